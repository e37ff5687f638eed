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
# Without a display there is nothing to hear or to play either. Elsewhere than on Linux both need nothing.
if [ "$(uname -s)" != Linux ] || [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; then wishes+=(audio gamepad); fi
install_packages "${wishes[@]}"
# Whether headers are there that something is built with; says what the game lacks without.
has_headers() {
    if [ "$(uname -s)" != Linux ] || pkg-config --exists "$1"; then return 0; fi
    echo "dance stage: without the headers of $1 the game has no $2"
    return 1
}
case " ${wishes[*]} " in
*" audio gamepad "*)
    if has_headers alsa sound; then features+=,audio; fi
    if has_headers libudev gamepads; then features+=,gamepad; fi
    ;;
esac

echo "dance stage: building (the first time takes about ten minutes on two cores, Bevy is large)"
cargo build --quiet --features "$features" --example dance_stage
target=${CARGO_TARGET_DIR:-target}
case $target in /*) ;; *) target=$package/$target ;; esac
cd "$here"
CARGO_MANIFEST_DIR=$package exec "$target/debug/examples/dance_stage" "$@"
