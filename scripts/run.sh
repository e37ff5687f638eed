#!/usr/bin/env bash
# Runs the dance game on a real desk, lit by the room. Installs what is missing first, and says so.
#
#   scripts/run.sh                            the recorded desk, in a window; drawn to files where there is no display
#   scripts/run.sh --feed device:0 --fov 60   your webcam (see the README for what it has to see)
#   scripts/run.sh --music song.ogg           your music
#   scripts/run.sh --help                     all options
#
# VK_DRIVER_FILES, if set, names the Vulkan driver to use.
set -euo pipefail
# Where the user is: paths in the arguments are relative to it.
here=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")/.."
package=$PWD

source scripts/install_packages.sh
source scripts/runtime_folder.sh
require_cargo
features=egui
wishes=(window)
for argument in "$@"; do
    case $argument in device:* | --feed=device:*) features+=,webcam wishes+=(webcam) ;; esac
done
# Without a display there is nothing to hear either. Elsewhere than on Linux sound needs nothing.
if [ "$(uname -s)" != Linux ] || [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; then wishes+=(audio); fi
install_packages "${wishes[@]}"
case " ${wishes[*]} " in
*" audio "*)
    if [ "$(uname -s)" != Linux ] || pkg-config --exists alsa; then
        features+=,audio
    else
        echo "dance stage: without the headers of ALSA the game is silent"
    fi
    ;;
esac

echo "dance stage: building (the first time takes about ten minutes on two cores, Bevy is large)"
cargo build --quiet --features "$features" --example dance_stage
target=${CARGO_TARGET_DIR:-target}
case $target in /*) ;; *) target=$package/$target ;; esac
cd "$here"
CARGO_MANIFEST_DIR=$package exec "$target/debug/examples/dance_stage" "$@"
