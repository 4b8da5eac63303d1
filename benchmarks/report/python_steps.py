# SPDX-License-Identifier: BSD-3-Clause
"""Tables of the Python package: a step beside other ways, and what Python adds to it."""

from tables import Rows, Table, chosen, count, digits, time

SCENES = {  # by the end of the file's name
    "helix-10": "helix 10 x 100",
    "helix-100": "helix 100 x 100",
    "helix-1000": "helix 1,000 x 100",
    "bundles-1000": "bundles 1,000 x 100",
}
QUERIES = {"pairs": "pairs()", "contacts": "contacts()"}
THREADS = {1: "1 thread", 2: "2 threads"}
RIVALS = {
    "all elements": "Numba, all elements of rods whose boxes overlap",
    "midpoint tree": "SciPy's k-d tree of midpoints, exact test in NumPy",
}
READ = (
    "Seconds of a step, which is an update and a query of the pairs that touch, adjacent segments "
    "left out: medians, and both quartiles in parentheses. The rows take turns in one process, "
    "after all have found the same pairs. Numba goes through all elements as PyElastica does, on "
    "one thread. scilpy asks its k-d tree for the neighbours of each segment in a loop of Python; "
    "here SciPy lists all pairs in one call. Neither computes contacts."
)
READ_COSTS = (
    "Python and C++ take turns with the same steps, of 100,000 segments. More is the median of the "
    "ratios of turns, with both quartiles. C++ fills one vector again and again, Python makes an "
    "array for each step; so does C++ in the rows with a new vector. The last row is of whole "
    "processes, which import the package or NumPy alone."
)

LARGE = ("helix-1000", "bundles-1000")


def quartiles(runs):
    return [runs.quantile(share) for share in (0.25, 0.5, 0.75)]


def spread(runs):
    """Median and quartiles, of times."""
    low, middle, high = quartiles(runs)
    scale = next((s for s in (1, 1e-3) if middle >= 0.9995 * s), 1e-6)
    return f"{time(middle)} ({digits(low / scale)} to {digits(high / scale)})"


def step_name(query, threads):
    return f"{query}, {THREADS[threads]}"


def times_as_fast(part, query, threads, rival):
    ours, theirs = (
        part.median("Steps", name, "seconds") for name in (step_name(query, threads), rival)
    )
    return theirs / ours


def steps(parts):
    scenes = chosen(parts, "steps", SCENES)
    rows = Rows(scenes.values())
    for query, call in QUERIES.items():
        for threads, on in THREADS.items():
            runs = ("Steps", step_name(query, threads), "seconds")
            rows.add(f"update() and {call}, {on}", lambda part: spread(part.runs(*runs)))
    for rival, what in RIVALS.items():
        rows.add(what, lambda part: spread(part.runs("Steps", rival, "seconds")))
    for rival, what in RIVALS.items():
        for query, call in QUERIES.items():
            times = f"{call} on 1 thread: times as fast as {what.split(',')[0]}"
            rows.add(times, lambda part: digits(times_as_fast(part, query, 1, rival)) + "x")
    rows.add("pairs that touch", lambda part: count(part.median("Steps", "all elements", "pairs")))
    header = ["", *(SCENES[name] for name in scenes)]
    return Table("python-steps", "A step in Python", header, rows, READ)


def more(part, query, threads, other):
    """Quartiles of what Python takes more than C++, as a share, over turns."""
    medians = (
        part.counters("Overhead", f"{who}/{query}/{threads}").groupby("turn")["seconds"].median()
        for who in ("python", other)
    )
    ours, theirs = medians
    return quartiles(ours / theirs - 1)


def percents(values):
    low, middle, high = (f"{100 * value:.1f}" for value in values)
    return f"{middle} % ({low} to {high})"


def import_more(part):
    ours, numpy = (part.runs("Import", name, "seconds") for name in ("fcl_fibers", "numpy"))
    return quartiles(ours - numpy)


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
                    rows.append([what, *seconds, percents(more(part, query, threads, other))])
    part = parts.get("import")
    if part:
        names = ("fcl_fibers", "numpy")
        low, middle, high = (digits(1e3 * seconds) for seconds in import_more(part))
        seconds = (time(part.median("Import", name, "seconds")) for name in names)
        rows.append(["import fcl_fibers, beside NumPy", *seconds, f"{middle} ms ({low} to {high})"])
    header = ["", "Python", "C++ or NumPy", "more"]
    return Table("python-costs", "What Python adds", header, rows, READ_COSTS)
