# SPDX-License-Identifier: BSD-3-Clause
"""Files of fibers and meshes."""

from __future__ import annotations

import os
import secrets
import warnings
from numbers import Integral
from typing import Any, Callable, List, NamedTuple, Optional, Tuple, Union

import numpy as np

from . import _arrays, _core
from ._arrays import ArrayLike, Points


class _Arrays(NamedTuple):
    points: np.ndarray
    offsets: np.ndarray
    radii: Union[float, np.ndarray, None]
    closed: Optional[np.ndarray]


class Fibers(_Arrays):
    """Fibers in the order of FiberTree.build(): tree.build(*fibers).

    points   (n, 3) float64
    offsets  (fibers + 1,) int64: fiber f has points[offsets[f]:offsets[f + 1]]
    radii    a number; PointRadii (n,), between which segments taper; or None if the file has none
    closed   (fibers,) bool, or None if no fiber is closed

    Not among these four are the following, each None if the file has none. build(fibers) and
    show(fibers) know the branches, build(fibers) the groups, and build(*fibers) neither.
    write(path, fibers) writes all but groups to a .vtp file, and fibers._replace() and copies keep
    them.

    starts_at  (fibers,) int32: the point of a fiber that the first point of each repeats, or -1, as
               in FiberTree.build()
    ends_at    (fibers,) int32: the point of a fiber that the last point of each repeats, or -1
    samples    (n,) int64: the sample of an .swc file that each point is. A segment goes to a sample
               from its parent, so samples[contacts["a"] + 1] tell the first segments of contacts
    types      (n,) int64: the types of these
    groups     (fibers,) int32: as in FiberTree.build(); None unless read() is told where they are
    group_values  float64, ascending: the number in the file of each group g is group_values[g - 1]
    """

    starts_at: Optional[np.ndarray] = None
    ends_at: Optional[np.ndarray] = None
    samples: Optional[np.ndarray] = None
    types: Optional[np.ndarray] = None
    groups: Optional[np.ndarray] = None
    group_values: Optional[np.ndarray] = None

    def _replace(self, **arrays: Any) -> Fibers:
        """Fibers with other arrays, also in the place of those that are not among the four."""
        more = {name: arrays.pop(name, getattr(self, name)) for name in Fibers.__annotations__}
        fibers = super()._replace(**arrays)
        vars(fibers).update(more)
        return fibers

    __replace__ = _replace  # of copy.replace()


class FiberFileWarning(UserWarning):
    """What a user of a file should know.

    Such are columns that are not read, points too coarse for the radius, data that a format cannot
    hold.
    """


def read(
    path: Union[str, os.PathLike],
    radius: Optional[float] = None,
    segments_per_span: int = 4,
    radius_from: Union[str, int, None] = None,
    groups_from: Union[str, int, None] = None,
) -> Fibers:
    """Reads a file of fibers: .hair, .tfx, .bcc, .vtp, .tck, .trk, .swc, or text, also packed by
    gzip.

    radius             of all fibers, in the file's unit. It replaces the radii in the file.
    segments_per_span  straight segments for each span of a .bcc spline
    radius_from        where the radii are, instead of `radius`: in a .vtp file the name of an array
                       of points or of cells; in text the number of a column, from 4 on
    groups_from        where the number is by which fibers are in groups: an array or a column as
                       for `radius_from`, or "type" of an .swc file. Of points, the last one of a
                       fiber counts.

    Points are in the unit and the frame of the file. Those of a .trk file are in millimetres of
    the scanner (RAS+). What is odd in a file is a FiberFileWarning.

    A file that cannot be opened raises OSError. A damaged one raises ValueError, which tells the
    place, and so does an option that does not fit the file.
    """
    radius = None if radius is None else _arrays.number("radius", radius)
    segments_per_span = _arrays.integer("segments_per_span", segments_per_span)
    arrays, more, remarks = _content(
        _core.read,
        path,
        radius,
        segments_per_span,
        _name("radius_from", radius_from),
        _name("groups_from", groups_from),
    )
    for remark in remarks:
        warnings.warn(f"{os.fsdecode(path)}: {remark}", FiberFileWarning, stacklevel=2)
    points, offsets, radii, closed = arrays
    if isinstance(radii, np.ndarray):
        radii = radii.view(_arrays.PointRadii)
    fibers = Fibers(points, offsets, radii, closed)
    vars(fibers).update(zip(Fibers.__annotations__, more))
    return fibers


def read_mesh(path: Union[str, os.PathLike]) -> Tuple[np.ndarray, np.ndarray]:
    """Reads a Wavefront OBJ file, also packed by gzip: TriangleMesh(*read_mesh(path)).

    The points are (n, 3) float64, all of the file, and the triangles (m, 3) int32. A face of k
    points becomes k - 2 triangles. Raises errors as read() does.
    """
    return _content(_core.read_mesh, path)


def _content(read: Callable[..., Any], path: Union[str, os.PathLike], *more: Any) -> Any:
    with open(path, "rb"):  # Python's own error, if it is missing
        pass
    try:
        return read(os.fsencode(path), *more)
    except RuntimeError as error:
        raise ValueError(str(error)) from None


def _name(option: str, name: Union[str, int, None]) -> bytes:
    if name is None:
        return b""
    text = f"{option} is {name!r}; give the name of an array, or the number of a column"
    if isinstance(name, str):
        if not name or "\0" in name:
            raise ValueError(text)
        return os.fsencode(name)
    if not isinstance(name, Integral):
        raise TypeError(text)
    return str(name).encode()


def write(
    path: Union[str, os.PathLike],
    points: Union[Points, Fibers],
    offsets: Optional[ArrayLike] = None,
    radii: Optional[Points] = None,
    closed: Optional[ArrayLike] = None,
    *,
    radius: Optional[float] = None,
) -> None:
    """Writes fibers to a file that ends in .vtp (ParaView), .hair or .txt, whole or not at all.

    Fibers are passed as read() returns them, write(path, fibers), or as to FiberTree.build(). Files
    hold PointRadii; of radii of segments, a point gets the larger one of its two. Branches, samples
    and types are those of Fibers, and .vtp alone has a place for them; where they are lost, a
    FiberFileWarning tells so. Text has no place for radii, and .hair rounds to float32. Both refuse
    fibers without points. Points of no fiber are left out.
    """
    more: List[Optional[ArrayLike]] = [None] * 4
    radii = _arrays.one_of(radius, radii)
    if isinstance(points, Fibers):
        if not (offsets is None and radii is None and closed is None):
            raise TypeError("fibers come with offsets, radii and closed; give them alone")
        more = [points.starts_at, points.ends_at, points.samples, points.types]
        points, offsets, radii, closed = points
    path = os.fsdecode(path)
    ending = os.path.splitext(path)[1].lower()
    if ending not in (".vtp", ".hair", ".txt"):
        packed = ", and pack it by gzip afterwards" if ending == ".gz" else ""
        raise ValueError(f"{path!r}: give a file that ends in .vtp, .hair or .txt{packed}")
    array, begin = _arrays.points_and_offsets(points, offsets)
    values, kind = _arrays.radii_of(0.0 if radii is None else radii, array, begin)
    if begin.ndim == 2 and any(numbers is not None for numbers in more):
        raise ValueError("branches and samples need offsets (fibers + 1,), without gaps")
    array, begin, values = _arrays.without_gaps(array, begin, values, kind)
    layout = _arrays.layout_of(array, begin, closed)
    _check_readable(array, begin, values, closed)
    starts_at, ends_at = branches_of(more[0], more[1], array, begin)
    samples, types = (
        _of_points(name, given, len(array)) for name, given in zip(("samples", "types"), more[2:])
    )
    empty = np.flatnonzero(begin[1:] == begin[:-1])
    if len(empty) > 0 and ending != ".vtp":
        raise ValueError(f"fiber {empty[0]} has no points; leave it out, or write a .vtp file")
    has_branches = any(joins is not None and (joins >= 0).any() for joins in (starts_at, ends_at))
    if ending != ".vtp" and (has_branches or samples is not None or types is not None):
        kind_of_file = "text" if ending == ".txt" else ending
        warnings.warn(
            f"{path}: {kind_of_file} has no place for branches, samples and types; write .vtp to "
            "keep them",
            FiberFileWarning,
            stacklevel=2,
        )
    numbers = _core.Numbers(array, values, kind)
    target = os.path.realpath(path)  # a link stays one
    draft = os.path.join(os.path.dirname(target), f".fibers-{secrets.token_hex(8)}{ending}")
    try:
        os.close(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    except OSError as error:  # which names the draft
        raise OSError(error.errno, error.strerror, path) from None
    try:
        if ending == ".txt":
            _write_text(draft, array, begin)
        else:
            is_hair = ending == ".hair"
            _core.write(
                os.fsencode(draft), numbers, layout, is_hair, starts_at, ends_at, samples, types
            )
        os.replace(draft, target)
    except BaseException as error:
        os.unlink(draft)
        if isinstance(error, RuntimeError):
            raise OSError(f"{path!r} cannot be written: {error}") from None
        raise


def branches_of(
    starts_at: Optional[ArrayLike],
    ends_at: Optional[ArrayLike],
    points: np.ndarray,
    begin: np.ndarray,
) -> Tuple[Optional[np.ndarray], Optional[np.ndarray]]:
    """Fibers.starts_at and ends_at as C++ takes them."""

    def checked(name: str, given: Optional[ArrayLike], own: np.ndarray) -> Optional[np.ndarray]:
        if given is None:
            return None
        array = _arrays.whole(name, given, np.int32)
        if len(array) != len(own):
            raise ValueError(f"{name} are {len(array)} for {len(own)} fibers; give one for each")
        wrong = (array == own) | (begin[1:] == begin[:-1])
        wrong = (array < -1) | (array >= len(points)) | (wrong & (array >= 0))
        joined = np.flatnonzero(~wrong & (array >= 0))
        wrong[joined] = (points[array[joined]] != points[own[joined]]).any(axis=1)
        if wrong.any():
            f = np.flatnonzero(wrong)[0]
            raise ValueError(
                f"{name} of fiber {f} is {array[f]}; give another point at the same place, or -1"
                " for none"
            )
        return array

    return checked("starts_at", starts_at, begin[:-1]), checked("ends_at", ends_at, begin[1:] - 1)


def _of_points(name: str, given: Optional[ArrayLike], count: int) -> Optional[np.ndarray]:
    if given is None:
        return None
    array = _arrays.whole(name, given, np.int64)
    if len(array) != count:
        raise ValueError(f"{name} are {len(array)} for {count} points; give one for each")
    return array


def _check_readable(
    points: np.ndarray, begin: np.ndarray, radii: np.ndarray, closed: Optional[ArrayLike]
) -> None:
    """Refuses what read() would refuse, or read as something else."""
    if len(points) == 0:
        raise ValueError("there are no points; a file has at least one")
    wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(wrong) > 0:
        raise ValueError(f"point {wrong[0]} is {points[wrong[0]].tolist()}; give finite numbers")
    if not (np.isfinite(radii) & (radii >= 0)).all():
        raise ValueError("radii have to be finite and not negative")
    if closed is not None:
        full = np.asarray(closed, bool) & (begin[1:] > begin[:-1])
        first, last = points[begin[:-1][full]], points[begin[1:][full] - 1]
        open_ones = np.flatnonzero(full)[(first != last).any(axis=1)]
        if len(open_ones) > 0:
            raise ValueError(f"the last point of closed fiber {open_ones[0]} is not its first")


def _write_text(path: str, points: np.ndarray, begin: np.ndarray) -> None:
    """One point per line and a blank line between fibers. Reading restores every bit."""
    with open(path, "w") as file:
        for first, last in zip(begin[:-1], begin[1:]):
            for x, y, z in points[first:last].tolist():
                file.write(f"{x!r} {y!r} {z!r}\n")
            file.write("\n")
