// SPDX-License-Identifier: BSD-3-Clause
//
// Two managers of objects that move in any of FCL's ways and in one of a program's own, under any
// sequence of calls. They may refuse by std::invalid_argument only. Each pair comes once, in the
// order that is promised, on two threads as on one. What meets at one of many times is found, and
// its impact is no later; what moves along lines and never meets is not found.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl_fibers/continuous_fiber_collision_manager.h>

#include "fuzz_input.h"
#include "support/exact_geometry.h"
#include "support/impact_oracle.h"
#include "support/least_box.h"
#include "support/moving_scene.h"
#include "support/random.h"

namespace {

using fcl_fibers::ContinuousFiberCollisionManager;
using fcl_fibers::FiberEnds;
using fcl_fibers::FiberGroup;
using fcl_fibers::FiberOptions;
using fcl_fibers::Report;
using fcl_fibers::TimedContact;
using fcl_fibers::fuzz::isRefused;
using fcl_fibers::fuzz::require;
using fcl_fibers::test::ExactBox;
using fcl_fibers::test::ExactCapsule;
using fcl_fibers::test::GivenInstant;
using fcl_fibers::test::GivenMotion;
using fcl_fibers::test::ImpactOracle;
using fcl_fibers::test::MotionKind;
using fcl_fibers::test::Moving;
using fcl_fibers::test::MovingScene;
using fcl_fibers::test::Random;
using fcl_fibers::test::Real;
using fcl_fibers::test::SeparationOracle;

/// Scenes that are judged have a size of about 1. This is the rounding of poses and motions.
template <typename S>
constexpr Real kPosing = 1e3L * Real(std::numeric_limits<S>::epsilon());
/// By how much bounds are larger at most.
constexpr Real kBounding = 1e-4L;
/// None of them divides a step as the library does.
constexpr int kTimes = 23;
/// SeparationOracle::ofLines() looks no further.
constexpr double kMostMargin = 0.09;

/// Where an object is during its step.
template <typename S>
struct Course {
  std::vector<ExactBox> boxes;         ///< at many times
  std::vector<ExactCapsule> capsules;  ///< likewise; empty if the shape is no capsule or sphere
  bool is_line;

  explicit Course(const Moving<S>& object)
      : is_line(dynamic_cast<fcl::TranslationMotion<S>*>(object.getMotion()) != nullptr) {
    const auto& shape = *object.collisionGeometry();
    const auto* rod = dynamic_cast<const fcl::Capsule<S>*>(&shape);
    const auto* ball = dynamic_cast<const fcl::Sphere<S>*>(&shape);
    for (int i = 0; i <= kTimes; ++i) {
      const auto posed = fcl_fibers::test::poseAt(object, static_cast<double>(i) / kTimes);
      boxes.push_back(fcl_fibers::test::leastBox(posed));
      if (rod == nullptr && ball == nullptr) continue;
      const fcl_fibers::test::Point middle = posed.getTranslation().template cast<Real>();
      const fcl_fibers::test::Point half =
          posed.getRotation().col(2).template cast<Real>() * Real(rod != nullptr ? rod->lz : 0) / 2;
      const Real radius = rod != nullptr ? rod->radius : ball->radius;
      capsules.push_back({middle - half, middle + half, radius});
    }
  }
};

/// How far apart two objects are at one of the times, by what counts for a report.
template <typename S>
Real gapAt(const Course<S>& p, const Course<S>& q, std::size_t i, Report report) {
  if (report == Report::kVolumes || p.capsules.empty() || q.capsules.empty()) {
    return fcl_fibers::test::boxGap(p.boxes[i], q.boxes[i]);
  }
  const ExactCapsule &a = p.capsules[i], &b = q.capsules[i];
  return fcl_fibers::test::segmentDistance(a.a, a.b, b.a, b.b) - a.radius - b.radius;
}

/// Of two capsules that move along lines.
template <typename S>
GivenMotion motionOf(const Course<S>& p, const Course<S>& q, Real margin) {
  const auto numbers = [](const fcl_fibers::test::Point& x) {
    return std::array{double(x[0]), double(x[1]), double(x[2])};
  };
  const auto instant = [&](const ExactCapsule& a, const ExactCapsule& b) {
    return GivenInstant{{numbers(a.a), numbers(a.b)},
                        {numbers(b.a), numbers(b.b)},
                        {double(a.radius), double(b.radius)}};
  };
  return {instant(p.capsules.front(), q.capsules.front()),
          instant(p.capsules.back(), q.capsules.back()), 2, double(margin)};
}

template <typename S>
class Program {
 public:
  explicit Program(Random random) : random_(std::move(random)) {
    options_.topology =
        chance(0.5) ? fcl_fibers::Topology::kBundle : fcl_fibers::Topology::kSuperThread;
    options_.report = chance(0.5) ? Report::kCapsules : Report::kVolumes;
    options_.ignored_neighbors = static_cast<int>(random_.below(3));
    if (chance(0.5)) options_.margin = random_.between(0, kMostMargin);
    for (Side& side : sides_) {
      for (int i = 0; i < 2; ++i) {
        options_.threads = 1 + i;
        side.managers[static_cast<std::size_t>(i)] = std::make_unique<Manager>(options_);
      }
    }
    const double wildness = chance(0.2) ? 0.1 : 0;
    for (std::size_t i = 2 + random_.below(14); i > 0; --i) {
      const bool is_wild = chance(wildness);
      const auto shape = fcl_fibers::test::randomShape<S>(random_, is_wild ? wildNumber() : 0.2);
      kinds_.push_back(fcl_fibers::test::motionKinds<S>()[random_.below(kKinds)]);
      scene_.add(shape, motion(kinds_.back(), is_wild));
      is_tame_ = is_tame_ && !is_wild;
    }
  }

  void run() {
    for (Side& side : sides_) enroll(side, scene_.objects());
    for (std::size_t i = 2 + random_.below(6); i > 0; --i) {
      query();
      change();
    }
    query();
  }

 private:
  using Manager = ContinuousFiberCollisionManager<S>;
  using Object = Moving<S>;
  using Objects = std::vector<Object*>;
  using Calls = std::vector<std::pair<Object*, Object*>>;

  static constexpr std::size_t kKinds = std::is_same_v<S, float> ? 3 : 5;

  /// What a manager was told of an object.
  struct Place {
    int fiber = -1;  ///< -1 if it is in none
    int segment = 0, fiber_size = 1, group = 0;
    bool is_closed = false;
  };

  /// The same manager for one thread and for two.
  struct Side {
    std::array<std::unique_ptr<Manager>, 2> managers;
    Objects managed;
    std::map<const Object*, Place> places;
    int fibers = 0;

    /// Returns whether the call was refused, by both or by none.
    template <class Call>
    bool refuses(Call&& call) {
      const bool refused = isRefused([&] { call(*managers[0]); });
      require(isRefused([&] { call(*managers[1]); }) == refused);
      return refused;
    }
    bool has(const Object* object) const { return places.count(object) > 0; }
    bool leavesOut(const Object* a, const Object* b, int ignored) const {
      if (!has(a) || !has(b)) return false;
      const Place &p = places.at(a), &q = places.at(b);
      if (p.group != 0 && p.group == q.group) return true;
      if (p.fiber < 0 || p.fiber != q.fiber) return false;
      const int apart = std::abs(p.segment - q.segment);
      return apart <= ignored || (p.is_closed && p.fiber_size - apart <= ignored);
    }
    /// In the order of registration.
    bool isBefore(const Object* a, const Object* b) const {
      const auto first = std::find(managed.begin(), managed.end(), a);
      return std::find(first, managed.end(), b) != managed.end();
    }
  };

  bool chance(double probability) { return random_.unit() < probability; }

  double wildNumber() {
    if (chance(0.1)) return std::numeric_limits<double>::quiet_NaN();
    return std::ldexp(random_.between(-1, 1), static_cast<int>(random_.below(1400)) - 700);
  }

  fcl_fibers::test::Motion<S> motion(MotionKind kind, bool is_wild) {
    const double size = is_wild ? wildNumber() : 0.4;
    const double angle = is_wild && chance(0.5) ? wildNumber() : random_.between(0, 2);
    return fcl_fibers::test::makeMotion<S>(kind, random_.inCube(is_wild ? wildNumber() : 0.6),
                                           chance(0.1) ? 0 : size, angle, random_);
  }

  /// Registers some of the objects as fibers, each by itself or all at once.
  void enroll(Side& side, const Objects& objects) {
    Objects coming;
    for (Object* object : objects) {
      if (chance(0.7)) coming.push_back(object);
    }
    while (!coming.empty()) {
      Objects some;
      for (std::size_t i = 1 + random_.below(4); i > 0 && !coming.empty(); --i) {
        some.push_back(coming.back());
        coming.pop_back();
      }
      const std::size_t form = random_.below(4);
      Place place;
      if (form < 2) {
        place.fiber = side.fibers++;
        place.group = static_cast<int>(random_.below(3));
        place.is_closed = chance(0.3);
        place.fiber_size = static_cast<int>(some.size());
      }
      if (side.refuses([&](Manager& manager) {
            if (form == 3) return manager.registerObject(some[0]);
            if (form == 2) return manager.registerObjects(some);
            manager.registerFiber(some, place.is_closed ? FiberEnds::kClosed : FiberEnds::kOpen,
                                  FiberGroup{place.group});
          })) {
        continue;
      }
      if (form == 3) some.resize(1);
      for (Object* object : some) {
        side.managed.push_back(object);
        side.places[object] = place;
        ++place.segment;
      }
    }
  }

  template <class... Kinds>
  static void assign(fcl::MotionBase<S>& to, const fcl::MotionBase<S>& from) {
    const auto assignAs = [&](auto* motion) {
      using Kind = std::remove_pointer_t<decltype(motion)>;
      motion = dynamic_cast<Kind*>(&to);
      if (motion != nullptr) *motion = dynamic_cast<const Kind&>(from);
    };
    (assignAs(static_cast<Kinds*>(nullptr)), ...);
  }

  void move(std::size_t i, bool is_wild) {
    const auto next = motion(kinds_[i], is_wild);
    fcl::MotionBase<S>& old = *scene_[i]->getMotion();
    assign<fcl::TranslationMotion<S>, fcl::SplineMotion<S>, fcl_fibers::test::OwnMotion<S>>(old,
                                                                                            *next);
    if constexpr (kKinds == 5) assign<fcl::InterpMotion<S>, fcl::ScrewMotion<S>>(old, *next);
  }

  void change() {
    Objects moved;
    std::vector<std::size_t> numbers;
    const double mobility = random_.unit();
    const bool breaks = chance(0.1);
    for (std::size_t i = 0; i < scene_.size(); ++i) {
      if (!chance(mobility)) continue;
      move(i, breaks);
      numbers.push_back(i);
      moved.push_back(scene_[i]);
    }
    const std::size_t form = random_.below(3);
    const auto update = [&](Manager& manager) {
      if (form == 0) return manager.update();
      if (form == 1) return manager.update(moved);
      for (Object* object : moved) manager.update(object);
    };
    for (Side& side : sides_) side.refuses(update);
    is_judged_ = !breaks;
    if (breaks) {
      query();
      for (const std::size_t i : numbers) move(i, false);
      for (Side& side : sides_) {
        require(!side.refuses([](Manager& manager) { manager.update(); }) || !is_tame_);
      }
      is_judged_ = true;
    }
    for (Side& side : sides_) {
      Objects away;
      for (Object* object : scene_.objects()) {
        if (!side.has(object)) {
          away.push_back(object);
        } else if (chance(0.1)) {
          require(!side.refuses([&](Manager& manager) { manager.unregisterObject(object); }));
          side.managed.erase(std::find(side.managed.begin(), side.managed.end(), object));
          side.places.erase(object);
        }
      }
      if (chance(0.3)) enroll(side, away);
      for (const auto& manager : side.managers) {
        Objects held;
        manager->getObjects(held);
        require(held == side.managed && manager->size() == held.size());
      }
    }
  }

  void query() {
    Side &asked = sides_[random_.below(2)], &second = sides_[random_.below(2)];
    Object* object = nullptr;
    Side* other = nullptr;
    const std::size_t form = random_.below(3);
    if (form == 1) object = scene_[random_.below(scene_.size())];
    if (form == 2 && &second != &asked) other = &second;

    struct Search {
      Calls calls;
      std::size_t stop_at = std::numeric_limits<std::size_t>::max();
      S limit = std::numeric_limits<S>::max();

      static bool collide(Object* a, Object* b, void* data) {
        auto& self = *static_cast<Search*>(data);
        self.calls.emplace_back(a, b);
        return self.calls.size() == self.stop_at;
      }
      static bool distance(Object* a, Object* b, void* data, S& least) {
        least = static_cast<Search*>(data)->limit;
        return collide(a, b, data);
      }
    };
    const bool is_distance = chance(0.3), is_cut = chance(0.1);
    std::array<Search, 2> searches;
    const double limit = random_.between(0, 0.5);
    std::size_t next = 0;
    const std::size_t stop_at = 1 + random_.below(8);
    const bool refused = asked.refuses([&](Manager& manager) {
      const std::size_t number = next++;
      Search& search = searches[number];
      if (is_cut) search.stop_at = stop_at;
      if (is_distance) search.limit = static_cast<S>(limit);
      const auto ask = [&](auto... partner) {
        if (is_distance) return manager.distance(partner..., &search, &Search::distance);
        manager.collide(partner..., &search, &Search::collide);
      };
      if (object != nullptr) return ask(object);
      if (other != nullptr)
        return ask(static_cast<typename Manager::Base*>(other->managers[number].get()));
      ask();
    });
    const Calls& calls = searches[0].calls;
    require(calls == searches[1].calls && (!refused || calls.empty()));
    if (refused) return;
    const std::set<std::pair<Object*, Object*>> found(calls.begin(), calls.end());
    require(found.size() == calls.size());
    for (const auto& [a, b] : found) {
      require(asked.has(a) && a != b && !asked.leavesOut(a, b, options_.ignored_neighbors));
      require(object != nullptr  ? b == object
              : other != nullptr ? other->has(b)
                                 : asked.isBefore(a, b));
    }
    if (is_cut) return require(calls.size() <= stop_at);
    if (!is_tame_ || !is_judged_) return;

    const Objects partners = object != nullptr  ? Objects{object}
                             : other != nullptr ? other->managed
                                                : asked.managed;
    std::map<const Object*, Course<S>> courses;
    for (Object* o : scene_.objects()) courses.emplace(o, Course<S>(*o));
    for (Object* a : asked.managed) {
      for (Object* b : partners) {
        if (a == b || asked.leavesOut(a, b, options_.ignored_neighbors)) continue;
        if (object == nullptr && other == nullptr && !asked.isBefore(a, b)) continue;
        const Course<S>&p = courses.at(a), &q = courses.at(b);
        const bool is_found = found.count({a, b}) > 0;
        if (is_distance) {
          judgeDistance(p, q, limit, is_found);
        } else {
          judge(*a, *b, p, q, is_found);
          const Manager* theirs = other != nullptr ? other->managers[0].get() : nullptr;
          judgeImpact(*asked.managers[0], *a, *b, theirs, p, q);
        }
      }
    }
  }

  /// Under Report::kCapsules a capsule that rests counts by itself.
  void judgeDistance(const Course<S>& p, const Course<S>& q, double limit, bool is_found) const {
    const bool by_capsules = options_.report == Report::kCapsules;
    Real least = std::numeric_limits<Real>::infinity();
    for (std::size_t i = 0; i < p.boxes.size(); ++i) {
      const auto toBox = [i](const Course<S>& capsule, const Course<S>& box) {
        const ExactCapsule& a = capsule.capsules[i];
        return fcl_fibers::test::segmentBoxDistance(a.a, a.b, box.boxes[i]) - a.radius;
      };
      const bool p_is_capsule = by_capsules && !p.capsules.empty();
      const bool q_is_capsule = by_capsules && !q.capsules.empty();
      least =
          std::min(least, p_is_capsule && q_is_capsule ? gapAt(p, q, i, Report::kCapsules)
                          : p_is_capsule               ? toBox(p, q)
                          : q_is_capsule               ? toBox(q, p)
                                         : fcl_fibers::test::boxDistance(p.boxes[i], q.boxes[i]));
    }
    require(is_found || least > limit - kPosing<S>);
  }

  void judge(Object& a, Object& b, const Course<S>& p, const Course<S>& q, bool is_found) const {
    const Real margin = options_.margin;
    Real least = std::numeric_limits<Real>::infinity();
    for (std::size_t i = 0; i < p.boxes.size(); ++i) {
      least = std::min(least, gapAt(p, q, i, options_.report));
    }
    require(is_found || least > margin - kPosing<S>);
    if (!p.is_line || !q.is_line) return;
    if (options_.report == Report::kCapsules && !p.capsules.empty() && !q.capsules.empty()) {
      require(is_found ||
              ImpactOracle::apartDuring(motionOf(p, q, margin - kPosing<S>), 0, 1).certain);
      require(!is_found ||
              !ImpactOracle::apartDuring(motionOf(p, q, margin + kBounding), 0, 1).certain);
    } else {
      const Real between = SeparationOracle<S>({&a, &b}, 1).ofLines(0, 1);
      require(is_found ? between < margin + kBounding : between > margin - kBounding);
    }
  }

  void judgeImpact(const Manager& manager, const Object& a, const Object& b, const Manager* theirs,
                   const Course<S>& p, const Course<S>& q) const {
    const Real margin = options_.margin;
    TimedContact contact;
    const bool is_found = manager.findImpact(&a, &b, theirs, contact);
    require(!is_found || (contact.time >= 0 && contact.time <= 1));
    const double until = is_found ? contact.time : 2;
    for (std::size_t i = 0; i < p.boxes.size(); ++i) {
      if (static_cast<double>(i) / kTimes >= until) break;
      require(gapAt(p, q, i, Report::kCapsules) > margin - kPosing<S>);
    }
    if (!is_found || !contact.is_exact) return;
    require(!p.capsules.empty() && !q.capsules.empty());
    if (!p.is_line || !q.is_line) return;
    const GivenMotion motion = motionOf(p, q, margin + kBounding);
    require(ImpactOracle::withinAt(motion, contact.time).certain);
  }

  Random random_;
  FiberOptions options_;
  MovingScene<S> scene_;
  std::vector<MotionKind> kinds_;
  std::array<Side, 2> sides_;
  bool is_tame_ = true;
  bool is_judged_ = true;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  Random random(bytes[0], bytes + 1, size - 1);
  if (bytes[0] % 2 == 0) {
    Program<double>(std::move(random)).run();
  } else {
    Program<float>(std::move(random)).run();
  }
  return 0;
}
