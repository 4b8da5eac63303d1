# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of fcl_fibers share: running it, and readers of what it writes that owe nothing to
it."""

import base64
import json
import os
import re
import struct
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path

PROGRAM = os.environ["FCL_FIBERS_PROGRAM"]

# Fiber 1 crosses fiber 0 in the middle of its second segment, 0.01 above; fiber 2 is far away.
CROSSING = """# three fibers
0 0 0
1 0 0
2 0 0
3 0 0

1.5 -1 0.01
1.5 1 0.01

0 0 50
0 1 50
"""
SEGMENTS = ("fiber_a", "number_a", "fiber_b", "number_b")
CONTACT_COLUMNS = [
    *("fiber_a", "number_a", "s", "fiber_b", "number_b", "t", "distance"),
    *(f"{name}_{axis}" for name in ("point_a", "point_b", "normal") for axis in "xyz"),
]
# In CSV after these, if there are meshes.
MESH_COLUMNS = ["mesh", "triangle", "weight_0", "weight_1", "weight_2", "solid"]


def box(low, high):
    """A box as a Wavefront OBJ file, counterclockwise from outside. Its faces are quadrangles."""
    points = [[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)]
    faces = "1 3 4 2\n5 6 8 7\n1 2 6 5\n3 7 8 4\n1 5 7 3\n2 4 8 6".split("\n")
    lines = [f"v {x} {y} {z}" for x, y, z in points] + [f"f {face}" for face in faces]
    return "\n".join(lines) + "\n"


class ProgramTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def run_program(self, *arguments, code=0):
        """stdout, of a run that has to end with this code."""
        done = subprocess.run(
            [PROGRAM, *(word if isinstance(word, bytes) else str(word) for word in arguments)],
            capture_output=True,
            encoding="utf-8",
            check=False,
        )
        self.assertEqual(done.returncode, code, f"{arguments}: {done.stderr}")
        self.stderr = done.stderr
        if code in (0, 1):
            self.assertNotIn("\r", done.stderr, "progress where there is no terminal")
        return done.stdout

    def page_of(self, *arguments):
        """The scene of a page."""
        page = self.folder / "page.html"
        self.run_program("view", *arguments, "-o", page)
        data = page.read_text(encoding="utf-8").split('class="fiber-viewer-data">', 1)[1]
        (scene,) = json.loads(data.split("</script>", 1)[0])["scenes"]
        return scene

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text, encoding="utf-8")
        return path

    def files(self):
        return sorted(path.name for path in self.folder.iterdir())


TYPES = {"Int32": "i", "Int64": "q", "UInt8": "B", "Float64": "d"}


def read_vtp(path):
    """Points, cells by kind, and arrays of points and of cells."""
    root = ElementTree.parse(path).getroot()
    assert root.tag == "VTKFile" and root.get("byte_order") == "LittleEndian"
    assert root.get("header_type") == "UInt64" and root.get("compressor") is None
    piece = root.find("PolyData/Piece")

    def numbers(array):
        assert array.get("format") == "binary"
        data = base64.b64decode(array.text, validate=True)
        code = TYPES[array.get("type")]
        (size,) = struct.unpack("<Q", data[:8])
        assert size == len(data) - 8
        return list(struct.unpack(f"<{size // struct.calcsize(code)}{code}", data[8:]))

    def arrays(tag):
        return {a.get("Name"): numbers(a) for a in piece.findall(f"{tag}/DataArray")}

    flat = arrays("Points")["Points"]
    points = list(zip(flat[0::3], flat[1::3], flat[2::3]))
    assert len(points) == int(piece.get("NumberOfPoints"))
    cells = {}
    for kind in ("Verts", "Lines", "Strips", "Polys"):
        found = arrays(kind)
        ends = found.get("offsets", [])
        corners = found.get("connectivity", [])
        assert len(ends) == int(piece.get("NumberOf" + kind))
        assert (ends[-1] if ends else 0) == len(corners)
        cells[kind] = [corners[a:b] for a, b in zip([0] + ends, ends)]
    cell_data = arrays("CellData")
    point_data = arrays("PointData")
    assert all(len(a) == sum(map(len, cells.values())) for a in cell_data.values())
    assert all(len(a) == len(points) for a in point_data.values())
    return points, cells, point_data, cell_data


def read_polylines(path):
    """Fibers as lists of points."""
    blocks = re.split(r"\n\s*\n", Path(path).read_text(encoding="utf-8").strip())
    return [[tuple(map(float, line.split())) for line in b.splitlines()] for b in blocks]
