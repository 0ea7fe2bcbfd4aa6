#!/usr/bin/env bash
# The Python package's tests, on the sources: run.sh LIBRARY HTVM [PYTEST_ARGUMENTS ...]
# Exits with 77, which CTest takes for "skipped", if no Python here has NumPy and pytest.
set -euo pipefail
HTVM_LIBRARY=$(realpath "$1")
HTVM_PROGRAM=$(realpath "$2")
export HTVM_LIBRARY HTVM_PROGRAM
shift 2
# Beside the program, where it was built.
live=$(dirname "$HTVM_PROGRAM")/lib/libhtvm_c_live.so
[ ! -e "$live" ] || export HTVM_LIVE_LIBRARY=${HTVM_LIVE_LIBRARY:-$live}
here=$(cd "$(dirname "$0")" && pwd)
export PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$here/..
for python in python3 /usr/bin/python3; do
    "$python" -c 'import numpy, pytest' 2>/dev/null && exec "$python" -m pytest -q -p no:cacheprovider "$@" "$here"
done
echo "No Python here has NumPy and pytest: skipped."
exit 77
