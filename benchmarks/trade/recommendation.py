# SPDX-License-Identifier: BSD-3-Clause
"""Which setting for which kind of scene, in words that follow from the data."""

import math
import statistics

from report import count_text, seconds_text
from settings import (
    CAGES,
    OURS,
    SAMPLINGS,
    SCENES,
    SHORT,
    by_directions,
    by_fatness,
    chord_error,
    entries_of,
    is_truth,
    missed,
    points_of,
    scenes_with,
    title_of,
)

NOISE = 1.1  # two runs of one setting differ by as much; what differs by less is called as fast
DEFAULT = "LayeredAABBTree/bundle"
MISSES = (0.1, 0.01, 0.001)  # shares of contacts that a program may miss


def recommendation(parts):
    blocks = []
    for scene in SCENES:
        items = [
            f"<li><b>{title}</b> {make(parts[f'{prefix}_{scene}'])}</li>"
            for title, prefix, make in (
                ("Only pairs that touch:", "managers", touching_only),
                ("Volumes, as FCL's callbacks expect them:", "managers", volumes),
                ("An answer in time:", "bounds", in_time),
            )
            if f"{prefix}_{scene}" in parts
        ]
        if items:
            blocks.append(f"<h3>{SCENES[scene]}</h3><ul>{''.join(items)}</ul>")
    if "sampling" in parts:
        blocks.append(f"<h3>Curves that are cut into segments</h3>{cut(parts['sampling'])}")
    blocks.append(defaults(parts))
    return "\n".join(block for block in blocks if block) or None


def ratio(factor):
    return f"{factor:.1f}" if factor >= 1.95 else f"{factor:.2f}"


def span(factors):
    low, high = ratio(min(factors)), ratio(max(factors))
    return low if low == high else f"{low} to {high}"


def false_text(false):
    return "no false pair" if false < 0.005 else f"{false:,.1f} false pairs for each contact"


def of_kind(part):
    """Exact ones, ours that report volumes, FCL's; each fastest first."""
    points = points_of(part)
    exact = [p for p in points if p[0] in OURS and p[0].endswith("capsules")]
    loose = [p for p in points if p[0] in OURS and not p[0].endswith("capsules")]
    return exact, loose, [p for p in points if p[0] not in OURS]


def setting_text(name):
    manager, variant = name.split("/")
    topology = "super thread" if variant.startswith("super_thread") else "bundle"
    report = "kCapsules" if variant.endswith("capsules") else "kVolumes"
    return f"<code>{manager}CollisionManager</code>, {topology}, <code>Report::{report}</code>"


def against_fcl(seconds, theirs):
    if not theirs:
        return " None of FCL's managers ended in time."
    name, other, false = theirs[0]
    return (
        f" The fastest of FCL's, {title_of(name).removeprefix('FCL ')}, takes"
        f" {ratio(other / seconds)} times as long, with {false_text(false)}."
    )


def touching_only(part):
    exact, _, theirs = of_kind(part)
    if not exact:
        return "none of ours ended in time."
    name, seconds, _ = exact[0]
    return f"{setting_text(name)}: {seconds_text(seconds)} a frame." + against_fcl(seconds, theirs)


def volumes(part):
    _, loose, theirs = of_kind(part)
    if not loose:
        return "none of ours ended in time."
    name, seconds, false = loose[0]
    text = f"{setting_text(name)}: {seconds_text(seconds)} a frame, with {false_text(false)}."
    text += against_fcl(seconds, theirs)
    for default in (p[1] for p in loose[1:] if p[0] == DEFAULT):
        text += f" Boxes, the default, take {ratio(default / seconds)} times as long."
    return text


def in_time(part):
    entries = entries_of(part)
    whole = entries["none"]
    bounded = {n: e for n, e in entries.items() if n.startswith(("tests:", "radii:"))}
    touching = whole.counters["pairs"]
    text = f"the whole query takes {seconds_text(whole.total)}."
    chosen = {}  # by setting: the limits that it is best in
    for words, limit in (("half", 2), ("a tenth", 10)):
        within = {n: e for n, e in bounded.items() if e.total * limit <= whole.total}
        if within:
            best = min(within, key=lambda n: (within[n].counters["unresolved"], within[n].total))
            chosen.setdefault(best, []).append(words)
    for name, limits in chosen.items():
        counters = bounded[name].counters
        text += (
            f" In {' or '.join(limits)} of that: {bound_text(name)}, which takes"
            f" {seconds_text(bounded[name].total)}, finds"
            f" {100 * counters['pairs'] / touching:.0f} % of the touching pairs and leaves"
            f" {count_text(counters['unresolved'] / touching)} pairs in pieces for each of them."
        )
    complete = [e.total for e in bounded.values() if e.counters["unresolved"] == 0]
    if complete:
        text += (
            f" A bound that leaves nothing takes {ratio(min(complete) / whole.total)} times as long"
            " as none."
        )
    return text


def bound_text(name):
    kind, _, value = name.partition(":")
    if kind == "tests":
        return f"at most {int(value):,} <code>volume_tests</code>"
    return f"a <code>resolution</code> of {value} radii"


def cut(part):
    entries = part.entries
    plain = {n: entries[f"{n}/plain"] for n in SAMPLINGS if not is_truth(n, "plain")}
    items = []
    for share in MISSES:
        enough = [n for n in plain if missed(plain[n]) <= share]
        words = f"<b>At most {100 * share:g} % of the contacts missed:</b>"
        if not enough:
            items.append(f"<li>{words} none of those measured.</li>")
            continue
        best = min(enough, key=lambda n: plain[n].total)
        items.append(f"<li>{words} {cut_text(best, plain[best])}.</li>")
    margin = {n: entries[f"{n}/margin"] for n in SAMPLINGS}
    complete = [n for n in margin if missed(margin[n]) == 0]
    if complete:
        best = min(complete, key=lambda n: margin[n].total)
        extra = margin[best].counters["extra"] / max(margin[best].counters["reported"], 1)
        items.append(
            "<li><b>None missed:</b> twice the chord error as <code>margin</code>;"
            f" {cut_text(best, margin[best])}, {100 * extra:.0f} % of what is reported being no"
            " contact of the finest.</li>"
        )
    return (
        f"<ul>{''.join(items)}</ul><p>Another curve is cut by the chord error:"
        " <code>segmentsForChordError</code> has its number of segments.</p>"
    )


def cut_text(segments, entry):
    return (
        f"a chord error of {chord_error(entry):.2g} radii, which are {segments:,} segments a fiber"
        f" here, {seconds_text(entry.total)} a frame"
    )


# What is the default, and whether it is the fastest


def defaults(parts):
    """Of each choice: by scene, the seconds of each of its settings."""
    manager_scenes = scenes_with(parts, "managers")
    loose = {s: by_title(of_kind(parts[f"managers_{s}"])[1]) for s in manager_scenes}
    exact = {s: by_title(of_kind(parts[f"managers_{s}"])[0]) for s in manager_scenes}
    choices = [
        ("Volumes: boxes over the bundle", title_of(DEFAULT), loose),
        ("Boxes over the bundle for what touches", title_of(f"{DEFAULT}_capsules"), exact),
        ("One segment a leaf", "leaves of 1", of_leaves(parts)),
        ("Boxes, not k-DOPs: volumes", "k = 6", of_kdops(parts, "detection")),
        ("Boxes, not k-DOPs, for what touches", "k = 6", of_kdops(parts, "touching_detection")),
        ("Exact cages, verified", CAGES["verified"] + " cages", of_spheres(parts)),
        # A lazy update is given the least time that it may take, see Page.lazy().
        ("No lazy updates, at best: volumes", "fatness 0", of_lazy(parts, "volumes")),
        ("No lazy updates, at best, for what touches", "fatness 0", of_lazy(parts, "capsules")),
    ]
    judged = [
        judge(words, default, scenes)
        for words, default, scenes in choices
        if any(default in found for found in scenes.values())
    ]
    if not judged:
        return None
    contrary = [words for words, _, chosen in judged if not chosen]
    verdict = (
        f"These data speak for another setting in: {'; '.join(contrary)}."
        if contrary
        else "These data choose it: over all scenes no other setting is faster."
    )
    items = "".join(f"<li><b>{words}.</b> {text}</li>" for words, text, _ in judged)
    return (
        "<h3>The default</h3><p>Boxes over the bundle, one segment a leaf, a refit of all, and"
        " <code>Report::kVolumes</code>, for a callback of FCL's managers expects volumes."
        f" {verdict}</p><ul>{items}</ul>{report_text(loose, exact)}"
    )


def judge(words, default, scenes):
    """Words again, what the data say, and whether they choose the default: whether no other setting
    takes less time over all scenes, as a geometric mean of the ratios."""
    known = {scene: found for scene, found in scenes.items() if default in found}
    beaten = []
    for scene, found in known.items():
        best = min(found, key=found.get)
        if found[default] > NOISE * found[best]:
            share = f"{found[best] / found[default]:.2f}"
            beaten.append(f"{SHORT[scene]} ({best}: {share} of the time)")
    common = set.intersection(*(set(found) for found in known.values())) - {default}
    means = {
        other: math.exp(statistics.mean(math.log(f[other] / f[default]) for f in known.values()))
        for other in common
    }
    elsewhere = f"; not in: {'; '.join(beaten)}" if beaten else ""
    text = (
        f"The fastest, or within {100 * (NOISE - 1):.0f} % of it, in {len(known) - len(beaten)} of"
        f" {count_of(known, 'scene')}{elsewhere}."
    )
    if not means:
        return words, text, not beaten
    best = min(means, key=means.get)
    text += f" Over all scenes the best other, {best}: {means[best]:.2f} of the time."
    return words, text, means[best] * NOISE >= 1


def count_of(things, noun):
    return f"{len(things)} {noun}{'' if len(things) == 1 else 's'}"


def report_text(loose, exact):
    prices = [
        exact[scene][capsules] / loose[scene][title_of(DEFAULT)]
        for capsules in [title_of(f"{DEFAULT}_capsules")]
        for scene in loose
        if title_of(DEFAULT) in loose[scene] and capsules in exact[scene]
    ]
    if not prices:
        return ""
    return (
        "<p>A program that tests the pairs itself takes <code>Report::kVolumes</code>; one that"
        " would only drop those that do not touch takes <code>Report::kCapsules</code>, whose frame"
        f" takes {span(prices)} times as long and leaves nothing to drop.</p>"
    )


def by_title(points):
    return {title_of(name): seconds for name, seconds, _ in points}


def of_leaves(parts):
    return {
        scene: {f"leaves of {n}": e.total for n, e in entries_of(parts[f"leaves_{scene}"]).items()}
        for scene in scenes_with(parts, "leaves")
    }


def of_kdops(parts, detection):
    return {
        scene: {
            f"k = {k}": e.counters["update"] + e.counters[detection]
            for k, e in by_directions(parts[f"kdops_{scene}"])
        }
        for scene in scenes_with(parts, "kdops")
    }


def of_spheres(parts):
    return {
        scene: {
            f"{CAGES[n]} cages": e.total for n, e in entries_of(parts[f"spheres_{scene}"]).items()
        }
        for scene in scenes_with(parts, "spheres")
    }


def of_lazy(parts, report):
    if "lazy" not in parts:
        return {}
    found = by_fatness(parts["lazy"], report)
    return {"dynamic": {f"fatness {fatness:g}": e.total for fatness, e in found}}
