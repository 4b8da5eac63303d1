# SPDX-License-Identifier: BSD-3-Clause
"""Tables of the set trade: what `fcl_fibers trade` found, and what options cost."""

import math
import re
from functools import partial

from measured_sets import titles
from ratios import median_of
from tables import Table, count, digits, percent, time

NOISE, SAME = 1.1, 2.0  # times and bytes, and errors, that are no difference


def settings(part):
    return part.names("Trade")


def of(part, name, key):
    return part.runs("Trade", name, key).iloc[0]


def error(value):
    """Of about 1e-15 to 1e3."""
    if math.isnan(value):
        return "-"
    return f"{value:.0e}".replace("e-0", "e-") if 0 < value < 1e-3 else f"{value:.2g}"


def median_error(part, name, what):
    return part.counters("Trade", name)[what].iloc[0]


def is_as_usual(part, name):
    """As showsNoDifference() of tools/trade/front.cpp."""
    usual = settings(part)[0]

    def equal(key, factor):
        a, b = (median_error(part, n, key) for n in (name, usual))
        return (math.isnan(a) and math.isnan(b)) or (a <= factor * b and b <= factor * a)

    same = all(of(part, name, k) == of(part, usual, k) for k in ("reported", "missed", "false"))
    return same and equal("times_default", NOISE) and equal("bytes", NOISE) and equal("depth", SAME)


def scene_table(name, part):
    rows, as_usual = [], []
    segments = part.context["segments"]
    for setting in settings(part):
        front = " *" if of(part, setting, "front") else ""
        ended = of(part, setting, "ended")
        if not ended and setting != settings(part)[0] and is_as_usual(part, setting):
            as_usual.append(setting)
            continue
        held = of(part, setting, "bytes")
        held = count(held / segments) if held else "-"
        if ended:
            rows.append([setting, "ended", "", held, *5 * [""]])
            continue
        cells = [time(of(part, setting, "seconds")), digits(of(part, setting, "times_default"), 2)]
        cells.append(held)
        cells += [percent(of(part, setting, f"{share}_share"), 1) for share in ("missed", "false")]
        cells += [error(median_error(part, setting, e)) for e in ("depth", "normal", "place")]
        rows.append([setting + front, *cells])
    context = part.context
    what = f"{context['segments']:,} segments, {context['contacts']:,} contacts"
    if context["judged_pieces"] < context["pieces"]:
        share = context["judged_pieces"] / context["pieces"]
        bound = of(part, settings(part)[0], "missed_share_at_most")
        what += f" in a sample of {100 * share:.2g} %, which may hide {100 * bound:.2g} %"
    header = [what, "time", "times", "bytes", "missed", "false", "depth", "normal", "place"]
    caption = (
        "Times are medians of a frame on one thread, and multiples of those of the default, "
        "which took turns with them. Bytes are of a segment. Missed are of the contacts, false of "
        "the pairs reported. Depth and place are median errors in radii, normal in degrees. * is "
        "on the front."
    )
    title = f"Trade of {titles('trade')[name]}"
    if as_usual:
        caption += f" As the first row: {'; '.join(as_usual)}."
    return Table(f"trade {name}", title, header, rows, caption)


def dial_of(part, setting):
    """The name of a setting without what is the scene's alone, such as a length in its unit."""
    setting = re.sub(r", e of [^,]*", "", setting)
    for dial, words in (
        ("neighbours: length", ("1 segment", "4 segments", "19 segments")),
        ("roots: of", ("half a segment", "3.5 segments")),
    ):
        if setting.startswith(dial):
            among = [s for s in settings(part) if s.startswith(dial)]
            index = next(i for i, s in enumerate(among) if s == setting)
            return f"{dial} {'of ' if dial[0] == 'n' else ''}{words[index]}"
    if setting.startswith("mesh: "):
        margin = ", margin e" if setting.endswith("margin e") else ""
        return re.sub(r" edges.*", " edges", setting) + margin
    return setting


def dials(parts):
    """Each setting over all scenes that have it."""
    found = {}
    for name in titles("trade"):
        part = parts.get(f"trade_{name}")
        for setting in settings(part) if part else []:
            found.setdefault(dial_of(part, setting), []).append((part, setting))

    def reach(values, form):
        least, most = form(min(values)), form(max(values))
        return least if least == most else f"{least} to {most}"

    rows = []
    for dial, places in found.items():
        timed = [(p, s) for p, s in places if not of(p, s, "ended")]
        ended = len(places) - len(timed)
        if not timed:
            rows.append([dial, "ended", "", "", "", ""])
            continue
        times = reach([of(p, s, "times_default") for p, s in timed], lambda x: digits(x, 2))
        missed = [of(p, s, "missed_share") for p, s in timed]
        wrong = [of(p, s, "false_share") for p, s in timed]
        depths = [median_error(p, s, "depth") for p, s in timed]
        depths = [d for d in depths if not math.isnan(d)]
        same = sum(is_as_usual(p, s) for p, s in timed)
        rows.append(
            [
                dial,
                times + (f", ended in {ended}" if ended else ""),
                reach(missed, lambda x: f"{100 * x:.3g} %"),
                reach(wrong, lambda x: f"{100 * x:.3g} %"),
                reach(depths, error) if depths else "-",
                f"{same} of {len(places)}",
            ]
        )
    header = ["setting", "times", "missed", "false", "depth off by, radii", "no difference in"]
    caption = (
        "The least and the greatest over all scenes. The last column has the scenes in which a "
        "setting finds, takes and holds what the default does, to 10 % of time and bytes."
    )
    return Table("trade-dials", "All dials over all scenes", header, rows, caption)


def is_beside(part, name):
    """Whether the fibers took turns with others, without tapers or branches."""
    return "times" in part.counters("Costs", name)


def costs(part):
    rows = []
    for name in sorted(part.names("Costs")):
        if is_beside(part, name):
            continue
        keys = ("segments", "bytes", "pairs", "update", "detection")
        segments, size, pairs, *times = part.medians("Costs", name, *keys)
        cells = [digits(size / segments), *(count(1e9 * seconds / segments) for seconds in times)]
        rows.append([name.replace("/", ": ", 1), *cells, count(pairs)])
    header = ["input: options", "bytes per segment", "update, ns per segment"]
    header += ["detection, ns per segment", "pairs"]
    caption = "Arrays are a FiberTree's, objects a manager's."
    return Table("costs", "What options cost", header, rows, caption)


def tapers(part):
    rows = []
    for name in filter(partial(is_beside, part), sorted(part.names("Costs"))):
        what = name.split("neighbours by number, ")[1]
        what += "" if ", " in what else ", pairs"
        rows.append([what, median_of(part.runs("Costs", name, "times")).text()])
    header = ["query", "times that of fibers without"]
    caption = "Fibers without tapers or branches took turns, and found equal pairs."
    return Table("tapers", "What tapers and branches cost", header, rows, caption)


def unused(part):
    rows = []
    for name in sorted(part.names("Unused")):
        runs = part.ratios("Unused", name, "with", "without")
        with_it, without = part.medians("Unused", name, "bytes_with", "bytes_without")
        rows.append([name.replace("/", ": ", 1), median_of(runs).text(), count(with_it - without)])
    header = ["feature that is there and not used", "time of a frame, times", "bytes more"]
    caption = (
        "A frame with the feature over one without it, which take turns. The bytes are of the "
        "whole tree or manager."
    )
    return Table("unused", "What is not used", header, rows, caption)
