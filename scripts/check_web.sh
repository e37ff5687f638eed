#!/usr/bin/env bash
# Type-checks the library for browsers (wasm32-unknown-unknown), without default features: the AprilTag C library and webcams are not
# for the web. Says why it checks nothing where no toolchain is installed that can do it; see docs/WEB.md.
#
#   scripts/check_web.sh             checks if it can, otherwise says what is missing and passes
#   scripts/check_web.sh --install   installs the target with rustup first, or on Debian unpacks a compiler into the user's cache
#   scripts/check_web.sh --require   fails where it cannot check
#
# The first run checks all of Bevy for this target, later ones only what changed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

source scripts/web_tools.sh

# Debian's compiler for the web has no rustup and conflicts with its packages. Unpacked, it shadows nothing.
readonly unpacked=$web_cache/mirrorball-web-toolchain
readonly packages=(rustc-web cargo-web rust-web-src)
# Other flags and another compiler than usual: a folder of its own keeps the usual build as it is.
export CARGO_TARGET_DIR=${MIRRORBALL_WEB_TARGET_DIR:-$web_cache/mirrorball-web-target}
export CARGO_INCREMENTAL=0

is_required='' is_installing=''
for argument in "$@"; do
    case $argument in
    --install) is_installing=yes ;;
    --require) is_required=yes ;;
    *)
        echo "unknown option $argument; see the head of $0" >&2
        exit 1
        ;;
    esac
done

# Whether Debian's compiler was unpacked.
has_unpacked() { [ -x "$unpacked/usr/bin/rustc" ] && [ -x "$unpacked/usr/bin/cargo" ]; }

# Unpacks Debian's compiler, of which the web browsers of stable Debian are built, and the sources of its standard library.
unpack_toolchain() {
    if ! command -v apt-get >/dev/null || ! command -v dpkg-deb >/dev/null; then
        echo "web: there is neither rustup nor Debian's apt-get to install a compiler with" >&2
        return 1
    fi
    # with the libraries that are missing here
    local needed
    mapfile -t needed < <(apt-get install --simulate --no-install-recommends "${packages[@]}" | sed -n 's/^Inst \([^ ]*\) .*/\1/p')
    if [ "${#needed[@]}" -eq 0 ]; then
        echo "web: apt-get knows no rustc-web; run apt-get update as root, or install Rust from https://rustup.rs" >&2
        return 1
    fi
    rm -rf "$unpacked"
    mkdir -p "$unpacked"
    (
        cd "$unpacked"
        apt-get download -qq "${needed[@]}" >&2
        for package in ./*.deb; do dpkg-deb -x "$package" .; done
        rm ./*.deb
    )
    echo "web: unpacked rustc-web into $unpacked"
}

if [ -n "$is_installing" ] && ! has_web_target && ! has_unpacked; then
    if command -v rustup >/dev/null; then
        echo "web: rustup target add $web_target"
        rustup target add "$web_target"
    else
        unpack_toolchain
    fi
fi

arguments=(check --locked --lib --no-default-features --target "$web_target")
if has_web_target; then
    echo "web: $(rustc --version), with its standard library for $web_target"
    cargo "${arguments[@]}"
elif has_unpacked; then
    export PATH="$unpacked/usr/bin:$PATH"
    export LD_LIBRARY_PATH="$unpacked/usr/lib/x86_64-linux-gnu:$unpacked/usr/lib/llvm-19/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
    export RUSTC="$unpacked/usr/bin/rustc"
    unset RUSTUP_TOOLCHAIN
    echo "web: $(rustc --version) of Debian, with its standard library built from source"
    # It has no standard library for the target; building that is not stable yet. Warnings of a newer compiler are not ours.
    RUSTC_BOOTSTRAP=1 cargo "${arguments[@]}" -Z build-std=std,panic_abort
else
    echo "web: not checked, because no compiler here has the target $web_target; scripts/check_web.sh --install gets one"
    [ -z "$is_required" ]
    exit
fi
echo "web: checked"
