#!/usr/bin/env bash
# The Python wheel for another processor or system, of the library in build/PLATFORM/python: its name, what it needs, and
# what can be run of it here. wheel.sh aarch64|windows [LIBRARY]
# 64-bit ARM: the Python package's own tests, by Debian's Python for ARM under qemu, from the root that HTVM_AARCH64_ROOT
# names, or root.sh makes in build/aarch64_root; where that cannot be had, a line says so. Windows: no Python can be had here, and a program does with
# the library what the package does. Prints one line of what was seen.
set -euo pipefail
cd "$(dirname "$0")/../.."
platform=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
library=${2:-$(find "build/$platform/python" -name 'libhtvm.so' -o -name 'libhtvm.dll')}
wheel=$(python3 -B python/htvm_wheel.py "$library" "$work")
python3 -m zipfile -e "$work/$wheel" "$work/installed"
# Its own record: every file, with its digest.
python3 - "$work/installed" <<'PYTHON'
import base64, hashlib, pathlib, sys
root = pathlib.Path(sys.argv[1])
record = next(root.glob("*.dist-info/RECORD")).read_text().split()
for line in record:
    name, digest, size = line.rsplit(",", 2)
    if digest:
        data = (root / name).read_bytes()
        told = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        assert digest == "sha256=" + told and int(size) == len(data), name
assert len(record) == sum(path.is_file() for path in root.rglob("*"))
PYTHON
case $platform in
    aarch64)
        [[ $wheel == htvm-*-py3-none-manylinux_2_*_aarch64.whl ]] || { echo "the wheel's name is $wheel"; exit 1; }
        root=${HTVM_AARCH64_ROOT:-build/aarch64_root}
        tests/platforms/root.sh "$root" 2>"$work/log" || true
        [ -x "$root/usr/bin/python3.11" ] || { echo "$wheel; not imported: no Python for ARM (mmdebstrap)"; exit 0; }
        libraries=/usr/lib/aarch64-linux-gnu
        qemu-aarch64-static -L "$root" -E LD_LIBRARY_PATH=$libraries/blas:$libraries/lapack -E PYTHONPATH="$work/installed" \
            -E PYTHONDONTWRITEBYTECODE=1 "$root/usr/bin/python3.11" -m pytest -q -p no:cacheprovider python/tests >"$work/log" 2>&1 ||
            { cat "$work/log"; exit 1; }
        echo "$wheel; $(tail -1 "$work/log")" ;;
    windows)
        [[ $wheel == htvm-*-py3-none-win_amd64.whl ]] || { echo "the wheel's name is $wheel"; exit 1; }
        x86_64-w64-mingw32-gcc-posix -std=c99 -Wall -Wextra -Werror -Iinclude -o "$work/wheel_library.exe" tests/platforms/wheel_library.c
        mapfile -t functions < <(grep -oE '^    "htvm_[a-z_]+": ' python/htvm/_interface.py | tr -d '": ')
        told=$(tests/platforms/emulate.sh windows "$work/wheel_library.exe" "$work/installed/htvm/htvm.dll" \
            tests/data/conformance/tracked_2.htvm "$work" "${functions[@]}") || { echo "$told"; exit 1; }
        echo "$wheel; $told" ;;
esac
