# SPDX-License-Identifier: BSD-3-Clause
"""What a program passes, as the arrays that C++ takes.

The one rule of copies: an aligned array of float32 or float64 in the machine's byte order is read
where it is, whatever its strides. Any other array of points is copied, as float64 unless it is
float32.

Offsets are (fibers + 1,), or (fibers, 2) if points between fibers are of no fiber.
Radii get the type of the points; a radius that float32 cannot hold is rounded up, so that no touch
is missed.
"""

from __future__ import annotations

import operator
from typing import Any, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import _core

ArrayLike = npt.ArrayLike
# One array, or one array for each fiber.
Points = Union[npt.ArrayLike, Sequence[npt.ArrayLike]]

ONE, PER_FIBER, PER_FIRST_POINT, PER_POINT = range(4)


class PointRadii(np.ndarray):
    """Radii at points: along a segment the radius changes linearly from that of one end to that of
    the other, so the segment is a rounded cone. They stand wherever radii do. A plain array of n
    numbers gives the radius of the segment that starts at each point, so segments are capsules.

    radii  (n,) numbers, one for each point; or a list of arrays, one for each fiber; or an array
           (fibers, n)

    Slices, operators and NumPy's functions keep the class, np.where and np.copy too, and so does
    what joins arrays, np.concatenate or np.append, if any of these has it. Plain are
    np.asarray(radii), np.array(radii), and a sum, mean or maximum of all radii.
    """

    def __new__(cls, radii: Any) -> PointRadii:
        is_joined = isinstance(radii, (list, tuple)) and any(np.ndim(r) > 0 for r in radii)
        array = np.concatenate(radii) if is_joined else np.asarray(radii)
        return array.reshape(-1).view(cls)

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        found = super().__array_function__(func, types, args, kwargs)
        # A plain array would be taken for radii of capsules.
        is_lost = type(found) is np.ndarray and found.ndim > 0 and found.dtype.kind in "fiu"
        return found.view(PointRadii) if is_lost else found

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        # np.squeeze() takes no scalar from here.
        return super().__array_wrap__(array, context) if array.ndim > 0 else np.asarray(array)


def unmasked(name: str, values: Any) -> np.ndarray:
    if np.ma.isMaskedArray(values) and np.ma.getmaskarray(values).any():
        raise TypeError(f"{name} are masked in part; leave out what is masked")
    return np.asarray(values)


def type_of(array: np.ndarray) -> str:
    if array.dtype.names is None:
        return f"of type {array.dtype}"
    return f"a structured array with the fields {', '.join(array.dtype.names)}"


def numbers(name: str, values: Any, keeps_strides: bool = False) -> np.ndarray:
    """An array of float32 or float64 that C++ can read, C-contiguous unless strides are kept."""
    array = unmasked(name, values)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} are {type_of(array)}; give real numbers")
    scalar = np.float32 if array.dtype == np.float32 else np.float64
    # C++ takes a stride of 0 for packed. Strides of a dimension of one element mean nothing.
    keeps_strides = keeps_strides and all(
        n > 1 and step for n, step in zip(array.shape, array.strides)
    )
    return np.require(array, scalar, ["A"] if keeps_strides else ["C", "A"])


def whole(name: str, values: ArrayLike, scalar: type) -> np.ndarray:
    """A one-dimensional array of whole numbers, each of which `scalar` can hold."""
    array = unmasked(name, values)
    is_empty = array.size == 0 and array.dtype.kind == "f"  # as [] is
    if array.dtype.kind not in "iub" and not is_empty:
        raise TypeError(f"{name} are {type_of(array)}; give whole numbers")
    if array.ndim != 1:
        raise ValueError(f"{name} have shape {array.shape}; give one dimension")
    limits: Any = np.iinfo(scalar)
    if array.size > 0 and not (limits.min <= array.min() and array.max() <= limits.max):
        raise ValueError(f"{name} have to be between {limits.min} and {limits.max}")
    return np.require(array, scalar, ["C", "A"])


def number(name: str, value: Any) -> float:
    if np.ndim(value) != 0 or np.asarray(value).dtype.kind not in "fiu":
        raise TypeError(f"{name} is {value!r}; give a number")
    return float(value)


def vector(name: str, values: ArrayLike, shape: Tuple[int, ...] = (3,)) -> list:
    """The numbers of a vector or matrix, row by row."""
    array = numbers(f"numbers of {name}", values)
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}; give {shape}")
    return array.ravel().tolist()


def integer(name: str, value: Any, scalar: type = np.int32) -> int:
    """A whole number that `scalar` can hold."""
    try:
        found = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {value!r}; give a whole number") from None
    limits: Any = np.iinfo(scalar)
    if not limits.min <= found <= limits.max:
        raise ValueError(f"{name} is {found}; give a number from {limits.min} to {limits.max}")
    return found


def rows(name: str, array: np.ndarray) -> np.ndarray:
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} have shape {array.shape}; give (n, 3)")
    return array


def corners(triangles: ArrayLike) -> np.ndarray:
    """The corners of triangles, (m, 3) int32, as a copy."""
    array = np.asarray(triangles)
    flat = whole("triangles", array.reshape(-1), np.int32)
    return rows("triangles", flat.reshape(array.shape)).copy()


def refuse_radii(name: str, values: Any) -> None:
    """Refuses a number or a row of numbers in the place of points."""
    if np.ndim(values) == 0 and np.asarray(values).dtype.kind in "fiu":
        raise TypeError(
            f"the number {values!s} is in the place of {name}; give a radius by name: "
            f"radius={values!s}"
        )
    if isinstance(values, (list, tuple)):
        are_flat = len(values) > 0 and np.ndim(values[0]) == 0
    else:
        are_flat = np.ndim(values) < 2
    if are_flat:
        what = values if np.ndim(values) == 0 else f"of shape {np.shape(values)}"
        raise TypeError(f"{name} are {what}; give points (n, 3), and radii by name: radii=...")


def is_array(points: Any) -> bool:
    """Whether points are one array, also that of another library, and no list of arrays."""
    if hasattr(points, "__array__"):
        return np.asarray(points).dtype != object
    return isinstance(points, memoryview)


def points_and_offsets(
    points: Any, offsets: Optional[ArrayLike], name: str = "points"
) -> Tuple[np.ndarray, np.ndarray]:
    """The points of all fibers, and their offsets.

    Without offsets, points are a list of arrays (n, 3), one for each fiber, or an array (fibers, n,
    3).
    """
    if offsets is not None:
        begin = whole_offsets(
            offsets
        )  # first, because points without offsets may have other shapes
        array = numbers(name, points, keeps_strides=True)
        if array.ndim == 3:
            raise ValueError(
                f"{name} have shape {array.shape}; give (n, 3), or leave out the offsets"
            )
        check_offsets(begin, len(rows(name, array)))
        return array, begin
    if is_array(points):
        array = numbers(name, points, keeps_strides=True)
        if array.ndim == 2:
            raise TypeError(f"offsets are missing; for a single fiber give [{name}]")
        if array.ndim != 3 or array.shape[2] != 3:
            raise ValueError(f"{name} have shape {array.shape}; give (fibers, n, 3)")
        fibers, count = array.shape[:2]
        return array.reshape(-1, 3), np.arange(fibers + 1, dtype=np.int64) * count
    if not np.iterable(points):
        raise TypeError(f"{name} are a {type(points).__name__}; give arrays of shape (n, 3)")
    parts = [rows(f"points of fiber {f}", numbers("points", p, True)) for f, p in enumerate(points)]
    begin = np.zeros(len(parts) + 1, np.int64)
    np.cumsum([len(part) for part in parts], out=begin[1:])
    if not parts:
        return np.empty((0, 3)), begin
    return np.concatenate(parts), begin


def whole_offsets(offsets: ArrayLike) -> np.ndarray:
    if np.ndim(offsets) == 0 and np.asarray(offsets).dtype.kind in "fiu":
        raise TypeError(
            f"the number {offsets!s} is in the place of offsets; give a radius by name: "
            f"radius={offsets!s}"
        )
    array = unmasked("offsets", offsets)
    if array.dtype.kind == "f" and array.size > 0:
        raise TypeError(
            f"offsets are {type_of(array)}; give whole numbers, and radii by name: radii=..."
        )
    if array.ndim != 2:
        return whole("offsets", array, np.int64)
    if array.shape[1] != 2:
        raise ValueError(f"offsets have shape {array.shape}; give (fibers + 1,) or (fibers, 2)")
    return whole("offsets", array.reshape(-1), np.int64).reshape(-1, 2)


def check_offsets(offsets: np.ndarray, point_count: int) -> None:
    if offsets.ndim == 2:
        limits = np.array([0, *offsets.ravel().tolist(), point_count])
        fall = np.flatnonzero(limits[1:] < limits[:-1])
        if len(fall) > 0:
            f = min(fall[0] // 2, len(offsets) - 1)
            raise ValueError(
                f"fiber {f} has the offsets {offsets[f].tolist()}; give a begin and an end that "
                f"ascend from fiber to fiber, from 0 to {point_count}, the number of points"
            )
        return
    if len(offsets) == 0:
        raise ValueError("offsets are empty; give one number more than there are fibers")
    if offsets[0] != 0 or offsets[-1] != point_count:
        raise ValueError(
            f"offsets run from {offsets[0]} to {offsets[-1]}; they have to run from 0 to "
            f"{point_count}, the number of points"
        )
    fall = np.flatnonzero(offsets[1:] < offsets[:-1])
    if len(fall) > 0:
        f = fall[0]
        raise ValueError(f"offsets descend at fiber {f}, from {offsets[f]} to {offsets[f + 1]}")


def begin_and_end(offsets: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Of each fiber the first point, and one past the last point."""
    return (offsets[:-1], offsets[1:]) if offsets.ndim == 1 else (offsets[:, 0], offsets[:, 1])


def without_gaps(
    points: np.ndarray, offsets: np.ndarray, radii: np.ndarray, kind: int
) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, offsets and radii without points of no fiber, each in one piece, for files."""
    if offsets.ndim == 1:
        return np.ascontiguousarray(points), offsets, radii
    begin, end = begin_and_end(offsets)
    counts = end - begin
    packed = np.concatenate(([0], np.cumsum(counts)))
    kept = np.repeat(begin - packed[:-1], counts) + np.arange(packed[-1])
    if kind == PER_POINT:
        radii = radii[kept]
    if kind == PER_FIRST_POINT:
        radii = radii[kept]
        radii[packed[1:][counts > 0] - 1] = 0  # no segment starts there, so it may be NaN
    return points[kept], packed, radii


def one_of(radius: Optional[float], radii: Any) -> Any:
    """Radii, which may be given as one radius."""
    if radius is None:
        return radii
    if radii is not None:
        raise TypeError("radius and radii are both given; give one of them")
    return number("radius", radius)


def radii_of(radii: Any, points: np.ndarray, offsets: np.ndarray) -> Tuple[np.ndarray, int]:
    """The radii as C++ takes them, and for what each counts."""
    if radii is None:
        raise TypeError("radii are missing; give a number, or one for each fiber, segment or point")
    begin, end = begin_and_end(offsets)
    if isinstance(radii, PointRadii) and radii.ndim > 1:
        radii = list(radii)
    if isinstance(radii, (list, tuple)) and any(isinstance(r, PointRadii) for r in radii):
        radii = joined_point_radii(radii, len(points), begin, end)
    if isinstance(radii, PointRadii) and radii.ndim > 0:
        if radii.shape != (len(points),):
            raise ValueError(
                f"radii at points have shape {radii.shape} for {len(points)} points; give one for "
                "each point"
            )
        return in_type_of(points, numbers("radii", radii)), PER_POINT
    is_joined = isinstance(radii, (list, tuple)) and len(radii) > 0 and np.ndim(radii[0]) > 0
    if is_joined:
        radii = joined_radii([numbers("radii", r) for r in radii], end - begin)
    array = numbers("radii", radii)
    if array.ndim == 0:
        return in_type_of(points, array.reshape(1)), ONE
    if array.ndim != 1:
        array, is_joined = joined_radii(list(array), end - begin), True
    meanings = []
    if len(array) == len(begin) and not is_joined:
        meanings.append((array, PER_FIBER))
    # With gaps, the last number, which is never read, may be missing, as in PyElastica's arrays.
    gaps = offsets.ndim == 2
    if len(array) == len(points) or (gaps and len(array) == len(points) - 1):
        per_point = array if len(array) == len(points) else np.pad(array, (0, 1))
        meanings.append((per_point, PER_FIRST_POINT))
    # A segment starts at each point of a fiber except for the last one.
    long = end - begin > 1
    steps = np.zeros(len(points), np.int8)
    steps[begin[long]] = 1
    steps[end[long] - 1] = -1
    starts = np.cumsum(steps, dtype=np.int8).view(bool)
    if len(array) == np.count_nonzero(starts):
        per_point = np.zeros(len(points), array.dtype)
        per_point[starts] = array
        meanings.append((per_point, PER_FIRST_POINT))
    if not meanings:
        raise ValueError(
            f"there are {len(array)} radii for {len(begin)} fibers, {np.count_nonzero(starts)} "
            f"segments and {len(points)} points; give one number, or as many as one of these"
        )
    if len(meanings) > 1:
        counts = np.maximum(end - begin - 1, 0)
        spread = [np.repeat(a, counts) if kind == PER_FIBER else a[starts] for a, kind in meanings]
        if any(not np.array_equal(s, spread[0], equal_nan=True) for s in spread[1:]):
            raise ValueError(
                f"{len(array)} radii could be one for each fiber, segment or point, because there "
                "are as many of these; give a list with an array of radii for each fiber"
            )
        # Those of fibers are all read, those of points only where segments start.
        read_is_right, all_are_right = (np.all((r >= 0) & (r < np.inf)) for r in (spread[0], array))
        if read_is_right and not all_are_right:
            meanings.reverse()
    chosen, kind = meanings[0]
    return in_type_of(points, chosen), kind


def joined_radii(parts: Sequence[np.ndarray], points: np.ndarray) -> np.ndarray:
    """The radii of all segments, given those of each fiber and its number of points."""
    if len(parts) != len(points):
        raise ValueError(f"radii are those of {len(parts)} fibers instead of {len(points)}")
    segments = np.maximum(points - 1, 0)
    given = [part.shape for part in parts]
    for counts in (points, segments):
        if given == [(count,) for count in counts]:
            return np.concatenate([part[:count] for part, count in zip(parts, segments)])
    for f, shape in enumerate(given):
        if shape not in ((points[f],), (segments[f],)):
            raise ValueError(
                f"radii of fiber {f} have shape {shape}; it has {points[f]} points, so give as "
                f"many, or {segments[f]}, one for each segment"
            )
    raise ValueError("radii are for points in some fibers and for segments in others; choose one")


def joined_point_radii(
    parts: Sequence[Any], point_count: int, begin: np.ndarray, end: np.ndarray
) -> PointRadii:
    """The radii at all points, given those of each fiber; they are 0 at points of no fiber."""
    if len(parts) != len(begin):
        raise ValueError(f"radii are those of {len(parts)} fibers instead of {len(begin)}")
    joined = np.zeros(point_count)
    for f, part in enumerate(parts):
        if not isinstance(part, PointRadii):
            raise TypeError(
                f"radii of fiber {f} are no PointRadii, and those of another fiber are; give "
                "PointRadii for all fibers or for none"
            )
        if part.shape != (end[f] - begin[f],):
            raise ValueError(
                f"radii at points of fiber {f} have shape {part.shape}; it has "
                f"{end[f] - begin[f]} points, so give as many"
            )
        joined[begin[f] : end[f]] = numbers("radii", part)
    return PointRadii(joined)


def in_type_of(points: np.ndarray, radii: np.ndarray) -> np.ndarray:
    if points.dtype == radii.dtype:
        return np.ascontiguousarray(radii)
    with np.errstate(over="ignore"):
        converted = radii.astype(points.dtype)
    low = converted < radii
    converted[low] = np.nextafter(converted[low], np.inf, dtype=points.dtype)
    return converted


def flags_of(closed: Optional[ArrayLike]) -> Optional[np.ndarray]:
    if closed is None:
        return None
    array = whole("closed", closed, np.uint8)
    if array.size > 0 and array.max() > 1:
        raise ValueError("closed have to be 0 or 1, or False or True")
    return array


def layout_of(
    points: np.ndarray,
    offsets: np.ndarray,
    closed: Optional[ArrayLike] = None,
    groups: Optional[ArrayLike] = None,
    meets: Optional[ArrayLike] = None,
    root_segments: Optional[ArrayLike] = None,
    categories: Optional[ArrayLike] = None,
    starts_at: Optional[ArrayLike] = None,
    ends_at: Optional[ArrayLike] = None,
) -> _core.Layout:
    begin, end = begin_and_end(offsets)
    by_fiber = {
        "closed": flags_of(closed),
        "groups": None if groups is None else whole("groups", groups, np.int32),
        "meets": None if meets is None else whole("meets", meets, np.uint32),
        "root_segments": (
            None if root_segments is None else whole("root_segments", root_segments, np.int32)
        ),
        "categories": None if categories is None else whole("categories", categories, np.uint32),
        "starts_at": None if starts_at is None else whole("starts_at", starts_at, np.int32),
        "ends_at": None if ends_at is None else whole("ends_at", ends_at, np.int32),
    }
    for name, array in by_fiber.items():
        if array is not None and len(array) != len(begin):
            raise ValueError(
                f"{name} are {len(array)} for {len(begin)} fibers; give one for each fiber"
            )
    ends = None
    if offsets.ndim == 2:
        offsets, ends = np.append(begin, len(points)), np.append(end, len(points))
    return _core.Layout(offsets, ends, **by_fiber)
