# SPDX-License-Identifier: BSD-3-Clause
"""Figures in sentences, each of which is a cell of a table in the documents:

    <!-- =TABLE > ROW > COLUMN -->text<!-- -->

They stand in README and in docs/*.md, not at the beginning of a line. TABLE is the name of a table
with a mark, or of a file in docs/measured. ROW begins the names of one row, joined by "; ". COLUMN
is a header, or "*" for the least and the greatest number of the row, those aside that the paper has
published. "COLUMN / N" is the Nth part of cells with a slash. The text is the cell without its
interval. So a sentence has the figure of the table that stands in the documents, whatever that
table is of.
"""

import csv
import re

from tables import MARK, documents

FIGURE = re.compile(r"(<!-- =([^\n]+?) > ([^\n]+?) > ([^\n]+?) -->)([^<]*)(<!-- -->)")
START = "<!-- ="
FIRST_IN_LINE = re.compile(r"^\s*" + START, re.MULTILINE)
SIGN, NUMBER, UNIT = r"about |[~>]?", r"-?[\d,]*\.?\d+(?:e-?\d+)?", r" ?(?:%|s|ms|us|ns|M|x)?"
CELL = re.compile(rf"({SIGN})({NUMBER})({UNIT})(?: to ({SIGN})({NUMBER})({UNIT}))?(?= |$)")
EMPTY = ("-", "\N{EN DASH}", "not given", "")
PART = re.compile(r"(.+) / (\d)")
PUBLISHED = "the paper's"  # how the headers of such columns begin
MEASURED = ("docs", "measured")


class TableOfDocuments:
    def __init__(self, name, lines):
        self.name, self.header, self.rows = name, lines[0], lines[1:]

    def row(self, start):
        """The one row whose names begin so."""

        def names(row):
            return "; ".join(row)

        found = [row for row in self.rows if names(row).startswith(start)]
        exact = [row for row in found if row[0] == start or names(row).startswith(start + ";")]
        found = exact if len(exact) == 1 else found
        if len(found) != 1:
            raise ValueError(f"{self.name}: {len(found)} rows begin with '{start}', not one")
        return found[0]

    def figure(self, start, column):
        part = PART.fullmatch(column) if column not in self.header else None
        column = part[1] if part else column
        cells = dict(zip(self.header[1:], self.row(start)[1:]))
        if part:
            cells = {header: part_of(cell, int(part[2])) for header, cell in cells.items()}
        if column == "*":
            return span([c for header, c in cells.items() if not header.startswith(PUBLISHED)])
        if column not in cells:
            raise ValueError(f"{self.name}: there is no column '{column}'")
        text = text_of(cells[column])
        if not any(map(str.isdigit, text)):
            raise ValueError(f"{self.name}: '{start}' has no number in the column '{column}'")
        return text


def part_of(cell, number):
    """Nothing if the cell has fewer."""
    parts = cell.split(" / ")
    return parts[number - 1] if number <= len(parts) else ""


def text_of(cell):
    """Without the interval or what an estimate was made in place of, and in words."""
    text = cell.split(" (")[0].split("; ")[-1]
    return re.sub(r"(?<=\d)x$", " times", text)


def span(cells):
    """The least and the greatest number of cells in one unit. A cell without a number is left out
    only if it is empty."""
    ends = []
    for cell in cells:
        match = CELL.match(text_of(cell))
        if match:
            ends += [match.group(*range(first, first + 3)) for first in (1, 4) if match[first + 1]]
        elif cell not in EMPTY:
            raise ValueError(f"'{cell}' has no number for the least and the greatest of its row")
    ends.sort(key=lambda end: float(end[1].replace(",", "")))
    if not ends or len({unit for _, _, unit in ends[:1] + ends[-1:] if unit}) > 1:
        raise ValueError(f"{cells} have no numbers in one unit")
    first, last = ends[0], ends[-1]
    text = "".join(last)
    return text if first[1] == last[1] else f"{first[0]}{first[1]} to {text}"


def cells_of(line):
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def tables_of(root):
    """Those of the documents, by name."""
    found = {}

    def add(name, lines):
        if name in found:
            raise ValueError(f"there are two tables {name}")
        found[name] = TableOfDocuments(name, lines)

    for path in documents(root):
        for mark in MARK.finditer(path.read_text(encoding="utf-8")):
            lines = [line for line in mark[4].splitlines() if line.startswith("|")]
            if lines:
                add(mark[2], [cells_of(line) for line in (lines[0], *lines[2:])])
    for path in sorted(root.joinpath(*MEASURED).glob("*.csv")):
        with path.open(encoding="utf-8", newline="") as file:
            add(path.stem, list(csv.reader(file)))
    return found


def fill(root, write=True):
    """Writes all figures, and returns the documents in which one was another."""
    tables, changed = tables_of(root), []
    for path in documents(root):

        def figure(mark):
            head, name, row, column, _, foot = mark.groups()
            if name not in tables:
                raise ValueError(f"{path.name}: there is no table {name}")
            return head + tables[name].figure(row, column) + foot

        text = path.read_text(encoding="utf-8")
        renewed, count = FIGURE.subn(figure, text)
        if count != text.count(START):
            raise ValueError(f"{path.name}: a mark that begins with '{START}' is not complete")
        if FIRST_IN_LINE.search(text):
            raise ValueError(f"{path.name}: a mark at the beginning of a line ends its paragraph")
        if renewed != text:
            changed.append(path.relative_to(root).as_posix())
            if write:
                path.write_text(renewed, encoding="utf-8")
    return changed
