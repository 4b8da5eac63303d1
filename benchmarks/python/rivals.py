# SPDX-License-Identifier: BSD-3-Clause
"""What Python programs do without this library: two ways to find the segments that touch.

Both are written for this benchmark, along the lines of the programs that they are named after.
"""

import numba
import numpy as np
from scipy.spatial import cKDTree


class AllElements:
    """As PyElastica: a box for each rod, and all pairs of elements of two rods whose boxes overlap.

    PyElastica calls Numba for each pair of rods; here one call goes through all of them. Like
    PyElastica, it first compares how far the starts of two elements are apart.
    """

    def __init__(self, offsets, radius):
        self.offsets, self.radius = offsets, radius

    def step(self, points):
        return all_elements(points, self.offsets, self.radius)


class MidpointTree:
    """As scilpy: a k-d tree of the segments' midpoints, and an exact test of those that are near.

    scilpy asks for the neighbours of one segment after the other and tests them one by one in
    Python. Here SciPy lists all pairs in one call, and NumPy tests them in blocks.
    """

    BLOCK = 1 << 15  # pairs whose arrays stay in the processor's cache

    def __init__(self, offsets, radius):
        starts = np.ones(offsets[-1], bool)
        starts[offsets[1:] - 1] = False
        self.starts = np.flatnonzero(starts)
        self.radius = radius

    def step(self, points):
        starts = self.starts
        edges = points[starts + 1] - points[starts]
        middles = points[starts] + edges / 2
        longest = np.sqrt(np.max(np.einsum("nc,nc->n", edges, edges)))
        # Neither option makes the query faster, and both make the tree slower to build.
        tree = cKDTree(middles, balanced_tree=False, compact_nodes=False)
        near = tree.query_pairs(longest + 2 * self.radius, output_type="ndarray")
        touching = [np.empty((0, 2), np.int64)]
        for first in range(0, len(near), self.BLOCK):
            a, b = starts[near[first : first + self.BLOCK]].T
            # Starts are ascending and query_pairs() has the lower first. Neighbours along a fiber
            # are adjacent points, since the last point of a fiber starts no segment.
            apart = b - a > 1
            a, b = a[apart], b[apart]
            squared = squared_distances(points[a], points[a + 1], points[b], points[b + 1])
            close = squared <= (2 * self.radius) ** 2
            touching.append(np.stack([a[close], b[close]], axis=1))
        return np.concatenate(touching)


def squared_distances(a0, a1, b0, b1):
    """Between segments, row by row: Ericson, Real-Time Collision Detection, section 5.1.9."""
    d1, d2, r = a1 - a0, b1 - b0, a0 - b0
    a, e = np.einsum("nc,nc->n", d1, d1), np.einsum("nc,nc->n", d2, d2)
    b, c, f = (np.einsum("nc,nc->n", x, y) for x, y in ((d1, d2), (d1, r), (d2, r)))
    area = a * e - b * b
    crossing = area > 1e-12 * a * e
    s = np.clip(np.where(crossing, b * f - c * e, 0) / np.where(crossing, area, 1), 0, 1)
    t = np.clip((b * s + f) / e, 0, 1)
    s = np.clip((b * t - c) / a, 0, 1)
    way = r + s[:, np.newaxis] * d1 - t[:, np.newaxis] * d2
    return np.einsum("nc,nc->n", way, way)


@numba.njit
def dot(x0, x1, x2, y0, y1, y2):
    return x0 * y0 + x1 * y1 + x2 * y2


@numba.njit
def difference(points, i, j):
    return (
        points[i, 0] - points[j, 0],
        points[i, 1] - points[j, 1],
        points[i, 2] - points[j, 2],
    )


@numba.njit
def clip(x):
    return min(max(x, 0.0), 1.0)


@numba.njit
def squared_distance(points, i, j):
    """Between the segments that start at points i and j, as above."""
    u0, u1, u2 = difference(points, i + 1, i)
    v0, v1, v2 = difference(points, j + 1, j)
    r0, r1, r2 = difference(points, i, j)
    a, e = dot(u0, u1, u2, u0, u1, u2), dot(v0, v1, v2, v0, v1, v2)
    b, c = dot(u0, u1, u2, v0, v1, v2), dot(u0, u1, u2, r0, r1, r2)
    f = dot(v0, v1, v2, r0, r1, r2)
    area = a * e - b * b
    s = clip((b * f - c * e) / area) if area > 1e-12 * a * e else 0.0
    t = clip((b * s + f) / e)
    s = clip((b * t - c) / a)
    w0, w1, w2 = r0 + s * u0 - t * v0, r1 + s * u1 - t * v1, r2 + s * u2 - t * v2
    return dot(w0, w1, w2, w0, w1, w2)


@numba.njit
def rod_boxes(points, offsets, radius):
    boxes = np.empty((len(offsets) - 1, 2, 3))
    for rod in range(len(boxes)):
        for k in range(3):
            own = points[offsets[rod] : offsets[rod + 1], k]
            boxes[rod, 0, k], boxes[rod, 1, k] = own.min() - radius, own.max() + radius
    return boxes


@numba.njit
def all_elements(points, offsets, radius):
    boxes = rod_boxes(points, offsets, radius)
    lengths = np.empty(len(points))
    for i in range(len(points) - 1):
        d0, d1, d2 = difference(points, i + 1, i)
        lengths[i] = np.sqrt(dot(d0, d1, d2, d0, d1, d2))
    found, count = np.empty((1024, 2), np.int64), 0
    for one in range(len(boxes)):
        for two in range(one, len(boxes)):
            overlap = True
            for k in range(3):
                if boxes[one, 1, k] < boxes[two, 0, k] or boxes[two, 1, k] < boxes[one, 0, k]:
                    overlap = False
            if not overlap:
                continue
            for i in range(offsets[one], offsets[one + 1] - 1):
                first = i + 2 if one == two else offsets[two]
                for j in range(first, offsets[two + 1] - 1):
                    d0, d1, d2 = difference(points, i, j)
                    reach = lengths[i] + lengths[j] + 2 * radius
                    if d0 * d0 + d1 * d1 + d2 * d2 > reach * reach:
                        continue
                    if squared_distance(points, i, j) <= 4 * radius * radius:
                        if count == len(found):
                            larger = np.empty((2 * count, 2), np.int64)
                            larger[:count] = found
                            found = larger
                        found[count, 0], found[count, 1] = i, j
                        count += 1
    return found[:count]
