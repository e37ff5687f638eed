#!/usr/bin/env bash
# Tests the page with the dance stage in Chromium on its software graphics: frame 0 of the recorded desk is lit and looks as the
# native picture, so it does when all is switched to toon; the browser's fake camera, which sees the desk, is tracked; and nothing is
# an error. Needs neither a display nor a graphics processor.
#
#   scripts/test_web.sh             tests if it can, otherwise says what is missing and passes
#   scripts/test_web.sh --require   fails where it cannot test
#   scripts/test_web.sh --release   tests the small program instead, and how much is sent
#
# Installs what is missing with apt-get, as root or with sudo: Chromium, Node.js with npm, ffmpeg; and playwright-core with npm. NATIVE,
# if set, is a folder with lit.png and toon.png that were drawn before. The last line is the verdict.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/runtime_folder.sh
source scripts/install_packages.sh

readonly work=${MIRRORBALL_WEB_TARGET_DIR:-${XDG_CACHE_HOME:-$HOME/.cache}/mirrorball-web-target}/page-test

is_required='' profile=()
for argument in "$@"; do
    case $argument in
    --require) is_required=yes ;;
    --release) profile=(--release) ;;
    *)
        echo "unknown option $argument; see the head of $0" >&2
        exit 1
        ;;
    esac
done

# Ends the script where something is missing.
lack() {
    echo "web: not tested, because $1"
    [ -z "$is_required" ]
    exit
}

install_packages browser || true
chromium=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)}
[ -n "$chromium" ] || lack "there is no Chromium; on Debian: apt-get install chromium"
for program in node npm ffmpeg; do
    command -v "$program" >/dev/null || lack "there is no $program; on Debian: apt-get install nodejs npm ffmpeg"
done

log=$(scripts/web.sh --no-serve "${profile[@]+"${profile[@]}"}") || lack "the page could not be built: $log"
page=$(tail -n 1 <<<"$log")
mkdir -p "$work"
native=${NATIVE:-$work/native}
if [ -z "${NATIVE:-}" ]; then
    mkdir -p "$native"
    for picture in lit toon; do
        styles=()
        [ "$picture" = lit ] || styles=(--toon all)
        scripts/run.sh --headless --frames 1 --out "$work/$picture" "${styles[@]+"${styles[@]}"}"
        cp "$work/$picture/frame_0000.png" "$native/$picture.png"
    done
fi

# What JPEG files have in full range, cameras and .y4m have in the limited one.
ffmpeg -v error -y -framerate 15 -i assets/desk_clip/frame_%03d.jpg -pix_fmt yuv420p \
    -vf scale=in_range=full:out_range=tv:in_color_matrix=bt601:out_color_matrix=bt601 "$work/desk.y4m"

# Beside the tests' copy, where Node.js looks for it.
cp scripts/test_web.mjs "$work/"
[ -d "$work/node_modules/playwright-core" ] || npm install --silent --no-save --prefix "$work" playwright-core@1.65
status=0
PAGE=$page OUT=$work CHROMIUM=$chromium NATIVE=$native VIDEO=$work/desk.y4m node "$work/test_web.mjs" || status=$?

if [ "$status" -eq 0 ]; then echo "web: passed"; else echo "web: failed"; fi
exit "$status"
