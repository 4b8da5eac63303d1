#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes one page of what fcl_fibers_paper has measured: report.py FOLDER [PAGE.html]

Parts that are missing are named on the page; the others are shown. The numbers of every table and
curve stand in FOLDER as CSV.
"""

import csv
import html
import math
import string
import sys
from pathlib import Path

sys.dont_write_bytecode = True  # no __pycache__ among the sources

import findings
import figures
from results import PHASES, load_parts, numbered

# Table I and section 4.1 of the paper, Pentium IV 2.4 GHz: seconds by phase, and collisions.
PAPER = {
    "half_scalp": {
        "spheres": (4.609, 1924.74, 1984.78),
        "boxes": (4.109, 0.766, 100.531),
        "collisions": 550_000,
    },
    "strand_1000": {
        "spheres": (2.907, 91.923, 15.282),
        "boxes": (2.781, 0.281, 1.688),
        "collisions": 23_000,
    },
    "strand_2000": {"boxes": (None, 0.6, 4.3), "collisions": 80_000},
}
TABLE_SCENES = {
    "half_scalp": "Half scalp, 50,000 × 50",
    "strand_1000": "Strand, 1,000 × 2,000",
    "strand_2000": "Strand, 2,000 × 2,000",
    "hair": "The file of --hair",
}
TABLE_ROWS = (
    "WrappedSphereTree/super_thread",
    "LayeredAABBTree/super_thread",
    "WrappedSphereTree/bundle",
    "LayeredAABBTree/bundle",
    "LayeredAABBTree/bundle_capsules",
    "DynamicAABBTree/tight",
)


def seconds_text(value):
    if value is None or math.isnan(value):
        return "–"
    for unit, scale in (("s", 1), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= 0.9995 * scale or unit == "µs":
            number = value / scale
            digits = 0 if number >= 99.95 else 1 if number >= 9.995 else 2
            return f"{number:,.{digits}f} {unit}"
    return ""


def count_text(value):
    return "–" if value is None or math.isnan(value) else f"{value:,.0f}"


def table(header, rows):
    """Rows are (css class, cells); the first cell of each is a name."""

    def line(cells, tag, css=""):
        out = []
        for i, cell in enumerate(cells):
            name = ' class="name"' if i == 0 else ""
            out.append(f"<{tag}{name}>{cell}</{tag}>")
        return f"<tr{f' class={css!r}' if css else ''}>" + "".join(out) + "</tr>"

    body = "\n".join(line(cells, "td", css) for css, cells in rows)
    return f'<div class="scroll"><table>\n{line(header, "th")}\n{body}\n</table></div>'


def figure(img, caption):
    return f"<figure>{img}<figcaption>{caption}</figcaption></figure>"


def write_csv(path, header, rows):
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(rows)


class Page:
    def __init__(self, folder):
        self.folder = folder
        self.parts = load_parts(folder)
        self.missing = []
        self.blocks = []

    def add(self, block):
        self.blocks.append(block)

    def section(self, title, what, make):
        """What fails for want of data is noted and left out."""
        try:
            block = make()
        except (KeyError, FileNotFoundError, IndexError, StopIteration) as lack:
            block = None
            print(f"report: {what}: {type(lack).__name__} {lack}", file=sys.stderr)
        if block:
            self.add(f"<h2>{title}</h2>\n{block}")
        else:
            self.missing.append(what)

    # Table I

    def table_entry(self, scene, name):
        entry = self.parts[scene].entries.get(name)
        return entry

    def paper_rows(self, scene):
        paper = PAPER.get(scene, {})
        rows = []
        for volume in ("spheres", "boxes"):
            if volume in paper:
                cells = [f"paper, {volume}"] + [seconds_text(s) for s in paper[volume]]
                rows.append(("paper", cells + [count_text(paper["collisions"]), "–", "–"]))
        return rows

    def our_row(self, scene, name):
        entry = self.table_entry(scene, name)
        if entry is None:
            return None
        cells = [figures.title_of(name)]
        for phase in PHASES:
            seconds, is_median = entry.time(phase)
            if entry.ended_in(phase):
                cells.append(html.escape(entry.note))
            else:
                known = not math.isnan(seconds)
                cells.append(("" if is_median or not known else "~") + seconds_text(seconds))
        pairs = entry.checked.get("pairs")
        touching = entry.checked.get("touching")
        size = entry.checked.get("bytes")
        per_segment = size / entry.checked["segments"] if size else None
        return ("", cells + [count_text(pairs), count_text(touching), count_text(per_segment)])

    def table_one(self):
        header = ["", "construction", "update", "detection", "pairs", "touching", "bytes/segment"]
        out, rows_csv = [], []
        for scene, title in TABLE_SCENES.items():
            if scene not in self.parts:
                if scene != "hair":
                    self.missing.append(f"Table I: {title}")
                continue
            ours = [row for name in TABLE_ROWS if (row := self.our_row(scene, name))]
            rows = self.paper_rows(scene) + ours
            rows_csv += [[title] + [html.unescape(c) for c in cells] for _, cells in rows]
            out.append(f"<h3>{title}</h3>" + table(header, rows))
        if not out:
            return None
        write_csv(self.folder / "table1.csv", ["scene"] + header, rows_csv)
        return (
            "<p>The paper's rows are of a Pentium IV, 2.4 GHz, ours of this machine, one thread."
            " <em>As published</em> is the paper's tree: fibers in the order of generation, one"
            " super thread, balanced and binary. <em>By default</em> is the bundle. <code>~</code>"
            " is a single time, <code>&gt;10 s</code> is where the phase was stopped. Pairs are"
            " those that a manager reports, touching those of them whose capsules touch; adjacent"
            " segments are left out but by FCL, which cannot. The paper's collisions stand under"
            " pairs; it does not say whether volumes or capsules are meant.</p>"
            + "".join(out)
        )

    # Figures 7 to 10

    def static_section(self, number, phase, caption):
        static = numbered(self.parts, "static")
        if len(static) < 2:
            return None
        img = figures.static_figure(static, phase, f"Fig. {number}")
        rows = [
            [
                1 * entry.checked.get("segments", 100 * fibers),
                figures.title_of(name),
                entry.median(phase),
            ]
            for fibers, part in static.items()
            for name, entry in part.entries.items()
        ]
        write_csv(self.folder / f"fig{number}.csv", ["segments", "manager", "seconds"], rows)
        return figure(img, caption) + self.ended_early(static)

    @staticmethod
    def ended_early(static):
        ended = {}
        for fibers, part in static.items():
            for name, entry in part.entries.items():
                if entry.note:
                    ended.setdefault((name, entry.note), []).append(100 * fibers)
        if not ended:
            return ""
        texts = [
            f"{figures.title_of(name)} ({html.escape(note)}) from {min(sizes):,} segments"
            for (name, note), sizes in ended.items()
        ]
        return f'<p class="facts">Ended before their time: {"; ".join(texts)}.</p>'

    @staticmethod
    def not_replayed(part):
        late = [
            f"{figures.title_of(name)} ({html.escape(entry.note) or 'too slow a step'})"
            for name, entry in part.entries.items()
            if math.isnan(entry.total)
        ]
        return f'<p class="facts">Not replayed: {"; ".join(late)}.</p>' if late else ""

    def dynamic_section(self):
        part = self.parts["dynamic"]
        img = figures.dynamic_figure(part)
        rows = []
        for name, entry in part.entries.items():
            for counter in ("pairs", "update", "detection", "cages_kept", "cages_recomputed"):
                for step, value in enumerate(figures.step_series(entry, counter)):
                    rows.append([figures.title_of(name), counter, step, value])
        write_csv(self.folder / "fig10.csv", ["manager", "what", "step", "value"], rows)
        cages = figures.cages_figure(part)
        return figure(
            img,
            (
                "Fig. 10. 150 fibers of 100 segments, bent from straight to a loop in 100 steps;"
                " each manager lives through all of them. The least of each step's times over"
                " replays in random order. Left: boxes and spheres count volumes that overlap,"
                " capsules those that touch. The paper's loads were recorded; these are made, a"
                " smooth path from no load to a loop's."
            ),
        ) + self.not_replayed(part) + figure(
            cages,
            (
                "Cascade verification: the share of cages whose basis no longer held at a step and"
                " that were computed anew. At 100 % the fibers had moved so far apart that the bundle"
                " was made anew."
            ),
        )

    # What has no figure in the paper

    def chain_section(self):
        chains = {kind: numbered(self.parts, f"chain_{kind}") for kind in ("random", "snake")}
        if not any(chains.values()):
            return None
        rows = []
        for kind, parts in chains.items():
            for part in parts.values():
                for name, e in part.entries.items():
                    c = e.counters
                    rows.append(
                        [
                            kind,
                            c.get("segments"),
                            figures.title_of(name),
                            c.get("volume_tests"),
                            c.get("pairs"),
                            e.total,
                        ]
                    )
        write_csv(
            self.folder / "chains.csv",
            ["chain", "segments", "manager", "volume_tests", "pairs", "seconds"],
            rows,
        )
        return figure(
            figures.chain_figure(chains),
            (
                "Tests of two volumes in one self-collision query of one chain. Both chains visit"
                " each point of a cubic lattice once, turned by π/4 about two axes: left in random"
                " order, right row after row, which is as bad as a well-behaved chain can be: each"
                " of its <i>n</i><sup>2/3</sup> rows has a volume that a fixed part of all others"
                " reach."
            ),
        )

    def radii_section(self):
        rows = self.parts["radii"].rows
        header = [
            "chain",
            "segments",
            "height",
            "layered",
            "wrapped",
            "ratio",
            "largest ratio",
            "bytes/segment, boxes",
            "bytes/segment, spheres",
        ]
        keys = ["segments", "height", "layered", "wrapped"]
        write_csv(
            self.folder / "radii.csv",
            header,
            [
                [name]
                + [r[k] for k in keys]
                + [
                    r["layered"] / r["wrapped"],
                    r["largest_ratio"],
                    r["box_bytes_per_segment"],
                    r["sphere_bytes_per_segment"],
                ]
                for name, r in rows.items()
            ],
        )
        return figure(
            figures.radii_figure(rows),
            (
                "Radius of the root sphere, layered to wrapped, in the paper's tree. The layered"
                " sphere is the least one around its two children's, the wrapped one around all"
                " leaves. Dashed: the bound that the paper cites."
            ),
        )

    def rods_section(self):
        entries = self.parts["rods"].entries
        rows, csv_rows = [], []
        for name in (n for n in entries if n.startswith("warm/")):
            size = name.split(":")[1]
            warm, cold = entries[name], entries[f"cold/segments:{size}"]
            steps = [count_text(entry.counters["iterations"]) for entry in (warm, cold)]
            rows.append(
                ("", [size, seconds_text(warm.total), steps[0], seconds_text(cold.total), steps[1]])
            )
            csv_rows.append([size, warm.total, cold.total])
        rows.sort(key=lambda row: int(row[1][0]))
        write_csv(self.folder / "rods.csv", ["segments", "warm s", "cold s"], csv_rows)
        scenes = [(name, entries[name]) for name in entries if "/" not in name]
        made = [
            (
                "",
                [
                    name.replace("_", " "),
                    count_text(entry.counters["fibers"]),
                    count_text(entry.counters["segments"]),
                    seconds_text(entry.total),
                ],
            )
            for name, entry in sorted(scenes)
        ]
        return (
            "<p>One hair, bent half way to the loop: warm from its shape under a load that differs"
            " by 2 %, cold from none; beside each, Newton steps.</p>"
            + table(["segments", "warm", "steps", "cold", "steps"], rows)
            + "<p>Making a scene, every rod of it in equilibrium.</p>"
            + table(["scene", "rods", "segments", "time"], made)
        )

    def axis_section(self):
        rows, csv_rows = [], []
        for name, straight, turned in findings.axis_pairs(self.parts):
            ratio = turned / straight if straight else math.nan
            rows.append(
                (
                    "",
                    [
                        figures.title_of(name),
                        seconds_text(straight),
                        seconds_text(turned),
                        f"{ratio:.2f}",
                    ],
                )
            )
            csv_rows.append([figures.title_of(name), straight, turned])
        if not rows:
            return None
        write_csv(
            self.folder / "axis_parallel.csv", ["manager", "axis-parallel s", "turned s"], csv_rows
        )
        return (
            "<p>The static assembly all but straight (bent by less than 0.1 rad), along z or turned by π/4"
            " about y and x.</p>"
            + table(["detection", "axis-parallel", "turned", "turned : axis-parallel"], rows)
        )

    def pictures_section(self):
        blocks = []

        def picture(what, make):
            try:
                blocks.append(make())
            except (FileNotFoundError, IndexError):
                self.missing.append(what)

        def counted(counts):
            return (
                f"{counts['fibers']:,.0f} fibers, {counts['segments']:,.0f} segments, "
                f"{counts['touching_pairs']:,.0f} touching pairs on "
                f"{100 * counts['touching_segments'] / counts['segments']:.1f} % of the segments"
            )

        def strand():
            img, counts = figures.strand_picture(self.folder)
            return figure(
                img,
                (
                    f"The paper's Figs. 1 and 6. Helical strand: {counted(counts)}. Middle: "
                    "touching segments red. Right: the framed part."
                ),
            )

        def loop():
            img, counts = figures.loop_picture(self.folder)
            return figure(
                img,
                (
                    "The paper's Fig. 3, left. The dynamic assembly late in its motion: "
                    f"{counted(counts)}."
                ),
            )

        def half_scalp():
            img, counts = figures.half_scalp_picture(self.folder)
            return figure(
                img,
                (
                    f"The paper's Fig. 2, right. Half scalp: {counted(counts)}. Three fibers "
                    "in ten are drawn."
                ),
            )

        def interactive():
            view = (self.folder / "view.html").read_text(encoding="utf-8")
            return figure(
                f'<div class="stage">{view}</div>',
                (
                    "The same scenes to turn and to enter: touching segments red, the volumes of "
                    "the bundle on request, the dynamic assembly played. Fibers and points are "
                    "thinned for the page, contacts are of all."
                ),
            )

        def volumes():
            img, stick_out = figures.volumes_picture(self.folder)
            outside = (
                ""
                if stick_out is None
                else (
                    " Right: the cage whose child sticks out farthest, by"
                    f" {100 * stick_out[2]:.0f} % of its radius: the leaves are inside all the"
                    " same."
                )
            )
            return figure(
                img,
                (
                    "The paper's Figs. 3, right, and 4. One filament of the dynamic "
                    f"assembly in the volumes of one level.{outside}"
                ),
            )

        picture("interactive view", interactive)
        picture("picture of the strand", strand)
        picture("picture of the loop", loop)
        picture("picture of the volumes", volumes)
        picture("picture of the half scalp", half_scalp)
        return "".join(blocks)

    def findings_section(self):
        items = findings.all_findings(self.parts, PAPER)
        if not items:
            return None
        rows = []
        for item in items:
            css = {"as the paper": "as", "differs": "differs"}.get(item.verdict, "partly")
            rows.append(
                f'<div class="finding"><div class="verdict {css}">{item.verdict}</div><div>'
                f'<p class="said">{item.said}</p><p>{item.found}</p></div></div>'
            )
        return (
            "<p>What the paper states, and what these measurements say of it. The sentences are"
            " made from the numbers.</p>"
            + "\n".join(rows)
        )

    def facts(self):
        contexts = [part.context for part in self.parts.values()]
        if not contexts:
            return ""
        command = self.folder / "command.txt"
        commands = [command.read_text(encoding="utf-8").strip()] if command.exists() else []
        rows = (
            [("command", "<code>" + html.escape("; ".join(commands)) + "</code>")]
            if commands
            else []
        )
        for key, label in (
            ("machine", "machine"),
            ("num_cpus", "cores"),
            ("compiler", "compiler"),
            ("build_type", "build"),
            ("commit", "commit"),
            ("seed", "seed"),
        ):
            values = dict.fromkeys(str(c.get(key, "unknown")) for c in contexts)
            rows.append((label, html.escape(", ".join(values))))
        dates = sorted(c["date"] for c in contexts if "date" in c)
        if dates:
            rows.append(("begun", f"{dates[0]}; last part {dates[-1]}"))
        lines = "".join(f"<tr><td>{k}</td><td>{v}</td></tr>" for k, v in rows)
        return f'<table class="facts">{lines}</table>'

    def make(self):
        # Figures 7 to 9 share their curves' legend; what each shows is in its caption.
        self.section("Table I", "Table I", self.table_one)
        self.section(
            "What the paper found, and what is found here", "findings", self.findings_section
        )
        self.section(
            "Construction",
            "Fig. 7",
            lambda: self.static_section(
                7,
                "SetUp",
                (
                    "Fig. 7. Time to construct the manager against the number of segments; static "
                    "assembly of 100 segments a fiber, turned."
                ),
            ),
        )
        self.section(
            "Update",
            "Fig. 8",
            lambda: self.static_section(
                8,
                "Update",
                (
                    "Fig. 8. Time of one update after all fibers have moved: for boxes one sweep,"
                    " for wrapped spheres the cascade verification."
                ),
            ),
        )
        self.section(
            "Detection",
            "Fig. 9",
            lambda: self.static_section(
                9,
                "SelfCollision",
                (
                    "Fig. 9. Time of one self-collision query. Boxes and spheres report volumes"
                    " that overlap; “capsules out” reports only capsules that touch, and tests that"
                    " as well."
                ),
            ),
        )
        self.section("Dynamic assembly", "Fig. 10", self.dynamic_section)
        self.section("Axis-parallel against turned", "axis-parallel fibers", self.axis_section)
        self.section("One chain against itself", "chains", self.chain_section)
        self.section("Layered against wrapped spheres", "radii", self.radii_section)
        self.section("What rods cost", "rods", self.rods_section)
        self.section("Pictures", "pictures", self.pictures_section)

    def text(self):
        missing = ""
        if self.missing:
            missing = (
                '<p class="missing">Not measured, or not to the end: '
                + "; ".join(html.escape(m) for m in self.missing)
                + ".</p>"
            )
        head = (
            "<h1>Collision detection in densely packed fiber assemblies, measured again</h1>"
            '<p class="lead">What Sobottka, Varnik and Weber report in <em>Collision Detection in '
            "Densely Packed Fiber Assemblies with Application to Hair Modeling</em>, beside "
            "fcl_fibers as published and by default, and FCL's own managers on the same tight "
            f"boxes.</p>{self.facts()}{missing}"
        )
        return head + "\n".join(self.blocks)


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit("usage: report.py FOLDER [PAGE.html]")
    folder = Path(sys.argv[1])
    target = Path(sys.argv[2]) if len(sys.argv) == 3 else folder.with_suffix(".html")
    page = Page(folder)
    page.make()
    template = (Path(__file__).parent / "page.html").read_text(encoding="utf-8")
    # Written beside and renamed, so that an interrupted run leaves the page before it whole.
    draft = target.with_suffix(".html.part")
    text = string.Template(template).substitute(
        title="fcl_fibers: the paper's measurements, again", body=page.text()
    )
    draft.write_text(text, encoding="utf-8")
    draft.replace(target)
    if page.missing:
        print("Missing on the page: " + "; ".join(page.missing), file=sys.stderr)


if __name__ == "__main__":
    main()
