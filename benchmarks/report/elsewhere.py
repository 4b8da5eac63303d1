# SPDX-License-Identifier: BSD-3-Clause
"""Tables of queries, loose objects, small scenes and changes."""

import re
from dataclasses import dataclass

import ratios
from ratios import BOXES, READ, Ratio, median_of, ratio_of
from tables import Table, count, digits, time, title

SAME_TOUCHING = 1e-3  # fcl::collide may change its mind about a pair if the two change places


def grouped(text):
    """With commas in its large numbers."""
    return re.sub(r"\d{4,}", lambda found: count(int(found[0])), text)


@dataclass
class Row:
    what: str
    ours: object  # runs
    theirs: object
    ratio: Ratio

    def cells(self):
        times = [time(runs.median()) for runs in (self.ours, self.theirs)]
        return [grouped(self.what), *times, title(self.ratio.against), self.ratio.text()]


def row_of(part, what, key, entries):
    """`entries`: kind and name by contender."""
    ours = entries.pop(BOXES)
    against = min(entries, key=lambda name: part.median(*entries[name], key))
    theirs = entries[against]
    answers = [part.median(*who, "answer") for who in (ours, theirs)]
    # Of loose objects ours may report fewer pairs; the candidates tell whether as many touch.
    if not same_answer(*answers) and not (ours[0] == "Objects" and answers[0] < answers[1]):
        raise ValueError(f"{part.file}: {what}: {answers[0]}, {against} {answers[1]}")
    values = [part.runs(*who, key) for who in (ours, theirs)]
    return Row(what, *values, ratio_of(*reversed(values), against))


def same_answer(ours, theirs):
    """Distances are the same to rounding, pairs to that of bounds. Where objects touch, a distance
    query ends at the first pair that does, which may be any."""
    if ours <= 0 and theirs <= 0:
        return True
    return theirs * (1 - 1e-6) <= ours <= theirs * (1 + ratios.ROUNDING)


def rows_of(part, kind, keys, before="", names=None):
    """A row for each query, scene or shape, and for each counter of `keys`, by its title."""
    groups = {}
    for name in part.names(kind) if names is None else names:
        what, contender = name.split("/", 1)
        for key, phase in keys.items():
            groups.setdefault((before + what + phase, key), {})[contender] = (kind, name)
    return [row_of(part, what, key, entries) for (what, key), entries in sorted(groups.items())]


def query_rows(part):
    keys = {"set_up": ", set-up, boxes written before", "set_up_with_boxes": ", set-up with boxes"}
    keys |= {"update": ", update", "detection": ", self-collision"}
    rows = rows_of(part, "Objects", keys, before="10,000 ")
    # Of a queried object FCL reads the box too.
    names = part.names("Query")
    probed = [name for name in names if "boxes" in part.counters("Query", name)]
    keys = {"seconds": ", box written before", "seconds_with_boxes": " with its box"}
    queries = rows_of(part, "Query", keys, names=probed)
    others = [name for name in names if name not in probed]
    queries += rows_of(part, "Query", {"seconds": ""}, names=others)
    return rows + sorted(queries, key=lambda row: row.what)


def client_rows(part):
    found = rows_of(part, "Clients", {"seconds": ""})
    return sorted(found, key=lambda row: (int(row.what.split()[0]), row.what))


def table(name, what, rows, caption):
    header = ["", "ours", "FCL's best", "which manager", "speed-up"]
    return Table(name, what, header, [row.cells() for row in rows], caption)


def elsewhere(part):
    return table("elsewhere", "Other queries, other objects", query_rows(part), READ)


def clients(part):
    caption = READ
    left_out = [title(name) + f" ({part.note(name, 'LeftOut')})" for name in part.names("LeftOut")]
    if left_out:
        caption += f" Left out: {'; '.join(sorted(left_out))}."
    return table("clients", "Small scenes", client_rows(part), caption)


def after(part, name):
    return part.ratios("Changes", name, "seconds", "reference")


def changes(part):
    rows = []
    for name in sorted(part.names("Changes")):
        times = [part.median("Changes", name, key) for key in ("seconds", "reference")]
        rows.append([grouped(name), *map(time, times), median_of(after(part, name)).text()])
    header = ["self-collision after", "time", "reference", "time / reference"]
    caption = "Times are medians. The ratio is the median of the ratios of single runs."
    return Table("changes", "After changes", header, rows, caption)


def candidates(part):
    rows = []
    names = dict.fromkeys(name.split("/")[0] for name in part.names("Candidates"))
    for shape in sorted(names):
        found = {
            who: part.medians("Candidates", f"{shape}/{who}", "pairs", "touching")
            for who in ("poses", "boxes", "fcl")
        }
        touching = found["fcl"][1]
        for who, (_, others) in found.items():
            if abs(others - touching) > SAME_TOUCHING * touching:
                raise ValueError(f"{part.file}: {shape}: {others} touching, FCL {touching}")
        each = [digits(pairs / touching) for pairs, _ in found.values()]
        rows.append([shape, count(touching), *each])
    header = ["10,000", "touching", "ours", "ours after computeAABB()", "FCL's tree, stock boxes"]
    caption = "Pairs reported for each pair that touches, as fcl::collide decides."
    return Table("candidates", "Candidates", header, rows, caption)
