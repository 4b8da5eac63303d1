// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

namespace fcl_fibers::benchmarks {

/// The fibers of a scene by their roots in rows, forth and back, as many as there are fibers in
/// one: consecutive fibers are near each other, which they are not where roots were drawn at
/// random.
std::vector<std::size_t> rowsOfRoots(const FiberPolylines& scene);

/// The scene with its fibers in another order.
FiberPolylines reordered(const FiberPolylines& scene, const std::vector<std::size_t>& order);

}  // namespace fcl_fibers::benchmarks
