# SPDX-License-Identifier: BSD-3-Clause
"""Tables of pairs that live: what a step costs with a list of them, and what was listed."""

from measured_sets import titles
from ratios import Ratio, median_of
from tables import Table, chosen, count, digits, percent, time

KINDS = {"helix-objects": "LiveObjects"}  # of runs; Live of the others
MOTIONS = ("slow", "fast", "weather", "creeping", "frames")
READ = (
    "A step is an update and a query that counts, on one thread. Both find the same pairs in every "
    "step and take turns in one run. Times as fast is the median of the ratios of steps, with the "
    "ranks of a 95 % interval. All steps include the set-up. The loop reads the points and writes "
    "displacements. Motions are those of a step, in radii."
)
SKINS_READ = (
    "Times as fast as without a list: all steps, each an update and a query on one thread, and the "
    "set-up. All find the pairs of a search in every step."
)
COUNTS_READ = (
    "Uncovered are the pairs a segment that were tested in a step although not listed. In vain are "
    "the pairs that were tested and did not touch. Bytes are those of the list, beside the tree."
)


class Run:
    """What was measured of one motion of one scene."""

    def __init__(self, part, scene, motion):
        self.part, self.scene, self.motion = part, scene, motion
        self.kind = KINDS.get(scene, "Live")
        self.title = f"{titles('live')[scene]}, {count(self.get('segments'))} segments, {motion}"

    def get(self, key):
        return self.part.median(self.kind, self.motion, key)

    def times(self, key, reference):
        """Of runs, each of which has taken both times."""
        return median_of(self.part.ratios(self.kind, self.motion, key, reference))

    def step(self):
        """How many times as fast a step is: the median of all, and their interval."""
        return Ratio(*(self.get(f"ratio{end}") for end in ("", "_low", "_high")))

    def whole(self):
        """How many times as fast all steps are, with the set-up."""
        return self.times("without_total", "with_total")

    def longest(self):
        """The longest step, times the median one without."""
        return self.times("with_longest", "without_step")

    def times_the_loop(self):
        return self.times("with_step", "loop")

    def of_segment(self, key):
        return self.get(key) / self.get("segments")


def runs_of(parts):
    scenes = chosen(parts, "live", titles("live"))
    return [
        Run(part, scene, motion)
        for scene, part in scenes.items()
        for motion in MOTIONS
        if part.has(KINDS.get(scene, "Live"), motion)
    ]


def table(parts):
    header = ["scene and motion", "mean motion", "largest", "step without", "with"]
    header += ["times as fast", "all steps", "longest step, times one without", "times the loop"]
    rows = []
    for run in runs_of(parts):
        row = [run.title, digits(run.get("motion"), 2), digits(run.get("largest_motion"), 2)]
        row += [time(run.get("without_step")), time(run.get("with_step"))]
        ratios = (run.whole(), run.longest(), run.times_the_loop())
        rows.append([*row, run.step().text(), *(ratio.text() for ratio in ratios)])
    return Table("live", "Pairs that live", header, rows, READ)


def counts(parts):
    header = ["scene and motion", "touching pairs a segment", "skin at the end, in radii", "steps"]
    header += ["listings", "longest life", "uncovered", "in vain", "bytes a segment"]
    rows = []
    for run in runs_of(parts):
        if run.kind != "Live":
            continue  # a manager does not tell
        row = [run.title, digits(run.of_segment("touching"), 2), digits(run.get("skin"), 2)]
        row += [count(run.get(key)) for key in ("steps", "listings", "longest_life")]
        row.append(digits(run.of_segment("uncovered"), 2))
        tested, found = run.get("tested"), run.get("tested_touching")
        row.append(percent(tested - found, tested) if tested else "-")
        rows.append([*row, digits(run.of_segment("bytes"), 2)])
    return Table("live-counts", "Pairs that live, what is listed", header, rows, COUNTS_READ)


def safe_distances(part):
    """From a list that lives, after each update."""
    header = ["motion", "segments", "update", "safe distances", "mean distance, in radii"]
    rows = []
    for motion in part.names("SafeDistances"):
        keys = ("segments", "update", "safe", "distance")
        segments, update, safe, distance = part.medians("SafeDistances", motion, *keys)
        rows.append([motion, count(segments), time(update), time(safe), digits(distance, 2)])
    return Table("safe-distances", "How far each point may move", header, rows)


def skins(part):
    """The dial against time, bytes and motion."""
    header = ["motion of a step, skin", "times as fast", "bytes a segment"]
    header += ["listings in 100 steps", "skin at the end, in radii"]
    rows = []
    names = [name.split("/") for name in part.names("LiveSkins")]
    ordered = sorted({skin for skin, _ in names}, key=lambda skin: (skin == "chosen", skin))
    for motion in MOTIONS:
        for skin in ordered:
            name = f"{skin}/{motion}"
            if not part.has("LiveSkins", name):
                continue
            keys = ("motion", "steps", "segments", "bytes", "listings", "skin")
            moved, steps, segments, held, listings, at_end = part.medians("LiveSkins", name, *keys)
            what = "chosen" if skin == "chosen" else f"{skin} radii"
            ratio = median_of(part.ratios("LiveSkins", name, "without_total", "with_total"))
            row = [f"{digits(moved, 2)} radii, {what}", ratio.text()]
            row += [digits(held / segments, 2), count(100 * listings / steps), digits(at_end, 2)]
            rows.append(row)
    return Table("skins", "The skin", header, rows, SKINS_READ)
