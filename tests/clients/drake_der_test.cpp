// SPDX-License-Identifier: BSD-3-Clause
#include "clients/client_support.h"

#include <type_traits>
#include <unordered_map>
#include <utility>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

namespace fcl_fibers::test {
namespace {

constexpr double kMargin = 0.02;

/// Cylinders, flat boxes or capsules along a chain, and the manager that holds them, by value.
template <typename OwnManager>
struct Filament {
  Scene<double> edges;
  OwnManager manager;

  template <typename... Options>
  explicit Filament(const Options&... options) : manager(options...) {}

  void fill(std::size_t kind, Random& random) {
    const double length = 0.1;
    const auto nodes = wanderingChain(30, 0.1, 0.15, random);
    for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
      Geometry shape;
      if (kind % 3 == 0) shape = std::make_shared<fcl::Cylinderd>(0.02, length);
      if (kind % 3 == 1) shape = std::make_shared<fcl::Boxd>(0.06, 0.01, length);
      if (kind % 3 == 2) shape = std::make_shared<fcl::Capsuled>(0.02, length);
      auto* edge = edges.add(std::move(shape), posedAlong(nodes[i], nodes[i + 1]));
      widenShape(*edge, kMargin);
      manager.registerObject(edge);
    }
    manager.setup();
  }
};

/// A step of a program, whatever it keeps its filaments in: pairs of a key and a filament.
template <typename Filaments>
void step(Filaments& filaments, Random& random) {
  Truth truth;
  for (auto& [key, filament] : filaments) {
    jolt(filament.edges.objects(), random, 0.02, 0.1);
    filament.manager.update();
    truth.read(filament.edges.objects(), kMargin);
  }
  for (auto& [key, filament] : filaments) {
    EXPECT_EQ(filament.manager.size(), filament.edges.size());
    truth.expectAll(filament.manager, filament.edges.size() / 2);
    for (auto& [other_key, other] : filaments) {
      if (key < other_key) truth.expectAll(filament.manager, other.manager);
    }
  }
}

/// FCL's manager stays where it was made, as a copy of it would free what the original owns.
void runFilaments(const std::unique_ptr<Manager>&, Random& random) {
  std::unordered_map<std::size_t, Filament<fcl::DynamicAABBTreeCollisionManagerd>> filaments;
  for (std::size_t key = 0; key < 5; ++key) {
    filaments.try_emplace(key).first->second.fill(key, random);
  }
  for (int i = 0; i < 3; ++i) step(filaments, random);
}

/// Ours moves: with a vector that grows, into a map, and from one place to another in it.
template <typename OwnManager>
void runMovedFilaments(const FiberManagerOptions& options, Random& random) {
  using Own = Filament<OwnManager>;
  static_assert(std::is_move_constructible_v<OwnManager> && std::is_move_assignable_v<OwnManager> &&
                !std::is_copy_constructible_v<OwnManager> &&
                !std::is_copy_assignable_v<OwnManager>);
  std::vector<std::pair<std::size_t, Own>> made;
  for (std::size_t key = 0; key < 5; ++key) {
    Own filament(options);
    filament.fill(key, random);
    made.emplace_back(key, std::move(filament));
  }
  step(made, random);

  std::unordered_map<std::size_t, Own> filaments;
  for (auto& [key, filament] : made) {
    filaments.emplace(key, std::move(filament));
    EXPECT_TRUE(filament.manager.empty());
  }
  made.clear();
  step(filaments, random);

  // One takes the place of another, which is gone with its objects, and is filled anew.
  filaments.at(1) = std::move(filaments.at(2));
  EXPECT_TRUE(filaments.at(2).manager.empty());
  filaments.at(2) = Own(options);
  filaments.at(2).fill(1, random);
  step(filaments, random);
}

void runFilaments(const std::unique_ptr<FiberCollisionManager<double>>& like, Random& random) {
  runMovedFilaments<LayeredAABBTreeCollisionManager<double>>(like->options(), random);
}

void runFilaments(const std::unique_ptr<WrappedSphereTreeCollisionManager<double>>& like,
                  Random& random) {
  runMovedFilaments<WrappedSphereTreeCollisionManager<double>>(like->options(), random);
}

// Filaments would take their pairs to nowhere when what holds them moves, or lose those within
// their margins.
MANAGER_SUITE(DrakeDer, ClientManagers);
TYPED_TEST(DrakeDer, FilamentsInContainers) {
  for (const FiberManagerOptions& options : optionsToTest<TypeParam>(0)) {
    SCOPED_TRACE(describe(options));
    Random random(3901);
    runFilaments(TypeParam::make(options), random);
  }
}

}  // namespace
}  // namespace fcl_fibers::test
