#!/usr/bin/env bash
# Installs the wheel and the add-on as docs/blender.md says, in a folder of its own, and imports a stream in Blender.
# blender.sh LIBRARY HTVM        the program blender is on the PATH
set -euo pipefail
library=$(realpath "$1")
htvm=$(realpath "$2")
unset HTVM_LIBRARY PYTHONPATH
project=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

wheel=$(/usr/bin/python3 "$project/python/htvm_wheel.py" "$library" "$work")
export BLENDER_USER_SCRIPTS=$work/scripts BLENDER_USER_CONFIG=$work/config
mkdir -p scripts/addons config
/usr/bin/python3 -m pip install -q --root-user-action ignore --no-index --no-deps --target scripts/addons/modules "$wheel"
cp "$project/python/blender/htvm_import.py" scripts/addons/

"$htvm" synth capture --frames 20 --vertices 3000 >/dev/null 2>&1
"$htvm" encode capture --keyint 8 --up y --floor 0 -o person.htvm --quiet
"$htvm" decode person.htvm -o decoded --unit mm --quiet
blender -b --factory-startup --addons htvm_import --python-exit-code 1 --python "$project/python/tests/blender_import.py" \
    -- "$work/person.htvm" "$work/decoded" "$work" >log 2>&1 || { cat log; exit 1; }
grep -q "what Blender shows is what htvm decodes" log || { cat log; exit 1; }
echo "1 passed, 0 failed"
