// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/scenes/export.h>
#include <fcl_fibers/scenes/fiber_polylines.h>

namespace fcl_fibers::scenes {

/// @file
/// Files for programs that draw. The ending of the path says which: .vtp, XML PolyData as ParaView
/// reads it, or .ply, binary, little endian. Coordinates are doubles in the scene's frame; numbers
/// beside the geometry are data of cells in .vtp, properties of the element in .ply. Of a .ply VTK,
/// and so ParaView, reads points and faces alone: neither the edges nor these numbers. Points of
/// fibers carry `radius`, as readFibers reads it: a segment has the larger one of its ends. A
/// segment thicker than both of its neighbours makes the one before it as thick in the file.
///
/// All throw std::invalid_argument for another ending, and std::runtime_error with the file where
/// it cannot be written.

/// One polyline a fiber, with its number `fiber`. In .ply an edge a segment, with `fiber` and
/// `segment`.
FCL_FIBERS_SCENES_EXPORT void exportFibers(const std::string& path, const FiberScene& scene);

/// One line a segment, with `fiber`, `segment` and `touching`. `touching` holds a number a segment,
/// fiber after fiber, 0 where it touches none; throws std::invalid_argument if it is not as long.
FCL_FIBERS_SCENES_EXPORT void exportSegments(const std::string& path, const FiberScene& scene,
                                             const std::vector<unsigned char>& touching);

/// One point a contact, midway between point_a and point_b, with `fiber_a`, `segment_a`, `s`,
/// `fiber_b`, `segment_b`, `t`, `distance`, `normal_x`, `normal_y` and `normal_z`.
FCL_FIBERS_SCENES_EXPORT void exportContacts(const std::string& path,
                                             const std::vector<Contact>& contacts);

/// The faces of FiberTree::volumes(), each with the number `volume` and the count `segments` below
/// it: of boxes six quadrangles, of spheres 320 triangles with their corners on the sphere.
FCL_FIBERS_SCENES_EXPORT void exportVolumes(const std::string& path,
                                            const std::vector<TreeVolume>& volumes);

}  // namespace fcl_fibers::scenes
