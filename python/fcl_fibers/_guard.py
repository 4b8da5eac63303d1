# SPDX-License-Identifier: BSD-3-Clause
"""Refuses, when it is imported, what would hang or give wrong answers in silence."""

import importlib


def is_main_interpreter() -> bool:
    """Whether this is the interpreter with which the process began."""
    for name in ("_interpreters", "_xxsubinterpreters"):  # since Python 3.13, and before
        try:
            interpreters = importlib.import_module(name)
        except ImportError:
            continue
        return bool(interpreters.get_current() == interpreters.get_main())
    return True  # nothing tells


def require_main_interpreter() -> None:
    """The modules in C++ would wait for ever for a lock."""
    if not is_main_interpreter():
        raise ImportError(
            "fcl_fibers cannot be imported in a sub-interpreter; import it in the main interpreter "
            "or in another process, as multiprocessing starts them"
        )


def require_numpy() -> None:
    """NumPy 2 lays its types out anew, and pybind11 before 2.12 reads them as those of NumPy 1."""
    import numpy

    from ._core import pybind11_version

    if int(numpy.__version__.split(".")[0]) >= 2 and pybind11_version < (2, 12):
        raise ImportError(
            f"fcl_fibers was built with pybind11 {'.'.join(map(str, pybind11_version))}, which "
            f"cannot read the arrays of NumPy {numpy.__version__}; build it again with a newer "
            "one, which `pip install .` without --no-build-isolation does, or install 'numpy<2'"
        )


require_main_interpreter()
require_numpy()
