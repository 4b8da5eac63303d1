# SPDX-License-Identifier: BSD-3-Clause
"""The brute force itself, against known distances and against the least of many points."""

import numpy as np
import pytest

import oracles


def vectors(*rows):
    return [np.array(row, float) for row in rows]


@pytest.mark.parametrize(
    "a0, a1, b0, b1, distance",
    [
        ((0, 0, 0), (1, 0, 0), (0.5, -1, 2), (0.5, 1, 2), 2),  # between both
        ((0, 0, 0), (1, 0, 0), (0.5, -1, 0), (0.5, 1, 0), 0),  # crossing
        ((0, 0, 0), (1, 0, 0), (4, 4, 0), (4, 9, 0), 5),  # two ends
        ((0, 0, 0), (1, 0, 0), (0.5, 3, 0), (0.5, 9, 0), 3),  # an end and the inside
        ((0, 0, 0), (4, 0, 0), (1, 2, 0), (9, 2, 0), 2),  # parallel
        ((0, 0, 0), (4, 0, 0), (6, 0, 0), (9, 0, 0), 2),  # collinear
        ((0, 0, 0), (4, 0, 0), (1, 0, 0), (9, 0, 0), 0),  # overlapping
        ((1, 1, 1), (1, 1, 1), (1, 1, 4), (1, 1, 4), 3),  # two points
        ((0, 0, 0), (9, 0, 0), (3, 4, 0), (3, 4, 0), 4),  # a point
    ],
)
def test_known_segments(a0, a1, b0, b1, distance):
    assert oracles.segment_segment(*vectors(a0, a1, b0, b1)) == pytest.approx(distance, rel=1e-15)


def test_segments_are_as_near_as_their_points():
    rng = np.random.default_rng(1)
    a0, a1, b0, b1 = rng.normal(size=(4, 500, 3))
    b1[:100] = b0[:100] + (a1 - a0)[:100] * rng.normal(size=(100, 1))
    b1[100:200] = b0[100:200] + (a1 - a0)[100:200] + 1e-9 * rng.normal(size=(100, 3))
    b0[200:250] = a0[200:250]
    s = np.linspace(0, 1, 101)[:, None, None]
    sampled = np.full(500, np.inf)
    for p in a0 + s * (a1 - a0):
        sampled = np.minimum(sampled, oracles.point_segment(p, b0, b1))
    found = oracles.segment_segment(a0, a1, b0, b1)
    assert (found <= sampled + 1e-12).all()
    assert (found >= sampled - oracles.length(a1 - a0) / 100).all()


@pytest.mark.parametrize(
    "a, b, distance",
    [
        ((1, 1, 3), (1, 1, 9), 3),  # an end above the inside
        ((1, 1, -1), (1, 1, 1), 0),  # crossing
        ((-3, 1, 0), (-2, 1, 4), 12 / np.sqrt(17)),  # beside an edge
        ((-3, -4, 0), (-3, -4, 9), 5),  # beside a corner
        ((1, 1, 0), (1, 2, 0), 0),  # in the plane
        ((1, 1, 2), (3, 1, 2), 2),  # parallel to the plane
    ],
)
def test_known_triangles(a, b, distance):
    triangle = np.array([(0, 0, 0), (4, 0, 0), (0, 4, 0)], float)
    assert oracles.segment_triangle(*vectors(a, b), triangle) == pytest.approx(distance, rel=1e-14)


def test_inside_a_tetrahedron():
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    faces = corners[[(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]]
    points = np.random.default_rng(2).uniform(-0.5, 1.5, (500, 3))
    expected = (points > 0).all(axis=1) & (points.sum(axis=1) < 1)
    assert (oracles.inside(points, faces) == expected).all()


def test_boxes():
    a, b = np.array([(3, 0, 0), (-5, 0.5, 0.5), (0, 2, 2)]), np.array(
        [(3, 9, 0), (5, 0.5, 0.5), (2, 2, 0)]
    )
    assert oracles.segment_box(a, b, (0, 0, 0), (1, 1, 1)) == pytest.approx([2, 0, 1], abs=1e-9)


def test_ring_and_arc_length_rules():
    ring = oracles.Scene(
        np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0)], float),
        np.array([0, 5]),
        np.zeros(1),
        closed=np.array([True]),
    )
    assert np.argwhere(ring.kept(ignored_neighbors=1)).tolist() == [[0, 2], [1, 3]]
    assert not ring.kept(ignored_arc_length=1.0).any()
    assert np.argwhere(ring.kept(ignored_arc_length=0.9)).tolist() == [[0, 2], [1, 3]]
    open_fiber = oracles.Scene(ring.points, ring.offsets, ring.radii)
    assert np.argwhere(open_fiber.kept(ignored_arc_length=1.0)).tolist() == [[0, 3]]
