#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes one page of what benchmarks/run.sh --trade has measured: page.py FOLDER [PAGE.html]

Parts that are missing are named on the page. The numbers stand in FOLDER as CSV.
"""

import html
import math
import string
import sys
from pathlib import Path

sys.dont_write_bytecode = True  # no __pycache__ among the sources
PAPER = Path(__file__).resolve().parent.parent / "paper"
sys.path.insert(0, str(PAPER))

import matplotlib.pyplot as plt
from figures import image
from report import count_text, figure, seconds_text, table, write_csv
from results import load_parts

SCENES = {
    "static": "Strand of 1,000 × 100 long segments (static)",
    "strand": "Strand of 1,000 × 2,000 short segments",
    "half_scalp": "A tenth of the half scalp, 5,000 × 50",
    "dynamic": "Dynamic assembly, 150 × 100, half way",
    "hair": "Hair from a file",
}
# Ours in colour, FCL's in grey; okabe-ito colours, which most eyes tell apart.
OURS = {
    "LayeredAABBTree/bundle": ("boxes", "#0072b2", "o"),
    "LayeredAABBTree/bundle_capsules": ("boxes, capsules out", "#56b4e9", "D"),
    "LayeredAABBTree/super_thread": ("boxes, super thread", "#d55e00", "o"),
    "WrappedSphereTree/bundle": ("spheres", "#009e73", "s"),
    "WrappedSphereTree/bundle_capsules": ("spheres, capsules out", "#60c8a8", "D"),
    "WrappedSphereTree/super_thread": ("spheres, super thread", "#9b3f8f", "s"),
}
FCL = {
    "DynamicAABBTree": ("FCL dynamic tree", "^"),
    "DynamicAABBTree_Array": ("FCL dynamic tree, array", "v"),
    "SaP": ("FCL SaP", "P"),
    "SSaP": ("FCL SSaP", "X"),
    "IntervalTree": ("FCL interval tree", "<"),
    "SpatialHashing": ("FCL spatial hashing", ">"),
    "Naive": ("FCL naive", "x"),
}
LEAST = 0.01  # false pairs per contact that the axis shows; exact ones stand below


def title_of(name):
    if name in OURS:
        return OURS[name][0]
    manager, variant = name.split("/")
    return f"{FCL[manager][0]}, {variant} boxes"


def points_of(part):
    """(name, seconds a frame, false pairs per contact), fastest first."""
    points = []
    for name, entry in part.entries.items():
        counters = entry.counters
        touching = counters.get("touching", 0)
        # Adjacent segments always touch, and are nothing that a program looks for.
        contacts = touching - (counters.get("segments", 0) - counters.get("fibers", 0))
        if math.isnan(entry.total) or contacts <= 0:
            continue
        points.append((name, entry.total, (counters["pairs"] - touching) / contacts))
    return sorted(points, key=lambda point: point[1])


def pareto(points):
    """Those that no other point beats in both."""
    front = []
    for point in points:
        if not front or point[2] < front[-1][2]:
            front.append(point)
    return front


def trade_figure(parts):
    scenes = [scene for scene in SCENES if f"managers_{scene}" in parts]
    columns = 2
    rows = (len(scenes) + 1 + columns - 1) // columns
    fig, axes = plt.subplots(rows, columns, figsize=(10.5, 3.6 * rows), squeeze=False)
    cells = list(axes.flat)
    for scene, ax in zip(scenes, cells):
        points = points_of(parts[f"managers_{scene}"])
        front = pareto(points)
        ax.plot(
            [1e3 * p[1] for p in front],
            [max(p[2], LEAST) for p in front],
            color="#e01b24",
            lw=1.2,
            drawstyle="steps-post",
            zorder=1,
        )
        for name, seconds, false in points:
            if name in OURS:
                _, color, marker = OURS[name]
            else:
                marker = FCL[name.split("/")[0]][1]
                color = "#22262e" if name.endswith("tight") else "#a3aab7"
            ax.scatter(1e3 * seconds, max(false, LEAST), c=color, marker=marker, s=42, zorder=2)
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.set_title(SCENES[scene])
        ax.set_xlabel("ms a frame: motion, update, detection")
        ax.set_ylabel("false pairs per contact")
        ax.axhspan(LEAST * 0.7, LEAST * 1.4, color="#eef4fb", zorder=0)
        ax.text(0.99, 0.02, "none", transform=ax.transAxes, ha="right", color="#5b6475", size=8)
    legend = cells[len(scenes)]
    legend.axis("off")
    handles = [
        plt.Line2D([], [], color=color, marker=marker, ls="", label=label)
        for label, color, marker in OURS.values()
    ]
    handles += [
        plt.Line2D([], [], color="#22262e", marker=marker, ls="", label=label)
        for label, marker in FCL.values()
    ]
    handles.append(plt.Line2D([], [], color="#a3aab7", marker="o", ls="", label="grey: stock boxes"))
    handles.append(plt.Line2D([], [], color="#e01b24", label="Pareto front"))
    legend.legend(handles=handles, loc="center", ncol=2, fontsize=8.5)
    for ax in cells[len(scenes) + 1 :]:
        ax.axis("off")
    fig.tight_layout()
    return image(fig, "False pairs against time, one picture a scene")


class Page:
    def __init__(self, folder):
        self.folder = folder
        self.parts = load_parts(folder)
        self.blocks = []
        self.missing = []

    def section(self, title, make):
        try:
            block = make()
        except (KeyError, IndexError, ValueError) as lack:
            block = None
            print(f"report: {title}: {type(lack).__name__} {lack}", file=sys.stderr)
        if block:
            self.blocks.append(f"<h2>{title}</h2>\n{block}")
        else:
            self.missing.append(title)

    def entries(self, part):
        return {name.rsplit("/", 1)[0]: e for name, e in self.parts[part].entries.items()}

    def scenes_with(self, prefix):
        return [scene for scene in SCENES if f"{prefix}_{scene}" in self.parts]

    # Managers

    def managers(self):
        if not self.scenes_with("managers"):
            return None
        rows = []
        for scene in self.scenes_with("managers"):
            points = points_of(self.parts[f"managers_{scene}"])
            front = {p[0] for p in pareto(points)}
            for name, seconds, false in points:
                rows.append([SCENES[scene], title_of(name), seconds, false, int(name in front)])
        header = ["scene", "setting", "seconds a frame", "false per touching", "on the front"]
        write_csv(self.folder / "managers.csv", header, rows)
        return figure(
            trade_figure(self.parts),
            (
                "Each manager at each setting: what a frame costs, and how many pairs it reports in"
                " vain for each contact, that is each touching pair of segments that are not"
                " adjacent; the adjacent ones are reported by all. FCL's managers with the boxes they make themselves"
                " (stock, grey) and with tight ones (black). One thread."
            ),
        )

    def recommendation(self):
        items, wins = [], 0
        scenes = self.scenes_with("managers")
        for scene in scenes:
            points = points_of(self.parts[f"managers_{scene}"])
            ours = [p for p in points if p[0] in OURS]
            exact = [p for p in ours if p[0].endswith("capsules")]
            loose = [p for p in ours if not p[0].endswith("capsules")]
            theirs = [p for p in points if p[0] not in OURS]
            if not exact or not loose or not theirs:
                items.append(f"<li><b>{SCENES[scene]}.</b> Not all of them ended in time.</li>")
                continue
            exact, loose, theirs = exact[0], loose[0], theirs[0]
            on_front = ", ".join(f"{title_of(p[0])}" for p in pareto(points))
            wins += title_of(loose[0]) == "boxes"
            items.append(
                f"<li><b>{SCENES[scene]}.</b> Only what touches: {title_of(exact[0])},"
                f" {seconds_text(exact[1])} a frame, {theirs[1] / exact[1]:.1f} times as fast as"
                f" FCL's fastest, which reports {theirs[2]:.1f} false pairs for each. Volumes:"
                f" {title_of(loose[0])}, {seconds_text(loose[1])}, with {loose[2]:.1f} false pairs."
                f" On the front: {on_front}.</li>"
            )
        if not items:
            return None
        return (
            f"<ul>{''.join(items)}</ul><p>Boxes over bundles, the default, are the fastest volumes in"
            f" {wins} of {len(scenes)} scenes. A program that tests the"
            " pairs itself takes Report::kVolumes; one that would only drop those that do not touch"
            " takes Report::kCapsules.</p>"
        )

    # Dials

    def leaves(self):
        rows, csv_rows = [], []
        for scene in self.scenes_with("leaves"):
            entries = self.entries(f"leaves_{scene}")
            base = entries["1"].total
            for length in ("1", "2", "4", "8"):
                if length not in entries:
                    continue
                e = entries[length]
                c = e.counters
                rows.append(
                    (
                        "group" if length == max(entries, key=int) else "",
                        [
                            SCENES[scene] if length == "1" else "",
                            length,
                            seconds_text(c["build"]),
                            seconds_text(c["update"]),
                            seconds_text(c["detection"]),
                            f"{base / e.total:.2f}",
                            count_text(c["touching"]),
                            count_text(c["run_pairs"]),
                            count_text(c["tests"]),
                        ],
                    )
                )
                csv_rows.append(
                    [SCENES[scene], length, c["build"], c["update"], c["detection"], c["touching"]]
                    + [c["run_pairs"], c["tests"], c["bytes"]]
                )
        if not rows:
            return None
        header = ["scene", "segments a leaf", "build", "update", "detection", "frame, 1 : this"]
        write_csv(
            self.folder / "leaves.csv",
            header[:2] + ["build s", "update s", "detection s", "touching", "run pairs", "tests"]
            + ["bytes"],
            csv_rows,
        )
        return (
            "<p>The tree over runs of segments, each run in the capsule about its chord; pairs of"
            " runs that touch are tried segment by segment. The answer is the same: the capsules"
            " that touch. Plain arrays, one thread. Left out: runs in capsules more than fifty times as"
            " thick as the fiber.</p>"
            + table(header + ["touching", "pairs of runs", "pairs tried"], rows)
        )

    def bounds(self):
        rows, csv_rows = [], []
        for scene in self.scenes_with("bounds"):
            entries = self.entries(f"bounds_{scene}")
            whole = entries["none"]
            for name in sorted(entries, key=self.bound_order):
                e = entries[name]
                c = e.counters
                share = c["pairs"] / whole.counters["pairs"]
                cells = [name.replace(":", " ≤ ") if ":" in name else name]
                cells += [seconds_text(e.total), f"{100 * share:.1f} %"]
                cells += [count_text(c["pieces"]), count_text(c["unresolved"])]
                rows.append(("", [SCENES[scene] if name == "none" else ""] + cells))
                csv_rows.append([SCENES[scene], name, e.total, c["pairs"], c["pieces"]]
                                + [c["unresolved"]])
        if not rows:
            return None
        write_csv(
            self.folder / "bounds.csv",
            ["scene", "bound", "seconds", "pairs", "pieces", "unresolved pairs"],
            csv_rows,
        )
        return (
            "<p>FiberTree::visitPairs with a SearchBound: at most so many tests of volumes, or no"
            " volume opened that is smaller than so many fiber radii. What is not resolved comes as"
            " pairs of pieces that hold every pair there may be.</p>"
            + table(
                ["scene", "bound", "time", "touching pairs resolved", "pieces", "pairs in them"],
                rows,
            )
        )

    @staticmethod
    def bound_order(name):
        kind, _, value = name.partition(":")
        return (("none", "all", "tests", "radii").index(kind), int(value or 0))

    def spheres(self):
        rows, csv_rows = [], []
        for scene in self.scenes_with("spheres"):
            entries = self.entries(f"spheres_{scene}")
            exact = entries["exact"].counters["mean_radius"]
            for name in ("verified", "exact", "core_set_20", "core_set_5", "Ritter", "centroid"):
                e = entries[name]
                c = e.counters
                rows.append(
                    (
                        "",
                        [
                            SCENES[scene] if name == "verified" else "",
                            name.replace("_", " "),
                            seconds_text(c["update"]),
                            seconds_text(c["detection"]),
                            f"{c['mean_radius'] / exact:.3f}",
                            count_text(c["tests"]),
                        ],
                    )
                )
                csv_rows.append(
                    [SCENES[scene], name, c["update"], c["detection"], c["mean_radius"] / exact]
                    + [c["tests"]]
                )
        if not rows:
            return None
        header = ["scene", "cages", "update", "detection", "mean radius : exact", "tests"]
        write_csv(self.folder / "spheres.csv", header, csv_rows)
        return (
            "<p>Cages of the wrapped sphere tree: <em>verified</em> keeps the exact one as long as"
            " its basis holds, which is what the manager does; the others are made anew at every"
            " step. Detection by the least instruction set, to compare tests.</p>"
            + table(header, rows)
        )

    def lazy(self):
        part = self.parts["lazy"]
        rows, csv_rows = [], []
        for report in ("volumes", "capsules"):
            found = {n.split(":")[1]: e for n, e in part.entries.items() if n.startswith(report)}
            base = found["0.00"].total
            for fatness in sorted(found, key=float):
                e = found[fatness]
                c = e.counters
                rows.append(
                    (
                        "",
                        [
                            report if fatness == "0.00" else "",
                            f"{float(fatness):g}",
                            f"{100 * c['share']:.0f} %",
                            seconds_text(c["moved"]),
                            seconds_text(c["still"]),
                            seconds_text(c["detection"]),
                            f"{base / e.total:.2f}",
                        ],
                    )
                )
                csv_rows.append([report, fatness, c["share"], c["moved"], c["still"]]
                                + [c["detection"], e.total])
        header = ["report", "fatness, radii", "leave", "update", "update, nothing moved"]
        write_csv(
            self.folder / "lazy.csv",
            ["report", "fatness", "share", "update s", "still s", "detection s", "sum s"],
            csv_rows,
        )
        return (
            "<p>The dynamic assembly, all its steps: boxes fattened, refitted only where a segment"
            " has left its own. The last column takes a refit in part for its share of a whole"
            " one, which it exceeds: the most that the dial may gain.</p>"
            + table(header + ["detection", "sum, tight : this"], rows)
        )

    def sampling(self):
        entries = self.parts["sampling"].entries
        rows, csv_rows = [], []
        for kind in ("plain", "margin"):
            for segments in (25, 50, 100, 200, 400, 1000, 2000):
                e = entries[f"{segments}/{kind}"]
                c = e.counters
                missed = c["missed"] / c["contacts"]
                extra = c["extra"] / max(c["reported"], 1)
                rows.append(
                    (
                        "",
                        [
                            kind if segments == 25 else "",
                            str(segments),
                            f"{c['chord_error'] / 0.0035:.3g}",
                            f"{100 * missed:.2f} %",
                            f"{100 * extra:.1f} %",
                            seconds_text(e.total),
                        ],
                    )
                )
                csv_rows.append([kind, segments, c["chord_error"], missed, extra, e.total])
        header = ["margin", "segments a fiber", "chord error, radii", "missed", "not in the finest"]
        write_csv(
            self.folder / "sampling.csv",
            ["margin", "segments", "chord error cm", "missed", "extra", "seconds"],
            csv_rows,
        )
        return (
            "<p>The strand of 1,000 fibers of 30 cm, against itself at 2,000 segments: contacts of"
            " two fibers missed, and contacts that the finest has none beside. <em>Margin</em>: with"
            " twice the chord error as margin, which misses none.</p>"
            + table(header + ["update + detection"], rows)
        )

    def costs(self):
        rows, csv_rows, text = [], [], []
        for name, e in sorted(self.parts["costs"].entries.items()):
            c = e.counters
            n = c["segments"]
            kind, what = name.split("/", 1)
            cells = [f"{c['bytes'] / n:.1f}", f"{1e9 * c['update'] / n:.0f}"]
            cells += [f"{1e9 * c['detection'] / n:.0f}"]
            rows.append(("", [f"{kind}: {what}"] + cells + [count_text(c["pairs"])]))
            csv_rows.append([kind, what] + cells + [c["pairs"]])
            text.append(f"| {kind} | {what} | {' | '.join(cells)} | {count_text(c['pairs'])} |")
        header = ["", "bytes a segment", "update, ns", "detection, ns", "pairs"]
        write_csv(self.folder / "costs.csv", ["of", "what"] + header[1:], csv_rows)
        head = "| of | what is asked for | bytes | update, ns | detection, ns | pairs |\n|---|---|--:|--:|--:|--:|\n"
        (self.folder / "costs.md").write_text(head + "\n".join(text) + "\n", encoding="utf-8")
        return (
            "<p>A strand of 1,000 × 100: what a tree over plain arrays and a manager of FCL objects"
            " hold and take, a segment, by what they are told to do.</p>" + table(header, rows)
        )

    def facts(self):
        contexts = [part.context for part in self.parts.values()]
        rows = []
        for key in ("machine", "num_cpus", "compiler", "build_type", "commit"):
            values = dict.fromkeys(str(c.get(key, "unknown")) for c in contexts)
            rows.append((key.replace("_", " "), html.escape(", ".join(values))))
        dates = sorted(c["date"] for c in contexts if "date" in c)
        if dates:
            rows.append(("begun", f"{dates[0]}; last part {dates[-1]}"))
        lines = "".join(f"<tr><td>{k}</td><td>{v}</td></tr>" for k, v in rows)
        return f'<table class="facts">{lines}</table>'

    def make(self):
        self.section("What a pair costs", self.managers)
        self.section("Which setting", self.recommendation)
        self.section("Leaves of several segments", self.leaves)
        self.section("How finely a curve is cut", self.sampling)
        self.section("An answer in time", self.bounds)
        self.section("Approximate spheres", self.spheres)
        self.section("Lazy updates", self.lazy)
        self.section("A scene pays for what it uses", self.costs)
        lack = (
            f'<p class="missing">Not measured: {"; ".join(self.missing)}.</p>' if self.missing else ""
        )
        return (
            "<h1>fcl_fibers: what accuracy costs</h1>"
            '<p class="lead">Every manager and every dial, measured.</p>'
            + lack
            + "\n".join(self.blocks)
            + "<h2>Circumstances</h2>"
            + self.facts()
        )


def main(arguments):
    if len(arguments) not in (1, 2):
        print(__doc__, file=sys.stderr)
        return 1
    folder = Path(arguments[0])
    output = Path(arguments[1]) if len(arguments) == 2 else folder.parent / "trade.html"
    body = Page(folder).make()
    template = string.Template((PAPER / "page.html").read_text(encoding="utf-8"))
    page = template.substitute(title="fcl_fibers: what accuracy costs", body=body)
    output.write_text(page, encoding="utf-8")
    print(output)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
