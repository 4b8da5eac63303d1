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
/// Exports for programs that draw. They write VTK's XML PolyData (.vtp), which ParaView reads.
///
///     exportFibers("fibers.vtp", fibers);
///     exportContacts("contacts.vtp", contacts);
///
/// Coordinates are doubles in the fibers' frame. Numbers beside the geometry are cell data. Points
/// of fibers carry `radius`, which readFibers() reads again. If the scene has radii of segments, a
/// point has the larger one of its two segments.
///
/// All functions throw std::invalid_argument if the path does not end in .vtp or a scene is not as
/// FiberPolylines requires, before they open the file. They throw std::runtime_error with the
/// file's name if it cannot be written.

/// Writes one polyline per fiber, with its number `fiber`, and with `starts_at` and `ends_at`,
/// which are indices of points or -1, if the scene has them. Points carry FiberPolylines::samples
/// and `types` as `swc_sample` and `swc_type`. readFibers() restores all of these bit for bit. If
/// the radius of all fibers is 0, the file holds no `radius`, because 0 stands for an unknown
/// radius. Groups are not written. A closed fiber is told only by its repeated last point.
FCL_FIBERS_IO_EXPORT void exportFibers(const std::string& path, const FiberPolylines& scene);

/// Writes one line per segment, with `fiber`, `number`, which is the one along the fiber, and
/// `touching`. The argument `touching` holds one number per point: 0 if the segment that starts
/// there touches no other. The number at a fiber's last point is not used. Throws
/// std::invalid_argument if it holds more or fewer.
FCL_FIBERS_IO_EXPORT void exportSegments(const std::string& path, const FiberPolylines& scene,
                                         const std::vector<unsigned char>& touching);

/// Writes one point per contact, midway between point_a and point_b, with the numbers `fiber_a`,
/// `number_a`, `s`, `fiber_b`, `number_b`, `t`, `distance`, `normal_x`, `normal_y` and `normal_z`.
/// A fiber or number that is kNoFiber is written as -1.
FCL_FIBERS_IO_EXPORT void exportContacts(const std::string& path,
                                         const std::vector<Contact>& contacts);

/// Writes the faces of volumes from FiberTree::volumes(). Each face has the number `volume` of its
/// volume, and the number `segments` of segments below that. A box has six quadrangles. A sphere
/// has 320 triangles, whose corners lie on it.
FCL_FIBERS_IO_EXPORT void exportVolumes(const std::string& path,
                                        const std::vector<TreeVolume>& volumes);

}  // namespace fcl_fibers::io
