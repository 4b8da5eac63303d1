# SPDX-License-Identifier: BSD-3-Clause
"""What a tree tells of itself, and queries with single shapes."""

import dataclasses
import pickle

import numpy as np
import pytest

import fcl_fibers
import oracles
from scenes import cross, random_scene
from test_contacts import KINDS, tree_of


def test_options():
    tree = fcl_fibers.FiberTree()
    assert tree.options == fcl_fibers.Options("capsules", "bundle", "boxes", 1, 0.0, 0.0, 1)
    chosen = dict(
        report="capsules",
        topology="super_thread",
        volumes="spheres",
        ignored_neighbors=np.int64(2),
        ignored_arc_length=np.float32(0.5),
        margin=1,
        threads=2,
    )
    assert fcl_fibers.FiberTree(**chosen).options._asdict() == chosen
    with pytest.raises(TypeError):
        fcl_fibers.FiberTree("capsules")
    with pytest.raises(AttributeError):
        tree.options = None


def test_repr_and_counts():
    tree = fcl_fibers.FiberTree()
    assert repr(tree) == "<FiberTree: 0 fibers, 0 segments, report='capsules'>"
    empty = tree.memory_usage
    tree.build(np.zeros((1000, 5, 3)), radii=1)
    assert (tree.fiber_count, tree.segment_count) == (1000, 4000)
    assert repr(tree) == "<FiberTree: 1000 fibers, 4000 segments, report='capsules'>"
    assert tree.memory_usage > empty + 4000 * 8


def test_fiber_segment():
    scene = random_scene(1)
    tree = tree_of(scene)
    expected = np.column_stack([scene.fiber, scene.number])
    assert (tree.fiber_segment(scene.names) == expected).all()
    assert (tree.fiber_segment(scene.names[::-1]) == expected[::-1]).all()
    pairs = tree.pairs()
    both = tree.fiber_segment(pairs)
    assert both.shape == pairs.shape + (2,) and both.dtype == np.int64
    contacts = tree.contacts()
    assert (both[:, 0, 0] == contacts["fiber_a"]).all()
    assert (both[:, 1, 1] == contacts["number_b"]).all()
    one = int(scene.names[7])
    assert tree.fiber_segment(one).tolist() == expected[7].tolist()
    assert tree.fiber_segment(np.full((2, 1, 3), one, np.uint8)).shape == (2, 1, 3, 2)
    for empty in ([], np.empty((0, 2), np.int32), np.empty((3, 0), np.int64)):
        assert tree.fiber_segment(empty).shape == np.shape(empty) + (2,)
    ends = scene.offsets[1:][np.diff(scene.offsets) > 0] - 1
    for wrong in (-1, len(scene.points), int(ends[0]), [one, int(ends[1])], 2**31 - 1):
        with pytest.raises(ValueError, match="no capsule starts at point"):
            tree.fiber_segment(wrong)
    for wrong, error in ((2**31, ValueError), (0.5, TypeError), ("0", TypeError)):
        with pytest.raises(error, match="segments"):
            tree.fiber_segment(wrong)


def test_running_numbers():
    scene = random_scene(1)  # with fibers of no and of one point
    tree = tree_of(scene)
    assert tree.segments.dtype == np.int32 and tree.segments.tolist() == scene.names.tolist()
    numbers = np.arange(tree.segment_count)
    assert tree.running_number(scene.names[::-1]).tolist() == numbers[::-1].tolist()
    contacts = tree.contacts()
    pairs = tree.running_number(np.column_stack([contacts["a"], contacts["b"]]))
    assert pairs.dtype == np.int64 and (scene.fiber[pairs[:, 1]] == contacts["fiber_b"]).all()
    assert (tree.segments[pairs] == tree.pairs()).all()
    assert tree.running_number(int(scene.names[7])) == 7
    for wrong in (-1, len(scene.points) - 1, [0, len(scene.points)]):
        with pytest.raises(ValueError, match="no capsule starts at point"):
            tree.running_number(wrong)
    with pytest.raises(TypeError, match="field a of contacts"):
        tree.running_number(contacts)
    tree.build(np.zeros((3, 2, 3)), radii=1)
    assert tree.segments.tolist() == [0, 2, 4] and tree.running_number([4, 0]).tolist() == [2, 0]


def test_arrays_of_a_tree():
    """They are the program's own, and nobody changes them by the way."""
    tree = fcl_fibers.FiberTree()
    assert (len(tree), len(tree.points), tree.offsets.tolist()) == (0, 0, [0]) and tree
    points, offsets = cross()
    radii = np.array([0.5, 0.25])
    tree.build(points, offsets, radii)
    assert len(tree) == tree.fiber_count == 2 and tree.offsets.tolist() == [0, 2, 4]
    assert np.shares_memory(tree.points, points) and np.shares_memory(tree.radii, radii)
    assert tree.radii.tolist() == [0.5, 0.25]
    moved = points.astype(np.float32)
    tree.update(moved, points + 1, radii=0.125)
    assert tree.points.tolist() == (points + 1).tolist() and tree.radii.tolist() == [0.125]
    tree.update(moved)
    assert np.shares_memory(tree.points, moved) and tree.radii.dtype == np.float32
    for array in (tree.points, tree.radii, tree.offsets, tree.segments):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    assert moved.flags.writeable and points.flags.writeable
    kept = tree.offsets
    with pytest.raises(ValueError):
        tree.build([[(0, 0, 0), (1, 1, np.nan)]], radii=1)
    assert tree.offsets is kept and np.shares_memory(tree.points, moved)
    tree.build(np.zeros((3, 2, 3)), radii=1)
    assert tree.offsets.tolist() == [0, 2, 4, 6] and kept.tolist() == [0, 2, 4]


@pytest.mark.parametrize("report, topology, volumes", KINDS)
def test_volumes(report, topology, volumes):
    scene = random_scene(2, fibers=60)
    tree = tree_of(scene, report=report, topology=topology, volumes=volumes, margin=0.1)
    counts = []
    for depth in range(40):
        found = tree.volumes(depth)
        center, half, offsets, segments = found
        counts.append(len(center))
        assert center.shape == half.shape == (len(offsets) - 1, 3)
        assert sorted(segments) == scene.names.tolist() and (np.diff(offsets) > 0).all()
        place = np.searchsorted(scene.names, segments)
        volume = np.repeat(np.arange(len(center)), np.diff(offsets))
        reach = scene.radius[place] + 0.05
        for point in (scene.start[place], scene.end[place]):
            away = np.abs(point - center[volume])
            if volumes == "boxes":
                assert (away + reach[:, None] <= half[volume] + 1e-12).all()
            else:
                assert (half == half[:, :1]).all()
                assert (oracles.length(away) + reach <= half[volume, 0] + 1e-12).all()
    assert counts[0] == 1 and counts == sorted(counts) and counts[-1] == tree.segment_count
    # A super thread is a binary tree, and a node of bundles has up to eight children.
    assert (counts[1] == 2) == (topology == "super_thread")
    assert len(fcl_fibers.FiberTree().volumes(0).center) == 0


def test_update_keeps_what_build_has_set():
    points, offsets = cross()
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    tree.build(points, offsets, 0.5, groups=[3, 3])
    tree.update(points.astype(np.float32))
    assert len(tree.pairs()) == 0
    tree.build(points, offsets, 0.5)
    assert len(tree.pairs()) == 1
    tree.build([], radii=1)
    assert len(tree.pairs()) == 0 and tree.fiber_count == 0


def test_update_takes_radii_of_every_kind_and_other_types():
    points, offsets = cross(gap=1.0)
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    for kept in (0.5, [0.5, 0.5], [0.5, 9, 0.5, 9]):
        tree.build(points, offsets, kept)
        for dtype in (np.float32, np.float64, np.int32):
            tree.update(points.astype(dtype))
            assert len(tree.pairs()) == 1
        for radii, count in ((0.25, 0), ([0.9, 0.1], 1), ([0.25, 9, 0.5, 9], 0)):
            tree.update(points, radii=radii)
            assert len(tree.pairs()) == count


@pytest.mark.parametrize("margin", [0.0, 0.1])
@pytest.mark.parametrize("volumes", ["boxes", "spheres"])
def test_overlaps(volumes, margin):
    scene = random_scene(5)
    tree = tree_of(scene, volumes=volumes, margin=margin)
    rng = np.random.default_rng(6)
    for _ in range(20):
        start, end = rng.uniform(-0.2, 1.2, (2, 3))
        radius = rng.uniform(0, 0.3)
        for a, b in ((start, end), (start, start)):
            found = oracles.as_set(tree.pairs(fcl_fibers.CapsuleShape(a, b.tolist(), radius)))
            axes = oracles.segment_segment(a, b, scene.start, scene.end)
            assert found == set(scene.names[axes <= scene.radius + radius + margin])
        low, high = np.minimum(start, end), np.maximum(start, end)
        found = tree.pairs(fcl_fibers.BoxShape(low, tuple(high)))
        assert found.dtype == np.int32
        gap = oracles.segment_box(scene.start, scene.end, low, high) - scene.radius
        assert oracles.as_set(found) == set(scene.names[gap <= margin])


def test_shapes():
    points = np.array([[0, 0, 0.3], [1, 0, 0.3], [0, 1, 2.0], [1, 1, 2.0]])
    turned = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    shapes = [
        fcl_fibers.HalfSpaceShape((0, 0, 2), 0.5),
        fcl_fibers.PlaneShape((0, 0, -1), -0.25),
        fcl_fibers.BoxShape((0, -1, -1), (1, 1, 0.25)),
        fcl_fibers.BoxShape((0, -1, -1), (1, 1, 0.25), turned, (0, 0, 0)),
        fcl_fibers.SphereShape((0.5, 0, 0), 0.25),
        fcl_fibers.CapsuleShape((0.5, -1, 0), (0.5, 1, 0), 0.25),
    ]
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=1)
    for shape in shapes:
        tree.build(points, [0, 2, 4], 0.1)
        assert tree.pairs(shape).tolist() == [0]
        contacts = tree.contacts(shape)
        assert contacts["segment"].tolist() == [0] and contacts["fiber"].tolist() == [0]
        np.testing.assert_allclose(contacts["distance"], -0.05, atol=1e-15)
        np.testing.assert_allclose(contacts["normal"], [[0, 0, -1]], atol=1e-15)
        tree.update(points + (0, 0, 1.05), points)
        impacts = tree.impacts(shape)
        assert impacts["segment"].tolist() == [0]
        np.testing.assert_allclose(impacts["time"], 1 / 1.05, atol=1e-9)
        np.testing.assert_allclose(tree.safe_step(shape), 1 / 1.05, atol=1e-9)
        there = tree.impact_contacts(impacts, shape)
        np.testing.assert_allclose(there["distance"], 0.05 - 0.05, atol=1e-9)
        assert pickle.loads(pickle.dumps(shape)) == shape and repr(shape).startswith(
            type(shape).__name__
        )
        made = dataclasses.replace(shape), type(shape)(**dataclasses.asdict(shape))
        assert made == (shape, shape)
        assert len({shape, *made}) == 1 and tree.pairs(made[0]).tolist() == [0]
    assert shapes[3].rotation == ((0, -1, 0), (1, 0, 0), (0, 0, 1))
    ball = type("Ball", (fcl_fibers.SphereShape,), {})(shapes[4].center, 0.25)
    assert tree.pairs(ball).tolist() == [0]
    with pytest.raises(TypeError, match="give one of them, such as SphereShape"):
        fcl_fibers.Shape()


def test_overlaps_of_volumes():
    scene = random_scene(7)
    tree = tree_of(scene, report="volumes")
    low, high = np.full(3, 0.3), np.full(3, 0.6)
    bottom = np.minimum(scene.start, scene.end) - scene.radius[:, None]
    top = np.maximum(scene.start, scene.end) + scene.radius[:, None]
    expected = set(scene.names[((bottom <= high) & (top >= low)).all(axis=1)])
    assert oracles.as_set(tree.pairs(fcl_fibers.BoxShape(low, high))) == expected
    assert (
        oracles.as_set(tree.pairs(fcl_fibers.CapsuleShape(low + 0.1, high - 0.1, 0.1))) == expected
    )


def test_root_segments():
    scene = random_scene(8)
    steps = oracles.length(scene.end - scene.start)
    for length in (0, 0.3, 1.0, 100.0):
        expected = [
            np.count_nonzero(np.cumsum(np.append(0, steps[scene.fiber == f]))[:-1] < length)
            for f in range(len(scene.offsets) - 1)
        ]
        for dtype in (np.float32, np.float64):
            found = fcl_fibers.root_segments(scene.points.astype(dtype), scene.offsets, length)
            assert found.dtype == np.int32 and found.tolist() == expected
    assert fcl_fibers.root_segments(np.zeros((2, 3, 3)), None, 1).tolist() == [2, 2]
