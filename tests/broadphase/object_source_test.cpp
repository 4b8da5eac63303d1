// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/object_source.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>

#include "support/drift.h"
#include "support/random.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using broadphase::ObjectSource;
using geometry::BlockMask;
using geometry::Frame;
using geometry::Segment;
using geometry::SegmentBlock;

template <typename S>
class Object : public fcl::CollisionObject<S> {
 public:
  using fcl::CollisionObject<S>::CollisionObject;
  using fcl::CollisionObject<S>::aabb;
};

/// Capsules and spheres, sometimes a box, with boxes of FCL's, tight ones, widened ones and broken
/// ones. Some have no length or hardly any, no radius, or are far out.
template <typename S>
std::unique_ptr<Object<S>> makeObject(Random& random) {
  const double size = std::pow(10.0, random.between(-6, 6));
  const auto length = [&] {
    return static_cast<S>(random.below(6) == 0 ? 0 : size * random.between(0, 1));
  };
  const S radius = length();
  const S lz = length() * (random.below(4) == 0 ? S(1e4) * std::numeric_limits<S>::epsilon() : 1);
  std::shared_ptr<fcl::CollisionGeometry<S>> shape = std::make_shared<fcl::Capsule<S>>(radius, lz);
  if (random.below(6) == 0) shape = std::make_shared<fcl::Sphere<S>>(radius);
  if (random.below(12) == 0) shape = std::make_shared<fcl::Box<S>>(radius, lz, length());
  fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
  if (random.below(4) != 0) pose.linear() = random.rotation().toRotationMatrix().template cast<S>();
  // About as far from a rotation as is taken, or a little farther. Few are, as one alone refuses
  // all.
  if (random.below(4) == 0) {
    const double drift = random.below(64) == 0 ? 1.1e-3 : random.between(0, 0.999e-3);
    pose.linear() = shearedRotation<S>(random.rotation(), drift, random);
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
    case 4:  // as FCL makes it if the pose is turned, or widened if it is not
      object->aabb = fcl::AABB<S>(pose.translation());
      object->aabb.expand(fcl::Vector3<S>::Constant(shape->aabb_radius));
      break;
    default:
      break;
  }
  return object;
}

template <typename S>
class ObjectSources : public testing::Test {};
TYPED_TEST_SUITE(ObjectSources, Scalars, ScalarName);

// An update of all objects would give other bounds than updates of each, so the next update would
// take what has not moved for moved, or miss a margin.
TYPED_TEST(ObjectSources, ObjectsReadTogetherAreAsEachAlone) {
  using S = TypeParam;
  Random random(61);
  std::size_t with_margin = 0, boxes = 0;
  for (int round = 0; round < 300; ++round) {
    std::vector<std::unique_ptr<Object<S>>> owned;
    std::vector<fcl::CollisionObject<S>*> objects;
    const std::size_t count = 2 + random.below(SegmentBlock::kCapacity - 1);
    while (objects.size() < count) {
      owned.push_back(makeObject<S>(random));
      objects.push_back(random.below(16) == 0 ? nullptr : owned.back().get());
    }
    std::vector<index::SegmentId> ids(count);
    std::iota(ids.begin(), ids.end(), 0);
    const Frame frame = round % 2 == 0 ? Frame{} : Frame{{0.3, -7, 100}, 0x1p12};
    for (const Bounds bounds : {Bounds::kShapes, Bounds::kShapesAndMargins, Bounds::kObjects}) {
      const ObjectSource<S> source("test", objects, bounds);
      SegmentBlock block;
      std::memset(&block, 0xFF, sizeof(block));  // NaN
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
        if (broadphase::readSegment(*objects[i], frame, bounds, alone) != nullptr) {
          all_readable = false;
          continue;
        }
        Segment bare;
        broadphase::readSegment(*objects[i], frame, Bounds::kShapes, bare);
        with_margin += alone.radius > bare.radius;
        boxes += alone.isBox();
        if (is_read) {
          EXPECT_EQ(present >> i & 1u, 1u);
          EXPECT_TRUE(block[static_cast<int>(i)] == alone) << "round " << round << ", object " << i;
        }
      }
      EXPECT_EQ(is_read, all_readable);
    }
  }
  EXPECT_GT(with_margin, 300u);
  EXPECT_GT(boxes, 300u);
}

// One object out of sixty-four with a broken pose or size would be taken as it is.
TYPED_TEST(ObjectSources, ABrokenObjectAmongOthersIsFound) {
  using S = TypeParam;
  const S kNan = std::numeric_limits<S>::quiet_NaN(),
          kInfinity = std::numeric_limits<S>::infinity();
  const auto capsule = [] { return std::make_shared<fcl::Capsule<S>>(S(0.1), S(1)); };
  std::vector<std::unique_ptr<Object<S>>> owned;
  std::vector<fcl::CollisionObject<S>*> objects;
  std::vector<std::shared_ptr<fcl::Capsule<S>>> shapes;
  for (int i = 0; i < SegmentBlock::kCapacity; ++i) {
    shapes.push_back(capsule());
    owned.push_back(std::make_unique<Object<S>>(shapes.back()));
    objects.push_back(owned.back().get());
  }
  std::vector<index::SegmentId> ids(objects.size());
  std::iota(ids.begin(), ids.end(), 0);
  const auto isRead = [&] {
    SegmentBlock block;
    BlockMask present = 0;
    return ObjectSource<S>("test", objects, Bounds::kShapesAndMargins)
        .read(ids.data(), SegmentBlock::kCapacity, 0, Frame{}, block, present);
  };
  ASSERT_TRUE(isRead());
  for (std::size_t at : {std::size_t{0}, std::size_t{29}, std::size_t{63}}) {
    const auto expectRefused = [&](const fcl::Transform3<S>& pose) {
      owned[at]->setTransform(pose);
      EXPECT_FALSE(isRead());
      owned[at]->setTransform(fcl::Transform3<S>::Identity());
      ASSERT_TRUE(isRead());
    };
    for (const S bad : {kNan, kInfinity, -kInfinity}) {
      for (int column = 0; column < 4; ++column) {
        fcl::Transform3<S> pose = fcl::Transform3<S>::Identity();
        pose.matrix()(column % 3, column) = bad;
        expectRefused(pose);
      }
    }
    fcl::Transform3<S> mirrored = fcl::Transform3<S>::Identity();
    mirrored.matrix()(0, 0) = -1;
    expectRefused(mirrored);
    fcl::Transform3<S> oblique = fcl::Transform3<S>::Identity();
    oblique.matrix()(0, 1) = S(0.1);
    expectRefused(oblique);
    for (const S bad : {kNan, kInfinity, S(-1)}) {
      shapes[at]->radius = bad;
      EXPECT_FALSE(isRead());
      shapes[at]->radius = S(0.1);
      shapes[at]->lz = bad;
      EXPECT_FALSE(isRead());
      shapes[at]->lz = S(1);
    }
    ASSERT_TRUE(isRead());
  }
}

}  // namespace
}  // namespace fcl_fibers::test
