// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/export.h>

namespace fcl_fibers::io {

/// @file
/// Exports for programs that draw: VTK's XML PolyData (.vtp), which ParaView reads. Coordinates are
/// doubles in the fibers' frame. Numbers beside the geometry are cell data. Points of fibers carry
/// `radius` as readFibers() reads it: a segment has the larger radius of its two ends. So a segment
/// that is thicker than both of its neighbours makes the one before it as thick in the file.
///
/// All functions throw std::invalid_argument if the path does not end in .vtp, and
/// std::runtime_error, which names the file, if it cannot be written.

/// Writes one polyline per fiber, with its number `fiber`.
FCL_FIBERS_IO_EXPORT void exportFibers(const std::string& path, const FiberPolylines& scene);

/// Writes one line per segment, with `fiber`, `segment` and `touching`. `touching` holds one number
/// per segment, fiber after fiber, 0 if it touches no other. Throws std::invalid_argument if it
/// holds more or fewer.
FCL_FIBERS_IO_EXPORT void exportSegments(const std::string& path, const FiberPolylines& scene,
                                         const std::vector<unsigned char>& touching);

/// Writes one point per contact, midway between point_a and point_b, with `fiber_a`, `segment_a`,
/// `s`, `fiber_b`, `segment_b`, `t`, `distance`, `normal_x`, `normal_y` and `normal_z`.
FCL_FIBERS_IO_EXPORT void exportContacts(const std::string& path,
                                         const std::vector<Contact>& contacts);

/// Writes the faces of FiberTree::volumes(), each with its volume's number `volume` and the number
/// `segments` of segments below that. A box has six quadrangles, a sphere 320 triangles with their
/// corners on it.
FCL_FIBERS_IO_EXPORT void exportVolumes(const std::string& path,
                                        const std::vector<TreeVolume>& volumes);

}  // namespace fcl_fibers::io
