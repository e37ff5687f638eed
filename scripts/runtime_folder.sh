#!/usr/bin/env bash
# Gives programs a private runtime folder where the system has none, as on servers and in containers. Without one, Mesa
# and Wayland complain at every start. Source it.

# Sets XDG_RUNTIME_DIR to a folder that only this user can read, unless it names a folder already.
ensure_runtime_folder() {
    case ${XDG_RUNTIME_DIR:-} in
    /*) if [ -d "$XDG_RUNTIME_DIR" ]; then return 0; fi ;;
    esac
    # one per user, so that programs which are started from here leave no heap of folders behind
    local folder
    folder=${TMPDIR:-/tmp}/mirrorball-runtime-$(id -u)
    if ! mkdir -m 700 "$folder" 2>/dev/null; then
        # something else may have that name, or someone else may have made it
        if [ -L "$folder" ] || [ ! -d "$folder" ] || [ ! -O "$folder" ] || ! chmod 700 "$folder"; then
            folder=$(mktemp -d) || return 0
        fi
    fi
    export XDG_RUNTIME_DIR=$folder
}

ensure_runtime_folder
