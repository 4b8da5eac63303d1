// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_collision_manager.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "broadphase/fiber_registry.h"
#include "broadphase/object_segments.h"
#include "geometry/touch.h"
#include "tree/fiber_tree.h"
#include "tree/traversal.h"

namespace fcl_fibers {
namespace {

using geometry::Frame;
using geometry::FrameChange;
using geometry::Segment;
using tree::SegmentId;
using tree::Visit;

[[noreturn]] void refuse(const char* call, const std::string& what) {
  throw std::invalid_argument(std::string("fcl_fibers: ") + call + ": " + what);
}

std::string nameOf(std::size_t index) { return "object " + std::to_string(index); }

/// What a query does with a pair that its admission has let through: on_pair(query, a, b).
template <class Admission, class F>
struct Query : Admission {
  F on_pair;
  SegmentId second = 0;  ///< b in a query of one segment against the scene

  Query(Admission admission, F f) : Admission(std::move(admission)), on_pair(std::move(f)) {}

  Visit leafPair(SegmentId a, SegmentId b) { return on_pair(*this, a, b); }
  Visit leaf(SegmentId a) { return on_pair(*this, a, second); }
};

template <class Admission, class F>
Query<Admission, F> makeQuery(Admission admission, F on_pair) {
  return {std::move(admission), std::move(on_pair)};
}

/// Counts what it admits from.
struct CountingAdmission : tree::OverlapAdmission {
  std::size_t* volume_tests;

  template <class Pack, class Volume, class F>
  Visit forEachAdmitted(const Pack& pack, const Volume& volume, geometry::LaneMask lanes,
                        double unit, F&& visit) {
    *volume_tests += static_cast<std::size_t>(__builtin_popcount(lanes));
    return OverlapAdmission::forEachAdmitted(pack, volume, lanes, unit, visit);
  }
};

// Pairs of which one is unbounded never reach a tree; they are admitted by their boxes.
bool admitsBoxes(const tree::OverlapAdmission&, const Segment& p, const Segment& q, double margin) {
  return boxesTouch(p, q, margin);
}
bool admitsBoxes(const tree::NearestAdmission& nearest, const Segment& p, const Segment& q,
                 double /*margin*/) {
  return boxDistanceLowerBound(p, q) < nearest.limit;
}

using Tree = std::variant<tree::LayeredBoxTree<8>, tree::LayeredBoxTree<2>,
                          tree::WrappedSphereTree<8>, tree::WrappedSphereTree<2>>;

/// What queries read, in the frame of the scene.
struct Scene {
  Frame frame;
  std::vector<Segment> segments;     ///< by id; what an empty id has is not read
  std::vector<SegmentId> unbounded;  ///< kept apart from the tree and tested against everything
  Tree tree;
};

}  // namespace

template <typename S>
class FiberCollisionManager<S>::Impl {
 public:
  Impl(Hierarchy hierarchy, const FiberManagerOptions& options)
      : options_(options), hierarchy_(hierarchy), registry_(options.ignored_neighbors > 0) {
    constexpr const char* kCall = "FiberManagerOptions";
    if (options.ignored_neighbors < 0) {
      refuse(kCall, "ignored_neighbors is " + std::to_string(options.ignored_neighbors) +
                        "; set 0 or more");
    }
    if (!(options.margin >= 0) || !std::isfinite(options.margin)) {
      refuse(kCall,
             "margin is " + std::to_string(options.margin) + "; set a finite length of 0 or more");
    }
  }

  const FiberManagerOptions& options() const { return options_; }
  const broadphase::FiberRegistry<S>& registry() const { return registry_; }

  // --- Registering ---

  enum class Fibers { kDeclared, kGuessed };

  void add(const char* call, const std::vector<Object*>& added, Fibers fibers) {
    refuseDuringQuery(call);
    if (added.size() > static_cast<std::size_t>(std::numeric_limits<SegmentId>::max()) / 2 -
                           registry_.objects().size()) {
      refuse(call, "too many objects; use several managers");
    }
    // Objects are read here to refuse the bad ones early and to guess fibers; where they will be
    // when the tree is built may be elsewhere.
    std::vector<bool> starts_fiber(added.size());
    std::optional<Segment> previous = last_registered_;
    for (std::size_t i = 0; i < added.size(); ++i) {
      if (added[i] == nullptr) refuse(call, nameOf(i) + " is null; pass objects only");
      const Segment segment = read(call, added[i], Frame{}, [i] { return nameOf(i); });
      const bool is_capsule = isCapsule(*added[i]);
      if (fibers == Fibers::kDeclared) {
        if (!is_capsule) {
          refuse(call, nameOf(i) + " is no capsule; register it by registerObject() instead");
        }
        starts_fiber[i] = i == 0;
      } else {
        starts_fiber[i] = !(is_capsule && previous && shareEnd(*previous, segment));
        previous = is_capsule ? std::optional<Segment>(segment) : std::nullopt;
      }
    }
    if (const auto duplicate = registry_.add(added, starts_fiber, fibers == Fibers::kDeclared)) {
      refuse(call, nameOf(*duplicate) + " is registered already; register each object once");
    }
    if (!added.empty()) {
      last_registered_ = previous;
      if (fibers == Fibers::kDeclared) last_registered_.reset();
      markStale();
    }
  }

  void remove(const char* call, const Object* object) {
    refuseDuringQuery(call);
    managedId(call, object, "object");
    markStale();
    last_registered_.reset();
    registry_.remove(object);
  }

  void clear(const char* call) {
    refuseDuringQuery(call);
    registry_.clear();
    scene_ = Scene{};
    last_registered_.reset();
    state_ = State::kStale;
  }

  // --- Reading the objects ---

  void setup(const char* call) {
    if (state_ == State::kReady) return;
    refuseDuringQuery(call);
    readAndBuild(call);
  }

  void update(const char* call) {
    refuseDuringQuery(call);
    if (state_.exchange(State::kRefused) != State::kReady) return readAndBuild(call);
    const std::vector<SegmentId> unbounded_before = scene_.unbounded;
    readAll(call);
    if (scene_.unbounded == unbounded_before) {
      refit();
    } else {
      build();
    }
    state_ = State::kReady;
  }

  void update(const char* call, const std::vector<Object*>& moved) {
    refuseDuringQuery(call);
    std::vector<SegmentId> ids;
    ids.reserve(moved.size());
    for (std::size_t i = 0; i < moved.size(); ++i)
      ids.push_back(managedId(call, moved[i], nameOf(i)));
    // A sweep over the whole tree costs less than the ways up from many segments.
    if (state_ != State::kReady || 4 * moved.size() > registry_.size()) {
      if (!moved.empty() || state_ != State::kReady) update(call);
      return;
    }
    state_ = State::kRefused;
    bool bounds_changed = false;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      Segment& segment = segmentOf(scene_, ids[i]);
      const bool was_bounded = isBounded(segment);
      segment = read(call, moved[i], scene_.frame, [i] { return nameOf(i); });
      bounds_changed |= was_bounded != isBounded(segment);
    }
    if (bounds_changed) {
      readAll(call);
      build();
    } else {
      ids.erase(std::remove_if(ids.begin(), ids.end(),
                               [&](SegmentId id) { return !isBounded(segmentOf(scene_, id)); }),
                ids.end());
      std::visit([&](auto& tree) { tree.refitMoved(scene_.segments, ids); }, scene_.tree);
    }
    state_ = State::kReady;
  }

  // --- Queries ---

  void collide(const char* call, void* cdata, fcl::CollisionCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call);
    auto query = makeQuery(tree::OverlapAdmission{}, [&](auto&, SegmentId a, SegmentId b) {
      if (a > b) std::swap(a, b);
      if (ignores(a, b) || !reports(a, b)) return Visit::kContinue;
      return callback(objectOf(a), objectOf(b), cdata) ? Visit::kStop : Visit::kContinue;
    });
    visitSelf(query);
  }

  void distance(const char* call, void* cdata, fcl::DistanceCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call);
    S least = std::numeric_limits<S>::max();
    auto query = makeQuery(nearerThan(least), [&](auto& nearest, SegmentId a, SegmentId b) {
      if (a > b) std::swap(a, b);
      if (ignores(a, b)) return Visit::kContinue;
      const Segment &p = segmentOf(scene_, a), &q = segmentOf(scene_, b);
      return callNearest(nearest, p, q, endPointErrors(p, q), objectOf(a), objectOf(b), cdata,
                         callback, least);
    });
    visitSelf(query);
  }

  void collide(const char* call, Object* object, void* cdata,
               fcl::CollisionCallBack<S> callback) const {
    requireCallback(call, callback);
    if (object == nullptr) refuse(call, "the object is null; pass an object");
    const QueryScope scope(*this, call);
    const Segment segment = readQueryObject(call, object);
    const SegmentId self = registry_.find(object);
    collideOne(segment, endPointError(segment), object, self, cdata, callback);
  }

  void distance(const char* call, Object* object, void* cdata,
                fcl::DistanceCallBack<S> callback) const {
    requireCallback(call, callback);
    if (object == nullptr) refuse(call, "the object is null; pass an object");
    const QueryScope scope(*this, call);
    const Segment segment = readQueryObject(call, object);
    const SegmentId self = registry_.find(object);
    S least = std::numeric_limits<S>::max();
    distanceOne(segment, endPointError(segment), object, self, cdata, callback, least);
  }

  /// Objects of a manager that is none of ours. They are read one by one, when it is their turn, so
  /// that a query that ends early costs no more than it has to.
  void collideAll(const char* call, const std::vector<Object*>& others, void* cdata,
                  fcl::CollisionCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call);
    for (std::size_t i = 0; i < others.size() && registry_.size() > 0; ++i) {
      const Segment segment = readOther(call, others[i], i);
      if (collideOne(segment, endPointError(segment), others[i], registry_.find(others[i]), cdata,
                     callback) == Visit::kStop) {
        return;
      }
    }
  }

  void distanceAll(const char* call, const std::vector<Object*>& others, void* cdata,
                   fcl::DistanceCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call);
    S least = std::numeric_limits<S>::max();
    for (std::size_t i = 0; i < others.size() && registry_.size() > 0; ++i) {
      const Segment segment = readOther(call, others[i], i);
      if (distanceOne(segment, endPointError(segment), others[i], registry_.find(others[i]), cdata,
                      callback, least) == Visit::kStop) {
        return;
      }
    }
  }

  void collide(const char* call, const Impl& other, void* cdata,
               fcl::CollisionCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call), other_scope(other, call);
    const FrameChange to_this(other.scene_.frame, scene_.frame);
    auto query = makeQuery(tree::OverlapAdmission{}, [&](auto&, SegmentId a, SegmentId b) {
      const Segment q = to_this(segmentOf(other.scene_, b));
      if (objectOf(a) == other.objectOf(b) ||
          !touchesIfAsked(segmentOf(scene_, a), q, to_this.error(q))) {
        return Visit::kContinue;
      }
      return callback(objectOf(a), other.objectOf(b), cdata) ? Visit::kStop : Visit::kContinue;
    });
    visitBetween(other, to_this, query);
  }

  void distance(const char* call, const Impl& other, void* cdata,
                fcl::DistanceCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call), other_scope(other, call);
    const FrameChange to_this(other.scene_.frame, scene_.frame);
    S least = std::numeric_limits<S>::max();
    auto query = makeQuery(nearerThan(least), [&](auto& nearest, SegmentId a, SegmentId b) {
      if (objectOf(a) == other.objectOf(b)) return Visit::kContinue;
      const Segment& p = segmentOf(scene_, a);
      const Segment q = to_this(segmentOf(other.scene_, b));
      return callNearest(nearest, p, q, endPointError(p) + to_this.error(q), objectOf(a),
                         other.objectOf(b), cdata, callback, least);
    });
    visitBetween(other, to_this, query);
  }

  // --- Statistics ---

  QueryStatistics selfCollisionStatistics(const char* call) const {
    const QueryScope scope(*this, call);
    QueryStatistics statistics;
    CountingAdmission admission;
    admission.volume_tests = &statistics.volume_tests;
    auto query = makeQuery(admission, [&](auto&, SegmentId a, SegmentId b) {
      if (ignores(a, b)) return Visit::kContinue;
      statistics.capsule_tests += options_.report == Report::kCapsules;
      statistics.pairs += reports(a, b);
      return Visit::kContinue;
    });
    visitSelf(query);
    return statistics;
  }

  CascadeStatistics cascadeStatistics(const char* call) const {
    const QueryScope scope(*this, call);
    return std::visit(
        [](const auto& tree) -> CascadeStatistics {
          if constexpr (std::is_same_v<typename std::decay_t<decltype(tree)>::Volume,
                                       geometry::Sphere>) {
            return {tree.hierarchy().cagesKept(), tree.hierarchy().cagesRecomputed()};
          } else {
            return {};
          }
        },
        scene_.tree);
  }

  std::size_t memoryUsage() const {
    const std::lock_guard<std::mutex> lock(build_mutex_);  // a first query may be building
    return sizeof(*this) + registry_.memoryUsage() + scene_.segments.capacity() * sizeof(Segment) +
           scene_.unbounded.capacity() * sizeof(SegmentId) +
           std::visit([](const auto& tree) { return tree.memoryUsage(); }, scene_.tree);
  }

  SegmentId managedId(const char* call, const Object* object, const std::string& name) const {
    if (object == nullptr) refuse(call, name + " is null; pass a registered object");
    const SegmentId id = registry_.find(object);
    if (id == broadphase::FiberRegistry<S>::kNotFound) {
      refuse(call, name + " is not registered; register it first");
    }
    return id;
  }

 private:
  enum class State {
    kStale,    ///< objects were registered or unregistered; the next query reads all and builds
    kReady,    ///< the scene may be queried
    kRefused,  ///< the last update failed; the scene is neither old nor new
  };

  /// Holds the scene ready and fixed while a query runs.
  class QueryScope {
   public:
    QueryScope(const Impl& impl, const char* call) : impl_(impl) {
      ++impl_.running_queries_;
      try {
        impl_.makeReady(call);
      } catch (...) {
        --impl_.running_queries_;
        throw;
      }
    }
    ~QueryScope() { --impl_.running_queries_; }
    QueryScope(const QueryScope&) = delete;
    QueryScope& operator=(const QueryScope&) = delete;

   private:
    const Impl& impl_;
  };

  void refuseDuringQuery(const char* call) const {
    if (running_queries_ != 0) {
      refuse(call, "a query is running; collect what is to be changed and change it afterwards");
    }
  }

  /// Several queries may be the first; one of them builds.
  void makeReady(const char* call) const {
    if (state_.load(std::memory_order_acquire) == State::kReady) return;
    const std::lock_guard<std::mutex> lock(build_mutex_);
    if (state_ == State::kReady) return;
    if (state_ == State::kRefused) {
      refuse(call, "the last update failed; mend the object it named and call update()");
    }
    readAndBuild(call);
  }

  void markStale() {
    if (state_ == State::kReady) state_ = State::kStale;
  }

  void readAndBuild(const char* call) const {
    readAll(call);
    build();
    state_.store(State::kReady, std::memory_order_release);
  }

  template <class Name>
  Segment read(const char* call, const Object* object, const Frame& frame, Name&& name) const {
    Segment segment;
    if (const char* problem = broadphase::readSegment(*object, frame, segment)) {
      refuse(call, name() + ": " + problem);
    }
    return segment;
  }

  Segment readQueryObject(const char* call, const Object* object) const {
    return read(call, object, scene_.frame, [] { return std::string("the object passed"); });
  }

  Segment readOther(const char* call, const Object* object, std::size_t index) const {
    const auto name = [index] { return nameOf(index) + " of the other manager"; };
    if (object == nullptr) refuse(call, name() + " is null; mend that manager");
    return read(call, object, scene_.frame, name);
  }

  /// Reads every object into the scene, in a frame chosen anew.
  void readAll(const char* call) const {
    const std::vector<Object*>& objects = registry_.objects();
    scene_.frame = broadphase::sceneFrame(objects);
    scene_.segments.resize(objects.size());
    scene_.unbounded.clear();
    for (std::size_t id = 0; id < objects.size(); ++id) {
      if (objects[id] == nullptr) continue;
      Segment& segment = scene_.segments[id];
      segment = read(call, objects[id], scene_.frame, [&] {
        const auto before =
            std::count(objects.begin(), objects.begin() + static_cast<std::ptrdiff_t>(id), nullptr);
        return nameOf(id - static_cast<std::size_t>(before)) + " in order of registration";
      });
      if (!isBounded(segment)) scene_.unbounded.push_back(static_cast<SegmentId>(id));
    }
  }

  double padding() const { return margin() / 2; }
  /// In the scene's frame, as all that follows.
  double margin() const { return options_.margin * scene_.frame.scale; }

  void build() const {
    const tree::Fibers fibers =
        registry_.fibers([&](SegmentId id) { return isBounded(segmentOf(scene_, id)); });
    const bool boxes = hierarchy_ == Hierarchy::kLayeredBoxes;
    if (options_.topology == Topology::kBundle) {
      auto topology = tree::bundle(fibers, scene_.segments);
      if (boxes) {
        scene_.tree = tree::LayeredBoxTree<8>(std::move(topology));
      } else {
        scene_.tree = tree::WrappedSphereTree<8>(std::move(topology));
      }
    } else {
      auto topology = tree::superThread(fibers);
      if (boxes) {
        scene_.tree = tree::LayeredBoxTree<2>(std::move(topology));
      } else {
        scene_.tree = tree::WrappedSphereTree<2>(std::move(topology));
      }
    }
    refit();
  }

  void refit() const {
    std::visit([&](auto& tree) { tree.refit(scene_.segments, padding()); }, scene_.tree);
  }

  static bool isCapsule(const Object& object) {
    return object.collisionGeometry()->getNodeType() == fcl::GEOM_CAPSULE;
  }

  /// Whether one of each one's ends is the same but for rounding: 4 ulp of the largest coordinate.
  static bool shareEnd(const Segment& p, const Segment& q) {
    const double largest = std::max({maxNorm(p.a), maxNorm(p.b), maxNorm(q.a), maxNorm(q.b)});
    const double tolerance = 4 * double{std::numeric_limits<S>::epsilon()} * largest;
    for (const auto& end : {p.a, p.b}) {
      if (maxNorm(end - q.a) <= tolerance || maxNorm(end - q.b) <= tolerance) return true;
    }
    return false;
  }

  template <class Callback>
  static void requireCallback(const char* call, Callback callback) {
    if (callback == nullptr) refuse(call, "the callback is null; pass a function");
  }

  Object* objectOf(SegmentId id) const { return registry_.objects()[static_cast<std::size_t>(id)]; }
  template <class AScene>
  static auto& segmentOf(AScene& scene, SegmentId id) {
    return scene.segments[static_cast<std::size_t>(id)];
  }
  static double endPointErrors(const Segment& p, const Segment& q) {
    return endPointError(p) + endPointError(q);
  }

  // --- The pair filter behind the tree ---

  bool ignores(SegmentId a, SegmentId b) const {
    return options_.ignored_neighbors > 0 &&
           registry_.areNeighbors(a, b, options_.ignored_neighbors);
  }

  bool touchesIfAsked(const Segment& p, const Segment& q, double q_error) const {
    return options_.report == Report::kVolumes || touch(p, q, margin(), endPointError(p) + q_error);
  }

  /// Of a pair that is not ignored.
  bool reports(SegmentId a, SegmentId b) const {
    if (options_.report == Report::kVolumes) return true;
    const Segment& q = segmentOf(scene_, b);
    return touchesIfAsked(segmentOf(scene_, a), q, endPointError(q));
  }

  tree::NearestAdmission nearerThan(S distance) const {
    return {static_cast<double>(distance) * scene_.frame.scale};
  }

  /// Hands a pair to a distance callback, unless the capsules are known to be no nearer than the
  /// nearest pair so far.
  Visit callNearest(tree::NearestAdmission& nearest, const Segment& p, const Segment& q,
                    double error, Object* first, Object* second, void* cdata,
                    fcl::DistanceCallBack<S> callback, S& least) const {
    if (options_.report == Report::kCapsules &&
        !(capsuleDistanceLowerBound(p, q, error) < nearest.limit)) {
      return Visit::kContinue;
    }
    const bool stop = callback(first, second, cdata, least);
    nearest.limit = nearerThan(least).limit;
    return stop ? Visit::kStop : Visit::kContinue;
  }

  // --- Traversals, with the unbounded objects ---

  /// Every unordered pair of managed objects that the query admits.
  template <class Q>
  void visitSelf(Q& query) const {
    const Visit visit =
        std::visit([&](const auto& tree) { return visitPairs(tree, query); }, scene_.tree);
    if (visit == Visit::kStop) return;
    for (const SegmentId u : scene_.unbounded) {
      const Segment& unbounded = segmentOf(scene_, u);
      const Visit each = forEachId([&](SegmentId id) {
        const Segment& segment = segmentOf(scene_, id);
        // Of two unbounded ones, the pair is the later one's.
        if (id == u || (id > u && !isBounded(segment))) return Visit::kContinue;
        return admitsBoxes(query, segment, unbounded, margin()) ? query.leafPair(id, u)
                                                                : Visit::kContinue;
      });
      if (each == Visit::kStop) return;
    }
  }

  /// Every managed object that the query admits against one segment in this scene's frame.
  template <class Q>
  Visit visitOne(const Segment& segment, double error, Q& query) const {
    if (!isBounded(segment)) {
      return forEachId([&](SegmentId id) {
        return admitsBoxes(query, segmentOf(scene_, id), segment, margin()) ? query.leaf(id)
                                                                            : Visit::kContinue;
      });
    }
    const Visit visit = std::visit(
        [&](const auto& tree) {
          using Volume = typename std::decay_t<decltype(tree)>::Volume;
          return visitLeaves(tree, Volume::around(segment, tree.padding() + error), query);
        },
        scene_.tree);
    if (visit == Visit::kStop) return Visit::kStop;
    for (const SegmentId u : scene_.unbounded) {
      if (admitsBoxes(query, segmentOf(scene_, u), segment, margin()) &&
          query.leaf(u) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }

  /// Every pair of one of this manager's objects and one of the other's that the query admits.
  template <class Q>
  void visitBetween(const Impl& other, const FrameChange& to_this, Q& query) const {
    const auto one_of_others = [&](SegmentId b) {
      const Segment segment = to_this(segmentOf(other.scene_, b));
      query.second = b;
      return visitOne(segment, to_this.error(segment), query);
    };
    std::visit(
        [&](const auto& tree, const auto& other_tree) {
          if constexpr (std::is_same_v<decltype(tree), decltype(other_tree)>) {
            // Each tree is padded by half its own margin; the sum has to be this manager's.
            const double growth = (options_.margin - other.options_.margin) / 2;
            const FrameChange b_to_a(other.scene_.frame, scene_.frame, growth * scene_.frame.scale);
            const FrameChange a_to_b(scene_.frame, other.scene_.frame,
                                     growth * other.scene_.frame.scale);
            if (visitPairs(tree, other_tree, b_to_a, a_to_b, query) == Visit::kStop) return;
            for (const SegmentId u : scene_.unbounded) {
              const Segment& unbounded = segmentOf(scene_, u);
              const Visit visit = other.forEachId([&](SegmentId b) {
                const Segment segment = to_this(segmentOf(other.scene_, b));
                if (!isBounded(segment)) return Visit::kContinue;
                return admitsBoxes(query, unbounded, segment, margin()) ? query.leafPair(u, b)
                                                                        : Visit::kContinue;
              });
              if (visit == Visit::kStop) return;
            }
            for (const SegmentId b : other.scene_.unbounded) {
              if (one_of_others(b) == Visit::kStop) return;
            }
          } else {
            other.forEachId(one_of_others);
          }
        },
        scene_.tree, other.scene_.tree);
  }

  Visit collideOne(const Segment& segment, double error, Object* object, SegmentId self,
                   void* cdata, fcl::CollisionCallBack<S> callback) const {
    auto query = makeQuery(tree::OverlapAdmission{}, [&](auto&, SegmentId a, SegmentId) {
      if (isSelfOrIgnored(a, self) || !touchesIfAsked(segmentOf(scene_, a), segment, error)) {
        return Visit::kContinue;
      }
      return callback(objectOf(a), object, cdata) ? Visit::kStop : Visit::kContinue;
    });
    return visitOne(segment, error, query);
  }

  Visit distanceOne(const Segment& segment, double error, Object* object, SegmentId self,
                    void* cdata, fcl::DistanceCallBack<S> callback, S& least) const {
    auto query = makeQuery(nearerThan(least), [&](auto& nearest, SegmentId a, SegmentId) {
      if (isSelfOrIgnored(a, self)) return Visit::kContinue;
      const Segment& p = segmentOf(scene_, a);
      return callNearest(nearest, p, segment, endPointError(p) + error, objectOf(a), object, cdata,
                         callback, least);
    });
    return visitOne(segment, error, query);
  }

  bool isSelfOrIgnored(SegmentId a, SegmentId self) const {
    return self != broadphase::FiberRegistry<S>::kNotFound && (a == self || ignores(a, self));
  }

  template <class F>
  Visit forEachId(F&& visit) const {
    for (std::size_t id = 0; id < registry_.objects().size(); ++id) {
      if (registry_.objects()[id] != nullptr && visit(static_cast<SegmentId>(id)) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    return Visit::kContinue;
  }

  const FiberManagerOptions options_;
  const Hierarchy hierarchy_;
  broadphase::FiberRegistry<S> registry_;
  std::optional<Segment> last_registered_;  ///< a capsule that the next one may continue

  // The first query after registering builds the scene, on whichever thread it runs.
  mutable Scene scene_;
  mutable std::mutex build_mutex_;
  mutable std::atomic<State> state_{State::kStale};
  mutable std::atomic<int> running_queries_{0};
};

template <typename S>
FiberCollisionManager<S>::FiberCollisionManager(Hierarchy hierarchy,
                                                const FiberManagerOptions& options)
    : impl_(std::make_unique<Impl>(hierarchy, options)) {}

template <typename S>
FiberCollisionManager<S>::~FiberCollisionManager() = default;

template <typename S>
void FiberCollisionManager<S>::registerFiber(const std::vector<Object*>& fiber) {
  impl_->add("registerFiber", fiber, Impl::Fibers::kDeclared);
}

template <typename S>
void FiberCollisionManager<S>::registerObjects(const std::vector<Object*>& objects) {
  impl_->add("registerObjects", objects, Impl::Fibers::kGuessed);
}

template <typename S>
void FiberCollisionManager<S>::registerObject(Object* object) {
  impl_->add("registerObject", {object}, Impl::Fibers::kGuessed);
}

template <typename S>
void FiberCollisionManager<S>::unregisterObject(Object* object) {
  impl_->remove("unregisterObject", object);
}

template <typename S>
void FiberCollisionManager<S>::setup() {
  impl_->setup("setup");
}

template <typename S>
void FiberCollisionManager<S>::update() {
  impl_->update("update");
}

template <typename S>
void FiberCollisionManager<S>::update(Object* object) {
  impl_->update("update", {object});
}

template <typename S>
void FiberCollisionManager<S>::update(const std::vector<Object*>& objects) {
  impl_->update("update", objects);
}

template <typename S>
void FiberCollisionManager<S>::clear() {
  impl_->clear("clear");
}

template <typename S>
void FiberCollisionManager<S>::getObjects(std::vector<Object*>& objects) const {
  objects.clear();
  objects.reserve(size());
  for (Object* object : impl_->registry().objects()) {
    if (object != nullptr) objects.push_back(object);
  }
}

template <typename S>
void FiberCollisionManager<S>::collide(Object* object, void* cdata,
                                       fcl::CollisionCallBack<S> callback) const {
  impl_->collide("collide", object, cdata, callback);
}

template <typename S>
void FiberCollisionManager<S>::collide(void* cdata, fcl::CollisionCallBack<S> callback) const {
  impl_->collide("collide", cdata, callback);
}

template <typename S>
void FiberCollisionManager<S>::collide(fcl::BroadPhaseCollisionManager<S>* other, void* cdata,
                                       fcl::CollisionCallBack<S> callback) const {
  if (other == nullptr) refuse("collide", "the manager is null; pass a manager");
  if (other == this) return collide(cdata, callback);
  if (const auto* fibers = dynamic_cast<const FiberCollisionManager*>(other)) {
    return impl_->collide("collide", *fibers->impl_, cdata, callback);
  }
  std::vector<Object*> objects;
  other->getObjects(objects);
  impl_->collideAll("collide", objects, cdata, callback);
}

template <typename S>
void FiberCollisionManager<S>::distance(Object* object, void* cdata,
                                        fcl::DistanceCallBack<S> callback) const {
  impl_->distance("distance", object, cdata, callback);
}

template <typename S>
void FiberCollisionManager<S>::distance(void* cdata, fcl::DistanceCallBack<S> callback) const {
  impl_->distance("distance", cdata, callback);
}

template <typename S>
void FiberCollisionManager<S>::distance(fcl::BroadPhaseCollisionManager<S>* other, void* cdata,
                                        fcl::DistanceCallBack<S> callback) const {
  if (other == nullptr) refuse("distance", "the manager is null; pass a manager");
  if (other == this) return distance(cdata, callback);
  if (const auto* fibers = dynamic_cast<const FiberCollisionManager*>(other)) {
    return impl_->distance("distance", *fibers->impl_, cdata, callback);
  }
  std::vector<Object*> objects;
  other->getObjects(objects);
  impl_->distanceAll("distance", objects, cdata, callback);
}

template <typename S>
bool FiberCollisionManager<S>::empty() const {
  return size() == 0;
}

template <typename S>
std::size_t FiberCollisionManager<S>::size() const {
  return impl_->registry().size();
}

template <typename S>
const FiberManagerOptions& FiberCollisionManager<S>::options() const {
  return impl_->options();
}

template <typename S>
FiberSegment FiberCollisionManager<S>::fiberSegment(const Object* object) const {
  return impl_->registry().fiberSegment(
      impl_->managedId("fiberSegment", object, "the object passed"));
}

template <typename S>
QueryStatistics FiberCollisionManager<S>::selfCollisionStatistics() const {
  return impl_->selfCollisionStatistics("selfCollisionStatistics");
}

template <typename S>
std::size_t FiberCollisionManager<S>::memoryUsage() const {
  return impl_->memoryUsage();
}

template <typename S>
LayeredAABBTreeCollisionManager<S>::LayeredAABBTreeCollisionManager(
    const FiberManagerOptions& options)
    : FiberCollisionManager<S>(FiberCollisionManager<S>::Hierarchy::kLayeredBoxes, options) {}

template <typename S>
WrappedSphereTreeCollisionManager<S>::WrappedSphereTreeCollisionManager(
    const FiberManagerOptions& options)
    : FiberCollisionManager<S>(FiberCollisionManager<S>::Hierarchy::kWrappedSpheres, options) {}

template <typename S>
CascadeStatistics WrappedSphereTreeCollisionManager<S>::cascadeStatistics() const {
  return this->impl_->cascadeStatistics("cascadeStatistics");
}

template class FiberCollisionManager<float>;
template class FiberCollisionManager<double>;
template class LayeredAABBTreeCollisionManager<float>;
template class LayeredAABBTreeCollisionManager<double>;
template class WrappedSphereTreeCollisionManager<float>;
template class WrappedSphereTreeCollisionManager<double>;

}  // namespace fcl_fibers
