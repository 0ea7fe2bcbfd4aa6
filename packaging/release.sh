#!/usr/bin/env bash
# Puts a release together in a folder: packaging/release.sh FOLDER
# From what is committed: the source archive, Python's source distribution, Debian's source package, the changes since
# the last version. From what is built: wheels, npm packages, Debian packages, the C library for ARM and Windows, htvm.exe; it says
# what it has not found, and which command makes it. Then the sizes of all, and their checksums (SHA256SUMS).
# The same commit and the same builds give the same bytes. Builds whose sources have changed since are brought up to date.
set -euo pipefail
out=${1:?usage: packaging/release.sh FOLDER}
mkdir -p "$out"
out=$(cd "$out" && pwd)
cd "$(dirname "$0")/.."
[ -z "$(ls -A "$out")" ] || { echo "$out is not empty" >&2; exit 1; }
git diff --quiet HEAD || echo "Warning: what is not committed is not in the source archives" >&2
version=$(grep -oE 'HTVM_VERSION_(MAJOR|MINOR|PATCH) [0-9]+' include/htvm/htvm.h | cut -d' ' -f2 | paste -sd.)
stamp=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH=$stamp # what DLLs say when they were linked or stripped
# No release has what was built before its sources changed.
for build in package aarch64 windows; do
    [ -f "build/$build/build.ninja" ] || continue
    case $build in
        package) targets=(all) ;;
        aarch64) targets=(htvm_c_shared htvm_python) ;;
        windows) targets=(htvm_c_shared htvm_python htvm) ;;
    esac
    cmake --build "build/$build" --target "${targets[@]}" >&2
done
for file in build/package/*.deb; do
    [ ! -f "$file" ] || [ ! "$file" -ot build/package/htvm ] || { echo "$file is older than what it packs: ./dev package makes it anew" >&2; exit 1; }
done
missing() { echo "left out: $1 ($2 makes it)"; }

# pack NAME FOLDER: an archive of the folder's files, the same bytes whenever it is made.
pack() {
    tar c --sort=name --mtime="@$stamp" --owner=0 --group=0 --numeric-owner -C "$2" . | gzip -9n >"$out/$1.tar.gz"
}

git archive --prefix="htvm-$version/" HEAD | gzip -9n >"$out/htvm-$version-source.tar.gz"
python3 -B python/htvm_wheel.py --source "$out" >/dev/null
packaging/debian_source.sh "$out/debian" >/dev/null
# The section of the changes that is this version's.
awk -v heading="## $version" 'index($0, heading) == 1 { on = 1; print; next } /^## / { on = 0 } on' CHANGELOG.md >"$out/CHANGES.md"

# C libraries: header, shared and static library.
stripped=$(mktemp -d) # for the Unity package
for build in package aarch64 windows; do
    library=$(find "build/$build/lib" -maxdepth 1 -type f \( -name 'libhtvm_c.so.*' -o -name 'libhtvm_c.dll' \) 2>/dev/null | head -1 || true)
    case $build in
        package) name=linux-$(uname -m) how="./dev package" ;;
        aarch64) name=linux-aarch64 how="./dev platforms aarch64" ;;
        windows) name=windows-x86_64 how="./dev platforms windows" ;;
    esac
    if [ -z "$library" ]; then
        missing "the C library for $name" "$how"
        continue
    fi
    folder=$(mktemp -d)
    mkdir -p "$folder/include/htvm" "$folder/lib"
    cp include/htvm/htvm.h "$folder/include/htvm/"
    cp LICENSE docs/c_api.md examples/decode.c examples/encode.c "$folder/"
    case $build in
        windows)
            x86_64-w64-mingw32-strip -o "$folder/lib/libhtvm_c.dll" "$library"
            cp "build/$build/lib/libhtvm_c.dll.a" "$folder/lib/" ;;
        *)
            strip=strip
            [ $build = package ] || strip=aarch64-linux-gnu-strip
            $strip -o "$folder/lib/$(basename "$library")" "$library"
            ln -s "$(basename "$library")" "$folder/lib/$(basename "${library%.*}")"
            ln -s "$(basename "$library")" "$folder/lib/libhtvm_c.so" ;;
    esac
    pack "htvm-c-$version-$name" "$folder"
    mkdir "$stripped/$build"
    find "$folder/lib" -type f \( -name '*.so.*' -o -name '*.dll' \) -exec mv {} "$stripped/$build/" \;
    rm -r "$folder"
done
find "$stripped" -type f -print0 | LC_ALL=C sort -z | xargs -0 packaging/unity.py "$out" >/dev/null
rm -r "$stripped"

# htvm.exe, one file, without the player where ./dev web has not built it.
if [ -f build/windows/htvm.exe ]; then
    folder=$(mktemp -d)
    cp LICENSE docs/platforms.md "$folder/"
    x86_64-w64-mingw32-strip -o "$folder/htvm.exe" build/windows/htvm.exe
    pack "htvm-$version-windows-x86_64" "$folder"
    rm -r "$folder"
else
    missing "htvm.exe" "./dev platforms windows"
fi

wheels=0
for library in build/{package,aarch64,windows}/python/{libhtvm.so,libhtvm.dll}; do
    [ -f "$library" ] || continue
    python3 -B python/htvm_wheel.py "$library" "$out" >/dev/null
    wheels=$((wheels + 1))
done
[ $wheels -gt 0 ] || missing "wheels for Python" "./dev package"
if [ -f web/packages/decoder/dist/index.js ]; then
    (cd web && npm pack --silent --pack-destination "$out" ./packages/decoder ./packages/three ./packages/player >/dev/null)
else
    missing "npm's packages" "./dev web"
fi
cp build/package/*.deb "$out/debian/" 2>/dev/null || missing "Debian's packages" "./dev package"

(cd "$out" && find . -type f ! -name SHA256SUMS -printf '%P\n' | LC_ALL=C sort | xargs sha256sum >SHA256SUMS)
(cd "$out" && find . -type f -printf '%s %P\n' | LC_ALL=C sort -k2 | awk '{ printf "%10d  %s\n", $1, $2 }')
