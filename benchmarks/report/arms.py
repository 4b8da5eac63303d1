# SPDX-License-Identifier: BSD-3-Clause
"""Tables of robot arms, whose programs stop at the first hit."""

from ratios import BOXES, CAPSULES, boxes_of, ratio_of
from tables import Table, count, time

FCL = ["DynamicAABBTree/stock", "DynamicAABBTree/tight"]
WHO = (FCL, [BOXES], [CAPSULES])
CALLS = ("", "_update_all")  # update(list) of what has moved, and update()
# Of the poses of a run.
MEDIANS = {"update": "update alone", "hit": "with a hit", "seconds": "without one"}


def cells_of(part):
    """Of each cell and median FCL's tree with the faster boxes and ours with both reports, with the
    faster call."""
    cells = {name.split("/")[0] for name in part.names("Arms")}
    for cell in sorted(cells, key=lambda cell: (cell.split(" among ")[0], len(cell))):
        for key, what in MEDIANS.items():
            fastest = [
                min(
                    (f"{cell}/{who}{call}" for who in group for call in CALLS),
                    key=lambda n: part.median("Arms", n, key),
                )
                for group in WHO
            ]
            yield key, f"{cell}, {what}", fastest


def arms(part):
    rows = []
    for key, what, names in cells_of(part):
        pairs = {"hit": "pairs_of_hit", "seconds": "pairs"}.get(key)
        asked = [count(part.median("Arms", name, pairs)) for name in names if pairs]
        runs = [part.runs("Arms", name, key) for name in names]
        speed_ups = [ratio_of(runs[0], ours, names[0]).text() for ours in runs[1:]]
        times = [time(found.median()) for found in runs]
        times[0] += f", {boxes_of(names[0])}"
        rows.append([what, *times, *speed_ups, ", ".join(asked)])
    header = ["", "FCL's tree, faster boxes", "kVolumes", "kCapsules"]
    header += ["speed-up, kVolumes", "speed-up, kCapsules", "calls of the callback"]
    caption = (
        "A time is that of a pose, update and query, the median of the poses of a run, after the "
        "faster of update() and update(list). Calls of the callback are means, in the order of the "
        "columns."
    )
    return Table("arms", "Robot arms", header, rows, caption)
