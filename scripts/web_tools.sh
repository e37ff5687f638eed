# What builds programs for browsers: the compiler's target and wasm-bindgen. Sourced by the scripts that do, in the package's folder.

readonly web_target=wasm32-unknown-unknown
readonly web_cache=${XDG_CACHE_HOME:-$HOME/.cache}
PATH=$web_cache/mirrorball-web-tools/bin:$PATH

# Whether the usual compiler has the standard library of the target.
has_web_target() {
    command -v cargo >/dev/null && command -v rustc >/dev/null &&
        compgen -G "$(rustc --print sysroot)/lib/rustlib/$web_target/lib/libstd-*.rlib" >/dev/null
}

# Installs what is missing: the target with rustup, and wasm-bindgen of the version in Cargo.lock with cargo, into the user's cache.
# Fails, after saying why, if it cannot.
install_web_tools() {
    if ! has_web_target; then
        if ! command -v rustup >/dev/null; then
            echo "web: the compiler lacks the target $web_target, and there is no rustup to add it; see https://rustup.rs" >&2
            return 1
        fi
        rustup target add "$web_target"
    fi
    local version
    version=$(sed -n '/^name = "wasm-bindgen"$/{n;s/version = "\(.*\)"/\1/p}' Cargo.lock)
    if [ "$(wasm-bindgen --version 2>/dev/null)" != "wasm-bindgen $version" ]; then
        echo "web: installing wasm-bindgen $version"
        CARGO_TARGET_DIR=$web_cache/mirrorball-web-tools/target cargo install --quiet --root "$web_cache/mirrorball-web-tools" \
            wasm-bindgen-cli --version "$version"
    fi
}

# Installs binaryen, if it is missing. Fails, after saying why, if it cannot. Needs install_packages.sh.
require_optimizer() {
    install_packages optimizer || true
    if ! command -v wasm-opt >/dev/null; then
        echo "web: there is no wasm-opt to make the program small with; on Debian: apt-get install binaryen" >&2
        return 1
    fi
}

# Makes a program smaller, in place, without the names of its functions.
optimize() {
    echo "web: optimizing (three minutes on two cores)"
    # what the compiler uses of what browsers with WebGPU have
    wasm-opt -Oz --strip-debug --enable-bulk-memory --enable-mutable-globals --enable-multivalue \
        --enable-nontrapping-float-to-int --enable-reference-types --enable-sign-ext "$1" -o "$1.optimized"
    mv "$1.optimized" "$1"
}
