# SPDX-License-Identifier: BSD-3-Clause
"""The page of show(), and the program that python -m runs."""

import html
import json
import re
import signal
import subprocess
import sys

import numpy as np
import pytest

import fcl_fibers
from scenes import cross, tetrahedron


def scene_of(page):
    found = re.search(r'class="fiber-viewer-data">(.*?)</script>', page.html, re.DOTALL)
    return json.loads(found[1])["scenes"][0]


def program(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "fcl_fibers", *map(str, arguments)],
        capture_output=True,
        text=True,
        **options,
    )


def test_the_page_has_the_fibers_and_contacts():
    points, offsets = cross(gap=0.1)
    scene = scene_of(fcl_fibers.show(points, offsets, 0.1, title="a <b>"))
    assert (scene["name"], scene["fibers"], scene["segments"]) == ("a <b>", 2, 2)
    assert scene["frames"][0]["contacts"] == 1
    assert scene["frames"][0]["meshContacts"] == 0
    apart = fcl_fibers.show(points, offsets, 0.01)
    assert scene_of(apart)["frames"][0]["contacts"] == 0
    assert scene_of(fcl_fibers.show(points, offsets, 0.01, margin=0.1))["frames"][0]["contacts"]


def test_meshes_are_shown():
    points, offsets = cross()
    mesh = fcl_fibers.TriangleMesh(*tetrahedron())
    page = fcl_fibers.show(points, offsets, 0.1, meshes=[mesh])
    assert scene_of(page)["frames"][0]["meshContacts"] > 0
    mesh.set_pose(np.eye(3), (9, 9, 9))
    page = fcl_fibers.show(points, offsets, 0.1, meshes=[mesh])
    assert scene_of(page)["frames"][0]["meshContacts"] == 0


def test_a_notebook_gets_a_frame_that_holds_the_page():
    page = fcl_fibers.show([[(0, 0, 0), (1, 0, 0)]], radii=0.1, height=321)
    frame = page._repr_html_()
    assert 'height="321"' in frame
    assert html.unescape(re.search(r'srcdoc="([^"]*)"', frame)[1]) == page.html
    assert page.html.startswith("<!doctype html>")


def test_a_page_is_saved(tmp_path):
    page = fcl_fibers.show([[(0, 0, 0), (1, 0, 0)]], radii=0.1, title="Zöpfe")
    page.save(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == page.html
    assert "Zöpfe" in page.html


@pytest.mark.parametrize(
    "arguments, text",
    [
        (dict(up="w"), "up"),
        (dict(depth=9), "depth"),
        (dict(most_points=1), "most_points"),
        (dict(radii=None), "radii are missing"),
        (dict(margin=-1.0), "margin"),
        (dict(points=[]), "no segment"),
        (dict(meshes=[tetrahedron()]), "TriangleMesh"),
        (dict(ignored_neighbors=None), "ignored_neighbors is None"),
        (dict(margin="a"), "margin is 'a'"),
        (dict(depth=2.5), "depth is 2.5"),
    ],
)
def test_wrong_arguments_are_named(arguments, text):
    given = {"points": [[(0, 0, 0), (1, 0, 0)]], "radii": 0.1, **arguments}
    with pytest.raises((TypeError, ValueError), match=text):
        fcl_fibers.show(**given)


def test_the_program_checks_measures_and_shows(tmp_path):
    points, offsets = cross(gap=0.1)
    file = tmp_path / "cross.txt"
    fcl_fibers.write(file, points, offsets)
    found = program("check", file, "--radius", 0.1, "--json")
    assert found.returncode == 1, found.stderr
    contact = json.loads(found.stdout)["contacts"][0]
    assert contact["distance"] == pytest.approx(-0.1)
    assert program("check", file, "--radius", 0.01).returncode == 0
    assert "fibers          2" in program("info", file).stdout
    shown = program("view", file, "--radius", 0.1, "-o", tmp_path / "page.html")
    assert shown.returncode == 0, shown.stderr
    assert "fiber-viewer" in (tmp_path / "page.html").read_text()


def test_the_program_tells_the_distance(tmp_path):
    points, _ = cross(gap=0.75)
    files = [tmp_path / "a.txt", tmp_path / "b.txt"]
    for file, first in zip(files, (0, 2)):
        fcl_fibers.write(file, points[first : first + 2], [0, 2])
    found = program("distance", *files, "--radius", 0.25, "--json")
    assert found.returncode == 0, found.stderr
    nearest = json.loads(found.stdout)["nearest"]
    assert nearest["distance"] == pytest.approx(0.25)
    assert (nearest["fiber_a"], nearest["fiber_b"]) == (0, 0)
    assert "the least distance is 0.25\n" in program("distance", *files, "--radius", 0.25).stdout


def test_the_program_trades(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    points, _ = cross(gap=0.75)
    fcl_fibers.write(tmp_path / "a.txt", points, [0, 2, 4])
    found = program("trade", tmp_path / "a.txt", "--radius", 0.4, "--json")
    assert found.returncode == 0, found.stderr
    answer = json.loads(found.stdout)
    assert (answer["contacts"], answer["chosen"]["missed"]) == (1, 0)
    # FCL's managers are not in the package.
    assert not [row for row in answer["rows"] if "FCL" in row["dial"]]


def test_the_program_tells_how_it_is_called():
    assert "Usage: python -m fcl_fibers" in program("--help").stdout
    # What needs FCL is not there, and neither are the scenes that a program makes.
    wrong = program("replay", "record.txt")
    assert wrong.returncode == 2
    wrong = program("info", "helix")
    assert wrong.returncode == 2
    assert "python -m fcl_fibers: 'helix': there is no file of that name" in wrong.stderr


def test_interrupt_ends_the_program():
    # It reads from standard input, which stays open. What a shell starts in the background ignores
    # interrupts, and so does what that starts.
    script = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from fcl_fibers.__main__ import main; print('ready', flush=True); main()"
    )
    command = [sys.executable, "-c", script, "info", "-"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) != 0
