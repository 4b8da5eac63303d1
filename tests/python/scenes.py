# SPDX-License-Identifier: BSD-3-Clause
"""Fibers and meshes that several tests take."""

import numpy as np

from oracles import Scene


def random_scene(seed=0, fibers=30, points=8, size=1.0, radius=0.05, dtype=float, **rules):
    """Fibers of up to `points` points in a cube, some of them without segments."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, points + 1, fibers)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    steps = rng.normal(scale=0.15 * size, size=(offsets[-1], 3))
    for begin, end in zip(offsets[:-1], offsets[1:]):
        steps[begin:end] = np.cumsum(steps[begin:end], axis=0) + rng.uniform(0, size, 3)
    radii = rng.uniform(0, 2 * radius * size, offsets[-1])
    return Scene(steps.astype(dtype), offsets, radii.astype(dtype), **rules)


def cross(gap=0.0):
    """Two fibers of one segment, which cross at a right angle with `gap` between their axes."""
    points = np.array([(-1, 0, 0), (1, 0, 0), (0, -1, gap), (0, 1, gap)], float)
    return points, np.array([0, 2, 4])


def tetrahedron():
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    return corners, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])


def ball(rings=6, radius=1.0):
    """A sphere of triangles, watertight, counterclockwise from outside."""
    points = [(0, 0, radius)]
    count = 2 * rings
    for i in range(1, rings):
        theta = np.pi * i / rings
        for j in range(count):
            phi = 2 * np.pi * j / count
            points.append(
                radius
                * np.array(
                    (np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta))
                )
            )
    points.append((0, 0, -radius))
    last = len(points) - 1
    triangles = []
    for j in range(count):
        k = (j + 1) % count
        triangles.append((0, 1 + j, 1 + k))
        for i in range(rings - 2):
            upper, lower = 1 + i * count, 1 + (i + 1) * count
            triangles.append((upper + j, lower + j, lower + k))
            triangles.append((upper + j, lower + k, upper + k))
        triangles.append((last, last - count + k, last - count + j))
    return np.array(points), np.array(triangles)
