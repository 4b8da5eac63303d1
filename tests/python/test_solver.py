# SPDX-License-Identifier: BSD-3-Clause
"""What a solver does with contacts: order, nodes, forces onto points, pairs of fibers."""

import numpy as np
import pytest

from fcl_fibers import FiberTree, HalfSpaceShape, SphereShape, TriangleMesh, fiber_pairs


def curls(seed, fibers=40, points=25, scalar=np.float64):
    random = np.random.RandomState(seed)
    steps = random.uniform(-0.1, 0.1, (fibers, points, 3))
    steps[:, 0] *= 4
    return np.cumsum(steps, axis=1).astype(scalar)


def tree_of(points, threads=1, **options):
    tree = FiberTree(report="capsules", ignored_neighbors=1, threads=threads, **options)
    tree.build(points, radii=0.02)
    return tree


def soup(seed=5, count=300):
    random = np.random.RandomState(seed)
    corners = random.uniform(-0.5, 0.5, (count, 1, 3)) + random.uniform(-0.1, 0.1, (count, 3, 3))
    return TriangleMesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def added(out, points, weights, forces):
    """The loop that accumulate() stands for."""
    for number, force in zip(range(len(points)), forces):
        for point, weight in zip(points[number], weights[number]):
            out[point] = (out[point] + weight * force).astype(out.dtype)


def test_order():
    tree, other = tree_of(curls(1)), tree_of(curls(2))
    for partner in (None, other, soup()):
        found = tree.pairs(partner)
        by_segments = found[np.lexsort((found[:, 1], found[:, 0]))]
        assert not np.array_equal(found, by_segments)
        assert np.array_equal(tree.pairs(partner, order="segments"), by_segments)
        fibers = found // 25
        keys = found[:, 1], found[:, 0], fibers[:, 1], fibers[:, 0]
        by_fibers = by_segments if isinstance(partner, TriangleMesh) else found[np.lexsort(keys)]
        assert np.array_equal(tree.pairs(partner, order="fibers"), by_fibers)
        contacts = tree.contacts(partner, order="fibers")
        names = ("segment", "triangle") if isinstance(partner, TriangleMesh) else ("a", "b")
        assert np.array_equal(np.stack([contacts[n] for n in names], 1), by_fibers)
    with pytest.raises(ValueError, match="order is 'fiber'; give one of 'found'"):
        tree.pairs(order="fiber")


def test_bare_contacts():
    tree, other = tree_of(curls(1)), tree_of(curls(2))
    for partner in (None, other):
        contacts, bare = tree.contacts(partner), tree.contacts(partner, bare=True)
        assert bare.dtype.itemsize == 64 and len(bare) > 100
        for name in bare.dtype.names:
            assert np.array_equal(bare[name], contacts[name])


@pytest.mark.parametrize("scalar", [np.float32, np.float64])
def test_nodes_carry_the_contact_points(scalar):
    mine, theirs = curls(1, scalar=scalar), curls(2, scalar=scalar)
    tree, other = tree_of(mine), tree_of(theirs)
    mine, theirs = mine.reshape(-1, 3).astype(float), theirs.reshape(-1, 3).astype(float)
    radius = float(tree._tree.numbers.radii[0])

    def carried(points, nodes):
        return np.einsum("nk,nkc->nc", nodes.weights, points[nodes.points])

    contacts = tree.contacts()
    points, weights = tree.nodes(contacts)
    assert points.dtype == np.int32 and points.shape == weights.shape == (len(contacts), 4)
    push = radius * contacts["normal"]
    for side, place in ((slice(0, 2), contacts["point_a"] - push), (slice(2, 4), None)):
        place = contacts["point_b"] + push if place is None else place
        at = np.einsum("nk,nkc->nc", weights[:, side], mine[points[:, side]])
        assert np.allclose(at, place, rtol=0, atol=1e-13)
    assert np.array_equal(tree.nodes(tree.contacts(bare=True)).points, points)

    contacts = tree.contacts(other)
    a, b = tree.nodes(contacts, other)
    push = radius * contacts["normal"]
    assert np.allclose(carried(mine, a), contacts["point_a"] - push, rtol=0, atol=1e-13)
    assert np.allclose(carried(theirs, b), contacts["point_b"] + push, rtol=0, atol=1e-13)

    mesh = soup()
    mesh.set_pose(np.eye(3), (0.1, 0, 0))
    contacts = tree.contacts(mesh)
    a, b = tree.nodes(contacts, mesh)
    corners = mesh.placed()[0]
    assert b.points.shape == (len(contacts), 3)
    assert np.allclose(carried(corners, b), contacts["point_b"], rtol=0, atol=1e-13)
    alone = tree.nodes(contacts)
    assert np.array_equal(alone.points, a.points) and np.array_equal(alone.weights, a.weights)


@pytest.mark.parametrize("scalar", [np.float32, np.float64])
@pytest.mark.parametrize("threads", [1, 3])
def test_accumulate_is_a_loop(scalar, threads):
    random = np.random.RandomState(7)
    tree, other = tree_of(curls(1), threads), tree_of(curls(2))
    signs = np.array([-1, -1, 1, 1])
    for bare in (False, True):
        contacts = tree.contacts(bare=bare)
        pushes, vectors = random.randn(len(contacts)), random.randn(len(contacts), 3)
        points, weights = tree.nodes(contacts)
        for forces in (pushes, vectors):
            full = forces if forces.ndim == 2 else forces[:, np.newaxis] * contacts["normal"]
            out = random.randn(1000, 3).astype(scalar)
            expected = out.copy()
            added(expected, points, signs * weights, full)
            assert tree.accumulate(contacts, forces, out) is out
            assert np.array_equal(out, expected)
    sums = tree.accumulate(contacts, pushes)
    assert sums.dtype == np.float64 and np.abs(sums.sum(axis=0)).max() < 1e-10
    by_fiber = np.zeros((40, 25, 3))
    assert tree.accumulate(contacts, pushes, by_fiber) is by_fiber
    assert np.array_equal(by_fiber.reshape(-1, 3), sums)

    contacts = tree.contacts(other)
    vectors = random.randn(len(contacts), 3)
    a, b = tree.nodes(contacts, other)
    expected, others = np.zeros((1000, 3), scalar), np.zeros((1000, 3), scalar)
    added(expected, a.points, -a.weights, vectors)
    added(others, b.points, b.weights, vectors)
    out, other_out = np.zeros_like(expected), np.zeros_like(others)
    tree.accumulate(contacts, vectors, out, other, other_out)
    assert np.array_equal(out, expected) and np.array_equal(other_out, others)
    assert np.array_equal(tree.accumulate(contacts, vectors, out * 0, other=other), expected)

    mesh = soup()
    contacts = tree.contacts(mesh)
    pushes = random.randn(len(contacts))
    a, b = tree.nodes(contacts, mesh)
    forces = pushes[:, np.newaxis] * contacts["normal"]
    expected, others = np.zeros((1000, 3), scalar), np.zeros((900, 3), scalar)
    added(expected, a.points, -a.weights, forces)
    added(others, b.points, b.weights, forces)
    out, other_out = np.zeros_like(expected), np.zeros_like(others)
    tree.accumulate(contacts, pushes, out, mesh, other_out)
    assert np.array_equal(out, expected) and np.array_equal(other_out, others)
    assert np.array_equal(tree.accumulate(contacts, pushes, out * 0), expected)


@pytest.mark.parametrize("scalar", [np.float32, np.float64])
@pytest.mark.parametrize("threads", [1, 3])
def test_contacts_with_shapes(scalar, threads):
    points = curls(1, scalar=scalar)
    tree = tree_of(points, threads)
    tree.update(points, points + np.random.RandomState(3).uniform(-0.1, 0.1, points.shape))
    random = np.random.RandomState(8)
    for shape in (HalfSpaceShape((0, 0.6, 0.8), 0), SphereShape((0.1, 0, 0), 0.4)):
        for contacts in (
            tree.contacts(shape),
            tree.contacts(shape)[::-2],
            tree.impact_contacts(tree.impacts(shape), shape),
        ):
            assert len(contacts) > 50
            first, s = contacts["segment"], contacts["s"]
            nodes, weights = tree.nodes(contacts)
            assert np.array_equal(nodes, np.stack([first, first + 1], 1))
            assert np.array_equal(weights, np.stack([1 - s, s], 1))
            pushes = random.randn(len(contacts))
            for forces in (pushes, random.randn(len(contacts), 3)):
                full = forces if forces.ndim == 2 else forces[:, np.newaxis] * contacts["normal"]
                out = np.zeros((1000, 3), scalar)
                expected = out.copy()
                added(expected, nodes, -weights, full)
                tree.accumulate(contacts, forces, out)
                assert np.array_equal(out, expected) and out.any()
    for call in (tree.nodes, lambda c, other: tree.accumulate(c, pushes, other=other)):
        for other in (tree, soup()):
            with pytest.raises((TypeError, ValueError), match="leave|or nothing"):
                call(contacts, other)


def test_some_contacts_in_any_layout():
    tree = tree_of(curls(1))
    contacts = tree.contacts()
    pushes = np.arange(len(contacts), dtype=float)
    touching = contacts["distance"] < -0.01
    assert 0 < touching.sum() < len(contacts)
    expected = tree.accumulate(contacts[touching], pushes[touching])
    assert np.array_equal(tree.accumulate(contacts, np.where(touching, pushes, 0)), expected)
    assert np.array_equal(
        tree.accumulate(contacts[::2], pushes[::2].tolist()),
        tree.accumulate(contacts[::2].copy(), pushes[::2]),
    )
    both = np.concatenate([contacts, contacts])
    assert np.allclose(
        tree.accumulate(both, np.ones(len(both))),
        2 * tree.accumulate(contacts, np.ones(len(contacts))),
    )


def test_contacts_of_impacts():
    start = curls(1)
    tree, other = tree_of(start), tree_of(curls(2))
    tree.update(start, start + np.random.RandomState(3).uniform(-0.1, 0.1, start.shape))
    other.update(curls(2), curls(2))
    for partner in (None, other, soup()):
        contacts = tree.impact_contacts(tree.impacts(partner), partner)
        assert len(contacts) > 100 and np.all(contacts["layout"] != 0)
        nodes = tree.nodes(contacts, partner)
        first = nodes.points if partner is None else nodes[0].points
        name = "segment" if isinstance(partner, TriangleMesh) else "a"
        assert np.array_equal(first[:, 0], contacts[name])
        tree.accumulate(contacts, np.ones(len(contacts)), other=partner)


def test_refusals():
    tree, other, mesh = tree_of(curls(1)), tree_of(curls(2, 30)), soup()
    contacts, ones = tree.contacts(), np.ones(len(tree.contacts()))
    out = np.zeros((1000, 3))
    for wrong in (np.nan, np.inf, -np.inf):
        forces = ones.copy()
        forces[17] = wrong
        with pytest.raises(ValueError, match="contact 17: its force is NaN, infinite"):
            tree.accumulate(contacts, forces, out)
    with pytest.raises(ValueError, match="forces for"):
        tree.accumulate(contacts, ones[1:], out)
    with pytest.raises(ValueError, match=r"forces have shape .* give \(n,\) or \(n, 3\)"):
        tree.accumulate(contacts, np.ones((len(ones), 2)), out)
    with pytest.raises(ValueError, match="sums for 999 points, but the tree has 1000"):
        tree.accumulate(contacts, ones, out[1:])
    with pytest.raises(ValueError, match="C-contiguous and writable"):
        tree.accumulate(contacts, ones, np.zeros((3, 1000)).T)
    with pytest.raises(TypeError, match="out is of type int64; give an array of float"):
        tree.accumulate(contacts, ones, np.zeros((1000, 3), int))
    with pytest.raises(TypeError, match="other_out is given without other"):
        tree.accumulate(contacts, ones, out, other_out=out)
    with pytest.raises(ValueError, match="not of this tree and this partner"):
        tree.accumulate(contacts, ones, out, other, np.zeros((750, 3)))
    with pytest.raises(ValueError, match="contacts are of two segments; leave the mesh out"):
        tree.accumulate(contacts, ones, out, mesh)
    with pytest.raises(ValueError, match="not of this tree and this partner"):
        tree.nodes(contacts, other)
    with pytest.raises(TypeError, match="leave the mesh out"):
        tree.nodes(contacts, mesh)
    with pytest.raises(TypeError, match="give the mesh, or nothing"):
        tree.nodes(tree.contacts(mesh), tree)
    with pytest.raises(TypeError, match="contacts are .*give an array that contacts"):
        tree.accumulate(tree.pairs(), ones, out)
    of_mesh = tree.contacts(mesh)
    for found, field, partner in (
        (contacts, "a", None),
        (tree.contacts(other), "b", other),
        (of_mesh, "segment", mesh),
        (of_mesh, "triangle", mesh),
    ):
        for wrong in (-1, 1000):
            changed = found.copy()
            changed[field][2] = wrong
            for call in (tree.nodes, lambda c, p: tree.accumulate(c, np.ones(len(c)), other=p)):
                with pytest.raises(ValueError, match="contact 2: it is not of this tree"):
                    call(changed, partner)
    changed = contacts.copy()
    changed["s"][3] = 1.5
    with pytest.raises(ValueError, match=r"contact 3: s, t or a weight is not in \[0, 1\]"):
        tree.accumulate(changed, ones, out)
    tree.build(curls(1, 41), radii=0.02)
    for call in (lambda: tree.accumulate(contacts, ones), lambda: tree.nodes(contacts)):
        with pytest.raises(ValueError, match="contact 0: it is not of this tree and this partner"):
            call()
    assert not out.any()


def test_sums_share_no_memory_with_what_is_read():
    tree = tree_of(curls(1))
    memory = np.zeros((2000, 3))
    first, second = memory[:1000], memory[1000:]
    contacts = tree.contacts()[:1000]
    ones = np.ones(1000)
    stored = memory.reshape(-1)[: 10 * contacts.itemsize // 8].view(contacts.dtype)
    stored[:] = contacts[:10]
    before = memory.copy()
    for names, arguments in (
        ("out .* forces", (contacts, first, first)),
        ("out .* forces", (contacts, memory[500:1500], first)),
        ("out .* contacts", (stored, ones[:10], first)),
        ("other_out .* forces", (contacts, first, second, tree, first)),
        ("other_out .* out", (contacts, ones, first, tree, first)),
    ):
        with pytest.raises(ValueError, match=names.replace(".*", "shares memory with")):
            tree.accumulate(*arguments)
        assert np.array_equal(memory, before)
    memory[:] = 0
    tree.accumulate(contacts, ones, first, tree, second)
    assert first.any() and second.any()
    pushes = np.ones((1000, 3), np.float32)  # they are converted, so they are read before
    assert tree.accumulate(contacts, pushes, pushes) is pushes


def test_nothing():
    tree = FiberTree(report="capsules", ignored_neighbors=1)
    contacts = tree.contacts()
    assert tree.nodes(contacts).points.shape == (0, 4)
    assert tree.accumulate(contacts, []).shape == (0, 3)
    assert len(fiber_pairs(contacts)) == 0


def test_fiber_pairs():
    tree = tree_of(curls(1), margin=0.05)
    contacts = tree.contacts(order="fibers")
    pairs = fiber_pairs(contacts)
    distances = {}
    for contact in tree.contacts():
        distances.setdefault((contact["fiber_a"], contact["fiber_b"]), []).append(
            contact["distance"]
        )
    assert len(pairs) == len(distances) > 100
    for pair in pairs:
        of_pair = distances[pair["fiber_a"], pair["fiber_b"]]
        assert pair["count"] == pair["end"] - pair["begin"] == len(of_pair)
        assert contacts["distance"][pair["deepest"]] == min(of_pair)
        assert pair["begin"] <= pair["deepest"] < pair["end"]
    with pytest.raises(
        ValueError, match="is not in the order .*order='fibers', .* by fiber_a, then"
    ):
        fiber_pairs(tree.contacts())
    shape = HalfSpaceShape((0, 0, 1), 0)
    for wrong in (tree.contacts(bare=True), tree.contacts(soup()), tree.contacts(shape)):
        with pytest.raises(
            TypeError, match="give contacts of two segments, with the field fiber_a"
        ):
            fiber_pairs(wrong)
