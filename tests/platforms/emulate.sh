#!/usr/bin/env bash
# Runs a program that was built for another processor or system:
#   tests/platforms/emulate.sh aarch64|windows PROGRAM ARGUMENTS...
# HTVM_EMULATED_ROOT names the root that an ARM program's libraries lie in, by default those of Debian's cross compiler.
# Wine keeps what it calls a prefix in build/wine. Lines end as they do here.
set -euo pipefail
project=$(cd "$(dirname "$0")/../.." && pwd)
platform=$1 program=$2
shift 2
case $platform in
    aarch64) exec qemu-aarch64-static -L "${HTVM_EMULATED_ROOT:-/usr/aarch64-linux-gnu}" "$program" "$@" ;;
    windows)
        mkdir -p "$project/build"
        # Wine takes the words of a command by this system's language.
        export WINEPREFIX=$project/build/wine WINEDEBUG=-all LC_ALL=C.UTF-8
        [ -f "$program" ] || program=$program.exe
        # Debian's package wine64 alone puts nothing into the PATH.
        wine=$(command -v wine64 || echo /usr/lib/wine/wine64)
        "$wine" "$program" "$@" | tr -d '\r' ;;
    *) echo "there is no platform '$platform'; there are: aarch64 windows" >&2; exit 2 ;;
esac
