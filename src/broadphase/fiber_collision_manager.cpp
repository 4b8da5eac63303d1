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

#include "broadphase/fiber_registry.h"
#include "broadphase/object_segments.h"
#include "geometry/touch.h"
#include "tree/scene.h"

namespace fcl_fibers {
namespace {

using geometry::Frame;
using geometry::FrameChange;
using geometry::Segment;
using tree::Scene;
using tree::SegmentId;
using tree::Visit;

[[noreturn]] void refuse(const char* call, const std::string& what) {
  throw std::invalid_argument(std::string("fcl_fibers: ") + call + ": " + what);
}

std::string nameOf(std::size_t index) { return "object " + std::to_string(index); }

/// What a query does with the pairs it finds: on_pair(a, b).
template <class F>
class PairsTo : public tree::PairSink {
 public:
  explicit PairsTo(F on_pair) : on_pair_(std::move(on_pair)) {}

  Visit take(const tree::Pair* pairs, std::size_t count) override {
    for (const tree::Pair* pair = pairs; pair != pairs + count; ++pair) {
      if (on_pair_(pair->a, pair->b) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }

 private:
  F on_pair_;
};

/// The same for distances: on_pair(a, b, limit).
template <class F>
class NearestTo : public tree::NearestVisitor {
 public:
  explicit NearestTo(F on_pair) : on_pair_(std::move(on_pair)) {}

  Visit visit(SegmentId a, SegmentId b, double& limit) override { return on_pair_(a, b, limit); }

 private:
  F on_pair_;
};

}  // namespace

template <typename S>
class FiberCollisionManager<S>::Impl {
 public:
  Impl(Hierarchy hierarchy, const FiberManagerOptions& options)
      : options_(checked(options)),
        registry_(options.ignored_neighbors > 0),
        scene_({hierarchy == Hierarchy::kWrappedSpheres, options.topology == Topology::kSuperThread,
                options.report == Report::kCapsules, options.margin, options.threads}) {}

  static const FiberManagerOptions& checked(const FiberManagerOptions& options) {
    constexpr const char* kCall = "FiberManagerOptions";
    if (options.ignored_neighbors < 0) {
      refuse(kCall, "ignored_neighbors is " + std::to_string(options.ignored_neighbors) +
                        "; set 0 or more");
    }
    if (!(options.margin >= 0) || !std::isfinite(options.margin)) {
      refuse(kCall,
             "margin is " + std::to_string(options.margin) + "; set a finite length of 0 or more");
    }
    if (options.threads < 1) {
      refuse(kCall, "threads is " + std::to_string(options.threads) + "; set 1 or more");
    }
    return options;
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
      prefetchObject(added, i + kPrefetchAhead);
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
    scene_.clear();
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
    const bool stays = scene_.update(newFrame(), registry_.objects().size(), reader(call));
    if (!stays) return readAndBuild(call);
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
    for (std::size_t i = 0; i < moved.size(); ++i) {
      read(call, moved[i], scene_.frame(), [i] { return nameOf(i); });
    }
    if (!scene_.updateSome(ids, reader(call))) return readAndBuild(call);
    state_ = State::kReady;
  }

  // --- Queries ---

  void collide(const char* call, void* cdata, fcl::CollisionCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call);
    const auto report = [&](SegmentId a, SegmentId b) {
      if (a > b) std::swap(a, b);
      if (ignores(a, b)) return Visit::kContinue;
      return callback(objectOf(a), objectOf(b), cdata) ? Visit::kStop : Visit::kContinue;
    };
    PairsTo sink(report);
    if (scene_.findPairs(sink) == Visit::kStop) return;
    forUnboundedPairs([&](SegmentId a, SegmentId b, const Segment& p, const Segment& q) {
      return boxesTouch(p, q, scene_.margin()) ? report(a, b) : Visit::kContinue;
    });
  }

  void distance(const char* call, void* cdata, fcl::DistanceCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call);
    NearestCall nearest(*this, cdata, callback);
    const auto report = [&](SegmentId a, SegmentId b, double& limit) {
      if (a > b) std::swap(a, b);
      return ignores(a, b) ? Visit::kContinue : nearest.call(objectOf(a), objectOf(b), limit);
    };
    NearestTo visitor([&](SegmentId a, SegmentId b, double& limit) {
      if (options_.report == Report::kCapsules) {
        const Segment& q = scene_.segment(b);
        if (!mayBeNearer(a, q, endPointError(q), limit)) return Visit::kContinue;
      }
      return report(a, b, limit);
    });
    double limit = nearest.limit();
    if (scene_.findNearest(limit, visitor) == Visit::kStop) return;
    limit = nearest.limit();
    forUnboundedPairs([&](SegmentId a, SegmentId b, const Segment& p, const Segment& q) {
      return boxDistanceLowerBound(p, q) < limit ? report(a, b, limit) : Visit::kContinue;
    });
  }

  void collide(const char* call, Object* object, void* cdata,
               fcl::CollisionCallBack<S> callback) const {
    requireCallback(call, callback);
    if (object == nullptr) refuse(call, "the object is null; pass an object");
    const QueryScope scope(*this, call);
    collideOne(readQueryObject(call, object), object, cdata, callback);
  }

  void distance(const char* call, Object* object, void* cdata,
                fcl::DistanceCallBack<S> callback) const {
    requireCallback(call, callback);
    if (object == nullptr) refuse(call, "the object is null; pass an object");
    const QueryScope scope(*this, call);
    NearestCall nearest(*this, cdata, callback);
    distanceOne(readQueryObject(call, object), object, nearest);
  }

  /// Objects of a manager that is none of ours. They are read one by one, when it is their turn, so
  /// that a query that ends early costs no more than it has to.
  void collideAll(const char* call, const std::vector<Object*>& others, void* cdata,
                  fcl::CollisionCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call);
    for (std::size_t i = 0; i < others.size() && registry_.size() > 0; ++i) {
      const Segment segment = readOther(call, others[i], i);
      if (collideOne(segment, others[i], cdata, callback) == Visit::kStop) return;
    }
  }

  void distanceAll(const char* call, const std::vector<Object*>& others, void* cdata,
                   fcl::DistanceCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call);
    NearestCall nearest(*this, cdata, callback);
    for (std::size_t i = 0; i < others.size() && registry_.size() > 0; ++i) {
      const Segment segment = readOther(call, others[i], i);
      if (distanceOne(segment, others[i], nearest) == Visit::kStop) return;
    }
  }

  void collide(const char* call, const Impl& other, void* cdata,
               fcl::CollisionCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call), other_scope(other, call);
    const auto report = [&](SegmentId a, SegmentId b) {
      if (objectOf(a) == other.objectOf(b)) return Visit::kContinue;
      return callback(objectOf(a), other.objectOf(b), cdata) ? Visit::kStop : Visit::kContinue;
    };
    visitBetween(
        other,
        [&] {
          std::vector<Segment> read;
          const bool needs = options_.report == Report::kCapsules && !other.scene_.keepsSegments();
          if (needs) read = other.allSegments();
          PairsTo sink(report);
          return scene_.findPairs(other.scene_,
                                  needs ? read.data() : other.scene_.segments().data(), sink);
        },
        [&](const Segment& segment, double error, SegmentId b, Among among) {
          return findOne(
              segment, error, [&](SegmentId a) { return report(a, b); }, among);
        });
  }

  void distance(const char* call, const Impl& other, void* cdata,
                fcl::DistanceCallBack<S> callback) const {
    requireCallback(call, callback);
    const QueryScope scope(*this, call), other_scope(other, call);
    const FrameChange to_this(other.scene_.frame(), scene_.frame());
    NearestCall nearest(*this, cdata, callback);
    const auto report = [&](SegmentId a, SegmentId b, double& limit) {
      return objectOf(a) == other.objectOf(b) ? Visit::kContinue
                                              : nearest.call(objectOf(a), other.objectOf(b), limit);
    };
    visitBetween(
        other,
        [&] {
          NearestTo visitor([&](SegmentId a, SegmentId b, double& limit) {
            if (options_.report == Report::kCapsules) {
              const Segment q = to_this(other.segmentOf(b));
              if (!mayBeNearer(a, q, to_this.error(q), limit)) return Visit::kContinue;
            }
            return report(a, b, limit);
          });
          return scene_.findNearest(other.scene_, nearest.limit(), visitor);
        },
        [&](const Segment& segment, double error, SegmentId b, Among among) {
          return findNearestOne(
              segment, error, nearest,
              [&](SegmentId a, double& limit) { return report(a, b, limit); }, among);
        });
  }

  // --- Statistics ---

  QueryStatistics selfCollisionStatistics(const char* call) const {
    const QueryScope scope(*this, call);
    QueryStatistics statistics;
    statistics.volume_tests = scene_.countVolumeTests();
    const auto count = [this](std::size_t& counter) {
      return PairsTo([this, &counter](SegmentId a, SegmentId b) {
        counter += !ignores(a, b);
        return Visit::kContinue;
      });
    };
    auto pairs = count(statistics.pairs), tests = count(statistics.capsule_tests);
    scene_.findPairs(pairs);
    if (options_.report == Report::kCapsules) scene_.findVolumePairs(tests);
    forUnboundedPairs([&](SegmentId a, SegmentId b, const Segment& p, const Segment& q) {
      statistics.pairs += boxesTouch(p, q, scene_.margin()) && !ignores(a, b);
      return Visit::kContinue;
    });
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
        scene_.tree());
  }

  std::size_t memoryUsage() const {
    const std::lock_guard<std::mutex> lock(build_mutex_);  // a first query may be building
    return sizeof(*this) + registry_.memoryUsage() + scene_.memoryUsage();
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
    scene_.build(
        newFrame(), registry_.objects().size(),
        [this](auto&& admit) { return registry_.fibers(admit); }, reader(call));
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
    return read(call, object, scene_.frame(), [] { return std::string("the object passed"); });
  }

  Segment readOther(const char* call, const Object* object, std::size_t index) const {
    const auto name = [index] { return nameOf(index) + " of the other manager"; };
    if (object == nullptr) refuse(call, name() + " is null; mend that manager");
    return read(call, object, scene_.frame(), name);
  }

  Frame newFrame() const { return broadphase::sceneFrame(registry_.objects()); }

  /// Objects are large and lie anywhere.
  static constexpr std::size_t kPrefetchAhead = 8;
  static void prefetchLines(const void* object, std::size_t count) {
    if (object == nullptr) return;
    const auto* lines = static_cast<const char*>(object);
    for (std::size_t line = 0; line < count; ++line) __builtin_prefetch(lines + 64 * line);
  }
  static void prefetchObject(const std::vector<Object*>& objects, std::size_t id) {
    if (id + kPrefetchAhead >= objects.size()) return;
    prefetchLines(objects[id + kPrefetchAhead], 3);
    // The object itself has arrived by now, and knows where its geometry is.
    if (objects[id] != nullptr) prefetchLines(objects[id]->collisionGeometry().get(), 2);
  }

  /// Reads objects into the scene.
  auto reader(const char* call) const {
    return [this, call](SegmentId id, Segment& segment) {
      prefetchObject(registry_.objects(), static_cast<std::size_t>(id) + kPrefetchAhead);
      const Object* object = objectOf(id);
      if (object == nullptr) return false;
      if (const char* problem = broadphase::readSegment(*object, scene_.frame(), segment)) {
        const auto& objects = registry_.objects();
        const auto before = std::count(objects.begin(), objects.begin() + id, nullptr);
        refuse(call, nameOf(static_cast<std::size_t>(id - before)) +
                         " in order of registration: " + problem);
      }
      return true;
    };
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
  /// As the scene has it; where it keeps none, as the object is now.
  Segment segmentOf(SegmentId id) const {
    if (scene_.keepsSegments()) return scene_.segment(id);
    Segment segment;
    reader("collide")(id, segment);
    return segment;
  }
  std::vector<Segment> allSegments() const {
    std::vector<Segment> segments(registry_.objects().size());
    forEachId([&](SegmentId id) {
      segments[static_cast<std::size_t>(id)] = segmentOf(id);
      return Visit::kContinue;
    });
    return segments;
  }

  bool ignores(SegmentId a, SegmentId b) const {
    return options_.ignored_neighbors > 0 &&
           registry_.areNeighbors(a, b, options_.ignored_neighbors);
  }

  // --- Distances ---

  /// Hands pairs to a distance callback and keeps the least distance that it has seen.
  class NearestCall {
   public:
    NearestCall(const Impl& impl, void* cdata, fcl::DistanceCallBack<S> callback)
        : scale_(impl.scene_.frame().scale), cdata_(cdata), callback_(callback) {}

    /// In the frame of the scene.
    double limit() const { return static_cast<double>(least_) * scale_; }

    Visit call(Object* first, Object* second, double& limit) {
      const bool stop = callback_(first, second, cdata_, least_);
      limit = this->limit();
      return stop ? Visit::kStop : Visit::kContinue;
    }

   private:
    double scale_;
    void* cdata_;
    fcl::DistanceCallBack<S> callback_;
    S least_ = std::numeric_limits<S>::max();
  };

  /// Whether a pair is worth a call of the distance callback, as far as the capsules say.
  /// @pre the scene keeps segments
  bool mayBeNearer(SegmentId a, const Segment& q, double q_error, double limit) const {
    const Segment& p = scene_.segment(a);
    return touch(p, q, limit, endPointError(p) + q_error);
  }

  // --- Unbounded objects, which are in no tree: tested against all others by their boxes ---

  bool isUnbounded(SegmentId id) const {
    const auto& unbounded = scene_.unbounded();
    return std::binary_search(unbounded.begin(), unbounded.end(), id);
  }

  /// Every pair of managed objects with an unbounded one: visit(a, b, segment of a, segment of b).
  template <class F>
  Visit forUnboundedPairs(F&& visit) const {
    for (const SegmentId u : scene_.unbounded()) {
      const Segment unbounded = segmentOf(u);
      const Visit each = forEachId([&](SegmentId id) {
        // Of two unbounded ones, the pair is the later one's.
        if (id == u || (id > u && isUnbounded(id))) return Visit::kContinue;
        return visit(id, u, segmentOf(id), unbounded);
      });
      if (each == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }

  /// Every managed object that makes an unbounded pair with this one: visit(id, segment).
  template <class F>
  Visit forUnboundedPairs(const Segment& segment, F&& visit) const {
    if (!isBounded(segment)) {
      return forEachId([&](SegmentId id) { return visit(id, segmentOf(id)); });
    }
    for (const SegmentId u : scene_.unbounded()) {
      if (visit(u, segmentOf(u)) == Visit::kStop) return Visit::kStop;
    }
    return Visit::kContinue;
  }

  // --- One segment against the scene, in the scene's frame ---

  enum class Among { kAll, kUnbounded };

  /// Every managed object that meets the segment, as the options have it: on_hit(id).
  template <class F>
  Visit findOne(const Segment& segment, double error, F&& on_hit, Among among = Among::kAll) const {
    if (isBounded(segment) && among == Among::kAll) {
      PairsTo sink([&](SegmentId a, SegmentId) { return on_hit(a); });
      if (scene_.findPairs(segment, error, sink) == Visit::kStop) return Visit::kStop;
    }
    return forUnboundedPairs(segment, [&](SegmentId a, const Segment& p) {
      return boxesTouch(p, segment, scene_.margin()) ? on_hit(a) : Visit::kContinue;
    });
  }

  /// Every managed object that may be nearer than the nearest so far: on_near(id, limit).
  template <class F>
  Visit findNearestOne(const Segment& segment, double error, const NearestCall& nearest,
                       F&& on_near, Among among = Among::kAll) const {
    if (isBounded(segment) && among == Among::kAll) {
      NearestTo visitor([&](SegmentId a, SegmentId, double& limit) {
        const bool prune =
            options_.report == Report::kCapsules && !mayBeNearer(a, segment, error, limit);
        return prune ? Visit::kContinue : on_near(a, limit);
      });
      if (scene_.findNearest(segment, error, nearest.limit(), visitor) == Visit::kStop) {
        return Visit::kStop;
      }
    }
    double limit = nearest.limit();
    return forUnboundedPairs(segment, [&](SegmentId a, const Segment& p) {
      return boxDistanceLowerBound(p, segment) < limit ? on_near(a, limit) : Visit::kContinue;
    });
  }

  Visit collideOne(const Segment& segment, Object* object, void* cdata,
                   fcl::CollisionCallBack<S> callback) const {
    const SegmentId self = registry_.find(object);
    return findOne(segment, endPointError(segment), [&](SegmentId a) {
      if (isSelfOrIgnored(a, self)) return Visit::kContinue;
      return callback(objectOf(a), object, cdata) ? Visit::kStop : Visit::kContinue;
    });
  }

  Visit distanceOne(const Segment& segment, Object* object, NearestCall& nearest) const {
    const SegmentId self = registry_.find(object);
    return findNearestOne(
        segment, endPointError(segment), nearest, [&](SegmentId a, double& limit) {
          return isSelfOrIgnored(a, self) ? Visit::kContinue
                                          : nearest.call(objectOf(a), object, limit);
        });
  }

  bool isSelfOrIgnored(SegmentId a, SegmentId self) const {
    return self != broadphase::FiberRegistry<S>::kNotFound && (a == self || ignores(a, self));
  }

  /// Every pair with an object of another fiber manager: by tree(), where both have trees of one
  /// kind, and by one(segment, error, id, among) for what the trees do not hold, the segment in
  /// this scene's frame.
  template <class TreePairs, class OnePairs>
  Visit visitBetween(const Impl& other, TreePairs&& tree, OnePairs&& one) const {
    const FrameChange to_this(other.scene_.frame(), scene_.frame());
    const auto meet = [&](SegmentId b, Among among) {
      const Segment segment = to_this(other.segmentOf(b));
      return one(segment, to_this.error(segment), b, among);
    };
    const bool matches = scene_.matches(other.scene_);
    if (matches && tree() == Visit::kStop) return Visit::kStop;
    if (matches && scene_.unbounded().empty() && other.scene_.unbounded().empty()) {
      return Visit::kContinue;
    }
    return other.forEachId([&](SegmentId b) {
      return meet(b, matches && !other.isUnbounded(b) ? Among::kUnbounded : Among::kAll);
    });
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
