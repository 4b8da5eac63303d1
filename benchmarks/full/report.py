# SPDX-License-Identifier: BSD-3-Clause
"""The tables of benchmarks/run.sh --full, from what fcl_fibers_full wrote: report.py FOLDER

Prints Markdown. Exits with status 1 if one of ours is wrong; a target that is missed is no error.
"""

import json
import math
import statistics
import sys
from pathlib import Path

SCENES = {
    "static": "static",
    "strand": "strand",
    "half_scalp": "half scalp",
    "dynamic": "dynamic",
}
OURS = "LayeredAABBTree/"
DEFAULT_TREE = "DynamicAABBTree/tight_level_0"
ROUNDING = 0.01  # Bounds are rounded outward: so many more pairs are the same work.

# How many times as fast, by scene.
TARGETS = {
    "self-collision against FCL's best, tight boxes": (2.5, 4.5, 2.5, 2),
    "self-collision against FCL's best, stock boxes": (8, 5, 9, 5),
    "update after motion against FCL's best": (2, 2, 2, 2),
    "set-up against FCL's dynamic tree": (4, 15, 8, 3),
    "set-up against the same with its default tree_init_level": (4, 15, 8, 3),
    "touching pairs out against FCL's best, stock boxes, + fcl::collide": (40, 10, 60, 15),
    "the same on 2 threads": (65, 16, 100, 20),
    "update + detection against Embree, 1 thread": (2, 4, 2, 2),
    "update + detection against Embree, 2 threads": (2, 4, 2, 2),
}
MOST_TIMES_THE_FLOOR = 1.5
MOST_GROWTH = 1.5
MOST_BYTES = 80
MOST_OF_FCLS_BYTES = 0.5


class Part:
    """One file: medians of counters and of the time, in seconds, by the benchmark's name."""

    def __init__(self, path):
        self.name = path.stem
        document = json.loads(path.read_text())
        self.context = document["context"]
        runs = {}
        self.labels = {}
        self.errors = []
        for run in document["benchmarks"]:
            if run["run_type"] != "iteration":
                continue
            name = run["run_name"].split("/iterations:")[0]
            if run.get("error_occurred"):
                self.errors.append(f"{name}: {run['error_message']}")
                continue
            self.labels[name] = run.get("label", "")
            runs.setdefault(name, []).append(run)
        self.values = {name: _medians(group) for name, group in runs.items()}
        self.counts = {name: len(group) for name, group in runs.items()}

    def named(self, prefix):
        """Values by the rest of the name."""
        return {n[len(prefix) :]: v for n, v in self.values.items() if n.startswith(prefix)}

    def wrong(self):
        """What is wrong of ours."""
        wrong = [error for error in self.errors if OURS in error]
        for name, label in self.labels.items():
            if name.startswith("Checked/" + OURS) and label:
                wrong.append(f"{name}: {label}")
        return wrong


def _medians(runs):
    result = {"seconds": statistics.median(run["real_time"] for run in runs)}
    result["seconds"] *= {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1}[runs[0]["time_unit"]]
    for key, value in runs[0].items():
        if isinstance(value, float) and key not in ("real_time", "cpu_time"):
            result[key] = statistics.median(run[key] for run in runs)
    if "update" in result:
        both = [run["update"] + run["detection"] for run in runs]
        result["frame"] = statistics.median(both)
    return result


def digits(value):
    """Three significant digits without an exponent."""
    if value is None or math.isnan(value):
        return "-"
    decimals = 2 if value == 0 else max(0, min(7, 2 - math.floor(math.log10(abs(value)))))
    return f"{value:,.{decimals}f}"


def time(seconds):
    if seconds is None or math.isnan(seconds):
        return "-"
    if seconds < 1e-3:
        return digits(1e6 * seconds) + " us"
    return digits(1e3 * seconds) + " ms" if seconds < 1 else digits(seconds) + " s"


def table(rows):
    widths = [max(len(row[c]) for row in rows) for c in range(len(rows[0]))]
    for r, row in enumerate(rows):
        # The first column holds names, the others numbers.
        numbers = [cell.rjust(width) for cell, width in zip(row[1:], widths[1:])]
        print("| " + " | ".join([row[0].ljust(widths[0]), *numbers]) + " |")
        if r == 0:
            rules = ["-" * (width + 1) + ":" for width in widths[1:]]
            print("|" + "|".join(["-" * (widths[0] + 2), *rules]) + "|")
    print()


def title(name):
    """`Embree/refit_2_threads` as in a table."""
    return name.replace("/", ", ").replace("_", " ")


def least(entries, key):
    """Name and values of the entry with the least such value, or None."""
    entries = {name: values for name, values in entries.items() if key in values}
    if not entries:
        return None
    name = min(entries, key=lambda entry: entries[entry][key])
    return name, entries[name]


class Scene:
    """One scene: who is best, and how many times as fast ours are."""

    def __init__(self, part):
        self.part = part
        self.frames = part.named("Frames/")
        self.checked = part.named("Checked/")
        self.segments = next(iter(self.checked.values()))["segments"] if self.checked else math.nan
        fcl = {n: v for n, v in self.frames.items() if n.startswith("DynamicAABBTree")}
        narrow = {n: v for n, v in fcl.items() if n.endswith("_and_collide")}
        plain = {n: v for n, v in fcl.items() if n not in narrow}
        self.tight = least({n: v for n, v in plain.items() if "/tight" in n}, "frame")
        self.stock = least({n: v for n, v in plain.items() if "/stock" in n}, "frame")
        self.best = least(plain, "frame")
        trees = {n: v for n, v in plain.items() if n.startswith("DynamicAABBTree/")}
        self.tree = least(trees, "set_up")
        self.default_tree = (DEFAULT_TREE, trees[DEFAULT_TREE]) if DEFAULT_TREE in trees else None
        self.narrow = least(narrow, "frame")
        self.floor = part.named("Floor/").get("read")

    def ours(self, variant):
        return self.frames.get(OURS + variant)

    def pairs(self, contender):
        """Of the first frame, as they were counted before anything was timed, or summed over the
        steps: the frames that were timed differ from one contender to another."""
        checked = self.checked.get(contender, {})
        if self.part.name == "dynamic" or "pairs" not in checked:
            return self.frames[contender]["pairs"]
        return checked["pairs"]

    def embree(self, threads, key="frame"):
        return least(
            {
                name: values
                for name, values in self.frames.items()
                if name.startswith("Embree/") and name.endswith("_2_threads") == (threads == 2)
            },
            key,
        )

    def is_equal_work(self):
        """Whether our boxes report as many pairs as FCL's tight ones."""
        if self.tight is None or self.ours("boxes") is None:
            return False
        ours, theirs = self.pairs(OURS + "boxes"), self.pairs(self.tight[0])
        return theirs <= ours <= (1 + ROUNDING) * theirs

    def ratios(self):
        """By the names of TARGETS: ratio, whom it is against; None where there is none."""

        def ratio(theirs, variant, key):
            ours = self.ours(variant)
            if theirs is None or ours is None:
                return None
            return theirs[1][key] / ours[key], theirs[0]

        return dict(
            zip(
                TARGETS,
                (
                    ratio(self.tight, "boxes", "detection") if self.is_equal_work() else None,
                    ratio(self.stock, "boxes", "detection"),
                    ratio(self.best, "boxes", "update"),
                    ratio(self.tree, "boxes", "set_up"),
                    ratio(self.default_tree, "boxes", "set_up"),
                    ratio(self.narrow, "capsules", "frame"),
                    ratio(self.narrow, "capsules_2_threads", "frame"),
                    ratio(self.embree(1), "boxes", "frame"),
                    ratio(self.embree(2), "boxes_2_threads", "frame"),
                ),
            )
        )

    def bytes(self, name):
        checked = self.checked.get(name)
        return checked["bytes_after_frames"] / self.segments if checked else math.nan

    def times_the_floor(self):
        if self.floor is None or self.ours("boxes") is None:
            return math.nan
        return self.ours("boxes")["update"] / self.floor["seconds"]

    def of_fcls_bytes(self):
        return self.bytes(OURS + "boxes") / self.bytes(self.tree[0]) if self.tree else math.nan


def at_least(found, target):
    if found is None:
        return "-"
    return f"{digits(found[0])}x {'met' if found[0] >= target else 'MISSED'} ({target}x)"


def at_most(value, most, unit=""):
    if math.isnan(value):
        return "-"
    return f"{digits(value)}{unit} {'met' if value < most else 'MISSED'} (< {most}{unit})"


def print_targets(scenes):
    print("## Targets\n")
    rows = [["times as fast, one thread unless said"] + [SCENES[name] for name in scenes]]
    ratios = {name: scene.ratios() for name, scene in scenes.items()}
    columns = {name: list(SCENES).index(name) for name in scenes}
    for target, values in TARGETS.items():
        rows.append([target] + [at_least(ratios[n][target], values[columns[n]]) for n in scenes])
    rows.append(
        ["update, times a loop that only reads the objects"]
        + [at_most(s.times_the_floor(), MOST_TIMES_THE_FLOOR, "x") for s in scenes.values()]
    )
    rows.append(
        ["bytes a segment after a frame"]
        + [at_most(s.bytes(OURS + "boxes"), MOST_BYTES) for s in scenes.values()]
    )
    rows.append(
        ["bytes, of FCL's dynamic tree's"]
        + [at_most(s.of_fcls_bytes(), MOST_OF_FCLS_BYTES) for s in scenes.values()]
    )
    table(rows)
    for name, scene in scenes.items():
        if not scene.is_equal_work():
            print(f"{SCENES[name]}: pair counts differ, so that tight boxes are not compared.\n")


def print_against(scenes):
    """Whom the ratios are against, and what Embree's detection alone takes."""
    print("## Who is best\n")
    rows = [["", *(SCENES[name] for name in scenes)]]

    def row(what, pick):
        rows.append([what] + [pick(s) for s in scenes.values()])

    def who(found):
        return "-" if found is None else title(found[0])

    row("FCL, tight boxes", lambda s: who(s.tight))
    row("FCL, stock boxes", lambda s: who(s.stock))
    row("FCL, set-up", lambda s: who(s.tree))
    row("Embree, 1 thread", lambda s: who(s.embree(1)))
    row("Embree, 2 threads", lambda s: who(s.embree(2)))

    def detection_alone(scene, threads, variant):
        best = scene.embree(threads, "detection")
        ours = scene.ours(variant)
        if best is None or ours is None:
            return "-"
        return digits(best[1]["detection"] / ours["detection"]) + "x"

    row("detection alone against Embree's fastest", lambda s: detection_alone(s, 1, "boxes"))
    row("the same on 2 threads", lambda s: detection_alone(s, 2, "boxes_2_threads"))
    table(rows)


def print_scene(name, scene):
    context = scene.part.context
    print(f"## {SCENES.get(name, name)}, {scene.segments:,.0f} segments\n")
    print(f"`{context['command']}`\n")
    rows = [
        [
            "",
            "set-up",
            "update",
            "detection",
            "update + detection",
            "pairs",
            "touching",
            "bytes/segment",
            "runs",
        ]
    ]
    for contender in sorted(scene.frames, key=lambda n: (not n.startswith(OURS), n)):
        values = scene.frames[contender]
        checked = scene.checked.get(contender, {})
        touching = values.get("touching", checked.get("touching", math.nan))
        times = [time(values[key]) for key in ("set_up", "update", "detection", "frame")]
        pairs = [f"{scene.pairs(contender):,.0f}", f"{touching:,.0f}"]
        runs = str(scene.part.counts["Frames/" + contender])
        rows.append([title(contender), *times, *pairs, digits(scene.bytes(contender)), runs])
    if scene.floor:
        runs = str(scene.part.counts["Floor/read"])
        floor = time(scene.floor["seconds"])
        rows.append(["reading the objects", "-", floor, *["-"] * 5, runs])
    table(rows)
    if scene.narrow:
        stride = scene.narrow[1]["stride"]
        sampled = (
            f", on a thousand out of every {stride:,.0f} thousand pairs, and scaled; so is its "
            "number of touching pairs"
        )
        print("fcl::collide was timed once" + (sampled if stride > 1 else "") + ".")
    if name == "dynamic":
        print("Times and pairs are sums over the steps; touching pairs are those of the last.")
    for what, label in scene.part.labels.items():
        if label:
            print(f"{what}: {label}.")
    print()
    print_tried(scene)


def print_tried(scene):
    tried = scene.part.named("Tried/")
    segments = max((values["segments"] for values in tried.values()), default=0)
    part = f" on {segments:,.0f} segments of the same density" if segments < scene.segments else ""
    ranked = sorted((v["frame"], v["set_up"], title(name)) for name, v in tried.items())
    print(f"<details><summary>FCL's trees, the faster of two tries{part}</summary>\n")
    rows = [["", "set-up", "update + detection"]]
    table(rows + [[name, time(set_up), time(frame)] for frame, set_up, name in ranked])
    print("</details>\n")


def same_answer(ours, theirs):
    """Distances are the same to rounding, pairs to that of bounds. Where objects touch, a distance
    query ends at the first pair that does, which may be any."""
    if ours <= 0 and theirs <= 0:
        return True
    return theirs * (1 - 1e-6) <= ours <= theirs * (1 + ROUNDING)


def print_queries(part):
    """Returns what is wrong."""
    groups = {}
    for name, values in part.named("Query/").items():
        query, contender = name.split("/", 1)
        groups.setdefault((query, "seconds"), {})[contender] = values
    phases = {"set-up": "set_up", "update": "update", "self-collision": "detection"}
    for name, values in part.named("Objects/").items():
        shape, contender = name.split("/", 1)
        for phase, key in phases.items():
            groups.setdefault((f"10^4 {shape}, {phase}", key), {})[contender] = values
    rows = [["nowhere slower than FCL's best", "ours", "FCL's best", "", "times as fast"]]
    wrong = []
    for what, key in sorted(groups, key=lambda group: (group[0].startswith("10^4"), group[0])):
        entries = groups[what, key]
        ours = entries.get(OURS + "boxes")
        best = least({n: v for n, v in entries.items() if not n.startswith(OURS)}, key)
        if ours is None or best is None:
            continue
        if not same_answer(ours["answer"], best[1]["answer"]):
            wrong.append(f"{what}: {ours['answer']} instead of {best[1]['answer']}")
        ratio = at_least((best[1][key] / ours[key],), 1)
        rows.append([what, time(ours[key]), time(best[1][key]), title(best[0]), ratio])
    print("## Elsewhere\n")
    table(rows)
    return wrong


def print_growth(part):
    """Cost per segment, of the larger strand over the smaller one."""
    small, large = sorted(part.named("Growth/").values(), key=lambda v: v["segments"])
    sizes = [f"{size['segments']:,.0f} segments" for size in (small, large)]
    rows = [["per segment, the tree over plain arrays", *sizes, "growth"]]
    for key in ("update", "detection"):
        growth = at_most(large[key] / small[key], MOST_GROWTH, "x")
        rows.append([key, *(digits(1e9 * size[key]) + " ns" for size in (small, large)), growth])
    for key, what in (("answer", "pairs"), ("bytes", "bytes")):
        rows.append([what, *(digits(size[key]) for size in (small, large)), "-"])
    print("## Growth\n")
    table(rows)


def print_circumstances(parts):
    context = next(iter(parts)).context
    print(
        f"{context['machine']}; {context['compiler']}, {context['build_type']}; "
        f"commit {context['commit']}\n"
    )
    print(
        "Medians of runs in random order. FCL's best is its dynamic tree or that tree's array "
        "form, whichever takes least for update + detection, with the best tree_init_level; its "
        "other managers, 10 to 100 times slower here, are left out. Other libraries' trees are "
        "set up anew after two updates, which costs them nothing; ours are kept. Embree reads "
        "the boxes from the poses in its update, as ours do, and is the fastest of a rebuild, a "
        "rebuild by Morton codes and a refit.\n"
    )
    if context.get("left_out"):
        print(f"Not installed and left out: {context['left_out']}.\n")


def main(folder):
    # A part that was interrupted has left nothing, or what cannot be read.
    paths = [path for path in sorted(folder.glob("*.json")) if path.stat().st_size > 0]
    parts = {path.stem: Part(path) for path in paths}
    scenes = {name: Scene(parts[name]) for name in SCENES if name in parts}
    if not parts:
        sys.exit(f"report.py: there are no results in {folder}")
    print_circumstances(parts.values())
    wrong = [error for part in parts.values() for error in part.wrong()]
    if scenes:
        print_targets(scenes)
        print_against(scenes)
    if "queries" in parts:
        wrong += print_queries(parts["queries"])
    if "hair" in parts:
        scenes["file of --hair"] = Scene(parts["hair"])
    if "growth" in parts:
        print_growth(parts["growth"])
    for name, scene in scenes.items():
        print_scene(name, scene)
    for error in wrong:
        print(f"WRONG: {error}\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(Path(sys.argv[1])))
