# SPDX-License-Identifier: BSD-3-Clause
"""Tables of robot arms, whose programs stop at the first hit."""

from ratios import BOXES, CAPSULES, ratio_of
from tables import Table, count, time

FCL = "DynamicAABBTree/stock"
FCLS = (FCL, FCL + "_update_all")
OURS = (BOXES, CAPSULES)
# Of the poses of a run.
MEDIANS = {"update": "update alone", "hit": "with a hit", "seconds": "without one"}


def cells_of(part):
    """Of each cell and median who is compared: FCL's tree after the faster of its two calls of
    update, and ours with both reports."""
    cells = {name.split("/")[0] for name in part.names("Arms")}
    for cell in sorted(cells, key=lambda cell: (cell.split(" among ")[0], len(cell))):
        for key, what in MEDIANS.items():
            fcl = min(FCLS, key=lambda who: part.median("Arms", f"{cell}/{who}", key))
            yield cell, key, f"{cell}, {what}", (fcl, *OURS)


def arms(part):
    rows = []
    for cell, key, what, who in cells_of(part):
        pairs = {"hit": "pairs_of_hit", "seconds": "pairs"}.get(key)
        names = [f"{cell}/{one}" for one in who]
        asked = [count(part.median("Arms", name, pairs)) for name in names if pairs]
        runs = [part.runs("Arms", name, key) for name in names]
        speed_ups = [ratio_of(runs[0], ours, who[0]).text() for ours in runs[1:]]
        times = [time(found.median()) for found in runs]
        call = "update()" if who[0].endswith("_all") else "update(list)"
        rows.append([what, call, *times, *speed_ups, ", ".join(asked)])
    header = ["", "FCL's faster call", "FCL's dynamic tree", "kVolumes", "kCapsules"]
    header += ["speed-up, kVolumes", "speed-up, kCapsules", "calls of the callback"]
    caption = (
        "A time is that of a pose, update and query, the median of the poses of a run. Ours is "
        "called update(list) with what has moved. Calls of the callback are means, in the order of "
        "the columns."
    )
    return Table("arms", "Robot arms", header, rows, caption)
