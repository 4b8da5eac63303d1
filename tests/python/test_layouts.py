# SPDX-License-Identifier: BSD-3-Clause
"""Arrays as programs have them: apart in memory, and with points of no fiber."""

import numpy as np
import pytest

import fcl_fibers
from scenes import random_scene

PLACES = ["a", "b", "layout", "segment"]


def built(*arguments, **named):
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=1)
    tree.build(*arguments, **named)
    return tree


def columns(points):
    return np.ascontiguousarray(points.T).T


def with_a_fourth(points):
    wide = np.full((len(points), 4), np.nan, points.dtype)
    wide[:, :3] = points
    return wide[:, :3]


STRIDED = {
    "columns": columns,
    "float4": with_a_fourth,
    "every third": lambda p: np.repeat(p, 3, axis=0)[::3],
    "backwards": lambda p: p[::-1].copy()[::-1],
    "columns backwards": lambda p: columns(p[:, ::-1])[:, ::-1],
    "big endian columns": lambda p: columns(p.astype(p.dtype.newbyteorder(">"))),
    "one point for all": lambda p: np.broadcast_to(p[:1], p.shape),
}
COPIED = ["big endian columns", "one point for all"]


def without_places(contacts):
    names = [name for name in contacts.dtype.names if name not in PLACES]
    return [contacts[name].tolist() for name in names]


@pytest.mark.parametrize("layout", STRIDED)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_strides_are_read_in_place(layout, dtype):
    scene = random_scene(5, fibers=60, dtype=dtype)
    points = STRIDED[layout](scene.points)
    same = np.array(points, dtype, order="C")
    expected = built(same, scene.offsets, scene.radii)
    tree = built(points, scene.offsets, scene.radii)
    assert (tree.contacts() == expected.contacts()).all()
    assert len(tree.contacts()) > 50
    is_in_place = np.shares_memory(tree._tree.numbers.points, points)
    assert is_in_place == (layout not in COPIED)

    moved = STRIDED[layout](scene.points + dtype(0.25) * scene.points[::-1])
    end = np.array(moved, dtype, order="C")
    tree.update(points, moved)
    expected.update(same, end)
    assert (tree.impacts() == expected.impacts()).all()
    assert (tree.contacts() == expected.contacts()).all()
    assert np.shares_memory(tree._tree.numbers.points, moved) == is_in_place
    found = tree.impact_contacts(tree.impacts())
    assert (found == expected.impact_contacts(tree.impacts())).all()
    assert (
        fcl_fibers.root_segments(points, scene.offsets, 0.3)
        == fcl_fibers.root_segments(same, scene.offsets, 0.3)
    ).all()


def test_rows_of_fibers_are_read_in_place():
    rng = np.random.default_rng(6)
    flat = rng.uniform(size=(3, 120))
    for fibers in (
        flat.reshape(3, 20, 6).transpose(1, 2, 0),
        with_a_fourth(flat.T).reshape(20, 6, 3),
    ):
        tree = built(fibers, radii=0.05)
        assert np.shares_memory(tree._tree.numbers.points, fibers)
        assert (tree.contacts() == built(fibers.copy(), radii=0.05).contacts()).all()


def gaps_of(scene, rng):
    """The points and radii of a scene with points of no fiber, and their offsets."""
    gaps = rng.integers(0, 4, scene.offsets.size)
    counts = np.diff(scene.offsets)
    begin = np.cumsum(gaps)[:-1] + scene.offsets[:-1]
    offsets = np.column_stack((begin, begin + counts))
    places = np.concatenate([np.arange(*pair) for pair in offsets])
    points = np.full((len(scene.points) + gaps.sum(), 3), np.nan, scene.points.dtype)
    points[places] = scene.points
    radii = np.full(len(points), np.nan, scene.points.dtype)
    radii[places] = np.repeat((20 + np.arange(len(counts))) / 1024, counts)
    radii[offsets[:, 1][counts > 0] - 1] = np.nan
    return points, offsets, radii, places


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_points_of_no_fiber(dtype, tmp_path):
    scene = random_scene(7, fibers=60, dtype=dtype)
    counts = np.diff(scene.offsets)
    per_fiber = (20 + np.arange(len(counts))) / 1024
    rng = np.random.default_rng(8)
    points, offsets, radii, places = gaps_of(scene, rng)
    is_start = np.ones(len(scene.points), bool)
    is_start[scene.offsets[1:][counts > 0] - 1] = False
    expected = built(scene.points, scene.offsets, per_fiber)
    assert len(expected.contacts()) > 50
    mesh = fcl_fibers.TriangleMesh(rng.uniform(-1, 1, size=(60, 3)), np.arange(60).reshape(20, 3))
    for given in (
        radii,
        radii[:-1],
        per_fiber,
        np.repeat(per_fiber, counts)[is_start],
        [np.full(n, r) for n, r in zip(counts, per_fiber)],
    ):
        tree = built(points, offsets, given)
        assert (tree.fiber_count, tree.segment_count) == (len(counts), is_start.sum())
        found, known = tree.contacts(), expected.contacts()
        assert without_places(found) == without_places(known)
        assert (found["a"] == places[known["a"]]).all()
        assert (found["layout"] != known["layout"]).all()
        assert (tree.pairs() == places[expected.pairs()]).all()
        assert (tree.fiber_segment(found["b"])[:, 0] == found["fiber_b"]).all()
        known = expected.contacts(mesh)
        assert without_places(tree.contacts(mesh)) == without_places(known)
    tree.update(points + 1)
    assert (tree._tree.offsets == offsets).all()
    with pytest.raises(ValueError, match="other numbers of points"):
        tree.update([scene.points[b:e] for b, e in zip(scene.offsets, scene.offsets[1:])])
    for point in set(range(len(points))) - set(places[is_start]):
        with pytest.raises(ValueError, match="no capsule starts"):
            tree.fiber_segment(point)
    assert (
        fcl_fibers.root_segments(points, offsets, 0.3)
        == fcl_fibers.root_segments(scene.points, scene.offsets, 0.3)
    ).all()
    # Files have no such points.
    fcl_fibers.write(tmp_path / "fibers.vtp", columns(points), offsets, given)
    written = fcl_fibers.read(tmp_path / "fibers.vtp")
    assert (written.points == scene.points).all()
    assert (written.offsets == scene.offsets).all()
    assert "<script" in fcl_fibers.show(columns(points), offsets, given).html


def test_begins_and_ends_have_to_ascend():
    points = np.zeros((9, 3))
    for offsets, text in (
        ([[0, 4], [3, 9]], r"fiber 1 has the offsets \[3, 9\]"),
        ([[4, 0], [5, 9]], r"fiber 0 has the offsets \[4, 0\]"),
        ([[0, 4], [6, 5]], r"fiber 1 has the offsets \[6, 5\]"),
        ([[0, 4], [6, 10]], r"fiber 1 has the offsets \[6, 10\].*from 0 to 9"),
        ([[-1, 4], [6, 9]], r"fiber 0 has the offsets \[-1, 4\]"),
        ([[0, 4, 6], [6, 9, 9]], r"have shape \(2, 3\)"),
        ([[[0, 4]]], r"have shape"),
    ):
        with pytest.raises(ValueError, match=text):
            built(points, offsets, 0.1)
    with pytest.raises(TypeError, match="whole numbers"):
        built(points, [[0.0, 9.0]], 0.1)
    with pytest.raises(ValueError, match="8 radii for 2 fibers, 7 segments and 9 points"):
        built(points, [0, 4, 9], np.ones(8))
    tree = built(points, np.empty((0, 2), int), 0.1)
    assert (tree.fiber_count, tree.segment_count) == (0, 0)
    points[3] = np.nan
    with pytest.raises(ValueError, match="point 3 is NaN"):
        built(points, [[0, 4], [5, 9]], 0.1)
    built(points, [[0, 3], [5, 9]], 0.1)


@pytest.mark.parametrize("unread", [np.nan, np.inf, -1.0])
@pytest.mark.parametrize(
    "offsets, radii",
    [
        ([[0, 1]], [0]),
        ([0, 1], [0]),
        ([[0, 1], [1, 2]], [0, 0]),
        ([[0, 1], [2, 3]], [0, 0]),  # the radius of the last point is left out
        ([[0, 2], [3, 3], [3, 3]], [0.5, 0, 0]),
        ([0, 2, 3, 3], [0.5, 0.5, 0]),
    ],
)
def test_unread_radii_of_as_many_fibers_as_points(offsets, radii, unread):
    points = np.eye(3)[: np.max(offsets)]
    given = np.array(radii, float)
    given[-1] = unread
    tree = built(points, offsets, given)
    other = built([[(1, 0, 0), (0, 1, 0)]], radius=0.5)
    assert tree.contacts(other)["distance"].tolist() == [-1.0] * tree.segment_count
    if tree.segment_count > 0:
        given[0] = unread
        with pytest.raises(ValueError, match="radius"):
            built(points, offsets, given)
