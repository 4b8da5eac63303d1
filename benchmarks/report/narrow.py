# SPDX-License-Identifier: BSD-3-Clause
"""Tables and the picture of narrow phases: what a pair costs and how exact its answer is."""

import math

from matplotlib.figure import Figure
from pictures import png
from tables import Table, count, digits

UNITS = ("cm", "m", "um", "m, 100 m away")
SOLVERS = {
    "libccd": "fcl::collide, libccd",
    "gjk": "fcl::collide, FCL's GJK",
    "distance": "fcl::distance",
    "closed_form": "closed form",
    "closed_form_of_axes": "closed form, axes read before",
    "capsuleContact": "capsuleContact",
    "ours": "ours",
}
KINDS = (
    *("crossing", "parallel", "near-parallel", "axes that meet", "joint", "end to end"),
    *("nested", "grazing", "balls", "thick", "tiny", "huge"),
)
DEFAULT = "_1e-6"  # fcl::CollisionRequest::gjk_tolerance
PICTURE = (
    "Medians of hair in metres, in double. FCL's two solvers have tolerances of 1e-3 to 1e-12. "
    "Further left is faster, further down is more exact."
)


def solvers_of(part):
    """(scalar, solver) in the order of the table."""
    found = {tuple(name.split("/")[1:3]) for name in part.names("Narrow")}
    place = list(SOLVERS)

    def key(row):
        scalar, solver = row
        name, _, tolerance = solver.partition("_1e")
        return scalar == "float", place.index(name), -float(tolerance or 0)

    return sorted(found, key=key)


def title(scalar, solver):
    name, _, tolerance = solver.partition("_1e")
    text = SOLVERS[name] + (f", 1e{tolerance}" if tolerance else "")
    return text + (", float" if scalar == "float" else "")


def nanoseconds(seconds):
    return count(1e9 * seconds)


def error(part, name, key, scale=1):
    """`-` where no contact was found, and infinite where one was not a number."""
    if not part.knows("Narrow", name, key):
        return "-"
    value = scale * part.median("Narrow", name, key)
    if value == 0 or 0.01 <= value < 10000:
        return digits(value, 2) if value else "0"
    return f"{value:.0e}".replace("e-0", "e-").replace("e+", "e")


def wrong(part, scene, scalar, solver):
    """Contacts missed and pairs that are none, without asking for the contact."""
    missed, false = part.medians("Narrow", f"{scene}/{scalar}/{solver}/touch", "missed", "false")
    return f"{count(missed)}, {count(false)}"


def narrow(hair, assembly=None):
    rows = []
    for scalar, solver in solvers_of(hair):
        times = [
            nanoseconds(hair.median("Narrow", f"cm/{scalar}/{solver}/{what}", "seconds"))
            for what in ("touch", "contact")
        ]
        cells = [wrong(hair, unit, scalar, solver) for unit in UNITS]
        cells += [wrong(assembly, "cm", scalar, solver)] if assembly else []
        rows.append([title(scalar, solver), *times, *cells])
    header = ["", "ns", "ns, contact", *(f"hair, {unit}" for unit in UNITS)]
    header += ["paper-static"] if assembly else []
    keys = ("pairs", "touching")
    pairs, touching = hair.medians("Narrow", "cm/double/ours/touch", *keys)
    caption = (
        f"Of {count(pairs)} pairs of overlapping boxes {count(touching)} touch in hair. Each cell "
        "has the contacts missed and the pairs reported that do not touch. Times are of 2,000 "
        "pairs that stay in the cache. Ours has read its capsules before, as in an update; the "
        "others read both poses of each pair, unless the row says otherwise."
    )
    return Table("narrow", "Narrow phases", header, rows, caption)


def errors(hair):
    rows = []
    for scalar, solver in solvers_of(hair):
        cells = []
        for what in ("depth", "normal", "point", "way"):
            scale = math.degrees(1) if what == "normal" else 1
            name = f"m/{scalar}/{solver}/contact"
            found = [error(hair, name, f"{what}_{key}", scale) for key in ("median", "most")]
            cells.append(", ".join(found))
        rows.append([title(scalar, solver), *cells])
    header = ["", "depth, radii", "normal, degrees", "point, radii", "way beyond, radii"]
    caption = "Median and worst error of the contacts that are found, of hair in metres."
    return Table("narrow-errors", "Errors of contacts", header, rows, caption)


def kinds(part):
    shown = [row for row in solvers_of(part) if "_1e" not in row[1] or row[1].endswith(DEFAULT)]
    rows = []
    made = {name.split("/")[0] for name in part.names("Narrow")}
    for kind in [kind for kind in KINDS if kind in made]:
        row = [kind]
        for scalar, solver in shown:
            if scalar == "double":
                depth = error(part, f"{kind}/double/{solver}/contact", "depth_most")
                row.append(f"{wrong(part, kind, scalar, solver)}, {depth}")
        rows.append(row)
    header = ["", *(title(scalar, solver) for scalar, solver in shown if scalar == "double")]
    caption = (
        "2,000 pairs of each kind, which all touch except for half of those that graze. Each cell "
        "has contacts missed, pairs that are none, and the worst error of a depth in radii."
    )
    return Table("narrow-kinds", "Narrow phases at the extremes", header, rows, caption)


def figure(part):
    """Error against the time of a pair."""
    points = {}
    for scalar, solver in solvers_of(part):
        name = f"m/double/{solver}/contact"
        if scalar == "double" and part.knows("Narrow", name, "depth_median"):
            found = part.medians("Narrow", name, "seconds", "depth_median", "normal_median")
            points.setdefault(SOLVERS[solver.partition("_1e")[0]], []).append(found)
    drawn = Figure(figsize=(10.4, 3.9))
    panels = (("error of the depth, radii", 1, 1), ("error of the normal, degrees", 2, 57.3))
    axes = drawn.subplots(1, len(panels))
    for axis, (ylabel, column, scale) in zip(axes, panels):
        for label, found in points.items():
            xs = [1e9 * row[0] for row in found]
            # Zero has no logarithm; nothing in double is more exact than this.
            ys = [max(scale * row[column], 1e-17) for row in found]
            axis.plot(xs, ys, "o-", ms=5, lw=1.1, label=label)
        axis.set(xscale="log", yscale="log", xlabel="ns a pair, with its contact", ylabel=ylabel)
    handles, labels = axes[0].get_legend_handles_labels()
    place = {"loc": "upper center", "bbox_to_anchor": (0.5, 0), "ncol": 5, "fontsize": 8.8}
    drawn.legend(handles, labels, **place)
    drawn.tight_layout()
    return png(drawn)
