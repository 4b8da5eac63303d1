# SPDX-License-Identifier: BSD-3-Clause
"""The list of what is measured, which lies in the folder above."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from sets import SETS, titles  # noqa: E402

__all__ = ["SETS", "titles"]
