#!/usr/bin/env bash
# Makes Debian's source package of what is committed (htvm_VERSION-1.dsc and what it names): debian_source.sh FOLDER [--lint]
# --lint: lintian reads it, and may warn of nothing.
set -euo pipefail
mkdir -p "$1"
out=$(cd "$1" && pwd)
cd "$(dirname "$0")/.."
version=$(sed -n '1s/^htvm (\(.*\)-[0-9]*).*/\1/p' packaging/debian/changelog)
rm -rf "$out/htvm-$version"
git archive --prefix="htvm-$version/" HEAD | tar x -C "$out"
# It has the same bytes whenever it is made.
stamp=$(git log -1 --format=%ct)
tar c --sort=name --mtime="@$stamp" --owner=0 --group=0 --numeric-owner -C "$out" "htvm-$version" |
    gzip -9n >"$out/htvm_$version.orig.tar.gz"
cp -r packaging/debian "$out/htvm-$version/debian"
(cd "$out" && dpkg-source -b "htvm-$version" >/dev/null)
rm -rf "$out/htvm-$version"
(cd "$out" && ls htvm_"$version"*)
if [ "${2:-}" = --lint ]; then
    (cd "$out" && lintian --allow-root --fail-on error,warning htvm_"$version"-*.dsc)
fi
