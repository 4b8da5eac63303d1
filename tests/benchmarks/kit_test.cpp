// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_SSaP.h>
#include <fcl/broadphase/broadphase_bruteforce.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl_fibers/benchmark/judge.h>
#include <fcl_fibers/benchmark/managers.h>
#include <fcl_fibers/benchmark/scenes.h>

#include "support/touch_oracle.h"

namespace fcl_fibers::benchmarks {
namespace {

using testing::ExitedWithCode;

// --- The judge ---

struct Crowd {
  std::size_t count;
  double half_side;
  double length;  ///< of each segment, on average
  double radius;
};

/// Capsules all over a cube. One in `rare` is twenty times as long, one is a point.
std::vector<Capsule> crowdOf(const Crowd& crowd, std::size_t rare, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vector = [&] { return fcl::Vector3d(unit(random), unit(random), unit(random)); };
  std::vector<Capsule> capsules;
  for (std::size_t i = 0; i < crowd.count; ++i) {
    const double length = i % 17 == 0 ? 0 : crowd.length * (i % rare == 1 ? 20 : 1);
    const fcl::Vector3d from = crowd.half_side * vector();
    capsules.push_back({from, from + length * vector(), crowd.radius});
  }
  return capsules;
}

test::TouchOracle oracleOf(const std::vector<Capsule>& capsules) {
  std::vector<test::GivenCapsule> given;
  for (const auto& [from, to, radius] : capsules) {
    given.push_back({{from.x(), from.y(), from.z()}, {to.x(), to.y(), to.z()}, radius});
  }
  return test::TouchOracle(given);
}

TEST(Judge, FindsWhatTouchesInAnyCrowd) {
  const Crowd crowds[] = {{400, 1, 0.2, 0.02},
                          {300, 5, 0.1, 0.2},
                          {400, 1e-6, 2e-7, 2e-8},
                          {300, 0, 0.3, 0.01},
                          {200, 1, 0, 0.1}};
  std::size_t touching = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    for (const Crowd& crowd : crowds) {
      const std::vector<Capsule> capsules = crowdOf(crowd, 50, seed);
      const std::vector<CapsulePair> pairs = touchingPairs(capsules);
      EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
      const std::set<CapsulePair> found(pairs.begin(), pairs.end());
      EXPECT_EQ(found.size(), pairs.size());
      touching += found.size();
      std::size_t near = 0;
      oracleOf(capsules).visitNearPairs(0, [&](std::size_t i, std::size_t j, auto verdict) {
        const bool is_found =
            found.count({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)}) > 0;
        near += is_found;
        // Within the band of contact() it may be either.
        if (std::abs(verdict.excess) < 2e-9 * verdict.reach) return;
        EXPECT_EQ(is_found, verdict.touching) << "capsules " << i << " and " << j;
      });
      EXPECT_EQ(near, found.size());
    }
  }
  EXPECT_GT(touching, 10000u);
}

TEST(Judge, LeavesWhatRoundingDecidesToNeither) {
  const auto at = [](double x) { return Capsule{{x, -1, 0}, {x, 1, 0}, 0.5}; };
  EXPECT_EQ(contact(at(0), at(0.999)), Contact::kTouching);
  EXPECT_EQ(contact(at(0), at(1)), Contact::kBoundary);
  EXPECT_EQ(contact(at(0), at(1.001)), Contact::kApart);
  EXPECT_EQ(contact(at(0), at(0.999), 0.01), Contact::kBoundary);
  EXPECT_EQ(contact(at(0), at(1.001), 0.01), Contact::kBoundary);
}

TEST(Judge, RefusesWhatIsNotFinite) {
  EXPECT_TRUE(touchingPairs({}).empty());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(touchingPairs({{{0, 0, 0}, {nan, 0, 0}, 1}}), std::invalid_argument);
  EXPECT_THROW(touchingPairs({{{0, 0, 0}, {1, 0, 0}, INFINITY}}), std::invalid_argument);
  EXPECT_THROW(touchingPairs({{{0, 0, 0}, {1, 0, 0}, -1}}), std::invalid_argument);
  EXPECT_THROW(touchingPairs({{{-1.7e308, 0, 0}, {1.7e308, 0, 0}, 1}}), std::invalid_argument);
  EXPECT_THROW(touchingPairs({{{0, 0, 0}, {1, 0, 0}, 1}}, nan), std::invalid_argument);
}

// --- Scenes ---

TEST(NamedScene, IsAMotionOfTheSameFibers) {
  const Scene scene = namedScene("paper-dynamic:fibers=3,segments=10,frame=7");
  EXPECT_EQ(scene.frame, 7);
  EXPECT_EQ(scene.frame_count, 101);
  const FiberPolylines first = scene.at(0), last = scene.at(100);
  EXPECT_EQ(first.fiberCount(), 3u);
  EXPECT_EQ(first.segmentCount(), 30u);
  EXPECT_EQ(last.segmentCount(), 30u);
  EXPECT_NE(first.points, last.points);
  EXPECT_THROW(scene.at(101), std::invalid_argument);
  const std::string file = FCL_FIBERS_SOURCE_DIR "/tests/data/rings.txt";
  EXPECT_THROW(namedScene(file), std::invalid_argument);
  const Scene swinging = namedScene(file, 0.05);
  EXPECT_NE(swinging.at(0).points, swinging.at(1).points);
  EXPECT_THROW(scene.at(-1), std::invalid_argument);
  EXPECT_THROW(namedScene("no such scene"), std::invalid_argument);
  EXPECT_THROW(namedScene("helix:color=red"), std::invalid_argument);
  EXPECT_THAT(sceneHelp(), testing::HasSubstr("paper-half-scalp"));
}

// --- Managers ---

enum class Fault {
  kNone,
  kLoses,
  kRepeats,
  kItself,
  kInvents,
  kThrows,
  kCrashes,
  kNeverEnds,
  kStale
};

/// Compares all with all, and has a fault.
template <Fault kFault>
class Faulty : public fcl::NaiveCollisionManagerd {
 public:
  using Callback = fcl::CollisionCallBack<double>;
  using NaiveCollisionManager::collide;
  using NaiveCollisionManager::update;

  void update() override { is_moved_ = true; }

  void collide(void* data, Callback callback) const override {
    if constexpr (kFault == Fault::kThrows) throw std::runtime_error("a reason");
    if constexpr (kFault == Fault::kCrashes) std::abort();
    for (volatile bool stuck = kFault == Fault::kNeverEnds; stuck;) {
    }
    Relay relay = {data, callback,
                   kFault == Fault::kLoses || (kFault == Fault::kStale && is_moved_)};
    NaiveCollisionManager::collide(&relay, [](auto* a, auto* b, void* passed) {
      auto& to = *static_cast<Relay*>(passed);
      // The first pair is of two neighbours of a fiber, which touch.
      const bool is_first = std::exchange(to.is_first, false);
      if (is_first && to.loses) return false;
      if (is_first && kFault == Fault::kRepeats) to.callback(a, b, to.data);
      if (is_first && kFault == Fault::kItself) to.callback(a, a, to.data);
      return to.callback(a, b, to.data);
    });
    if constexpr (kFault == Fault::kInvents) callback(this->objs.front(), this->objs.back(), data);
  }

 private:
  struct Relay {
    void* data;
    Callback callback;
    bool loses;
    bool is_first = true;
  };

  bool is_moved_ = false;
};

/// What a program with run() does: both streams are stderr.
[[noreturn]] void runProgram(std::vector<std::string> words) {
  dup2(STDERR_FILENO, STDOUT_FILENO);
  words.insert(words.begin(), "folder/program");
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  const int code = run(static_cast<int>(arguments.size()), arguments.data(),
                       {"paper-static:fibers=4,segments=12"});
  std::fflush(stdout);
  std::_Exit(code);
}

template <Fault kFault>
[[noreturn]] void runWith(Reported reported = Reported::kTouchingAtLeast) {
  registerManager<Faulty<kFault>>("mine", Boxes::kTight, reported);
  runProgram({"--limit=0.5"});
}

/// Stays where it was at set-up.
class Stale : public fcl::DynamicAABBTreeCollisionManagerd {
 public:
  using DynamicAABBTreeCollisionManager::update;
  void update() override {}
};

/// Has one pair more after an update, which is right: objects that are almost near.
class Generous : public fcl::NaiveCollisionManagerd {
 public:
  using NaiveCollisionManager::collide;
  using NaiveCollisionManager::update;
  void update() override { is_moved_ = true; }
  void collide(void* data, fcl::CollisionCallBack<double> callback) const override {
    NaiveCollisionManager::collide(data, callback);
    if (is_moved_) callback(this->objs.front(), this->objs.back(), data);
  }

 private:
  bool is_moved_ = false;
};

/// Reports pairs with what it was never given.
class Inventive : public fcl::NaiveCollisionManagerd {
 public:
  using NaiveCollisionManager::collide;
  void collide(void* data, fcl::CollisionCallBack<double> callback) const override {
    NaiveCollisionManager::collide(data, callback);
    callback(this->objs.front(), nullptr, data);
    callback(&stranger_, this->objs.front(), data);
  }

 private:
  mutable fcl::CollisionObjectd stranger_{std::make_shared<fcl::Sphered>(1)};
};

/// What a bad day brings, in a query.
template <class Deed>
class Doing : public fcl::NaiveCollisionManagerd {
 public:
  using NaiveCollisionManager::collide;
  void collide(void*, fcl::CollisionCallBack<double>) const override { Deed()(); }
};

class KitDeathTest : public testing::Test {};

TEST_F(KitDeathTest, TimesManagersThatAreRight) {
  const auto program = [] {
    registerManager<Faulty<Fault::kNone>>("mine", Boxes::kTight);
    registerManager<fcl::SSaPCollisionManager<float>>("sweep in float");
    registerManager<double>("made", [](const auto& objects) {
      EXPECT_EQ(objects.size(), 48u);
      return std::make_unique<fcl::SSaPCollisionManagerd>();
    });
    registerPeers();
    runProgram({});
  };
  const std::string time = " +[<0-9.]+ [mu]?s";
  for (const std::string name : {"mine", "sweep in float", "made", "DynamicAABBTree/tight",
                                 "LayeredAABBTree/capsules", "WrappedSphereTree/spheres"}) {
    EXPECT_EXIT(program(), ExitedWithCode(0), name + " *" + time + time + time + time);
  }
}

TEST_F(KitDeathTest, SaysWhatIsWrong) {
  EXPECT_EXIT(runWith<Fault::kLoses>(), ExitedWithCode(1),
              "mine +wrong: [0-9]+ missed in detection");
  EXPECT_EXIT(runWith<Fault::kStale>(), ExitedWithCode(1),
              "mine +wrong: [0-9]+ missed in detection after update");
  EXPECT_EXIT(runWith<Fault::kRepeats>(), ExitedWithCode(1), "mine +wrong: 1 reported again");
  EXPECT_EXIT(runWith<Fault::kItself>(), ExitedWithCode(1), "mine +wrong: 1 with themselves");
  EXPECT_EXIT(runWith<Fault::kThrows>(), ExitedWithCode(1),
              "mine +refused in detection when fibers meet: a reason");
  EXPECT_EXIT(runWith<Fault::kCrashes>(), ExitedWithCode(1), "mine +crashed in detection");
  // To be slow is not to be wrong.
  EXPECT_EXIT(runWith<Fault::kNeverEnds>(), ExitedWithCode(0), "mine +>0.5 s in detection");
  // More pairs are right, unless those that touch are promised alone.
  EXPECT_EXIT(runWith<Fault::kInvents>(), ExitedWithCode(0), "mine .* [0-9.]+ us");
  EXPECT_EXIT(runWith<Fault::kInvents>(Reported::kTouching), ExitedWithCode(1),
              "mine +wrong: [0-9]+ not touching");
}

TEST_F(KitDeathTest, NoticesWhoDoesNotNoticeMotion) {
  for (const Boxes boxes : {Boxes::kNone, Boxes::kStock, Boxes::kTight}) {
    for (const char* const scene : {"paper-static:fibers=20,segments=20", "helix:fibers=6",
                                    "paper-strand:fibers=4,segments=200"}) {
      const auto program = [&] {
        registerManager<Stale>("mine", boxes);
        runProgram({std::string("--scene=") + scene});
      };
      EXPECT_EXIT(program(), ExitedWithCode(1), "mine +wrong: [0-9]+ missed in detection after");
    }
  }
  // It names one of the pairs.
  EXPECT_EXIT(runWith<Fault::kLoses>(), ExitedWithCode(1), "such as objects [0-9]+ and [0-9]+");
}

TEST_F(KitDeathTest, TakesOtherPairsAfterOtherUpdates) {
  const auto program = [] {
    registerManager<Generous>("mine", Boxes::kTight);
    runProgram({});
  };
  EXPECT_EXIT(program(), ExitedWithCode(0), "mine .* us .* us");
}

TEST_F(KitDeathTest, OutlivesAnyManager) {
  const auto program = [](auto deed) {
    registerManager<Doing<decltype(deed)>>("mine", Boxes::kTight);
    runProgram({"--limit=0.3"});
  };
  struct Exits {
    void operator()() const { std::exit(0); }
  };
  struct ThrowsANumber {
    void operator()() const { throw 7; }
  };
  struct IsKilled {
    void operator()() const { std::raise(SIGKILL); }
  };
  struct IgnoresSignals {
    void operator()() const {
      std::signal(SIGALRM, SIG_IGN);
      std::signal(SIGTERM, SIG_IGN);
      for (volatile bool stuck = true; stuck;) {
      }
    }
  };
  EXPECT_EXIT(program(Exits()), ExitedWithCode(1),
              "mine +crashed in detection when fibers meet: it ended the process with 0");
  EXPECT_EXIT(program(ThrowsANumber()), ExitedWithCode(1), "mine +refused .* no std::exception");
  EXPECT_EXIT(program(IsKilled()), ExitedWithCode(1), "mine +crashed in detection .*: Killed");
  EXPECT_EXIT(program(IgnoresSignals()), ExitedWithCode(0), "mine +>0.3 s in detection");
  const auto inventive = [] {
    registerManager<Inventive>("mine", Boxes::kTight);
    runProgram({});
  };
  EXPECT_EXIT(inventive(), ExitedWithCode(1), "mine +wrong: 2 of objects that it was not given");
}

// Someone who wants to know which manager is fast on fibers of his own has a file.
TEST_F(KitDeathTest, TakesAFile) {
  const auto program = [](std::vector<std::string> radius) {
    registerPeers();
    radius.insert(radius.begin(), "--scene=" FCL_FIBERS_SOURCE_DIR "/tests/data/rings.txt");
    runProgram(radius);
  };
  EXPECT_EXIT(program({"--radius=0.05"}), ExitedWithCode(0),
              "rings.txt: [0-9]+ segments of [0-9]+ fibers");
  EXPECT_EXIT(program({"--radius=0.05"}), ExitedWithCode(0),
              "LayeredAABBTree/capsules( +[<0-9.]+ [mu]?s){4}");
  EXPECT_EXIT(program({}), ExitedWithCode(1), "rings.txt': the file holds no radius");
}

TEST_F(KitDeathTest, RefusesFloatWhereRoundingDecides) {
  const auto program = [] {
    registerManager<fcl::NaiveCollisionManager<float>>("mine");
    runProgram({"--scene=helix:fibers=5,segments=10,radius=1e-5"});
  };
  EXPECT_EXIT(program(), ExitedWithCode(1), "rounding of float decides [0-9]+ pairs");
}

TEST_F(KitDeathTest, RefusesACommandLineThatIsWrong) {
  const auto program = [](const char* word) {
    registerPeers();
    runProgram({word});
  };
  EXPECT_EXIT(program("--scene=nowhere"), ExitedWithCode(1),
              "program: 'nowhere': there is neither a file nor a scene .* see program --help");
  EXPECT_EXIT(program("--speed=1"), ExitedWithCode(1), "program: there is no option --speed=1");
  EXPECT_EXIT(program("--limit=0"), ExitedWithCode(1), "--limit");
  EXPECT_EXIT(program("--benchmark_speed=1"), ExitedWithCode(1), "program: Google Benchmark");
  EXPECT_EXIT(program("--help"), ExitedWithCode(0), "paper-half-scalp");
  EXPECT_EXIT(runProgram({}), ExitedWithCode(1), "there is no manager; call registerManager");
}

TEST_F(KitDeathTest, LeavesThePrintingToGoogleBenchmarkIfAsked) {
  const auto program = [] {
    registerManager<Faulty<Fault::kNone>>("mine", Boxes::kTight);
    runProgram({"--benchmark_format=json", "--benchmark_filter=update"});
  };
  EXPECT_EXIT(program(), ExitedWithCode(0),
              "paper-static:fibers=4,segments=12/mine/update/iterations:1");
}

TEST(RegisterManager, RefusesANameThatIsEmptyOrTaken) {
  const auto add = [](const char* name) {
    registerManager<fcl::NaiveCollisionManagerd>(name, Boxes::kStock);
  };
  add("a name");
  EXPECT_THROW(add(""), std::invalid_argument);
  EXPECT_THROW(add("a name"), std::invalid_argument);
  EXPECT_THROW(registerManager<fcl::NaiveCollisionManager<float>>("a name"), std::invalid_argument);
}

}  // namespace
}  // namespace fcl_fibers::benchmarks
