# SPDX-License-Identifier: BSD-3-Clause
"""The page that shows fibers in 3D, offline."""

from __future__ import annotations

import html
import os
from typing import Optional, Sequence, Union

import numpy as np

from . import _arrays, _core
from ._arrays import ArrayLike, Points
from ._files import Fibers, branches_of
from ._tree import TriangleMesh


class Page:
    """A page of three.js. A notebook shows it; save() writes it for a browser."""

    def __init__(self, text: str, height: int) -> None:
        self.html = text
        self._height = height

    def save(self, path: Union[str, os.PathLike]) -> None:
        """Writes the page to a file, which a browser opens offline."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.html)

    def _repr_html_(self) -> str:
        # A frame, because a notebook runs no script that it inserts, and to keep styles apart.
        return (
            f'<iframe srcdoc="{html.escape(self.html)}" width="100%" height="{self._height}" '
            'style="border:0"></iframe>'
        )

    def __repr__(self) -> str:
        return f"<Page: {len(self.html):,} characters; save(path) writes it>"


def show(
    points: Union[Points, Fibers],
    offsets: Optional[ArrayLike] = None,
    radii: Optional[Points] = None,
    closed: Optional[ArrayLike] = None,
    *,
    radius: Optional[float] = None,
    meshes: Sequence[TriangleMesh] = (),
    ignored_neighbors: int = 1,
    margin: float = 0.0,
    threads: int = 1,
    depth: int = 2,
    most_points: int = 200_000,
    up: str = "z",
    title: str = "fibers",
    height: int = 600,
) -> Page:
    """Shows fibers, their contacts and the volumes of the tree, which can be turned and picked.

    points, offsets, radii, closed, radius    as in FiberTree.build(), or Fibers, which tell where
                                      they branch: show(fibers)
    meshes                            drawn at their present poses
    ignored_neighbors, margin, threads    as in FiberTree; pairs that touch are marked
    depth        deepest level of volumes that the page can show, 0 to 8
    most_points  the most points to draw, at least 1000; of more, every nth fiber and point is
                 drawn, and contacts are those of all
    up           the axis that points up: "x", "y" or "z"
    title        the name of the scene on the page
    height       of the frame in a notebook, in pixels

    Wrong arrays or options, and fibers without a segment, raise ValueError or TypeError.
    """
    from . import _program

    if not all(isinstance(mesh, TriangleMesh) for mesh in meshes):
        raise TypeError("meshes are not all TriangleMesh")
    if up not in ("x", "y", "z"):
        raise ValueError(f"up is {up!r}; give 'x', 'y' or 'z'")
    if not 0 <= _arrays.integer("depth", depth) <= 8:
        raise ValueError(f"depth is {depth}; give 0 to 8")
    if _arrays.integer("most_points", most_points, np.int64) < 1000:
        raise ValueError(f"most_points is {most_points}; give at least 1000")
    starts_at, ends_at = None, None
    if isinstance(points, Fibers):
        if not (offsets is None and radii is None and closed is None):
            raise TypeError("fibers come with offsets, radii and closed; give them alone")
        starts_at, ends_at = points.starts_at, points.ends_at
        points, offsets, radii, closed = points
        radii = radii if radius is None else None  # as for a file
    array, begin = _arrays.points_and_offsets(points, offsets)
    numbers, kind = _arrays.radii_of(_arrays.one_of(radius, radii), array, begin)
    array, begin, numbers = _arrays.without_gaps(array, begin, numbers, kind)
    branches = branches_of(starts_at, ends_at, array, begin)
    try:
        text = _program.page(
            str(title),
            _core.Numbers(array, numbers, kind),
            _arrays.layout_of(array, begin, closed),
            *branches,
            _arrays.integer("ignored_neighbors", ignored_neighbors),
            _arrays.number("margin", margin),
            _arrays.integer("threads", threads),
            depth,
            most_points,
            up,
            [mesh.placed() for mesh in meshes],
        )
    except RuntimeError as error:
        raise ValueError(str(error)) from None
    return Page(text, height)
