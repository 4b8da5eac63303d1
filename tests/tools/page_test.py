# SPDX-License-Identifier: BSD-3-Clause
"""The page that `fcl_fibers view` writes, in a headless Chromium. FCL_FIBERS_SCREENSHOTS names a
folder that keeps what is seen."""

import base64
import csv
import html
import io
import json
import struct
import sys
import unittest

try:
    from page import DRIVER, STATE, VIEWER, PageTest
    from page import is_blue, is_drawn, is_fiber, is_green, is_mesh, is_red
    from PIL import Image
    from program import box
except ImportError:
    DRIVER, PageTest = None, unittest.TestCase


def any_drawn(line):
    return any(map(is_drawn, line))


@unittest.skipUnless(DRIVER, "Chromium and Selenium are not installed")
class Page(PageTest):
    def test_shows_fibers_and_contacts_without_a_network(self):
        """An empty canvas, or one without its red segments, or a page that needs a server."""
        path = self.make("helix:fibers=150,segments=60,radius=0.01")
        self.open(path, "#red=1&markers=0")
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
        self.click("[name=red]")
        picture = self.look("report")
        self.assertGreater(picture.count(is_fiber), 3000)
        self.assertGreater(picture.count(is_red), 100)
        self.assertEqual(self.browser.requests(), [f"file://{report}"])
        self.assertEqual(self.browser.problems(), [])

    def test_is_drawn_inside_a_notebook(self):
        """A frame without an address of its own would open the notebook within itself."""
        page = self.make("helix:fibers=150,segments=60,radius=0.01").read_text(encoding="utf-8")
        notebook = self.write(
            "notebook.html",
            '<!doctype html><meta charset="utf-8"><body style="margin:0">'
            f'<iframe style="width:900px; height:600px" srcdoc="{html.escape(page)}"></iframe>',
        )
        self.browser.open(f"file://{notebook}")
        self.browser.driver.switch_to.frame(0)
        self.browser.wait_for(f"document.querySelector('.fiber-viewer') && {STATE} === 'drawn'")
        zooms = f"{VIEWER}.eye.controls.enableZoom"
        self.assertFalse(self.browser.evaluate(zooms), "the wheel scrolls the page around it")
        self.browser.driver.find_element("tag name", "canvas").click()
        self.assertTrue(self.browser.evaluate(zooms))
        self.browser.driver.find_element("name", "red").click()
        self.assertGreater(self.look("notebook").count(is_red), 100)
        self.assertEqual(self.browser.evaluate("location.href"), "about:srcdoc")
        self.assertEqual(self.browser.requests(), [f"file://{notebook}"])
        self.assertEqual(self.browser.problems(), [])

    def test_records_the_loads_of_a_guide_filament(self):
        """A recording would bend the assembly otherwise than the filament that was seen."""
        page = self.make("paper-dynamic:fibers=5,segments=20,frames=0:100:50", "--record")
        self.open(page)
        guide = f"{VIEWER}.drawn.find(drawn => drawn.rod)"
        # A torque of 2 pi B / L closes the circle. With a force of B / L^2 the tip of the elastica
        # is deflected by 0.3017 L (Bisshopp and Drucker, 1945).
        tip = self.browser.evaluate(
            f"(() => {{ const rod = {guide}.rod, L = rod.length, B = rod.stiffness;"
            "  const none = new THREE.Vector3();"
            "  rod.bend(none, new THREE.Vector3(2 * Math.PI * B / L, 0, 0));"
            "  const tips = [rod.tip.toArray().map(x => x / L)];"
            "  rod.straighten();"
            "  rod.bend(new THREE.Vector3(B / (L * L), 0, 0), none);"
            "  tips.push(rod.tip.toArray().map(x => x / L));"
            "  rod.straighten();"
            "  return tips; })()"
        )
        for k in range(3):
            self.assertAlmostEqual(tip[0][k], 0, delta=1e-5)
        self.assertAlmostEqual(tip[1][0], 0.3017, delta=5e-5)

        self.click("[name=record]")
        place = (
            f"(() => {{ const seen = {guide}.rod.tip.clone().add({guide}.group.position);"
            f"  seen.project({VIEWER}.eye.camera);"
            "  return [(seen.x + 1) / 2 * innerWidth, (1 - seen.y) / 2 * innerHeight]; })()"
        )
        x, y = self.browser.evaluate(place)
        self.browser.drag(x, y, x - 200, y + 20)
        self.assertLess(self.browser.evaluate(place)[0], x - 20)
        # A rod that is pressed beyond Euler's load would snap to another shape than it replays.
        self.assertFalse(
            self.browser.evaluate(
                f"(() => {{ const seen = {guide}.rod, rod = new seen.constructor(seen);"
                "  const load = -1.1 * Math.PI ** 2 / 4 * rod.stiffness / rod.length ** 2;"
                "  return rod.bend(new THREE.Vector3(0, 0, load), new THREE.Vector3()); })()"
            )
        )
        states = self.browser.evaluate(f"{guide}.text").splitlines()[2:]
        self.assertEqual(states[0], "0 0 0 0 0 0")
        self.assertGreater(len(states), 3)
        self.assertIn(f"{len(states)} states", self.browser.evaluate(f"{guide}.panel.textContent"))
        loads = self.write("loads.txt", self.browser.evaluate(f"{guide}.text"))

        # The assembly is bent to the side that the tip was drawn to, as far as it. The loads of a
        # fiber deviate by some percent of those of the guide filament.
        tip = self.browser.evaluate(f"{guide}.rod.tip.toArray()")
        bent = self.folder / "bent.txt"
        scene = "paper-dynamic:fibers=200,segments=50"
        self.run_program("generate", scene, "--loads", loads, "-o", bent)
        fibers = [
            [[float(n) for n in line.split()] for line in fiber.splitlines()]
            for fiber in bent.read_text().strip().split("\n\n")
        ]
        for k in range(3):
            ways = [fiber[-1][k] - fiber[0][k] for fiber in fibers]
            self.assertAlmostEqual(sum(ways) / len(ways), tip[k], delta=0.1)
        self.assertGreater(abs(tip[0]) + abs(tip[1]), 3)

        # With Shift the mouse turns the tip and leaves the force, and a button saves the states.
        before = self.browser.evaluate(place)[0]
        turned = self.browser.evaluate(
            f"(() => {{ const force = {guide}.rod.force.clone();"
            f"  {guide}.drag(30, 0, true);"
            f"  return [{guide}.rod.force.distanceTo(force), {guide}.rod.torque.length()]; }})()"
        )
        self.assertEqual(turned[0], 0)
        self.assertGreater(turned[1], 0)
        self.assertGreater(self.browser.evaluate(place)[0], before)
        self.browser.evaluate(
            "(() => { HTMLAnchorElement.prototype.click = function() { window.saved = this; }; })()"
        )
        self.click("[name=save]")
        saved = self.browser.evaluate("window.saved.download")
        self.assertEqual(saved, "recorded_loads.txt")
        self.assertEqual(self.browser.problems(), [])
        self.assertNotIn("GuideRod", self.make("paper-dynamic:fibers=2").read_text())

    def test_only_what_touches_is_red(self):
        """Other segments than those that touch would be shown as touching."""
        crossing = self.write("crossing.txt", "0 0 0\n0 1 0\n0 2 0\n0 3 0\n\n-1 1.5 0\n1 1.5 0\n")
        address = "#red=1&markers=0"
        self.open(self.make(crossing, "-r", 0.05), address)
        picture = self.look("crossing")
        red, fiber = picture.count(is_red), picture.count(is_fiber)
        # One third of the upright fiber, all of the other: 3 of 5 units of length, but that red
        # lines are drawn a little thicker.
        self.assertGreater(red, 0.45 * (red + fiber))
        self.assertLess(red, 0.75 * (red + fiber))
        apart = self.write("apart.txt", "0 0 0\n0 1 0\n0 2 0\n0 3 0\n\n1 1.5 0\n3 1.5 0\n")
        self.open(self.make(apart, "-r", 0.05), address)
        self.assertEqual(self.look("apart").count(is_red), 0)

    def test_draws_cones(self):
        """A segment that tapers would be as thick everywhere as at one of its ends, or between."""
        for end, ratio in (1, 1), (0.1, 0.775 / 0.325):
            neuron = self.write("neuron.swc", f"1 3 0 0 0 1 -1\n2 3 10 0 0 {end} 1\n")
            self.open(self.make(neuron))
            rows = self.look(f"cone_{end}").inside
            along = max((rows, [*zip(*rows)]), key=lambda lines: sum(map(any_drawn, lines)))
            widths = [sum(map(is_drawn, line)) for line in along if any_drawn(line)]
            a, b = widths[len(widths) // 4], widths[3 * len(widths) // 4]
            # A pixel more or less on either side.
            self.assertAlmostEqual(max(a, b) / min(a, b), ratio, delta=0.2 * ratio)

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

    def test_plays_a_step(self):
        """An impact would be shown at another instant or place, or as a mere contact."""
        fall = "0 0 0\n1 0 0\n\n0.5 -1 {0}\n0.5 1 {0}\n".format
        start, end = self.write("start.txt", fall(1)), self.write("end.txt", fall(-1))
        page = self.make(start, "--end", end, "-r", 0.1)
        for frame, text in ((0, "0 impacts at the start"), (13, "1 impact since the instant")):
            self.open(page, f"#frame={frame}")
            self.assertIn(f"{text}", self.text(".counts"))
            self.assertIn("1 in the step", self.text(".counts"))
        self.look("step")
        self.click_at(*self.on_screen([0.5, 0, 0.1]))
        self.assertEqual(
            self.text(".picked"), "fiber 0, segment 0 first touches fiber 1, segment 0 at time 0.4"
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

    def test_all_points_are_in_the_picture(self):
        """A sample of every second point would not see that strands of 16 points end far out."""
        hair = self.hair(
            "hair.txt", 1500, lambda x, y: [(x, y, -0.01 * i if i < 15 else -9) for i in range(16)]
        )
        for scene in (hair, "-r", 0.01), ("cap:fibers=20000,segments=15",):
            self.open(self.make(*scene))
            self.assertLessEqual(self.farthest_seen(), 1)
            self.browser.evaluate(f"{VIEWER}.eye.look({{azimuth: 70, elevation: -40, zoom: 1}})")
            self.assertLessEqual(self.farthest_seen(), 1)
            self.assertGreater(self.look("all_points").count(is_drawn), 8000)

    def test_one_stray_fiber_does_not_make_all_others_tiny(self):
        hair = self.hair("hair.txt", 400, lambda x, y: [(x, y, 0.2 * i) for i in range(16)])
        stray = "\n900 0 0\n900 0 1\n"
        hair.write_text(hair.read_text(encoding="utf-8") + stray, encoding="utf-8")
        self.open(self.make(hair, "-r", 0.01))
        self.assertGreater(self.look("stray").width(), 200)

    def test_finds_and_takes_the_axis_that_is_up(self):
        """Hair would hang sideways, and orbits would tip it over."""
        hair = self.hair("hair.txt", 400, lambda x, z: [(x, -i, z) for i in range(16)])
        page = self.make(hair, "-r", 0.01)
        self.open(page)
        up = f"{VIEWER}.state.up"
        self.assertEqual(self.browser.evaluate(up), "y")
        self.assertLess(self.on_screen((2, 0, 0.5))[1], self.on_screen((2, -15, 0.5))[1] - 200)
        self.browser.evaluate(
            "(() => { const up = document.querySelector('[name=up]'); up.value = 'x';"
            "up.dispatchEvent(new Event('change')); })()"
        )
        self.assertLess(self.on_screen((4, -7, 0.5))[1], self.on_screen((0, -7, 0.5))[1] - 20)
        before = self.browser.evaluate(f"{VIEWER}.eye.view")
        self.browser.drag(450, 350, 600, 350)
        after = self.browser.evaluate(f"{VIEWER}.eye.view")
        self.assertGreater(abs(after["azimuth"] - before["azimuth"]), 10)
        self.assertAlmostEqual(after["elevation"], before["elevation"], 3)
        self.open(page, "#up=z")
        self.assertEqual(self.browser.evaluate(up), "z")
        self.run_program("view", hair, "-r", 0.01, "--up", "x", "-o", page)
        self.open(page)
        self.assertEqual(self.browser.evaluate(up), "x")
        self.open(self.crossing())
        self.assertEqual(self.browser.evaluate(up), "y", "all is nearly in the plane of x and y")

    def crossing(self):
        """At x = 0.5 and y = 0 the surfaces overlap between z = 0.04 and z = 0.06."""
        text = "-1 0 0\n0 0 0\n1 0 0\n\n0.5 -1 0.1\n0.5 1 0.1\n"
        return self.make(self.write("crossing.txt", text), "-r", 0.06)

    def test_marks_contacts_where_they_are(self):
        page = self.crossing()
        markers = self.first_frame(page)["markers"]
        self.assertEqual(struct.unpack("<4I", base64.b64decode(markers["segments"])), (0, 1, 1, 0))
        for name, number in ("distances", -0.02), ("depths", 1 / 6):
            (found,) = struct.unpack("<f", base64.b64decode(markers[name]))
            self.assertAlmostEqual(found, number, 6)
        self.open(page)
        place = self.browser.evaluate(
            f"Array.from({VIEWER}.frames.get(0).markers.places)"
            f".map((x, k) => x + {VIEWER}.frames.scene.middle[k])"
        )
        for found, number in zip(place, (0.5, 0, 0.05)):
            self.assertAlmostEqual(found, number, 6)
        x, y = self.on_screen((0.5, 0, 0.05))
        picture = Image.open(io.BytesIO(self.look("marker").png)).convert("RGB")
        self.assertTrue(is_red(picture.getpixel((round(x), round(y)))))
        self.assertEqual(self.text(".deepest"), "16.7 % of the radii's sum")
        self.click("[name=markers]")
        self.assertEqual(self.look("no_marker").count(is_red), 0)

        helix = "helix:fibers=150,segments=60,radius=0.01"
        count = json.loads(self.run_program("check", helix, "--json", code=1))["contact_count"]
        self.open(self.make(helix))
        seen = f"{VIEWER}.markers[0].mesh.geometry.maxInstancedCount"
        self.assertEqual(self.browser.evaluate(seen), count)

    def test_tells_what_was_clicked(self):
        self.open(self.crossing())
        self.click_at(*self.on_screen((0.5, 0, 0.05)))
        self.assertEqual(
            self.text(".picked"),
            "fiber 0, segment 1 touches fiber 1, segment 0; 0.02 deep, 16.7 % of the radii's sum",
        )
        before = self.look("picked_marker")
        self.click_at(*self.on_screen((-0.5, 0, 0)))
        self.assertEqual(self.text(".picked"), "fiber 0, segment 0")
        self.assertGreater(self.look("picked_fiber").differing(before), 1000)
        hidden = "document.querySelector('.picked').hidden"
        self.click_at(880, 600)
        self.assertTrue(self.browser.evaluate(hidden))
        self.click_at(*self.on_screen((0.5, 0.7, 0.1)))
        self.assertEqual(self.text(".picked"), "fiber 1, segment 0")
        self.assertFalse(self.browser.evaluate(hidden))
        for kind in "keyDown", "keyUp":
            self.browser.call("Input.dispatchKeyEvent", type=kind, key="Escape")
        self.assertTrue(self.browser.evaluate(hidden))

    def test_groups_have_colours_and_names(self):
        """Nobody would see which of two bundles a fiber is of."""
        first = self.write("first.txt", "-1 -9 0\n-1 9 0\n\n1 -9 0\n1 9 0\n")
        second = self.write("second.txt", "-9 0 0.3\n9 0 0.3\n")
        scenes = (first, second, "-r", 0.2)
        self.open(self.make(*scenes, "--groups"), "#markers=0")
        picture = self.look("groups")
        self.assertGreater(picture.count(is_blue), 500)
        self.assertGreater(picture.count(is_fiber), 1000)
        names = self.browser.evaluate(
            "[...document.querySelectorAll('.groups div')].map(line => line.textContent)"
        )
        self.assertEqual(names, ["first.txt: 2 fibers", "second.txt: 1 fiber"])
        self.click_at(*self.on_screen((4, 0, 0.3)))
        self.assertEqual(self.text(".picked"), "fiber 0 of second.txt, segment 0")
        self.click("[name=markers]")
        self.look("groups_marked")
        self.click_at(*self.on_screen((1, 0, 0.15)))
        self.assertIn(
            "fiber 1 of first.txt, segment 0 touches fiber 0 of second.txt, segment 0; 0.1 deep",
            self.text(".picked"),
        )
        self.assertEqual(self.browser.problems(), [])
        numbers = self.write("n.txt", "0 0 0 3\n0 9 0 3\n\n1 0 0 -1\n1 9 0 -1\n")
        self.open(self.make(numbers, "-r", 0.2, "--groups-from", 4))
        self.assertEqual(self.text(".groups"), "group -1: 1 fibergroup 3: 1 fiber")
        self.click_at(*self.on_screen((0, 5, 0)))
        self.assertEqual(self.text(".picked"), "fiber 0 of group 3, segment 0")
        self.open(self.make(*scenes))
        self.assertEqual(self.look("no_groups").count(is_blue), 0)

    def test_tells_the_segment_of_the_file_where_not_all_points_are_drawn(self):
        line = self.write("line.txt", "".join(f"{x} 0 0\n" for x in range(2003)))
        page = self.make(line, "-r", 0.3, "--points", 1000)
        self.open(page, "#camera=90,10,30,1234,0,0")
        for number in 1233, 1234, 1235:
            self.click_at(*self.on_screen((number + 0.5, 0, 0)))
            self.assertEqual(self.text(".picked"), f"fiber 0, segment {number}")
        self.open(page)
        self.assertIn("point drawn", self.text(".drawn"))
        for at in 0.5, 1234, 2001.5:
            self.click_at(*self.on_screen((at, 0, 0)))
            number = int(self.text(".picked").removeprefix("fiber 0, segment "))
            # A pixel of this line is about three segments wide.
            self.assertLess(abs(number + 0.5 - at), 4)
            self.assertLess(number, 2002)

    def test_the_address_opens_what_was_seen(self):
        page = self.make("helix:fibers=150,segments=60")
        self.open(page, "#camera=30,20,2&up=y&bare=1&markers=0&red=1&touching=1")
        view = self.browser.evaluate(f"{VIEWER}.eye.view")
        for name, number in ("azimuth", 30), ("elevation", 20), ("zoom", 2):
            self.assertAlmostEqual(view[name], number, 3)
        state = self.browser.evaluate(f"{VIEWER}.state")
        self.assertEqual((state["up"], state["markers"], state["red"]), ("y", 0, 1))
        shown = "[...document.querySelectorAll('.panel, .hint')].filter(p => p.offsetHeight).length"
        self.assertEqual(self.browser.evaluate(shown), 0)

        self.open(page)
        self.assertGreater(self.browser.evaluate(shown), 2)
        start = self.look("address_start")
        self.browser.drag(450, 350, 650, 300)
        turned = self.look("address_turned")
        self.assertGreater(turned.differing(start), 3000)
        address = self.browser.evaluate("location.hash")
        self.assertIn("camera=", address)
        seen = self.on_screen((1, 1, 1)) + self.on_screen((-1, 0, 2))
        self.open(page, address)
        for now, then in zip(self.on_screen((1, 1, 1)) + self.on_screen((-1, 0, 2)), seen):
            self.assertLess(abs(now - then), 3)

    def test_shows_the_deepest_of_too_many_contacts(self):
        scene = "helix:fibers=46,segments=10,radius=20"
        frame = self.first_frame(self.make(scene))
        depths = [
            -float(row["distance"]) / 40
            for row in csv.DictReader(
                io.StringIO(self.run_program("check", scene, "--csv", code=1))
            )
        ]
        self.assertEqual(frame["contacts"], len(depths))
        self.assertGreater(len(depths), 100000)
        shown = struct.unpack("<100000f", base64.b64decode(frame["markers"]["depths"]))
        for found, number in zip(shown, sorted(depths)[-100000:]):
            self.assertAlmostEqual(found, number, 6)

    def on_box(self):
        """Fiber 0 lies on a box, 0.01 deep; fiber 1 is behind it, and fiber 2 above."""
        self.write("box.obj", box((-2, -2, -1), (2, 2, 1)))
        fibers = self.write(
            "fibers.txt", "-1 0 1.05\n1 0 1.05\n\n-4 -1 0\n-4 1 0\n\n0 -1 3\n0 1 3\n"
        )
        return self.make(fibers, "-r", 0.06, "--mesh", self.folder / "box.obj", "--up", "z")

    def test_draws_meshes_and_marks_their_contacts(self):
        """Hair would hang on nothing, or its contacts with the head would look like the others."""
        page = self.on_box()
        self.open(page, "#camera=0,20,1")
        solid = self.look("mesh_solid")
        self.assertGreater(solid.count(is_mesh), 20000)
        self.assertGreater(solid.count(is_green), 10)
        self.assertEqual(
            self.text(".counts").split(" \u00b7 ")[2], "0 touching pairs, 1 with meshes"
        )
        self.assertEqual(self.text(".of-meshmarkers .deepest"), "0.01 deep")
        self.click("[name=meshmarkers]")
        self.assertEqual(self.look("mesh_unmarked").count(is_green), 0)
        seen = {}
        for how, name in (1, "solid"), (2, "glass"), (0, "none"):
            self.open(page, f"#camera=0,20,1&mesh={how}&meshmarkers=0")
            picture = self.look("mesh_" + name)
            seen[name] = picture.count(is_mesh), picture.count(is_fiber)
        self.assertLess(seen["none"][0], 100)
        self.assertGreater(seen["none"][1], seen["solid"][1] + 300, "fiber 1 is behind the mesh")
        self.assertGreater(seen["glass"][1], seen["solid"][1] + 200, "glass hides nothing")
        self.assertEqual(self.browser.problems(), [])
        self.open(self.crossing())
        self.assertNotIn("with meshes", self.text(".counts"))
        self.assertTrue(self.browser.evaluate("document.querySelector('[name=mesh]').hidden"))

    def test_tells_which_triangle_was_clicked(self):
        page = self.on_box()
        self.open(page, "#camera=0,20,1")
        (contact,) = json.loads(
            self.run_program(
                *("check", self.folder / "fibers.txt", "-r", 0.06, "--json"),
                *("--mesh", self.folder / "box.obj"),
                code=1,
            )
        )["contacts"]
        self.click_at(*self.on_screen(contact["point_b"]))
        self.assertEqual(
            self.text(".picked"),
            f"fiber 0, segment 0 touches box.obj, triangle {contact['triangle']}; 0.01 deep",
        )
        self.click_at(*self.on_screen((-0.8, 0, 1.05)))
        self.assertEqual(self.text(".picked"), "fiber 0, segment 0")
        self.click_at(*self.on_screen((0, 0, 3)))
        self.assertEqual(self.text(".picked"), "fiber 2, segment 0")
        behind = self.on_screen((-4, 0.5, 0))
        self.click_at(*behind)
        self.assertRegex(self.text(".picked"), r"^box\.obj, triangle \d+$")
        triangle = int(self.text(".picked").rsplit(" ", 1)[1])
        self.assertIn(triangle, (2, 3), "those of the top")
        for how in 0, 2:
            self.open(page, f"#camera=0,20,1&mesh={how}")
            self.click_at(*behind)
            self.assertEqual(self.text(".picked"), "fiber 1, segment 0")

    def test_the_mesh_is_in_the_picture(self):
        self.write("box.obj", box((-20, -2, -9), (2, 5, 1)))
        fibers = self.write("fibers.txt", "-1 0 1.05\n1 0 1.05\n")
        self.open(self.make(fibers, "-r", 0.06, "--mesh", self.folder / "box.obj"))
        for x, y in map(self.on_screen, ((-20, -2, -9), (2, 5, 1), (-20, 5, 1), (2, -2, -9))):
            self.assertTrue(0 < x < 900 and 0 < y < 640, (x, y))

    def test_a_radius_far_too_large_ends_with_a_warning(self):
        """All segments touch: memory would run out."""
        page = self.make("helix:fibers=70,segments=100,radius=1000")
        self.assertIn("more than 10,000,000 pairs, so the page", self.stderr)
        self.open(page)
        self.assertIn("more than 10,000,000 touching pairs", self.text(".counts"))
        self.assertIn("the search stopped there", self.text(".drawn"))
        self.assertIn("the 100,000 deepest contacts shown", self.text(".drawn"))


if __name__ == "__main__":
    if not DRIVER:
        print(
            "Chromium's driver, Selenium or Pillow is missing: no page is looked at",
            file=sys.stderr,
        )
        sys.exit(77)
    unittest.main()
