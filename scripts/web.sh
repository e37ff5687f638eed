#!/usr/bin/env bash
# Builds the page with the dance stage and serves it on this machine. The folder that it makes works unchanged on any web server with
# HTTPS (browsers give WebGPU and cameras to no other pages, but for those on localhost).
#
#   scripts/web.sh              builds, serves on http://localhost:8000
#   scripts/web.sh --release    optimized and smaller (the first time builds all of Bevy anew)
#   scripts/web.sh --no-serve   builds only, and prints the folder as its last line
#   PORT=8080 scripts/web.sh    another port
#
# Installs what is missing: the target wasm32-unknown-unknown with rustup, and wasm-bindgen of the version in Cargo.lock with cargo, into
# the user's cache. Needs Python to serve. See docs/WEB.md.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

source scripts/web_tools.sh

export CARGO_TARGET_DIR=${MIRRORBALL_WEB_TARGET_DIR:-$web_cache/mirrorball-web-target}

profile=dev is_serving=yes
for argument in "$@"; do
    case $argument in
    --release) profile=web ;;
    --no-serve) is_serving='' ;;
    *)
        echo "unknown option $argument; see the head of $0" >&2
        exit 1
        ;;
    esac
done

install_web_tools
echo "web: building (the first time takes about ten minutes on two cores, Bevy is large)"
cargo build --quiet --locked --profile "$profile" --target "$web_target" --no-default-features --features egui,locus,webgpu \
    --example dance_stage
folder=$CARGO_TARGET_DIR/page-$profile
mkdir -p "$folder/assets/models"
wasm-bindgen --target web --no-typescript --out-dir "$folder" \
    "$CARGO_TARGET_DIR/$web_target/${profile/#dev/debug}/examples/dance_stage.wasm"
cp examples/dance_stage/web/index.html examples/dance_stage/web/page.js "$folder/"
# What the stage loads, and what the page refers to.
cp -r assets/desk assets/desk_clip assets/markers assets/scenes "$folder/assets/"
cp assets/models/dancer.glb "$folder/assets/models/"

if [ -z "$is_serving" ]; then
    echo "$folder"
    exit
fi
port=${PORT:-8000}
if ! command -v python3 >/dev/null; then
    echo "web: there is no python3 to serve $folder with; any other server does" >&2
    exit 1
fi
echo "web: http://localhost:$port (the folder is $folder; Ctrl+C ends)"
exec python3 -m http.server --bind 127.0.0.1 --directory "$folder" "$port"
