// SPDX-License-Identifier: BSD-3-Clause
//
// Random sequences of all that a user may do with a manager, against a model: a list of what is
// registered, and brute force over it. ManagerDifferential has what is missing here: motion, times
// of impact, roots, categories, and meshes that are solid or deform. A sequence that fails is
// shrunk by rapidcheck and printed. RC_PARAMS="seed=7 max_success=1000 max_size=400" runs others
// and longer ones.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/state.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <ostream>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "support/distance_search.h"
#include "support/managers_under_test.h"
#include "support/mesh_models.h"
#include "support/pair_oracle.h"
#include "support/pair_queries.h"
#include "support/scalars.h"
#include "support/scene_generators.h"

namespace fcl_fibers::test {
namespace {

using Indices = std::vector<std::size_t>;

std::string named(const Indices& indices) {
  std::string text;
  for (const std::size_t i : indices) text += (text.empty() ? "" : ", ") + std::to_string(i);
  return "{" + text + "}";
}

// The cast, the same for every sequence: objects are named by their index in it. Half of the fibers
// are a strand, half are rings. Of what a fiber has lost, kObjects more is the name.
constexpr std::size_t kFibers = 4, kSegments = 6, kLoose = 6, kShapes = 12, kUnbounded = 2;
constexpr std::size_t kCapsules = kFibers * kSegments + kLoose, kMeshes = 3;
constexpr std::size_t kObjects = kCapsules + kShapes + kUnbounded + kMeshes;
constexpr std::size_t kShared = 2;  // another manager has it as well

Indices fiberIndices(std::size_t fiber) {
  Indices indices;
  for (std::size_t i = 0; i < kSegments; ++i) indices.push_back(fiber * kSegments + i);
  return indices;
}

// What a manager is to know.
struct Model {
  Indices managed;              // in the order of registration
  std::vector<Indices> fibers;  // that were declared
  std::vector<int> groups;      // of these fibers
  std::vector<FiberEnds> ends;  // likewise
  std::set<std::size_t> stale;  // managed, and moved since an update named them

  bool has(std::size_t i) const {
    return std::find(managed.begin(), managed.end(), i) != managed.end();
  }
  Indices outside() const {
    Indices indices;
    for (std::size_t i = 0; i < kObjects; ++i) {
      if (!has(i)) indices.push_back(i);
    }
    return indices;
  }
  void add(const Indices& added) { managed.insert(managed.end(), added.begin(), added.end()); }
  void remove(std::size_t i) {
    managed.erase(std::find(managed.begin(), managed.end(), i));
    stale.erase(i);
    for (Indices& fiber : fibers) std::replace(fiber.begin(), fiber.end(), i, kObjects + i);
  }
};

template <typename S>
struct Sut {
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;

  Sut(bool with_spheres, const FiberManagerOptions& with, double offset)
      : spheres(with_spheres),
        options(with),
        placement{Eigen::Vector3d(offset, -offset, offset / 2), 1},
        cast(strandScene<S>(kFibers / 2, kSegments, 7, placement)),
        probes(soupScene<S>(5, 1, 9, placement)),
        manager(make()),
        other(make()),
        foreign(makeFclNaive<S>()) {
    Random random(8);
    for (std::size_t f = kFibers / 2; f < kFibers; ++f) {
      const Eigen::Vector3d center = placement.origin + random.inCube(0.3);
      std::vector<Eigen::Vector3d> ring;  // of long and short segments in turn
      for (std::size_t i = 0; i < kSegments; ++i) {
        const double place = static_cast<double>(i) + (i % 2 == 0 ? 0 : 0.7);
        const double angle = 2 * M_PI / kSegments * place;
        ring.push_back(center + 0.4 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0));
      }
      ring.push_back(ring.front());
      cast.addFiber(ring, 0.08);
    }
    for (std::size_t i = 0; i < kLoose; ++i) {
      const Eigen::Vector3d place = placement.origin + random.inCube(1);
      cast.addCapsule(place, place + random.between(0, 1) * random.direction(), 0.05);
    }
    addShapes(cast, kShapes, 0.4, 10, placement);
    cast.addHalfspace({0, 0, 1}, placement.origin.z() - 0.5);
    cast.addPlane({1, 0, 0}, placement.origin.x());
    addShapes(probes, 6, 0.4, 11, placement);
    // Two meshes share their geometry.
    const auto small = makeModel<S>(fcl::BV_AABB, blob(0.25, 0.2, 5, 4)),
               large = makeModel<S>(fcl::BV_OBBRSS, blob(0.5, 0.3, 6, 4));
    const auto add = [&](Scene<S>& scene, const auto& model) {
      const Eigen::Quaterniond rotation = random.rotation();
      scene.add(model, makePose<S>(rotation, placement.origin + random.inCube(0.6)));
    };
    for (const auto& model : {small, large, small}) add(cast, model);
    add(probes, large);
    lost = cast.reallocated(0);
    // A capsule of a fiber may be in both.
    other->registerObjects(probes.objects());
    other->registerObject(cast[kShared]);
    foreign->registerObjects(probes.objects());
  }

  std::unique_ptr<FiberCollisionManager<S>> make() const {
    if (spheres) return makeWrappedSphereTree<S>(options);
    return makeLayeredAabbTree<S>(options);
  }
  Objects objects(const Indices& indices) const {
    Objects all;
    for (const std::size_t i : indices) {
      all.push_back(i < kObjects ? cast[i] : lost[i - kObjects]);
    }
    return all;
  }
  PairOracle<S> oracle(const Model& model) const {
    std::vector<Objects> fibers;
    for (const Indices& fiber : model.fibers) fibers.push_back(objects(fiber));
    Objects all = cast.objects();
    all.insert(all.end(), probes.objects().begin(), probes.objects().end());
    const LeafVolume volume = spheres ? LeafVolume::kSphere : LeafVolume::kBox;
    return PairOracle<S>(all,
                         {volume, options.report, options.margin, options.ignored_neighbors,
                          options.ignored_arc_length},
                         fibers, model.groups, model.ends);
  }

  bool spheres;
  FiberManagerOptions options;
  Placement placement;
  Scene<S> cast, probes;
  Scene<S> lost;  // the cast, which nobody registers
  std::unique_ptr<FiberCollisionManager<S>> manager, other;
  std::unique_ptr<fcl::BroadPhaseCollisionManager<S>> foreign;
};

void require(const testing::AssertionResult& result) {
  if (!result) RC_FAIL(result.message());
}

template <typename S>
struct Command : rc::state::Command<Model, Sut<S>> {
  using Base = rc::state::Command<Model, Sut<S>>;

  /// What the model says of the manager after this command.
  void check(const Model& before, const Sut<S>& sut) const {
    ++commands_run;
    const Model after = this->nextState(before);
    RC_ASSERT(objectsOf<S>(*sut.manager) == sut.objects(after.managed));
    RC_ASSERT(sut.manager->size() == after.managed.size());
    RC_ASSERT(sut.manager->empty() == after.managed.empty());
  }

  /// Pairs that are ignored for something else than their numbers alone.
  static void countNeighbors(const PairOracle<S>& oracle, const Model& model, const Sut<S>& sut) {
    const auto reach = static_cast<std::size_t>(sut.options.ignored_neighbors);
    for (std::size_t f = 0; f < model.fibers.size(); ++f) {
      if (model.groups[f] != 0) continue;
      const auto fiber = sut.objects(model.fibers[f]);
      for (std::size_t i = 0; i < kSegments; ++i) {
        for (std::size_t j = i + reach + 1; j < kSegments; ++j) {
          if (model.fibers[f][i] >= kObjects || model.fibers[f][j] >= kObjects) continue;
          if (!oracle.ignored(fiber[i], fiber[j])) continue;
          const bool is_near = model.ends[f] == FiberEnds::kClosed && i + kSegments - j <= reach;
          ++(is_near ? seam_pairs : arc_pairs);
        }
      }
    }
  }

  static inline std::size_t commands_run = 0, pairs_judged = 0;
  static inline std::size_t seam_pairs = 0, arc_pairs = 0, changes_refused = 0;
};

// --- Registering ---

template <typename S>
struct Register : Command<S> {
  enum class By { kObject, kObjects, kFiber } by;
  Indices added;
  int group = 0;
  FiberEnds ends = FiberEnds::kOpen;

  explicit Register(std::size_t fiber)
      : by(By::kFiber),
        added(fiberIndices(fiber)),
        group(*rc::gen::element(0, 0, 1, 2)),
        ends(*rc::gen::element(FiberEnds::kOpen, FiberEnds::kClosed)) {}
  explicit Register(const Model& model)
      : by(*rc::gen::element(By::kObject, By::kObjects, By::kFiber, By::kFiber, By::kFiber)) {
    if (by == By::kFiber) {
      std::vector<Indices> outside;
      for (std::size_t f = 0; f < kFibers; ++f) {
        const Indices fiber = fiberIndices(f);
        const auto has = [&](std::size_t i) { return model.has(i); };
        if (std::none_of(fiber.begin(), fiber.end(), has)) outside.push_back(fiber);
      }
      RC_PRE(!outside.empty());
      added = *rc::gen::elementOf(outside);
      group = *rc::gen::element(0, 0, 1, 2);
      ends = *rc::gen::element(FiberEnds::kOpen, FiberEnds::kClosed);
    } else {
      const Indices outside = model.outside();
      RC_PRE(!outside.empty());
      const auto count =
          by == By::kObject ? 1 : *rc::gen::inRange<std::size_t>(0, outside.size() + 1);
      const auto first = *rc::gen::inRange<std::size_t>(0, outside.size());
      for (std::size_t i = 0; i < count; ++i)
        added.push_back(outside[(first + i) % outside.size()]);
    }
  }
  void start(Model& model, Sut<S>& sut) const {
    show(RC_LOG() << '\n');
    run(model, sut);
    apply(model);
  }
  void checkPreconditions(const Model& model) const override {
    for (const std::size_t i : added) RC_PRE(!model.has(i));
  }
  void apply(Model& model) const override {
    model.add(added);
    if (by != By::kFiber) return;
    model.fibers.push_back(added);
    model.groups.push_back(group);
    model.ends.push_back(ends);
  }
  void run(const Model& model, Sut<S>& sut) const override {
    const auto objects = sut.objects(added);
    if (by == By::kObject) sut.manager->registerObject(objects[0]);
    if (by == By::kObjects) sut.manager->registerObjects(objects);
    if (by == By::kFiber) sut.manager->registerFiber(objects, ends, FiberGroup{group});
    this->check(model, sut);
  }
  void show(std::ostream& os) const override {
    os << (by == By::kFiber ? "registerFiber " : "register ") << named(added);
    if (ends == FiberEnds::kClosed) os << ", closed";
    if (group != 0) os << ", group " << group;
  }
};

template <typename S>
struct Unregister : Command<S> {
  Indices gone;

  explicit Unregister(const Model& model) {
    RC_PRE(!model.managed.empty());
    const auto count = *rc::gen::inRange<std::size_t>(1, model.managed.size() + 1);
    // Mostly few.
    for (std::size_t i = 0; i < 1 + count / 8; ++i) {
      const std::size_t index = *rc::gen::elementOf(model.managed);
      if (std::find(gone.begin(), gone.end(), index) == gone.end()) gone.push_back(index);
    }
  }
  void checkPreconditions(const Model& model) const override {
    for (const std::size_t i : gone) RC_PRE(model.has(i));
  }
  void apply(Model& model) const override {
    for (const std::size_t i : gone) model.remove(i);
  }
  void run(const Model& model, Sut<S>& sut) const override {
    for (auto* object : sut.objects(gone)) sut.manager->unregisterObject(object);
    this->check(model, sut);
  }
  void show(std::ostream& os) const override { os << "unregister " << named(gone); }
};

template <typename S>
struct Clear : Command<S> {
  explicit Clear(const Model&) {
    // Seldom.
    RC_PRE(*rc::gen::inRange(0, 8) == 0);
  }
  void apply(Model& model) const override { model = {}; }
  void run(const Model& model, Sut<S>& sut) const override {
    sut.manager->clear();
    this->check(model, sut);
  }
  void show(std::ostream& os) const override { os << "clear"; }
};

// Its clone takes a manager's place, over copies of all objects.
template <typename S>
struct Clone : Command<S> {
  std::uint64_t seed;

  explicit Clone(const Model&) : seed(*rc::gen::inRange<std::uint64_t>(0, 1000)) {}
  void apply(Model& model) const override { model.stale.clear(); }
  void run(const Model& model, Sut<S>& sut) const override {
    Scene<S> copies = sut.cast.reallocated(seed);
    sut.other->unregisterObject(sut.cast[kShared]);
    sut.other->registerObject(copies[kShared]);
    std::swap(sut.cast, copies);
    const auto clone = [&] { return cloneOf<S>(*sut.manager, sut.objects(model.managed)); };
    const auto original = std::exchange(sut.manager, clone());
    for (const std::size_t i : model.managed) {
      const FiberSegment its = original->fiberSegment(copies[i]);
      const FiberSegment now = sut.manager->fiberSegment(sut.cast[i]);
      RC_ASSERT(now.fiber == its.fiber && now.number == its.number);
    }
    this->check(model, sut);
  }
  void show(std::ostream& os) const override { os << "clone, seed " << seed; }
};

// A manager that has been moved takes its place.
template <typename S>
struct Move : Command<S> {
  explicit Move(const Model&) {}
  template <class Manager>
  static void move(std::unique_ptr<FiberCollisionManager<S>>& manager) {
    auto& from = dynamic_cast<Manager&>(*manager);
    auto to = std::make_unique<Manager>(std::move(from));
    RC_ASSERT(from.empty());
    manager = std::move(to);
  }
  void run(const Model& model, Sut<S>& sut) const override {
    if (sut.spheres) {
      move<WrappedSphereTreeCollisionManager<S>>(sut.manager);
    } else {
      move<LayeredAABBTreeCollisionManager<S>>(sut.manager);
    }
    this->check(model, sut);
  }
  void show(std::ostream& os) const override { os << "move the manager"; }
};

// --- Moving and reading ---

template <typename S>
struct Update : Command<S> {
  enum class Form { kNone, kAll, kList, kOne } form;
  Indices moved;
  std::uint64_t seed;
  double distance;
  bool swells;  // or shrinks, if it is a capsule

  explicit Update(const Model& model)
      : form(*rc::gen::element(Form::kNone, Form::kAll, Form::kAll, Form::kList, Form::kOne)),
        seed(*rc::gen::inRange<std::uint64_t>(0, 1000)),
        distance(std::pow(10.0, *rc::gen::inRange(-5, 2))),
        swells(*rc::gen::inRange(0, 3) == 0) {
    RC_PRE(!model.managed.empty());
    const auto count = form == Form::kAll   ? model.managed.size()
                       : form == Form::kOne ? 1
                                            : *rc::gen::inRange<std::size_t>(0, 9);
    for (std::size_t i = 0; i < count; ++i) moved.push_back(*rc::gen::elementOf(model.managed));
  }
  void checkPreconditions(const Model& model) const override {
    for (const std::size_t i : moved) RC_PRE(model.has(i));
  }
  void apply(Model& model) const override {
    for (const std::size_t i : moved) model.stale.insert(i);
    if (form == Form::kNone) return;
    if (form == Form::kAll) model.stale.clear();
    for (const std::size_t i : moved) model.stale.erase(i);
  }
  void run(const Model& model, Sut<S>& sut) const override {
    Random random(seed);
    for (const std::size_t i : moved) {
      jolt(*sut.cast[i], random, distance, 1);
      if (!swells || i >= kCapsules) continue;
      sut.cast.capsule(i).radius = static_cast<S>(random.between(0, 0.12));
      sut.cast.capsule(i).computeLocalAABB();
      sut.cast[i]->computeAABB();
    }
    const auto objects = sut.objects(moved);
    if (form == Form::kAll) sut.manager->update();
    if (form == Form::kList) sut.manager->update(objects);
    if (form == Form::kOne) sut.manager->update(objects[0]);
    this->check(model, sut);
  }
  void show(std::ostream& os) const override {
    const char* const kForms[] = {"no update", "update()", "update(objects)", "update(object)"};
    os << (swells ? "move and swell " : "move ") << named(moved) << " by " << distance << " (seed "
       << seed << "), " << kForms[static_cast<int>(form)];
  }
};

template <typename S>
struct Setup : Command<S> {
  explicit Setup(const Model&) {}
  void run(const Model& model, Sut<S>& sut) const override {
    sut.manager->setup();
    this->check(model, sut);
  }
  void show(std::ostream& os) const override { os << "setup"; }
};

// --- Queries ---

template <typename S>
struct Query : Command<S> {
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;
  enum class With { kItself, kObject, kProbe, kFiberManager, kFclManager } with;
  bool is_distance;
  std::size_t object;
  std::size_t ends_at;  // 0: not before its end
  bool throws;

  explicit Query(const Model&)
      : with(*rc::gen::element(With::kItself, With::kObject, With::kProbe, With::kFiberManager,
                               With::kFclManager)),
        is_distance(*rc::gen::arbitrary<bool>()),
        object(*rc::gen::inRange<std::size_t>(0, kObjects)),
        ends_at(*rc::gen::inRange<std::size_t>(0, 12)),
        throws(*rc::gen::arbitrary<bool>()) {}

  template <typename Recorder, typename RunQuery>
  void runQuery(Recorder& recorder, RunQuery&& run) const {
    try {
      run(recorder);
    } catch (const CallbackError&) {
      RC_ASSERT(recorder.throw_at == recorder.calls.size());
    }
  }

  template <typename Recorder, typename RunQuery>
  void runBoth(const Recorder& fresh, Recorder& whole, RunQuery&& run) const {
    Recorder cut = fresh;
    if (ends_at > 0) {
      (throws ? cut.throw_at : cut.stop_at) = ends_at;
      runQuery(cut, run);
      RC_ASSERT(cut.calls.size() <= ends_at);
    }
    runQuery(whole, run);
    RC_ASSERT((ends_at == 0 || cut.calls.size() == std::min(ends_at, whole.calls.size())));
    RC_ASSERT(std::equal(cut.calls.begin(), cut.calls.end(), whole.calls.begin()));
  }

  void run(const Model& model, Sut<S>& sut) const override {
    sut.other->update();
    sut.foreign->update();
    Object* one = with == With::kProbe ? sut.probes[object % sut.probes.size()] : sut.cast[object];
    QueryPartner<S> partner;
    switch (with) {
      case With::kItself:
        break;
      case With::kObject:
      case With::kProbe:
        partner = one;
        break;
      case With::kFiberManager:
        partner = *sut.other;
        break;
      case With::kFclManager:
        partner = *sut.foreign;
        break;
    }
    const Objects& partners = partner.objects;

    const PairOracle<S> oracle = sut.oracle(model);
    const Objects managed = sut.objects(model.managed);
    if (with == With::kItself) this->countNeighbors(oracle, model, sut);
    if (is_distance) {
      DistanceSearch<S> search(oracle);
      runBoth(DistanceSearch<S>(oracle), search,
              [&](DistanceSearch<S>& one_search) { one_search.run(*sut.manager, partner); });
      require(search.keepsToTheRules());
      if (model.stale.empty()) {
        const S smallest = oracle.smallestDistance(managed, partner.isSelf() ? nullptr : &partners);
        RC_ASSERT((smallest > 0 ? search.result() == smallest : search.result() <= 0));
        for (std::size_t i = 0; i + 1 < search.left.size(); ++i) RC_ASSERT(search.left[i] > 0);
      }
    } else {
      PairCollector<S> collector;
      runBoth(PairCollector<S>(), collector, [&](PairCollector<S>& pairs) {
        partner.collide(*sut.manager, &pairs, &PairCollector<S>::collide);
      });
      if (model.stale.empty()) {
        // Nothing is registered at first; the test counts what was found in all.
        constexpr auto kOrder = ArgumentOrder::kPromised;
        require(with == With::kItself
                    ? oracle.answersSelf(collector.calls, managed, kOrder, 0)
                    : oracle.answersBetween(collector.calls, managed, partners, kOrder, 0));
        this->pairs_judged += collector.calls.size();
        RC_ASSERT(!sut.manager->movedSinceUpdate());
      }
    }
    this->check(model, sut);
  }

  void show(std::ostream& os) const override {
    const char* const kWith[] = {"itself", "object", "probe", "another fiber manager",
                                 "a manager of FCL's"};
    os << (is_distance ? "distance with " : "collide with ") << kWith[static_cast<int>(with)];
    if (with == With::kObject || with == With::kProbe) os << " " << object;
    if (ends_at > 0) os << (throws ? ", throws at call " : ", stops at call ") << ends_at;
  }
};

// --- Mistakes ---

template <typename S>
struct Mistake : Command<S> {
  using Manager = FiberCollisionManager<S>;
  enum class Kind { kNull, kTwice, kUnknown, kWithinAQuery, kNumberOf } kind;
  std::size_t object;

  explicit Mistake(const Model&)
      : kind(static_cast<Kind>(*rc::gen::inRange(0, static_cast<int>(Kind::kNumberOf)))),
        object(*rc::gen::inRange<std::size_t>(0, kObjects)) {}

  void checkPreconditions(const Model& model) const override {
    if (kind == Kind::kTwice) RC_PRE(model.has(object));
    if (kind == Kind::kUnknown) RC_PRE(!model.has(object));
  }
  void run(const Model& model, Sut<S>& sut) const override {
    auto& manager = *sut.manager;
    auto* it = sut.cast[object];
    switch (kind) {
      case Kind::kNull:
        RC_ASSERT_THROWS_AS(manager.registerObject(nullptr), std::invalid_argument);
        RC_ASSERT_THROWS_AS(manager.unregisterObject(nullptr), std::invalid_argument);
        break;
      case Kind::kTwice: {
        const auto outside = sut.objects(model.outside());
        auto with_it = outside;
        with_it.push_back(it);
        RC_ASSERT_THROWS_AS(manager.registerObject(it), std::invalid_argument);
        RC_ASSERT_THROWS_AS(manager.registerObjects(with_it), std::invalid_argument);
        break;
      }
      case Kind::kUnknown:
        RC_ASSERT_THROWS_AS(manager.unregisterObject(it), std::invalid_argument);
        manager.update(it);  // passed over
        break;
      default: {
        struct Attempt {
          decltype(&manager) to;
          int made = 0, refused = 0;
        } attempt{&manager};
        manager.collide(&attempt,
                        [](fcl::CollisionObject<S>* a, fcl::CollisionObject<S>*, void* data) {
                          auto& self = *static_cast<Attempt*>(data);
                          const std::vector<std::function<void()>> changes = {
                              [&] { self.to->unregisterObject(a); },
                              [&] { self.to->registerObjects({}); },
                              [&] { self.to->update(); },
                              [&] { self.to->update(a); },
                              [&] { self.to->clear(); },
                          };
                          for (const auto& change : changes) {
                            ++self.made;
                            try {
                              change();
                            } catch (const std::invalid_argument&) {
                              ++self.refused;
                            }
                          }
                          return false;
                        });
        RC_ASSERT(attempt.refused == attempt.made);
        this->changes_refused += static_cast<std::size_t>(attempt.refused);
      }
    }
    this->check(model, sut);
  }
  void show(std::ostream& os) const override {
    const char* const kKinds[] = {"null", "register twice", "unknown", "change within a query"};
    os << "mistake: " << kKinds[static_cast<int>(kind)] << " " << object;
  }
};

template <typename S>
class Stateful : public testing::Test {
 protected:
  // Some thousand calls; rapidcheck reads this once.
  static void SetUpTestSuite() {
    ::setenv("RC_PARAMS", "seed=1 max_success=100 max_size=140", /*overwrite=*/0);
  }
};
TYPED_TEST_SUITE(Stateful, Scalars, ScalarName);

// Some combination of calls that nobody thought of would leave the manager wrong.
TYPED_TEST(Stateful, AManagerIsItsModel) {
  using S = TypeParam;
  using Counts = Command<S>;
  Counts::commands_run = Counts::pairs_judged = Counts::seam_pairs = Counts::arc_pairs = 0;
  Counts::changes_refused = 0;
  EXPECT_TRUE(rc::check("any sequence of calls", [] {
    const bool spheres = *rc::gen::arbitrary<bool>();
    FiberManagerOptions options;
    options.topology = *rc::gen::arbitrary<bool>() ? Topology::kSuperThread : Topology::kBundle;
    options.report = *rc::gen::arbitrary<bool>() ? Report::kCapsules : Report::kVolumes;
    options.margin = *rc::gen::element(0.0, 0.05);
    options.ignored_neighbors = *rc::gen::inRange(0, 4);
    options.ignored_arc_length = *rc::gen::element(0.0, 0.0, 0.43, 0.91);
    options.threads = *rc::gen::inRange(1, 3);
    // Nobody here widens a box.
    options.bounds = *rc::gen::element(Bounds::kShapesAndMargins, Bounds::kShapes);
    if (!spheres && options.report == Report::kCapsules) {
      options.skin = *rc::gen::element(0.0, -1.0, 0.1, 3.0);
    }
    const double offset = *rc::gen::element(0.0, 10.0, 1e4);
    RC_LOG() << (spheres ? "spheres, " : "boxes, ") << topologyName(options.topology) << ", "
             << describe(options) << ", arc length " << options.ignored_arc_length << ", threads "
             << options.threads << ", skin " << options.skin << ", offset " << offset;
    Sut<S> sut(spheres, options, offset);
    Model model;
    for (std::size_t f = 0; f < kFibers; ++f) {
      if (*rc::gen::inRange(0, 4) > 0) Register<S>(f).start(model, sut);
    }
    rc::state::check(
        model, sut,
        rc::state::gen::execOneOfWithArgs<Register<S>, Register<S>, Unregister<S>, Clear<S>,
                                          Clone<S>, Move<S>, Update<S>, Update<S>, Setup<S>,
                                          Query<S>, Query<S>, Query<S>, Mistake<S>>());
  }));
  this->RecordProperty("commands", std::to_string(Counts::commands_run));
  // Fewer would leave open whether these rules were tried.
  EXPECT_GT(Counts::pairs_judged, 5000u);
  EXPECT_GT(Counts::seam_pairs, 100u);
  EXPECT_GT(Counts::arc_pairs, 100u);
  EXPECT_GT(Counts::changes_refused, 100u);
}

}  // namespace
}  // namespace fcl_fibers::test
