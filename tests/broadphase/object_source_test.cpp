// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_source.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>

#include "broadphase/shape_samples.h"
#include "support/drift.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using broadphase::ObjectSource;
using geometry::BlockMask;
using geometry::Frame;
using geometry::Segment;
using geometry::SegmentBlock;

/// A capsule of hardly any length, so far out that rounding hides it. A program has widened its
/// box, which is as large as FCL's cube of a turned one.
template <typename S>
std::unique_ptr<Object<S>> makeAlmostBall(Random& random) {
  const auto shape =
      std::make_shared<fcl::Capsule<S>>(S(0.5), S(1024) * std::numeric_limits<S>::epsilon());
  fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
  pose.translation() = (1024 * random.direction()).template cast<S>();
  auto object = std::make_unique<Object<S>>(shape, pose);
  object->aabb = fcl::AABB<S>(pose.translation());
  object->aabb.expand(fcl::Vector3<S>::Constant(shape->aabb_radius));
  return object;
}

/// Capsules, spheres, boxes and other bounded shapes, with boxes of FCL's, tight ones, widened ones
/// and broken ones. Some have no length or hardly any, no radius, or are far out.
template <typename S>
std::unique_ptr<Object<S>> makeObject(Random& random) {
  if (random.below(16) == 0) return makeAlmostBall<S>(random);
  const double size = std::pow(10.0, random.between(-6, 6));
  const auto length = [&] {
    return static_cast<S>(random.below(6) == 0 ? 0 : size * random.between(0, 1));
  };
  const S radius = length();
  const S lz = length() * (random.below(4) == 0 ? S(1e4) * std::numeric_limits<S>::epsilon() : 1);
  std::shared_ptr<fcl::CollisionGeometry<S>> shape = std::make_shared<fcl::Capsule<S>>(radius, lz);
  if (random.below(6) == 0) shape = std::make_shared<fcl::Sphere<S>>(radius);
  if (random.below(3) == 0) shape = std::make_shared<fcl::Box<S>>(radius, lz, length());
  if (random.below(8) == 0) {
    shape = makeSample<S>(static_cast<int>(random.below(kBounded)), size, random).shape;
  }
  fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
  if (random.below(4) != 0) pose.linear() = random.rotation().toRotationMatrix().template cast<S>();
  // About as far from a rotation as is taken, or a little farther. Few are, as one alone refuses
  // all.
  if (random.below(4) == 0) {
    const double drift = random.below(64) == 0 ? 1.1e-3 : random.between(0, 0.999e-3);
    const Eigen::Quaterniond turn = random.rotation();
    pose.linear() = shearedRotation<S>(turn, drift, random);
  }
  // A quarter or half turn about one axis, which some entries of the rotation do not show.
  if (random.below(8) == 0) {
    const auto axis = fcl::Vector3<S>::Unit(static_cast<int>(random.below(3)));
    const S angle = static_cast<S>(1 + random.below(2)) * S(1.5707963267948966);
    pose.linear() = fcl::AngleAxis<S>(angle, axis).toRotationMatrix();
  }
  const double offset = random.below(3) == 0 ? 1e4 * size : size;
  pose.translation() = (offset * random.inCube(1)).template cast<S>();
  auto object = std::make_unique<Object<S>>(shape, pose);
  switch (random.below(6)) {
    case 0: {  // as a program makes it tight
      const Eigen::Vector3d axis = pose.linear().col(2).template cast<double>();
      const Eigen::Vector3d half =
          double{lz} / 2 * axis.cwiseAbs() + double{radius} * Eigen::Vector3d::Ones();
      const Eigen::Vector3d center = pose.translation().template cast<double>();
      object->aabb.min_ = (center - half).template cast<S>();
      object->aabb.max_ = (center + half).template cast<S>();
      break;
    }
    case 1:
      object->aabb.expand(fcl::Vector3<S>::Constant(static_cast<S>(0.1 * size)));
      break;
    case 2:
      object->aabb.max_[static_cast<int>(random.below(3))] += static_cast<S>(size);
      break;
    case 3:
      object->aabb.min_[static_cast<int>(random.below(3))] = std::numeric_limits<S>::quiet_NaN();
      break;
    case 4:  // as FCL makes it if the pose is turned, or widened or too small if it is not
      object->aabb = fcl::AABB<S>(pose.translation());
      object->aabb.expand(fcl::Vector3<S>::Constant(shape->aabb_radius));
      break;
    default:
      break;
  }
  return object;
}

/// Breaks its pose or its size.
template <typename S>
void spoil(Object<S>& object, Random& random) {
  const S kBad[] = {std::numeric_limits<S>::quiet_NaN(), std::numeric_limits<S>::infinity(),
                    -std::numeric_limits<S>::infinity(), S(-1)};
  const S bad = kBad[random.below(4)];
  fcl::Transform3<S> pose = object.getTransform();
  const int row = static_cast<int>(random.below(3)), column = static_cast<int>(random.below(4));
  const std::size_t what = random.below(4);
  if (what == 0) pose.matrix()(row, column) = bad;
  if (what == 1) pose.linear().col(row) *= -1;
  if (what == 2) pose.linear().col(row) += S(0.1) * pose.linear().col((row + 1) % 3);
  object.setTransform(pose);
  if (what < 3) return;
  if (auto* capsule = dynamic_cast<fcl::Capsule<S>*>(&object.shape())) {
    (column < 2 ? capsule->radius : capsule->lz) = bad;
  }
  if (auto* box = dynamic_cast<fcl::Box<S>*>(&object.shape())) box->side[row] = bad;
}

template <typename S>
class ObjectSources : public testing::Test {};
TYPED_TEST_SUITE(ObjectSources, Scalars, ScalarName);

// An update of all objects would give other bounds than updates of each, so the next update would
// take what has not moved for moved, or miss a margin; or one broken object among others be taken
// as it is.
TYPED_TEST(ObjectSources, ObjectsReadTogetherAreAsEachAlone) {
  using S = TypeParam;
  Random random(61);
  std::size_t with_margin = 0, boxes = 0, refused = 0;
  for (int round = 0; round < 300; ++round) {
    std::vector<std::unique_ptr<Object<S>>> owned;
    std::vector<fcl::CollisionObject<S>*> objects;
    const std::size_t count = 2 + random.below(SegmentBlock::kCapacity - 1);
    const std::size_t broken = round % 2 == 0 ? random.below(count) : count;
    while (objects.size() < count) {
      owned.push_back(makeObject<S>(random));
      if (objects.size() == broken) spoil(*owned.back(), random);
      objects.push_back(random.below(16) == 0 ? nullptr : owned.back().get());
    }
    std::vector<index::SegmentId> ids(count);
    std::iota(ids.begin(), ids.end(), 0);
    const Frame frame = round % 2 == 0 ? Frame{} : Frame{{0.3, -7, 100}, 0x1p12};
    for (const Bounds bounds : {Bounds::kShapes, Bounds::kShapesAndMargins, Bounds::kObjects}) {
      // Marks tell poses and sizes of boxes apart.
      const bool marks = random.below(2) == 0;
      const ObjectSource<S> source("test", objects, bounds, /*beside=*/nullptr, marks);
      SegmentBlock block;
      for (double* row :
           {block.a[0], block.a[1], block.a[2], block.b[0], block.b[1], block.b[2], block.radius}) {
        std::fill_n(row, SegmentBlock::kCapacity, std::numeric_limits<double>::quiet_NaN());
      }
      BlockMask present = 0;
      const bool is_read =
          source.read(ids.data(), static_cast<int>(count), 0, frame, block, present);
      bool all_readable = true;
      for (std::size_t i = 0; i < count; ++i) {
        if (objects[i] == nullptr) {
          if (!is_read) continue;
          EXPECT_EQ(present >> i & 1u, 0u);
          EXPECT_TRUE(isFinite(block[static_cast<int>(i)])) << "the place was never set";
          continue;
        }
        Segment alone;
        const auto read = broadphase::readObject(*objects[i], bounds);
        Segment at_length;
        const char* problem = broadphase::segmentOf(read, frame, at_length, marks);
        EXPECT_EQ(broadphase::readSegment(*objects[i], frame, bounds, alone, marks), problem);
        if (problem != nullptr) {
          all_readable = false;
          continue;
        }
        EXPECT_TRUE(alone == at_length) << "round " << round << ", object " << i;
        Segment bare;
        broadphase::readSegment(*objects[i], frame, Bounds::kShapes, bare, marks);
        with_margin += alone.radius > bare.radius || (alone.isBox() && !(alone == bare));
        boxes += alone.isBox();
        if (is_read) {
          EXPECT_EQ(present >> i & 1u, 1u);
          EXPECT_TRUE(block[static_cast<int>(i)] == alone) << "round " << round << ", object " << i;
        }
      }
      EXPECT_EQ(is_read, all_readable);
      refused += is_read ? 0 : 1;
    }
  }
  EXPECT_GT(with_margin, 300u);
  EXPECT_GT(boxes, 300u);
  EXPECT_GT(refused, 100u);
}

}  // namespace
}  // namespace fcl_fibers::test
