#!/usr/bin/env bash
# Runs all tests on software Vulkan, as CI does: no GPU and no window needed.
#
#   scripts/test.sh                       everything, examples compiled, documentation examples run
#   scripts/test.sh --test authoring      arguments go to cargo test
#
# VK_DRIVER_FILES, if set, names the Vulkan driver to use instead.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
start=$SECONDS

source scripts/install_packages.sh
require_cargo
install_packages webcam

if [ -n "${VK_DRIVER_FILES:-}" ]; then
    echo "graphics: VK_DRIVER_FILES is set, testing on $VK_DRIVER_FILES"
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

echo "tests: cargo test --workspace --features egui,webcam --no-fail-fast $*"
status=0
cargo test --workspace --features egui,webcam --no-fail-fast "$@" || status=$?
if [ "$status" -eq 0 ]; then outcome=passed; else outcome=failed; fi
echo "tests: $outcome after $((SECONDS - start)) s"
exit "$status"
