#!/usr/bin/env bash
# Tests the page with the dance stage in Chromium on its software graphics: frame 0 of the recorded desk is lit and looks as the
# native picture, so it does when all is switched to toon, and nothing is an error. Needs neither a display nor a graphics processor.
#
#   scripts/test_web.sh             tests if it can, otherwise says what is missing and passes
#   scripts/test_web.sh --require   fails where it cannot test
#
# Needs what scripts/web.sh needs, and Chromium, Node.js with npm and Python with Pillow (which compares pictures). Fetches
# playwright-core with npm. NATIVE, if set, is a folder with lit.png and toon.png that were drawn before. The last line is the verdict.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source scripts/runtime_folder.sh

readonly cache=${XDG_CACHE_HOME:-$HOME/.cache}
readonly work=${MIRRORBALL_WEB_TARGET_DIR:-$cache/mirrorball-web-target}/page-test
# Largest mean difference of a picture from the native one, of 255: rasterizers differ along edges.
readonly max_difference=2

is_required=''
[ "${1:-}" != --require ] || is_required=yes

# Ends the script where something is missing.
lack() {
    echo "web: not tested, because $1"
    [ -z "$is_required" ]
    exit
}

chromium=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)}
[ -n "$chromium" ] || lack "there is no Chromium; on Debian: apt-get install chromium"
for program in node npm python3; do
    command -v "$program" >/dev/null || lack "there is no $program; on Debian: apt-get install nodejs npm python3"
done
python3 -c 'import PIL' 2>/dev/null || lack "Python has no Pillow; python3 -m pip install pillow"

log=$(scripts/web.sh --no-serve) || lack "the page could not be built: $log"
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

# Beside the tests' copy, where Node.js looks for it.
cp scripts/test_web.mjs "$work/"
[ -d "$work/node_modules/playwright-core" ] || npm install --silent --no-save --prefix "$work" playwright-core@1.65
status=0
PAGE=$page OUT=$work CHROMIUM=$chromium node "$work/test_web.mjs" || status=$?

for picture in lit toon; do
    python3 - "$work/$picture.png" "$native/$picture.png" "$max_difference" <<'PYTHON' || status=1
import sys
from PIL import Image, ImageChops, ImageStat

try:
    page, native = (Image.open(path).convert("RGB") for path in sys.argv[1:3])
except OSError as error:
    sys.exit(f"FAIL {error}")
if page.size != native.size:
    sys.exit(f"FAIL {sys.argv[1]} has {page.size} pixels, the native picture {native.size}")
mean = sum(ImageStat.Stat(ImageChops.difference(page, native)).mean) / 3
text = f"{sys.argv[1]} differs from the native picture by {mean:.2f} of 255 in the mean"
sys.exit(f"FAIL {text}, more than {sys.argv[3]}" if mean > float(sys.argv[3]) else print("ok  ", text))
PYTHON
done
if [ "$status" -eq 0 ]; then echo "web: passed"; else echo "web: failed"; fi
exit "$status"
