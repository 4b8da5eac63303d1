# SPDX-License-Identifier: BSD-3-Clause
"""Tables of fibers in motion: what a step costs."""

from ratios import READ as READ_RATIOS
from ratios import median_of, ratio_of
from tables import Rows, Table, chosen, count, digits, time, title

READ = (
    "A step of the cap in the wind, named by its mean motion. Times are medians on one thread. "
    "Times of the static query or update are medians of the ratios of runs. Embree visits both "
    "orders of each pair. "
) + READ_RATIOS


class Motion:
    """What was measured of one motion."""

    def __init__(self, part):
        self.part = part

    def median(self, name, key):
        return self.part.median("Motion", name, key)

    def ours(self, key):
        return self.median("ours", key)

    def times(self, key, of):
        """Both are timed in each run."""
        return median_of(self.part.ratios("Motion", "ours", key, of)).text()

    def gain_of_2_threads(self):
        names = ("ours", "ours_2_threads")
        return ratio_of(*(self.part.runs("Motion", name, "query") for name in names)).text()

    def swept(self):
        """Names of the trees over boxes around both positions."""
        names = self.part.names("Motion")
        return [name for name in names if not name.startswith("ours")]

    def against(self, name):
        """How many times as fast as that tree ours is, update and query together."""
        theirs, ours = (self.part.runs("Motion", who, "seconds") for who in (name, "ours"))
        return ratio_of(theirs, ours, name)

    def against_the_fastest(self):
        """None of a motion for which swept boxes would take minutes."""
        found = [self.against(name) for name in self.swept()]
        return min(found, key=lambda ratio: ratio.value) if found else None

    def judged(self, key):
        return self.part.median("Judged", "impacts", key)

    def safe(self, key):
        return self.part.median("Safe", "step", key)


def motions_of(parts):
    """By radii, those that were measured."""
    return {int(radii): Motion(part) for radii, part in chosen(parts, "motion").items()}


def table(parts):
    found = motions_of(parts)
    rows = Rows(found.values())
    add = rows.add
    add("mean motion, in radii", lambda m: digits(m.ours("motion")))
    add("pairs that touch at the start", lambda m: count(m.ours("touching")))
    add("moving pairs", lambda m: count(m.ours("candidates")))
    add("impacts", lambda m: count(m.ours("impacts")))
    add("static query of touching pairs", lambda m: time(m.ours("static_query")))
    for key, what in (("moving_pairs_query", "moving pairs"), ("query", "impacts")):
        add(f"query of {what}", lambda m: time(m.ours(key)))
        times = f"query of {what}, times the static one"
        add(times, lambda m: m.times(key, "static_query"))
    what = "query of impacts on 2 threads, times as fast"
    add(what, lambda m: m.gain_of_2_threads())
    add("static update", lambda m: time(m.ours("static_update")))
    add("update for a step", lambda m: time(m.ours("update")))
    add("update, times the static one", lambda m: m.times("update", "static_update"))
    add("bytes per segment", lambda m: digits(m.ours("bytes") / m.ours("segments")))
    for name in dict.fromkeys(name for motion in found.values() for name in motion.swept()):

        def add_swept(what, value):
            add(f"{title(name)}: {what}", lambda m: value(m) if name in m.swept() else "-")

        add_swept("pairs of boxes", lambda m: count(m.median(name, "candidates")))
        add_swept("update and impacts", lambda m: time(m.median(name, "seconds")))
        add_swept("ours", lambda m: m.against(name).text())
    add("judged: impacts", lambda m: count(m.judged("touching")))
    add("judged: missed", lambda m: count(m.judged("missed")))
    add("judged: widest gap at an impact, in radii", lambda m: f"{m.judged('widest_gap'):.0e}")
    add("safe step: radius, of the scene's", lambda m: digits(m.safe("radius"), 2))
    add("safe step: fraction", lambda m: f"{m.safe('fraction'):.3g}")
    add("safe step: time", lambda m: time(m.safe("seconds")))
    add("safe step: time of all impacts", lambda m: time(m.safe("query")))
    header = ["", *(f"{radii} radii" for radii in found)]
    return Table("motion", "Motion", header, rows, READ)
