#!/usr/bin/env bash
# Builds the page with the dance stage and serves it on this machine. The folder that it makes works unchanged on any web server with
# HTTPS (browsers give WebGPU and cameras to no other pages, but for those on localhost).
#
#   scripts/web.sh              builds, serves on http://localhost:8000
#   scripts/web.sh --release    small: optimized, without names (the first time builds all of Bevy anew), and says how large it is
#   scripts/web.sh --lan        serves on the local network too, over HTTPS: browsers give phones a camera in no other way
#   scripts/web.sh --no-serve   builds only, and prints the folder as its last line
#   PORT=8080 scripts/web.sh    another port
#
# Installs what is missing: the target wasm32-unknown-unknown with rustup, and wasm-bindgen of the version in Cargo.lock with cargo, into
# the user's cache; with --release binaryen with apt-get. Needs Python to serve, and OpenSSL with --lan. See docs/WEB.md.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

source scripts/install_packages.sh
source scripts/web_tools.sh

export CARGO_TARGET_DIR=${MIRRORBALL_WEB_TARGET_DIR:-$web_cache/mirrorball-web-target}

profile=dev is_serving=yes serving=()
for argument in "$@"; do
    case $argument in
    --release) profile=web ;;
    --lan) serving+=(--lan) ;;
    --no-serve) is_serving='' ;;
    *)
        echo "unknown option $argument; see the head of $0" >&2
        exit 1
        ;;
    esac
done

install_web_tools
[ "$profile" = dev ] || require_optimizer
echo "web: building (the first time takes about ten minutes on two cores, Bevy is large)"
cargo build --quiet --locked --profile "$profile" --target "$web_target" --no-default-features --features egui,locus,webgpu \
    --example dance_stage
folder=$CARGO_TARGET_DIR/page-$profile
mkdir -p "$folder/assets/models"
wasm-bindgen --target web --no-typescript --out-dir "$folder" \
    "$CARGO_TARGET_DIR/$web_target/${profile/#dev/debug}/examples/dance_stage.wasm"
program=$folder/dance_stage_bg.wasm
rm -f "$folder"/*.gz
[ "$profile" = dev ] || optimize "$program"
cp examples/dance_stage/web/page.js "$folder/"
# For the progress bar.
sed "s/<html /&data-size=\"$(stat -c %s "$program")\" /" examples/dance_stage/web/index.html >"$folder/index.html"
# What the stage loads, and what the page refers to.
cp -r assets/desk assets/desk_clip assets/markers assets/scenes "$folder/assets/"
cp assets/models/dancer.glb "$folder/assets/models/"
if [ "$profile" != dev ]; then
    gzip --best --keep --force "$program" "$folder/dance_stage.js"
    megabytes() { awk "BEGIN { printf \"%.1f MB\", $(stat -c %s "$1") / 1e6 }"; }
    echo "web: the program is $(megabytes "$program"), compressed $(megabytes "$program.gz")"
fi

if [ -z "$is_serving" ]; then
    echo "$folder"
    exit
fi
port=${PORT:-8000}
if ! command -v python3 >/dev/null; then
    echo "web: there is no python3 to serve $folder with; any other server does" >&2
    exit 1
fi
exec python3 scripts/serve_page.py "$folder" "$port" "${serving[@]+"${serving[@]}"}"
