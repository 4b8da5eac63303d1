# SPDX-License-Identifier: BSD-3-Clause
"""Tables and pictures of the set trade."""

from frames import header_of, scenes_of
from paper_pictures import Panel, panels_figure
from pictures import OURS, count_label, seconds_label
from ratios import FCL
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
    if name in OURS:
        return OURS[name][0]
    manager, variant = name.split("/")
    return f"{FCL[manager].replace(', array', '')}, {variant.split('_')[0]} boxes"


def rows_of(scene):
    """By row: seconds a frame, false pairs per contact, whether it is on the Pareto front."""
    points = points_of(scene)
    front = pareto(points)
    # The fastest level has the last word.
    return {row_of(point[0]): (*point[1:], point in front) for point in reversed(points)}


def managers(parts):
    scenes = scenes_of(parts)
    found = {name: rows_of(scene) for name, scene in scenes.items()}

    def cell(seconds, false, on_front):
        return f"{time(seconds)}, {digits(false, 2)}" + (" *" if on_front else "")

    ours = [label for label, _ in OURS.values()]
    names = {row for rows in found.values() for row in rows}
    order = sorted(names, key=lambda row: (ours.index(row) if row in ours else len(ours), row))
    rows = [
        [row, *(cell(*cells[row]) if row in cells else "-" for cells in found.values())]
        for row in order
    ]
    caption = (
        "Each cell has the time of update and detection on one thread, and the false pairs for "
        "each contact. A contact is a pair that touches and is not adjacent. A false pair is "
        "reported and does not touch. * is on the scene's Pareto front: no other is better in "
        "both. - was ended, because a phase took longer than the limit. FCL's dynamic tree has the "
        "form and level that is fastest in the scene."
    )
    return Table("managers", "Managers", header_of(scenes), rows, caption)


def dial_rows(parts):
    """What pictures.dial() draws."""
    return {scene.title(): rows_of(scene) for scene in scenes_of(parts).values()}


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
    header = ["segments per fiber", "chord error e, radii", "missed", "time"]
    header += ["missed, margin 2 e", "time, margin 2 e", "false, margin 2 e"]
    caption = (
        "Contacts of two fibers, compared with the finest sampling. The time is of update and "
        "detection of arrays. False pairs are reported with the margin and are no contact there."
    )
    return Table("sampling", "Sampling", header, rows, caption)


def sampling_points(part):
    """Segments a fiber, percent missed, seconds, both without margin; seconds, percent false with
    one."""
    points = []
    for segments in samplings(part):
        keys = ("missed", "contacts", "seconds", "extra", "reported")
        missed, contacts, plain, *_ = part.medians("Sampling", f"{segments}/plain", *keys)
        *_, seconds, extra, reported = part.medians("Sampling", f"{segments}/margin", *keys)
        points.append((segments, 100 * missed / contacts, plain, seconds, 100 * extra / reported))
    return points


def sampling_figure(points):
    segments, missed, plain, margin, false = zip(*points)
    shares = {"contacts missed, no margin": missed, "false pairs, margin of 2 e": false}
    times = {"time, no margin": plain, "time, margin of 2 e": margin}
    form = {"xlabel": "segments per fiber", "xscale": "log", "x_format": count_label}
    return panels_figure(
        [
            Panel(
                title,
                {label: list(zip(segments, values)) for label, values in curves.items()},
                y_format=y_format,
                **form,
            )
            for title, curves, y_format in (
                ("what is wrong", shares, lambda share, _: f"{share:g} %"),
                ("update + detection", times, seconds_label),
            )
        ]
    )


def costs(part):
    rows = []
    for name in sorted(part.names("Costs")):
        keys = ("segments", "bytes", "pairs", "update", "detection")
        segments, size, pairs, *times = part.medians("Costs", name, *keys)
        cells = [digits(size / segments), *(count(1e9 * seconds / segments) for seconds in times)]
        rows.append([name.replace("/", ": ", 1), *cells, count(pairs)])
    header = ["input: options", "bytes per segment", "update, ns per segment"]
    header += ["detection, ns per segment", "pairs"]
    caption = "Arrays are a FiberTree's, objects a manager's."
    return Table("costs", "What options cost", header, rows, caption)
