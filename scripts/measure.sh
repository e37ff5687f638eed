#!/usr/bin/env bash
# Measures on whatever graphics device there is, and prints one table: device, milliseconds of each pass and megabytes of the
# composite of the shipped desk, its difference from the committed picture, and the ratios of both benchmarks to the engine.
#
#   scripts/measure.sh                       the system's own driver
#   scripts/measure.sh --driver FILE.json    the Vulkan driver that this file describes, or: swiftshader
#   scripts/measure.sh --quick               without the benchmarks, which take ten minutes on two cores
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

source scripts/install_packages.sh
source scripts/runtime_folder.sh
require_cargo
is_quick=
while [ $# -gt 0 ]; do
    case $1 in
    --quick) is_quick=yes ;;
    --driver)
        if [ $# -lt 2 ]; then
            echo "--driver needs a name: swiftshader, or a driver's .json file" >&2
            exit 1
        fi
        shift
        if [ "$1" = swiftshader ]; then VK_DRIVER_FILES=$(fetch_swiftshader); else VK_DRIVER_FILES=$1; fi
        export VK_DRIVER_FILES VK_ICD_FILENAMES="$VK_DRIVER_FILES"
        ;;
    *)
        echo "unknown option $1; see the head of $0" >&2
        exit 1
        ;;
    esac
    shift
done
install_packages

out=$(mktemp -d)
trap 'rm -r "$out"' EXIT
echo "measure: building" >&2
cargo build --quiet --example composite
composite() {
    cargo run --quiet --example composite -- --frame assets/desk/photo.jpg --intrinsics 601.83,601.83,320,240 \
        --scene assets/desk/desk.glb --out "$out/composite.png" --report "$out/report.json" "$@"
}
composite --compare assets/pictures/composite.png

# The report has one value a line.
value() { sed -n "s/^ *\"$1\": \(.*[^,]\),\{0,1\}$/\1/p" "$out/report.json" | tr -d '"'; }
block() { sed -n "/^  \"$1\": {/,/^  }/p" "$out/report.json" | sed '1d;$d' | tr -d '",'; }

echo
echo "| what | measured |"
echo "|---|---|"
echo "| commit, day | $(git rev-parse --short HEAD 2>/dev/null || echo unknown), $(date +%F) |"
echo "| device | $(value device) |"
block milliseconds_gpu | sed 's/^ *\(.*\): \([0-9.e-]*\)$/| \1, ms | \2 |/'
echo "| all passes of the crate together, ms | $(block milliseconds_gpu | awk '/mirrorball/ { sum += $2 } END { printf "%.2f", sum }') |"
echo "| all of the crate's memory there, MB | $(block device_bytes | awk '{ sum += $2 } END { printf "%.1f", sum / 1e6 }') |"
echo "| off from the committed picture, mean and largest of 255 | $(value mean), $(value largest) |"
echo "| pixels within 6/255 of it, % | $(value within_6_percent) |"
if [ -z "$is_quick" ]; then
    cargo bench --quiet --profile dev --bench environment -- --directions 0 --csv "$out/environment.csv" >&2
    cargo bench --quiet --profile dev --bench shadows -- --csv "$out/shadows.csv" >&2
    awk -F, 'NR > 1 && $6 != "" { printf "| filter, %s at %s²: ms, Bevy ms, Bevy ÷ ours | %s, %s, %s |\n", $1, $2, $4, $5, $6 }' \
        "$out/environment.csv"
    awk -F, 'NR > 1 { printf "| %s, %s, %s triangles, against %s: ms, theirs, ours ÷ theirs | %s, %s, %s |\n",
        $1, $2 == "" ? $13 : $13 " of " $2 " directions", $4, $9, $8, $10, $11 }' "$out/shadows.csv"
fi
