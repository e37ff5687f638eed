#!/usr/bin/env bash
# Keeps docs/public_api.txt, the list of everything that games can name: modules, types with fields and variants, functions with their
# signatures, and the traits that types implement. It is what the documentation shows; hidden items are left out.
#
#   scripts/public_api.sh           writes the list
#   scripts/public_api.sh --check   fails, and says what changed, where the list is not up to date
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly list=docs/public_api.txt
# as the documentation is built, so that nothing is checked twice
readonly features=egui,webcam,locus
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT

if ! command -v python3 >/dev/null; then
    echo "public API: python3 is missing, which turns rustdoc's JSON into the list" >&2
    exit 1
fi
# rustdoc writes JSON only if unstable options are allowed. They are allowed to rustdoc alone: with them allowed to cargo, everything
# would be compiled anew.
cat >"$work/rustdoc" <<'END'
#!/bin/sh
RUSTC_BOOTSTRAP=1 exec rustdoc "$@"
END
chmod +x "$work/rustdoc"
RUSTDOC="$work/rustdoc" cargo rustdoc --quiet --locked --lib --features "$features" -- -Z unstable-options --output-format json
python3 scripts/public_api.py "${CARGO_TARGET_DIR:-target}/doc/bevy_mirrorball.json" >"$work/list"

if [ "${1:-}" != --check ]; then
    mkdir -p docs
    cp "$work/list" "$list"
    echo "public API: $(wc -l <"$list") lines in $list"
elif difference=$(diff "$list" "$work/list"); then
    echo "public API: as in $list"
else
    echo "public API: not as in $list (< there, > in the sources):" >&2
    echo "$difference" | grep '^[<>]' >&2 || true
    echo "public API: if that is meant, run scripts/public_api.sh, commit the list, and name it in CHANGELOG.md (what was removed or" \
        "renamed under Migration)" >&2
    exit 1
fi
