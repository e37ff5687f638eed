#!/usr/bin/env bash
# Installs what compiling and testing on a machine without a GPU needs, or says what is missing and how to get it.
# Run it, or source it and call install_packages.

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

# Whether any Vulkan driver is installed. macOS needs none: wgpu draws with Metal there.
any_graphics_driver() {
    [ "$(uname -s)" = Darwin ] && return 0
    local folder
    for folder in /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d; do
        compgen -G "$folder/*.json" >/dev/null && return 0
    done
    [ -n "${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}" ]
}

# Whether the Vulkan loader is installed.
vulkan_loader() {
    # ldconfig is not always on a user's PATH; with -q, grep would end first and break the pipe under pipefail
    PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null | grep 'libvulkan\.so\.1' >/dev/null
}

# Prints the Debian packages that are missing, one a line. Looks for the things themselves, so that a compiler from
# elsewhere counts.
missing_packages() {
    # the AprilTag library is compiled from C
    if ! command -v cc >/dev/null; then echo gcc libc6-dev | tr ' ' '\n'; fi
    # build scripts look for system libraries with it
    if ! command -v pkg-config >/dev/null; then echo pkg-config; fi
    if ! vulkan_loader; then echo libvulkan1; fi
    # lavapipe, the software Vulkan driver
    if ! software_vulkan >/dev/null; then echo mesa-vulkan-drivers; fi
}

# For systems that this script does not install on.
say_what_is_needed() {
    echo "Needed: a C compiler, pkg-config, the Vulkan loader and Mesa's software Vulkan driver (lavapipe)."
    if [ "$(uname -s)" = Darwin ]; then
        echo "  macOS:  xcode-select --install    (graphics come with the system)"
    elif command -v dnf >/dev/null; then
        echo "  Fedora: sudo dnf install gcc pkgconf-pkg-config vulkan-loader mesa-vulkan-drivers"
    elif command -v pacman >/dev/null; then
        echo "  Arch:   sudo pacman -S --needed gcc pkgconf vulkan-icd-loader vulkan-swrast"
    elif command -v apt-get >/dev/null; then
        echo "  Debian, Ubuntu: apt-get install gcc libc6-dev pkg-config libvulkan1 mesa-vulkan-drivers    (as root)"
    fi
}

# Makes compiling and drawing possible. Fails, after saying why, if one of them is not.
install_packages() {
    local as_root=() missing
    if [ "$(uname -s)" = Linux ] && command -v apt-get >/dev/null; then
        mapfile -t missing < <(missing_packages)
        if [ "${#missing[@]}" -eq 0 ]; then
            echo "packages: nothing is missing"
            return 0
        fi
        if [ "$(id -u)" -ne 0 ] && command -v sudo >/dev/null; then as_root=(sudo); fi
        if [ "$(id -u)" -eq 0 ] || [ "${#as_root[@]}" -gt 0 ]; then
            echo "packages: installing ${missing[*]} with apt-get"
            if "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq &&
                "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
                    "${missing[@]}"; then
                return 0
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
    install_packages
fi
