#!/usr/bin/env bash
# Tests webcams against the kernel's own drivers, without a camera: boots a Debian kernel in QEMU with vivid (a virtual
# camera) and an emulated USB webcam, and runs the crate's camera tests there. Debian and Ubuntu on x86-64; one to three
# minutes after the build. KVM is used where it works and is not needed.
#
#   scripts/test_webcam.sh                all tests of webcams
#   scripts/test_webcam.sh unplugged      only those with this in their names
#
# The first run installs what is missing (says so) and fetches a kernel package of 70 MB, which is unpacked and not installed.
# Exit code: 0 passed, 124 no end within the limit, 125 the machine died, otherwise failed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
readonly limit_seconds=400
readonly work=${CARGO_TARGET_DIR:-target}/webcam_vm
mkdir -p "$work"

scripts/webcam_vm/prepare.sh "$work"

echo "tests: compiling"
# With the features of the other checks, so that Bevy is not compiled twice.
binary=$(cargo test --features egui,webcam --lib --no-run --message-format=json-render-diagnostics |
    sed -n 's/.*"kind":\["lib"\].*"executable":"\([^"]*\)".*/\1/p' | tail -n 1)
[ -n "$binary" ] || { echo "tests: cargo names no test binary" >&2; exit 1; }
cc -O2 -o "$work/usb_camera" scripts/webcam_vm/usb_camera.c

# The payload: the programs and the shared libraries they need, in a second archive behind the first.
root=$work/payload
rm -rf "$root" && mkdir -p "$root/payload"
strip --strip-debug -o "$root/payload/tests" "$binary"
cp "$work/usb_camera" "$root/payload/"
printf '%s\n' "${1:-webcam}" >"$root/payload/filter"
for program in "$root"/payload/tests "$root"/payload/usb_camera; do
    ldd "$program" | grep -o '/[^ ]*' | while read -r library; do
        mkdir -p "$root$(dirname "$library")"
        cp -L "$library" "$root$library"
    done
done
(cd "$root" && find . -print0 | cpio --null -o -H newc --quiet) >"$work/payload.cpio"
cat "$work/base.cpio.gz" "$work/payload.cpio" >"$work/initrd"

# /dev/kvm alone does not say it: within some virtual machines it is there and boots nothing.
accelerator=tcg cpu=max
if [ -w /dev/kvm ] && { [ -d /sys/module/kvm_intel ] || [ -d /sys/module/kvm_amd ]; }; then
    accelerator=kvm cpu=host
fi
memory=$((192 + 3 * $(stat -c %s "$work/initrd") / 1048576))
echo "tests: booting with $accelerator and $memory MiB"
status=0
timeout -k 5 "$limit_seconds" qemu-system-x86_64 -nodefaults -no-user-config -display none -no-reboot \
    -machine "pc,accel=$accelerator" -cpu "$cpu" -smp 2 -m "$memory" -kernel "$work/vmlinux" -initrd "$work/initrd" \
    -append "console=ttyS0,115200 quiet loglevel=5 panic=-1 reboot=t tsc=reliable rdinit=/init" \
    -serial "file:$work/console.log" -serial stdio </dev/null || status=$?

outcome=$(sed -n 's/.*WEBCAM_TESTS_EXIT=\([0-9]*\).*/\1/p' "$work/console.log" | tail -n 1)
if [ -z "$outcome" ]; then
    echo "tests: the machine gave no result; the end of its kernel's messages:" >&2
    tail -n 30 "$work/console.log" >&2
    [ "$status" -eq 124 ] && exit 124 || exit 125
fi
if [ "$outcome" -eq 0 ]; then echo "tests: passed"; else echo "tests: failed"; fi
exit "$outcome"
