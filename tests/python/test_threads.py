# SPDX-License-Identifier: BSD-3-Clause
"""Python's threads and signals beside queries."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import fcl_fibers
from scenes import ball, random_scene
from test_contacts import tree_of

PATIENCE = 60  # seconds after which a test fails, on the slowest machine


def in_threads(calls):
    """The results of calls that start together, or their exceptions."""
    barrier = threading.Barrier(len(calls))
    results = [None] * len(calls)

    def run(i):
        barrier.wait()
        try:
            results[i] = calls[i]()
        except BaseException as error:
            results[i] = error

    threads = [threading.Thread(target=run, args=(i,)) for i in range(len(calls))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
        assert not thread.is_alive()
    return results


@pytest.mark.parametrize("threads", [1, 2])
def test_many_threads_query_one_tree(threads):
    scene = random_scene(1, fibers=300, points=12, size=2)
    tree = tree_of(scene, ignored_neighbors=1, threads=threads)
    tree.update(scene.points, scene.points + 0.01)
    other = tree_of(random_scene(2), threads=threads)
    other.update(random_scene(2).points, random_scene(2).points)
    mesh = fcl_fibers.TriangleMesh(*ball())
    calls = [
        tree.pairs,
        tree.contacts,
        tree.impacts,
        tree.moving_pairs,
        lambda: tree.pairs(other),
        lambda: tree.contacts(mesh),
        lambda: tree.touching_segments(mesh),
        lambda: tree.impacts(other),
        lambda: np.array(tree.safe_step()),
        lambda: tree.volumes(3).center,
        lambda: tree.pairs(fcl_fibers.BoxShape((0, 0, 0), (1, 1, 1))),
        lambda: tree.fiber_segment(scene.names),
    ]
    expected = [call() for call in calls]
    for found, wanted in zip(in_threads(calls * 4), expected * 4):
        assert not isinstance(found, BaseException), found
        assert (found == wanted).all()


class LongVisit:
    """A visit in another thread, which goes on until it is told to end."""

    def __init__(self, tree):
        self.tree, self.inside, self.end = tree, threading.Event(), threading.Event()
        self.thread = threading.Thread(target=tree.visit_pairs, args=(self.visit,))

    def visit(self, pairs):
        self.inside.set()
        assert self.end.wait(PATIENCE)
        return True

    def __enter__(self):
        self.thread.start()
        assert self.inside.wait(PATIENCE)
        return self

    def __exit__(self, *_):
        self.end.set()
        self.thread.join(PATIENCE)
        assert not self.thread.is_alive()


def test_changes_beside_a_query_are_refused():
    scene = random_scene(3)
    tree = tree_of(scene)
    before = tree.contacts()
    with LongVisit(tree):
        for change in (
            lambda: tree.build(**scene.arguments),
            lambda: tree.update(scene.points),
            lambda: tree.update(scene.points, scene.points),
        ):
            with pytest.raises(RuntimeError, match="still running"):
                change()
        assert (tree.contacts() == before).all()
    tree.update(scene.points)
    assert (tree.contacts() == before).all()


def test_a_query_beside_a_build_is_refused_or_answered():
    scene = random_scene(4, fibers=3000, points=12, size=6, radius=0.005)
    tree = tree_of(scene)
    expected = tree.contacts()
    refused = 0
    for _ in range(10):
        results = in_threads([lambda: tree.build(**scene.arguments), tree.contacts, tree.contacts])
        errors = [result for result in results if isinstance(result, BaseException)]
        refused += len(errors)
        assert all(type(error) is RuntimeError for error in errors), errors
        # Either the build was refused, or those queries that came during it.
        assert not (isinstance(results[0], RuntimeError) and len(errors) > 1)
        for found in results[1:]:
            assert isinstance(found, RuntimeError) or (found == expected).all()
    assert refused > 0
    assert (tree.contacts() == expected).all()


def test_what_a_tree_tells_beside_a_build_is_refused_or_right():
    scene = random_scene(4, fibers=3000, points=12, size=6, radius=0.005)
    tree = tree_of(scene)
    contacts = tree.contacts()
    calls = (
        lambda: tree._tree.layout(None),
        lambda: (tree.fiber_count, tree.segment_count),
        lambda: tree.memory_usage > 0,
        lambda: tree.nodes(contacts).points.tolist(),
    )
    expected = [call() for call in calls]

    is_over = threading.Event()

    def build():
        for _ in range(3000):  # a call may meet no build for a while
            tree.build(**scene.arguments)
            if is_over.is_set():
                return

    thread = threading.Thread(target=build)
    thread.start()
    refused = 0
    while thread.is_alive():
        if refused >= 20:
            is_over.set()
        for call, known in zip(calls, expected):
            try:
                assert call() == known
            except RuntimeError as error:
                assert "another thread builds" in str(error)
                refused += 1
    assert refused > 0


def test_of_two_builds_one_may_be_refused(request):
    scenes = random_scene(5, fibers=20), random_scene(6, fibers=15)
    expected = [tree_of(scene).contacts() for scene in scenes]
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    interval = sys.getswitchinterval()
    request.addfinalizer(lambda: sys.setswitchinterval(interval))
    sys.setswitchinterval(1e-6)  # a thread gives way at any line
    for _ in range(1500):
        results = in_threads([lambda s=scene: tree.build(**s.arguments) for scene in scenes])
        errors = [result for result in results if result is not None]
        assert len(errors) <= 1 and all(type(error) is RuntimeError for error in errors)
        last = next(i for i in (0, 1) if tree.fiber_count == len(scenes[i].offsets) - 1)
        assert (tree.contacts() == expected[last]).all()
        tree.update(scenes[last].points)
        if errors:
            assert results[last] is None


def test_two_trees_that_query_each_other():
    a, b = tree_of(random_scene(7)), tree_of(random_scene(8))
    expected = len(a.pairs(b))
    with LongVisit(a), LongVisit(b):
        assert len(a.pairs(b)) == len(b.pairs(a)) == expected


def test_a_mesh_may_move_during_queries():
    tree = tree_of(random_scene(9, fibers=300))
    points, triangles = ball()
    mesh = fcl_fibers.TriangleMesh(points, triangles)
    places = [(0, 0, 0), (0.5, 0.5, 0.5)]
    expected = []
    for place in places:
        mesh.set_pose(np.eye(3), place)
        expected.append(tree.touching_segments(mesh).tobytes())

    def move():
        for i in range(100):
            mesh.set_pose(np.eye(3), places[i % 2])
            mesh.update(points)

    def query():
        return {tree.touching_segments(mesh).tobytes() for _ in range(30)}

    moved, *found = in_threads([move, query, query])
    assert moved is None and all(results <= set(expected) for results in found)


@pytest.fixture(scope="module")
def crowded():
    """All pairs of 8000 segments touch: 32 million."""
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    points = np.random.default_rng(1).uniform(size=(8000, 2, 3))
    tree.build(points, radii=2.0)
    return tree


def count(tree):
    found = 0

    def visit(pairs):
        nonlocal found
        found += len(pairs)

    tree.visit_pairs(visit)
    return found


def test_other_threads_run_during_a_query(crowded):
    turns, done = 0, threading.Event()

    def turn():
        nonlocal turns
        while not done.is_set():
            turns += 1
            time.sleep(0.001)

    thread = threading.Thread(target=turn)
    thread.start()
    try:
        begin, before = time.monotonic(), turns
        crowded.pairs()
        seconds, after = time.monotonic() - begin, turns
    finally:
        done.set()
        thread.join()
    # A query that held the lock would let the other thread run once or twice.
    assert after - before > min(20, seconds * 50)


class Alarm(Exception):
    pass


QUERIES = {
    "pairs": lambda tree: tree.pairs(),
    "contacts": lambda tree: tree.contacts(),
    "pairs of two": lambda tree: tree.pairs(COPY[0]),
    "contacts with a mesh": lambda tree: tree.contacts(MESH),
    "visit_pairs": count,
    "visit_pairs, one block": lambda tree: tree.visit_pairs(len, block=2**40),
}
COPY = []
MESH = fcl_fibers.TriangleMesh(np.zeros((3, 3)), np.tile([0, 1, 2], (2000, 1)))


@pytest.mark.parametrize("query", QUERIES)
def test_an_exception_of_a_handler_ends_a_query(crowded, query):
    if not COPY:
        COPY.append(fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0))
        COPY[0].build(np.random.default_rng(1).uniform(size=(8000, 2, 3)), radii=2.0)

    points = np.random.default_rng(1).uniform(size=(8000, 2, 3))

    def handle(*_):
        # An update is refused as long as the query runs. After it, the exception would come too.
        with pytest.raises(RuntimeError, match="still running"):
            crowded.update(points)
        raise Alarm

    previous = signal.signal(signal.SIGALRM, handle)
    begin = time.monotonic()
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.02)
        with pytest.raises(Alarm):
            QUERIES[query](crowded)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
    assert time.monotonic() - begin < 10
    # The tree works, and no query counts as running.
    assert crowded.visit_pairs(lambda pairs: True) is True
    crowded.update(points)


def test_control_c(crowded):
    # Python's own handler, which is not there if a shell has started the tests in the background.
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    begin = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            while time.monotonic() - begin < PATIENCE:
                crowded.pairs()
    finally:
        signal.signal(signal.SIGINT, previous)
    assert time.monotonic() - begin < 10
    timer.join()
    assert crowded.visit_pairs(lambda pairs: True) is True


def test_a_handler_without_an_exception_ends_nothing(crowded):
    calls = []
    previous = signal.signal(signal.SIGALRM, lambda *_: calls.append(1))
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.02, 0.02)
        found = count(crowded)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
    assert found == 8000 * 7999 // 2 and len(calls) > 0


def test_signals_wait_for_the_main_thread(crowded):
    """A handler runs in the main thread only, so a query of another one goes on."""
    previous = signal.signal(signal.SIGALRM, lambda *_: None)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.02, 0.02)
        (found,) = in_threads([lambda: count(crowded)])
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
    assert found == 8000 * 7999 // 2


@pytest.mark.parametrize("fibers, radius", [(1000, 0.3), (20000, 0.1)])
def test_daemons_in_a_query_do_not_abort_the_end(fibers, radius):
    """The process goes on for a second after the interpreter has ended, and so do queries. Those of
    many fibers have not ended until then."""
    script = f"""
import ctypes, sys, threading, time
import numpy as np
import fcl_fibers

tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
tree.build(np.random.default_rng(1).uniform(size=({fibers}, 2, 3)), radii={radius})

def run(query):
    while True:
        query()

for query in (tree.pairs, lambda: tree.visit_pairs(len, block=100)):
    threading.Thread(target=run, args=(query,), daemon=True).start()
time.sleep(0.2)
libc = ctypes.CDLL(None)
libc.on_exit(ctypes.cast(libc.sleep, ctypes.c_void_p), None)  # calls sleep(the exit status)
sys.exit(1)
"""
    for _ in range(3):
        ended = subprocess.run([sys.executable, "-c", script], capture_output=True, timeout=60)
        assert (ended.returncode, ended.stderr) == (1, b"")
