# SPDX-License-Identifier: BSD-3-Clause
"""What is to be reached by the sets full and python: tables of what is met and what is missed."""

import arms
import arrays
import elsewhere
import frames
import live
import motion
import obstacles
import python_steps
import ratios
import shapes
from tables import Rows, Table, chosen, digits


def target(value, goal, least=False):
    """`4.50 met (at least 4)`."""
    met = value >= goal if least else value <= goal
    limit = f"at {'least' if least else 'most'} {goal}"
    return f"{digits(value)} {'met' if met else 'MISSED'} ({limit})"


class Targets(Rows):
    """Rows of things that have names."""

    def add(self, what, goals, value, least=False):
        """`goals`: one of all things, or by name; a dash stands where there is none."""

        def cell(column):
            name, thing = column
            goal = goals.get(name) if isinstance(goals, dict) else goals
            found = None if goal is None else value(thing)
            return "-" if found is None else target(found, goal, least)

        super().add(what, cell)


def of_frames(scenes, growth):
    columns = {name: scenes[name] for name in ratios.SCENES if name in scenes}
    rows = Targets(columns.items())
    for row, goals in (
        (ratios.TIGHT, (4, 4, 3.5, 4)),
        (ratios.STOCK, (8, 5, 9, 5)),
        (ratios.UPDATE, (2, 2, 2, 1.5)),
        (ratios.SET_UP, (4, 12, 4, 1.5)),
        (ratios.TOUCHING_TEST, (4, 4, 3.5, 4)),
        (ratios.TOUCHING_STOCK, (40, 10, 60, 15)),
        (ratios.TOUCHING_STOCK + ratios.ON_2_THREADS, (65, 16, 100, 20)),
        (ratios.EMBREE["frame"] + ": Embree, 1 thread", (2, 4, 2, 2)),
        (ratios.EMBREE["frame"] + ": Embree, 2 threads", (2, 4, 2, 2)),
    ):
        of_scene = dict(zip(ratios.SCENES, goals))
        rows.add(row, of_scene, lambda s: getattr(s.ratios()[row], "value", None), least=True)
    floor = dict(zip(ratios.SCENES, (1.6, 1.5, 1.5, 2.5)))
    rows.add("update, times the loop", floor, ratios.Scene.times_the_floor)
    rows.add("bytes a segment", 55, lambda s: s.bytes(ratios.BOXES))
    rows.add("bytes a segment, capsules", 90, lambda s: s.bytes(ratios.CAPSULES))
    rows.add("bytes, of FCL's best's", 0.5, ratios.Scene.of_fcls_bytes)
    for key in ("update", "detection") if growth else ():
        first, *_, last = frames.growth_of(growth, key)
        rows.append([f"growth, {key}", target(last / first, 1.5), *["-"] * (len(columns) - 1)])
    return Table("targets", "Targets", frames.header_of(columns), rows)


def of_managers(queries, clients):
    """Of the parts that there are."""
    rows = []
    found = elsewhere.query_rows(queries) if queries else []
    for row in found + (elsewhere.client_rows(clients) if clients else []):
        least = 1.2 if row.what.startswith("distance, ") else 1
        rows.append([elsewhere.grouped(row.what), target(row.ratio.value, least, least=True)])
    for name in sorted(clients.names("Changes")) if clients else []:
        most = 1.1 if "registered" in name else 1.3
        times = elsewhere.after(clients, name).median()
        rows.append([elsewhere.grouped(name), target(times, most)])
    header = ["", "times as fast as FCL's best, or times the reference"]
    return Table("targets of managers", "Targets of managers", header, rows)


def of_shapes(part):
    rows = []
    for name in sorted(part.names("Beside")):
        if part.median("Beside", name, "with") == 0 and name.endswith("half-space"):
            times = shapes.beside_of(part, name).median()
            rows.append([name.replace("/", ", "), target(times, 1.05)])
    for name in sorted(part.names("FibersOf")):
        size, segments = part.medians("FibersOf", name, "bytes", "segments")
        rows.append([f"fibers of {name}, bytes per object", target(size / segments, 160)])
        update = part.ratios("FibersOf", name, "update", "capsules_update").median()
        rows.append([f"fibers of {name}, update / capsules", target(update, 1.5)])
    header = ["", "bytes, or times the reference"]
    return Table("targets of shapes", "Targets of shapes", header, rows)


def of_arms(part):
    goals = {"arm of hulls": (1.1, 1), "arm of meshes": (1.1, 1), "cable beside": (1.2, 1.2)}
    rows = []
    for cell, key, what, (theirs, *ours) in arms.cells_of(part):
        if key == "update":
            continue
        least = next(goal for start, goal in goals.items() if cell.startswith(start))
        cells = [target(theirs.median() / o.median(), g, least=True) for o, g in zip(ours, least)]
        rows.append([what, *cells])
    header = ["times as fast as FCL's tree", "kVolumes", "kCapsules"]
    return Table("targets of arms", "Targets of arms", header, rows)


def of_arrays(parts):
    scenes = arrays.scenes_of(parts)
    rows = Targets(scenes.items())
    for key, most in (("build", (28, 28, 45)), ("update", (6, 8, 10)), ("unmoved", (3, 3.5, 4))):
        what, goals = f"{arrays.PHASES[key]}, times the loop", dict(zip(arrays.SCENES, most))
        rows.add(what, goals, lambda s: s.times_the_loop("boxes", key))
    rows.add("query for capsules, times volumes", 1.3, lambda s: s.of_capsules("boxes"))
    large = [name for name, scene in scenes.items() if scene.segments > 1e6]
    for key, least in (("build", 1.6), ("update", 1.6), ("query", 1.8)):
        goals = dict.fromkeys(large, least)
        rows.add(f"{key} on 2 threads", goals, lambda s: s.on_2_threads("boxes", key), least=True)
    for name, most in (("boxes", 43), ("boxes_capsules", 75)):
        rows.add(f"bytes a segment, {name}", most, lambda s: s.bytes(name))
    return Table("targets of arrays", "Targets of arrays", arrays.header_of(scenes), rows)


def of_obstacles(parts):
    least = {"by arrays": 100, "candidates alone": 1, "least distance, by the manager": 10}
    most = {"contacts": 2, "head turned": 1.3, "refit": 3}
    rows = [
        [row.what, target(row.ratio.value, goal, least=row.faster)]
        for row in obstacles.rows_of(parts)
        for end, goal in (least if row.faster else most).items()
        if row.what.endswith(end)
    ]
    header = ["", "times as fast as the other, or times as long"]
    return Table("targets of obstacles", "Targets of obstacles", header, rows)


def of_motion(parts):
    rows = Targets(motion.motions_of(parts).items())
    static_query = {50: 4, 150: 8}
    rows.add(
        "impacts, times the static query", static_query, lambda m: m.times("query", "static_query")
    )
    rows.add("update, times the static one", 2, lambda m: m.times("update", "static_update"))
    what = "times as fast as the fastest of the swept boxes"
    rows.add(what, {150: 3}, motion.Motion.against_the_fastest, least=True)
    rows.add("impacts missed", 0, lambda m: m.judged("missed"))
    rows.add("safe step, times all impacts", 1, lambda m: m.safe("seconds") / m.safe("query"))
    return Table("targets of motion", "Targets of motion", motion.table(parts).header, rows)


def of_live(parts):
    least = {"slow": 10, "fast": 6, "creeping": 3}
    rows = []
    for run in live.runs_of(parts):
        # Of fibers that are few, or move far, nothing is gained and little may be lost.
        thick = run.scene == "helix-thick"
        gains = run.motion in least and run.get("segments") > 1000 and not thick
        goal = least[run.motion] if gains else 0.95
        if run.kind == "LiveObjects":
            rows.append([run.title, target(run.whole(), 3, least=True), *["-"] * 4])
            continue
        row = [run.title, target(run.whole(), goal, least=True), target(run.longest(), 1.3)]
        row.append(target(run.times_the_loop(), 3) if gains and run.motion == "slow" else "-")
        row.append(target(run.get("listings"), 10, least=True) if gains else "-")
        rows.append([*row, target(run.of_segment("bytes"), 60) if thick else "-"])
    header = ["", "times as fast, all steps", "longest step, times one without"]
    header += ["times the loop", "listings", "bytes a segment"]
    if "safe-distances" in parts:
        for name in parts["safe-distances"].names("SafeDistances"):
            seconds = parts["safe-distances"].median("SafeDistances", name, "safe")
            rows.append([f"safe distances, {name}, seconds", target(seconds, 0.06), *["-"] * 4])
    return Table("targets of live pairs", "Targets of pairs that live", header, rows)


def of_python(parts):
    """With 100,000 segments."""
    rows = []
    for name, part in chosen(parts, "steps_{}", python_steps.LARGE).items():
        for query, call in python_steps.QUERIES.items():
            seconds = part.median("Steps", python_steps.step_name(query, 1), "seconds")
            what = f"{python_steps.SCENES[name]}, {call}"
            rows.append([f"{what}, seconds", target(seconds, 0.1)])
            for rival, least in (("all elements", 100), ("midpoint tree", 10)):
                times = python_steps.times_as_fast(part, query, 1, rival)
                rows.append([f"{what} over {rival}", target(times, least, least=True)])
    for name, part in chosen(parts, "overhead_{}", python_steps.LARGE).items():
        for query, call in python_steps.QUERIES.items():
            share = target(python_steps.more(part, query, 1, "cpp")[1], 0.05)
            rows.append([f"{python_steps.SCENES[name]}, {call}, more than C++", share])
    if "import" in parts:
        seconds = python_steps.import_more(parts["import"])[1]
        rows.append(["import, seconds", target(seconds, 0.1)])
    return Table("targets of python", "Targets of the Python package", ["", "found"], rows)
