#!/usr/bin/env bash
# Builds the wheel, installs it into a new virtual environment, and there runs the tests, mypy and the example.
# installed.sh LIBRARY HTVM      python3 with NumPy, pytest, matplotlib and mypy is /usr/bin/python3, Debian's
set -euo pipefail
library=$(realpath "$1")
HTVM_PROGRAM=$(realpath "$2")
export HTVM_PROGRAM PYTHONDONTWRITEBYTECODE=1
unset HTVM_LIBRARY PYTHONPATH
project=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
fail() { echo "FAILED: $*"; exit 1; }

wheel=$(/usr/bin/python3 "$project/python/htvm_wheel.py" "$library" "$work")
[[ $wheel == htvm-*-py3-none-manylinux_2_*_"$(uname -m)".whl ]] || fail "the wheel's name is $wheel"
/usr/bin/python3 -m venv --system-site-packages environment
environment/bin/pip install -q --no-index --no-deps "$wheel"
where=$(environment/bin/python -c 'import htvm; print(htvm.__file__)')
[[ $where == "$work"/environment/* ]] || fail "htvm was imported from $where"
environment/bin/python -m pytest -q -p no:cacheprovider "$project/python/tests"

# pip builds the same wheel from the sources.
HTVM_LIBRARY=$library environment/bin/pip wheel -q --no-deps --no-build-isolation -w built "$project/python"
cmp "$wheel" "built/$wheel"
environment/bin/python -m mypy --config-file "$project/python/pyproject.toml" --cache-dir mypy_cache "$project/python/htvm"

"$HTVM_PROGRAM" synth capture --frames 6 --vertices 2000 >/dev/null
for quality in 20 60; do
    "$HTVM_PROGRAM" encode capture -q $quality -o "q$quality.htvm" --quiet
done
MPLCONFIGDIR=$work environment/bin/python "$project/examples/python/plot_errors.py" capture q20.htvm q60.htvm -o errors.png |
    tee lines
[ "$(wc -l <lines)" -eq 2 ] || fail "the example says something else"
[ "$(head -c 4 errors.png | tail -c 3)" = PNG ] || fail "the example wrote no picture"
echo "1 passed, 0 failed"
