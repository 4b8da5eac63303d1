# SPDX-License-Identifier: BSD-3-Clause
"""Pairs and contacts of one tree and of two, against brute force."""

import itertools

import numpy as np
import pytest

import fcl_fibers
import oracles
from scenes import random_scene

KINDS = list(
    itertools.product(["capsules", "volumes"], ["bundle", "super_thread"], ["boxes", "spheres"])
)


def tree_of(scene, **options):
    options = {"report": "capsules", "ignored_neighbors": 0, **options}
    tree = fcl_fibers.FiberTree(**options)
    tree.build(**scene.arguments)
    return tree


def test_flat_contacts(tmp_path):
    contacts = tree_of(random_scene(4)).contacts()
    table = fcl_fibers.flat(contacts)
    assert np.shares_memory(table, contacts) and len(table) == len(contacts) > 10
    assert table.dtype.names[:9] == tuple(
        ["a", "b", "layout", "s", "t", "distance", "normal_x", "normal_y", "normal_z"]
    )
    assert all(table.dtype[name].shape == () for name in table.dtype.names)
    for k, axis in enumerate("xyz"):
        for name in ("normal", "point_a", "point_b"):
            assert (table[f"{name}_{axis}"] == contacts[name][:, k]).all()
    np.savetxt(tmp_path / "contacts.csv", table, "%.17g", ",", header=",".join(table.dtype.names))
    read = np.genfromtxt(tmp_path / "contacts.csv", delimiter=",", names=True)
    assert all((read[name] == table[name]).all() for name in table.dtype.names)
    assert fcl_fibers.flat(contacts[::2])["b"].tolist() == contacts["b"][::2].tolist()
    assert len(fcl_fibers.flat(contacts[:0])) == 0
    for wrong in (contacts["a"], contacts.tolist()):
        with pytest.raises(TypeError, match="give an array of contacts"):
            fcl_fibers.flat(wrong)
    frame = pytest.importorskip("pandas").DataFrame(table)
    assert frame["point_b_z"].tolist() == contacts["point_b"][:, 2].tolist()


def test_pairs_with_itself():
    tree = tree_of(random_scene(4), ignored_neighbors=1)
    assert (tree.pairs(tree) == tree.pairs()).all()
    assert (tree.contacts(tree) == tree.contacts()).all()


@pytest.mark.parametrize("arc", [0.1, 0.5, 2.0])
def test_ignored_arc_length(arc):
    scene = random_scene(6, points=12)
    pairs = tree_of(scene, ignored_arc_length=arc).pairs()
    oracles.check_pairs(pairs, scene, ignored_arc_length=arc)
    assert len(pairs) < len(tree_of(scene).pairs())


def check_contact(contacts, a, b, radius_a, radius_b):
    """That each number of contacts between segments a and b, as (start, end), fits the others."""
    s, t = contacts["s"][:, None], contacts["t"][:, None]
    assert ((s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)).all()
    on_a, on_b = a[0] + s * (a[1] - a[0]), b[0] + t * (b[1] - b[0])
    axes = oracles.segment_segment(*a, *b)
    assert oracles.length(on_a - on_b) == pytest.approx(axes, abs=1e-12)
    assert contacts["distance"] == pytest.approx(axes - radius_a - radius_b, abs=1e-12)
    normal = contacts["normal"]
    assert oracles.length(normal) == pytest.approx(np.ones(len(normal)))
    assert contacts["point_a"] == pytest.approx(on_a + normal * radius_a[:, None], abs=1e-12)
    assert contacts["point_b"] == pytest.approx(on_b - normal * radius_b[:, None], abs=1e-12)
    crossing = axes < 1e-9
    way = (on_b - on_a)[~crossing]
    assert normal[~crossing] == pytest.approx(way / oracles.length(way)[:, None], abs=1e-6)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_contacts(dtype, threads):
    scene = random_scene(9, dtype=dtype)
    tree = tree_of(scene, ignored_neighbors=1, threads=threads)
    pairs, contacts = tree.pairs(), tree.contacts()
    assert len(contacts) == len(pairs) > 50
    names_a = scene.offsets[contacts["fiber_a"]] + contacts["number_a"]
    names_b = scene.offsets[contacts["fiber_b"]] + contacts["number_b"]
    assert (np.column_stack([names_a, names_b]) == pairs).all()
    points, radii = scene.points.astype(float), scene.radii.astype(float)
    check_contact(
        contacts,
        (points[names_a], points[names_a + 1]),
        (points[names_b], points[names_b + 1]),
        radii[names_a],
        radii[names_b],
    )
    assert (contacts["distance"] <= 1e-12).all()


def test_contacts_of_two_trees():
    for dtypes in itertools.product([np.float32, np.float64], repeat=2):
        a, b = random_scene(10, dtype=dtypes[0]), random_scene(11, dtype=dtypes[1])
        tree, other = tree_of(a, margin=0.01), tree_of(b)
        pairs, contacts = tree.pairs(other), tree.contacts(other)
        i, j = pairs.T
        assert (a.offsets[contacts["fiber_a"]] + contacts["number_a"] == i).all()
        assert (b.offsets[contacts["fiber_b"]] + contacts["number_b"] == j).all()
        p, q = a.points.astype(float), b.points.astype(float)
        check_contact(
            contacts,
            (p[i], p[i + 1]),
            (q[j], q[j + 1]),
            a.radii.astype(float)[i],
            b.radii.astype(float)[j],
        )


def test_trees_that_do_not_fit_each_other():
    boxes, spheres = (tree_of(random_scene(13), volumes=v) for v in ("boxes", "spheres"))
    thread = tree_of(random_scene(13), topology="super_thread")
    broad = tree_of(random_scene(13), report="volumes")
    for other in (spheres, thread, broad):
        for call in (boxes.pairs, boxes.contacts):
            with pytest.raises(ValueError):
                call(other)
        assert len(boxes.pairs()) > 0
    for other in (1, "tree", np.zeros(3), boxes._tree):
        with pytest.raises(TypeError, match="FiberTree, a TriangleMesh or a Shape"):
            boxes.pairs(other)


def test_empty_trees():
    empty, full = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0), tree_of(
        random_scene(14)
    )
    for one, two in ((empty, None), (empty, full), (full, empty), (empty, empty)):
        assert one.pairs(two).shape == (0, 2) and one.pairs(two).dtype == np.int32
        assert len(one.contacts(two)) == 0
        assert one.contacts(two).dtype == full.contacts().dtype
