# SPDX-License-Identifier: BSD-3-Clause
"""What a program may pass as points, offsets and radii."""

import copy
import pickle

import numpy as np
import pytest

import fcl_fibers
from scenes import cross, random_scene

INTEGERS = [np.int8, np.int16, np.int32, np.int64, np.uint8, np.uint16, np.uint32, np.uint64]


def built(*arguments, **named):
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    tree.build(*arguments, **named)
    return tree


def answer(*arguments, **named):
    return built(*arguments, **named).contacts()


class Marked(np.ndarray):
    """A subclass, as units and masks are."""


def unaligned(array):
    raw = np.empty(array.nbytes + 1, np.uint8)
    copy = raw[1:].view(array.dtype).reshape(array.shape)
    copy[...] = array
    assert not copy.flags.aligned
    return copy


def read_only(array):
    copy = array.copy()
    copy.flags.writeable = False
    return copy


SAME_NUMBERS = {
    "big endian": lambda a: a.astype(a.dtype.newbyteorder(">")),
    "Fortran order": np.asfortranarray,
    "negative strides": lambda a: a[::-1].copy()[::-1],
    "negative columns": lambda a: a[:, ::-1].copy()[:, ::-1] if a.ndim == 2 else a,
    "every second": lambda a: np.repeat(a, 2, axis=0)[::2],
    "unaligned": unaligned,
    "read-only": read_only,
    "subclass": lambda a: a.view(Marked),
    "list": lambda a: a.tolist(),
    "tuple": lambda a: tuple(map(tuple, a.tolist())) if a.ndim == 2 else tuple(a.tolist()),
    "memory view": memoryview,
    "long double": lambda a: a.astype(np.longdouble) if a.dtype.kind == "f" else a,
}


@pytest.mark.parametrize("layout", SAME_NUMBERS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_layouts_of_the_same_numbers(layout, dtype):
    scene = random_scene(1, dtype=dtype)
    change = SAME_NUMBERS[layout]
    expected = answer(scene.points, scene.offsets, scene.radii)
    points, offsets, radii = change(scene.points), change(scene.offsets), change(scene.radii)
    assert len(expected) > 50
    for arguments in (
        (points, scene.offsets, scene.radii),
        (scene.points, offsets, scene.radii),
        (scene.points, scene.offsets, radii),
        (points, offsets, radii),
    ):
        found = answer(*arguments)
        assert found["distance"] == pytest.approx(expected["distance"], abs=1e-6)
        assert (found["fiber_a"] == expected["fiber_a"]).all()


@pytest.mark.parametrize("dtype", [np.float16] + INTEGERS)
def test_other_types_of_points(dtype):
    points = np.array([(1, 2, 3), (4, 2, 3), (2, 1, 3), (2, 9, 3)])
    assert (
        answer(points.astype(dtype), [0, 2, 4], 1) == answer(points / 1.0, [0, 2, 4], 1.0)
    ).all()


def test_float_points_are_not_rounded():
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1 + 2.0**-40, 0), (1, 1 + 2.0**-40, 0)])
    assert len(answer(points, [0, 2, 4], 0.5)) == 0
    assert len(answer(points.astype(np.float32), [0, 2, 4], 0.5)) == 1


def test_shapes_of_fibers():
    points = np.random.default_rng(2).uniform(size=(20, 5, 3))
    flat, offsets = points.reshape(-1, 3), np.arange(21) * 5
    expected = answer(flat, offsets, 0.1)
    for same in (
        points,
        list(points),
        tuple(points),
        points.tolist(),
        [p.tolist() for p in points],
    ):
        assert (answer(same, radii=0.1) == expected).all()
    one = answer([flat], radii=0.1)
    assert (one == answer(flat, [0, 100], 0.1)).all() and (one["fiber_b"] == 0).all()
    uneven = [points[0], points[1][:0], points[2][:1], points[3][:2], points[4]]
    tree = built(uneven, radii=0.1)
    assert (tree.fiber_count, tree.segment_count) == (5, 9)
    mixed = [points[0].astype(np.float32), points[1], points[2].astype(np.int64)]
    assert built(mixed, radii=0.1).segment_count == 12


@pytest.mark.parametrize(
    "points, offsets, fibers",
    [
        ([], None, 0),
        ((), None, 0),
        (np.empty((0, 3)), [0], 0),
        (np.empty((0, 3), np.float32), [0, 0, 0], 2),
        (np.empty((0, 5, 3)), None, 0),
        (np.empty((5, 0, 3)), None, 5),
        ([np.empty((0, 3))], None, 1),
        (np.zeros((1, 3)), [0, 0, 1, 1], 3),
        ([np.zeros((1, 3))], None, 1),
    ],
)
def test_fibers_without_segments(points, offsets, fibers):
    tree = built(points, offsets, 0.1)
    assert (tree.fiber_count, tree.segment_count) == (fibers, 0)
    assert len(tree.pairs()) == len(tree.contacts()) == 0
    tree.update(points, radii=0.2)
    assert tree.fiber_count == fibers


def test_kinds_of_radii():
    points = np.zeros((7, 3))
    points[:, 0] = [0, 1, 2, 5, 6, 7, 8]
    offsets = [0, 3, 7]
    # Segments start at the points 0, 1, 3, 4, 5.
    per_fiber, per_segment = [0.25, 0.5], [0.25, 0.25, 0.5, 0.5, 0.5]
    per_point = [0.25, 0.25, 9, 0.5, 0.5, 0.5, 9]
    expected = answer(points, offsets, per_fiber)
    for radii in (
        per_segment,
        per_point,
        np.array(per_point, np.float32),
        [np.array(per_segment[:2]), np.array(per_segment[2:])],
        [per_point[:3], per_point[3:]],
        np.array(per_point)[::-1][::-1],
    ):
        assert (answer(points, offsets, radii) == expected).all()
    for one in (1, 1.0, np.float32(1), np.float64(1), np.int8(1), np.array(1.0), np.float16(1)):
        assert (answer(points, offsets, one) == answer(points, offsets, [1, 1])).all()


def test_radii_of_lists_of_fibers():
    fibers = [np.zeros((3, 3)), np.ones((4, 3))]
    expected = answer(fibers, radii=[0.5, 0.25])
    assert (answer(fibers, radii=[np.full(3, 0.5), np.full(4, 0.25)]) == expected).all()
    assert (answer(fibers, radii=[np.full(2, 0.5), np.full(3, 0.25)]) == expected).all()


def test_ambiguous_radii():
    # Two fibers with one segment each: two radii are the same for fibers and for segments.
    points, offsets = cross(gap=1.0)
    assert (answer(points, offsets, [0.5, 0.5]) == answer(points, offsets, 0.5)).all()
    assert answer(points, offsets, [0.75, 0.25])["point_a"][0][2] == 0.75
    # Three fibers, of 0, 1 and 3 points: two segments; four points.
    with pytest.raises(ValueError, match="3 radii could be"):
        # Fibers of 2, 0 and 3 points have three segments, of which two are in the last fiber.
        built(np.zeros((5, 3)), [0, 2, 2, 5], [1.0, 2.0, 3.0])
    built(np.zeros((5, 3)), [0, 2, 2, 5], [1.0, 1.0, 1.0])


@pytest.mark.parametrize("layout", ["one", "per fiber", "per point", "per segment"])
def test_radii_are_rounded_up(layout):
    """Two float32 capsules whose axes are 0.2 apart, as a float64 tells it."""
    points, offsets = cross(gap=0.2)
    points = points.astype(np.float32)
    gap = float(points[2, 2])
    below = np.nextafter(gap / 2, 0)
    radii = {"one": below, "per fiber": [below] * 2, "per point": [below] * 4}.get(layout)
    if layout == "per segment":
        points = np.concatenate([points, [[5, 5, 5]]]).astype(np.float32)
        offsets, radii = [0, 2, 5], [below] * 3
    tree = built(points, offsets, radii)
    kept = tree._tree.numbers.radii
    assert kept.dtype == np.float32 and (kept[kept > 0] >= below).all()
    assert kept.max() <= np.nextafter(np.float32(below), np.float32(1))


def test_every_radius_is_rounded_up():
    rng = np.random.default_rng(3)
    radii = np.concatenate(
        [rng.uniform(size=1000), 10.0 ** rng.uniform(-50, 38, 1000), [0, 1, 5e-324]]
    )
    points = np.zeros((2 * len(radii), 3), np.float32)
    tree = built(points.reshape(-1, 2, 3), radii=radii)
    kept = tree._tree.numbers.radii
    assert kept.dtype == np.float32 and (kept >= radii).all()
    exact = radii.astype(np.float32) == radii
    assert (kept[exact] == radii[exact]).all()
    assert (np.nextafter(kept[~exact], np.float32(0)) < radii[~exact]).all()


@pytest.mark.parametrize("dtype", INTEGERS)
def test_types_of_offsets(dtype):
    scene = random_scene(4, fibers=10)
    found = answer(scene.points, scene.offsets.astype(dtype), scene.radii)
    assert (found == answer(scene.points, scene.offsets, scene.radii)).all()


@pytest.mark.parametrize(
    "name, dtypes",
    [
        ("closed", [bool, np.uint8, np.int64]),
        ("groups", INTEGERS),
        ("meets", INTEGERS),
        ("root_segments", INTEGERS),
    ],
)
def test_types_of_what_each_fiber_has(name, dtypes):
    points, offsets = cross()
    for dtype in dtypes:
        tree = built(points, offsets, 0.5, **{name: np.array([1, 1], dtype)})
        assert len(tree.pairs()) == (0 if name == "groups" else 1)
    built(points, offsets, 0.5, **{name: [1, 0]})


def test_radii_by_fiber_have_to_fit_the_fibers():
    fibers = [np.random.default_rng(f).uniform(size=(n, 3)) for f, n in enumerate((4, 3))]
    for radii, text in (
        ([np.ones(3), np.full(4, 2.0)], "radii of fiber 1 have shape"),  # as many in all
        ([np.ones(4), np.ones(2)], "for points in some fibers"),
        ([np.ones(7)], "1 fibers instead of 2"),
    ):
        with pytest.raises(ValueError, match=text):
            built(fibers, radii=radii)
    rods = np.random.default_rng(3).uniform(size=(2, 3, 3))
    with pytest.raises(ValueError, match="3 fibers instead of 2"):
        built(rods, radii=np.ones((3, 2)))  # (n, fibers) in the place of (fibers, n)
    assert (answer(rods, radii=np.ones((2, 3))) == answer(rods, radii=1.0)).all()
    assert (answer(rods, radii=np.ones((2, 2))) == answer(rods, radii=1.0)).all()
    # There are as many fibers as points, but a list is never one radius for each fiber.
    uneven = [np.empty((0, 3)), np.eye(3)[:2]]
    with pytest.raises(ValueError, match="give a list"):
        built(uneven, radii=[0.1, 0.2])
    point = fcl_fibers.SphereShape((1, 0, 0.15), 0)
    assert built(uneven, radii=[[], [0.1, 0.2]]).pairs(point).size == 0
    assert built(uneven, radii=[[], [0.2, 0.1]]).pairs(point).size == 1


def test_updates_take_what_builds_take():
    points = np.random.default_rng(4).uniform(size=(20, 3))
    offsets = [0, 12, 20]
    tree = built(points, offsets, radii=0.2)
    expected = tree.contacts()

    class Tensor:
        def __array__(self, dtype=None):
            return points if dtype is None else points.astype(dtype)

    for same in (points.tolist(), tuple(map(tuple, points)), Tensor(), memoryview(points)):
        tree.update(same)
        assert (tree.contacts() == expected).all()
        assert (built(same, offsets, radii=0.2).contacts() == expected).all()
    for fibers in ([points[:12], points[12:]], [points[:12].tolist(), points[12:].tolist()]):
        tree.update(fibers)
        assert (tree.contacts() == expected).all()


def test_trees_are_no_values():
    tree = built([np.eye(3)], radii=0.1)
    for copy_of in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="build another one"):
            copy_of(tree)
    mesh = fcl_fibers.TriangleMesh(np.eye(3), [[0, 1, 2]])
    other = copy.deepcopy(mesh)
    other.set_pose(np.eye(3), (1, 2, 3))
    assert (mesh.pose[1] == 0).all()
