# SPDX-License-Identifier: BSD-3-Clause
"""The main tables: a column for each kind of machine that has measured them.

What a machine has measured stays in docs/measured/machines.json until the same machine measures it
again, so that a table can be written without the other machines.
"""

import json
from dataclasses import dataclass

from tables import Table


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


def markdown(table, found):
    """The table, and what each of its columns is of."""
    cells = {machine: measured["cells"] for machine, measured in found.items()}
    sources = "\n".join(measured["source"] + "\\" for measured in found.values())
    return table.table(cells).markdown() + "\n\n" + sources.removesuffix("\\")
