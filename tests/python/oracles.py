# SPDX-License-Identifier: BSD-3-Clause
"""Brute force in NumPy, over all pairs, which shares no code with the library.

Distances come from formulas whose value is always that of some pair of points, so that rounding can
only make them a little too long. `Scene` holds fibers and tells which of their segments touch.
"""

from __future__ import annotations

import dataclasses
from typing import Optional

import numpy as np

EPS = np.finfo(float).eps


def dot(a, b):
    return np.einsum("...i,...i", a, b)


def length(a):
    return np.sqrt(dot(a, a))


def ratio(a, b):
    """a / b in [0, 1], and 0 where b is 0."""
    return np.clip(np.divide(a, b, out=np.zeros(np.broadcast(a, b).shape), where=b != 0), 0, 1)


def point_segment(p, a, b):
    """Distances of points p from segments a b."""
    along = b - a
    s = ratio(dot(p - a, along), dot(along, along))
    # The difference first, as it is exact where coordinates are large.
    return length(a - p + s[..., None] * along)


def segment_segment(a0, a1, b0, b1):
    """Distances of segments a0 a1 from b0 b1: at an end of one of them, or between both."""
    u, v, w = a1 - a0, b1 - b0, b0 - a0
    ends = (
        point_segment(a0, b0, b1),
        point_segment(a1, b0, b1),
        point_segment(b0, a0, a1),
        point_segment(b1, a0, a1),
    )
    normal = np.cross(u, v)
    square = dot(normal, normal)
    s = ratio(dot(np.cross(w, v), normal), square)
    t = ratio(dot(np.cross(w, u), normal), square)
    between = length(w + t[..., None] * v - s[..., None] * u)
    return np.minimum.reduce(np.broadcast_arrays(*ends, between))


def segment_error(a0, a1, b0, b1):
    """How much too long segment_segment() may be.

    The place of the closest points between two axes at a small angle has an error of eps / angle.
    Below sqrt(eps) the ends are as near as the closest points, up to sqrt(eps) of the lengths.
    """
    u, v = a1 - a0, b1 - b0
    product = length(u) * length(v)
    sine = np.divide(length(np.cross(u, v)), product, out=np.ones(product.shape), where=product > 0)
    size = length(u) + length(v) + length(b0 - a0)
    return 16 * EPS / np.maximum(sine, np.sqrt(EPS)) * size


def triangle_normal(t):
    return np.cross(t[..., 1, :] - t[..., 0, :], t[..., 2, :] - t[..., 0, :])


def segment_triangle(a, b, t):
    """Distances of segments a b from triangles t (..., 3, 3).

    They are closest at an edge, or at an end of the segment above the triangle, or cross.
    """
    normal = triangle_normal(t)
    area = length(normal)
    unit = np.divide(normal, area[..., None], out=np.zeros(normal.shape), where=area[..., None] > 0)
    candidates = [segment_segment(a, b, t[..., i - 1, :], t[..., i, :]) for i in range(3)]

    def within(p):
        sides = [
            dot(np.cross(t[..., i, :] - t[..., i - 1, :], p - t[..., i, :]), unit) for i in range(3)
        ]
        return (np.minimum.reduce(sides) >= 0) & (area > 0)

    height_a, height_b = dot(a - t[..., 0, :], unit), dot(b - t[..., 0, :], unit)
    for p, height in ((a, height_a), (b, height_b)):
        candidates.append(np.where(within(p), np.abs(height), np.inf))
    s = ratio(height_a, height_a - height_b)
    crosses = (height_a * height_b <= 0) & (height_a != height_b)
    candidates.append(np.where(crosses & within(a + s[..., None] * (b - a)), 0, np.inf))
    return np.minimum.reduce(np.broadcast_arrays(*candidates))


def inside(p, triangles):
    """Whether points are inside a watertight mesh (n, 3, 3): the solid angles of its triangles add
    up to 4 pi, and to 0 outside."""
    r = triangles[None] - p[:, None, None, :]
    a, b, c = r[:, :, 0], r[:, :, 1], r[:, :, 2]
    x, y, z = length(a), length(b), length(c)
    volume = dot(a, np.cross(b, c))
    rest = x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y
    return np.sum(2 * np.arctan2(volume, rest), axis=1) > 2 * np.pi


def segment_box(a, b, low, high):
    """Distances of segments from one solid box, by the convex function along the segment."""
    low, high = np.asarray(low, float), np.asarray(high, float)

    def gap(s):
        p = a + s[..., None] * (b - a)
        return length(p - np.clip(p, low, high))

    left, right = np.zeros(len(a)), np.ones(len(a))
    for _ in range(200):  # ternary search
        third = (right - left) / 3
        nearer_left = gap(left + third) <= gap(right - third)
        left, right = (
            np.where(nearer_left, left, left + third),
            np.where(nearer_left, right - third, right),
        )
    return np.minimum.reduce([gap(np.zeros(len(a))), gap(np.ones(len(a))), gap((left + right) / 2)])


@dataclasses.dataclass
class Scene:
    """Fibers in the arrays of FiberTree.build(), with a radius for each point."""

    points: np.ndarray
    offsets: np.ndarray
    radii: np.ndarray
    closed: Optional[np.ndarray] = None
    groups: Optional[np.ndarray] = None

    def __post_init__(self):
        fibers = len(self.offsets) - 1
        fiber_of_point = np.repeat(np.arange(fibers), np.diff(self.offsets))
        # A segment is named by its first point, which is not the last of a fiber.
        self.names = np.flatnonzero(
            np.arange(len(self.points)) + 1 < self.offsets[fiber_of_point + 1]
        )
        self.fiber = fiber_of_point[self.names]
        self.number = self.names - self.offsets[self.fiber]
        self.count = np.diff(self.offsets)[self.fiber] - 1  # segments of its fiber
        points = self.points.astype(float)
        self.start, self.end = points[self.names], points[self.names + 1]
        self.radius = np.broadcast_to(self.radii, len(points)).astype(float)[self.names]

    @property
    def arguments(self):
        return dict(
            points=self.points,
            offsets=self.offsets,
            radii=self.radii,
            closed=self.closed,
            groups=self.groups,
        )

    def extent(self):
        return float(np.ptp(self.points.astype(float), axis=0).max()) if len(self.points) else 0.0

    def kept(self, ignored_neighbors=0, ignored_arc_length=0.0):
        """Which pairs a query of one tree may report, as (segments, segments)."""
        kept = self.names[:, None] < self.names
        same = self.fiber[:, None] == self.fiber
        apart = np.abs(self.number[:, None] - self.number)
        if self.closed is not None:
            ring = self.closed.astype(bool)[self.fiber]
            apart = np.where(ring & same, np.minimum(apart, self.count - apart), apart)
        if ignored_neighbors > 0:
            kept &= ~(same & (apart <= ignored_neighbors))
        if ignored_arc_length > 0:
            lengths = length(self.end - self.start)
            begin = np.cumsum(lengths) - lengths
            between = begin[None, :] - (begin + lengths)[:, None]
            if self.closed is not None:
                total = np.bincount(self.fiber, lengths, len(self.offsets) - 1)[self.fiber]
                around = total - between - lengths - lengths[:, None]
                between = np.where(ring, np.minimum(between, around), between)
            kept &= ~(same & (np.maximum(between, 0) <= ignored_arc_length * (1 + 1e-12)))
        if self.groups is not None:
            group = self.groups[self.fiber]
            kept &= ~((group[:, None] == group) & (group != 0))
        return kept


def gaps(a, b, report="capsules", volumes="boxes"):
    """How far surfaces, boxes or spheres of all pairs of two scenes are apart, and its error."""
    p, q = (a.start[:, None], a.end[:, None]), (b.start, b.end)
    radii = a.radius[:, None] + b.radius
    extent = max(a.extent(), b.extent()) + 2 * (radii.max() if radii.size else 0)
    if len(a.points) and len(b.points):
        extent += float(np.abs(a.points[0].astype(float) - b.points[0]).max())
    if report == "capsules":
        # The library's own promise is 256 eps of the extent and the lengths.
        return segment_segment(*p, *q) - radii, segment_error(*p, *q) + 512 * EPS * extent
    error = np.full(radii.shape, 2.0**-19 * extent)  # the promise is 2^-20
    if volumes == "spheres":
        half = length(p[1] - p[0]) / 2 + length(q[1] - q[0]) / 2
        return length((p[0] + p[1] - q[0] - q[1]) / 2) - half - radii, error
    apart = np.maximum(
        np.minimum(*p) - np.maximum(*q),
        np.minimum(*q) - np.maximum(*p),
    )
    return apart.max(axis=-1) - radii, error


def as_set(rows):
    """Rows as a set, which has each row once."""
    rows = np.asarray(rows)
    found = set(map(tuple, rows.tolist())) if rows.ndim == 2 else set(rows.tolist())
    assert len(found) == len(rows), "a row comes twice"
    return found


def check(found, names_a, names_b, gap, error, kept=True):
    """That rows `found` are the pairs whose gap is at most 0, but for those within the error."""
    found = as_set(found)

    def pairs(of):
        i, j = np.nonzero(of & kept)
        return set(zip(names_a[i].tolist(), names_b[j].tolist()))

    missed = pairs(gap <= -error) - found
    wrong = found - pairs(gap <= error)
    assert not missed and not wrong, (sorted(missed)[:5], sorted(wrong)[:5])


def check_pairs(found, scene, margin=0.0, report="capsules", volumes="boxes", **ignored):
    gap, error = gaps(scene, scene, report, volumes)
    check(found, scene.names, scene.names, gap - margin, error, scene.kept(**ignored))
