# SPDX-License-Identifier: BSD-3-Clause
"""Makes tables and a page of what benchmarks/run.sh has measured.

What was not run is named as not measured. Anything else that is missing is an error.
"""

import argparse
import base64
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
import frames
import live
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
import targets
import threads
import trade
from results import circumstances, load
from tables import MARK, Table, count, digits, documents, time

# Tables that documents have, by the first word of their names. The others are on the page alone.
DOCUMENTED = {
    "headline": ("headline",),
    "full": (
        *("ratios", "best", "scene", "elsewhere", "clients", "changes", "candidates"),
        *("beside", "fibers-of", "one-by-one", "arms"),
        *("arrays", "growth", "obstacles", "obstacle-counts"),
        *("motion", "live", "live-counts"),
    ),
    "trade": (
        *("trade-dials", "trade", "costs", "unused", "skins"),
        *("narrow", "narrow-errors", "narrow-kinds"),
    ),
    "paper": (
        "table-1",
        "table-1-hard",
        "table-1-ratios",
        "paper-styles",
        "paper-static",
        "paper-replay",
        "paper-claims",
        "paper-cascade",
        "paper-volumes",
    ),
    "python": ("python-steps", "python-costs"),
    "card": ("card", "card-scene"),
    "threads": ("threads",),
}
BARS = "Bars are medians. Lines reach from the lowest run to the highest."


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

    def __init__(self, kind, title, folder, wanted):
        """`wanted`: the files of the set's measures, a regex each, by what is measured."""
        self.kind, self.title, self.folder = kind, title, folder
        self.parts = load(folder, "|".join([*wanted.values(), "frames_hair"]))
        self.missing = [what for what, files in wanted.items() if not self.has(files)]
        self.blocks = []

    def has(self, files):
        return any(re.fullmatch(files, name) for name in self.parts)

    def add(self, files, make, *arguments):
        """A table of such files, if there are any."""
        if self.has(files):
            self.blocks.append(make(*arguments))

    def draw(self, files, name, title, caption, make, *arguments):
        """Likewise a figure."""
        if self.has(files):
            self.blocks.append(Figure(name, title, caption, partial(make, *arguments)))

    def tables(self):
        return {block.name: block for block in self.blocks if isinstance(block, Table)}

    def figures(self):
        return [block for block in self.blocks if isinstance(block, Figure)]

    def documented(self):
        """Of several scenes each one's table."""
        words = DOCUMENTED[self.kind]
        return {name: t for name, t in self.tables().items() if name.split()[0] in words}


def files_of(kind, scenes):
    return {f"{kind} of {scene}": f"{kind}_{scene}" for scene in scenes}


def speed(kind, folder, with_targets=False):
    """The sets headline and full."""
    if kind == "headline":
        report = Report(kind, "The headline", folder, files_of("frames", frames.HEADLINE))
    else:
        wanted = files_of("frames", frames.FULL)
        wanted |= {"queries": "queries", "clients": "clients", "shapes": "shapes", "arms": "arms"}
        wanted |= files_of("arrays", arrays.SCENES) | {"growth": "growth"}
        wanted |= files_of("obstacles", obstacles.SCENES)
        wanted |= {f"motion by {radii} radii": f"motion_{radii}" for radii in motion.MOTIONS}
        wanted |= {f"pairs that live of {scene}": f"live_{scene}" for scene in live.SCENES}
        wanted |= {"safe distances": "safe-distances"}
        report = Report(kind, "All figures", folder, wanted)
    scenes, parts = frames.scenes_of(report.parts), report.parts
    if kind == "headline":
        report.add("frames_.*", frames.headline, scenes)
    report.add("frames_.*", frames.all_ratios, scenes)
    report.add("frames_.*", frames.best, scenes)
    picture = "headline" if kind == "headline" else ""
    report.draw("frames_.*", picture, "Time of a frame", BARS, pictures.headline, scenes)
    if with_targets:
        report.add("frames_.*", targets.of_frames, scenes, parts.get("growth"))
        found = [parts.get(name) for name in ("queries", "clients")]
        report.add("queries|clients", targets.of_managers, *found)
        report.add("shapes", targets.of_shapes, parts.get("shapes"))
        report.add("arms", targets.of_arms, parts.get("arms"))
        report.add("arrays_.*", targets.of_arrays, parts)
        report.add("obstacles_.*", targets.of_obstacles, parts)
        report.add(r"motion_\d+", targets.of_motion, parts)
        report.add("live_.*", targets.of_live, parts)
    for name, scene in scenes.items():
        report.add(f"frames_{name}", frames.scene_table, scene, kind == "headline")
        report.add(f"frames_{name}", frames.tried, scene)
    report.add("queries", elsewhere.elsewhere, parts.get("queries"))
    report.add("clients", elsewhere.clients, parts.get("clients"))
    report.add("clients", elsewhere.changes, parts.get("clients"))
    report.add("queries", elsewhere.candidates, parts.get("queries"))
    for table in (shapes.beside, shapes.fibers_of, shapes.one_by_one):
        report.add("shapes", table, parts.get("shapes"))
    report.add("arms", arms.arms, parts.get("arms"))
    report.add("arrays_.*", arrays.table, parts)
    report.add("growth", frames.growth, parts.get("growth"))
    report.add("obstacles_.*", obstacles.table, parts)
    report.add("obstacles_(cap|combed)", obstacles.counts, parts)
    report.add(r"motion_\d+", motion.table, parts)
    report.add("live_.*", live.table, parts)
    report.add("live_.*", live.counts, parts)
    report.add("safe-distances", live.safe_distances, parts.get("safe-distances"))
    return report


def trade_offs(folder):
    wanted = files_of("trade", trade.SCENES) | {"costs": "costs", "unused features": "unused"}
    wanted |= {"skins of pairs that live": "skins"}
    wanted |= {"narrow phases": "narrow", "narrow phases of paper-static": "narrow_paper-static"}
    report = Report("trade", "What accuracy costs", folder, wanted)
    parts = report.parts
    report.add("trade_.*", trade.dials, parts)
    for name in trade.SCENES:
        report.add(f"trade_{name}", trade.scene_table, name, parts.get(f"trade_{name}"))
    report.add("skins", live.skins, parts.get("skins"))
    report.add("costs", trade.costs, parts.get("costs"))
    report.add("unused", trade.unused, parts.get("unused"))
    hair = parts.get("narrow")
    report.add("narrow", narrow.narrow, hair, parts.get("narrow_paper-static"))
    report.add("narrow", narrow.errors, hair)
    report.add("narrow", narrow.kinds, hair)
    title = "Error against time"
    report.draw("narrow", "trade_narrow", title, narrow.PICTURE, narrow.figure, hair)
    return report


def paper_again(folder):
    names = ("radii", "rods", "axis_turned_0", "axis_turned_1", "pictures", "chain-claims")
    names += tuple(paper_claims.REPLAYS)
    wanted = {name: name for name in names}
    wanted |= {"static assembly": r"static_\d+", "chains": r"chain_(random|snake)_\d+"}
    wanted |= {f"table of {name}": f"table_{name}" for name in paper_table.SCENES}
    wanted |= {f"volume tests of {name}": f"tests_{name}" for name in paper_table.SCENES}
    wanted |= {f"slow tree {name}": f"long_{name}" for name in paper_table.SLOW}
    wanted |= {f"volumes of {name}": f"volumes_{name}" for name in paper_claims.VOLUME_SCENES}
    wanted |= {f"style {name}": f"styles_{name}" for name in paper_table.STYLES}
    wanted |= {f"cages of {name}": f"cascade_{name}" for name in paper_cascade.SCENES}
    wanted |= {"sizes of cages": r"cascade_static_\d+"}
    report = Report("paper", "The paper's measurements, again", folder, wanted)
    parts = report.parts
    if "frames_hair" in parts:
        parts["table_hair"] = parts["frames_hair"]
    for hard in (False, True):
        ours = [name for name, scene in paper_table.SCENES.items() if scene.hard == hard]
        ours += [] if hard else ["hair"]
        report.add(f"table_({'|'.join(ours)})", paper_table.table_one, parts, hard)
    report.add("table_(?!hair).*", paper_table.ratios, parts)
    report.add("styles_.*", paper_table.styles, parts)
    report.add(
        "(chain|axis|static|cascade|replay|volumes)_.*|radii|replay|chain-claims",
        paper_claims.table,
        parts,
    )
    report.add(f"cascade_({'|'.join(paper_cascade.SCENES)})", paper_cascade.table, parts)
    report.add("volumes_.*", paper_claims.volumes, parts)
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
    title = "One chain against itself"
    report.draw("chain_.*", "paper_chains", title, paper.CHAINS, paper.chain_figure, parts)
    columns = {"height": count, "layered": digits, "wrapped": digits, "largest_of_bound": digits}
    title = "Radii of layered and wrapped spheres"
    report.add("radii", paper.medians, parts.get("radii"), "Radii", title, columns, paper.RADII)
    columns = {"seconds": time, "iterations": count}
    title = "One hair, bent half way to the loop"
    report.add("rods", paper.medians, parts.get("rods"), "Rod", title, columns, paper.RODS)
    columns = {"fibers": count, "segments": count, "seconds": time}
    title = "Making a scene, every rod in equilibrium"
    report.add("rods", paper.medians, parts.get("rods"), "Make", title, columns)
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


def python(folder, with_targets=False):
    wanted = files_of("steps", python_steps.SCENES)
    wanted |= files_of("overhead", python_steps.LARGE) | {"import": "import"}
    report = Report("python", "The Python package", folder, wanted)
    report.add("steps_.*", python_steps.steps, report.parts)
    report.add("overhead_.*|import", python_steps.costs, report.parts)
    if with_targets:
        report.blocks.append(targets.of_python(report.parts))
    return report


def card_of_managers(folder):
    wanted = {
        f"{scene} in {scalar}": f"card_{scene}_{scalar}"
        for scene in card.SCENES
        for scalar in card.SCALARS
    }
    report = Report("card", "FCL's managers and ours on the paper's scenes", folder, wanted)
    parts, double = report.parts, "card_.*_double"
    report.add(double, card.summary, parts)
    report.draw(double, "card", "Frames and segments", card.PICTURE, card.picture, parts)
    for scene in card.SCENES:
        report.add(f"card_{scene}_.*", card.scene_table, scene, parts)
    return report


def gains_of_threads(folder):
    wanted = files_of("threads", threads.SCENES)
    report = Report("threads", "What threads gain", folder, wanted)
    report.blocks += threads.tables(report.parts)
    return report


def write_page(report, path):
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    pages = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
    template = pages.get_template("page.html")
    text = template.render(report=report, circumstances=circumstances(report.parts))
    path.write_text(text, encoding="utf-8")


def write_documents(report, root):
    """Replaces the marked tables and the pictures of what was measured of this set."""
    tables = report.documented()
    due = set(tables)
    known = {word: kind for kind, words in DOCUMENTED.items() for word in words}

    def renewed(mark):
        head, name, command, _, foot = mark.groups()
        if known[name.split()[0]] != report.kind:
            return mark[0]
        if report.missing and name not in tables:
            return mark[0]  # of what was not measured
        due.remove(name)  # a second one is an error
        source = f"`{command}`, {circumstances(report.parts)}"
        return f"{head}\n{tables[name].markdown()}\n\n{source}\n\n{foot}"

    for path in documents(root):
        path.write_text(MARK.sub(renewed, path.read_text(encoding="utf-8")), encoding="utf-8")
    if due:
        raise ValueError(f"no document has a mark for {', '.join(sorted(due))}")
    for figure in report.figures():
        if figure.name:
            (root / "docs" / "images" / f"{figure.name}.png").write_bytes(figure.data)
    for front in report.folder.glob("trade_*.svg"):
        if front.stem in report.parts:
            shutil.copy(front, root / "docs" / "images")


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("set", choices=DOCUMENTED)
    parser.add_argument("folder", type=Path, help="of the results")
    parser.add_argument("--page", type=Path, metavar="FILE.html")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="the first, if any")
    parser.add_argument("--docs", type=Path, metavar="ROOT", help="renews its tables and pictures")
    parser.add_argument("--targets", action="store_true", help="full, python: met and missed")
    options = parser.parse_args(arguments)
    if options.set in ("headline", "full"):
        report = speed(options.set, options.folder, options.targets)
    elif options.set == "python":
        report = python(options.folder, options.targets)
    else:
        sets = {"trade": trade_offs, "paper": paper_again, "card": card_of_managers}
        sets["threads"] = gains_of_threads
        report = sets[options.set](options.folder)
    shown = report.documented()
    if options.targets:
        found = report.tables().items()
        shown |= {name: table for name, table in found if name.startswith("targets")}
    for table in shown.values():
        print(f"## {table.title}\n\n{table.markdown()}\n\n{table.caption}\n")
    print(circumstances(report.parts))
    if report.missing:
        print(f"Not measured: {'; '.join(report.missing)}.")
    if options.page:
        write_page(report, options.page)
    if options.picture and report.figures():
        options.picture.write_bytes(report.figures()[0].data)
    if options.docs:
        write_documents(report, options.docs)


if __name__ == "__main__":
    main(sys.argv[1:])
