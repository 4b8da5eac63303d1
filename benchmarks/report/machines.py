# SPDX-License-Identifier: BSD-3-Clause
"""The main tables: a column for each kind of machine that has measured them.

What a machine has measured stays in docs/measured/machines.json until the same machine measures it
again, so that a table can be written without the other machines.
"""

import json
import re
from dataclasses import dataclass

from tables import Table

# A machine like another one in all but its processor is told by that and its code.
SOURCE = re.compile(
    r"(?P<command>`[^`]*`, )(?P<machine>[^;]*)(?P<rest>;.*)(?P<code>; commit [^;]*)", re.DOTALL
)


@dataclass
class MainTable:
    name: str  # as in the documents' marks
    title: str
    cells: dict  # by row; of the machine that has measured
    caption: str = ""  # how to read it

    def table(self, found):
        """`found`: cells by machine."""
        rows = [[row, *(cells.get(row, "-") for cells in found.values())] for row in self.cells]
        return Table(self.name, self.title, ["", *found], rows, self.caption)


def read(path):
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def renewed(known, table, machine, source):
    """Cells and source by machine, with those of this one anew."""
    found = dict(known.get(table.name, {}))
    found[machine] = {"cells": table.cells, "source": source}
    return dict(sorted(found.items()))


def markdown(table, found, newest):
    """The table, and what each of its columns is of. `newest`: the machine that measured last."""
    cells = {machine: measured["cells"] for machine, measured in found.items()}
    code = SOURCE.fullmatch(found[newest]["source"])["code"].split()[-1]
    sources, told = [], None
    for measured in found.values():
        match = SOURCE.fullmatch(measured["source"])
        alike = match["command"] + match["rest"]
        source = match["machine"] + match["code"] if alike == told else match[0]
        told = told or alike
        is_older = match["code"].split()[-1] != code
        sources.append(source.removesuffix(".") + " (older)." if is_older else source)
    return table.table(cells).markdown() + "\n\n" + "\\\n".join(sources)
