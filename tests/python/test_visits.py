# SPDX-License-Identifier: BSD-3-Clause
"""Visitors of pairs: blocks, how a visit ends, and calls of the tree from inside."""

import numpy as np
import pytest

import fcl_fibers
from scenes import random_scene
from test_contacts import tree_of


@pytest.fixture(scope="module", params=[1, 2])
def tree(request):
    return tree_of(random_scene(1, fibers=60), threads=request.param)


@pytest.fixture(scope="module")
def other():
    return tree_of(random_scene(2))


@pytest.mark.parametrize("block", [1, 2, 7, 1000, 10**6, 2**62])
@pytest.mark.parametrize("beside", [False, True])
def test_blocks(tree, other, block, beside):
    second = other if beside else None
    expected, blocks = tree.pairs(second), []
    assert tree.visit_pairs(blocks.append, second, block=block) is False
    assert [len(b) for b in blocks[:-1]] == [block] * (len(blocks) - 1)
    assert 0 < len(blocks[-1]) <= block
    assert all(b.dtype == np.int32 and b.flags.writeable for b in blocks)
    assert (np.concatenate(blocks) == expected).all()


@pytest.mark.parametrize("last", [False, True])
@pytest.mark.parametrize("result", [True, 1, "yes", [0], np.bool_(True)])
def test_a_true_value_ends_the_visit(tree, result, last):
    block = len(tree.pairs()) if last else 10
    calls = []

    def visit(pairs):
        calls.append(len(pairs))
        return result if last or len(calls) == 3 else 0

    assert tree.visit_pairs(visit, block=block) is True
    assert calls == ([block] if last else [10] * 3)


@pytest.mark.parametrize("result", [None, False, 0, "", [], np.float32(0)])
def test_a_false_value_goes_on(tree, result):
    assert tree.visit_pairs(lambda pairs: result, block=100) is False


def test_a_tree_without_pairs_calls_nothing():
    tree = fcl_fibers.FiberTree()
    assert tree.visit_pairs(lambda pairs: pytest.fail("a call")) is False


class Wrong(Exception):
    pass


@pytest.mark.parametrize(
    "error", [Wrong("text"), KeyboardInterrupt(), SystemExit(3), StopIteration(), MemoryError()]
)
@pytest.mark.parametrize("block", [1, 10, 10**6])
def test_exceptions_are_passed_on(tree, error, block):
    def visit(pairs):
        raise error

    before = tree.pairs()
    with pytest.raises(type(error)) as raised:
        tree.visit_pairs(visit, block=block)
    assert raised.value is error
    assert (tree.pairs() == before).all()
    tree.update(random_scene(1, fibers=60).points)  # it counts as no running query


def test_a_value_without_truth_is_an_error(tree):
    with pytest.raises(ValueError, match="truth value"):
        tree.visit_pairs(lambda pairs: pairs, block=10)
    assert tree.visit_pairs(lambda pairs: None) is False


def test_calls_that_do_not_fit(tree):
    with pytest.raises(TypeError):
        tree.visit_pairs(lambda: None)


def test_queries_from_inside(tree, other):
    pairs, contacts = tree.pairs(), tree.contacts()
    depth = 0

    def visit(found):
        nonlocal depth
        depth += 1
        assert (tree.pairs() == pairs).all() and (tree.contacts() == contacts).all()
        assert len(tree.pairs(other)) > 0 and len(tree.fiber_segment(found)) == len(found)
        if depth < 4:
            tree.visit_pairs(visit, block=1)
        return True

    assert tree.visit_pairs(visit, block=1) is True
    assert depth == 4


@pytest.mark.parametrize("catches", [False, True])
@pytest.mark.parametrize("block", [10, 10**6])
def test_changes_from_inside(tree, block, catches):
    scene = random_scene(1, fibers=60)
    before, refusals = tree.contacts(), 0

    def visit(pairs):
        nonlocal refusals
        for change in (
            lambda: tree.update(scene.points),
            lambda: tree.update(scene.points, scene.points),
            lambda: tree.build(**scene.arguments),
        ):
            with pytest.raises(RuntimeError, match="still running"):
                change()
            refusals += 1
        if not catches:
            tree.update(scene.points)

    if catches:
        tree.visit_pairs(visit, block=block)
    else:
        with pytest.raises(RuntimeError, match="still running"):
            tree.visit_pairs(visit, block=block)
    assert refusals >= 3 and (tree.contacts() == before).all()
    tree.update(scene.points)
    assert (tree.contacts() == before).all()


def test_another_tree_is_in_use_too(tree, other):
    scene = random_scene(2)

    def visit(pairs):
        with pytest.raises(RuntimeError, match="still running"):
            other.update(scene.points)
        return True

    assert tree.visit_pairs(visit, other) is True
    other.update(scene.points)


def test_a_visit_may_drop_the_tree():
    trees = [tree_of(random_scene(3))]
    expected, blocks = trees[0].pairs(), []

    def visit(pairs):
        trees.clear()
        blocks.append(pairs)

    trees[0].visit_pairs(visit, block=10)
    assert (np.concatenate(blocks) == expected).all()
