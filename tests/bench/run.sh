#!/usr/bin/env bash
# The tests of what bench/ computes, by a Python that has numpy: the first one found, or Debian's own.
for python in python3 /usr/bin/python3; do
    "$python" -c 'import numpy' 2>/dev/null && exec "$python" "$(dirname "$0")/live_test.py"
done
echo "There is no Python with numpy (Debian: python3-numpy): what bench/ computes is not tested."
exit 77
