# SPDX-License-Identifier: BSD-3-Clause
"""Shapes that fibers may touch."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from . import _arrays, _core
from ._arrays import ArrayLike


class Shape:
    """A shape as plain numbers, in the frame and unit of the fibers.

    It is the `other` of pairs(), contacts(), impacts(), impact_contacts() and safe_step(). They
    raise ValueError if the numbers make no shape, such as a negative radius. Shapes do not change.
    They have the names of C++'s shapes.h.
    """

    _kind: Any

    def __init__(self) -> None:
        """Raises TypeError: a program makes one of the types that are derived from this one."""
        raise TypeError("Shape is the type of all shapes; give one of them, such as SphereShape")

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            if field.type == "float":
                value = _arrays.number(field.name, value)
            else:
                shape = (3, 3) if field.name == "rotation" else (3,)
                rows = np.reshape(_arrays.vector(field.name, value, shape), shape).tolist()
                value = tuple(map(tuple, rows)) if len(shape) == 2 else tuple(rows)
            object.__setattr__(self, field.name, value)

    def _core_shape(self) -> Any:
        values = dataclasses.astuple(self)  # type: ignore[call-overload]
        return self._kind(*(np.ravel(v).tolist() if np.ndim(v) == 2 else v for v in values))


@dataclasses.dataclass(frozen=True)
class CapsuleShape(Shape):
    """All points within `radius` of the line from `start` to `end`, (3,) each."""

    _kind = _core.CapsuleShape
    start: ArrayLike
    end: ArrayLike
    radius: float


@dataclasses.dataclass(frozen=True)
class SphereShape(Shape):
    """A ball, which is a capsule of no length. `center` is (3,)."""

    _kind = _core.SphereShape
    center: ArrayLike
    radius: float


@dataclasses.dataclass(frozen=True)
class BoxShape(Shape):
    """A box from the corner `low` to the corner `high`, (3,) each; it may be flat.

    It is turned and moved as a mesh is: a point p of it is at rotation @ p + position.

    rotation       (3, 3), orthonormal and no reflection; kept as three rows
    position       (3,)
    """

    _kind = _core.BoxShape
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

    _kind = _core.HalfSpaceShape
    normal: ArrayLike
    offset: float


@dataclasses.dataclass(frozen=True)
class PlaneShape(Shape):
    """All points p with normal @ p = offset: a sheet without an end, which has two sides.

    normal         (3,), of any length but 0
    offset         a number: the height of the sheet along a normal of length 1
    """

    _kind = _core.PlaneShape
    normal: ArrayLike
    offset: float
