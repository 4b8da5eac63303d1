// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/contact.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"
#include "support/random.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

using Vector = std::array<double, 3>;
template <typename S>
using SumsOf = std::vector<std::array<S, 3>>;

template <typename S>
FiberTree treeOf(const Assembly<S>& fibers, int threads = 1) {
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 0;  // so that some contacts have a point twice
  options.threads = threads;
  FiberTree tree(options);
  tree.build(fibers.view());
  return tree;
}

/// Something to add to, so that sums are not only written.
template <typename S>
SumsOf<S> someSums(std::size_t points) {
  SumsOf<S> sums(points);
  for (std::size_t i = 0; i < points; ++i) {
    sums[i] = {static_cast<S>(i), static_cast<S>(0.1), static_cast<S>(-0.3)};
  }
  return sums;
}

/// The loop that accumulate() stands for.
template <typename S>
void addPart(SumsOf<S>& sums, std::int32_t point, double weight, const Vector& force) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    S& sum = sums[static_cast<std::size_t>(point)][axis];
    sum = static_cast<S>(static_cast<double>(sum) + weight * force[axis]);
  }
}
template <typename S>
void addLoop(const BareContact& c, const Vector& force, SumsOf<S>& a, SumsOf<S>& b) {
  addPart(a, c.pair.a, -(1 - c.s), force);
  addPart(a, c.pair.a + 1, -c.s, force);
  addPart(b, c.pair.b, 1 - c.t, force);
  addPart(b, c.pair.b + 1, c.t, force);
}

Vector alongNormal(double number, const Vector& normal) {
  return {number * normal[0], number * normal[1], number * normal[2]};
}

struct RandomForces {
  explicit RandomForces(std::uint64_t seed, std::size_t count) {
    Random random(seed);
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d f = random.inCube(1);
      vectors.push_back({f.x(), f.y(), f.z()});
      numbers.push_back(f.x() + 0.1);
    }
  }
  std::vector<Vector> vectors;
  std::vector<double> numbers;
};

template <typename S>
class Accumulate : public testing::Test {};
TYPED_TEST_SUITE(Accumulate, Scalars, ScalarName);

// A force would act at another place than the contact.
TYPED_TEST(Accumulate, NodesCarryTheContactPoint) {
  const auto fibers = curledFibers<TypeParam>(41, 60);
  const FiberTree tree = treeOf(fibers);
  std::vector<Contact> contacts;
  tree.find(Contacts{fibers.view()}, contacts);
  ASSERT_GT(contacts.size(), 1000u);
  for (const Contact& c : contacts) {
    const ContactNodes<4> nodes = c.nodes();
    const double radius_a = fibers.capsule(static_cast<std::size_t>(c.pair.a)).radius;
    const double radius_b = fibers.capsule(static_cast<std::size_t>(c.pair.b)).radius;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto at = [&](std::size_t k) {
        return nodes.weights[k] * fibers.point(static_cast<std::size_t>(nodes.points[k]))[axis];
      };
      // A few roundings of coordinates below 4.
      ASSERT_NEAR(at(0) + at(1) + radius_a * c.normal[axis], c.point_a[axis], 1e-14);
      ASSERT_NEAR(at(2) + at(3) - radius_b * c.normal[axis], c.point_b[axis], 1e-14);
    }
  }
}

// Sums would be wrong, or depend on the threads.
TYPED_TEST(Accumulate, AddsAsALoopOverTheContacts) {
  const auto fibers = curledFibers<TypeParam>(42, 60);
  std::vector<Contact> contacts;
  treeOf(fibers).find(Contacts{fibers.view()}, contacts);
  // So many that several threads add.
  for (std::size_t i = 0; contacts.size() < (1u << 18) + 1000; ++i) contacts.push_back(contacts[i]);
  for (const std::size_t count : {contacts.size(), std::size_t{500}}) {
    contacts.resize(count);
    const std::vector<BareContact> bare(contacts.begin(), contacts.end());
    const RandomForces forces(43, count);
    SumsOf<TypeParam> by_vector = someSums<TypeParam>(fibers.pointCount());
    SumsOf<TypeParam> by_number = by_vector;
    for (std::size_t i = 0; i < count; ++i) {
      addLoop(contacts[i], forces.vectors[i], by_vector, by_vector);
      addLoop(contacts[i], alongNormal(forces.numbers[i], contacts[i].normal), by_number,
              by_number);
    }
    for (int threads = 1; threads <= 4; ++threads) {
      const FiberTree tree = treeOf(fibers, threads);
      const auto sumsOf = [&](const ContactForces& given) {
        auto sums = someSums<TypeParam>(fibers.pointCount());
        tree.accumulate(given, sums);
        return sums;
      };
      EXPECT_EQ(sumsOf({contacts, forces.vectors}), by_vector);
      EXPECT_EQ(sumsOf({bare, forces.vectors}), by_vector);
      EXPECT_EQ(sumsOf({contacts, forces.numbers}), by_number);
      EXPECT_EQ(sumsOf({bare, forces.numbers}), by_number);
    }
  }
}

// A force would act on points of the other tree, or with the wrong sign.
TYPED_TEST(Accumulate, AddsOntoThePointsOfTwoTrees) {
  const auto mine = curledFibers<TypeParam>(44, 60), theirs = curledFibers<TypeParam>(45, 50);
  const FiberTree other = treeOf(theirs);
  const auto others = theirs.view();
  std::vector<BareContact> contacts;
  treeOf(mine).find(Contacts{mine.view(), &others}, other, contacts);
  ASSERT_GT(contacts.size(), 100u);
  for (std::size_t i = 0; contacts.size() < (1u << 18); ++i) contacts.push_back(contacts[i]);
  const RandomForces forces(46, contacts.size());
  auto of_mine = someSums<TypeParam>(mine.pointCount());
  auto of_theirs = someSums<TypeParam>(theirs.pointCount());
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    addLoop(contacts[i], forces.vectors[i], of_mine, of_theirs);
  }
  for (const int threads : {1, 3}) {
    const FiberTree tree = treeOf(mine, threads);
    auto a = someSums<TypeParam>(mine.pointCount()), b = someSums<TypeParam>(theirs.pointCount());
    tree.accumulate({contacts, forces.vectors}, other, a, b);
    EXPECT_EQ(a, of_mine);
    EXPECT_EQ(b, of_theirs);
    // Each may be left out.
    a = someSums<TypeParam>(mine.pointCount());
    tree.accumulate({contacts, forces.vectors}, other, a, {});
    EXPECT_EQ(a, of_mine);
    b = someSums<TypeParam>(theirs.pointCount());
    tree.accumulate({contacts, forces.vectors}, other, {}, b);
    EXPECT_EQ(b, of_theirs);
  }
}

// A mesh would be pushed at another place, or not against the fiber.
TYPED_TEST(Accumulate, AddsOntoThePointsOfAMesh) {
  const auto fibers = curledFibers<TypeParam>(47, 120);
  const Triangles<TypeParam> triangles = soup<TypeParam>(48, 400, 0.5);
  TriangleMesh mesh(triangles.view());
  mesh.setPose(randomPose(49, 0.1));
  std::vector<MeshContact> contacts;
  treeOf(fibers).find(Contacts{fibers.view()}, mesh, contacts);
  ASSERT_GT(contacts.size(), 100u);
  for (std::size_t i = 0; contacts.size() < (1u << 18); ++i) contacts.push_back(contacts[i]);
  const RandomForces forces(50, contacts.size());
  auto of_fibers = someSums<TypeParam>(fibers.pointCount());
  auto of_mesh = someSums<double>(triangles.pointCount());
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const MeshContact& c = contacts[i];
    const Vector force = alongNormal(forces.numbers[i], c.normal);
    EXPECT_EQ(c.nodes().points, (std::array<std::int32_t, 2>{c.segment, c.segment + 1}));
    addPart(of_fibers, c.segment, -(1 - c.s), force);
    addPart(of_fibers, c.segment + 1, -c.s, force);
    const std::array<std::int32_t, 3> corners = mesh.corners(c.triangle);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(corners[k], triangles.indices[3 * static_cast<std::size_t>(c.triangle) + k]);
      addPart(of_mesh, corners[k], c.weights[k], force);
    }
  }
  const std::vector<ShapeContact> shapes(contacts.begin(), contacts.end());
  for (const int threads : {1, 3}) {
    const FiberTree tree = treeOf(fibers, threads);
    auto sums = someSums<TypeParam>(fibers.pointCount());
    auto mesh_sums = someSums<double>(triangles.pointCount());  // of another type than the fibers'
    tree.accumulate({contacts, forces.numbers}, mesh, sums, mesh_sums);
    EXPECT_EQ(sums, of_fibers);
    EXPECT_EQ(mesh_sums, of_mesh);
    // The mesh may be left out, as it is for a shape, which has no points.
    sums = someSums<TypeParam>(fibers.pointCount());
    tree.accumulate({contacts, forces.numbers}, sums);
    EXPECT_EQ(sums, of_fibers);
    sums = someSums<TypeParam>(fibers.pointCount());
    tree.accumulate({shapes, forces.numbers}, sums);
    EXPECT_EQ(sums, of_fibers);
  }
  EXPECT_THROW(mesh.corners(-1), std::invalid_argument);
  EXPECT_THROW(mesh.corners(400), std::invalid_argument);
}

/// Three fibers, whose contacts are many enough for several ranges.
struct Refusals : testing::Test {
  Refusals() : fibers(curledFibers<double>(51, 120)), tree(treeOf(fibers, 3)) {
    tree.find(Contacts{fibers.view()}, contacts);
    forces.resize(contacts.size(), 1);
  }

  template <class Sums = SumsOf<double>>
  void expectRefusal(const char* text, Sums sums) {
    const Sums before = sums;
    EXPECT_THAT(
        [&] {
          tree.accumulate({contacts, forces}, sums);
        },
        ThrowsMessage<std::invalid_argument>(HasSubstr(text)));
    EXPECT_EQ(sums, before);
  }
  void expectRefusal(const char* text) {
    expectRefusal(text, someSums<double>(fibers.pointCount()));
  }

  Assembly<double> fibers;
  FiberTree tree;
  std::vector<Contact> contacts;
  std::vector<double> forces;
};

// A program would never learn that its forces have been NaN.
TEST_F(Refusals, OfForces) {
  ASSERT_GT(contacts.size(), 5000u);
  for (const double wrong : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    forces[4999] = wrong;
    forces[3] = wrong;
    expectRefusal("contact 3: its force is NaN, infinite");
    forces[3] = 1;
    expectRefusal("contact 4999: its force is NaN, infinite");
  }
  forces[4999] = 1e39;
  expectRefusal("contact 4999: its force", someSums<float>(fibers.pointCount()));
  forces[4999] = 1;
  contacts[7].normal[2] = std::nan("");
  expectRefusal("contact 7: its force is NaN");
  forces.pop_back();
  expectRefusal("forces for");
}

// Forces would be added to points of other fibers, or beyond the sums.
TEST_F(Refusals, OfContactsOfOtherFibers) {
  const std::vector<Contact> right = contacts;
  const auto expectWrong = [&] {
    expectRefusal("contact 9: it is not of this tree and this partner");
    contacts[9] = right[9];
  };
  contacts[9].layout += 2;
  expectWrong();
  for (const std::uint32_t layout : {std::uint32_t{0}, right[9].layout}) {
    for (const int wrong : {-1, static_cast<int>(fibers.pointCount()) - 1, 1 << 30}) {
      for (const bool is_a : {false, true}) {
        contacts[9].layout = layout;
        (is_a ? contacts[9].pair.a : contacts[9].pair.b) = wrong;
        expectWrong();
      }
    }
  }
  // The last point of a fiber starts no segment.
  contacts[9].layout = 0;
  contacts[9].pair.b = static_cast<int>(fibers.point_begin[2]) - 1;
  expectWrong();
  // Without a layout, right segments will do.
  contacts[9].layout = 0;
  auto sums = someSums<double>(fibers.pointCount());
  tree.accumulate({contacts, forces}, sums);

  const auto fewer = curledFibers<double>(51, 119);
  tree.build(fewer.view());
  expectRefusal("contact 0: it is not", someSums<double>(fewer.pointCount()));
}

TEST_F(Refusals, OfPartners) {
  const auto theirs = curledFibers<double>(52, 20);
  const FiberTree other = treeOf(theirs);
  auto sums = someSums<double>(fibers.pointCount()), others = someSums<double>(theirs.pointCount());
  const auto refusal = [](const char* text) {
    return ThrowsMessage<std::invalid_argument>(HasSubstr(text));
  };
  EXPECT_THAT(
      [&] {
        tree.accumulate({contacts, forces}, other, sums, others);
      },
      refusal("contact 0: it is not of this tree and this partner"));
  EXPECT_THAT(
      [&] {
        tree.accumulate({contacts, forces}, other, sums, sums);
      },
      refusal("but the other tree has"));
  const TriangleMesh mesh(soup<double>(53, 50, 0.5).view());
  EXPECT_THAT(
      [&] {
        tree.accumulate({contacts, forces}, mesh, sums, {});
      },
      refusal("contacts are of two segments"));
  std::vector<MeshContact> of_mesh;
  tree.find(Contacts{fibers.view()}, mesh, of_mesh);
  ASSERT_FALSE(of_mesh.empty());
  forces.resize(of_mesh.size());
  EXPECT_THAT(
      [&] {
        tree.accumulate({of_mesh, forces}, other, sums, others);
      },
      refusal("not of two trees"));
  const std::vector<ShapeContact> shapes(of_mesh.begin(), of_mesh.end());
  EXPECT_THAT([&] { tree.accumulate({shapes, forces}, mesh, sums, {}); }, refusal("of no mesh"));
  EXPECT_THAT(
      [&] {
        tree.accumulate({of_mesh, forces}, mesh, {}, sums);
      },
      refusal("but the mesh has 150"));
  of_mesh[0].triangle = 50;
  EXPECT_THAT(
      [&] {
        tree.accumulate({of_mesh, forces}, mesh, sums, {});
      },
      refusal("contact 0: it is not of this tree and this partner"));
  of_mesh[0].triangle = 0;
  of_mesh[0].weights[2] = -0.1;
  EXPECT_THAT(
      [&] {
        tree.accumulate({of_mesh, forces}, mesh, sums, {});
      },
      refusal("a weight is not in [0, 1]"));
  EXPECT_EQ(sums, someSums<double>(fibers.pointCount()));
  EXPECT_EQ(others, someSums<double>(theirs.pointCount()));
}

TEST_F(Refusals, OfParametersAndSums) {
  for (const double wrong : {-1e-300, 1 + 1e-15, std::nan("")}) {
    contacts[5].s = wrong;
    expectRefusal("contact 5: s, t or a weight is not in [0, 1]");
    contacts[5].s = 0.5;
    contacts[6].t = wrong;
    expectRefusal("contact 6: s, t or a weight is not in [0, 1]");
    contacts[6].t = 0.5;
  }
  expectRefusal("points, but the tree has", someSums<double>(fibers.pointCount() - 1));
  expectRefusal("points, but the tree has", SumsOf<float>());
}

TEST(Accumulate, OfNothingAddsNothing) {
  const FiberTree empty;
  const std::vector<Contact> contacts;
  const std::vector<double> forces;
  SumsOf<double> none;
  empty.accumulate({contacts, forces}, none);
  empty.accumulate({contacts, forces}, empty, none, none);
  const auto fibers = curledFibers<double>(54, 5);
  auto sums = someSums<double>(fibers.pointCount());
  treeOf(fibers).accumulate({contacts, forces}, sums);
  EXPECT_EQ(sums, someSums<double>(fibers.pointCount()));
}

}  // namespace
}  // namespace fcl_fibers::test
