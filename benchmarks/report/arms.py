# SPDX-License-Identifier: BSD-3-Clause
"""Tables of robot arms, whose programs stop at the first hit."""

from ratios import BOXES, CAPSULES, ratio_of
from tables import Table, count, time

FCL = "DynamicAABBTree/stock"
WHO = (FCL, BOXES, CAPSULES)
# Of the poses of a run.
MEDIANS = {"update": "update alone", "hit": "with a hit", "seconds": "without one"}


def cells_of(part):
    """Of each cell and median the runs of FCL's tree and of ours with both reports."""
    cells = {name.split("/")[0] for name in part.names("Arms")}
    for cell in sorted(cells, key=lambda cell: (cell.split(" among ")[0], len(cell))):
        for key, what in MEDIANS.items():
            runs = [part.runs("Arms", f"{cell}/{who}", key) for who in WHO]
            yield cell, key, f"{cell}, {what}", runs


def arms(part):
    rows = []
    for cell, key, what, runs in cells_of(part):
        pairs = {"hit": "pairs_of_hit", "seconds": "pairs"}.get(key)
        asked = [count(part.median("Arms", f"{cell}/{who}", pairs)) for who in WHO if pairs]
        speed_ups = [ratio_of(runs[0], ours, FCL).text() for ours in runs[1:]]
        times = [time(found.median()) for found in runs]
        rows.append([what, *times, *speed_ups, ", ".join(asked)])
    header = ["", "FCL's dynamic tree", "kVolumes", "kCapsules"]
    header += ["speed-up, kVolumes", "speed-up, kCapsules", "calls of the callback"]
    caption = (
        "A time is that of a pose, update and query, the median of the poses of a run. Calls are "
        "means, in the order of the columns."
    )
    return Table("arms", "Robot arms", header, rows, caption)
