# SPDX-License-Identifier: BSD-3-Clause
"""Pairs that live, against brute force and fresh queries, while fibers move."""

import copy
import gc
import pickle
import weakref

import numpy as np
import pytest

import oracles
from fcl_fibers import FiberTree, LivePairs, SphereShape, TriangleMesh, _core
from scenes import ball, cross, random_scene
from test_contacts import tree_of
from test_meshes import TURN, check_mesh_pairs
from test_threads import LongVisit, in_threads


class Story:
    """Checks slots and changes of each update against those of the update before."""

    def __init__(self, live):
        self.live, self.slots, self.last_ended = live, {}, set()

    def check(self):
        pairs, slots = self.live.pairs(), self.live.slots()
        assert pairs.dtype == slots.dtype == np.int32 and pairs.shape == (len(slots), 2)
        assert len(self.live) == len(pairs)
        now = dict(zip(map(tuple, pairs.tolist()), slots.tolist()))
        assert len(now) == len(pairs) == len(set(now.values())), "a pair or a slot comes twice"
        assert all(0 <= slot < self.live.slot_count for slot in now.values())
        begun, ended = (
            dict(zip(map(tuple, change.pairs.tolist()), change.slots.tolist()))
            for change in (self.live.begun(), self.live.ended())
        )
        assert begun == {pair: now[pair] for pair in now.keys() - self.slots.keys()}
        assert ended == {pair: self.slots[pair] for pair in self.slots.keys() - now.keys()}
        assert all(now[pair] == slot for pair, slot in self.slots.items() if pair in now)
        # A program that looks at ended() may still use the slots of the last update.
        assert not set(begun.values()) & set(ended.values())
        self.slots = now
        return pairs


def moved(scene, random, step):
    """All points a little, now and then some of them far."""
    scene.points += random.normal(scale=0.002, size=scene.points.shape)
    if step % 7 == 3:
        scene.points[random.integers(0, len(scene.points), 5)] += random.normal(size=(5, 3)) / 5
    scene.__post_init__()


def rows(array):
    """Sorted, so that orders do not matter."""
    return np.sort(array, order=array.dtype.names[:2])


# If it failed, a solver would miss contacts or see some that are none.
@pytest.mark.parametrize("skin", [None, 0, 0.01, 0.2])
@pytest.mark.parametrize("options", [{}, {"threads": 2, "margin": 0.02, "ignored_neighbors": 2}])
def test_pairs_are_those_of_brute_force(skin, options):
    random = np.random.default_rng(1)
    scene = random_scene(1, fibers=60)
    tree = tree_of(scene, **options)
    live = LivePairs(tree, skin=skin)
    assert (len(live), live.slot_count, live.counters.updates) == (0, 0, 0)
    story = Story(live)
    rules = {name: value for name, value in options.items() if name != "threads"}
    for step in range(40):
        moved(scene, random, step)
        if step == 20:
            tree.update(scene.points, scene.points, radii=scene.radii)
        else:
            tree.update(scene.points, radii=scene.radii if step % 5 else 0.04)
        live.update()
        pairs = story.check()
        if step % 5 or step == 20:
            oracles.check_pairs(pairs, scene, **rules)
        assert oracles.as_set(pairs) == oracles.as_set(tree.pairs()) and len(pairs) > 50
        contacts = live.contacts()
        assert np.array_equal(np.stack([contacts["a"], contacts["b"]], 1), pairs)
        assert np.array_equal(rows(contacts), rows(tree.contacts()))
        assert np.array_equal(rows(live.contacts(bare=True)), rows(tree.contacts(bare=True)))
    counters = live.counters
    assert counters.updates == 40 and 0 < counters.listings <= 40
    assert counters.tested_pairs >= counters.touching_pairs
    if skin is not None:  # what is chosen may be no list
        assert (counters.touching_pairs > 0) == (skin != 0)
    assert live.memory_usage > 0


# If it failed, a step would cost a whole search although nothing has come near.
def test_a_list_serves_many_updates():
    random = np.random.default_rng(2)
    scene = random_scene(2, fibers=100)
    tree = tree_of(scene)
    live = LivePairs(tree, skin=0.1)
    for _ in range(20):
        # Two points come nearer by at most 4 * sqrt(3) * 0.01.
        tree.update(scene.points + random.uniform(-0.01, 0.01, scene.points.shape))
        live.update()
    assert live.skin == 0.1
    assert live.counters.listings == 1 and live.counters.updates == 20


# If it failed, a solver of two bodies would miss contacts, or mix up their segments.
def test_pairs_of_two_trees():
    random = np.random.default_rng(3)
    scene, other_scene = random_scene(3, fibers=60), random_scene(4, fibers=50)
    tree, other = tree_of(scene, margin=0.01), tree_of(other_scene, margin=0.01)
    live = LivePairs(tree, other)
    assert live.tree is tree and live.partner is other
    story = Story(live)
    for step in range(30):
        moved(scene, random, step)
        tree.update(scene.points)
        if step % 3 == 0:
            moved(other_scene, random, step)
            other.update(other_scene.points)
        live.update()
        pairs = story.check()
        gap, error = oracles.gaps(scene, other_scene)
        oracles.check(pairs, scene.names, other_scene.names, gap - 0.01, error)
        assert len(pairs) > 50
        contacts = live.contacts()
        assert np.array_equal(rows(contacts), rows(tree.contacts(other)))
        own, others = tree.nodes(contacts, other)
        assert np.array_equal(own.points[:, 0], pairs[:, 0])
        assert np.array_equal(others.points[:, 0], pairs[:, 1])


# If it failed, hair would fall through a head that nods.
@pytest.mark.parametrize("solid", [False, True])
def test_pairs_with_a_mesh(solid):
    random = np.random.default_rng(6)
    scene = random_scene(15, fibers=60)
    tree = tree_of(scene)
    points, triangles = ball(rings=4, radius=0.4)
    mesh = TriangleMesh(points, triangles, solid=solid)
    live = LivePairs(tree, mesh)
    story = Story(live)
    for step in range(30):
        moved(scene, random, step)
        tree.update(scene.points)
        if step % 2 == 0:
            mesh.set_pose(TURN, (0.5, 0.5, 0.5 + 0.01 * step))
        if step % 5 == 0:
            mesh.update(points * (1 + 0.01 * step))
        live.update()
        pairs = story.check()
        placed, _ = mesh.placed()
        check_mesh_pairs(pairs, scene, placed[triangles], solid)
        assert len(pairs) > 50
        contacts = live.contacts()
        assert np.array_equal(np.stack([contacts["segment"], contacts["triangle"]], 1), pairs)
        keys = ["segment", "triangle"]
        assert np.array_equal(
            np.sort(contacts, order=keys), np.sort(tree.contacts(mesh), order=keys)
        )


# If it failed, a mesh that another thread places would be read in the middle of that.
def test_a_mesh_moves_after_the_update():
    points, offsets = cross()
    tree = FiberTree()
    tree.build(points, offsets, 0.25)
    mesh = TriangleMesh([(-9, -9, 0.5), (9, -9, 0.5), (0, 9, 0.5)], [(0, 1, 2)])
    live = LivePairs(tree, mesh)
    kept = weakref.ref(mesh._mesh)
    live.update()
    assert len(live) == 0
    mesh.set_pose(np.eye(3), (0, 0, -0.375))
    assert len(live) == 0
    live.update()
    assert live.contacts()["distance"] == pytest.approx([-0.125, -0.125])
    # Contacts are with the mesh where it is.
    mesh.set_pose(np.eye(3), (0, 0, -0.25))
    assert live.contacts()["distance"] == pytest.approx([0, 0])
    del mesh
    gc.collect()
    live.update()
    assert kept() is not None and len(live) == 2


def test_a_tree_as_its_own_partner():
    tree = tree_of(random_scene(5))
    live, same = LivePairs(tree), LivePairs(tree, tree)
    live.update(), same.update()
    assert np.array_equal(live.pairs(), same.pairs()) and len(live) > 10


def shortened(random, distances):
    """Ways of any direction, mostly as long as the distances allow."""
    ways = random.normal(size=(len(distances), 3))
    lengths = np.where(np.isfinite(distances), distances, 1) * (1 - 1e-12)
    return ways * (lengths / oracles.length(ways))[:, None]


# If it failed, a solver that cuts its steps would let fibers through each other.
@pytest.mark.parametrize("skips", [False, True])
def test_steps_by_safe_distances_make_no_new_pair(skips):
    random = np.random.default_rng(5)
    scene, other_scene = random_scene(13, fibers=40), random_scene(14, fibers=30)
    tree, other = tree_of(scene), tree_of(other_scene)
    own, both = LivePairs(tree, skin=0.05), LivePairs(tree, other, skin=0.05)
    for _ in range(30):
        own.update(), both.update()
        before = oracles.as_set(own.pairs()), oracles.as_set(both.pairs())
        distances = own.safe_distances(skip_touching=skips)
        with_other, of_other = both.safe_distances(skips)
        assert distances.shape == with_other.shape == (len(scene.points),)
        assert of_other.shape == (len(other_scene.points),) and distances.dtype == np.float64
        touching = np.unique(own.pairs())
        assert skips or not (distances[touching].any() or distances[touching + 1].any())
        assert 0 < np.count_nonzero(np.minimum(distances, with_other))
        scene.points += shortened(random, np.minimum(distances, with_other))
        other_scene.points += shortened(random, of_other)
        tree.update(scene.points), other.update(other_scene.points)
        assert oracles.as_set(tree.pairs()) <= before[0]
        assert oracles.as_set(tree.pairs(other)) <= before[1]


# If it failed, hair would get into the head, or stop far from it.
@pytest.mark.parametrize("skips", [False, True])
def test_steps_by_safe_distances_do_not_touch_a_mesh(skips):
    random = np.random.default_rng(6)
    scene, head = random_scene(15, fibers=40), ball(radius=0.4)
    mesh = TriangleMesh(*head, solid=True)
    tree = tree_of(scene)
    live = LivePairs(tree, mesh, skin=0.05)
    for step in range(10):
        mesh.set_pose(np.eye(3), (0.01 * step, 0, 0))
        with pytest.raises(ValueError, match="the fibers or the mesh have changed; call update"):
            live.safe_distances()
        live.update()
        before = set(live.pairs()[:, 0].tolist())
        distances = live.safe_distances(skip_touching=skips)
        assert distances.shape == (len(scene.points),) and distances.dtype == np.float64
        touching = np.array(sorted(before))
        assert skips or not (distances[touching].any() or distances[touching + 1].any())
        scene.points += shortened(random, np.minimum(distances, 0.1))
        tree.update(scene.points)
        assert set(tree.pairs(mesh)[:, 0].tolist()) <= before


def test_safe_distances_of_few_points():
    points, _ = cross(gap=1.0)
    points = np.concatenate([points, [(5, 5, 5)] * 2])  # of no fiber
    tree = FiberTree()
    tree.build(points, [(0, 2), (2, 4)], 0.25)
    live = LivePairs(tree, skin=2)
    live.update()
    distances = live.safe_distances()
    assert distances[:4] == pytest.approx([0.25] * 4, rel=0.1) and (distances[:4] <= 0.25).all()
    assert distances[4:].tolist() == [np.inf] * 2
    tree.update(points)
    with pytest.raises(ValueError, match="the fibers have changed; call update"):
        live.safe_distances()
    searches = LivePairs(tree, skin=0)
    searches.update()
    with pytest.raises(ValueError, match="no list.*skin above 0"):
        searches.safe_distances()


# If it failed, friction of one pair would go on at two other segments of the same numbers.
def test_a_build_ends_all_pairs():
    scene = random_scene(6)
    tree = tree_of(scene)
    live = LivePairs(tree)
    story = Story(live)
    live.update()
    before = story.check()
    tree.build(**scene.arguments)
    assert len(live.contacts()) == len(before)  # these offsets have the same segments
    live.update()
    assert oracles.as_set(live.ended().pairs) == oracles.as_set(before)
    assert oracles.as_set(live.begun().pairs) == oracles.as_set(live.pairs())
    assert oracles.as_set(live.pairs()) == oracles.as_set(before)
    tree.build(*cross(), 0.25)
    with pytest.raises(ValueError, match="other offsets than at the last update"):
        live.contacts()
    live.update()
    assert live.pairs().tolist() == [[0, 2]] and live.contacts()["a"].tolist() == [0]


def test_results_belong_to_the_program():
    tree = tree_of(random_scene(7))
    live = LivePairs(tree)
    live.update()
    calls = (live.pairs, live.slots, live.contacts, live.begun)
    expected = [np.copy(call()[0]) if call == live.begun else call().copy() for call in calls]
    for call in calls:
        result = call()
        result = result.pairs if call == live.begun else result
        assert result.flags.writeable and len(result) > 10
        result.view(np.uint8)[...] = 77
    for call, before in zip(calls, expected):
        result = call()
        assert np.array_equal(result.pairs if call == live.begun else result, before)


# If it failed, a program that drops its tree would read freed memory.
def test_the_tree_and_the_partner_are_kept():
    points, offsets = cross()
    tree, other = FiberTree(), FiberTree()
    tree.build(points, offsets, 0.25)
    other.build(points + 0.1, offsets, 0.25)
    live = LivePairs(tree, other)
    inner = _core.LiveOfTrees(tree._tree, other._tree, -1.0)
    kept = weakref.ref(tree), weakref.ref(other), weakref.ref(tree._tree), weakref.ref(other._tree)
    del tree, other
    gc.collect()
    live.update()
    assert len(live.contacts()) == len(live) == 4
    del live
    gc.collect()
    assert [one() is None for one in kept] == [True, True, False, False]
    inner.update()
    assert inner.count == 4
    del inner
    gc.collect()
    assert [one() for one in kept] == [None] * 4


def test_what_is_refused():
    tree = tree_of(random_scene(8))
    for wrong, error, text in [
        ({"tree": np.zeros((3, 3))}, TypeError, "tree is a ndarray; give a FiberTree"),
        ({"partner": np.zeros((3, 3))}, TypeError, "partner is a ndarray; give a FiberTree or"),
        ({"partner": SphereShape((0, 0, 0), 1)}, TypeError, r"pairs\(\) of the tree"),
        ({"skin": "wide"}, TypeError, "skin is 'wide'; give a number"),
        ({"skin": -1}, ValueError, "skin is -1.0; give a finite length, or None"),
        ({"skin": np.nan}, ValueError, "skin is nan"),
        ({"skin": np.inf}, ValueError, "skin is inf"),
        ({"tree": FiberTree(volumes="spheres")}, ValueError, "volumes='boxes'"),
        ({"tree": FiberTree(report="volumes")}, ValueError, "report='capsules'"),
        ({"partner": FiberTree(report="volumes")}, ValueError, "report='capsules'"),
    ]:
        with pytest.raises(error, match=text):
            LivePairs(**{"tree": tree, **wrong})
    live = LivePairs(tree, FiberTree(topology="super_thread"))
    with pytest.raises(ValueError, match="topologies"):
        live.update()
    live = LivePairs(tree)
    assert "0 pairs" in repr(live) and bool(live)
    for call in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="LivePairs can be neither copied nor pickled"):
            call(live)


# If it failed, an exception in a step would leave pairs of half of the fibers.
def test_a_refused_update_changes_nothing():
    scene = random_scene(9)
    tree = tree_of(scene)
    live = LivePairs(tree)
    live.update()
    pairs, slots, begun = live.pairs(), live.slots(), live.begun()
    wrong = scene.points.copy()
    wrong[3] = np.nan
    with pytest.raises(ValueError, match="NaN"):
        tree.update(wrong)
    with LongVisit(tree):
        with pytest.raises(RuntimeError, match="still running"):
            live.update()
        # A read is a query, which may run beside others.
        assert np.array_equal(live.pairs(), pairs) and len(live.contacts()) == len(pairs)
    assert live.counters.updates == 1
    assert np.array_equal(live.pairs(), pairs) and np.array_equal(live.slots(), slots)
    assert np.array_equal(live.begun().pairs, begun.pairs)
    live.update()
    assert len(live.begun().pairs) == len(live.ended().slots) == 0


def test_an_update_from_within_a_visitor_is_refused():
    tree = tree_of(random_scene(10))
    live = LivePairs(tree)
    with pytest.raises(RuntimeError, match="around this call"):
        tree.visit_pairs(lambda pairs: live.update())
    live.update()


# If it failed, two threads would read pairs while a third one writes them.
def test_threads():
    scene = random_scene(11, fibers=300, points=12, size=2)
    tree, other = tree_of(scene, threads=2), tree_of(random_scene(12), threads=2)
    lives = LivePairs(tree), LivePairs(tree, other)
    for live in lives:
        live.update()
    reads = [call for live in lives for call in (live.pairs, live.slots, live.contacts)]
    expected = [call() for call in reads]
    for found, wanted in zip(in_threads(reads * 4), expected * 4):
        assert np.array_equal(found, wanted)
    for _ in range(20):
        calls = [lives[0].update, lives[1].update, lambda: tree.update(scene.points), *reads]
        for found in in_threads(calls):
            if isinstance(found, BaseException):
                assert isinstance(found, RuntimeError), found
                assert "still running" in str(found) or "another thread" in str(found)
    for live, wanted in zip(lives, expected[::3]):
        tree.update(scene.points)
        live.update()
        assert oracles.as_set(live.pairs()) == oracles.as_set(wanted)
