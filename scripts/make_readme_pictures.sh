#!/usr/bin/env bash
# Makes all pictures of the README anew, on software Vulkan: assets/pictures/*, and assets/desk/two_markers.jpg for the
# example of that name. Needs ffmpeg; for the picture of the panel, which only a window has, also Xvfb, a display without a screen.
#
#   scripts/make_readme_pictures.sh              all of them, ten minutes on two cores after the build
#   scripts/make_readme_pictures.sh toon panel   only these
#
# VK_DRIVER_FILES, if set, names the Vulkan driver to use instead of lavapipe.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly all=(two_markers dance_stage panel minimal toon no_ball real_light_events composite real_lights eight_cases
    live_environment shadow_lab shadow_methods looks places)
# Width of pictures in the gallery; quality of JPEGs in ffmpeg's scale, on which 2 is best.
readonly width=640 quality=4
# The moving picture: one round of the recorded desk, on which the game plays itself.
readonly moving_size=480x270 moving_frames=60 moving_rate=15

for tool in ffmpeg python3; do
    if ! command -v "$tool" >/dev/null; then
        echo "pictures: $tool is missing; on Debian and Ubuntu: apt-get install $tool" >&2
        exit 1
    fi
done
source scripts/install_packages.sh
source scripts/runtime_folder.sh
require_cargo
install_packages webcam
if [ -z "${VK_DRIVER_FILES:-}" ]; then
    VK_DRIVER_FILES=$(software_vulkan)
fi
export VK_DRIVER_FILES VK_ICD_FILENAMES="$VK_DRIVER_FILES" CARGO_MANIFEST_DIR=$PWD
if [ "$(uname -s)" = Linux ]; then export WGPU_BACKEND=vulkan; fi

echo "pictures: building the examples"
cargo build --quiet --features egui,webcam --examples
target=${CARGO_TARGET_DIR:-target}
examples=$target/debug/examples
pictures=assets/pictures
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Runs an example without a window.
draw() {
    local name=$1
    shift
    env -u DISPLAY -u WAYLAND_DISPLAY "$examples/$name" "$@"
}

# Writes a picture as a JPEG no wider than the gallery, and without notes about the machine.
to_jpeg() {
    ffmpeg -loglevel error -y -i "$1" -vf "scale='min($width,iw)':-1:flags=area" -bitexact -map_metadata -1 \
        -q:v "${3:-$quality}" "$pictures/$2.jpg"
}

# A small example, which writes one frame.
small() {
    draw "$1" --headless --out "$work/$1.png" "${@:2}"
    to_jpeg "$work/$1.png" "$1"
}

make_two_markers() {
    python3 scripts/make_two_markers.py "$examples" "$work"
}

make_dance_stage() {
    draw dance_stage --headless --frames $moving_frames --size $moving_size --demo --toon "dancer,mirror ball" --out "$work/dance"
    # an animated WebP: a tenth of a GIF's size, and without its 256 colors
    ffmpeg -loglevel error -y -framerate $moving_rate -i "$work/dance/frame_%04d.png" -c:v libwebp_anim -quality 70 \
        -compression_level 4 -loop 0 "$pictures/dance_stage.webp"
}

make_panel() {
    if ! command -v Xvfb >/dev/null; then
        echo "pictures: no Xvfb, so assets/pictures/dance_stage.jpg stays as it is" >&2
        return 0
    fi
    local server program number=97
    Xvfb ":$number" -screen 0 1100x500x24 >/dev/null 2>&1 &
    server=$!
    sleep 2
    DISPLAY=":$number" "$examples/dance_stage" --toon "dancer,mirror ball" >/dev/null 2>&1 &
    program=$!
    # until shaders are compiled and the light is measured
    sleep "${PANEL_SECONDS:-60}"
    ffmpeg -loglevel error -y -f x11grab -draw_mouse 0 -video_size 1010x480 -i ":$number" -frames:v 1 "$work/panel.png"
    kill "$program" "$server"
    wait "$program" "$server" 2>/dev/null || true
    # the panel's text needs a better quality
    ffmpeg -loglevel error -y -i "$work/panel.png" -bitexact -map_metadata -1 -q:v 5 "$pictures/dance_stage.jpg"
}

make_minimal() { small minimal; }
make_toon() { small toon --press KeyT; }
make_no_ball() { small no_ball; }
make_real_light_events() { small real_light_events; }

make_composite() {
    draw composite --frame assets/desk/photo.jpg --intrinsics 601.83,601.83,320,240 --scene assets/desk/desk.glb \
        --out $pictures/composite.png
}

make_real_lights() {
    draw real_lights --picture 20 --out "$work/real_lights.png"
    to_jpeg "$work/real_lights.png" real_lights
}

make_eight_cases() {
    draw eight_cases --out "$work/eight_cases.png"
    to_jpeg "$work/eight_cases.png" eight_cases
}

make_live_environment() {
    draw live_environment --headless --frames 3 --out "$work/sky"
    to_jpeg "$work/sky/frame_0002.png" live_environment
}

# With times of this machine in it.
make_shadow_methods() {
    draw shadow_lab --gallery "$pictures/shadow_methods.png" --size 360x202
}

make_shadow_lab() {
    draw shadow_lab --headless --frames 1 --size 640x360 --out "$work/lab"
    to_jpeg "$work/lab/frame_0000.png" shadow_lab
}

# Wider than the others, because it has eighteen parts; drawn larger still, for smooth lines.
make_looks() {
    draw looks --headless --size 800x600 --out "$work/looks.png"
    ffmpeg -loglevel error -y -i "$work/looks.png" -vf scale=1440:-1:flags=area -c:v libwebp -quality 85 -compression_level 6 \
        "$pictures/looks.webp"
    draw looks --compare --size 960x720 --out "$work/ball_filters.png"
    to_jpeg "$work/ball_filters.png" ball_filters
}

make_places() {
    local place
    for place in stonehenge campus; do
        draw dance_stage --headless --place "$place" --demo --difficulty hard --frames 34 --size 640x360 --out "$work/$place"
        to_jpeg "$work/$place/frame_0033.png" "$place"
    done
}

mkdir -p $pictures
if [ $# -eq 0 ]; then set -- "${all[@]}"; fi
for picture in "$@"; do
    if ! declare -F "make_$picture" >/dev/null; then
        echo "pictures: there is no $picture; there are ${all[*]}" >&2
        exit 1
    fi
    "make_$picture"
done
ls -l $pictures assets/desk/two_markers.jpg
