# SPDX-License-Identifier: BSD-3-Clause
"""Pairs that would be too many, and one radius for all."""

import numpy as np
import pytest

import fcl_fibers
from scenes import random_scene


def test_without_a_limit_a_scene_without_hope_is_an_error():
    """If this failed, a radius in the wrong unit would fill all memory."""
    points = np.random.default_rng(1).random((2 * 17_000, 3))
    tree = fcl_fibers.FiberTree(threads=2)
    tree.build(points, np.arange(0, len(points) + 1, 2), 10.0)
    with pytest.raises(ValueError, match="more pairs than the limit, 134217728; the radius"):
        tree.pairs()
    with pytest.raises(
        ValueError, match=r"unit of the points, or ask visit_pairs\(\), which keeps"
    ):
        tree.closest()


@pytest.mark.parametrize("report", ["volumes", "capsules"])
def test_more_pairs_than_the_limit_are_an_error(report):
    scene = random_scene(9, fibers=60)
    tree = fcl_fibers.FiberTree(report=report, ignored_neighbors=1)
    tree.build(scene.points, scene.offsets, scene.radii)
    mesh = fcl_fibers.TriangleMesh(np.eye(3), [(0, 1, 2)])
    other = fcl_fibers.FiberTree(report=report, ignored_neighbors=1)
    other.build(scene.points + 0.1, scene.offsets, scene.radii)
    calls = [tree.pairs]
    if report == "capsules":
        calls.append(tree.contacts)
    partners = [None, other] if report == "volumes" else [None, other, mesh]
    for call in calls:
        for partner in partners:
            found = call(partner)
            count = len(found)
            assert count > 5
            for limit in (count, count + 1, None, 2**62):
                assert (call(partner, limit=limit) == found).all()
            for order in ("segments", "fibers"):
                assert len(call(partner, order, limit=count)) == count
                with pytest.raises(ValueError, match="more pairs than the limit, 3"):
                    call(partner, order, limit=3)
            for limit in (0, 1, count - 1):
                text = f"more pairs than the limit, {limit}; the radius or the margin is probably"
                with pytest.raises(ValueError, match=text):
                    call(partner, limit=limit)
            assert (call(partner) == found).all()
            for wrong, error in ((-1, ValueError), (1.5, TypeError), (2**64, ValueError)):
                with pytest.raises(error, match="limit"):
                    call(partner, limit=wrong)


def test_limits_of_steps_and_points():
    scene = random_scene(9, fibers=60)
    trees = []
    for _ in range(2):
        trees.append(fcl_fibers.FiberTree(report="capsules", ignored_neighbors=1))
        trees[-1].build(scene.points, scene.offsets, scene.radii)
        trees[-1].update(scene.points + len(trees) * 0.2, scene.points)
    tree, other = trees
    mesh = fcl_fibers.TriangleMesh(np.eye(3), [(0, 1, 2)])
    moved = mesh.copy()
    moved.set_pose(np.eye(3), (0.1, 0, 0))
    plane = fcl_fibers.PlaneShape((0, 0, 1), 0.5)
    for call, *arguments in (
        (tree.impacts,),
        (tree.impacts, other),
        (tree.impacts, mesh, moved),
        (tree.impacts, plane),
        (tree.moving_pairs,),
        (tree.moving_pairs, other),
        (tree.holding, scene.points),
    ):
        found = call(*arguments)
        assert len(found) > 5
        for limit in (len(found), None):
            assert (call(*arguments, limit=limit) == found).all()
        for limit in (0, len(found) - 1):
            with pytest.raises(ValueError, match=f"more pairs than the limit, {limit};"):
                call(*arguments, limit=limit)
        for wrong, error in ((-1, ValueError), (1.5, TypeError)):
            with pytest.raises(error, match="limit"):
                call(*arguments, limit=wrong)


def test_none_is_no_more_than_a_limit_of_none():
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=1)
    tree.build([np.eye(3)], radius=0.1)
    assert len(tree.pairs(limit=0)) == len(tree.contacts(limit=0)) == 0


def test_one_radius(tmp_path):
    points = np.random.default_rng(10).uniform(size=(5, 20, 3))
    trees = [fcl_fibers.FiberTree(report="capsules", ignored_neighbors=1) for _ in range(2)]
    trees[0].build(points, radii=0.05)
    trees[1].build(points, radius=0.05)
    assert len(trees[0].pairs()) > 5
    for radius in (0.07, np.float32(0.06), 1):
        assert (trees[0].contacts() == trees[1].contacts()).all()
        trees[0].update(points, radii=radius)
        trees[1].update(points, radius=radius)
    trees[0].update(points, points + 0.1, 0.2, 0.2)
    trees[1].update(points, points + 0.1, radius=0.2)
    assert (trees[0].impacts() == trees[1].impacts()).all()
    fcl_fibers.write(tmp_path / "a.vtp", points, radius=0.5)
    assert fcl_fibers.read(tmp_path / "a.vtp").radii == 0.5
    assert "<script" in fcl_fibers.show(points, radius=0.01).html
    with pytest.raises(TypeError, match="radius and radii are both given"):
        trees[0].build(points, radii=1.0, radius=1.0)
    with pytest.raises(TypeError, match=r"radius is \[1, 2\]; give a number"):
        trees[0].build(points, radius=[1, 2])


def test_a_radius_in_the_place_of_another_argument_is_told():
    points = np.random.default_rng(11).uniform(size=(5, 20, 3))
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=1)
    for given in (points, list(points), points.tolist()):
        with pytest.raises(TypeError, match="0.05 is in the place of offsets.*radius=0.05"):
            tree.build(given, 0.05)
        with pytest.raises(TypeError, match="0.05 is in the place of offsets.*radius=0.05"):
            fcl_fibers.show(given, 0.05)
    tree.build(points, radius=0.05)
    for given in (points, list(points)):
        with pytest.raises(TypeError, match="the number 0.1 is in the place of end.*radius=0.1"):
            tree.update(given, 0.1)
