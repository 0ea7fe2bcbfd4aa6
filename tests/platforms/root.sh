#!/usr/bin/env bash
# A root of Debian for 64-bit ARM in a folder, unpacked but not set up: what the programs link, and a Python. It takes a
# minute, 460 MB, and Debian's servers. root.sh FOLDER
set -euo pipefail
root=$1
# As ./dev's `packages`, but for what runs here.
packages=(libc6-dev libstdc++-12-dev libexpected-dev libeigen3-dev libnanoflann-dev libboost1.81-dev libssl-dev libnats-dev
          libcli11-dev libfmt-dev nlohmann-json3-dev libdraco-dev libembree-dev libpng-dev libturbojpeg0-dev libwebp-dev
          libopus-dev libsndfile1-dev libsamplerate0-dev libaom-dev libvpx-dev libdav1d-dev libsvtav1enc-dev
          python3-minimal libpython3-stdlib python3-numpy python3-pytest)
[ ! -f "$root/made" ] || exit 0
rm -rf "$root"
mkdir -p "$(dirname "$root")"
nice mmdebstrap --variant=extract --architectures=arm64 --include="$(IFS=,; echo "${packages[*]}")" \
    bookworm "$root" http://deb.debian.org/debian >&2 || { rm -rf "$root"; exit 1; }
touch "$root/made" # all of it
