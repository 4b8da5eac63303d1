# SPDX-License-Identifier: BSD-3-Clause
"""Least distances, nearest segments, and segments that hold points, against brute force."""

import subprocess
import sys

import numpy as np
import pytest

import fcl_fibers
import oracles
from scenes import ball, cross, random_scene
from test_contacts import tree_of

ERROR = 1e-9  # of scenes of size one: the oracle's, at axes that are not nearly parallel


def moved(scene, away):
    return oracles.Scene(scene.points + scene.points.dtype.type(away), scene.offsets, scene.radii)


def expect_nearest(found, gap, names, names_of_others, distance):
    """That rows `found` are what is at most `distance` from another, with the nearest of these."""
    least = gap.min(axis=1)
    assert sorted(found[:, 0].tolist()) == names[least <= distance].tolist()
    at = np.searchsorted(names, found[:, 0]), np.searchsorted(names_of_others, found[:, 1])
    assert gap[at] == pytest.approx(least[at[0]], abs=ERROR)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("away", [0.0, 3.0])
def test_two_trees(dtype, away):
    a, b = random_scene(31, dtype=dtype), moved(random_scene(32), away)
    tree, other = tree_of(a, margin=0.3), tree_of(b, threads=2)
    gap, _ = oracles.gaps(a, b)
    contact = tree.closest(other)
    assert tree.distance(other) == contact["distance"] == pytest.approx(gap.min(), abs=ERROR)
    at = np.searchsorted(a.names, contact["a"]), np.searchsorted(b.names, contact["b"])
    assert gap[at] == pytest.approx(gap.min(), abs=ERROR)
    assert (contact["distance"] > 0) == (away > 0)
    for distance in (0.05, 5.0, np.inf):
        expect_nearest(tree.nearest(other, distance), gap, a.names, b.names, distance)


@pytest.mark.parametrize("radius", [0.05, 1e-6])
def test_one_tree(radius):
    scene = random_scene(33, radius=radius)
    tree = tree_of(scene, ignored_neighbors=1)
    gap, _ = oracles.gaps(scene, scene)
    kept = scene.kept(ignored_neighbors=1)
    assert tree.distance() == pytest.approx(gap[kept].min(), abs=ERROR)
    gap = np.where(kept | kept.T, gap, np.inf)
    expect_nearest(tree.nearest(distance=0.3), gap, scene.names, scene.names, 0.3)


def way(contacts):
    """That of one segment off a mesh: the shortest out of a solid, or off the nearest triangle."""
    inside = contacts[contacts["solid"]]
    return (
        inside[inside["distance"].argmax()]
        if len(inside)
        else contacts[contacts["distance"].argmin()]
    )


def test_meshes():
    points, triangles = ball(radius=0.2)
    tree = tree_of(random_scene(34), threads=2)
    for solid in (False, True):
        mesh = fcl_fibers.TriangleMesh(points, triangles, solid)
        mesh.set_pose(np.eye(3), (0.5, 0.4, 0.6))
        contacts = tree.contacts(mesh)
        ways = [way(contacts[contacts["segment"] == s]) for s in np.unique(contacts["segment"])]
        assert tree.closest(mesh) == min(ways, key=lambda contact: contact["distance"])
        mesh.set_pose(np.eye(3), (5, 4, 6))
        found = tree_of(random_scene(34), margin=100).contacts(mesh)
        assert tree.distance(mesh) == found["distance"].min() > 0


def test_no_pair_is_infinitely_far():
    empty, tree = fcl_fibers.FiberTree(report="capsules"), tree_of(random_scene(35))
    mesh = fcl_fibers.TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    one = fcl_fibers.FiberTree(report="capsules")
    one.build([np.eye(3)[:2]], radii=0.1)
    for contact in (empty.closest(), empty.closest(tree), tree.closest(empty), one.closest()):
        assert contact["distance"] == np.inf
        assert contact[["a", "b", "fiber_a", "fiber_b"]].item() == (-1, -1, -1, -1)
    assert tree.distance(mesh) == np.inf and tree.closest(mesh)["segment"] == -1
    assert empty.nearest(tree).shape == tree.nearest(empty).shape == (0, 2)
    assert empty.holding(np.eye(3)).shape == tree.nearest_to(np.zeros((0, 3))).shape == (0, 2)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("margin", [0.0, 0.03])
def test_points(dtype, margin):
    scene = random_scene(36)
    tree = tree_of(scene, margin=margin, ignored_neighbors=2, ignored_arc_length=0.5)
    points = np.random.default_rng(37).uniform(-0.5, 1.5, (1000, 3)).astype(dtype)
    array = points.astype(float)
    gap = oracles.point_segment(array[:, None], scene.start, scene.end) - scene.radius
    for distance in (0.0, 0.2, np.inf):
        found = tree.nearest_to(points, distance)
        assert (np.diff(found[:, 0]) > 0).all()
        expect_nearest(found, gap, np.arange(1000), scene.names, distance)
    held = tree.holding(points)
    i, j = np.nonzero(gap <= margin)
    assert held.tolist() == np.stack([i, scene.names[j]], axis=1).tolist()
    assert len(held) > 20


def test_points_that_are_no_places():
    tree = tree_of(random_scene(36))
    for axis, wrong in enumerate((np.nan, np.inf, -np.inf)):
        points = np.zeros((5, 3))
        points[3, axis] = wrong
        for call in (tree.nearest_to, tree.holding):
            with pytest.raises(ValueError, match="^point 3 is NaN or infinite"):
                call(points)


def test_trees_of_volumes_are_refused():
    points, offsets = cross()
    volumes, tree = fcl_fibers.FiberTree(report="volumes"), fcl_fibers.FiberTree(report="capsules")
    for one in (volumes, tree):
        one.build(points, offsets, 0.1)
    for call in (
        volumes.distance,
        lambda: volumes.distance(tree),
        lambda: tree.distance(volumes),
        lambda: volumes.nearest(tree),
        lambda: tree.nearest(volumes),
        lambda: volumes.nearest_to(points),
        lambda: volumes.holding(points),
    ):
        with pytest.raises(ValueError, match="report='capsules'"):
            call()
    for wrong in (points[0], points[:, :2]):
        with pytest.raises(ValueError, match=r"points have shape .*; give \(n, 3\)"):
            tree.holding(wrong)


def test_the_program_measures_distances(tmp_path):
    paths = [tmp_path / "a.txt", tmp_path / "b.txt"]
    for path, height in zip(paths, (0, 5)):
        path.write_text(f"0 0 {height}\n1 0 {height}\n")
    command = [sys.executable, "-m", "fcl_fibers", "distance", *paths, "--radius", "0.5"]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 0 and "the least distance is 4\n" in run.stdout
