# SPDX-License-Identifier: BSD-3-Clause
"""Tables of objects that are no capsules of fibers, and of objects that come and go one by one."""

import pandas as pd

from elsewhere import grouped
from ratios import BOXES, CAPSULES, READ, boxes_of, median_of, ratio_of
from tables import Table, count, digits, time

FCL = ("DynamicAABBTree/stock", "DynamicAABBTree/tight")


def beside_of(part, name):
    return part.ratios("Beside", name, "seconds", "reference")


def beside(part):
    """Objects in rows, reports in columns."""
    reports, objects = (
        sorted({name.split("/")[word] for name in part.names("Beside")}) for word in (0, 1)
    )
    alone = []
    for report in reports:
        runs = [part.runs("Beside", f"{report}/{what}", "reference") for what in objects]
        alone.append(time(pd.concat(runs).median()))
    rows = [["nothing else", *alone]]
    for what in objects:
        names = [f"{report}/{what}" for report in reports]
        rows.append([what, *(beside_cell(part, name) for name in names)])
    header = ["self-collision beside", *reports]
    caption = "Times and ratios are medians, the ratios of single runs to the query beside nothing."
    return Table("beside", "Objects beside fibers", header, rows, caption)


def beside_cell(part, name):
    pairs = part.median("Beside", name, "with")
    return median_of(beside_of(part, name)).text() + (f", {count(pairs)} pairs" if pairs else "")


def fibers_of(part):
    rows = []
    for name in sorted(part.names("FibersOf"), key=lambda name: (name != "capsules", name)):
        segments, size, pairs = part.medians("FibersOf", name, "segments", "bytes", "pairs")
        cells = [name, digits(size / segments), count(pairs)]
        for key in ("update", "detection"):
            found = part.ratios("FibersOf", name, key, "capsules_" + key)
            cells += [time(part.median("FibersOf", name, key)), median_of(found).text()]
        rows.append(cells)
    header = ["fibers of", "bytes per object", "pairs", "update", "update / capsules"]
    header += ["detection", "detection / capsules"]
    caption = "Times and ratios are medians, the ratios of single runs to capsules by turns."
    return Table("fibers-of", "Fibers of other shapes", header, rows, caption)


def one_by_one(part):
    names = dict.fromkeys(name.split("/")[0] for name in part.names("OneByOne"))
    rows = []
    for what in sorted(names, key=lambda name: (name.split(", ")[1], int(name.split()[0]), name)):
        fcl = min(FCL, key=lambda who: part.median("OneByOne", f"{what}/{who}", "seconds"))
        runs = [part.runs("OneByOne", f"{what}/{who}", "seconds") for who in (BOXES, CAPSULES, fcl)]
        speed_ups = [ratio_of(runs[2], ours, fcl).text() for ours in runs[:2]]
        times = [time(found.median()) for found in runs]
        rows.append([grouped(what), *times[:2], f"{times[2]}, {boxes_of(fcl)}", *speed_ups])
    header = ["", "kVolumes", "kCapsules", "FCL's dynamic tree, faster boxes"]
    header += ["speed-up, kVolumes", "speed-up, kCapsules"]
    return Table("one-by-one", "One by one", header, rows, READ)
