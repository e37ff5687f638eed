#!/usr/bin/env bash
# Makes the machine of scripts/test_webcam.sh in a folder: vmlinux, and base.cpio.gz with busybox, the camera drivers and
# init. Does nothing that was done before.
#
#   scripts/webcam_vm/prepare.sh FOLDER
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "$1"

as_root=()
if [ "$(id -u)" -ne 0 ]; then as_root=(sudo); fi
missing=()
need() { command -v "$1" >/dev/null || missing+=("$2"); }
need qemu-system-x86_64 qemu-system-x86
need cpio cpio
need modprobe kmod
need xz xz-utils
need cc gcc
# The one in the machine has no shared libraries.
if ! [ -x /bin/busybox ] || ldd /bin/busybox >/dev/null 2>&1; then missing+=(busybox-static); fi
# Needed to compile v4l's bindings.
if ! compgen -G '/usr/lib/*/libclang*.so*' >/dev/null && ! compgen -G '/usr/lib/llvm*/lib/libclang*.so*' >/dev/null; then
    missing+=(libclang1)
fi
if [ "${#missing[@]}" -gt 0 ]; then
    echo "packages: installing ${missing[*]} with apt-get"
    "${as_root[@]}" apt-get update -qq
    # Rather fails than removes what is there, such as a newer QEMU's tools.
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends --no-remove "${missing[@]}"
fi

if ! [ -d kernel/boot ]; then
    # The kernels for clouds have no vivid.
    package=$(apt-cache depends linux-image-amd64 linux-image-generic 2>/dev/null |
        sed -n 's/.*Depends: \(linux-image-[0-9].*\)/\1/p' | head -n 1)
    echo "kernel: fetching $package"
    apt-get -o APT::Sandbox::User="$(id -un)" download -qq "$package"
    rm -rf kernel.new && mkdir kernel.new
    dpkg-deb --fsys-tarfile "$package"_*.deb | tar -x -C kernel.new --wildcards './boot/vmlinuz-*' \
        './lib/modules/*/modules.*' './lib/modules/*/kernel/drivers/media/*' './lib/modules/*/kernel/drivers/usb/*' \
        './lib/modules/*/kernel/drivers/base/*' './lib/modules/*/kernel/sound/*' './lib/modules/*/kernel/drivers/input/*'
    mv kernel.new kernel
    rm -f "$package"_*.deb
fi
version=$(basename kernel/lib/modules/*)

if ! [ -f vmlinux ]; then
    # The kernel itself, from its self-extracting archive: QEMU boots it at once, and emulated unpacking takes seconds.
    image=kernel/boot/vmlinuz-$version
    offset=$(LC_ALL=C grep -abom 1 -P '\xfd7zXZ\x00' "$image" | cut -d: -f1)
    xz -dc --single-stream >vmlinux.new < <(tail -c "+$((offset + 1))" "$image")
    mv vmlinux.new vmlinux
fi

if ! [ base.cpio.gz -nt "$here/init" ]; then
    [ -f "kernel/lib/modules/$version/modules.dep.bin" ] || depmod -b kernel "$version"
    rm -rf base && mkdir -p base/{bin,dev,proc,sys,tmp,modules}
    cp /bin/busybox base/bin/
    install -m 755 "$here/init" base/init
    # A driver after those it needs; init loads them in this order.
    for driver in vivid uvcvideo vhci_hcd; do
        modprobe -S "$version" -d kernel --show-depends "$driver"
    done | sed -n 's/^insmod \([^ ]*\).*/\1/p' | awk '!seen[$0]++' | while read -r module; do
        cp "$module" base/modules/
        basename "$module" >>base/modules/order
    done
    (cd base && find . -print0 | cpio --null -o -H newc --quiet | gzip -6) >base.new
    # What follows has to begin at a multiple of four bytes.
    truncate -s %512 base.new
    mv base.new base.cpio.gz
fi
