#!/usr/bin/env bash
# Runs all tests on software Vulkan, as CI does: no GPU and no window needed.
#
#   scripts/test.sh                       everything, examples compiled, documentation examples run
#   scripts/test.sh --test tracking       arguments go to cargo test: one of the folders of tests/,
#   scripts/test.sh --test shadows -- toon::   or those of its tests whose paths contain a name
#   scripts/test.sh --driver swiftshader  on SwiftShader, a second software Vulkan (fetched on Debian; slower), with
#                                         no more than WebGPU's default limits and features
#   scripts/test.sh --driver FILE.json    on the Vulkan driver that this file describes
#
# VK_DRIVER_FILES, if set, names the Vulkan driver to use instead of lavapipe.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
start=$SECONDS

source scripts/install_packages.sh
source scripts/runtime_folder.sh
require_cargo
arguments=() locked=()
while [ $# -gt 0 ]; do
    case $1 in
    --driver)
        if [ $# -lt 2 ]; then
            echo "--driver needs a name: swiftshader, or a driver's .json file" >&2
            exit 1
        fi
        chosen=$2
        shift 2
        ;;
    *)
        if [ "$1" = --locked ]; then locked=(--locked); fi
        arguments+=("$1")
        shift
        ;;
    esac
done
set -- "${arguments[@]+"${arguments[@]}"}"
install_packages webcam

case ${chosen:-} in
'') ;;
swiftshader)
    VK_DRIVER_FILES=$(fetch_swiftshader)
    # With what every WebGPU device can do, hence without arrays of textures, in which Bevy keeps the maps of light
    # probes natively: where a surface discards the first of four pixels, SwiftShader reads from an arbitrary address.
    export WGPU_SETTINGS_PRIO=webgpu
    ;;
*)
    if [ ! -f "$chosen" ]; then
        echo "--driver $chosen: there is no such file; give the .json file of a Vulkan driver, or swiftshader" >&2
        exit 1
    fi
    VK_DRIVER_FILES=$chosen
    ;;
esac

if [ -n "${VK_DRIVER_FILES:-}" ]; then
    echo "graphics: testing on $VK_DRIVER_FILES"
    export VK_DRIVER_FILES VK_ICD_FILENAMES="$VK_DRIVER_FILES"
elif driver=$(software_vulkan); then
    echo "graphics: software Vulkan, $driver"
    # the older name of the same setting is for loaders before 1.3.207
    export VK_DRIVER_FILES="$driver" VK_ICD_FILENAMES="$driver"
else
    echo "graphics: no software Vulkan found, testing on the system's own driver"
fi
# wgpu would fall back to OpenGL, which is another renderer than the one under test
if [ "$(uname -s)" = Linux ]; then export WGPU_BACKEND=vulkan; fi
# tests that draw fail without an adapter instead of being skipped
export MIRRORBALL_REQUIRE_GPU=1

# the driver's own words: name and version
cargo test --quiet --workspace --features egui,webcam,locus "${locked[@]+"${locked[@]}"}" \
    --test environment device::the_driver_is_named -- --nocapture |
    grep '^driver:' || echo "driver: unknown, the test that names it failed"

echo "tests: cargo test --workspace --features egui,webcam,locus --no-fail-fast $*"
status=0
cargo test --workspace --features egui,webcam,locus --no-fail-fast "$@" || status=$?
if [ "$status" -eq 0 ]; then outcome=passed; else outcome=failed; fi
echo "tests: $outcome after $((SECONDS - start)) s"
exit "$status"
