#!/usr/bin/env bash
# Makes the Debian packages of a build and checks their contents. As root, where none of them is installed, also
# installs them, builds programs against /usr, and removes them. packages.sh BUILD_FOLDER
set -euo pipefail
build=$(cd "$1" && pwd)
project=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
installed=()
trap '[ ${#installed[@]} -eq 0 ] || dpkg -P "${installed[@]}" >/dev/null; rm -rf "$work"' EXIT
cd "$work"
fail() { echo "FAILED: $*"; exit 1; }

cpack -G DEB --config "$build/CPackConfig.cmake" -B "$work" >cpack.log 2>&1 || { cat cpack.log; exit 1; }
version=$(sed -nE 's/^set\(CPACK_PACKAGE_VERSION "(.*)"\)/\1/p' "$build/CPackConfig.cmake")
machine=$(dpkg --print-architecture) shared=libhtvm${version%.*}
draco=libhtvm-draco${version%.*} live=libhtvm-live${version%.*} texture=libhtvm-texture${version%.*}
for package in htvm "$shared" "$draco" "$live" "$texture" libhtvm-dev; do
    file=${package}_${version}_$machine.deb
    [ -f "$file" ] || fail "$file was not made"
    dpkg-deb -c "$file" | awk '{ print $6 }' >"$package.files"
    grep -qx "./usr/share/doc/$package/copyright" "$package.files" || fail "$package has no copyright file"
done
# has PACKAGE PATTERN...
has() {
    local package=$1 pattern
    shift
    for pattern in "$@"; do grep -qE "^\./usr/$pattern$" "$package.files" || fail "$package lacks $pattern"; done
}
has htvm bin/htvm bin/htvm-lab share/man/man1/htvm-encode.1.gz share/bash-completion/completions/htvm \
    share/zsh/vendor-completions/_htvm share/fish/vendor_completions.d/htvm.fish
has "$shared" "lib/.*/libhtvm_c.so.$version" "lib/.*/libhtvm_decoder.so.${version%.*}"
has libhtvm-dev include/htvm/htvm.h 'lib/.*/libhtvm_decoder\.(a|so)' 'lib/.*/pkgconfig/htvm-c.pc' \
    'lib/.*/cmake/htvm/htvm-config.cmake'
has "$live" "lib/.*/libhtvm_live.so.${version%.*}"
has "$texture" "lib/.*/libhtvm_texture.so.${version%.*}"
depends() { dpkg-deb -f "$1_${version}_$machine.deb" Depends; }
[[ $(depends htvm) == *libc6* && $(depends htvm) == *libembree* ]] || fail "htvm depends on: $(depends htvm)"
[[ $(depends "$shared") == *libstdc++6* && $(depends "$shared") != *draco* && $(depends "$shared") != *ssl* &&
    $(depends "$shared") != *aom* ]] ||
    fail "$shared depends on: $(depends "$shared")"
[[ $(depends "$live") == *libssl3* ]] || fail "$live depends on: $(depends "$live")"
[[ $(depends "$texture") == *libaom* && $(depends "$texture") == *libdav1d* && $(depends "$texture") == *libsvtav1enc* ]] ||
    fail "$texture depends on: $(depends "$texture")"
[[ $(depends libhtvm-dev) == *libexpected-dev* && $(depends libhtvm-dev) == *"$shared (= $version)"* ]] ||
    fail "libhtvm-dev depends on: $(depends libhtvm-dev)"

if [ "$(id -u)" -ne 0 ] || dpkg-query -W htvm libhtvm-dev "$shared" "$draco" "$live" "$texture" >/dev/null 2>&1; then
    echo "Not root, or the packages are installed already: their installation is not tried."
    exit 0
fi
installed=(htvm libhtvm-dev "$shared" "$draco" "$live" "$texture")
dpkg -i ./*.deb >dpkg.log 2>&1 || { cat dpkg.log; exit 1; }
[ "$(/usr/bin/htvm --version)" = "htvm $version" ] || fail "/usr/bin/htvm does not run"
! command -v man >/dev/null || man -w htvm-encode >/dev/null || fail "man does not find htvm-encode"
for kind in static shared; do
    cmake -S "$project/tests/install/consumer" -B $kind -DEXAMPLES="$project/examples" \
        "-DCOMPONENTS=$kind;decoder;encoder;c;c_decoder;draco;live" -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON >$kind.log 2>&1
    cmake --build $kind -j 2 >>$kind.log || { cat $kind.log; fail "programs against the package: $kind"; }
    $kind/use_draco
    $kind/use_live
    $kind/use_encoder cpp.htvm
    $kind/use_c c.htvm
    cmp cpp.htvm c.htvm
    [ "$($kind/use_decoder c.htvm | wc -l)" -eq 4 ] || fail "$kind/use_decoder"
done
# shellcheck disable=SC2046
cc -std=c99 "$project/examples/decode.c" -o by_pkg_config $(pkg-config --cflags --libs htvm-c-decoder)
[ "$(./by_pkg_config c.htvm | wc -l)" -eq 4 ] || fail "by pkg-config"
echo "1 passed, 0 failed"
