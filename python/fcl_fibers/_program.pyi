# SPDX-License-Identifier: BSD-3-Clause
from typing import List, Optional, Tuple

import numpy as np

from ._core import Layout, Numbers

def run(arguments: List[str], /) -> int: ...
def page(
    title: str,
    numbers: Numbers,
    layout: Layout,
    starts_at: Optional[np.ndarray],
    ends_at: Optional[np.ndarray],
    ignored_neighbors: int,
    margin: float,
    threads: int,
    depth: int,
    most_points: int,
    up: str,
    meshes: List[Tuple[np.ndarray, np.ndarray]],
    /,
) -> str: ...
