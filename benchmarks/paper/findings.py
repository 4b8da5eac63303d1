# SPDX-License-Identifier: BSD-3-Clause
"""What the paper states, judged by the numbers."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from figures import step_series
from results import numbered

BOXES = "LayeredAABBTree/super_thread"
SPHERES = "WrappedSphereTree/super_thread"
DEFAULT = "LayeredAABBTree/bundle"
DEFAULT_SPHERES = "WrappedSphereTree/bundle"
CAPSULES = "LayeredAABBTree/bundle_capsules"
FCL_TREE = "DynamicAABBTree/tight"

AGREES, PARTLY, DIFFERS = "as the paper", "in part", "differs"


@dataclass
class Finding:
    said: str
    found: str
    verdict: str


def exponent(x, y):
    """Slope of the straight line through the points, both axes logarithmic."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def residuals(x, y):
    """Parts by which the points stand off that line."""
    line = np.polyfit(np.log(x), np.log(y), 1)
    return np.exp(np.log(y) - np.polyval(line, np.log(x))) - 1


def curve(static, name, phase):
    points = [
        (100.0 * fibers, part.entries[name].median(phase))
        for fibers, part in static.items()
        if name in part.entries and not math.isnan(part.entries[name].median(phase))
    ]
    return np.array(points).T if len(points) >= 3 else None


def ratios(parts, phase, above, below):
    """Times of `above` over those of `below`, over all parts where both are known."""
    found = {}
    for name, part in parts.items():
        if above in part.entries and below in part.entries:
            a, b = part.entries[above].time(phase)[0], part.entries[below].time(phase)[0]
            if b > 0 and not math.isnan(a):
                found[name] = a / b
    return found


def span(values, digits=2):
    values = list(values)
    low, high = min(values), max(values)
    if f"{low:.{digits}g}" == f"{high:.{digits}g}":
        return f"{number(low, digits)}"
    return f"{number(low, digits)} to {number(high, digits)}"


def number(value, digits=2):
    if value >= 10**digits:
        return f"{value:,.0f}"
    text = f"{value:.{digits}g}"
    return text if "e" not in text else f"{value:.{digits}f}"


def scenes_of(parts):
    return {
        n: p
        for n, p in parts.items()
        if n.startswith(("static_", "axis_", "strand_", "half_scalp"))
    }


def boxes_beat_spheres(parts):
    scenes = scenes_of(parts)
    published = ratios(scenes, "SelfCollision", SPHERES, BOXES)
    if not published:
        return None
    default = ratios(scenes, "SelfCollision", DEFAULT_SPHERES, DEFAULT)
    lost = [name for name, ratio in {**published}.items() if ratio < 1]
    text = (
        f"As published, spheres take {span(published.values())} times as long as boxes in "
        f"{len(published)} scenes"
    )
    if default:
        text += f"; by default {span(default.values())} times in {len(default)}"
    text += ". " + (
        "Boxes are the faster in each of them."
        if not lost
        else f"Spheres are the faster in {', '.join(lost)}."
    )
    late = [n for n, p in scenes.items() if SPHERES in p.entries and p.entries[SPHERES].note]
    if late:
        text += (
            " Not counted, as spheres as published ran out of time:"
            f" {', '.join(late).replace('_', ' ')}."
        )
    lost_default = [r for r in default.values() if r < 1]
    verdict = AGREES if not lost and not lost_default else PARTLY
    return Finding(
        "Detection with boxes is consistently faster than with wrapped spheres (Fig. 9).",
        text,
        verdict,
    )


def table_factors(parts, paper):
    lines = []
    for scene in ("half_scalp", "strand_1000"):
        scenes = {k: v for k, v in scenes_of(parts).items() if k == scene}
        theirs = [s / b for s, b in zip(paper[scene]["spheres"], paper[scene]["boxes"])]
        ours = [
            ratios(scenes, phase, SPHERES, BOXES).get(scene)
            for phase in ("SetUp", "Update", "SelfCollision")
        ]
        if any(r is None for r in ours):
            continue
        label = {"half_scalp": "half scalp", "strand_1000": "strand"}[scene]
        lines.append((label, theirs, ours))
    if not lines:
        return None
    words = ("construction", "update", "detection")
    text = " ".join(
        f"{label.capitalize()}: "
        + ", ".join(f"{w} {number(o)} (paper {number(t)})" for w, t, o in zip(words, theirs, ours))
        + "."
        for label, theirs, ours in lines
    )
    off = [o / t for _, theirs, ours in lines for t, o in zip(theirs[1:], ours[1:])]
    least = min(o for _, _, ours in lines for o in ours[1:])
    text += (
        " In update and detection our spheres lag behind boxes by "
        + span([o for _, _, ours in lines for o in ours[1:]])
        + " times, the paper's by "
        + span([t for _, theirs, _ in lines for t in theirs[1:]])
        + " times."
    )
    verdict = AGREES if least >= 10 else PARTLY if least > 1 else DIFFERS
    if max(off) < 0.1 and verdict == AGREES:
        verdict = PARTLY
    return Finding(
        (
            "Boxes outperform spheres in memory and time by orders of magnitude (Table I: "
            "times of spheres over boxes)."
        ),
        text,
        verdict,
    )


def linear_phase(all_parts, phase, said):
    static = numbered(all_parts, "static")
    parts = []
    slopes = []
    for name, label in ((BOXES, "boxes"), (SPHERES, "spheres"), (DEFAULT, "boxes by default")):
        points = curve(static, name, phase)
        if points is None:
            continue
        slope = exponent(*points)
        if name == BOXES:
            slopes.append(slope)
        per = points[1] / points[0] * 1e9
        parts.append(f"{label} grow as n<sup>{slope:.2f}</sup> ({span(per, 3)} ns a segment)")
    if not slopes:
        return None
    verdict = (
        AGREES if abs(slopes[0] - 1) < 0.1 else PARTLY if abs(slopes[0] - 1) < 0.35 else DIFFERS
    )
    text = "; ".join(parts) + "."
    strand = all_parts.get("strand_1000")
    if strand and BOXES in strand.entries:
        large = strand.entries[BOXES].time(phase)[0] / strand.entries[BOXES].checked["segments"]
        text += (
            f" In the strand of {strand.entries[BOXES].checked['segments']:,.0f} segments it is"
            f" {number(1e9 * large, 3)} ns a segment for boxes."
        )
    return Finding(said, text[0].upper() + text[1:], verdict)


def sphere_peaks(static):
    lines, worst = [], {}
    for phase, word in (("SetUp", "construction"), ("Update", "update")):
        for name, label in ((SPHERES, "spheres"), (BOXES, "boxes")):
            points = curve(static, name, phase)
            if points is None:
                continue
            off = residuals(*points)
            drops = int(np.sum(np.diff(points[1]) < 0))
            worst[(phase, name)] = max(abs(off))
            lines.append(
                f"{word} of {label} stands off its power law by at most"
                f" {100 * max(abs(off)):.0f} %, and falls with more segments {drops} times of"
                f" {len(off) - 1}"
            )
    if not lines:
        return None
    text = "; ".join(lines) + "."
    # What boxes show as well is no matter of enclosing spheres.
    peaks = any(
        worst[(phase, SPHERES)] > max(0.3, 2 * worst.get((phase, BOXES), 0))
        for phase, name in worst
        if name == SPHERES
    )
    text += (
        " Spheres stand off more than twice as far as boxes, so there are peaks."
        if peaks
        else (
            " Spheres do not stand off twice as far as boxes, which have no enclosing spheres to"
            " compute: there are no such peaks. The algorithm used here draws no random numbers."
        )
    )
    return Finding(
        (
            "Construction and verification of spheres show peaks at certain numbers of segments "
            "(Figs. 7 and 8), put down to Welzl's randomized algorithm."
        ),
        text[0].upper() + text[1:],
        AGREES if peaks else DIFFERS,
    )


def output_sensitive(parts):
    part = parts.get("dynamic")
    if part is None:
        return None
    touching = step_series(part.entries[CAPSULES], "pairs") if CAPSULES in part.entries else []
    lines, pearson = [], []
    for name, label in (
        (BOXES, "boxes"),
        (SPHERES, "spheres"),
        (DEFAULT, "boxes by default"),
        (FCL_TREE, "FCL's dynamic tree"),
    ):
        entry = part.entries.get(name)
        if entry is None or not entry.counters:
            continue
        pairs, detection = step_series(entry, "pairs"), step_series(entry, "detection")
        r = correlation(pairs, detection)
        both = f"{label}: {r:.2f} with the volumes that overlap"
        if len(touching) == len(detection):
            both += f", {correlation(touching, detection):.2f} with capsules that touch"
        lines.append(both)
        if name in (BOXES, SPHERES):
            pearson.append(max(r, correlation(touching, detection)) if len(touching) else r)
    if not pearson:
        return None
    entry = part.entries.get(BOXES) or part.entries[SPHERES]
    pairs, detection = step_series(entry, "pairs"), step_series(entry, "detection")
    text = (
        "Correlation over the steps, "
        + "; ".join(lines)
        + ". "
        f"Pairs of the first named range over {count_span(pairs)}, its detection over "
        f"{ms_span(detection)}."
    )
    verdict = AGREES if min(pearson) > 0.8 else PARTLY if max(pearson) > 0.8 else DIFFERS
    return Finding(
        (
            "Detection in the dynamic case is strongly correlated to the number of collisions "
            "(Fig. 10)."
        ),
        text,
        verdict,
    )


def correlation(x, y):
    known = ~(np.isnan(x) | np.isnan(y))
    x, y = x[known], y[known]
    if len(x) < 3 or np.std(x) == 0 or np.std(y) == 0:
        return math.nan
    return float(np.corrcoef(x, y)[0, 1])


def count_span(values):
    return f"{np.nanmin(values):,.0f} to {np.nanmax(values):,.0f}"


def ms_span(values):
    return f"{1e3 * np.nanmin(values):.3g} to {1e3 * np.nanmax(values):.3g} ms"


def update_base_line(parts):
    part = parts.get("dynamic")
    if part is None:
        return None
    lines, spreads, of_boxes = [], [], None
    for name, label in (
        (BOXES, "boxes"),
        (SPHERES, "spheres"),
        (DEFAULT_SPHERES, "spheres by default"),
    ):
        entry = part.entries.get(name)
        if entry is None or not entry.counters:
            continue
        update = step_series(entry, "update")
        update = update[~np.isnan(update)]
        low, middle, high = np.percentile(update, [5, 50, 95])
        lines.append(
            f"{label} {1e3 * middle:.3g} ms, nine steps in ten within "
            f"{1e3 * low:.3g} to {1e3 * high:.3g} ms"
        )
        spreads.append(high / low)
        if name == BOXES:
            of_boxes = high / low
    if of_boxes is None:
        return None
    return Finding(
        "Update times are independent of the geometry: a stable base line (Fig. 10).",
        "Median by step: " + "; ".join(lines) + ".",
        AGREES if max(spreads) < 1.5 else PARTLY if of_boxes < 1.5 else DIFFERS,
    )


def cages(parts):
    part = parts.get("dynamic")
    if part is None:
        return None
    lines, shares = [], []
    for name, label in ((SPHERES, "As published"), (DEFAULT_SPHERES, "by default")):
        entry = part.entries.get(name)
        if entry is None or not entry.counters:
            continue
        recomputed, kept = step_series(entry, "cages_recomputed"), step_series(entry, "cages_kept")
        share = recomputed / (recomputed + kept)
        share = share[~np.isnan(share)]
        lines.append(
            f"{label} {100 * np.median(share):.1f} % of the cages are recomputed at a median "
            f"step, {100 * share.min():.0f} to {100 * share.max():.0f} % over all"
        )
        shares.append(float(np.median(share)))
    if not lines:
        return None
    verdict = AGREES if shares[0] < 0.1 else PARTLY if shares[0] < 0.4 else DIFFERS
    return Finding(
        (
            "Cages should be recomputed seldom: the basis of a cage stays the same over a long "
            "time (section 3.1, an assumption)."
        ),
        "; ".join(lines) + ".",
        verdict,
    )


def axis_pairs(parts):
    """(manager, axis-parallel seconds, turned seconds) of detection."""
    for fibers, part in numbered(parts, "axis_parallel").items():
        turned = parts.get(f"axis_turned_{fibers}")
        if turned is None:
            continue
        for name in (BOXES, SPHERES, DEFAULT, DEFAULT_SPHERES, CAPSULES, FCL_TREE):
            if name in part.entries and name in turned.entries:
                a = part.entries[name].time("SelfCollision")[0]
                b = turned.entries[name].time("SelfCollision")[0]
                if not math.isnan(a) and not math.isnan(b):
                    yield name, a, b


def axis_parallel(parts):
    found = {
        name: turned / straight for name, straight, turned in axis_pairs(parts) if straight > 0
    }
    if BOXES not in found:
        return None
    text = (
        f"Turned by π/4 about two axes, detection with boxes takes {number(found[BOXES], 3)} times"
        " as long"
    )
    if SPHERES in found:
        text += f", with spheres {number(found[SPHERES], 3)} times"
    if DEFAULT in found:
        text += f", with boxes by default {number(found[DEFAULT], 3)} times"
    return Finding(
        (
            "The more the fibers are in parallel with the axes, the faster is detection with boxes."
        ),
        text + ".",
        AGREES if found[BOXES] > 1.1 else DIFFERS,
    )


def chain_exponents(parts):
    lines, slopes = [], []
    kinds = (("random", "random path"), ("snake", "snake, as bad as can be"))
    counts = (("volume_tests", "tests of two volumes"), ("pairs", "overlapping pairs of segments"))
    for (kind, words), (counter, counted) in itertools.product(kinds, counts):
        chain = numbered(parts, f"chain_{kind}")
        texts = []
        for name, label in ((BOXES, "boxes"), (SPHERES, "spheres")):
            points = [
                (c["segments"], c[counter])
                for part in chain.values()
                if name in part.entries and (c := part.entries[name].counters).get(counter)
            ]
            # Small chains are all surface.
            points = [p for p in points if p[0] >= 2000]
            if len(points) >= 3:
                slope = exponent(*np.array(points).T)
                slopes.append(slope)
                texts.append(f"{label} n<sup>{slope:.2f}</sup>")
        if texts:
            lines.append(f"{words}, {counted}: " + ", ".join(texts))
    if not slopes:
        return None
    text = (
        "; ".join(lines)
        + ". The bound is n<sup>1.33</sup>."
    )
    return Finding(
        (
            "In a chain-aligned hierarchy of a well-behaved chain at most of the order of "
            "n<sup>4/3</sup> volumes overlap (section 2.1)."
        ),
        text[0].upper() + text[1:],
        AGREES if max(slopes) < 1.38 else PARTLY,
    )


def radii(parts):
    part = parts.get("radii")
    if part is None or not part.rows:
        return None
    rows = part.rows.values()
    ratio = max(r["layered"] / r["wrapped"] for r in rows)
    of_bound = max(r["layered"] / r["wrapped"] / math.sqrt(r["height"] + 1) for r in rows)
    node = max(r["largest_of_bound"] for r in rows)
    text = (
        f"Over {len(part.rows)} trees of up to {max(r['segments'] for r in rows):,.0f} segments,"
        f" the root of the layered tree is up to {ratio:.2f} times the wrapped one's radius, at"
        f" most {100 * of_bound:.0f} % of the bound; any node at most {100 * node:.0f} % of the"
        " bound for its own height."
    )
    return Finding(
        (
            "The radius of the layered root is at most √(h + 1) times that of the wrapped one "
            "(section 2.2)."
        ),
        text,
        AGREES if max(of_bound, node) <= 1 else DIFFERS,
    )


def memory(parts):
    part = parts.get("radii")
    if part is None or not part.rows:
        return None
    row = max(part.rows.values(), key=lambda r: r["segments"])
    boxes, spheres = row["box_bytes_per_segment"], row["sphere_bytes_per_segment"]
    text = (
        f"The trees alone, as published, take {boxes:.0f} bytes a segment with boxes and"
        f" {spheres:.0f} with spheres, {spheres / boxes:.1f} times as much"
    )
    held = []
    for name, other in parts.items():
        entries = other.entries
        if name == "strand_1000" and BOXES in entries and SPHERES in entries:
            b, s = entries[BOXES].checked, entries[SPHERES].checked
            if b.get("bytes") and s.get("bytes"):
                held.append(
                    f"; whole managers {b['bytes'] / b['segments']:.0f} and "
                    f"{s['bytes'] / s['segments']:.0f} bytes in the strand"
                )
    text += "".join(held) + "."
    return Finding(
        "Boxes need less memory than spheres, which store the basis of each cage.",
        text,
        AGREES if spheres > boxes else DIFFERS,
    )


def collisions(parts, paper):
    lines, factors = [], []
    for scene, label in (
        ("half_scalp", "half scalp"),
        ("strand_1000", "strand of 1,000"),
        ("strand_2000", "strand of 2,000"),
    ):
        part = parts.get(scene)
        if part is None:
            continue
        boxes = next(
            (
                part.entries[n].checked["pairs"]
                for n in (BOXES, DEFAULT)
                if n in part.entries and "pairs" in part.entries[n].checked
            ),
            None,
        )
        touching = next(
            (
                part.entries[n].checked["touching"]
                for n in (CAPSULES, DEFAULT)
                if n in part.entries and "touching" in part.entries[n].checked
            ),
            None,
        )
        if touching is None or boxes is None:
            continue
        due = paper[scene]["collisions"]
        factors.append(touching / due)
        lines.append(
            f"{label}: {boxes:,.0f} boxes overlap and {touching:,.0f} capsules touch, paper {due:,}"
        )
    if not lines:
        return None
    near = all(0.85 < f < 1.15 for f in factors)
    text = "; ".join(lines) + "."
    text = (
        text[0].upper()
        + text[1:]
        + f" Touching capsules are {span(factors)} times the paper's count: "
        "root areas and deviates, which the paper does not give, were chosen so."
    )
    return Finding(
        (
            "550,000 collisions in the half scalp, 23,000 in the strand of 1,000 fibers and 80,000"
            " in that of 2,000."
        ),
        text,
        AGREES if near else DIFFERS,
    )


def growth_of_strand(parts):
    one, two = parts.get("strand_1000"), parts.get("strand_2000")
    if one is None or two is None or BOXES not in one.entries or BOXES not in two.entries:
        return None
    factor = {}
    for phase in ("Update", "SelfCollision"):
        a, b = (p.entries[BOXES].time(phase)[0] for p in (one, two))
        if math.isnan(a) or math.isnan(b):
            return None
        factor[phase] = b / a
    c1, c2 = (p.entries[BOXES].checked.get("touching", math.nan) for p in (one, two))
    text = (
        f"From 1,000 to 2,000 fibers update takes {factor['Update']:.1f} times as long (paper 2.0),"
        f" detection {factor['SelfCollision']:.1f} times (paper 2.5), and {c2 / c1:.1f} times as"
        " many capsules touch (paper 3.5)."
    )
    near = abs(factor["Update"] - 2) < 0.5 and 1.5 < factor["SelfCollision"] < 4
    return Finding(
        "Twice the fibers double the update; detection follows the collisions.",
        text,
        AGREES if near else PARTLY,
    )


def past_the_paper(parts):
    scenes = scenes_of(parts)
    bundle = ratios(scenes, "SelfCollision", BOXES, DEFAULT)
    fcl = ratios(scenes, "SelfCollision", FCL_TREE, BOXES)
    fcl_default = ratios(scenes, "SelfCollision", FCL_TREE, DEFAULT)
    if not bundle:
        return None
    text = (
        f"Detection with boxes by default is {span(bundle.values())} times as fast as with the"
        " paper's tree"
    )
    if fcl:
        text += (
            f"; FCL's dynamic AABB tree takes {span(fcl.values())} times as long as the paper's"
            f" tree and {span(fcl_default.values())} times as long as the default"
        )
    return Finding(
        "Not in the paper: another topology and FCL.",
        text + f", over {len(bundle)} scenes.",
        "beyond it",
    )


def all_findings(parts, paper):
    static = numbered(parts, "static")
    found = [
        boxes_beat_spheres(parts),
        table_factors(parts, paper),
        linear_phase(
            parts,
            "SetUp",
            (
                "Construction of boxes takes linear time, that of spheres n log n; "
                "both depend on the number of segments only (Fig. 7)."
            ),
        ),
        linear_phase(
            parts,
            "Update",
            "The update of boxes depends linearly on the number of segments (Fig. 8).",
        ),
        sphere_peaks(static),
        output_sensitive(parts),
        update_base_line(parts),
        cages(parts),
        collisions(parts, paper),
        growth_of_strand(parts),
        axis_parallel(parts),
        chain_exponents(parts),
        radii(parts),
        memory(parts),
        past_the_paper(parts),
    ]
    return [finding for finding in found if finding]
