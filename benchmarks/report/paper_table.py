# SPDX-License-Identifier: BSD-3-Clause
"""Table I of the paper once more, ratios of its numbers, and what order and style cost."""

from dataclasses import dataclass

from measured_sets import titles
from paper_pictures import FCL_TREE
from tables import Rows, Table, chosen, count, digits, time

PHASES = ("set_up", "update", "detection")
PHASE_TITLES = ["construction", "update", "detection"]


@dataclass
class Scene:
    title: str
    paper: str = ""  # its case in PAPER
    hard: bool = False  # for the paper's tree; else as the paper may have made it


# Table I and section 4.1 of the paper, Pentium IV 2.4 GHz: seconds by phase, and collisions.
PAPER = {
    "half scalp": {
        "spheres": (4.609, 1924.74, 1984.78, 550_000),
        "boxes": (4.109, 0.766, 100.531, 550_000),
    },
    "strand of 1,000": {
        "spheres": (2.907, 91.923, 15.282, 23_000),
        "boxes": (2.781, 0.281, 1.688, 23_000),
    },
    "strand of 2,000": {"boxes": (None, 0.6, 4.3, 80_000)},
}
SCENES = {
    "half-scalp-wisps": Scene("half scalp in wisps", "half scalp"),
    "half-scalp": Scene("half scalp", "half scalp", hard=True),
    "strand-loose-1000": Scene("loose strand of 1,000", "strand of 1,000"),
    "strand-1000": Scene("strand of 1,000", "strand of 1,000", hard=True),
    "strand-loose-2000": Scene("loose strand of 2,000", "strand of 2,000"),
    "strand-2000": Scene("strand of 2,000", "strand of 2,000", hard=True),
}
PUBLISHED = {"boxes": "LayeredAABBTree/super_thread", "spheres": "WrappedSphereTree/super_thread"}
DEFAULT = {"boxes": "LayeredAABBTree/boxes", "spheres": "WrappedSphereTree/spheres"}
BEST = "FCL's best, all pairs"
CONTENDERS = {
    "spheres, as published": PUBLISHED["spheres"],
    "boxes, as published": PUBLISHED["boxes"],
    "spheres, by default": DEFAULT["spheres"],
    "boxes, by default": DEFAULT["boxes"],
    BEST: None,
}
NONE = "not given"
SLOW = ("half-scalp-wisps_WrappedSphereTree", "half-scalp_LayeredAABBTree")


def millions(tests):
    return f"{digits(tests / 1e6)} M"


def is_known(counters, phase):
    """False of a phase that was not reached, or took no time because it was not asked for."""
    return phase in counters and (counters[phase] > 0).all()


class Cells:
    """What is known of one contender on one scene, or of FCL's trees together."""

    def __init__(self, parts, scene, name):
        slow = [part for key, part in parts.items() if key.startswith(f"long_{scene}_")]
        self.parts, self.tests = [parts[f"table_{scene}"], *slow], parts.get(f"tests_{scene}")
        checked = [name for part in self.parts for name in part.names("Checked")]
        trees = [name for name in dict.fromkeys(checked) if name.split("/")[0] in FCL_TREE]
        self.names = [name] if name else trees
        self.is_fcl = name is None

    def fastest(self, phase):
        """Seconds, whether of a single time, and whose: the least of the medians if there are.

        Of the first file that knows the phase: what was measured twice is no better for it.
        """
        for kind in ("Frames", "Checked"):
            for part in self.parts:
                names = [n for n in self.names if part.has(kind, n)]
                known = [n for n in names if is_known(part.counters(kind, n), phase)]
                if known:
                    found = {part.median(kind, name, phase): name for name in known}
                    return min(found), kind == "Checked", found[min(found)]
        return None, False, None

    def seconds(self, phase):
        """Those that are known, or an estimate; and whether they are one."""
        seconds = self.fastest(phase)[0]
        if seconds is None and phase == "detection":
            seconds = self.estimated_detection()
            return seconds, seconds is not None
        return seconds, False

    def volume_tests(self):
        """The number; and if it is an estimate, those that were made, and its relative error."""
        if self.tests is None:
            return None
        name = self.fastest("detection")[2] if self.is_fcl else self.names[0]
        if name is None or not self.tests.has("VolumeTests", name):
            return None
        number, share = self.tests.medians("VolumeTests", name, "volume_tests", "share")
        estimate = self.tests.medians("VolumeTests", name, "made", "error") if share < 1 else None
        return number, estimate

    def time_text(self, phase):
        seconds, is_single, _ = self.fastest(phase)
        if seconds is not None:
            return ("~" if is_single else "") + time(seconds)
        notes = [p.note(n) for p in self.parts for n in self.names if p.has("Checked", n)]
        estimate = self.estimated_detection() if phase == "detection" else None
        return (notes or ["-"])[-1] + (f"; about {time(estimate)}" if estimate else "")

    def estimated_detection(self):
        """From the part of the traversal that was gone through."""
        if self.tests is None or not self.tests.has("VolumeTests", self.names[0]):
            return None
        return self.tests.median("VolumeTests", self.names[0], "traversal")

    def tests_text(self):
        tests = self.volume_tests()
        if tests is None:
            return "-"
        number, estimate = tests
        if estimate is None:
            return millions(number)
        made, error = estimate
        return f"about {millions(number)} +- {100 * error:.1g} % ({millions(made)} made)"

    def bytes(self):
        known = [(p, n) for p in self.parts for n in self.names if p.has("Checked", n)]
        known = [p.counters("Checked", n) for p, n in known]
        return next((c["bytes_stated"].iloc[0] for c in known if "bytes_stated" in c), None)

    def counts(self):
        """Pairs and touching pairs, as the check has found them; None if it was ended."""
        for key in ("pairs", "touching"):
            known = [
                part.median("Checked", name, key)
                for part in self.parts
                for name in self.names
                if part.has("Checked", name) and not part.note(name)
            ]
            yield known[0] if known else None


def scenes_of(parts):
    found = {key: SCENES[key] for key in chosen(parts, "table", SCENES)}
    if "table_hair" in parts:
        found["hair"] = Scene(parts["table_hair"].title("hair"))
    return found


def rows_of(parts, key, scene):
    rows = []
    for volume, (*seconds, collisions) in PAPER.get(scene.paper, {}).items():
        cells = [NONE if value is None else time(value) for value in seconds]
        name = f"{scene.title}: the paper's {volume}"
        rows.append([name, *cells, NONE, NONE, count(collisions)])
    for title, name in CONTENDERS.items():
        cells = Cells(parts, key, name)
        times = [cells.time_text(phase) for phase in PHASES]
        counts = ["-" if number is None else count(number) for number in cells.counts()]
        rows.append([f"{scene.title}: {title}", *times, cells.tests_text(), *counts])
    return rows


def table_one(parts, hard):
    """Of the scenes as the paper may have made them, or of those that are hard for its tree."""
    rows = []
    for key, scene in scenes_of(parts).items():
        if scene.hard == hard:
            rows += rows_of(parts, key, scene)
    title = "Table I, scenes that are hard for the published tree" if hard else "Table I"
    caption = (
        "The paper's times are of a Pentium IV, 2.4 GHz, the others of one thread here. 'As "
        "published' is the paper's tree, 'by default' is the bundle. FCL's best is the form and "
        "level of its dynamic tree, on tight boxes, that is fastest in the phase; its volume tests "
        "are those of the one that is fastest in detection. ~ marks a single time, 'about' an "
        "estimate from a random sample of the traversal. All except FCL leave out adjacent "
        "segments. The paper's number of collisions stands under touching."
    )
    header = ["", *PHASE_TITLES, "volume tests", "pairs", "touching"]
    return Table("table-1-hard" if hard else "table-1", title, header, rows, caption)


def quotient(a, b, is_estimate=False):
    if not a or not b:
        return "-"
    return "about " * is_estimate + digits(a / b, 2)


def paper_seconds(case, volume, phase):
    return PAPER[case].get(volume, (None,) * 4)[PHASES.index(phase)]


def ratios(parts):
    """What each number is divided by, for the paper and for both of our scenes."""
    scenes = scenes_of(parts)
    columns = {}  # by title: our scene if it is one of ours, and the paper's case
    for case in [case for case in PAPER if any(s.paper == case for s in scenes.values())]:
        if "spheres" in PAPER[case]:  # else it has nothing to compare
            columns[f"the paper's {case}"] = None, case
        columns |= {s.title: (key, case) for key, s in scenes.items() if s.paper == case}

    def cells(key, which):
        kind, volume = which
        contender = {"published": PUBLISHED, "default": DEFAULT}[kind].get(volume)
        return Cells(parts, key, contender)

    def seconds(key, case, which, phase):
        if key:
            return cells(key, which).seconds(phase)
        known = which[0] == "published"
        return paper_seconds(case, which[1], phase) if known else None, False

    def tests(key, which):
        found = key and cells(key, which).volume_tests()
        return found[0] if found else None

    spheres, boxes = ("published", "spheres"), ("published", "boxes")
    rows = Rows(columns.values())

    def add(title, one, other):
        for phase, what in zip(PHASES, PHASE_TITLES):

            def of_seconds(column):
                (a, is_estimate), (b, is_another) = (
                    seconds(*column, which, phase) for which in (one, other)
                )
                return quotient(a, b, is_estimate or is_another)

            rows.add(f"{title}: {what}", of_seconds)
        rows.add(f"{title}: volume tests", lambda c: quotient(tests(c[0], one), tests(c[0], other)))

    def add_of_spheres(what, number):
        def of_both(column):
            key = column[0]
            return quotient(*(number(cells(key, of)) for of in (spheres, boxes))) if key else "-"

        rows.add(f"Spheres / boxes, as published: {what}", of_both)

    add("Spheres / boxes, as published", spheres, boxes)
    add_of_spheres("pairs", lambda of: next(of.counts()))
    add_of_spheres("bytes of the tree", Cells.bytes)
    for phase, what in zip(PHASES, PHASE_TITLES):

        def of_the_papers(column):
            key, case = column
            papers = paper_seconds(case, "boxes", phase)
            return quotient(papers, *seconds(key, case, boxes, phase)) if key else "1"

        rows.add(f"The paper's boxes / ours as published: {what}", of_the_papers)
    add("As published / by default, boxes", boxes, ("default", "boxes"))
    add("As published, boxes / FCL's best", boxes, ("default", None))
    add("FCL's best / boxes by default", ("default", None), ("default", "boxes"))

    def add_time_of_a_test(whose, spent):
        for which in (spheres, boxes):

            def nanoseconds(column):
                value, is_estimate = spent(column, which)
                text = quotient(value and 1e9 * value, tests(column[0], which), is_estimate)
                return text if text == "-" else f"{text} ns"

            rows.add(f"{whose} detection with {which[1]} / our volume tests", nanoseconds)

    add_time_of_a_test("The paper's", lambda c, of: (paper_seconds(c[1], of[1], PHASES[2]), False))
    add_time_of_a_test("Our", lambda c, of: seconds(*c, of, PHASES[2]))
    caption = (
        "Quotients of the numbers of Table I, which are medians, and so without intervals. Above 1 "
        "the second is faster, or makes fewer tests. "
        "'The paper's detection / our volume tests' is the time that a Pentium IV had for a test "
        "if the paper's scene was ours."
    )
    return Table("table-1-ratios", "Ratios", ["", *columns], rows, caption)


def styles(parts):
    """What order, length, style and turn cost the published boxes."""
    rows = []
    names = titles("styles")
    for key, part in chosen(parts, "styles", names).items():
        case = "half scalp" if key.startswith("scalp") else "strand of 1,000"
        touching = part.median("VolumeTests", "LayeredAABBTree/capsules", "touching")
        keys = ("volume_tests", "share")
        published, share = part.medians("VolumeTests", PUBLISHED["boxes"], *keys)
        default, share_of_default = part.medians("VolumeTests", DEFAULT["boxes"], *keys)
        nanoseconds = 1e9 * PAPER[case]["boxes"][2] / published
        rows.append(
            [
                f"{case}: {names[key]}",
                count(touching),
                ("~" if share < 1 else "") + millions(published),
                ("~" if share_of_default < 1 else "") + millions(default),
                digits(published / default, 2),
                f"{digits(nanoseconds, 2)} ns",
            ]
        )
    header = ["", "touching", "tests, published", "tests, default", "ratio", "time on a Pentium IV"]
    caption = (
        "Tests of two boxes in a self query. ~ marks an estimate from a random sample of the "
        "traversal, whose standard error is below 1 %. The last column is the paper's time of "
        "detection, divided by the tests of the published tree."
    )
    return Table("paper-styles", "Order, length and style", header, rows, caption)
