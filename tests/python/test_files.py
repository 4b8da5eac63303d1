# SPDX-License-Identifier: BSD-3-Clause
"""Files that are written and read again, damaged files, and writes that fail."""

import copy
import gzip
import os
import pathlib
import pickle
import resource
import stat
import subprocess
import sys
import warnings

import numpy as np
import pytest

import fcl_fibers
from scenes import random_scene

DATA = pathlib.Path(__file__).parent.parent / "data"


def scene_of(dtype=float):
    """Fibers of at least one point, as a file has no others."""
    scene = random_scene(1, dtype=dtype)
    kept = np.diff(scene.offsets) > 0
    offsets = np.concatenate([[0], np.cumsum(np.diff(scene.offsets)[kept])])
    return scene.points, offsets, scene.radii


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("ending", ["vtp", "hair", "txt"])
@pytest.mark.parametrize("as_path", [str, pathlib.Path])
def test_points_come_back(tmp_path, ending, dtype, as_path):
    points, offsets, radii = scene_of(dtype)
    path = as_path(tmp_path / f"fibers.{ending}")
    fcl_fibers.write(path, points, offsets, None if ending == "txt" else 0.125)
    found = fcl_fibers.read(path)
    assert found.points.dtype == np.float64 and found.offsets.dtype == np.int64
    exact = points.astype(np.float32) if ending == "hair" else points
    assert found.points.tobytes() == exact.astype(float).tobytes()
    assert (found.offsets == offsets).all() and found.closed is None
    if ending == "txt":
        assert found.radii is None
    else:
        assert set(np.ravel(found.radii).tolist()) == {0.125}
    again = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    again.build(*found) if found.radii is not None else again.build(*found[:2], 0.125)
    assert again.segment_count == len(points) - len(offsets) + 1


def test_extreme_numbers_come_back(tmp_path):
    points = np.array(
        [(0.1, -0.0, 5e-324), (1e308, -1 / 3, 2.0**-1022), (1e-7, 1e16, np.pi), (1, 2, 3)]
    )
    for ending in ("vtp", "txt"):
        path = tmp_path / f"fibers.{ending}"
        fcl_fibers.write(path, points, [0, 2, 4], 5e-324)
        assert fcl_fibers.read(path).points.tobytes() == points.tobytes()


@pytest.mark.parametrize("ending", ["vtp", "hair"])
def test_kinds_of_radii(tmp_path, ending):
    points = np.arange(21.0).reshape(7, 3)
    offsets = np.array([0, 3, 7])
    path = tmp_path / f"fibers.{ending}"
    for radii, expected in [
        (0.5, [0.5] * 7),
        ([0.5, 0.25], [0.5] * 3 + [0.25] * 4),
        ([0.5, 0.5, 0.25, 0.25, 0.25], [0.5] * 3 + [0.25] * 4),
        (np.full(7, 0.5, np.float32), [0.5] * 7),
    ]:
        fcl_fibers.write(path, points, offsets, radii)
        found = fcl_fibers.read(path).radii
        assert np.broadcast_to(found, 7).tolist() == expected
    assert fcl_fibers.read(path, radius=3).radii == 3.0


@pytest.mark.filterwarnings("ignore:.*has no place for branches")
@pytest.mark.parametrize("ending", ["vtp", "hair"])
def test_radii_at_points(tmp_path, ending):
    """A narrow place of one point would be lost where fibers are read and written."""
    path = tmp_path / "neuron.swc"
    path.write_text("1 1 0 0 0 3 -1\n2 3 10 0 0 .5 1\n3 3 20 0 0 3 2\n")
    fibers = fcl_fibers.read(path)
    assert isinstance(fibers.radii, fcl_fibers.PointRadii) and len(fibers) == 4
    assert fibers.radii.tolist() == [3, 0.5, 3] and fibers.radii.dtype == np.float64
    out = tmp_path / f"out.{ending}"

    def written(*fibers):
        fcl_fibers.write(out, *fibers)
        return fcl_fibers.read(out)

    for given in (fibers, copy.deepcopy(fibers), pickle.loads(pickle.dumps(fibers))):
        assert written(given).radii.tolist() == [3, 0.5, 3]
        assert written(*given).radii.tolist() == [3, 0.5, 3]
    # A segment's radius is that of both its ends, if it is not less than that of its neighbor.
    plain = np.asarray(fibers.radii)
    assert written(fibers.points, fibers.offsets, plain).radii.tolist() == [3, 3, 0.5]
    for more in ([0, 3], None, 1.0), ([0, 3],):
        with pytest.raises(TypeError, match="fibers come with"):
            fcl_fibers.write(out, fibers, *more)
    with pytest.raises(ValueError, match="radii at points have shape"):
        fcl_fibers.write(out, fibers.points, fibers.offsets, fibers.radii[:2])
    # The tree has cones: at the narrow place nothing is as far from the axis.
    tree = fcl_fibers.FiberTree()
    tree.build(*fibers)
    assert len(tree.pairs(fcl_fibers.SphereShape((10, 1.3, 0), 0.1))) == 0
    tree.build(fibers.points, fibers.offsets, plain)
    assert len(tree.pairs(fcl_fibers.SphereShape((10, 1.3, 0), 0.1))) == 1


def test_branches_and_samples(tmp_path):
    """A neuron would fall apart into fibers, and nobody could find a contact in its file."""
    path = tmp_path / "neuron.swc"
    rows = ["1 1 0 0 0 3 -1", "2 3 1 0 0 .5 1", "5 3 2 0 0 3 2", "4 2 1 1 0 1 2"]
    path.write_text("\n".join(rows) + "\n")
    fibers = fcl_fibers.read(path)
    assert fibers.starts_at.tolist() == [-1, 1, 1] and fibers.starts_at.dtype == np.int32
    assert fibers.ends_at is None
    assert fibers.samples.tolist() == [1, 2, 2, 5, 2, 4] and fibers.samples.dtype == np.int64
    assert fibers.types.tolist() == [1, 3, 3, 3, 3, 2]
    out = tmp_path / "out.vtp"
    fibers.ends_at = np.array([-1, -1, -1])
    fcl_fibers.write(out, fibers)
    found = fcl_fibers.read(out)
    for name in ("points", "offsets", "radii", "starts_at", "samples", "types"):
        assert getattr(found, name).tolist() == getattr(fibers, name).tolist(), name
    assert found.ends_at is None
    assert '"contacts":0' in fcl_fibers.show(fibers).html
    for name, wrong, error in (
        ("starts_at", [-1, 1], "starts_at are 2 for 3 fibers"),
        ("starts_at", [-1, 1, 6], "starts_at of fiber 2 is 6"),
        ("starts_at", [-2, 1, 1], "starts_at of fiber 0 is -2"),
        ("starts_at", [0, 1, 1], "starts_at of fiber 0 is 0"),
        ("ends_at", [-1, 0, -1], "ends_at of fiber 1 is 0"),
        ("samples", [1], "samples are 1 for 6 points"),
    ):
        broken = copy.copy(fibers)
        setattr(broken, name, wrong)
        with pytest.raises(ValueError, match=error):
            fcl_fibers.write(out, broken)


def neuron_of(folder):
    path = folder / "neuron.swc"
    path.write_text("1 1 0 0 0 3 -1\n2 3 1 0 0 .5 1\n5 3 2 0 0 3 2\n4 2 1 1 0 1 2\n")
    return path


def test_copies_keep_branches_and_samples(tmp_path):
    fibers = fcl_fibers.read(neuron_of(tmp_path))
    more = ("starts_at", "ends_at", "samples", "types")
    assert [getattr(fibers, name) is None for name in more] == [False, True, False, False]
    copies = [
        copy.copy(fibers),
        copy.deepcopy(fibers),
        fibers._replace(),
        fibers._replace(radii=2 * fibers.radii),
        fibers.__replace__(radii=0.5),  # as copy.replace() of Python 3.13
        *(pickle.loads(pickle.dumps(fibers, level)) for level in range(6)),
    ]
    for found in copies:
        assert type(found) is fcl_fibers.Fibers and (found.points == fibers.points).all()
        for name in more:
            assert np.array_equal(getattr(found, name), getattr(fibers, name)), name
    assert (copies[3].radii == 2 * fibers.radii).all()
    assert isinstance(copies[3].radii, fcl_fibers.PointRadii)
    for name in more:
        found = fibers._replace(closed=None, **{name: [7]})
        assert getattr(found, name) == [7]
        for other in set(more) - {name}:
            assert getattr(found, other) is getattr(fibers, other)
        assert not np.array_equal(getattr(fibers, name), [7])
    with pytest.raises((TypeError, ValueError), match="radius"):
        fibers._replace(radius=1)


@pytest.mark.parametrize("ending", ["hair", "txt"])
def test_a_file_without_branches_and_samples_is_warned_of(tmp_path, ending):
    source, out = neuron_of(tmp_path), tmp_path / f"out.{ending}"
    # Python's warning is that of the program.
    command = [sys.executable, "-m", "fcl_fibers", "convert", source, out]
    told = subprocess.run(command, check=True, text=True, stderr=subprocess.PIPE).stderr
    text = "has no place for branches, samples and types; write .vtp to keep them"
    fibers = fcl_fibers.read(source)
    bare = fibers._replace(**dict.fromkeys(vars(fibers)))
    for name, array in vars(fibers).items():
        if array is None:
            continue
        with pytest.warns(fcl_fibers.FiberFileWarning, match=text) as caught:
            fcl_fibers.write(out, bare._replace(**{name: array}))
        assert len(caught) == 1 and caught[0].filename == __file__
        assert str(caught[0].message) in told
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fcl_fibers.write(tmp_path / "out.vtp", fibers)
        fcl_fibers.write(out, *fibers)
        fcl_fibers.write(out, bare._replace(starts_at=[-1] * 3, ends_at=[-1] * 3))
        before = out.read_bytes()
        with pytest.raises(fcl_fibers.FiberFileWarning):
            fcl_fibers.write(out, fibers._replace(points=fibers.points + 1))
    assert out.read_bytes() == before


def test_where_radii_are(tmp_path):
    text = tmp_path / "points.txt"
    text.write_text("0 0 0 .5 1\n1 0 0 .5 1\n")
    with pytest.warns(fcl_fibers.FiberFileWarning, match="radius_from 4 takes"):
        assert fcl_fibers.read(text).radii is None
    with pytest.warns(fcl_fibers.FiberFileWarning, match="after the radius"):
        assert fcl_fibers.read(text, radius_from=4).radii == 0.5
    assert fcl_fibers.read(text, radius_from="5").radii == 1
    vtp = tmp_path / "lines.vtp"
    fcl_fibers.write(vtp, [np.eye(3)], radii=0.25)
    vtp.write_text(vtp.read_text().replace('"radius"', '"Tübe"'))
    with pytest.warns(fcl_fibers.FiberFileWarning, match="point data"):
        assert fcl_fibers.read(vtp).radii is None
    assert fcl_fibers.read(vtp, radius_from="Tübe").radii == 0.25
    with pytest.raises(ValueError, match="no array 'x', which radius_from names"):
        fcl_fibers.read(vtp, radius_from="x")
    wrongs = (("", ValueError), ("Tübe\0", ValueError), (2.5, TypeError), (b"Tube", TypeError))
    for wrong, error in wrongs:
        with pytest.raises(error, match="radius_from is .*; give the name of an array, or the num"):
            fcl_fibers.read(vtp, radius_from=wrong)
    with pytest.raises(ValueError, match="radius_from"):
        fcl_fibers.read(vtp, 0.5, radius_from="Tübe")


def test_where_groups_are(tmp_path):
    """Fibers of one group would meet, or those of two would not."""
    text = tmp_path / "points.txt"
    text.write_text("".join(f"0 0 {i} {g}\n1 0 {i} {g}\n\n" for i, g in enumerate((8, 8, -1, 8))))
    fibers = fcl_fibers.read(text, radius=0.6, groups_from=4)
    assert fibers.groups.tolist() == [2, 2, 1, 2] and fibers.group_values.tolist() == [-1, 8]
    tree = fcl_fibers.FiberTree()
    tree.build(fibers)
    assert tree.pairs().tolist() == [[2, 4], [4, 6]]
    tree.build(fibers, groups=[0] * 4)
    assert len(tree.pairs()) == 3
    assert fibers._replace(radii=1.0).groups is fibers.groups
    with pytest.warns(fcl_fibers.FiberFileWarning):
        assert fcl_fibers.read(text).groups is None
    with pytest.raises(ValueError, match="groups_from is '3'"):
        fcl_fibers.read(text, groups_from=3)
    with pytest.raises(TypeError, match="groups_from is 2.5"):
        fcl_fibers.read(text, groups_from=2.5)


def test_packed_files(tmp_path):
    path = tmp_path / "points.txt.gz"
    path.write_bytes(gzip.compress(b"1 2 3\n4 5 6\n"))
    assert fcl_fibers.read(path).points.tolist() == [[1, 2, 3], [4, 5, 6]]
    with pytest.raises(ValueError, match="pack it by gzip"):
        fcl_fibers.write(path, [np.eye(3)])


@pytest.mark.parametrize("ending", ["vtp", "hair", "txt"])
def test_closed_fibers(tmp_path, ending):
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0)], float)
    path = tmp_path / f"fibers.{ending}"
    fcl_fibers.write(path, [square, square[:3]], radii=0.1, closed=[True, False])
    found = fcl_fibers.read(path)
    assert found.closed.dtype == bool and found.closed.tolist() == [True, False]
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=1)
    tree.build(found.points, found.offsets, 0.1, found.closed, groups=[1, 1])
    assert tree.fiber_count == 2


@pytest.mark.parametrize("ending", ["vtp", "hair", "txt"])
def test_empty_fibers_are_kept_or_refused(ending, tmp_path):
    path = tmp_path / f"fibers.{ending}"
    points = np.arange(9.0).reshape(3, 3)
    offsets = [0, 0, 2, 2, 3, 3]
    if ending != "vtp":
        with pytest.raises(ValueError, match="fiber 0 has no points; leave it out, or write a"):
            fcl_fibers.write(path, points, offsets, 0.5)
        assert list(tmp_path.iterdir()) == []
        return
    fcl_fibers.write(path, points, offsets, 0.5)
    fibers = fcl_fibers.read(path)
    assert (fibers.points == points).all() and fibers.offsets.tolist() == offsets


def test_results_own_their_memory(tmp_path):
    points, offsets, radii = scene_of()
    fcl_fibers.write(tmp_path / "a.vtp", points, offsets, radii)
    found = fcl_fibers.read(tmp_path / "a.vtp")
    os.unlink(tmp_path / "a.vtp")
    [np.full(points.shape, 7.0) for _ in range(100)]
    assert (found.points == points).all() and found.points.flags.writeable
    assert found.points.flags.c_contiguous and found.radii.dtype == np.float64


@pytest.mark.parametrize("name", ["radii.vtp", "rings.txt", "ascii_none_little_h32_float.vtp"])
def test_files_of_others(name):
    found = fcl_fibers.read(DATA / name)
    assert found.points.shape == (found.offsets[-1], 3) and found.offsets[0] == 0
    assert (found.radii is None) == (name != "radii.vtp")
    assert found.closed.any()
    tree = fcl_fibers.FiberTree()
    tree.build(found.points, found.offsets, 0.1, found.closed)


def test_what_cannot_be_opened(tmp_path):
    for path in (tmp_path / "no.vtp", str(tmp_path / "no" / "no.txt"), ""):
        with pytest.raises(FileNotFoundError):
            fcl_fibers.read(path)
    with pytest.raises(IsADirectoryError):
        fcl_fibers.read(tmp_path)
    for wrong in (None, 3.5, object()):
        with pytest.raises(TypeError):
            fcl_fibers.read(wrong)
    with pytest.raises((ValueError, FileNotFoundError)):
        fcl_fibers.read("a\0b.txt")


def test_damaged_files(tmp_path):
    points, offsets, radii = scene_of()
    path = tmp_path / "fibers.hair"
    fcl_fibers.write(path, points, offsets, radii)
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(ValueError, match=r"fibers\.hair.*byte"):
        fcl_fibers.read(path)
    text = tmp_path / "fibers.txt"
    text.write_text("0 0 0\n1 0 0\n1 nonsense 0\n")
    with pytest.raises(ValueError, match=r"fibers\.txt.*line 3"):
        fcl_fibers.read(text)
    text.write_text("0 0 nan\n1 0 0\n")
    with pytest.raises(ValueError, match="line 1"):
        fcl_fibers.read(text)
    unknown = tmp_path / "fibers.xyz"
    unknown.write_bytes(b"\x01\x02\x03")
    with pytest.raises(ValueError, match=r"fibers\.xyz"):
        fcl_fibers.read(unknown)
    vtp = tmp_path / "fibers.vtp"
    fcl_fibers.write(vtp, points, offsets, radii)
    vtp.write_bytes(vtp.read_bytes()[:-100])
    with pytest.raises(ValueError, match=r"fibers\.vtp"):
        fcl_fibers.read(vtp)


def test_options_of_reading(tmp_path):
    path = tmp_path / "fibers.txt"
    path.write_text("0 0 0\n1 0 0\n")
    assert fcl_fibers.read(path, np.float32(0.5)).radii == 0.5
    for wrong, error in (
        (-1, ValueError),
        (np.nan, ValueError),
        ("1", TypeError),
        ([1], TypeError),
    ):
        with pytest.raises(error, match="radius"):
            fcl_fibers.read(path, wrong)
    for wrong, error in (
        (0, ValueError),
        (1001, ValueError),
        (2.5, TypeError),
        (2**40, ValueError),
    ):
        with pytest.raises(error, match="segments_per_span"):
            fcl_fibers.read(path, segments_per_span=wrong)


def test_warnings(tmp_path, recwarn):
    path = tmp_path / "fibers.hair"
    points, offsets, _ = scene_of()
    fcl_fibers.write(path, points, offsets, 0.25)
    fcl_fibers.read(path)
    assert len(recwarn) == 0
    path.write_bytes(path.read_bytes() + b"more")
    with pytest.warns(fcl_fibers.FiberFileWarning, match=r"fibers\.hair: ") as caught:
        fcl_fibers.read(path)
    assert caught[0].filename == __file__
    assert issubclass(fcl_fibers.FiberFileWarning, UserWarning)


@pytest.mark.parametrize("name", ["fibers.vtk", "fibers", "fibers.HAIR2", ".vtp", "fibers.vtp.gz"])
def test_other_endings(tmp_path, name):
    with pytest.raises(ValueError, match=r"\.vtp, \.hair or \.txt"):
        fcl_fibers.write(tmp_path / name, [np.zeros((2, 3))])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", ["vtp", "hair", "txt"])
@pytest.mark.parametrize("exists", [False, True])
def test_a_write_that_fails_changes_nothing(tmp_path, ending, exists, monkeypatch):
    path = tmp_path / f"fibers.{ending}"
    good = np.zeros((2, 3))
    if exists:
        path.write_text("old")
    before = sorted(tmp_path.iterdir())

    def unchanged():
        assert sorted(tmp_path.iterdir()) == before
        assert not exists or path.read_text() == "old"

    for arguments, error in [
        (dict(points=[np.full((2, 3), np.nan)]), ValueError),
        (dict(points=good, offsets=[0, 3]), ValueError),
        (dict(points=[good], radii=-1.0), ValueError),
        (dict(points=[good], radii=[1.0, np.inf]), ValueError),
        (dict(points=[good], closed=[1, 1]), ValueError),
        (dict(points=[np.eye(3)], closed=[1]), ValueError),
        (dict(points=[]), ValueError),
        (dict(points=[good * 1j]), TypeError),
        (dict(points=good), TypeError),
        (dict(points=None), TypeError),
    ]:
        with pytest.raises(error):
            fcl_fibers.write(path, **arguments)
        unchanged()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="No space"):
        fcl_fibers.write(path, [good])
    unchanged()


@pytest.mark.parametrize("ending", ["vtp", "hair", "txt"])
def test_a_full_disk(tmp_path, ending):
    path = tmp_path / f"fibers.{ending}"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        # Python ignores the signal, so that a write beyond this size fails.
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, before[1]))
        with pytest.raises(OSError):
            fcl_fibers.write(path, [np.random.default_rng(1).uniform(size=(5000, 3))])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert list(tmp_path.iterdir()) == []


def test_folders_that_cannot_be_written_to(tmp_path):
    with pytest.raises(FileNotFoundError, match="gone.fibers.txt"):
        fcl_fibers.write(tmp_path / "gone" / "fibers.txt", [np.zeros((2, 3))])
    folder = tmp_path / "fibers.txt"
    folder.mkdir()
    with pytest.raises(OSError):
        fcl_fibers.write(folder, [np.zeros((2, 3))])
    assert list(tmp_path.iterdir()) == [folder] and list(folder.iterdir()) == []


@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_permissions_follow_the_mask(tmp_path, mask):
    path = tmp_path / "fibers.vtp"
    before = os.umask(mask)
    try:
        for _ in range(2):
            fcl_fibers.write(path, [np.zeros((2, 3))])
            assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~mask
        assert os.umask(mask) == mask
    finally:
        os.umask(before)


def test_relative_paths(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fcl_fibers.write("fibers.txt", [np.eye(3)])
    fcl_fibers.write(b"bytes.txt".decode(), [np.eye(3)])
    assert (fcl_fibers.read("fibers.txt").points == np.eye(3)).all()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bytes.txt", "fibers.txt"]


def test_names_beyond_ascii(tmp_path):
    path = tmp_path / "Fäden 纤维.vtp"
    fcl_fibers.write(path, [np.eye(3)], radii=1)
    assert (fcl_fibers.read(path).points == np.eye(3)).all()
    assert (fcl_fibers.read(os.fsencode(path)).points == np.eye(3)).all()


@pytest.mark.parametrize("ending", ["tck", "trk"])
def test_tractograms_that_nibabel_wrote(tmp_path, ending):
    streamlines = pytest.importorskip("nibabel.streamlines")
    points, offsets, _ = scene_of(np.float32)
    fibers = [points[b:e] for b, e in zip(offsets[:-1], offsets[1:])]
    path = tmp_path / f"fibers.{ending}"
    tractogram = streamlines.Tractogram(fibers, affine_to_rasmm=np.eye(4))
    streamlines.save(tractogram, str(path))
    found = fcl_fibers.read(path)
    assert found.offsets.tolist() == offsets.tolist() and found.radii is None
    # Nibabel stores voxels with their corner as the origin in .trk, which rounds.
    assert found.points == pytest.approx(points, abs=0 if ending == "tck" else 1e-6)


def test_names_of_any_bytes_and_links(tmp_path):
    path = os.fsdecode(os.fsencode(tmp_path) + b"/\xff.VTP")
    fcl_fibers.write(os.fsencode(path), [np.eye(3)], radii=1)
    assert (fcl_fibers.read(path).points == np.eye(3)).all()
    link = tmp_path / "link.txt"
    (tmp_path / "target.txt").write_text("old")
    link.symlink_to("target.txt")
    fcl_fibers.write(link, [np.eye(3)])
    assert link.is_symlink()
    assert (fcl_fibers.read(tmp_path / "target.txt").points == np.eye(3)).all()
