# SPDX-License-Identifier: BSD-3-Clause
"""Makes tables and a page of what benchmarks/run.sh has measured.

What was not run is named as not measured. Anything else that is missing is an error.
"""

import argparse
import base64
import json
import re
import shutil
import sys
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import jinja2

import arms
import arrays
import card
import elsewhere
import figures
import frames
import live
import machines
import motion
import narrow
import obstacles
import paper
import paper_cascade
import paper_claims
import paper_pictures
import paper_table
import pictures
import python_steps
import shapes
import summary
import threads
import trade
from machines import MainTable
from measured_sets import SETS, titles
from results import circumstances, load, told
from tables import MARK, Table, documents

MEASURED = Path("docs", "measured")  # tables that no document has
HAIR = "frames_hair"
BARS = "Bars are medians. Lines reach to the ends of the 95 % interval."


@dataclass
class Figure:
    name: str  # of the file in docs/images, if it is there
    title: str
    caption: str
    draw: object = None  # returns the bytes of a PNG
    html: str = ""

    @cached_property
    def data(self):
        return self.draw()

    @property
    def inlined(self):
        return "data:image/png;base64," + base64.b64encode(self.data).decode()


class Report:
    """Tables and figures of one set."""

    def __init__(self, kind, title, folder):
        self.kind, self.title, self.folder = kind, title, folder
        names = [measure.name for measure in SETS[kind]]
        self.parts = load(folder, [*names, HAIR])
        self.missing = [name for name in names if name not in self.parts]
        if HAIR in self.parts:
            self.missing = []
        self.blocks, self.main, self.files = [], [], {}
        self.on_page_alone = set()
        self.linked_by_none = set()  # tables for which no document has a place

    def has(self, files):
        return any(re.fullmatch(files, name) for name in self.parts)

    def add(self, files, make, *arguments):
        """A table of such files, if there are any."""
        if self.has(files):
            table = make(*arguments)
            self.files[table.name] = files
            (self.main if isinstance(table, MainTable) else self.blocks).append(table)

    def draw(self, files, name, title, caption, make, *arguments):
        """A figure of such files, if there are any."""
        if self.has(files):
            self.blocks.append(Figure(name, title, caption, partial(make, *arguments)))

    def tables(self):
        return {block.name: block for block in self.blocks if isinstance(block, Table)}

    def figures(self):
        return [block for block in self.blocks if isinstance(block, Figure)]

    @property
    def machine(self):
        """The kind of machine: its processor, and the target of our SIMD."""
        # The first measure of a set is not held to a lesser target.
        simd = [part.context["simd"] for part in self.parts.values() if "simd" in part.context]
        return ", ".join([told(self.parts, "machine").split(", ")[0], *simd[:1]])

    def lacks(self, name):
        """Whether a file of the table of that name was not measured."""
        return any(re.fullmatch(self.files[name], file) for file in self.missing)

    def source(self, name, command):
        """What the table of that name is of."""
        files = self.files.get(name, ".*")
        parts = {name: part for name, part in self.parts.items() if re.fullmatch(files, name)}
        return f"`{command}`, {circumstances(parts, self.parts)}"


def headline(folder):
    report = Report("headline", "The headline", folder)
    scenes = frames.scenes_of(report.parts)
    report.add("frames_(?!hair).*", frames.readme, scenes)
    report.add("frames_.*", frames.headline, scenes)
    report.draw("frames_.*", "headline", "Time of a frame", BARS, pictures.headline, scenes)
    add_frames(report, scenes)
    report.on_page_alone = report.tables().keys() - {"headline"}  # the set full has the others
    return report


def add_frames(report, scenes):
    report.add("frames_.*", frames.all_ratios, scenes)
    report.add("frames_.*", frames.best, scenes)
    for name, scene in scenes.items():
        report.add(f"frames_{name}", frames.scene_table, scene)
        report.add(f"frames_{name}", frames.tried, scene)
        report.on_page_alone.add(f"tried {name}")


def full(folder):
    report = Report("full", "All figures", folder)
    parts, add = report.parts, report.add
    scenes = frames.scenes_of(parts)
    add("frames_(?!hair).*|obstacles_.*|motion_.*|clients", summary.table, parts)
    report.draw("frames_.*", "", "Time of a frame", BARS, pictures.headline, scenes)
    add_frames(report, scenes)
    add("best_.*", frames.at_their_best, parts)
    add("embree_.*", frames.embrees, parts)
    add("queries", elsewhere.elsewhere, parts.get("queries"))
    add("clients", elsewhere.clients, parts.get("clients"))
    add("clients", elsewhere.changes, parts.get("clients"))
    add("queries", elsewhere.candidates, parts.get("queries"))
    for table in (shapes.beside, shapes.fibers_of, shapes.one_by_one):
        add("shapes", table, parts.get("shapes"))
    add("arms", arms.arms, parts.get("arms"))
    add("arrays_.*", arrays.table, parts)
    add("growth", frames.growth, parts.get("growth"))
    add("obstacles_.*", obstacles.table, parts)
    add("obstacles_(cap|combed)", obstacles.counts, parts)
    add(r"motion_\d+", motion.table, parts)
    add("live_.*", live.table, parts)
    add("live_.*", live.counts, parts)
    add("safe-distances", live.safe_distances, parts.get("safe-distances"))
    return report


def trade_offs(folder):
    report = Report("trade", "What accuracy costs", folder)
    parts = report.parts
    report.add("trade_.*", trade.dials, parts)
    for name in titles("trade"):
        report.add(f"trade_{name}", trade.scene_table, name, parts.get(f"trade_{name}"))
    report.add("skins", live.skins, parts.get("skins"))
    report.add("costs", trade.costs, parts.get("costs"))
    report.add("costs", trade.tapers, parts.get("costs"))
    report.add("unused", trade.unused, parts.get("unused"))
    hair = parts.get("narrow")
    report.add("narrow", narrow.narrow, hair, parts.get("narrow_paper-static"))
    report.add("narrow", narrow.errors, hair)
    report.add("narrow", narrow.kinds, hair)
    title = "Error against time"
    report.draw("narrow", "trade_narrow", title, narrow.PICTURE, narrow.figure, hair)
    return report


def paper_again(folder):
    report = Report("paper", "The paper's measurements, again", folder)
    parts = report.parts
    if HAIR in parts:
        parts["table_hair"] = parts[HAIR]
    for hard in (False, True):
        ours = [name for name, scene in paper_table.SCENES.items() if scene.hard == hard]
        ours += [] if hard else ["hair"]
        report.add(f"table_({'|'.join(ours)})", paper_table.table_one, parts, hard)
    report.add("table_(?!hair).*", paper_table.ratios, parts)
    report.add("styles_.*", paper_table.styles, parts)
    report.add(
        "(axis|static|cascade|replay)_.*|replay",
        paper_claims.table,
        parts,
    )
    names = "|".join(titles("cascade"))
    report.add(f"cascade_({names})", paper_cascade.table, parts)
    for number, (phase, what) in enumerate(zip(paper_table.PHASES, paper_table.PHASE_TITLES), 7):
        title = f"Fig. {number}. Time of {what}"
        caption = paper.static_caption(parts)
        name = f"paper_{what}"
        report.draw(r"static_\d+", name, title, caption, paper.static_figure, parts, phase)
    report.add(r"static_\d+", paper.static_table, parts)
    report.add("replay", paper.replay_table, parts.get("replay"))
    replay = partial(report.draw, "replay")
    title = "Fig. 10. Dynamic assembly"
    replay("paper_replay", title, paper.REPLAY, paper.replay_figure, parts.get("replay"))
    title = "Cascade verification"
    replay("paper_cages", title, paper.CAGES, paper.cages_figure, parts.get("replay"))
    for name, title in paper.AXES.items():
        if name in parts:
            report.add(name, frames.scene_table, frames.Scene(title, parts[name]))
            report.linked_by_none.add(report.blocks[-1].name)  # The claims have what it tells.
    for name, (title, draw) in paper_pictures.PICTURES.items():
        if "pictures" in parts:
            caption = paper_pictures.caption(parts["pictures"], name)
            image = paper_pictures.IN_DOCUMENTS.get(name, "")
            report.blocks.append(Figure(image, title, caption, partial(draw, folder, name)))
    if (folder / "topologies.png").exists():
        draw = (folder / "topologies.png").read_bytes
        report.blocks.append(Figure("topologies", "Fig. 5. Both trees", paper.TREES, draw))
    if (folder / "view.html").exists():
        html = (folder / "view.html").read_text(encoding="utf-8")
        report.blocks.append(Figure("", "To turn and to enter", paper.VIEW, html=html))
    return report


def python(folder):
    report = Report("python", "The Python package", folder)
    report.add("steps_.*", python_steps.steps, report.parts)
    report.add("overhead_.*|import", python_steps.costs, report.parts)
    return report


def card_of_managers(folder):
    report = Report("card", "FCL's managers and ours on the paper's scenes", folder)
    parts, double = report.parts, "card_.*_double"
    report.add(double, card.summary, parts)
    report.draw(double, "card", "Frames and segments", card.PICTURE, card.picture, parts)
    for scene in card.scenes():
        report.add(f"card_{scene}_.*", card.scene_table, scene, parts)
    return report


def gains_of_threads(folder):
    report = Report("threads", "What threads gain", folder)
    report.blocks += threads.tables(report.parts)
    kept = (threads.JOBS, threads.IN_DOCUMENTS)
    report.linked_by_none = {name for name in report.tables() if not name.startswith(kept)}
    return report


REPORTS = {
    **{"headline": headline, "full": full, "trade": trade_offs, "paper": paper_again},
    **{"python": python, "card": card_of_managers, "threads": gains_of_threads},
}


def write_page(report, path):
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    pages = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
    template = pages.get_template("page.html")
    text = template.render(report=report, circumstances=circumstances(report.parts))
    path.write_text(text, encoding="utf-8")


def write_documents(report, root):
    """Renews the marked tables and figures of the documents, the other tables in docs/measured, and
    the pictures, all of what was measured."""
    tables, main = report.tables(), {table.name: table for table in report.main}
    if " and " in told(report.parts, "machine"):
        raise ValueError(f"{report.folder} has results of several machines")
    marked = {
        m[2]: m[3] for path in documents(root) for m in MARK.finditer(path.read_text("utf-8"))
    }
    # One of which some scenes are missing would have the least of the others as that of all.
    main = {name: table for name, table in main.items() if not report.lacks(name)}
    for name in main.keys() - marked.keys():
        raise ValueError(f"no document has a mark for the table {name}")
    store = root / MEASURED / "machines.json"
    store.parent.mkdir(parents=True, exist_ok=True)
    known = machines.read(store)
    for name, table in main.items():
        source = report.source(name, marked[name])
        known[name] = machines.renewed(known, table, report.machine, source)
    if main:
        store.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")

    def renewed(mark):
        head, name, command, _, foot = mark.groups()
        if name in main:
            return f"{head}\n{machines.markdown(main[name], known[name], report.machine)}\n\n{foot}"
        if name in tables:
            return f"{head}\n{tables[name].markdown()}\n\n{report.source(name, command)}\n\n{foot}"
        return mark[0]

    alone = report.on_page_alone | report.linked_by_none | marked.keys()
    others = {name: table for name, table in tables.items() if name not in alone}

    command = "benchmarks/run.sh" + ("" if report.kind == "headline" else f" --{report.kind}")
    for name, table in others.items():
        text = table.csv(report.source(name, command))
        (root / MEASURED / file_of(name)).write_text(text, encoding="utf-8")
    for path in documents(root):
        path.write_text(MARK.sub(renewed, path.read_text(encoding="utf-8")), encoding="utf-8")
    figures.fill(root)
    for drawn in report.figures():
        if drawn.name:
            (root / "docs" / "images" / f"{drawn.name}.png").write_bytes(drawn.data)
    for front in report.folder.glob("trade_*.svg"):
        if front.stem in report.parts:
            shutil.copy(front, root / "docs" / "images")


def file_of(name):
    return re.sub(r"[^\w-]+", "_", name).strip("_") + ".csv"


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("set", choices=REPORTS)
    parser.add_argument("folder", type=Path, help="of the results")
    parser.add_argument("--page", type=Path, metavar="FILE.html")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="the first, if any")
    parser.add_argument("--docs", type=Path, metavar="ROOT", help="renews its tables and pictures")
    options = parser.parse_args(arguments)
    report = REPORTS[options.set](options.folder)
    mains = [table.table({report.machine: table.cells}) for table in report.main]
    shown = [t for name, t in report.tables().items() if name not in report.on_page_alone]
    for table in (*mains, *shown):
        print(f"## {table.title}\n\n{table.markdown()}\n\n{table.caption}\n")
    print(circumstances(report.parts))
    if report.missing:
        print(f"Not measured: {', '.join(report.missing)}.")
    if options.page:
        write_page(report, options.page)
    if options.picture and report.figures():
        options.picture.write_bytes(report.figures()[0].data)
    if options.docs:
        write_documents(report, options.docs)


if __name__ == "__main__":
    main(sys.argv[1:])
