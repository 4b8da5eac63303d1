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


def wrong_and_time(part, kind, names, whole, what, margin, xlabel, times_of):
    """Two panels: percent missed without a margin and false with one, and the times of both.
    `names` of what was measured, by x; missed are a part of `whole`."""
    points = []
    for x, name in names.items():
        missed, of, plain = part.medians(kind, f"{name}/plain", "missed", whole, "seconds")
        keys = ("seconds", "extra", "reported")
        seconds, extra, reported = part.medians(kind, f"{name}/margin", *keys)
        points.append((x, 100 * missed / of, plain, seconds, 100 * extra / reported))
    xs, missed, plain, with_margin, false = zip(*points)
    shares = {f"{what} missed, no margin": missed, f"false, margin of {margin}": false}
    times = {"time, no margin": plain, f"time, margin of {margin}": with_margin}
    form = {"xlabel": xlabel, "xscale": "log", "x_format": count_label}
    return panels_figure(
        [
            Panel(
                title,
                {label: list(zip(xs, values)) for label, values in curves.items()},
                y_format=y_format,
                **form,
            )
            for title, curves, y_format in (
                ("what is wrong", shares, lambda share, _: f"{share:g} %"),
                (times_of, times, seconds_label),
            )
        ]
    )


def sampling_figure(part):
    names = {segments: segments for segments in samplings(part)}
    form = ("contacts", "2 e", "segments per fiber", "update + detection")
    return wrong_and_time(part, "Sampling", names, "contacts", *form)


def resolutions(part):
    """Triangles of a mesh; the last is the truth."""
    return sorted({int(n.split("/")[1]) for n in part.names("Dials") if n.startswith("mesh/")})


def resolution_figure(part):
    names = {triangles: f"mesh/{triangles}" for triangles in resolutions(part)}
    form = ("segments", "e", "triangles of the head", "time of a query")
    return wrong_and_time(part, "Dials", names, "touching", *form)


def dials(part):
    """Margin, root length and resolution."""
    titles = {"margin": "margin of {} radii", "roots": "roots of {} cm"}
    order = {"margin": 0, "roots": 1, "mesh": 2}
    names = [name.split("/") for name in part.names("Dials")]
    names.sort(key=lambda words: (order[words[0]], float(words[1]), words[2:] == ["margin"]))
    rows = []
    for dial, value, *margin in names:
        keys = ("touching", "reported", "missed", "extra", "seconds", "error")
        name = "/".join([dial, value, *margin])
        touching, reported, missed, extra, seconds, error = part.medians("Dials", name, *keys)
        if dial == "mesh":
            what = f"mesh of {int(value):,} triangles, e of {digits(error, 2)} radii"
            what += ", margin e" if margin == ["margin"] else ""
        else:
            what = titles[dial].format(value)
        shares = [percent(missed, touching), percent(extra, reported) if reported else "0 %"]
        rows.append([what, count(reported), *shares, time(seconds)])
    header = ["dial", "segments reported", "left out", "added", "time"]
    caption = (
        "Segments that touch the head. Left out and added are compared with margin 0, with all "
        "roots, and with the finest mesh. The time is that of TouchingSegments."
    )
    return Table("dials", "Dials of obstacles", header, rows, caption)


# How pairs of a step are looked for, by dial and value, in the order of the table and the picture.
MOTION_WAYS = {
    ("substeps", 1): "the end alone",
    ("substeps", 4): "4 substeps",
    ("substeps", 16): "16 substeps",
    ("substeps", 64): "64 substeps",
    ("margin", 1): "margin of the mean motion",
    ("margin", 2): "margin of twice that",
    ("linear", 1): "linear bounds",
}


def motions(part):
    """Radii of the mean motion."""
    return sorted({int(name.split("/")[1]) for name in part.names("Dials")})


def motion_figure(part):
    """Of those that were not ended, over the mean motion in radii."""
    shares, times = {}, {}
    for (dial, value), way in MOTION_WAYS.items():
        for radii in motions(part):
            name = f"motion/{radii}/{dial}/{value}"
            keys = ("ended", "motion", "missed", "impacts", "seconds")
            ended, moved, missed, impacts, seconds = part.medians("Dials", name, *keys)
            if not ended:
                shares.setdefault(way, []).append((moved, 100 * missed / impacts))
                times.setdefault(way, []).append((moved, seconds))
    form = {"xlabel": "mean motion, radii", "xscale": "log", "x_format": count_label}
    percents = Panel("impacts missed", shares, y_format=lambda share, _: f"{share:g} %", **form)
    seconds = Panel("time of a step", times, y_format=seconds_label, yscale="log", **form)
    return panels_figure([percents, seconds])


def motion_dials(part):
    rows = []
    for (dial, value), way in MOTION_WAYS.items():
        row = [way]
        for radii in motions(part):
            keys = ("ended", "missed", "impacts", "extra", "reported", "seconds")
            ended, missed, impacts, extra, reported, seconds = part.medians(
                "Dials", f"motion/{radii}/{dial}/{value}", *keys
            )
            shares = f"{percent(missed, impacts)}, {percent(extra, reported)}"
            row.append("-" if ended else f"{shares}, {time(seconds)}")
        rows.append(row)
    header = ["", *(f"{radii} radii" for radii in motions(part))]
    caption = (
        "Each cell has the impacts that are missed, the false pairs among those reported, and the "
        "time of updates and queries. - was ended, because it reports more than 20 million pairs."
    )
    return Table("motion-dials", "Dials of motion", header, rows, caption)


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
