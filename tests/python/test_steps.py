# SPDX-License-Identifier: BSD-3-Clause
"""Steps: what touches while points move straight, against many moments of the step."""

import itertools

import numpy as np
import pytest

import fcl_fibers
import oracles
from scenes import ball, random_scene
from test_contacts import check_contact

MOMENTS = np.linspace(0, 1, 101)
ERROR = 1e-9  # far above 2^-36 of the sizes here, and below what a sample may miss


class Step:
    """A scene at the start and at the end of a step."""

    def __init__(self, seed, fibers=30, speed=0.3, dtype=float, end_dtype=None):
        self.start = random_scene(seed, fibers, radius=0.02, dtype=dtype)
        rng = np.random.default_rng(seed + 1000)
        move = rng.uniform(-speed, speed, self.start.points.shape)
        radii = self.start.radii * rng.uniform(0.5, 2, len(self.start.radii))
        self.end = oracles.Scene(
            (self.start.points + move).astype(end_dtype or dtype),
            self.start.offsets,
            radii.astype(end_dtype or dtype),
        )
        self.names = self.start.names

    def tree(self, **options):
        tree = fcl_fibers.FiberTree(**{"report": "capsules", "ignored_neighbors": 0, **options})
        tree.build(**self.start.arguments)
        tree.update(self.start.points, self.end.points, self.start.radii, self.end.radii)
        return tree

    def at(self, time):
        """Starts, ends and radii of the segments."""
        return [
            np.asarray(a + time * (b - a))
            for a, b in (
                (self.start.start, self.end.start),
                (self.start.end, self.end.end),
                (self.start.radius, self.end.radius),
            )
        ]

    def speed(self):
        """How fast each surface moves at most."""
        ends = oracles.length(self.end.start - self.start.start), oracles.length(
            self.end.end - self.start.end
        )
        return np.maximum(*ends) + np.abs(self.end.radius - self.start.radius)


def gaps(a, b, time):
    p, q = a.at(time), b.at(time)
    axes = oracles.segment_segment(p[0][:, None], p[1][:, None], q[0], q[1])
    return axes - p[2][:, None] - q[2]


def check_impacts(impacts, a, b, kept, margin=0.0):
    """That no pair is missed, none comes too late, and all touch at their times."""
    sampled = np.array([gaps(a, b, time) for time in MOMENTS]) - margin
    between = (a.speed()[:, None] + b.speed()) * (MOMENTS[1] / 2)
    found = oracles.as_set(np.column_stack([impacts["a"], impacts["b"]]))

    def pairs(of):
        i, j = np.nonzero(of & kept)
        return set(zip(a.names[i].tolist(), b.names[j].tolist()))

    assert pairs((sampled <= -ERROR).any(axis=0)) <= found
    assert found <= pairs(sampled.min(axis=0) <= between + ERROR)
    i, j = np.searchsorted(a.names, impacts["a"]), np.searchsorted(b.names, impacts["b"])
    for k, impact in enumerate(impacts):
        time = impact["time"]
        assert 0 <= time <= 1
        p, q = ([x[n] for x in side.at(time)] for side, n in ((a, i[k]), (b, j[k])))
        apart = oracles.length(
            p[0] + impact["s"] * (p[1] - p[0]) - q[0] - impact["t"] * (q[1] - q[0])
        )
        assert apart - p[2] - q[2] - margin <= ERROR
        before = sampled[MOMENTS < time, i[k], j[k]]
        assert (before >= -ERROR).all()
    return sampled


@pytest.mark.parametrize("topology", ["bundle", "super_thread"])
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("dtypes", list(itertools.product([np.float32, np.float64], repeat=2)))
def test_impacts(topology, threads, dtypes):
    step = Step(1, dtype=dtypes[0], end_dtype=dtypes[1])
    options = dict(topology=topology, margin=0.005, ignored_neighbors=1)
    tree = step.tree(**options, threads=threads)
    impacts = tree.impacts()
    assert (impacts["a"] < impacts["b"]).all() and (impacts["time"] > 0).sum() > 25
    check_impacts(impacts, step, step, step.start.kept(ignored_neighbors=1), 0.005)
    assert (impacts == step.tree(**options).impacts()).all()
    assert (impacts == tree.impacts(tree)).all()


def test_impacts_of_two_trees():
    for dtypes in itertools.product([np.float32, np.float64], repeat=2):
        a, b = Step(2, dtype=dtypes[0]), Step(3, dtype=dtypes[1])
        tree, other = a.tree(), b.tree()
        impacts = tree.impacts(other)
        assert (impacts["time"] > 0).sum() > 25
        check_impacts(impacts, a, b, True)
        contacts = tree.impact_contacts(impacts, other)
        assert len(contacts) == len(impacts)
        late = impacts["time"] > 0
        assert contacts["distance"][late] == pytest.approx(np.zeros(late.sum()), abs=ERROR)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_impact_contacts(dtype):
    step = Step(4, dtype=dtype)
    tree = step.tree(ignored_neighbors=1)
    impacts = tree.impacts()
    for some in (impacts, impacts[::2], impacts[:0], impacts[::-1]):
        contacts = tree.impact_contacts(some)
        assert len(contacts) == len(some)
        for impact, contact in zip(some, contacts):
            start, end, radius = step.at(impact["time"])
            i, j = np.searchsorted(step.names, [impact["a"], impact["b"]])
            check_contact(
                contact[None],
                (start[[i]], end[[i]]),
                (start[[j]], end[[j]]),
                radius[[i]],
                radius[[j]],
            )
    late = impacts["time"] > 0
    distance = tree.impact_contacts(impacts)["distance"]
    assert distance[late] == pytest.approx(np.zeros(late.sum()), abs=ERROR)
    assert late.sum() > 25


def test_wrong_impacts():
    step = Step(5)
    tree = step.tree()
    impacts = tree.impacts()
    for field, values in (
        ("a", [-1, 2**31 - 1]),
        ("b", [-5, int(step.start.offsets[-1]) - 1]),
        ("time", [-0.1, 1.1, np.nan]),
    ):
        for value in values:
            wrong = impacts.copy()
            wrong[field][3] = value
            with pytest.raises(ValueError):
                tree.impact_contacts(wrong)
    for wrong in (impacts[["a", "b", "time"]], impacts.reshape(1, -1), tree.contacts()):
        with pytest.raises((TypeError, ValueError), match="impacts"):
            tree.impact_contacts(wrong)


def test_moving_pairs():
    a, b = Step(6), Step(7)
    tree, other = a.tree(ignored_neighbors=1), b.tree()
    for pairs, impacts in (
        (tree.moving_pairs(), tree.impacts()),
        (tree.moving_pairs(other), tree.impacts(other)),
    ):
        assert pairs.dtype == np.int32
        touching = oracles.as_set(np.column_stack([impacts["a"], impacts["b"]]))
        assert touching <= oracles.as_set(pairs)
    kept = a.start.kept(ignored_neighbors=1)
    assert len(tree.moving_pairs()) < 0.7 * np.count_nonzero(kept)
    same = fcl_fibers.FiberTree(report="volumes", ignored_neighbors=0)
    same.build(**a.start.arguments)
    same.update(a.start.points, a.end.points)
    assert len(same.moving_pairs()) > 0


def test_safe_steps():
    for seed in range(20):
        # Few short moves of thin fibers, so that the first impact is not at once.
        tree = Step(100 + seed, fibers=8, speed=0.1).tree(ignored_neighbors=1)
        for others in ((), (Step(200 + seed, fibers=8, speed=0.1).tree(),)):
            time, impacts = tree.safe_step(*others), tree.impacts(*others)
            assert 0 <= time <= 1
            if (impacts["time"] > 0).all():
                assert time == pytest.approx(impacts["time"].min(initial=1), abs=1e-9)


def two(height, end_height):
    """Two crossing capsules of radius 1/4, whose axes go from one height to the other."""
    points = np.array([(-1, 0, 0), (1, 0, 0), (0, -1, height), (0, 1, height)], float)
    end = points.copy()
    end[2:, 2] = end_height
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    tree.build(points, [0, 2, 4], 0.25)
    tree.update(points, end)
    return tree


@pytest.mark.parametrize(
    "height, end_height, impact, safe",
    [
        (1.5, -0.5, 0.5, 0.5),
        (1.0, 0.5, 1.0, 1.0),
        (1.0, 0.75, None, 1.0),
        (10.5, -9.5, 0.5, 0.5),  # through each other
        (0.25, 2.0, 0.0, 1.0),  # touching, and moving apart
        (0.25, 0.25, 0.0, 1.0),  # touching, at rest
        (0.25, 0.125, 0.0, 0.0),  # touching, and coming nearer
    ],
)
def test_known_steps(height, end_height, impact, safe):
    tree = two(height, end_height)
    times = tree.impacts()["time"].tolist()
    assert times == ([] if impact is None else [pytest.approx(impact, abs=1e-9)])
    # One that touches has to come nearer by 2^-35 of the sizes first.
    assert tree.safe_step() == pytest.approx(safe, abs=1e-8)
    assert len(tree.pairs()) == (abs(end_height) <= 0.5)  # other calls ask about the end


def test_trees_without_a_step():
    step, rest = Step(8).tree(), fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    rest.build(**Step(8).start.arguments)
    impacts = step.impacts()
    updated = Step(8).tree()
    updated.update(Step(8).start.points)
    for tree in (rest, updated):
        for call in (
            tree.impacts,
            tree.moving_pairs,
            tree.safe_step,
            lambda: tree.impact_contacts(impacts),
            lambda: step.impacts(tree),
            lambda: step.safe_step(tree),
            lambda: step.impact_contacts(impacts, tree),
        ):
            with pytest.raises(ValueError, match="rest|step"):
                call()
    volumes = fcl_fibers.FiberTree(report="volumes", ignored_neighbors=0)
    volumes.build(**Step(8).start.arguments)
    volumes.update(Step(8).start.points, Step(8).end.points)
    for call in (volumes.impacts, volumes.safe_step):
        with pytest.raises(ValueError):
            call()
    spheres = fcl_fibers.FiberTree(report="capsules", volumes="spheres", ignored_neighbors=0)
    spheres.build(**Step(8).start.arguments)
    with pytest.raises(ValueError, match="spheres"):
        spheres.update(Step(8).start.points, Step(8).end.points)


def mesh_gaps(step, corners, end_corners, time):
    start, end, radius = step.at(time)
    triangles = corners + time * (end_corners - corners)
    return oracles.segment_triangle(start[:, None], end[:, None], triangles) - radius[:, None]


@pytest.mark.parametrize("moves", [False, True])
def test_impacts_with_a_mesh(moves):
    step = Step(9, speed=0.2)
    tree = step.tree()
    points, triangles = ball(rings=4, radius=0.3)
    mesh = fcl_fibers.TriangleMesh(points, triangles)
    mesh.set_pose(np.eye(3), (0.5, 0.5, 0.5))
    moved = mesh.copy()
    if moves:
        moved.set_pose(np.eye(3), (0.6, 0.5, 0.7))
    ends = (mesh, moved) if moves else (mesh,)
    corners = (points + mesh.pose[1])[triangles]
    end_corners = (points + moved.pose[1])[triangles]
    impacts = tree.impacts(*ends)
    sampled = np.array([mesh_gaps(step, corners, end_corners, time) for time in MOMENTS])
    i, j = np.nonzero((sampled <= -ERROR).any(axis=0))
    found = oracles.as_set(np.column_stack([impacts["segment"], impacts["triangle"]]))
    assert set(zip(step.names[i].tolist(), j.tolist())) <= found
    assert (impacts["time"] > 0).sum() > 25
    at = np.searchsorted(step.names, impacts["segment"])
    for k, triangle, time in zip(at, impacts["triangle"], impacts["time"]):
        assert (sampled[MOMENTS < time, k, triangle] >= -ERROR).all()
        assert mesh_gaps(step, corners, end_corners, time)[k, triangle] <= ERROR
    contacts = tree.impact_contacts(impacts, *ends)
    assert (contacts["triangle"] == impacts["triangle"]).all()
    late = impacts["time"] > 0
    assert contacts["distance"][late] == pytest.approx(np.zeros(late.sum()), abs=1e-8)
    time = tree.safe_step(*ends)
    apart = sampled[0] > ERROR
    assert 0 <= time <= 1 and (sampled[MOMENTS < time][:, apart] >= -ERROR).all()
