# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the page share: opening one, looking at it, clicking in it."""

import io
import json
import os
from pathlib import Path

from browser import Browser, find_driver
from PIL import Image
from program import ProgramTest

DRIVER = find_driver()
STATE = "document.querySelector('.fiber-viewer').dataset.state"
VIEWER = "document.querySelector('.fiber-viewer').viewer"


def is_red(pixel):
    red, green, blue = pixel
    return red > 150 and red > 2 * green and red > 2 * blue


def is_fiber(pixel):
    """Brown to blond; neither the background nor the panels' greys."""
    red, green, blue = pixel
    return red > blue + 25 and red >= green > blue and not is_red(pixel)


def is_blue(pixel):
    """A fiber of the second group."""
    red, green, blue = pixel
    return blue > 90 and blue > 1.25 * green > 1.25 * red


def is_green(pixel):
    """A contact with a mesh."""
    red, green, blue = pixel
    return green > 120 and green > 1.5 * red and green > 1.5 * blue


def is_mesh(pixel):
    """Lighter than the background, and of nearly no colour."""
    red, green, blue = pixel
    return 75 < red <= green <= blue < red + 40


def is_drawn(pixel):
    return is_red(pixel) or is_fiber(pixel)


class Picture:
    """A screenshot, and what is counted in the part that no panel covers."""

    def __init__(self, png):
        self.png = png
        whole = Image.open(io.BytesIO(png)).convert("RGB")
        seen = whole.crop((30, 200, whole.width - 30, whole.height - 110))
        flat = list(seen.getdata())
        self.inside = [flat[i : i + seen.width] for i in range(0, len(flat), seen.width)]

    def count(self, predicate):
        return sum(predicate(pixel) for row in self.inside for pixel in row)

    def width(self):
        """Columns in which anything is drawn."""
        return sum(any(map(is_drawn, column)) for column in zip(*self.inside))

    def differing(self, other):
        return sum(
            sum(map(abs, (a - b for a, b in zip(p, q)))) > 24
            for mine, its in zip(self.inside, other.inside)
            for p, q in zip(mine, its)
        )


class PageTest(ProgramTest):
    """What a test does to a page, and reads from it."""

    @classmethod
    def setUpClass(cls):
        cls.browser = Browser(DRIVER, 900, 640)

    @classmethod
    def tearDownClass(cls):
        cls.browser.quit()

    def make(self, *scenes):
        path = self.folder / "page.html"
        self.run_program("view", *scenes, "-o", path)
        return path

    def first_frame(self, page):
        data = page.read_text(encoding="utf-8").split('class="fiber-viewer-data">', 1)[1]
        return json.loads(data.split("</script>", 1)[0])["scenes"][0]["frames"][0]

    def hair(self, name, strands, points):
        """A file of strands, 40 side by side, of points(strand's place)."""
        blocks = (points(0.1 * (s % 40), 0.1 * (s // 40)) for s in range(strands))
        lines = ("\n".join(" ".join(map(str, p)) for p in block) for block in blocks)
        return self.write(name, "\n\n".join(lines) + "\n")

    def text(self, selector):
        return self.browser.evaluate(f"document.querySelector('{selector}').textContent")

    def on_screen(self, point):
        """Where a point of the file is seen, in pixels."""
        return self.browser.evaluate(
            f"(() => {{ const v = {VIEWER}, m = v.frames.scene.middle, p = {list(point)};"
            "const seen = new THREE.Vector3(...p.map((x, k) => x - m[k])).project(v.eye.camera);"
            "return [(1 + seen.x) * innerWidth / 2, (1 - seen.y) * innerHeight / 2]; })()"
        )

    def click_at(self, x, y):
        self.browser.mouse("mousePressed", x, y, button="left", clickCount=1)
        self.browser.mouse("mouseReleased", x, y, button="left", clickCount=1)

    def open(self, path, state=""):
        self.browser.open(f"file://{path}{state}")
        self.browser.wait_for(f"document.querySelector('.fiber-viewer') && {STATE}")
        self.assertEqual(self.browser.evaluate(STATE), "drawn")

    def look(self, name):
        """What is seen once all that was asked for has been drawn."""
        self.browser.wait_for(f"!{VIEWER}.pending")
        picture = Picture(self.browser.screenshot())
        folder = os.environ.get("FCL_FIBERS_SCREENSHOTS")
        if folder:
            Path(folder, name + ".png").write_bytes(picture.png)
        return picture

    def click(self, selector):
        x, y = self.browser.evaluate(
            f"(() => {{ const b = document.querySelector('{selector}').getBoundingClientRect();"
            "return [b.x + b.width / 2, b.y + b.height / 2]; })()"
        )
        self.click_at(x, y)

    def farthest_seen(self):
        """Of all points from the picture's middle: 1 is its edge, and beyond it behind the eye."""
        self.browser.wait_for(f"!{VIEWER}.pending")
        return self.browser.evaluate(
            f"(() => {{ const v = {VIEWER}, p = v.frames.get(v.state.frame).points; let far = 0;"
            "for (let i = 0; i < p.length; i += 3) {"
            "const seen = new THREE.Vector3(p[i], p[i + 1], p[i + 2]).project(v.eye.camera);"
            "far = Math.max(far, Math.abs(seen.x), Math.abs(seen.y), Math.abs(seen.z)); }"
            "return far; })()"
        )
