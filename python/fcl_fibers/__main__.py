# SPDX-License-Identifier: BSD-3-Clause
"""The program: python -m fcl_fibers check|info|distance|view|convert ..."""

import signal
import sys

from . import _program


def main() -> int:
    # The program does not return to the interpreter before it ends, so Ctrl-C ends the process.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _program.run(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
