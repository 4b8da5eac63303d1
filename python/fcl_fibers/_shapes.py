# SPDX-License-Identifier: BSD-3-Clause
"""Shapes that fibers may touch."""

from __future__ import annotations

import dataclasses
from typing import Any

from . import _arrays, _core
from ._arrays import ArrayLike


class Shape:
    """A shape as plain numbers, in the frame and unit of the fibers.

    It is the `other` of pairs(), contacts(), impacts() and safe_step(), which raise ValueError if
    no shape has such numbers. Shapes do not change. They have the names of C++'s shapes.h.
    """

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            if field.type == "float":
                value = _arrays.number(field.name, value)
            else:
                shape = (3, 3) if field.name == "rotation" else (3,)
                value = tuple(_arrays.vector(field.name, value, shape))
            object.__setattr__(self, field.name, value)

    def _core_shape(self) -> Any:
        return getattr(_core, type(self).__name__)(*dataclasses.astuple(self))  # type: ignore


@dataclasses.dataclass(frozen=True)
class CapsuleShape(Shape):
    """All points within `radius` of the line from `start` to `end`, (3,) each."""

    start: ArrayLike
    end: ArrayLike
    radius: float


@dataclasses.dataclass(frozen=True)
class SphereShape(Shape):
    """A ball, which is a capsule of no length. `center` is (3,)."""

    center: ArrayLike
    radius: float


@dataclasses.dataclass(frozen=True)
class BoxShape(Shape):
    """A box from the corner `low` to the corner `high`, (3,) each; it may be flat.

    It is turned and moved as a mesh is: a point p of it is at rotation @ p + position.

    rotation       (3, 3), orthonormal and no reflection; kept as 9 numbers, row by row
    position       (3,)
    """

    low: ArrayLike
    high: ArrayLike
    rotation: ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    position: ArrayLike = (0.0, 0.0, 0.0)


@dataclasses.dataclass(frozen=True)
class HalfSpaceShape(Shape):
    """All points p with normal @ p <= offset, such as the ground below a floor.

    normal         (3,), of any length but 0; it points out
    offset         a number: the height of the surface along a normal of length 1
    """

    normal: ArrayLike
    offset: float


@dataclasses.dataclass(frozen=True)
class PlaneShape(Shape):
    """All points p with normal @ p = offset: a sheet without an end, which has two sides."""

    normal: ArrayLike
    offset: float
