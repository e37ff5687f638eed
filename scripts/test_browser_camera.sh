#!/usr/bin/env bash
# Tests the browser's camera (src/camera/browser) in Chromium with its fake camera: pixels against the files of the desk clip, order,
# rate, dropped frames, every state, locks, turned phones. Two minutes; needs neither a display nor a graphics processor.
#
#   scripts/test_browser_camera.sh             all tests, if it can; otherwise says what is missing and passes
#   scripts/test_browser_camera.sh refused     only those with this in their names
#   scripts/test_browser_camera.sh --require   fails where it cannot test
#
# Installs what is missing: Chromium, Node.js with npm and ffmpeg with apt-get, as root or with sudo, what scripts/web_tools.sh has, and
# playwright-core with npm.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

source scripts/install_packages.sh
source scripts/web_tools.sh

export CARGO_TARGET_DIR=${MIRRORBALL_WEB_TARGET_DIR:-$web_cache/mirrorball-web-target}
readonly work=$CARGO_TARGET_DIR/browser_camera
readonly crate=scripts/browser_camera

is_required='' filter=''
for argument in "$@"; do
    case $argument in
    --require) is_required=yes ;;
    -*)
        echo "unknown option $argument; see the head of $0" >&2
        exit 1
        ;;
    *) filter=$argument ;;
    esac
done

# Ends the script where something is missing.
lack() {
    echo "browser camera: not tested, because $1"
    [ -z "$is_required" ]
    exit
}

install_packages browser || true
chromium=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)}
[ -n "$chromium" ] || lack "there is no Chromium; on Debian: apt-get install chromium"
for program in node npm ffmpeg; do
    command -v "$program" >/dev/null || lack "there is no $program; on Debian: apt-get install nodejs npm ffmpeg"
done
install_web_tools || lack "there is nothing to build the page with"

mkdir -p "$work/pages"
cp Cargo.lock "$crate/Cargo.lock"
cargo build --quiet --release --manifest-path "$crate/Cargo.toml" --target "$web_target"
wasm-bindgen --target web --out-dir "$work/pages/pkg" "$CARGO_TARGET_DIR/$web_target/release/browser_camera.wasm"
cp "$crate/page.html" "$work/pages/"

# What JPEG files have in full range, cameras and .y4m have in the limited one.
ffmpeg -v error -y -framerate 15 -i assets/desk_clip/frame_%03d.jpg -pix_fmt yuv420p \
    -vf scale=in_range=full:out_range=tv:in_color_matrix=bt601:out_color_matrix=bt601 "$work/desk.y4m"

# Beside the tests' copy, where Node.js looks for it.
cp "$crate/test_camera.mjs" "$work/"
[ -d "$work/node_modules/playwright-core" ] || npm install --silent --no-save --prefix "$work" playwright-core@1.65
PAGES=$work/pages CLIP=$PWD/assets/desk_clip VIDEO=$work/desk.y4m CHROMIUM=$chromium node "$work/test_camera.mjs" "$filter"
