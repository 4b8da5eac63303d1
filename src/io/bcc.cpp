// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "io/formats.h"

namespace fcl_fibers::io {
namespace {

// The format, from http://www.cemyuksel.com/research/yarnmodels/: numbers are little endian.
//
//     byte 0  3                 4           6           7        8       16              24 .. 64
//     "BCC"   sizes of numbers  curve type  dimensions  up axis  curves  control points  text
//
// then for each curve the int32 number of its control points, negative if it is closed, and three
// floats for each of them.
constexpr std::uint64_t kHeaderSize = 64;
constexpr unsigned char kFourByteNumbers = 0x44;  // integers and floats
constexpr std::uint64_t kCountSize = 4, kPointSize = 12;

using Weights = std::array<double, 4>;

// Weights of the control points i - 1 to i + 2 at t in [0, 1] of the span from i to i + 1.
Weights catmullRomWeights(double t) {
  const double t2 = t * t, t3 = t2 * t;
  return {(-t + 2 * t2 - t3) / 2, (2 - 5 * t2 + 3 * t3) / 2, (t + 4 * t2 - 3 * t3) / 2,
          (t3 - t2) / 2};
}

Weights bSplineWeights(double t) {
  const double t2 = t * t, t3 = t2 * t, s = 1 - t;
  return {s * s * s / 6, (4 - 6 * t2 + 3 * t3) / 6, (1 + 3 * t + 3 * t2 - 3 * t3) / 6, t3 / 6};
}

Point mirrored(const Point& point, const Point& at) {
  return {2 * at[0] - point[0], 2 * at[1] - point[1], 2 * at[2] - point[2]};
}

Point weighted(const Point* points, const Weights& weights) {
  Point sum = {0, 0, 0};
  for (std::size_t j = 0; j < 4; ++j) {
    for (std::size_t k = 0; k < 3; ++k) sum[k] += weights[j] * points[j][k];
  }
  return sum;
}

/// Appends the points of a curve. Beyond the ends of an open curve control points are mirrored; a
/// closed curve wraps around.
/// @param controls  two control points or more, with room for one before and two after them
/// @param weights   of the points of a span, its end included
void tessellate(std::vector<Point>& controls, bool closed, const std::vector<Weights>& weights,
                std::vector<Point>& points) {
  const std::size_t first = points.size(), count = controls.size() - 3;
  controls[0] = closed ? controls[count] : mirrored(controls[2], controls[1]);
  controls[count + 1] = closed ? controls[1] : mirrored(controls[count - 1], controls[count]);
  controls[count + 2] = controls[2];  // of a closed curve
  const std::size_t spans = closed ? count : count - 1;
  for (std::size_t span = 0; span < spans; ++span) {
    for (std::size_t i = 0; i + 1 < weights.size(); ++i) {
      points.push_back(weighted(&controls[span], weights[i]));
    }
  }
  points.push_back(closed ? points[first] : weighted(&controls[spans - 1], weights.back()));
}

}  // namespace

ParsedFibers parseBcc(ByteReader& file, const FiberFileOptions& options) {
  if (file.take(3, "the header") != "BCC") file.refuse(0, "the file does not start with BCC");
  const auto sizes = file.number<std::uint8_t>("the header");
  if (sizes != kFourByteNumbers) {
    file.refuse(3, "the sizes of numbers are ", int{sizes}, "; only 4-byte integers and floats (",
                int{kFourByteNumbers}, ") are supported");
  }
  const std::string_view type = file.take(2, "the header");
  if (type != "C0" && type != "BS") {
    file.refuse(4, "the curve type is '", ByteReader::shortened(type),
                "'; supported are C0 (uniform Catmull-Rom) and BS (uniform B-spline)");
  }
  const auto dimensions = file.number<std::uint8_t>("the header");
  if (dimensions != 3) file.refuse(6, "dimensions are ", int{dimensions}, "; 3 are needed");
  file.take(1, "the header");
  const auto curves = file.number<std::uint64_t>("the header");
  const auto control_points = file.number<std::uint64_t>("the header");
  file.seek(kHeaderSize, "the header");
  if (curves == 0) file.refuse(8, "there are no curves");
  if (curves > file.remaining() / kCountSize ||
      control_points > (file.remaining() - kCountSize * curves) / kPointSize) {
    file.refuse(8, curves, " curves of ", control_points, " control points end beyond the file of ",
                file.size(), " bytes");
  }

  const auto steps = static_cast<std::size_t>(options.segments_per_span);
  const auto weightsAt = type == "C0" ? &catmullRomWeights : &bSplineWeights;
  std::vector<Weights> weights;
  for (std::size_t i = 0; i <= steps; ++i) {
    weights.push_back(weightsAt(static_cast<double>(i) / static_cast<double>(steps)));
  }

  ParsedFibers parsed;
  parsed.is_float = true;
  FiberPolylines& scene = parsed.fibers;
  // A curve has at most as many spans as control points, and one point more.
  parsed.reserve(control_points * steps + curves, curves);
  scene.closed.reserve(static_cast<std::size_t>(curves));
  std::uint64_t left = control_points;
  for (std::uint64_t i = 0; i < curves; ++i) {
    const std::uint64_t at = file.offset();
    const auto signed_count = std::int64_t{file.number<std::int32_t>("the curves")};
    const bool closed = signed_count < 0;
    const auto count = static_cast<std::uint64_t>(std::abs(signed_count));
    if (count == 0) file.refuse(at, "curve ", i, " has no control points");
    if (closed && count < 3) {
      file.refuse(at, "the closed curve ", i, " has ", count,
                  " control points; at least 3 are needed");
    }
    if (count > left) {
      file.refuse(at, "curve ", i, " has ", count, " control points, but only ", left, " of ",
                  control_points, " are left");
    }
    left -= count;
    std::vector<Point> points(static_cast<std::size_t>(count) + 3);
    for (std::size_t j = 1; j <= count; ++j) points[j] = file.point();
    if (count == 1) {
      scene.points.push_back(points[1]);
    } else {
      tessellate(points, closed, weights, scene.points);
    }
    scene.closed.push_back(closed ? 1 : 0);
    parsed.endFiber();
  }
  if (left != 0) {
    file.refuse(16, "the header has ", control_points, " control points, but the curves have ",
                control_points - left);
  }
  parsed.expectEnd(file);
  return parsed;
}

}  // namespace fcl_fibers::io
