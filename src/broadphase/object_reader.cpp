// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_reader.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>

namespace fcl_fibers::broadphase {
namespace {

using geometry::AffineMap;
using geometry::Frame;
using geometry::Obstacle;
using geometry::Segment;
using geometry::Vec3d;

constexpr const char* kNoOwnBox =
    "its box is empty or NaN; give it a non-empty shape and call computeAABB()";

const char* rangeProblem(const Segment& segment) {
  return isFinite(segment)
             ? nullptr
             : "its coordinates overflow; bring the scene nearer to the origin or change its unit";
}

bool allFinite(const Vec3d& v) {
  // Zero times infinity or NaN is NaN.
  return 0 * v.x + 0 * v.y + 0 * v.z == 0;
}

/// Most rotations are close to orthonormal, and their right hand tells so in fewer steps. The sum
/// bounds what isRotation() asks for; see kUsualRotation.
FCL_FIBERS_ALWAYS_INLINE bool isUsualRotation(const AffineMap& pose) {
  const Vec3d &x = pose.column[0], &y = pose.column[1], &z = pose.column[2];
  const Vec3d off = cross(x, y) - z;
  return (std::fabs(dot(x, x) - 1) + std::fabs(dot(y, y) - 1)) +
             (std::fabs(dot(x, y)) + norm1(off)) <=
         kUsualRotation;
}

/// Why a pose is refused, and the remedy; nullptr if it is proper.
const char* poseProblem(const AffineMap& pose) {
  const Vec3d &x = pose.column[0], &y = pose.column[1], &z = pose.column[2];
  const bool is_rotation =
      isUsualRotation(pose) || geometry::isRotation(x, y, z, kRotationTolerance);
  if (is_rotation && allFinite(pose.shift)) return nullptr;
  if (!allFinite(x) || !allFinite(y) || !allFinite(z) || !allFinite(pose.shift)) {
    return "its pose is NaN or infinite; give it a finite pose";
  }
  return "its rotation is not orthonormal or is a reflection; give it a proper rotation";
}

// --- Boxes in a frame ---

constexpr double kMost = std::numeric_limits<double>::max();

/// A box far out may overflow. But its low side must not become +infinity, its high side must not
/// become -infinity, and neither may become NaN.
double finiteLow(double x) { return x <= kMost ? x : std::isnan(x) ? -kInfinity : kMost; }
double finiteHigh(double x) { return -finiteLow(-x); }

FCL_FIBERS_ALWAYS_INLINE Corners finiteCorners(const Vec3d& low, const Vec3d& high) {
  if (std::isfinite(low.x + low.y + low.z + high.x + high.y + high.z)) return {low, high};
  return {{finiteLow(low.x), finiteLow(low.y), finiteLow(low.z)},
          {finiteHigh(high.x), finiteHigh(high.y), finiteHigh(high.z)}};
}

/// A box of the world in `frame`. Sides that overflow stay outside of the box.
Corners inFrame(Corners box, const Frame& frame) {
  return finiteCorners(frame.fromWorld(box.low), frame.fromWorld(box.high));
}

/// The box of a posed shape, larger by a length in the world's unit.
FCL_FIBERS_ALWAYS_INLINE Corners posedCorners(const ShapeBox& shape, const Vec3d& position,
                                              double larger, const Frame& frame) {
  const double outward = shape.rounding() + larger;
  const Vec3d by{outward, outward, outward};
  const Vec3d at = frame.fromWorld(position);
  return finiteCorners(at + frame.scale * (shape.posed.low - by),
                       at + frame.scale * (shape.posed.high + by));
}

bool contains(const Corners& outer, const Corners& inner, double rounding) {
  const auto reaches = [rounding](const Vec3d& low, const Vec3d& high) {
    return low.x <= high.x + rounding && low.y <= high.y + rounding && low.z <= high.z + rounding;
  };
  return reaches(outer.low, inner.low) && reaches(inner.high, outer.high);
}

double finiteNorm(const Vec3d& v) {
  double largest = 0;
  for (const double x : {v.x, v.y, v.z}) {
    if (std::isfinite(x)) largest = std::max(largest, std::fabs(x));
  }
  return largest;
}

FCL_FIBERS_ALWAYS_INLINE bool isWithin(const Vec3d& off, double slack) {
  return std::fabs(off.x) <= slack && std::fabs(off.y) <= slack && std::fabs(off.z) <= slack;
}

/// Whether the box of a capsule adds nothing. geometry::segmentsOf() decides in the same way, and
/// has the reasons.
template <typename S>
FCL_FIBERS_ALWAYS_INLINE bool addsNothing(const fcl::AABB<S>& box, const AffineMap& pose,
                                          double radius, double length) {
  const Vec3d size = toVec3(box.max_) - toVec3(box.min_), at = abs(pose.shift);
  const double thickness = radius + radius, end = length + thickness;
  const double slack = double{std::numeric_limits<S>::epsilon()} *
                       (2.5 * std::max(std::max(at.x, at.y), at.z) + 8 * end);
  constexpr double kSmall = 1e-280;
  const double square = thickness * thickness * 2 + end * end;
  const bool is_turned = std::fabs(size.y - size.x) <= slack &&
                         std::fabs(size.z - size.x) <= slack && length > 2 * slack &&
                         square > kSmall &&
                         std::fabs(size.x * size.x - square) <= 2 * slack * size.x;
  const Vec3d thick{thickness, thickness, thickness};
  return is_turned || isWithin(size - Vec3d{thickness, thickness, end}, slack) ||
         isWithin(size - (length * abs(pose.column[2]) + thick), slack);
}

/// Reads what the program has added to the box of a capsule or sphere.
template <typename S>
void readMarginOfRound(const fcl::CollisionObject<S>& object, ReadObject& out) {
  const fcl::AABB<S>& box = ObjectMembers<S>::box(object);
  const double radius = out.size.x, length = out.size.y;
  if (addsNothing(box, out.pose, radius, length)) return;
  const Vec3d end = 0.5 * (length * abs(out.pose.column[2])), ball{radius, radius, radius};
  out.added =
      wideningOf(object, ShapeBox::symmetric({radius, radius, length / 2 + radius}, end + ball));
  if (!out.added.is_uneven) return;
  out.shape = Obstacle::Kind::kAxis;
  out.own = openCorners(box);
}

/// Reads what the program has added to the box of any other shape.
template <typename S>
void readMargin(const fcl::CollisionObject<S>& object, ReadObject& out) {
  const bool is_open = !isBounded(out.box);
  if (!is_open) out.added = wideningOf(object, out.box);
  const fcl::AABB<S>& box = ObjectMembers<S>::box(object);
  if (is_open ? !isProper(box) : !out.added.is_uneven) return;
  out.own = openCorners(box);
  if (!is_open) return;
  // FCL treats small rotations as the identity.
  out.open_rounding =
      4 * double{std::numeric_limits<S>::epsilon()} *
          std::max(finiteNorm(out.own.low), finiteNorm(out.own.high)) +
      4 * double{Eigen::NumTraits<S>::dummy_precision()} * finiteNorm(out.box.posed.half());
}

/// What is part of the mark of a box beside the pose. Other shapes than these have boxes of their
/// own for each size.
Vec3d markedSizeOf(const ReadObject& object) {
  return isRound(object.kind) || object.kind == ObjectKind::kBar ? object.size : Vec3d{0, 0, 0};
}

FCL_FIBERS_ALWAYS_INLINE Segment capsuleOf(const AffineMap& pose, double radius, double length,
                                           const Frame& frame) {
  const Vec3d center = frame.fromWorld(pose.shift);
  // Halving the length instead of the scale could lose the last bit of a subnormal length.
  const Vec3d half = (frame.scale / 2 * length) * pose.column[2];
  return {center - half, center + half, frame.scale * radius};
}

}  // namespace

double markOf(const AffineMap& pose, const Vec3d& size) {
  // Odd numbers, at random.
  constexpr std::uint64_t kFactors[] = {0x9e3779b97f4a7c15, 0xbf58476d1ce4e5b9, 0x94d049bb133111eb,
                                        0xd6e8feb86659fd93, 0xa0761d6478bd642f, 0xe7037ed1a0b428db,
                                        0x8ebc6af09c88c6e3, 0x589965cc75374cc3, 0x1d8e4e27c47d124f,
                                        0xeb44accab455d165, 0x2127599bf4325c37, 0x880355f21e6d1965,
                                        0xff51afd7ed558ccd, 0xc4ceb9fe1a85ec53, 0xd2a98b26625eee7b};
  const auto& [x, y, z] = pose.column;
  const Vec3d vectors[] = {x, y, z, pose.shift, size};
  std::uint64_t sum = 0;
  const std::uint64_t* factor = kFactors;
  for (const Vec3d& v : vectors) {
    for (const double number : {v.x, v.y, v.z}) {
      std::uint64_t bits;
      std::memcpy(&bits, &number, sizeof(bits));
      // The signs of two numbers, which are their highest bits, must not cancel out.
      sum += (bits ^ bits >> 32) * *factor++;
    }
  }
  sum = (sum ^ sum >> 29) * kFactors[0];
  const std::uint64_t bits = std::uint64_t{0x3ff} << 52 | sum >> 12;
  double number;
  std::memcpy(&number, &bits, sizeof(number));
  return number;
}

void refuse(std::string_view reason, SegmentId place) {
  throw RefusedObject{std::string(reason), place};
}

template <typename S>
double lengthInFiber(const fcl::CollisionObject<S>& object) {
  const fcl::CollisionGeometry<S>& shape = *ObjectMembers<S>::shape(object);
  switch (shape.getNodeType()) {
    case fcl::GEOM_CAPSULE:
      return static_cast<double>(static_cast<const fcl::Capsule<S>&>(shape).lz);
    case fcl::GEOM_CYLINDER:
      return static_cast<double>(static_cast<const fcl::Cylinder<S>&>(shape).lz);
    case fcl::GEOM_BOX:
      return static_cast<double>(static_cast<const fcl::Box<S>&>(shape).side[2]);
    default:
      return 0;
  }
}

template <typename S>
ReadObject readObject(const fcl::CollisionObject<S>& object, Bounds bounds,
                      const LocalBounds* mesh) {
  ReadObject out;
  out.kind = kindOf(object);
  if (out.kind == ObjectKind::kNothing) {
    out.problem = "it has no geometry; construct it with a shape";
    return out;
  }
  out.pose = poseOf(object);
  out.problem = poseProblem(out.pose);
  if (out.problem != nullptr) return out;
  out.is_own_box = bounds == Bounds::kObjects;
  if (out.is_own_box) {
    const fcl::AABB<S>& box = ObjectMembers<S>::box(object);
    out.own = openCorners(box);
    if (!isProper(box)) out.problem = kNoOwnBox;
    return out;
  }
  const bool is_round = readSize(object, out.kind, out.size.x, out.size.y);
  out.problem =
      is_round ? sizeProblem(out.size.x, out.size.y) : readShape(object, bounds, mesh, out);
  if (out.problem == nullptr && bounds == Bounds::kShapesAndMargins) {
    is_round ? readMarginOfRound(object, out) : readMargin(object, out);
  }
  // Where only FCL's box of the shape is known, the program may know more.
  if (out.shape == Obstacle::Kind::kBox && !(out.isAllOfShape() || out.box.is_least)) {
    out.shape = Obstacle::Kind::kNone;
  }
  return out;
}

const char* segmentOf(const ReadObject& object, const Frame& frame, Segment& segment,
                      bool marks_boxes) {
  if (object.problem != nullptr) return object.problem;
  const Widening& added = object.added;
  if (object.is_own_box) {
    const Corners own = inFrame(object.own, frame);
    segment = Segment::box(own.low, own.high);
    return nullptr;
  }
  if (isRound(object.kind)) {
    segment = capsuleOf(object.pose, object.size.x, object.size.y, frame);
    const double larger = frame.scale * added.onAllSides();
    if (!added.is_uneven) segment.radius += larger;
    if (const char* problem = rangeProblem(segment)) return problem;
    if (!added.is_uneven) return nullptr;
    segment.radius += larger;
    const Corners own = inFrame(object.own, frame);
    const Segment box = boxAround(segment, endPointError(segment));
    segment = {min(own.low, box.a), max(own.high, box.b), -2};
  } else {
    Corners corners = posedCorners(object.box, object.pose.shift, added.onAllSides(), frame);
    bool counts_own = added.is_uneven;
    if (object.open_rounding >= 0) {
      counts_own =
          contains(inFrame(object.own, frame), corners, frame.scale * object.open_rounding);
    }
    if (counts_own) {
      const Corners own = inFrame(object.own, frame);
      corners = {min(own.low, corners.low), max(own.high, corners.high)};
    }
    segment = Segment::box(corners.low, corners.high);
  }
  if (marks_boxes) segment.radius *= markOf(object.pose, markedSizeOf(object));
  return nullptr;
}

template <typename S>
const char* readSegment(const fcl::CollisionObject<S>& object, const Frame& frame, Bounds bounds,
                        Segment& segment, bool marks_boxes) {
  // Most are proper and have a box that adds nothing. What is not finite shows in the segment.
  const ObjectKind kind = bounds != Bounds::kObjects ? kindOf(object) : ObjectKind::kNothing;
  double radius = 0, length = 0;
  if (readSize(object, kind, radius, length)) {
    const AffineMap pose = poseOf(object);
    if (isUsualRotation(pose) && radius >= 0 && length >= 0 &&
        (bounds == Bounds::kShapes ||
         addsNothing(ObjectMembers<S>::box(object), pose, radius, length))) {
      segment = capsuleOf(pose, radius, length, frame);
      if (isFinite(segment)) return nullptr;
    }
  } else if (kind != ObjectKind::kNothing) {
    ReadObject read;
    read.kind = kind;
    read.pose = poseOf(object);
    const auto readBoxes = [&] {
      return kind == ObjectKind::kBar ? readBar(object, read.pose, read.size, read.box)
                                      : readShape(object, bounds, /*mesh=*/nullptr, read);
    };
    if (isUsualRotation(read.pose) && allFinite(read.pose.shift) && readBoxes() == nullptr &&
        (bounds == Bounds::kShapes ||
         (isBounded(read.box) && isStockSize(BoxSize(ObjectMembers<S>::box(object)), read.box,
                                             ObjectMembers<S>::pose(object))))) {
      const Corners corners = posedCorners(read.box, read.pose.shift, /*larger=*/0, frame);
      segment = Segment::box(corners.low, corners.high);
      if (marks_boxes) segment.radius *= markOf(read.pose, markedSizeOf(read));
      return nullptr;
    }
  }
  return segmentOf(readObject(object, bounds), frame, segment, marks_boxes);
}

Obstacle obstacleOf(const ReadObject& object, const Frame& frame,
                    const std::shared_ptr<const geometry::PolytopeVertices>& known) {
  Obstacle found;
  if (object.problem != nullptr || object.shape == Obstacle::Kind::kNone) return found;
  found.kind = object.shape;
  found.point = frame.fromWorld(object.pose.shift);
  const double position_error = geometry::endPointError(maxNorm(found.point));
  const auto turn = [&](const Vec3d& p) { return frame.scale * object.pose.linear(p); };
  found.margin = frame.scale * object.added.margin;
  const Corners& local = object.box.local;
  const double box_error = 16 * std::numeric_limits<double>::epsilon() * frame.scale *
                           (maxNorm(local.low) + maxNorm(local.high));
  switch (object.shape) {
    case Obstacle::Kind::kAxis:
      found.vector[0] = (frame.scale / 2 * object.size.y) * object.pose.column[2];
      found.margin = frame.scale * (object.size.x + object.added.margin);
      found.error = endPointError(found.capsule());
      break;
    case Obstacle::Kind::kTriangle:
      found.error = box_error;
      for (int i = 0; i < 3; ++i) found.vector[i] = found.point + turn(object.vector[i]);
      break;
    case Obstacle::Kind::kPolytope:
      found.error = box_error + 4 * std::numeric_limits<double>::min() *
                                    (maxNorm(local.low) + maxNorm(local.high));
      for (int i = 0; i < 3; ++i) found.vector[i] = frame.scale * object.pose.column[i];
      found.vertices = known != nullptr && known->isCopyOf(object.vertices)
                           ? known
                           : std::make_shared<geometry::PolytopeVertices>(object.vertices);
      break;
    case Obstacle::Kind::kBox: {
      found.error = box_error;
      found.point = found.point + turn(local.middle());
      const Vec3d half = local.half();
      found.vector[0] = turn({half.x, 0, 0});
      found.vector[1] = turn({0, half.y, 0});
      found.vector[2] = turn({0, 0, half.z});
      break;
    }
    default:
      found.vector[0] = object.vector[0];
      found.offset = frame.scale * object.offset;
      found.margin = 0;
  }
  // The smallest normal number covers the loss if subnormals are flushed to zero.
  found.error += position_error + 8 * (frame.scale + 1) * std::numeric_limits<double>::min();
  return isFinite(found) ? found : Obstacle();
}

#define FCL_FIBERS_INSTANTIATE(S)                                                                  \
  template double lengthInFiber(const fcl::CollisionObject<S>&);                                   \
  template ReadObject readObject(const fcl::CollisionObject<S>&, Bounds, const LocalBounds*);      \
  template const char* readSegment(const fcl::CollisionObject<S>&, const Frame&, Bounds, Segment&, \
                                   bool);
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

}  // namespace fcl_fibers::broadphase
