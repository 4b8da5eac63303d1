# SPDX-License-Identifier: BSD-3-Clause
"""Tables of fibers and triangle meshes: speed, and what was found."""

from dataclasses import dataclass

import ratios
from ratios import Ratio, ratio_of
from tables import Table, chosen, count, digits, time, title

HAIR = ("cap", "combed")
SETS = ("all segments", "without roots")
READ = "Times are medians on one thread. " + ratios.READ


@dataclass
class Row:
    what: str
    ours: float
    other: float
    which: str
    ratio: Ratio
    faster: bool  # whether the ratio is how many times as fast ours is, not as long

    def cells(self):
        times = [time(self.ours), time(self.other)]
        found = self.ratio.text() if self.faster else f"{self.times()} {self.spread()}"
        return [self.what, *times, self.which, found]

    def times(self):
        return digits(self.ratio.value, 2) + " times"

    def spread(self):
        return f"({digits(self.ratio.low, 2)} to {digits(self.ratio.high, 2)})"


def speed_up(what, part, ours, others):
    """Against the fastest of the others; each is a kind and a name."""
    best = min(others, key=lambda name: part.median(*name, "seconds"))
    runs = [part.runs(*name, "seconds") for name in (ours, best)]
    ratio = ratio_of(*reversed(runs), best[1])
    which = title(best[1].split("/")[-1] if best[0] == "Boxes" else best[1])
    return Row(what, runs[0].median(), runs[1].median(), which, ratio, True)


def times(what, part, ours, reference, key, which):
    """How many times as long as `key` of the reference."""
    runs = part.runs(*ours, "seconds"), part.runs(*reference, key)
    return Row(what, runs[0].median(), runs[1].median(), which, ratio_of(*runs, which), False)


def fcl_of(part, kind, start=""):
    names = part.names(kind)
    return [(kind, name) for name in names if name.startswith(f"{start}DynamicAABBTree")]


def hair_rows(scene, part):
    rows = []
    for of in SETS:
        before = f"{scene}, {of}: "
        touching, fcl = ("Touching", f"{of}/arrays"), fcl_of(part, "Touching", f"{of}/")
        for who, how in (("arrays", "by arrays"), ("manager", "by the manager")):
            row = speed_up(before + how, part, ("Touching", f"{of}/{who}"), fcl)
            row.which = row.which.replace(f"{of}, ", "") + ", fcl::collide"
            rows.append(row)
        turned = ("Touching", f"{of}/turned")
        rows.append(times(before + "head turned", part, turned, touching, "seconds", "not turned"))
        contacts = ("Contacts", of)
        which = "touching segments"
        rows.append(times(before + "contacts", part, contacts, touching, "seconds", which))
    ours, others = ("Boxes", "ours"), [("Boxes", n) for n in part.names("Boxes") if n != "ours"]
    if others:
        rows.append(speed_up(f"{scene}: candidates alone", part, ours, others))
    refit = ("Refit", "mesh")
    rows.append(times(f"{scene}: refit", part, refit, refit, "loop", "a loop that writes boxes"))
    return rows


def rows_of(parts):
    rows = []
    for scene, part in chosen(parts, "obstacles", HAIR).items():
        rows += hair_rows(scene, part)
    for part in chosen(parts, "obstacles", ("cables",)).values():
        for who, how in (("arrays", "by arrays of FiberTree"), ("manager", "by the manager")):
            what = f"cables, least distance, {how}"
            row = speed_up(what, part, ("Distance", who), fcl_of(part, "Distance"))
            row.which += ", fcl::distance"
            rows.append(row)
    return rows


def table(parts):
    header = ["", "ours", "the other", "which other", "speed-up, or times as long"]
    rows = [row.cells() for row in rows_of(parts)]
    return Table("obstacles", "Obstacles", header, rows, READ)


def counts(parts):
    """What was found, and what FCL finds that is wrong."""
    rows = []
    for scene, part in chosen(parts, "obstacles", HAIR).items():
        for of in SETS:
            keys = ("segments", "triangles", "touching", "missed", "extra", "undecided")
            found = dict(zip(keys, part.medians("Judged", of, *keys)))
            fcls = fcl_of(part, "Touching", f"{of}/")
            heads = sorted(fcls, key=lambda name: "_pieces" in name[1])  # the whole one first
            fcl = [part.median(*name, "pairs") for name in heads]
            boxes = part.median("Boxes", "ours", "pairs")
            contacts = part.median("Contacts", of, "contacts")
            numbers = [*fcl, boxes, found["touching"], contacts]
            numbers += [found[key] for key in ("missed", "extra", "undecided")]
            rows.append([f"{scene}, {of}", *map(count, numbers)])
    header = [
        "",
        "FCL's pairs of segment and whole head",
        "of segment and piece, without those of a segment that touches one",
        "pairs of segment and triangle, by boxes",
    ]
    header += [
        "touching segments",
        "contacts",
        "missed by FCL",
        "FCL's that are apart",
        "undecided",
    ]
    caption = (
        "A judge that takes all triangles decides where FCL and ours differ. Undecided are 1e-9 of "
        "a radius or less from touching."
    )
    return Table("obstacle-counts", "What touches the head", header, rows, caption)
