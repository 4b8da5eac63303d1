# SPDX-License-Identifier: BSD-3-Clause
"""The tables of what threads gain."""

from ratios import ratio_of
from tables import Table, chosen, time

READ = (
    "Times are medians. A gain is the time of one thread divided by that of so many threads. The "
    "plain loop sums the squares of all coordinates, so its gain is the machine's own. Capsules "
    "are without neighbours in a fiber, and volumes with them. A frame is an update and a query "
    "of capsules."
)
# By the kind of run and its counter.
STAGES = {
    ("loop", "pass"): "plain loop over the points",
    ("arrays", "build"): "build",
    ("arrays", "update"): "update, capsules",
    ("arrays", "query_volumes"): "visit(Pairs), volumes",
    ("arrays", "query_capsules"): "visit(Pairs), capsules",
    ("arrays", "find_pairs"): "find(Pairs), volumes, a vector that is kept",
    ("arrays", "find_new_pairs"): "find(Pairs), volumes, a new vector",
    ("arrays", "find_contacts"): "find(Contacts), BareContact",
    ("arrays", "frame"): "frame, capsules",
    ("manager", "set_up_volumes"): "manager, volumes: set-up",
    ("manager", "update_volumes"): "manager, volumes: update",
    ("manager", "collide_volumes"): "manager, volumes: collide",
    ("manager", "set_up_capsules"): "manager, capsules: set-up",
    ("manager", "update_capsules"): "manager, capsules: update",
    ("manager", "collide_capsules"): "manager, capsules: collide",
}

JOBS = "threads jobs"
# The documents link the gains on a machine with so many, and not on one with two.
IN_DOCUMENTS = "threads 16 cores"
JOBS_READ = (
    "Work is in tests of one volume against another. A job is what a thread takes at a time, and a "
    "barrier is where all threads wait for the last."
)


def tables(parts):
    scenes = chosen(parts, "threads")
    all_tables = [table(*named) for named in scenes.items()]
    counted = {scene: part for scene, part in scenes.items() if part.has("Threads", "jobs/1")}
    return all_tables + ([jobs(counted)] if counted else [])


def jobs(scenes):
    header = ["query of volumes", "tasks", "jobs", "work of a job: least", "median", "largest"]
    header += ["largest, share of all", "barriers"]
    rows = []
    for scene, part in scenes.items():
        count = {
            key: part.median("Threads", "jobs/1", key)
            for key in ("tasks", "jobs", "least_tests", "median_tests", "most_tests", "barriers")
        }
        share = part.median("Threads", "jobs/1", "tests") / count["most_tests"]
        *numbers, barriers = (f"{number:,.0f}" for number in count.values())
        rows.append([scene, *numbers, f"1/{share:.0f}", barriers])
    return Table(JOBS, "Threads, what they share", header, rows, JOBS_READ)


def table(scene, part):
    # Kinds that were left out, by --benchmark_filter, have no rows.
    stages = {stage: what for stage, what in STAGES.items() if part.has("Threads", f"{stage[0]}/1")}
    kind = next(iter(stages))[0]
    names = [name.split("/") for name in part.names("Threads")]
    counts = sorted(int(count) for of, count in names if of == kind)
    segments = part.median("Threads", f"{kind}/1", "segments")
    header = [f"{scene.split('-')[0]}, {segments:,.0f} segments"]
    header += [f"{count} threads" if count > 1 else "1 thread" for count in counts]
    header += [f"gain of {count}" for count in counts if count > 1]
    rows = []
    for (of, key), what in stages.items():
        runs = {count: part.runs("Threads", f"{of}/{count}", key) for count in counts}
        gains = [ratio_of(runs[1], runs[count]).text() for count in counts if count > 1]
        rows.append([what, *(time(found.median()) for found in runs.values()), *gains])
    cores = part.context["machine"].split(", ")[-1]
    return Table(f"threads {cores} {scene}", f"Threads, {scene}", header, rows, READ)
