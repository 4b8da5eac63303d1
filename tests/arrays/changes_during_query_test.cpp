// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"
#include "arrays/motion.h"
#include "arrays/queries.h"

namespace fcl_fibers {
namespace {

using test::Motion;

/// What a query reads, made anew for each. Members are empty after they were destroyed.
struct Watched {
  static constexpr int kFibers = 30;
  FiberTreeOptions options = test::capsules();
  Motion<double> own_motion = Motion<double>::random(1, kFibers, 0.1);
  Motion<double> other_motion = Motion<double>::random(2, kFibers, 0.1);
  Motion<float> floats = Motion<float>::random(1, kFibers, 0.1);
  test::Triangles<double> triangles = test::soup<double>(3, 300, 0.4);
  std::optional<FiberTree> own{test::treeOf(own_motion, options)};
  std::optional<FiberTree> other{test::treeOf(other_motion, options)};
  std::optional<TriangleMesh> start{triangles.view()}, end{triangles.view()};
  Shape shape = BoxShape{{-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}};
};

/// All that a query hands out, in its order.
using Found = std::vector<std::pair<std::int32_t, std::int32_t>>;
using Change = std::function<void(Watched&)>;

/// Keeps what a query finds up to so many, and makes a change at the first.
struct Visitor {
  bool operator()(SegmentPair pair) { return take(pair.a, pair.b); }
  bool operator()(const Impact& impact) { return take(impact.pair.a, impact.pair.b); }
  bool operator()(TrianglePair pair) { return take(pair.segment, pair.triangle); }
  bool operator()(const MeshImpact& i) { return take(i.pair.segment, i.pair.triangle); }
  bool operator()(std::int32_t segment) { return take(segment, 0); }

  bool take(std::int32_t a, std::int32_t b) {
    found.emplace_back(a, b);
    if (found.size() == 1) change(scene);
    return found.size() == wanted;
  }

  Watched& scene;
  const Change& change;
  std::size_t wanted = 0;  ///< 0 for all
  Found found = {};
};

struct VisitorQuery {
  const char* name;
  bool reads_other;
  std::function<bool(Watched&, Visitor&)> ask;
};

/// Each that calls a visitor.
std::vector<VisitorQuery> allVisitorQueries() {
  using S = Watched;
  using V = Visitor;
  return {
      {"pairs", false, [](S& s, V& visit) { return s.own->visit(Pairs{}, visit); }},
      {"pairs of two", true, [](S& s, V& visit) { return s.own->visit(Pairs{}, *s.other, visit); }},
      {"impacts", false, [](S& s, V& visit) { return s.own->visit(Impacts{}, visit); }},
      {"impacts of two", true,
       [](S& s, V& visit) { return s.own->visit(Impacts{}, *s.other, visit); }},
      {"moving pairs", false, [](S& s, V& visit) { return s.own->visit(MovingPairs{}, visit); }},
      {"moving pairs of two", true,
       [](S& s, V& visit) { return s.own->visit(MovingPairs{}, *s.other, visit); }},
      {"mesh", false, [](S& s, V& visit) { return s.own->visit(Pairs{}, *s.start, visit); }},
      {"impacts with a mesh", false,
       [](S& s, V& visit) {
         return s.own->visit(Impacts{}, MeshStep{*s.start, *s.end}, visit);
       }},
      {"capsule", false,
       [](S& s, V& visit) {
         return s.own->visit(Pairs{}, CapsuleShape{{0, 0, 0}, {0.1, 0, 0}, 0.3}, visit);
       }},
      {"box", false,
       [](S& s, V& visit) {
         return s.own->visit(Pairs{}, BoxShape{{-0.3, -0.3, -0.3}, {0.3, 0.3, 0.3}}, visit);
       }},
  };
}

Found foundBy(const VisitorQuery& query, const Change& change) {
  Watched scene;
  Visitor visitor{scene, change};
  query.ask(scene, visitor);
  return visitor.found;
}

/// Calls use(name, change) for each call that changes the fibers of a tree.
template <class Use>
void forChanges(FiberTree& tree, const Watched& scene, Use&& use) {
  const auto a = scene.own_motion.start.view(), b = scene.own_motion.end.view();
  const auto c = scene.floats.start.view(), d = scene.floats.end.view();
  use("FiberTree::build", [&] { tree.build(a); });
  use("FiberTree::build", [&] { tree.build(c); });
  use("FiberTree::update", [&] { tree.update(a); });
  use("FiberTree::update", [&] { tree.update(c); });
  use("FiberTree::update", [&] { tree.update(a, b); });
  use("FiberTree::update", [&] { tree.update(c, d); });
}

TEST(VisitorQueries, EndWhereTheVisitorSays) {
  // If this fails, a program that wants the first contacts waits for all, or gets others.
  for (const VisitorQuery& query : allVisitorQueries()) {
    SCOPED_TRACE(query.name);
    Watched scene;
    const Change none = [](Watched&) {};
    Visitor all{scene, none}, some{scene, none, 17};
    EXPECT_FALSE(query.ask(scene, all));
    EXPECT_TRUE(query.ask(scene, some));
    EXPECT_EQ(some.found, Found(all.found.begin(), all.found.begin() + 17));
  }
}

TEST(ChangesDuringAQuery, OfItsTreesAreRefused) {
  // If this fails, a program that changes a tree in a visitor reads freed memory, or is refused
  // although the query has ended or does not read the tree.
  for (const VisitorQuery& query : allVisitorQueries()) {
    SCOPED_TRACE(query.name);
    const auto expectRefusals = [](FiberTree& tree, const Watched& scene) {
      forChanges(tree, scene, [](const std::string& call, const auto& change) {
        EXPECT_THAT(change, testing::ThrowsMessage<std::invalid_argument>(
                                "fcl_fibers: " + call +
                                ": a query is running; make the change after the query has ended"));
      });
    };
    const auto expectNone = [](FiberTree& tree, const Watched& scene) {
      forChanges(tree, scene,
                 [](const std::string&, const auto& change) { EXPECT_NO_THROW(change()); });
    };
    Watched scene;
    const Change change = [&](Watched& s) {
      expectRefusals(*s.own, s);
      query.reads_other ? expectRefusals(*s.other, s) : expectNone(*s.other, s);
    };
    Visitor visitor{scene, change};
    query.ask(scene, visitor);
    EXPECT_GT(visitor.found.size(), 20u);
    EXPECT_EQ(visitor.found, foundBy(query, [](Watched&) {}));
    expectNone(*scene.own, scene);
    expectNone(*scene.other, scene);
  }
}

TEST(ChangesDuringAQuery, EndWithAVisitorThatThrows) {
  // If this fails, a tree whose visitor has thrown can never be changed again.
  for (const VisitorQuery& query : allVisitorQueries()) {
    SCOPED_TRACE(query.name);
    Watched scene;
    const Change fail = [](Watched&) { throw std::runtime_error("enough"); };
    Visitor visitor{scene, fail};
    EXPECT_THROW(query.ask(scene, visitor), std::runtime_error);
    for (FiberTree* tree : {&*scene.own, &*scene.other}) {
      forChanges(*tree, scene,
                 [](const std::string&, const auto& change) { EXPECT_NO_THROW(change()); });
    }
  }
}

/// Each change that is not refused.
std::vector<std::pair<const char*, Change>> allChanges() {
  return {
      {"trees are replaced", [](Watched& s) { *s.own = FiberTree(), *s.other = FiberTree(); }},
      {"trees are exchanged", [](Watched& s) { std::swap(*s.own, *s.other); }},
      {"trees are moved away",
       [](Watched& s) { const FiberTree a(std::move(*s.own)), b(std::move(*s.other)); }},
      {"trees are destroyed", [](Watched& s) { s.own.reset(), s.other.reset(); }},
      {"meshes are replaced",
       [](Watched& s) { *s.start = *s.end = TriangleMesh(MeshArrays<double>{}); }},
      {"meshes are moved away",
       [](Watched& s) { const TriangleMesh a(std::move(*s.start)), b(std::move(*s.end)); }},
      {"meshes are destroyed", [](Watched& s) { s.start.reset(), s.end.reset(); }},
      {"meshes are updated",
       [](Watched& s) {
         auto far = s.triangles;
         for (double& x : far.points) x += 10;
         s.start->update(far.view()), s.end->update(far.view());
         const std::vector<float> points(far.points.begin(), far.points.end());
         const MeshArrays<float> floats{points.data(), far.pointCount(), far.indices.data(),
                                        far.count()};
         s.start->update(floats), s.end->update(floats);
       }},
      {"meshes are posed and sorted",
       [](Watched& s) {
         for (auto* mesh : {&*s.start, &*s.end}) {
           mesh->setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {10, 0, 0}});
           mesh->setCategories(0);
         }
       }},
      {"the shape is replaced",
       [](Watched& s) {
         s.shape = BoxShape{{9, 9, 9}, {10, 10, 10}};
       }},
  };
}

TEST(ChangesDuringAQuery, ThatCannotBeRefusedComeAfterIt) {
  // If this fails, a visitor that moves, replaces or destroys what the query reads, or changes a
  // mesh, makes the query read freed memory or mix the old with the new.
  const auto changes = allChanges();
  for (const VisitorQuery& query : allVisitorQueries()) {
    const Found expected = foundBy(query, [](Watched&) {});
    for (const auto& [name, change] : changes) {
      EXPECT_EQ(foundBy(query, change), expected) << query.name << ": " << name;
    }
  }
}

/// The contacts that all threads find, while the first one makes a change.
template <class Ask>
test::Record contactsOf(int threads, const Change& change, const Ask& ask) {
  FiberTreeOptions options = test::capsules();
  options.threads = threads;
  Watched scene{options};
  test::Record found;
  std::mutex mutex;
  ask(scene, [&](const auto& contact, int /*worker*/) {
    const std::lock_guard<std::mutex> lock(mutex);
    if (found.size() == 0) change(scene);
    found(contact);
  });
  return found.sorted();
}

TEST(ChangesDuringAQuery, DoNotReachContacts) {
  // If this fails, a solver that moves a mesh or lets go of a tree while contacts come gets those
  // of another place, or crashes.
  const tbb::global_control most(tbb::global_control::max_allowed_parallelism, 64);
  const auto check = [](const char* partner, const auto& ask) {
    const test::Record expected = contactsOf(
        1, [](Watched&) {}, ask);
    EXPECT_GT(expected.size(), 100u) << partner;
    for (const int threads : {1, 8}) {
      for (const auto& [name, change] : allChanges()) {
        EXPECT_TRUE(contactsOf(threads, change, ask).is(expected))
            << partner << ": " << name << ", threads " << threads;
      }
    }
  };
  check("the tree itself", [](Watched& s, const auto& visit) {
    s.own->visitInParallel(Contacts{s.own_motion.end.view()}, visit);
  });
  check("another tree", [](Watched& s, const auto& visit) {
    const FiberArrays<double> others = s.other_motion.end.view();
    s.own->visitInParallel(Contacts{s.own_motion.end.view(), &others}, *s.other, visit);
  });
  check("a mesh", [](Watched& s, const auto& visit) {
    s.own->visitInParallel(Contacts{s.own_motion.end.view()}, *s.start, visit);
  });
  check("a shape", [](Watched& s, const auto& visit) {
    s.own->visitInParallel(Contacts{s.own_motion.end.view()}, s.shape, visit);
  });
}

}  // namespace
}  // namespace fcl_fibers
