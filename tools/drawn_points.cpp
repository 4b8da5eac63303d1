// SPDX-License-Identifier: BSD-3-Clause
#include "drawn_points.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

#include "bounds.h"
#include "bytes.h"

namespace fcl_fibers::tools {
namespace {

std::size_t ceilDiv(std::size_t a, std::size_t b) { return (a + b - 1) / b; }

std::string nth(std::size_t n, const char* what) {
  return fmt::format("every {}{} {}", n,
                     n % 10 == 2 && n != 12   ? "nd"
                     : n % 10 == 3 && n != 13 ? "rd"
                     : n % 10 == 1 && n != 11 ? "st"
                                              : "th",
                     what);
}

}  // namespace

Thinning Thinning::forScene(const FiberPolylines& scene, std::size_t most_points) {
  constexpr std::size_t kSmooth = 50;
  Thinning thinning;
  if (scene.points.size() <= most_points) return thinning;
  const std::size_t per_fiber = scene.points.size() / scene.fiberCount();
  const std::size_t wanted = ceilDiv(scene.points.size(), most_points);
  thinning.point_step = std::clamp<std::size_t>(per_fiber / kSmooth, 1, wanted);
  thinning.fiber_step = std::clamp<std::size_t>(
      ceilDiv(scene.points.size() / thinning.point_step, most_points), 1, scene.fiberCount());
  return thinning;
}

std::string Thinning::text() const {
  if (fiber_step == 1 && point_step == 1) return "";
  if (fiber_step == 1) return nth(point_step, "point drawn");
  if (point_step == 1) return nth(fiber_step, "fiber drawn");
  return nth(fiber_step, "fiber and ") + nth(point_step, "point drawn");
}

Steps::Steps(const std::vector<const std::vector<Point>*>& frames) {
  Bounds box;
  for (const std::vector<Point>* const frame : frames) {
    for (const Point& point : *frame) box.add(point);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    middle[k] = (box.low[k] + box.high[k]) / 2;
    size[k] = box.high[k] - box.low[k];
  }
  const double largest = *std::max_element(size.begin(), size.end());
  step = largest > 0 ? largest / 65535 : 1;
}

std::string pointsText(const FiberPolylines& scene, const Thinning& thinning, const Steps& steps) {
  std::string bytes;
  thinning.forEachFiber(scene, [&](std::size_t, const std::vector<std::size_t>& points) {
    for (const std::size_t i : points) {
      for (std::size_t k = 0; k < 3; ++k) {
        const double place =
            std::round((scene.points[i][k] - steps.middle[k]) / steps.step + 32767.5);
        appendLittleEndian(bytes, static_cast<std::uint16_t>(std::clamp(place, 0.0, 65535.0)));
      }
    }
  });
  return base64(bytes);
}

std::string radiiText(const FiberPolylines& scene, const Thinning& thinning) {
  std::string bytes;
  if (scene.radii.empty()) {
    appendLittleEndian(bytes, static_cast<float>(scene.radius));
    return base64(bytes);
  }
  thinning.forEachFiber(scene, [&](std::size_t, const std::vector<std::size_t>& points) {
    for (const std::size_t i : points) {
      appendLittleEndian(bytes, static_cast<float>(scene.radii[i]));
    }
  });
  return base64(bytes);
}

std::string touchingText(const FiberPolylines& scene, const Thinning& thinning,
                         const std::vector<unsigned char>& touching) {
  std::string bytes;
  std::size_t bit = 0;
  thinning.forEachFiber(scene, [&](std::size_t, const std::vector<std::size_t>& points) {
    for (std::size_t n = 0; n < points.size(); ++n, ++bit) {
      if (bit % 8 == 0) bytes += '\0';
      if (n + 1 == points.size()) continue;
      const auto begin = touching.begin() + static_cast<std::ptrdiff_t>(points[n]);
      const auto end = begin + static_cast<std::ptrdiff_t>(points[n + 1] - points[n]);
      if (std::find(begin, end, 1) == end) continue;
      bytes.back() = static_cast<char>(static_cast<unsigned char>(bytes.back()) | 1u << bit % 8);
    }
  });
  return base64(bytes);
}

}  // namespace fcl_fibers::tools
