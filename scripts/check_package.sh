#!/usr/bin/env bash
# Checks what `cargo publish` would send: its size, and that library and examples compile from nothing but its files. Shares the
# target folder, and with it the compiled dependencies, with all other builds.
#
#   scripts/check_package.sh [--locked]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# The registry takes up to 10 MiB; half of that keeps builds of games quick.
readonly max_bytes=5000000

source scripts/install_packages.sh
require_cargo
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
# names what is being compiled, and is another package here
unset CARGO_MANIFEST_DIR

cargo package --quiet --no-verify --allow-dirty "$@"
package=$(cargo pkgid | sed 's/.*#\(.*@\)\{0,1\}//')
name=bevy_mirrorball-$package
archive=$CARGO_TARGET_DIR/package/$name.crate
bytes=$(wc -c <"$archive")
echo "package: $name.crate has $bytes bytes in $(tar -tzf "$archive" | wc -l) files"
if [ "$bytes" -gt "$max_bytes" ]; then
    echo "package: more than $max_bytes bytes; the largest files are:" >&2
    tar -tvzf "$archive" | sort -k3 -n -r | head -5 >&2
    exit 1
fi

# Always the same folder, so that results of earlier runs are replaced and do not pile up. Files in a package are all of one time
# long ago, at which cargo would take them for unchanged.
folder=$CARGO_TARGET_DIR/package_check
rm -rf "$folder"
mkdir -p "$folder"
tar -xzmf "$archive" -C "$folder"
cd "$folder/$name"
for file in README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE assets/desk/photo.jpg assets/markers/tag36h11-0.svg; do
    if [ ! -f "$file" ]; then
        echo "package: $file is missing" >&2
        exit 1
    fi
done
cargo check --quiet "$@" --features egui,webcam,locus,audio,gamepad --lib --examples
echo "package: library and examples compile"
