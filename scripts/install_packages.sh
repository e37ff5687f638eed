#!/usr/bin/env bash
# Installs what compiling and testing on a machine without a GPU needs, or says what is missing and how to get it.
# Run it, or source it and call install_packages. Arguments ask for more:
#   webcam    building the feature `webcam`
#   window    opening windows, where there is a display
#   audio     building the feature `audio`
#   gamepad   building the feature `gamepad`
#   browser   testing pages in Chromium
#   optimizer making programs for browsers small

# Prints the driver file of lavapipe, Mesa's software Vulkan. Fails if there is none.
software_vulkan() {
    local folder file
    for folder in /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d; do
        for file in "$folder"/lvp_icd*.json; do
            if [ -f "$file" ]; then
                echo "$file"
                return 0
            fi
        done
    done
    return 1
}

# Prints the driver file of SwiftShader, the software Vulkan that Chromium falls back to. Its library comes with a Debian package
# of Chromium, which is unpacked into the user's cache and not installed.
fetch_swiftshader() {
    local folder=${XDG_CACHE_HOME:-$HOME/.cache}/mirrorball-swiftshader
    local driver=$folder/usr/lib/chromium/vk_swiftshader_icd.json
    if [ ! -f "$driver" ]; then
        if ! command -v apt-get >/dev/null || ! command -v dpkg-deb >/dev/null; then
            echo "swiftshader: only fetched on Debian and its kin; give its vk_swiftshader_icd.json as --driver" >&2
            return 1
        fi
        mkdir -p "$folder"
        # the list of packages may be older than the package
        if ! (cd "$folder" && apt-get download -qq chromium-common >&2); then
            if [ "$(id -u)" -eq 0 ]; then apt-get update -qq >&2; fi
            if ! (cd "$folder" && apt-get download -qq chromium-common >&2); then
                echo "swiftshader: apt-get could not download chromium-common; run apt-get update as root" >&2
                return 1
            fi
        fi
        dpkg-deb -x "$folder"/chromium-common_*.deb "$folder"
        echo "swiftshader: unpacked from $(cd "$folder" && ls chromium-common_*.deb)" >&2
        rm "$folder"/chromium-common_*.deb
    fi
    echo "$driver"
}

# Whether any Vulkan driver is installed. macOS needs none: wgpu draws with Metal there.
any_graphics_driver() {
    [ "$(uname -s)" = Darwin ] && return 0
    local folder
    for folder in /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d; do
        compgen -G "$folder/*.json" >/dev/null && return 0
    done
    [ -n "${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}" ]
}

# Whether a shared library is installed.
has_library() {
    # ldconfig is not always on a user's PATH; with -q, grep would end first and break the pipe under pipefail
    PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null | grep "$1" >/dev/null
}

# Whether libclang is installed. It has a version in its name and need not be where the loader looks. Compilers come with
# libclang-cpp, which is another library and does not help.
has_libclang() {
    [ -n "${LIBCLANG_PATH:-}" ] || has_library 'libclang\(-[0-9][-.0-9]*\)\?\.so' ||
        compgen -G "/usr/lib/llvm-*/lib/libclang.so*" >/dev/null ||
        compgen -G "/usr/lib/llvm-*/lib/libclang-[0-9]*.so*" >/dev/null
}

# Debian and Ubuntu name the package after its version; prints the newest there is.
libclang_package() {
    apt-cache search --names-only '^libclang1-[0-9]+$' | cut -d' ' -f1 | sort -t- -k2 -n | tail -n 1
}

# Prints the Debian packages that are missing, one a line. Looks for the things themselves, so that a compiler from
# elsewhere counts.
missing_packages() {
    # the AprilTag library is compiled from C
    if ! command -v cc >/dev/null; then echo gcc libc6-dev | tr ' ' '\n'; fi
    # build scripts look for system libraries with it
    if ! command -v pkg-config >/dev/null; then echo pkg-config; fi
    if ! has_library 'libvulkan\.so\.1'; then echo libvulkan1; fi
    # lavapipe, the software Vulkan driver
    if ! software_vulkan >/dev/null; then echo mesa-vulkan-drivers; fi
    local wish
    for wish in "$@"; do
        case $wish in
        # the camera's system header is read with it
        webcam) if ! has_libclang; then echo libclang1; fi ;;
        # Bevy's sound is built on ALSA
        audio) if ! pkg-config --exists alsa 2>/dev/null; then echo libasound2-dev; fi ;;
        # gamepads are found with it
        gamepad) if ! pkg-config --exists libudev 2>/dev/null; then echo libudev-dev; fi ;;
        # the browser, what drives it, and what makes its fake camera's film
        browser)
            if ! command -v chromium >/dev/null && ! command -v google-chrome >/dev/null; then echo chromium; fi
            if ! command -v node >/dev/null; then echo nodejs; fi
            if ! command -v npm >/dev/null; then echo npm; fi
            if ! command -v ffmpeg >/dev/null; then echo ffmpeg; fi
            ;;
        optimizer) if ! command -v wasm-opt >/dev/null; then echo binaryen; fi ;;
        # loaded by name when a window is opened; a desktop has them
        window)
            if [ -z "${DISPLAY:-}" ]; then continue; fi
            if ! has_library 'libX11\.so\.6'; then echo libx11-6; fi
            if ! has_library 'libX11-xcb\.so\.1'; then echo libx11-xcb1; fi
            if ! has_library 'libXcursor\.so\.1'; then echo libxcursor1; fi
            if ! has_library 'libXi\.so\.6'; then echo libxi6; fi
            if ! has_library 'libxkbcommon-x11\.so\.0'; then echo libxkbcommon-x11-0; fi
            ;;
        esac
    done
}

# For systems that this script does not install on.
say_what_is_needed() {
    echo "Needed: a C compiler, pkg-config, the Vulkan loader and Mesa's software Vulkan driver (lavapipe); for webcams libclang, for sound ALSA, for gamepads libudev."
    if [ "$(uname -s)" = Darwin ]; then
        echo "  macOS:  xcode-select --install    (graphics come with the system)"
    elif command -v dnf >/dev/null; then
        echo "  Fedora: sudo dnf install gcc pkgconf-pkg-config vulkan-loader mesa-vulkan-drivers clang-libs alsa-lib-devel systemd-devel"
    elif command -v pacman >/dev/null; then
        echo "  Arch:   sudo pacman -S --needed gcc pkgconf vulkan-icd-loader vulkan-swrast clang alsa-lib systemd-libs"
    elif command -v apt-get >/dev/null; then
        echo "  Debian, Ubuntu: apt-get install gcc libc6-dev pkg-config libvulkan1 mesa-vulkan-drivers libclang-dev libasound2-dev libudev-dev    (as root)"
    fi
}

# Ends the script, after saying why, where there is no cargo. In the package's folder.
require_cargo() {
    command -v cargo >/dev/null && return 0
    echo "cargo is missing. Install Rust from https://rustup.rs or as your system's package, version" \
        "$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml) or later, and run this again." >&2
    exit 1
}

# Makes compiling and drawing possible, and what the arguments ask for. Fails, after saying why, if it is not.
install_packages() {
    local as_root=() missing
    if [ "$(uname -s)" = Linux ] && command -v apt-get >/dev/null; then
        mapfile -t missing < <(missing_packages "$@")
        if [ "${#missing[@]}" -eq 0 ]; then
            echo "packages: nothing is missing"
            return 0
        fi
        if [ "$(id -u)" -ne 0 ] && command -v sudo >/dev/null; then as_root=(sudo); fi
        if [ "$(id -u)" -eq 0 ] || [ "${#as_root[@]}" -gt 0 ]; then
            echo "packages: installing ${missing[*]} with apt-get"
            if "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq; then
                # its real name is known only now
                missing=("${missing[@]/#libclang1/$(libclang_package)}")
                if "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
                    "${missing[@]}"; then
                    return 0
                fi
            fi
            echo "packages: apt-get failed" >&2
        else
            echo "packages: missing ${missing[*]}, and neither root nor sudo to install them" >&2
        fi
    fi
    say_what_is_needed >&2
    if ! command -v cc >/dev/null; then
        echo "packages: there is no C compiler" >&2
        return 1
    fi
    if ! any_graphics_driver; then
        echo "packages: there is no Vulkan driver" >&2
        return 1
    fi
    echo "packages: going on with what is there"
}

if [ "${BASH_SOURCE[0]}" = "$0" ]; then
    set -euo pipefail
    install_packages "$@"
fi
