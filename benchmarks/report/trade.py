# SPDX-License-Identifier: BSD-3-Clause
"""Tables of the set trade, and the points of its pictures."""

from frames import header_of, scenes_of
from pictures import OURS, style_of
from tables import Table, count, digits, percent, time

HELIX_RADIUS = 0.0035  # cm, of makeHelix()


def contacts(scene, name):
    """Adjacent segments always touch, and are nothing that a program looks for."""
    return scene.checked(name, "touching") - (scene.segments - scene.fibers)


def points_of(scene):
    """(name, seconds a frame, false pairs per contact) of one thread, fastest first."""
    points = []
    for name in scene.contenders:
        if name.endswith("_threads") or not scene.part.knows("Frames", name, "frame"):
            continue
        false = scene.checked(name, "pairs") - scene.checked(name, "touching")
        points.append((name, scene.median(name, "frame"), false / contacts(scene, name)))
    return sorted(points, key=lambda point: point[1])


def pareto(points):
    """Those that no other point beats in both."""
    front = []
    for point in sorted(points, key=lambda point: point[1:]):
        if not front or point[2] < front[-1][2]:
            front.append(point)
    return front


def row_of(name):
    """FCL's dynamic tree is one row, in the form and at the level that is fastest in the scene."""
    label = style_of(name)[0].replace(", array", "")
    return label if name in OURS else f"{label}, {name.split('/')[1].split('_')[0]} boxes"


def managers(parts):
    scenes = scenes_of(parts)
    cells = {}
    for scene in scenes.values():
        points = points_of(scene)
        front = pareto(points)
        for point in reversed(points):  # the fastest level has the last word
            name, seconds, false = point
            text = f"{time(seconds)}, {digits(false, 2)}" + (" *" if point in front else "")
            cells.setdefault(row_of(name), {})[scene.name] = text
    ours = [label for label, *_ in OURS.values()]
    order = sorted(cells, key=lambda row: (ours.index(row) if row in ours else len(ours), row))
    rows = [[row, *(cells[row].get(name, "-") for name in scenes)] for row in order]
    caption = (
        "Update + detection on one thread, and false pairs for each contact: a contact is a pair "
        "that touches and is not adjacent. * is on the scene's Pareto front: nobody beats it in "
        "both. - was ended, as a phase took longer than the limit. FCL's dynamic tree is that form "
        "and level that is fastest in the scene."
    )
    return Table("managers", "Managers", header_of(scenes), rows, caption)


def manager_points(parts):
    """Points and Pareto fronts by the scene's title."""
    points = {scene.title(): points_of(scene) for scene in scenes_of(parts).values()}
    return points, {title: pareto(found) for title, found in points.items()}


def samplings(part):
    """Segments a fiber; the last is the truth."""
    return sorted({int(name.split("/")[0]) for name in part.names("Sampling")})


def sampling(part):
    rows = []
    for segments in samplings(part):
        error = part.median("Sampling", f"{segments}/plain", "chord_error")
        cells = [digits(error / HELIX_RADIUS, 2)]
        for name in (f"{segments}/plain", f"{segments}/margin"):
            keys = ("missed", "contacts", "seconds", "extra", "reported")
            missed, contacts, seconds, *extra = part.medians("Sampling", name, *keys)
            cells += [percent(missed, contacts), time(seconds)]
        rows.append([f"{segments:,}", *cells, percent(*extra)])
    header = ["segments a fiber", "chord error e, radii", "missed", "takes"]
    header += ["missed with a margin of 2 e", "takes", "of these not in the finest"]
    caption = "Contacts of two fibers, against the finest sampling; update and detection of arrays."
    return Table("sampling", "Sampling", header, rows, caption)


def costs(part):
    rows = []
    for name in sorted(part.names("Costs")):
        keys = ("segments", "bytes", "pairs", "update", "detection")
        segments, size, pairs, *times = part.medians("Costs", name, *keys)
        cells = [digits(size / segments), *(count(1e9 * seconds / segments) for seconds in times)]
        rows.append([name.replace("/", ": ", 1), *cells, count(pairs)])
    header = ["what is asked for", "bytes a segment", "update, ns a segment"]
    header += ["detection, ns a segment", "pairs"]
    caption = "Of a tree over plain arrays, and of a manager of FCL's objects."
    return Table("costs", "What a scene pays for", header, rows, caption)
