#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes the .vtp files of this folder by VTK's own writer, so that our readers are tested
against files of others: four lines of four, two, five (closed) and three points over 13 points, and
what readers have to skip. Made once, by python3-vtk9 9.1.0 of Debian 12; --all makes every
combination that the writer knows."""

import itertools
import sys

import vtk


def poly_data(number, radius=None):
    points = vtk.vtkPoints()
    points.SetDataType(vtk.VTK_DOUBLE if number == "double" else vtk.VTK_FLOAT)
    for i in range(13):
        points.InsertNextPoint(0.5 * i, 0.25 * i * i, -1.125 * i)
    points.GetData().GetRange(-1)  # leaves an information key behind

    def cells(lists):
        array = vtk.vtkCellArray()
        for ids in lists:
            array.InsertNextCell(len(ids))
            for i in ids:
                array.InsertCellPoint(i)
        return array

    def numbers(array, name, values):
        array.SetName(name)
        for value in values:
            array.InsertNextValue(value)
        return array

    data = vtk.vtkPolyData()
    data.SetPoints(points)
    data.SetLines(cells([[0, 1, 2, 3], [4, 5], [6, 7, 8, 9, 6], [3, 10, 11]]))
    data.SetVerts(cells([[12], [0]]))
    data.GetPointData().AddArray(
        numbers(vtk.vtkDoubleArray(), "theta of point", [0.1 * i for i in range(13)])
    )
    if radius:
        data.GetPointData().AddArray(
            numbers(vtk.vtkFloatArray(), "radius", [radius(i) for i in range(13)])
        )
    data.GetFieldData().AddArray(numbers(vtk.vtkIntArray(), "frame", [7]))
    return data


def write_radii():
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetInputData(poly_data("float", lambda i: 0.5 + 0.25 * (i % 5)))
    writer.SetFileName("radii.vtp")
    writer.Write()


def write_xml(mode, compressor, order, header, number):
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetInputData(poly_data(number))
    modes = {"ascii": writer.SetDataModeToAscii, "binary": writer.SetDataModeToBinary}
    modes.get(mode, writer.SetDataModeToAppended)()
    writer.SetEncodeAppendedData(mode == "appended_base64")
    {
        "none": writer.SetCompressorTypeToNone,
        "zlib": writer.SetCompressorTypeToZLib,
    }[compressor]()
    {"little": writer.SetByteOrderToLittleEndian, "big": writer.SetByteOrderToBigEndian}[order]()
    {"h32": writer.SetHeaderTypeToUInt32, "h64": writer.SetHeaderTypeToUInt64}[header]()
    {"h32": writer.SetIdTypeToInt32, "h64": writer.SetIdTypeToInt64}[header]()
    writer.SetFileName(f"{mode}_{compressor}_{order}_{header}_{number}.vtp")
    writer.Write()


if "--all" in sys.argv:
    for choice in itertools.product(
        ["ascii", "binary", "appended_base64", "appended_raw"],
        ["none", "zlib"],
        ["little", "big"],
        ["h32", "h64"],
        ["float", "double"],
    ):
        write_xml(*choice)
else:
    write_xml("ascii", "none", "little", "h32", "float")
    write_xml("binary", "none", "big", "h64", "double")
    write_xml("binary", "zlib", "little", "h32", "float")
    write_xml("appended_raw", "none", "little", "h64", "double")
    write_xml("appended_raw", "zlib", "big", "h32", "float")
    write_xml("appended_base64", "zlib", "little", "h64", "double")
    write_radii()
