// SPDX-License-Identifier: BSD-3-Clause
#include "clients/client_support.h"

#include <initializer_list>

#include <fcl/geometry/shape/capsule.h>

namespace fcl_fibers::test {
namespace {

/// Capsules between the nodes of a rod, whose lengths are set by way of the shapes that the limb
/// keeps.
struct Limb {
  std::vector<Eigen::Vector3d> nodes;
  std::vector<std::shared_ptr<fcl::Capsuled>> shapes;
  Scene<double> edges;
  std::unique_ptr<Manager> manager;

  Limb(const Swap& swap, std::size_t count, Random& random)
      : nodes(wanderingChain(count, 0.1, 0.25, random)), manager(swap.make()) {
    for (std::size_t i = 0; i < count; ++i) {
      shapes.push_back(std::make_shared<fcl::Capsuled>(0.02, 1));
      edges.add(shapes.back(), fcl::Transform3d::Identity());
    }
    manager->registerObjects(edges.objects());
    manager->setup();
  }

  /// Neither computeLocalAABB() nor computeAABB(), so that every box remains the one of a capsule
  /// of length one at the origin.
  void step(Random& random) {
    for (Eigen::Vector3d& node : nodes) node += random.inCube(0.01);
    for (std::size_t i = 0; i < edges.size(); ++i) {
      shapes[i]->lz = (nodes[i + 1] - nodes[i]).norm();
      edges[i]->setTransform(posedAlong(nodes[i], nodes[i + 1]));
    }
    manager->update();
  }
};

// All pairs would be reported, as FCL's tree does here, or those of rods whose boxes nobody
// computed would be lost.
void limbsInContact(const Swap& swap, Random& random) {
  const bool is_fcl = swap.rules.volume == LeafVolume::kStock;
  std::vector<Limb> limbs;
  for (const std::size_t edges : std::initializer_list<std::size_t>{50, 30, 1})
    limbs.emplace_back(swap, edges, random);
  for (int frame = 0; frame < 4; ++frame) {
    SCOPED_TRACE("frame " + std::to_string(frame));
    for (Limb& limb : limbs) limb.step(random);
    Truth truth;
    for (const Limb& limb : limbs) truth.read(limb.edges.objects());
    for (std::size_t i = 0; i < limbs.size(); ++i) {
      const auto& edges = limbs[i].edges.objects();
      truth.expectAll(*limbs[i].manager, edges.size() - 1);
      const Calls<double> pairs = selfPairs(*limbs[i].manager);
      EXPECT_TRUE(PairOracle<double>(edges, swap.rules)
                      .answersSelf(pairs, edges, swap.order, edges.size() - 1));
      const std::size_t all = edges.size() * (edges.size() - 1) / 2;
      if (is_fcl) {
        EXPECT_EQ(pairs.size(), all);
      } else if (all > 0) {
        EXPECT_LT(pairs.size(), all / 3);
      }
      for (std::size_t j = i + 1; j < limbs.size(); ++j) {
        truth.expectAll(*limbs[i].manager, *limbs[j].manager, j == 1 ? 1 : 0);
      }
    }
  }
}

MANAGER_SUITE(Dismech, ClientManagers);
TYPED_TEST(Dismech, LimbsInContact) { runClient<TypeParam>(&limbsInContact, 3101); }

}  // namespace
}  // namespace fcl_fibers::test
