# SPDX-License-Identifier: BSD-3-Clause
"""Where the package cannot work, its import says so."""

import subprocess
import sys

import pytest

from fcl_fibers import _core

SUB_INTERPRETER = """
try:
    import _interpreters as interpreters
except ImportError:
    import _xxsubinterpreters as interpreters
{before}
failure = interpreters.run_string(interpreters.create(), '''
try:
    import fcl_fibers
except ImportError as error:
    print(error, flush=True)
''')
assert failure is None, failure
"""


def run(program):
    # What hangs would do so for ever, and an import takes a second at most.
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=120
    )


@pytest.mark.parametrize("before", ["", "import fcl_fibers"])
def test_a_sub_interpreter_is_refused(before):
    found = run(SUB_INTERPRETER.format(before=before))
    assert found.returncode == 0, found.stderr
    assert "cannot be imported in a sub-interpreter" in found.stdout


# tests/python/numpy_2.sh has NumPy itself in the place of its number.
@pytest.mark.parametrize("numpy", ["1.26.4", "2.0.0", "2.4.6", "3.1.0rc1"])
def test_numpy_2_needs_a_pybind11_that_knows_it(numpy):
    found = run(f"import numpy; numpy.__version__ = {numpy!r}; import fcl_fibers")
    if numpy.startswith("1.") or _core.pybind11_version >= (2, 12):
        assert found.returncode == 0, found.stderr
    else:
        refusal = found.stderr.splitlines()[-1]
        assert refusal.startswith("ImportError: fcl_fibers was built with pybind11 2.")
        assert f"cannot read the arrays of NumPy {numpy}" in refusal
        assert "`pip install .` without --no-build-isolation" in refusal and "numpy<2" in refusal
