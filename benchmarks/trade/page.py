#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes one page of what benchmarks/run.sh --trade has measured.

Parts that are missing are named on the page. The numbers stand in FOLDER as CSV.
"""

import argparse
import html
import re
import string
import sys
from pathlib import Path

sys.dont_write_bytecode = True  # no __pycache__ among the sources
PAPER = Path(__file__).resolve().parent.parent / "paper"
sys.path.insert(0, str(PAPER))

from pictures import dials_figure, managers_figure
from recommendation import recommendation
from report import count_text, figure, seconds_text, table, write_csv
from results import load_parts
from settings import (
    CAGES,
    DIALS,
    SAMPLINGS,
    SCENES,
    SHORT,
    bound_order,
    by_directions,
    by_fatness,
    chord_error,
    entries_of,
    missed,
    pareto,
    points_of,
    scenes_with,
    title_of,
)

COSTS_BLOCK = re.compile(r"(<!-- table: [^\n]*-->\n).*?(<!-- end of table -->)", re.DOTALL)
COSTS_HEADER = ("bytes a segment", "update, ns a segment", "detection, ns a segment", "pairs")


def ratio_text(value):
    return f"{value:.2f} ×"


def grouped(rows):
    """Rows of cells for table(): what the first cell says stands once, a line below the last."""
    out = []
    for row, after in zip(rows, rows[1:] + [[None]]):
        first = not out or rows[len(out) - 1][0] != row[0]
        out.append(("group" if after[0] != row[0] else "", [row[0] if first else ""] + row[1:]))
    return out


class Page:
    def __init__(self, folder):
        self.folder = folder
        self.parts = load_parts(folder)
        self.blocks = []
        self.missing = []
        self.files = []

    def attempt(self, title, make):
        """None where data are missing."""
        try:
            return make()
        except (KeyError, IndexError, ValueError, ZeroDivisionError) as lack:
            print(f"report: {title}: {type(lack).__name__} {lack}", file=sys.stderr)
            return None

    def section(self, title, make, prefix=None):
        """`prefix`: of its parts, where there is one for each scene."""
        block = self.attempt(title, make)
        if not block:
            self.missing.append(title)
            return
        self.blocks.append(f"<h2>{title}</h2>\n{block}")
        if prefix:
            here = scenes_with(self.parts, prefix)
            # Without a file there is no hair in any part.
            due = [s for s in SCENES if s != "hair" or "managers_hair" in self.parts]
            lack = [SHORT[scene] for scene in due if scene not in here]
            self.missing += [f"{title} ({'; '.join(lack)})"] if lack else []

    def csv(self, name, header, rows):
        write_csv(self.folder / f"{name}.csv", header, rows)
        self.files.append(f"{name}.csv")

    def by_scene(self, prefix):
        for scene in scenes_with(self.parts, prefix):
            yield SHORT[scene], entries_of(self.parts[f"{prefix}_{scene}"])

    # Figures

    def managers(self):
        scenes = scenes_with(self.parts, "managers")
        if not scenes:
            return None
        rows = []
        for scene in scenes:
            points = points_of(self.parts[f"managers_{scene}"])
            front = pareto(points)
            for point in points:
                name, seconds, false = point
                rows.append([SHORT[scene], title_of(name), seconds, false, int(point in front)])
        header = ["scene", "setting", "seconds a frame", "false per contact", "on the front"]
        self.csv("managers", header, rows)
        return figure(
            managers_figure(self.parts),
            (
                "Each manager at each setting: what a frame costs, and how many pairs it reports in"
                " vain for each contact, that is each touching pair of segments that are not"
                " adjacent; the adjacent ones are reported by all. FCL's managers with the boxes"
                " they make themselves (stock, grey) and with tight ones (black). What takes more than 2"
                " seconds in any phase (10 on the short strand) is left out. One thread."
            ),
        )

    def dials(self):
        tried = [self.attempt(make.__name__, lambda: make(self.parts)) for make in DIALS]
        dials = [dial for dial in tried if dial and dial.curves]
        if not dials:
            return None
        rows = [
            [dial.title, SHORT[curve.scene], curve.kind, *point, dial.trades, int(point in front)]
            for dial in dials
            for curve in dial.curves
            for front in [dial.front(curve.scene)]
            for point in curve.points
        ]
        header = ["dial", "scene", "kind", "setting", "seconds", "value", "of"]
        self.csv("dials", header + ["on the front"], rows)
        return figure(
            dials_figure(dials),
            (
                "Each dial turned through its settings, a curve for each scene; both axes are the"
                " better the nearer to zero. Full: the Pareto front of the scene, settings that no"
                " other of that dial beats in both. Leaves, search bounds and sampling report what"
                " touches; k-DOPs, spheres and lazy updates volumes. The time of lazy updates is"
                " the least that they may take, not measured as a whole. One thread. Along a curve"
                " the settings keep their order; a label that would cover others is left out."
            ),
        )

    # Dials

    def leaves(self):
        rows, csv_rows = [], []
        for scene, entries in self.by_scene("leaves"):
            for length in sorted(entries, key=int):
                e = entries[length]
                c = e.counters
                rows.append(
                    [
                        scene,
                        length,
                        seconds_text(c["build"]),
                        seconds_text(c["update"]),
                        seconds_text(c["detection"]),
                        ratio_text(entries["1"].total / e.total),
                        count_text(c["touching"]),
                        count_text(c["run_pairs"]),
                        count_text(c["tests"]),
                    ]
                )
                csv_rows.append(
                    [scene, length, c["build"], c["update"], c["detection"], c["touching"]]
                    + [c["run_pairs"], c["tests"], c["bytes"]]
                )
        if not rows:
            return None
        self.csv(
            "leaves",
            ["scene", "segments a leaf", "build s", "update s", "detection s", "touching"]
            + ["run pairs", "tests", "bytes"],
            csv_rows,
        )
        header = ["scene", "segments<br>a leaf", "build", "update", "detection"]
        header += ["frame,<br>1 : this", "touching<br>pairs", "pairs<br>of runs", "pairs<br>tried"]
        return (
            "<p>The tree over runs of segments, each run in the capsule about its chord; pairs of"
            " runs that touch are tried segment by segment. The answer is the same: the capsules"
            " that touch. Plain arrays, one thread. Left out: runs in capsules more than fifty"
            " times as thick as the fiber.</p>"
            + table(header, grouped(rows))
        )

    def kdops(self):
        rows, csv_rows = [], []
        for scene in scenes_with(self.parts, "kdops"):
            found = by_directions(self.parts[f"kdops_{scene}"])
            box = dict(found)["6"].counters
            for directions, e in found:
                c = e.counters
                touching_frame = c["update"] + c["touching_detection"]
                false = (c["pairs"] - c["touching"]) / c["touching"]
                rows.append(
                    [
                        SHORT[scene],
                        directions,
                        seconds_text(c["update"]),
                        seconds_text(c["detection"]),
                        seconds_text(c["touching_detection"]),
                        count_text(c["pairs"]),
                        f"{false:,.2f}",
                        f"{c['bytes'] / c['segments']:.1f}",
                        ratio_text(
                            (box["update"] + box["detection"]) / (c["update"] + c["detection"])
                        ),
                        ratio_text((box["update"] + box["touching_detection"]) / touching_frame),
                    ]
                )
                csv_rows.append(
                    [SHORT[scene], directions, c["update"], c["detection"]]
                    + [c["touching_detection"], c["pairs"], c["touching"], c["tests"]]
                    + [c["bytes"], c["segments"]]
                )
        if not rows:
            return None
        self.csv(
            "kdops",
            ["scene", "directions", "update s", "detection s", "detection with capsules out s"]
            + ["pairs", "touching", "tests", "bytes", "segments"],
            csv_rows,
        )
        header = ["scene", "directions", "update", "detection", "capsules<br>out", "pairs"]
        header += ["false per<br>touching", "bytes a<br>segment", "frame,<br>6 : this"]
        return (
            "<p>The tree with k-DOPs, polytopes between parallel planes, instead of boxes, which"
            " are those of 6 directions and go through the same code here. <em>Capsules out</em> is"
            " detection with the capsule test behind it, which leaves the pairs that touch. A frame"
            " is update and detection, in the last column with capsules out. Bounds are float but"
            " for <em>double</em>. Plain arrays, one thread.</p>"
            + table(header + ["touching,<br>6 : this"], grouped(rows))
        )

    def bounds(self):
        rows, csv_rows = [], []
        for scene, entries in self.by_scene("bounds"):
            whole = entries["none"].counters["pairs"]
            for name in sorted(entries, key=bound_order):
                e = entries[name]
                c = e.counters
                kind, _, value = name.partition(":")
                unit = f"{kind} ≤ {int(value):,}" if kind == "tests" else f"from {value} {kind}"
                rows.append(
                    [
                        scene,
                        unit if value else name,
                        seconds_text(e.total),
                        f"{100 * c['pairs'] / whole:.1f} %",
                        count_text(c["pieces"]),
                        count_text(c["unresolved"]),
                    ]
                )
                csv_rows.append([scene, name, e.total, c["pairs"], c["pieces"], c["unresolved"]])
        if not rows:
            return None
        self.csv(
            "bounds", ["scene", "bound", "query s", "pairs", "pieces", "unresolved pairs"], csv_rows
        )
        header = ["scene", "bound", "query", "touching pairs resolved", "pieces", "pairs in them"]
        return (
            "<p>FiberTree::visitPairs with a SearchBound: at most so many tests of volumes, or no"
            " volume opened that is smaller than so many fiber radii; <em>none</em> is the query"
            " without one, <em>all</em> with one that binds nothing. What is not resolved comes as"
            " pairs of pieces that hold every pair there may be.</p>" + table(header, grouped(rows))
        )

    def spheres(self):
        rows, csv_rows = [], []
        for scene, entries in self.by_scene("spheres"):
            exact = entries["exact"].counters
            for name in CAGES:
                c = entries[name].counters
                radius = c["mean_radius"] / exact["mean_radius"]
                rows.append(
                    [
                        scene,
                        CAGES[name],
                        seconds_text(c["update"]),
                        seconds_text(c["detection"]),
                        f"{radius:.3f} ×",
                        count_text(c["tests"]),
                        f"{c['tests'] / exact['tests']:.3f} ×",
                    ]
                )
                csv_rows.append([scene, name, c["update"], c["detection"], radius, c["tests"]])
        if not rows:
            return None
        self.csv(
            "spheres",
            ["scene", "cages", "update s", "detection s", "mean radius : exact", "tests"],
            csv_rows,
        )
        header = ["scene", "cages", "update", "detection", "mean radius : exact"]
        return (
            "<p>Cages of the wrapped sphere tree: <em>verified</em> keeps the exact one as long as"
            " its basis holds, which is what the manager does; the others are made anew at every"
            " step. Detection by the least instruction set, to compare tests.</p>"
            + table(header + ["tests of volumes", "tests : exact"], grouped(rows))
        )

    def lazy(self):
        if "lazy" not in self.parts:
            return None
        rows, csv_rows = [], []
        for report in ("volumes", "capsules"):
            found = by_fatness(self.parts["lazy"], report)
            tight = found[0][1]
            for fatness, e in found:
                c = e.counters
                rows.append(
                    [
                        report,
                        f"{fatness:g} radii",
                        f"{100 * c['share']:.0f} %",
                        seconds_text(c["moved"]),
                        seconds_text(c["still"]),
                        seconds_text(c["detection"]),
                        count_text(c["pairs"]),
                        ratio_text(c["pairs"] / tight.counters["pairs"]),
                        ratio_text(tight.total / e.total),
                    ]
                )
                csv_rows.append(
                    [report, fatness, c["share"], c["moved"], c["still"], c["detection"]]
                    + [c["pairs"], e.total]
                )
        self.csv(
            "lazy",
            ["report", "fatness radii", "share", "update s", "still s", "detection s", "pairs"]
            + ["sum s"],
            csv_rows,
        )
        header = ["report", "fatness", "leave", "update", "update,<br>nothing moved", "detection"]
        header += ["pairs", "pairs,<br>this : tight", "sum,<br>tight : this"]
        return (
            "<p>The dynamic assembly, all its steps: boxes fattened, refitted only where a segment"
            " has left its own. The last column takes a refit in part for its share of a whole"
            " one, which it exceeds: the most that the dial may gain.</p>"
            + table(header, grouped(rows))
        )

    def sampling(self):
        if "sampling" not in self.parts:
            return None
        entries = self.parts["sampling"].entries
        rows, csv_rows = [], []
        for kind in ("plain", "margin"):
            for segments in SAMPLINGS:
                e = entries[f"{segments}/{kind}"]
                extra = e.counters["extra"] / max(e.counters["reported"], 1)
                rows.append(
                    [
                        kind,
                        f"{segments:,}",
                        f"{chord_error(e):.3g} radii",
                        f"{100 * missed(e):.2f} %",
                        f"{100 * extra:.1f} %",
                        seconds_text(e.total),
                    ]
                )
                chord = e.counters["chord_error"]
                csv_rows.append([kind, segments, chord, missed(e), extra, e.total])
        self.csv(
            "sampling",
            ["margin", "segments", "chord error cm", "missed", "extra", "seconds"],
            csv_rows,
        )
        header = ["margin", "segments a fiber", "chord error", "missed", "not in the finest"]
        return (
            "<p>The strand of 1,000 fibers of 30 cm, against itself at 2,000 segments: contacts of"
            " two fibers missed, and contacts that the finest has none beside. <em>Margin</em>:"
            " with twice the chord error as margin, which misses none.</p>"
            + table(header + ["update + detection"], grouped(rows))
        )

    def cost_rows(self):
        for name, e in sorted(self.parts["costs"].entries.items()):
            c = e.counters
            nanoseconds = [1e9 * c[phase] / c["segments"] for phase in ("update", "detection")]
            yield [*name.split("/", 1), c["bytes"] / c["segments"], *nanoseconds, c["pairs"]]

    def cost_cells(self):
        for of, what, size, *others in self.cost_rows():
            yield [of, what, f"{size:.1f}", *(count_text(other) for other in others)]

    def costs(self):
        if "costs" not in self.parts:
            return None
        header = ["of", "what is asked for", *COSTS_HEADER]
        self.csv("costs", header, self.cost_rows())
        return (
            "<p>A strand of 1,000 × 100: what a tree over plain arrays and a manager of FCL"
            " objects hold and take, a segment, by what they are told to do.</p>"
            + table([h.replace(" a ", "<br>a ") for h in header], grouped(list(self.cost_cells())))
        )

    def write_costs(self, path):
        """Renews the table of docs/costs.md."""
        if "costs" not in self.parts:
            raise ValueError(f"no costs.json in {self.folder}: run benchmarks/run.sh --trade")
        text = path.read_text(encoding="utf-8")
        if not COSTS_BLOCK.search(text):
            raise ValueError(f"{path}: no lines <!-- table: ... --> and <!-- end of table -->")
        context = self.parts["costs"].context
        keys = ("machine", "compiler", "build_type")
        where = [context.get(key, "unknown") for key in keys]
        lines = [
            "; ".join([*where, f"commit {context.get('commit', 'unknown')}", "medians."]),
            "",
            "| of | what is asked for | " + " | ".join(COSTS_HEADER) + " |",
            "|---|---|" + "--:|" * len(COSTS_HEADER),
            *("| " + " | ".join(row) + " |" for row in self.cost_cells()),
        ]
        block = "\n" + "\n".join(lines) + "\n\n"
        text = COSTS_BLOCK.sub(lambda found: found[1] + block + found[2], text)
        path.write_text(text, encoding="utf-8")

    def facts(self):
        contexts = [part.context for part in self.parts.values()]
        rows = []
        for key in ("machine", "num_cpus", "compiler", "build_type", "commit"):
            values = dict.fromkeys(str(c.get(key, "unknown")) for c in contexts)
            rows.append((key.replace("_", " "), html.escape(", ".join(values))))
        dates = sorted(c["date"] for c in contexts if "date" in c)
        if dates:
            rows.append(("begun", f"{dates[0]}; last part {dates[-1]}"))
        rows.append(("as CSV", f"in {html.escape(self.folder.name)}: {', '.join(self.files)}"))
        lines = "".join(f"<tr><td>{k}</td><td>{v}</td></tr>" for k, v in rows)
        return f'<table class="facts">{lines}</table>'

    def make(self):
        self.section("What a pair costs", self.managers, "managers")
        self.section("The dials", self.dials)
        self.section("Leaves of several segments", self.leaves, "leaves")
        self.section("k-DOPs", self.kdops, "kdops")
        self.section("An answer in time", self.bounds, "bounds")
        self.section("Approximate spheres", self.spheres, "spheres")
        self.section("Lazy updates", self.lazy)
        self.section("How finely a curve is cut", self.sampling)
        self.section("A scene pays for what it uses", self.costs)
        self.section("Which setting", lambda: recommendation(self.parts))
        lack = ""
        if self.missing:
            lack = f'<p class="missing">Not measured: {"; ".join(self.missing)}.</p>'
        return (
            "<h1>fcl_fibers: what accuracy costs</h1>"
            '<p class="lead">Every manager and every dial, measured.</p>'
            + lack
            + "\n".join(self.blocks)
            + "<h2>Circumstances</h2>"
            + self.facts()
        )


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the parts are")
    parser.add_argument("page", type=Path, nargs="?", help="trade.html beside the folder")
    parser.add_argument("--costs", type=Path, help="docs/costs.md, whose table is renewed")
    options = parser.parse_args(arguments)
    page = Page(options.folder)
    output = options.page or options.folder.parent / "trade.html"
    template = string.Template((PAPER / "page.html").read_text(encoding="utf-8"))
    title = "fcl_fibers: what accuracy costs"
    output.write_text(template.substitute(title=title, body=page.make()), encoding="utf-8")
    print(output)
    if options.costs:
        try:
            page.write_costs(options.costs)
        except (OSError, ValueError) as error:
            print(f"page.py: --costs: {error}", file=sys.stderr)
            return 1
        print(options.costs)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
