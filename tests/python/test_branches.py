# SPDX-License-Identifier: BSD-3-Clause
"""Fibers that start and end at points of others, and radii given by point."""

import collections

import numpy as np
import pytest

import fcl_fibers
from fcl_fibers import PointRadii
from scenes import random_scene

ALL = dict(report="capsules", ignored_neighbors=0)


def neuron(seed, fibers=25, dtype=float):
    """A tree of fibers, some of which end at an earlier point again."""
    rng = np.random.default_rng(seed)
    parts, starts, ends = [], [], []
    for f in range(fibers):
        known = np.concatenate(parts) if parts else np.zeros((1, 3), dtype)
        steps = rng.uniform(-0.1, 0.1, (rng.integers(1, 6), 3)).astype(dtype)
        starts.append(rng.integers(len(known)) if f > 0 else -1)
        part = np.cumsum([known[starts[-1]], *steps], axis=0, dtype=dtype)
        ends.append(rng.integers(len(known)) if f > 0 and rng.random() < 0.2 else -1)
        if ends[-1] >= 0:
            part[-1] = known[ends[-1]]
        parts.append(part)
    offsets = np.cumsum([0, *map(len, parts)])
    return np.concatenate(parts), offsets, np.array(starts), np.array(ends)


def neighbors(offsets, starts, ends, reach):
    """Pairs of segments at most `reach` apart, by breadth-first search over their points."""
    same = np.arange(offsets[-1])
    for begin, end, start, stop in zip(offsets[:-1], offsets[1:], starts, ends):
        for own, other in ((begin, start), (end - 1, stop)):
            if other >= 0:
                same[same == same[own]] = same[other]
    ways = collections.defaultdict(set)
    names = [i for b, e in zip(offsets[:-1], offsets[1:]) for i in range(b, e - 1)]
    for i in names:
        ways[same[i]].add(i)
        ways[same[i + 1]].add(i)
    found = set()
    for i in names:
        near = {i}
        for _ in range(reach):
            near |= {n for s in near for point in (s, s + 1) for n in ways[same[point]]}
        found |= {(i, n) for n in near if n > i}
    return found


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("reach", [1, 2, 4])
def test_neighbors_count_along_the_tree(dtype, reach):
    points, offsets, starts, ends = neuron(reach, dtype=dtype)
    tree = fcl_fibers.FiberTree(**ALL)
    tree.build(points, offsets, 0.03)
    expected = set(map(tuple, tree.pairs())) - neighbors(offsets, starts, ends, reach)
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=reach)
    tree.build(points, offsets, 0.03)
    assert len(tree.pairs()) > len(expected) > 0
    for scalar in (np.int32, np.int64, list):
        make = list if scalar is list else scalar
        tree.build(points, offsets, 0.03, starts_at=make(starts), ends_at=make(ends))
        assert set(map(tuple, tree.pairs())) == expected
    tree.update(points + dtype(0))
    assert set(map(tuple, tree.pairs())) == expected
    tree.update(points, points)
    assert set(map(tuple, tree.pairs())) == expected


def test_points_between_fibers_count():
    points = np.array([(0, 0, 0), (1, 0, 0), (9, 9, 9), (1, 0, 0), (1, 1, 0)], float)
    tree = fcl_fibers.FiberTree()
    tree.build(points, [(0, 2), (3, 5)], 0.1, starts_at=[-1, 1])
    assert len(tree.pairs()) == 0
    with pytest.raises(ValueError, match="starts_at of fiber 1 is 2, a point of no fiber"):
        tree.build(points, [(0, 2), (3, 5)], 0.1, starts_at=[-1, 2])


@pytest.mark.parametrize("name", ["starts_at", "ends_at"])
def test_what_is_no_branch_is_refused(name):
    fibers = dict(points=np.eye(3)[[0, 1, 0, 2, 1, 2]], offsets=[0, 2, 4, 6], radius=0.1)
    tree = fcl_fibers.FiberTree()
    tree.build(**fibers)
    before = tree.pairs()
    for values, error, text in [
        ([-1, 0], ValueError, f"{name} are 2 for 3 fibers"),
        ([-1, 0.5, 0], TypeError, f"{name} are of type float64; give whole numbers"),
        ([-1, np.nan, 0], TypeError, f"{name} are of type float64; give whole numbers"),
        ([-1, 2**40, 0], ValueError, f"{name} have to be between"),
        ([-1, 6, 0], ValueError, f"{name} of fiber 1 is 6; give a point from 0 to 5, or -1"),
        ([-1, 1, 0], ValueError, "; give both the same coordinates, or -1 for none"),
    ]:
        with pytest.raises(error, match=text.replace(";", ".*;", 1)):
            tree.build(**fibers, **{name: values})
        assert (tree.pairs() == before).all()
    with pytest.raises(ValueError, match="the same point|the same coordinates"):
        tree.build(**fibers, **{name: [1, -1, -1]})


def test_points_that_come_apart_are_refused():
    points, offsets, starts, ends = neuron(3)
    tree = fcl_fibers.FiberTree()
    tree.build(points, offsets, 0.03, starts_at=starts, ends_at=ends)
    moved = points.copy()
    moved[offsets[5]] += 0.01
    for arguments in ((moved,), (moved, points), (points, moved)):
        with pytest.raises(ValueError, match=f"the fiber starts with point {offsets[5]} at"):
            tree.update(*arguments)


def test_point_radii_are_those_of_all_points():
    scene = random_scene(5)
    thick = np.full(len(scene.points), 0.05)
    plain, tapered = fcl_fibers.FiberTree(**ALL), fcl_fibers.FiberTree(**ALL)
    plain.build(scene.points, scene.offsets, 0.05)
    fibers = np.split(scene.points, scene.offsets[1:-1])
    for arguments in (
        (scene.points, scene.offsets, PointRadii(thick)),
        (scene.points, scene.offsets, PointRadii(thick.tolist())),
        (fibers, None, PointRadii(np.split(thick, scene.offsets[1:-1]))),
    ):
        tapered.build(*arguments)
        assert isinstance(tapered.radii, PointRadii)
        assert (tapered.pairs(None, "segments") == plain.pairs(None, "segments")).all()
    rods = np.random.default_rng(1).uniform(size=(3, 4, 3))
    tapered.build(rods, radii=PointRadii(np.full((3, 4), 0.1)))
    assert tapered.radii.shape == (12,)

    # The radii stay, and may change with the points.
    wide = PointRadii(scene.radii.astype(np.float32))
    tapered.build(scene.points.astype(np.float32), scene.offsets, wide)
    tapered.update(scene.points)
    assert isinstance(tapered.radii, PointRadii) and (tapered.radii == wide).all()
    double = PointRadii(2 * thick)
    tapered.update(scene.points, scene.points, PointRadii(thick), double)
    assert (tapered.radii == double).all()
    tapered.update(scene.points, radii=tapered.radii)
    assert isinstance(tapered.radii, PointRadii)
    tapered.update(scene.points, radius=0.1)
    assert not isinstance(tapered.radii, PointRadii)


@pytest.mark.parametrize("scalar", [np.float32, np.float64, np.int64])
def test_what_is_made_of_point_radii_is_at_points(scalar):
    """A plain array would be taken for radii of capsules, and nothing would tell."""
    plain = np.arange(1, 5).astype(scalar)
    radii, mask = PointRadii(plain), np.array([True, False, True, False])
    for made, expected in [
        (np.concatenate([radii, radii]), np.tile(plain, 2)),
        (np.concatenate([plain, radii]), np.tile(plain, 2)),
        (np.hstack([radii, plain]), np.tile(plain, 2)),
        (np.append(radii, 7), [*plain, 7]),
        (np.r_[radii, plain], np.tile(plain, 2)),
        (np.stack([radii, plain]), [plain, plain]),
        (np.vstack([plain, radii]), [plain, plain]),
        (np.where(mask, radii, 7), [1, 7, 3, 7]),
        (np.where(mask, plain, radii), plain),
        (np.interp([0.5, 2], np.arange(4), radii), [1.5, 3]),
        (np.pad(radii, 1, "edge"), [1, *plain, 4]),
        (np.select([mask], [radii], 7), [1, 7, 3, 7]),
        (np.copy(radii), plain),
        (np.maximum(radii[:-1], radii[1:]), [2, 3, 4]),
        (np.split(radii, 2)[1], [3, 4]),
        (radii[mask] * 2, [2, 6]),
    ]:
        assert type(made) is PointRadii and made.tolist() == np.asarray(expected).tolist()
    for made in (np.asarray(radii), np.array(radii)):
        assert type(made) is np.ndarray
    assert type(np.where(radii > 2)[0]) is np.ndarray
    assert radii[1] == 2 and np.allclose(radii, plain) is True


def test_one_number_of_point_radii_is_one_radius():
    scene = random_scene(5)
    radii = PointRadii(scene.radii[0] * np.linspace(1, 2, len(scene.points)))
    plain, tree = fcl_fibers.FiberTree(**ALL), fcl_fibers.FiberTree(**ALL)
    plain.build(scene.points, scene.offsets, float(radii[-1]))
    expected = plain.pairs(None, "segments")
    assert len(expected) > 0
    for one in (radii.max(), np.max(radii), np.squeeze(radii[-1:]), radii[-1:].reshape(())):
        tree.build(scene.points, scene.offsets, one)
        assert tree.radii.shape == (1,) and not isinstance(tree.radii, PointRadii)
        assert (tree.pairs(None, "segments") == expected).all()
    # A maximum is at no point, and neither is what is made of it.
    tree.build(scene.points, scene.offsets, radii.max() * np.ones(len(scene.offsets) - 1))
    assert not isinstance(tree.radii, PointRadii)
    assert (tree.pairs(None, "segments") == expected).all()


def test_lists_of_point_radii():
    rng = np.random.default_rng(11)
    points, offsets = rng.uniform(size=(9, 3)), np.array([0, 4, 4, 9])
    radii = rng.uniform(0.01, 0.5, 9)
    parts = [PointRadii(part) for part in np.split(radii, offsets[1:-1])]
    fibers = np.split(points, offsets[1:-1])
    tree = fcl_fibers.FiberTree(**ALL)
    for given in (parts, tuple(parts)):
        tree.build(fibers, radii=given)
        assert isinstance(tree.radii, PointRadii) and (tree.radii == radii).all()
    tree.update(points, radii=[2 * part for part in parts])
    assert isinstance(tree.radii, PointRadii) and (tree.radii == 2 * radii).all()
    single = [part.astype(np.float32) for part in parts]
    tree.build(points.astype(np.float32), offsets, single)
    assert (tree.radii == radii.astype(np.float32)).all()
    # Points between fibers have radii that nobody reads.
    tree.build(points, [(0, 4), (5, 9)], [parts[0], parts[2][1:]])
    assert (np.delete(tree.radii, 4) == np.delete(radii, 4)).all()
    tree.build(points[:8].reshape(2, 4, 3), radii=np.stack([parts[0], parts[2][:4]]))
    assert isinstance(tree.radii, PointRadii) and (tree.radii == radii[:8]).all()
    before = np.array(tree.radii)
    plain = [np.asarray(part) for part in parts]
    for given, error, text in [
        ([*parts[:2], plain[2]], TypeError, "radii of fiber 2 are no PointRadii, and those of ano"),
        ([*plain[:2], parts[2]], TypeError, "radii of fiber 0 are no PointRadii, and those of ano"),
        ([0.5, *parts[1:]], TypeError, "radii of fiber 0 are no PointRadii, and those of another"),
        (parts[:2], ValueError, "radii are those of 2 fibers instead of 3"),
        ([*parts[:2], parts[2][1:]], ValueError, r"fiber 2 have shape \(4,\); it has 5 points, so"),
        (np.stack([parts[0]] * 3), ValueError, r"fiber 1 have shape \(4,\); it has 0 points, so"),
    ]:
        with pytest.raises(error, match=text):
            tree.build(fibers, radii=given)
        assert (tree.radii == before).all()


def test_point_radii_have_to_fit():
    points, offsets = np.random.default_rng(7).uniform(size=(7, 3)), [0, 4, 7]
    tree = fcl_fibers.FiberTree()
    for radii, error, text in [
        (np.ones(6), ValueError, r"radii at points have shape \(6,\) for 7 points"),
        ([np.ones(4)], ValueError, r"shape \(4,\) for 7 points; give one for each point"),
        (np.full(7, -1.0), ValueError, "radius 0 is negative"),
        (["a"] * 7, TypeError, "radii are of type"),
    ]:
        with pytest.raises(error, match=text):
            tree.build(points, offsets, PointRadii(radii))
    with pytest.raises(TypeError, match="radius and radii are both given"):
        tree.build(points, offsets, PointRadii(np.ones(7)), radius=0.1)


def test_fibers_of_a_file_come_with_their_branches(tmp_path):
    path = tmp_path / "y.swc"
    path.write_text("1 1 0 0 0 1 -1\n2 3 0 0 5 .5 1\n3 3 0 3 9 .2 2\n4 3 0 -3 9 .3 2\n")
    fibers = fcl_fibers.read(path)
    tree = fcl_fibers.FiberTree()
    tree.build(*fibers)
    assert len(tree.pairs()) == 3
    tree.build(fibers)
    assert len(tree.pairs()) == 0
    with pytest.raises(TypeError, match="leave them out"):
        tree.build(fibers, radii=1.0)


def test_segments_with_radii_at_points_are_cones():
    cone = np.array([[0, 0, 0], [10, 0, 0.0]])
    across = np.array([[0, -3, 1], [0, 3, 1.0]])
    tree = fcl_fibers.FiberTree()
    for x, pairs in ((1, 0), (9, 1)):  # at the thin end and at the thick one
        tree.build([cone, across + [x, 0, 0]], radii=PointRadii([0.1, 1, 0.1, 0.1]))
        assert len(tree.pairs()) == pairs
    contact = tree.contacts()[0]
    # What is sampled is too far by less than the square of a step, which is 5e-6.
    assert contact["distance"] == pytest.approx(distance_of_cone(9, 1) - 0.1, abs=5e-11)


def distance_of_cone(x, z):
    """From (x, 0, z) to the cone above, by its definition."""
    s = np.linspace(0, 1, 2_000_001)
    return (np.hypot(x - 10 * s, z) - (0.1 + 0.9 * s)).min()
