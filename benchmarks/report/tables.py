# SPDX-License-Identifier: BSD-3-Clause
"""Numbers as text, and tables as Markdown; page.html has them as HTML."""

import math
import re
from dataclasses import dataclass

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


class Rows(list):
    """Rows whose cells are of things of one kind, such as scenes."""

    def __init__(self, columns):
        super().__init__()
        self.columns = list(columns)

    def add(self, what, cell):
        self.append([what, *map(cell, self.columns)])


def chosen(parts, form, names):
    """By name, the parts that were measured, whose names are `form` with it."""
    return {name: parts[form.format(name)] for name in names if form.format(name) in parts}


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


def time_and_range(runs):
    """Median, and the least and the greatest in the same unit."""
    scale = _unit(runs.median())[1]
    return f"{time(runs.median())} ({digits(runs.min() / scale)} to {digits(runs.max() / scale)})"


def times_and_range(runs):
    """The same of ratios."""
    return f"{digits(runs.median())}x ({digits(runs.min())} to {digits(runs.max())})"


def percent(part, whole):
    return f"{100 * part / whole:.3g} %"


def title(name):
    """`Embree/refit_2_threads` as in a table."""
    return name.replace("/", ", ").replace("_", " ")
