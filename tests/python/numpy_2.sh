#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Whether NumPy 2 gives right answers, or the import tells that it cannot:
#
#   tests/python/numpy_2.sh PYTHON FOLDER    # that the package is in
#
# Ends with 77 if NumPy 2 cannot be had.
set -euo pipefail
venv=$(mktemp -d)
trap 'rm -rf "$venv"' EXIT
if ! "$1" -m venv "$venv" || ! "$venv/bin/pip" install -q --retries 0 'numpy>=2'; then
  echo "NumPy 2, which pip cannot install here"
  exit 77
fi
cd "$2"
PYTHONPATH=$2 "$venv/bin/python" -B - <<'END'
import numpy as np

try:
    import fcl_fibers
except ImportError as error:
    assert f"cannot read the arrays of NumPy {np.__version__}" in str(error), error
else:
    tree = fcl_fibers.FiberTree()
    tree.build([[(-1, 0, 0), (1, 0, 0)], [(0, -1, 0.125), (0, 1, 0.125)]], radii=0.1)
    assert tree.pairs().tolist() == [[0, 2]], tree.pairs()
    assert tree.contacts()["normal"].tolist() == [[0, 0, 1]], tree.contacts()
END
