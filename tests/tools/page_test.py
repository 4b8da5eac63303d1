# SPDX-License-Identifier: BSD-3-Clause
"""The page that `fcl_fibers view` writes, in a headless Chromium. FCL_FIBERS_SCREENSHOTS names a
folder that keeps what is seen."""

import io
import os
import sys
import unittest
from pathlib import Path

from program import ProgramTest

try:
    from browser import Browser, find_driver
    from PIL import Image

    DRIVER = find_driver()
except ImportError:
    DRIVER = None
STATE = "document.querySelector('.fiber-viewer').dataset.state"
VIEWER = "document.querySelector('.fiber-viewer').viewer"


def is_red(pixel):
    red, green, blue = pixel
    return red > 150 and red > 2 * green and red > 2 * blue


def is_fiber(pixel):
    """Brown to blond; neither the background nor the panels' greys."""
    red, green, blue = pixel
    return red > blue + 25 and red >= green > blue and not is_red(pixel)


def is_drawn(pixel):
    return is_red(pixel) or is_fiber(pixel)


class Picture:
    """A screenshot, and what is counted in the part that no panel covers."""

    def __init__(self, png):
        self.png = png
        whole = Image.open(io.BytesIO(png)).convert("RGB")
        seen = whole.crop((30, 130, whole.width - 30, whole.height - 110))
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


@unittest.skipUnless(DRIVER, "Chromium and Selenium are not installed")
class PageTest(ProgramTest):
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
        self.browser.mouse("mousePressed", x, y, button="left", clickCount=1)
        self.browser.mouse("mouseReleased", x, y, button="left", clickCount=1)

    def test_shows_fibers_and_contacts_without_a_network(self):
        """An empty canvas, or one without its red segments, or a page that needs a server."""
        path = self.make("helix:fibers=150,segments=60,radius=0.01")
        self.open(path)
        picture = self.look("helix")
        self.assertGreater(picture.count(is_fiber), 5000)
        self.assertGreater(picture.count(is_red), 200)
        self.assertEqual(self.browser.requests(), [f"file://{path}"])
        self.assertEqual(self.browser.problems(), [])

        self.click("[name=red]")
        plain = self.look("strand_plain")
        self.assertEqual(plain.count(is_red), 0)
        self.assertGreater(plain.count(is_fiber), 5000)

    def test_is_drawn_inside_a_report(self):
        """The report of the paper's experiments would show an empty frame."""
        part = self.folder / "part.html"
        self.run_program(
            "view", "helix:fibers=150,segments=60,radius=0.01", "--fragment", "-o", part
        )
        report = self.write(
            "report.html",
            '<!doctype html><meta charset="utf-8"><body style="margin:0">'
            f'<div style="height:600px">{part.read_text(encoding="utf-8")}</div><p>Below.</p>',
        )
        self.open(report)
        picture = self.look("report")
        self.assertGreater(picture.count(is_fiber), 3000)
        self.assertGreater(picture.count(is_red), 100)
        self.assertEqual(self.browser.requests(), [f"file://{report}"])
        self.assertEqual(self.browser.problems(), [])

    def test_only_what_touches_is_red(self):
        """Other segments than those that touch would be shown as touching."""
        crossing = self.write("crossing.txt", "0 0 0\n0 1 0\n0 2 0\n0 3 0\n\n-1 1.5 0\n1 1.5 0\n")
        self.open(self.make(crossing, "-r", 0.05))
        picture = self.look("crossing")
        red, fiber = picture.count(is_red), picture.count(is_fiber)
        # One third of the upright fiber, all of the other: 3 of 5 units of length, but that red
        # lines are drawn a little thicker.
        self.assertGreater(red, 0.45 * (red + fiber))
        self.assertLess(red, 0.75 * (red + fiber))
        apart = self.write("apart.txt", "0 0 0\n0 1 0\n0 2 0\n0 3 0\n\n1 1.5 0\n3 1.5 0\n")
        self.open(self.make(apart, "-r", 0.05))
        self.assertEqual(self.look("apart").count(is_red), 0)

    def test_orbits_and_zooms(self):
        self.open(self.make("helix:fibers=150,segments=60"))
        first = self.look("orbit_before")
        self.browser.drag(450, 350, 650, 300)
        turned = self.look("orbit_after")
        self.assertGreater(turned.differing(first), 3000)
        self.assertGreater(turned.count(is_fiber), 3000)
        for _ in range(8):
            self.browser.mouse("mouseWheel", 450, 320, deltaX=0, deltaY=-240)
        near = self.look("zoom")
        # 8 turns of 5 % each make 1.5; the ends, of another width, leave the picture.
        self.assertGreater(near.width(), 1.25 * turned.width())
        self.click("[name=reset]")
        self.assertLess(self.look("reset").differing(first), 50)
        self.assertEqual(self.browser.problems(), [])

    def test_shows_volumes(self):
        """Volumes of another depth or kind than asked for, or none."""
        path = self.make("helix:fibers=60,segments=60")
        self.open(path)
        without = self.look("no_volumes")
        seen = []
        for kind in ("boxes", "spheres"):
            for depth in (0, 2):
                self.open(path, f"#volumes={kind}&depth={depth}")
                picture = self.look(f"{kind}_{depth}")
                self.assertGreater(picture.differing(without), 1500, (kind, depth))
                for other in seen:
                    self.assertGreater(picture.differing(other), 1500, (kind, depth))
                seen.append(picture)
                count = self.browser.evaluate(
                    f"{VIEWER}.volumes.group.children[0].geometry.maxInstancedCount"
                )
                self.assertTrue(count == 1 if depth == 0 else 8 < count <= 64, count)
        self.assertEqual(self.browser.problems(), [])

    def test_plays_the_motion(self):
        self.open(self.make("paper-dynamic:fibers=30,segments=40,frames=0:100:10"))
        self.assertEqual(self.browser.evaluate(f"{VIEWER}.state.frame"), 10)
        self.browser.evaluate(f"{VIEWER}.set({{frame: 0}})")
        start = self.look("dynamic_start")
        self.click("[name=play]")
        self.browser.wait_for(f"{VIEWER}.state.frame === 10 && !{VIEWER}.playing")
        end = self.look("dynamic_end")
        self.assertGreater(end.differing(start), 1000)
        self.assertGreater(end.count(is_fiber), 500)
        self.assertEqual(
            self.browser.evaluate("document.querySelector('.time output').textContent"), "frame 100"
        )
        self.assertEqual(self.browser.problems(), [])

    def test_changes_scenes(self):
        self.open(self.make("helix:fibers=20,segments=20", "cap:fibers=200,segments=20"))
        first = self.look("first_scene")
        self.click(".scenes button:nth-child(2)")
        second = self.look("second_scene")
        self.assertGreater(second.differing(first), 3000)
        self.assertIn(
            "200 fibers", self.browser.evaluate("document.querySelector('.counts').textContent")
        )


if __name__ == "__main__":
    if not DRIVER:
        print(
            "Chromium's driver, Selenium or Pillow is missing: no page is looked at",
            file=sys.stderr,
        )
        sys.exit(77)
    unittest.main()
