#!/usr/bin/env bash
# Tests the browser's camera (src/camera/browser) in Chromium with its fake camera: pixels against the files of the desk clip, order,
# rate, dropped frames, every state, locks, turned phones. Two minutes; needs neither a display nor a graphics processor.
#
#   scripts/test_browser_camera.sh             all tests, if it can; otherwise says what is missing and passes
#   scripts/test_browser_camera.sh refused     only those with this in their names
#   scripts/test_browser_camera.sh --require   fails where it cannot test
#
# Needs Chromium, Node.js with npm, ffmpeg, a compiler with the target wasm32-unknown-unknown (scripts/check_web.sh --install, by rustup)
# and wasm-bindgen of the version in Cargo.lock, which it says how to install. Fetches playwright-core with npm.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly target=wasm32-unknown-unknown
readonly cache=${XDG_CACHE_HOME:-$HOME/.cache}
export CARGO_TARGET_DIR=${MIRRORBALL_WEB_TARGET_DIR:-$cache/mirrorball-web-target}
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

version=$(sed -n '/^name = "wasm-bindgen"$/{n;s/version = "\(.*\)"/\1/p}' Cargo.lock)
PATH=$cache/mirrorball-web-tools/bin:$PATH
chromium=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)}
[ -n "$chromium" ] || lack "there is no Chromium; on Debian: apt-get install chromium"
for program in node npm ffmpeg; do
    command -v "$program" >/dev/null || lack "there is no $program; on Debian: apt-get install nodejs npm ffmpeg"
done
compgen -G "$(rustc --print sysroot 2>/dev/null)/lib/rustlib/$target/lib/libstd-*.rlib" >/dev/null ||
    lack "the compiler lacks the target; rustup target add $target"
[ "$(wasm-bindgen --version 2>/dev/null)" = "wasm-bindgen $version" ] ||
    lack "there is no wasm-bindgen $version; cargo install --root $cache/mirrorball-web-tools wasm-bindgen-cli --version $version"

mkdir -p "$work/pages"
cp Cargo.lock "$crate/Cargo.lock"
cargo build --quiet --release --manifest-path "$crate/Cargo.toml" --target "$target"
wasm-bindgen --target web --out-dir "$work/pages/pkg" "$CARGO_TARGET_DIR/$target/release/browser_camera.wasm"
cp "$crate/page.html" "$work/pages/"

# What JPEG files have in full range, cameras and .y4m have in the limited one.
ffmpeg -v error -y -framerate 15 -i assets/desk_clip/frame_%03d.jpg -pix_fmt yuv420p \
    -vf scale=in_range=full:out_range=tv:in_color_matrix=bt601:out_color_matrix=bt601 "$work/desk.y4m"

# Beside the tests' copy, where Node.js looks for it.
cp "$crate/test_camera.mjs" "$work/"
[ -d "$work/node_modules/playwright-core" ] || npm install --silent --no-save --prefix "$work" playwright-core@1.65
PAGES=$work/pages CLIP=$PWD/assets/desk_clip VIDEO=$work/desk.y4m CHROMIUM=$chromium node "$work/test_camera.mjs" "$filter"
