#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes the .tck and .trk files of this folder by nibabel's own writer, and beside each, in
NAME.txt, the points that nibabel reads from it, so that our readers are tested against another
program. Made once, by python3-nibabel 5.0.0 of Debian 12."""

import warnings
from pathlib import Path

import numpy as np
from nibabel.streamlines import Tractogram, load, save
from nibabel.streamlines.tck import TckFile
from nibabel.streamlines.trk import TrkFile, header_2_dtype

HERE = Path(__file__).parent
HEADER_SIZE = 1000


def tractogram(scalars=False, properties=False):
    """Four streamlines of 5, 1, 3 and 2 points, in the scanner's millimetres."""
    streamlines = []
    for s, count in enumerate([5, 1, 3, 2]):
        i = np.arange(count)
        xyz = [7.5 * i - 20 * s, 30 - 0.375 * i * i + s, -12.0 + i * (2.125 + s)]
        streamlines.append(np.stack(xyz, axis=1).astype("f4"))
    per_point = {"fa": [np.full((len(s), 1), 0.5) for s in streamlines]} if scalars else None
    if scalars:
        per_point["colour"] = [np.full((len(s), 3), 100.0) for s in streamlines]
    per_streamline = {"mean": [[float(s), 2.0] for s in range(4)]} if properties else None
    return Tractogram(
        streamlines,
        data_per_streamline=per_streamline,
        data_per_point=per_point,
        affine_to_rasmm=np.eye(4),
    )


def rotation(axis, degrees):
    """The matrix of a turn by the right hand's rule."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def affine(matrix, sizes, origin):
    """The matrix vox_to_ras of voxels of these sizes."""
    result = np.eye(4)
    result[:3, :3] = matrix @ np.diag(sizes)
    result[:3, 3] = origin
    return result


def write_expected(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what the header lacks
        streamlines = load(path).streamlines
    with open(path.with_suffix(".txt"), "w", encoding="utf-8") as file:
        file.write(f"# The points of {path.name}, as nibabel reads them.\n")
        for streamline in streamlines:
            for point in streamline:
                file.write(" ".join(f"{c:.9g}" for c in point) + "\n")
            file.write("\n")


def write_trk(name, matrix, sizes, order, change=None, **data):
    path = HERE / f"{name}.trk"
    header = {
        "voxel_to_rasmm": matrix.astype("f4"),
        "voxel_sizes": np.array(sizes, "f4"),
        "dimensions": np.array([60, 70, 40], "i2"),
        "voxel_order": order,
    }
    save(TrkFile(tractogram(**data), header), str(path))
    if change:
        content = path.read_bytes()
        fields = np.frombuffer(content[:HEADER_SIZE], header_2_dtype).copy()
        path.write_bytes(change(fields, content[HEADER_SIZE:]))
    write_expected(path)


def swapped(fields, data):
    """nibabel reads the other byte order, but does not write it. All data have four bytes."""
    return fields.byteswap().tobytes() + np.frombuffer(data, "<u4").byteswap().tobytes()


def of_version_1(fields, data):
    fields["version"] = 1
    fields["voxel_order"] = b""
    fields["voxel_to_rasmm"] = 0
    return fields.tobytes() + data


def without_count(fields, data):
    fields["nb_streamlines"] = 0
    return fields.tobytes() + data


sizes = [2.0, 1.25, 3.5]
turned = affine(rotation([1, 2, 3], 25), sizes, [-60.5, -70.25, -30])
write_trk("turned_ras", turned, sizes, b"RAS")
write_trk("turned_lps", turned, sizes, b"LPS", scalars=True, properties=True)
write_trk("turned_lps_big", turned, sizes, b"LPS", swapped, scalars=True, properties=True)
write_trk("without_count", turned, sizes, b"LAS", without_count, properties=True)
write_trk("version_1", np.eye(4), sizes, b"LPS", of_version_1, scalars=True)
mirrored = rotation([3, -1, 1], 20) @ np.array([[0, 0, -1], [-1, 0, 0], [0, 1, 0]])
write_trk("mirrored", affine(mirrored, sizes, [80, 75, -30]), sizes, b"PSL")
write_trk("exchanged_axes", affine(mirrored, sizes, [80, 75, -30]), sizes, b"LAS", scalars=True)
# The largest entries are in other rows than those of the nearest rotation.
sheared = np.array([[-0.9, -0.3, 0.3], [-0.5, -0.7, -0.1], [-0.4, -1.0, -1.0]])
write_trk("sheared", affine(sheared, sizes, [1, 2, 3]), sizes, b"LAI")

save(TckFile(tractogram()), str(HERE / "tracks.tck"))
write_expected(HERE / "tracks.tck")
