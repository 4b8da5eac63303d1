// SPDX-License-Identifier: BSD-3-Clause
#include "mesh_size.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <fmt/format.h>

#include "messages.h"

namespace fcl_fibers::tools {
namespace {

constexpr double kOtherUnit = 100;  ///< in sizes

struct Bounds {
  Point low, high;

  Bounds() {
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-low[0]);
  }

  void add(const Point& point) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], point[k]);
      high[k] = std::max(high[k], point[k]);
    }
  }

  double size() const { return std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]); }

  bool meets(const Bounds& other, double distance) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (low[k] - distance > other.high[k] || other.low[k] - distance > high[k]) return false;
    }
    return true;
  }
};

}  // namespace

void warnOfMeshSize(const FiberPolylines& fibers, const std::vector<MeshFile>& meshes,
                    double margin, const std::string& name) {
  if (meshes.empty() || fibers.points.empty()) return;
  Bounds of_fibers, of_meshes;
  for (const Point& point : fibers.points) of_fibers.add(point);
  for (const MeshFile& mesh : meshes) {
    // Files may have points that no triangle has.
    for (const std::int32_t i : mesh.triangles) {
      of_meshes.add(mesh.points[static_cast<std::size_t>(i)]);
    }
  }
  const double ratio = of_meshes.size() / of_fibers.size();
  const bool have_sizes = ratio > 0 && std::isfinite(ratio);
  if (have_sizes && (ratio >= kOtherUnit || ratio <= 1 / kOtherUnit)) {
    warn(name, fmt::format("the {} about {:.3g} times as large as the {}; they have to be in the "
                           "same unit",
                           ratio > 1 ? "meshes are" : "fibers are", ratio > 1 ? ratio : 1 / ratio,
                           ratio > 1 ? "fibers" : "meshes"));
    return;
  }
  double radius = fibers.radius;
  for (const double r : fibers.radii) radius = std::max(radius, r);
  if (of_fibers.meets(of_meshes, radius + margin)) return;
  warn(
      name,
      "the fibers and the meshes are apart, because boxes around them do not meet; they have to be "
      "in the same frame and unit");
}

}  // namespace fcl_fibers::tools
