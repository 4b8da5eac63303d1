// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/frame.h"

#include <algorithm>

namespace fcl_fibers::geometry {

namespace {

/// Moves the origin to a multiple of a power of two near the median distance of the segments from
/// it, so by half of that at most. Scenes with about the same place and size get one frame
/// then, and pairs between them need no change of frame.
void roundOrigin(Frame& frame, Segment* samples, std::size_t count) {
  const auto distance = [&](const Segment& s) { return maxNorm(midpoint(s) - frame.origin); };
  Segment* const median = samples + count / 2;
  std::nth_element(samples, median, samples + count,
                   [&](const Segment& p, const Segment& q) { return distance(p) < distance(q); });
  const double spread = distance(*median);
  if (!std::isnormal(spread)) return;
  const double unit = std::ldexp(1.0, std::ilogb(spread));
  for (const auto axis : {&Vec3d::x, &Vec3d::y, &Vec3d::z}) {
    const double rounded = unit * std::nearbyint(frame.origin.*axis / unit);
    if (std::isfinite(rounded)) frame.origin.*axis = rounded;
  }
}

}  // namespace

Frame frameFor(Segment* samples, std::size_t count) {
  Frame frame;
  if (count == 0) return frame;
  Segment *const end = samples + count, *const median = samples + count / 2;
  for (const auto axis : {&Vec3d::x, &Vec3d::y, &Vec3d::z}) {
    std::nth_element(samples, median, end, [axis](const Segment& p, const Segment& q) {
      return midpoint(p).*axis < midpoint(q).*axis;
    });
    // Without its sign if it is 0: which of two equal ones is the median is up to the standard
    // library, and trees put -0 before 0.
    frame.origin.*axis = midpoint(*median).*axis + 0.0;
  }
  double size = 0;
  for (const Segment* s = samples; s != end; ++s) {
    size = std::max({size, maxNorm(s->a - frame.origin) + s->thickness(),
                     maxNorm(s->b - frame.origin) + s->thickness()});
  }
  if (size > 0 && std::isfinite(size)) {
    // The size becomes 2^50. Squares still fit float if the scene grows a thousandfold, and squares
    // of lengths 10^30 times smaller do too, such as those of all other segments if one object is
    // far out. The scale itself stays away from the ends of double's range.
    frame.scale = std::ldexp(1.0, std::clamp(50 - std::ilogb(size), -1000, 1000));
  }
  roundOrigin(frame, samples, count);
  return frame;
}

Segment FrameChange::around(const Segment& segment, Grows grows) const {
  if (grows == Grows::kAll && isIdentity()) return segment;
  Segment moved = (*this)(segment);
  const double growth = grows == Grows::kNothing ? 0 : error(moved);
  if (!segment.isBox()) {
    if (grows != Grows::kAll) return moved;
    moved.radius += growth;
    return isFinite(moved) ? moved : Segment::everywhere();
  }
  if (grows != Grows::kNothing) moved = boxAround(moved, growth);
  const bool is_box = moved.a.x <= moved.b.x && moved.a.y <= moved.b.y && moved.a.z <= moved.b.z;
  // An open side stays open.
  if (!is_box || (isBounded(segment) && !isBounded(moved))) moved = Segment::everywhere();
  moved.radius = segment.radius;
  return moved;
}

}  // namespace fcl_fibers::geometry
