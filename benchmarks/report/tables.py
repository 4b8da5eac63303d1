# SPDX-License-Identifier: BSD-3-Clause
"""Numbers as text, and tables as Markdown and CSV; page.html has them as HTML."""

import csv
import io
import math
import re
from dataclasses import dataclass

import interval

UNITS = (("s", 1), ("ms", 1e-3), ("us", 1e-6))
# A table's place in a document: head, name, command, text, foot.
MARK = re.compile(r"(<!-- table ([\w -]+): ([^\n]*) -->\n)(.*?)(<!-- end of table -->)", re.DOTALL)


def documents(root):
    """Those that have such places."""
    return [root / "README.md", *sorted((root / "docs").glob("*.md"))]


@dataclass
class Table:
    name: str  # as in the documents' marks
    title: str
    header: list
    rows: list  # of texts; the first column holds names, the others numbers
    caption: str = ""  # how to read it

    def markdown(self):
        lines = [self.header, *self.rows]
        widths = [max(len(line[c]) for line in lines) for c in range(len(self.header))]
        rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
        return "\n".join(
            "| " + " | ".join([name.ljust(widths[0]), *map(str.rjust, cells, widths[1:])]) + " |"
            for name, *cells in [self.header, rule, *self.rows]
        )

    def csv(self, source):
        """Below the rows, each in a row of its own, are how to read it and what it is of."""
        text = io.StringIO()
        rest = [""] * (len(self.header) - 1)
        notes = [[note, *rest] for note in (self.caption, source) if note]
        # A hyphen alone would be the item of a list where the file is shown.
        rows = [["–" if cell == "-" else cell for cell in row] for row in self.rows]
        csv.writer(text, lineterminator="\n").writerows([self.header, *rows, *notes])
        return text.getvalue()


class Rows(list):
    """Rows whose cells are of things of one kind, such as scenes."""

    def __init__(self, columns):
        super().__init__()
        self.columns = list(columns)

    def add(self, what, cell):
        self.append([what, *map(cell, self.columns)])


def chosen(parts, kind, names=None):
    """The parts whose names are `kind_NAME`, by NAME, in the order of the set; only these names if
    any are given."""
    start = kind + "_"
    found = {name[len(start) :]: part for name, part in parts.items() if name.startswith(start)}
    return {name: part for name, part in found.items() if names is None or name in names}


def digits(value, count=3):
    """That many significant digits, without an exponent."""
    decimals = count - 1 if value == 0 else count - 1 - math.floor(math.log10(abs(value)))
    return f"{value:,.{min(max(decimals, 0), 7)}f}"


def count(value):
    return f"{value:,.0f}"


def _unit(seconds):
    return next((unit for unit in UNITS if seconds >= 0.9995 * unit[1]), UNITS[-1])


def time(seconds):
    unit, scale = _unit(seconds)
    return f"{digits(seconds / scale)} {unit}"


def time_and_interval(runs):
    """Median, and the ends of its 95 % interval in the same unit."""
    scale = _unit(runs.median())[1]
    low, high = (digits(end / scale) for end in interval.of_median(runs))
    return f"{time(runs.median())} ({low} to {high})"


def percent(part, whole):
    return f"{100 * part / whole:.3g} %"


def title(name):
    """`Embree/refit_2_threads` as in a table."""
    return name.replace("/", ", ").replace("_", " ")
