# SPDX-License-Identifier: BSD-3-Clause
"""Tables of the Python package: a step beside other packages, and what Python adds to it."""

from measured_sets import titles
from ratios import READ, median_of
from tables import Table, chosen, time, time_and_interval

QUERIES = {"pairs": "pairs()", "contacts": "contacts()"}
THREADS = {1: "1 thread", 2: "2 threads"}
OURS = {  # a row of times each, and what it returns
    "pairs, 1 thread": ("pairs()", "pairs that touch"),
    "pairs, 2 threads": ("pairs(), 2 threads", "pairs that touch"),
    "contacts, 1 thread": ("contacts()", "contacts"),
    "contacts, 2 threads": ("contacts(), 2 threads", "contacts"),
    "boxes, 1 thread": ('pairs() of report="volumes"', "pairs whose boxes overlap"),
    "adjacent too, 1 thread": ("contacts() of ignored_neighbors=0", "contacts, of neighbours too"),
    "safe step, 1 thread": ("safe_step() of radius 0", "share of the motion"),
    "PyElastica with our tree": ("FiberContact in PyElastica", "forces of two rods on nodes"),
    "scilpy with our tree": ("TreeIntersectionFinder of scilpy", "streamlines to be removed"),
}
PEERS = {  # a row of ratios each: what it returns, and beside which of ours
    "midpoint tree": ("SciPy, cKDTree of midpoints", "pairs that touch", "pairs, 1 thread"),
    "warp": ("warp, Bvh and a kernel", "pairs that touch, float32", "pairs, 1 thread"),
    "newton, SAP": ("newton, SAP", "contacts, float32", "contacts, 1 thread"),
    "newton, NxN": ("newton, NxN", "contacts, float32", "contacts, 1 thread"),
    "python-fcl": ("python-fcl", "contacts, of neighbours too", "adjacent too, 1 thread"),
    "ipc-toolkit, candidates": (
        "ipc-toolkit, Candidates",
        "pairs whose boxes overlap",
        "boxes, 1 thread",
    ),
    "ipc-toolkit, contacts": (
        "ipc-toolkit, NormalCollisions",
        "contacts, one at a shared end",
        "contacts, 1 thread",
    ),
    "ipc-toolkit, safe step": (
        "ipc-toolkit, safe step",
        "at most our share of the motion",
        "safe step, 1 thread",
    ),
    "PyElastica": (
        "PyElastica, RodRodContact",
        "forces of two rods on nodes",
        "PyElastica with our tree",
    ),
    "scilpy": ("scilpy, IntersectionFinder", "streamlines to be removed", "scilpy with our tree"),
}
READ_STEPS = (
    "A step is an update and a query, on one thread where the row does not say; adjacent segments "
    "are left out except where neighbours are named. Our rows are medians with their 95 % "
    "intervals, those of the others tell how many times as fast ours are that return the same. "
    "All take turns in one process, after the answers have been checked; the steps of one turn "
    "count as one run, by their median, so that a fast one has its data in the cache. A dash: the "
    "package is not installed, or the other of the two is too slow. "
) + READ
READ_COSTS = (
    "Python and C++ take turns with the same steps, of 100,000 segments. More is the median of the "
    "ratios of turns, with its 95 % interval. C++ fills one vector again and again, Python makes "
    "an array for each step; C++ makes one, too, in the rows with a new vector. The last row is of "
    "whole processes, which import the package or NumPy alone."
)

LARGE = ("helix-1000", "bundles-1000")


def turns(part, kind, name):
    """The median of each turn: steps that follow each other are alike."""
    return part.counters(kind, name).groupby("turn")["seconds"].median()


def times_as_long(part, peer):
    """As ours that returns the same, turn by turn: a machine is slower in some turns, for both."""
    theirs, ours = (turns(part, "Steps", name) for name in (peer, PEERS[peer][-1]))
    return median_of(theirs / ours)


def peer_cell(part, peer):
    if not part.has("Checked", peer):
        return "-"
    return part.note(peer) or times_as_long(part, peer).text()


def steps(parts):
    names = titles("steps")
    scenes = chosen(parts, "steps", names)

    def row(who, returns, cell):
        return [who, returns, *map(cell, scenes.values())]

    rows = []
    for name, (call, returns) in OURS.items():
        of = ("Steps", name)
        rows.append(
            row(
                call,
                returns,
                lambda p: time_and_interval(turns(p, *of)) if p.has(*of) else "-",
            )
        )
    for name, (title, returns, _) in PEERS.items():
        rows.append(row(title, returns, lambda part: peer_cell(part, name)))
    header = ["", "what it returns", *(names[name] for name in scenes)]
    return Table("python-steps", "A step in Python", header, rows, READ_STEPS)


def more(part, query, threads, other):
    """What Python takes more than C++: the median of turns as a share, with its interval."""
    ours, theirs = (
        turns(part, "Overhead", f"{who}/{query}/{threads}") for who in ("python", other)
    )
    found = median_of(ours / theirs)
    middle, low, high = (f"{100 * (x - 1):.1f}" for x in (found.value, found.low, found.high))
    return f"{middle} % ({low} to {high})"


def costs(parts):
    rows = []
    for scene, part in chosen(parts, "overhead", LARGE).items():
        for query, call in QUERIES.items():
            for threads, on in THREADS.items():
                for other, into in (("cpp", ""), ("cpp_new", ", new vector")):
                    if not part.has("Overhead", f"{other}/{query}/{threads}"):
                        continue
                    seconds = (
                        time(part.median("Overhead", f"{who}/{query}/{threads}", "seconds"))
                        for who in ("python", other)
                    )
                    what = f"{scene.split('-')[0]}, {call}, {on}{into}"
                    rows.append([what, *seconds, more(part, query, threads, other)])
    part = parts.get("import")
    if part:
        names = ("fcl_fibers", "numpy")
        runs = [part.runs("Import", name, "seconds") for name in names]
        times = [*(time(found.median()) for found in runs), time_and_interval(runs[0] - runs[1])]
        rows.append(["import fcl_fibers, beside NumPy", *times])
    header = ["", "Python", "C++ or NumPy", "more"]
    return Table("python-costs", "What Python adds", header, rows, READ_COSTS)
