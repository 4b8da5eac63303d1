// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/capsule_test.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

#include "support/random.h"
#include "support/scoped_target.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using test::Random;
using test::Real;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kCapacity = CapsulePairs::kCapacity;

struct Question {
  Segment p, q;
  double margin = 0;
  double error = 0;
};
struct Block {
  double unit = 1;
  std::vector<Question> questions;
};

enum class Answer { kUndecided, kTouching, kApart, kBoth };
std::ostream& operator<<(std::ostream& out, Answer answer) {
  return out << static_cast<int>(answer);
}

std::vector<Answer> answersOf(CapsulePairs& pairs) {
  const CapsulePairs::Verdict verdict = pairs.decide();
  std::vector<Answer> answers;
  for (int i = 0; i < pairs.size(); ++i) {
    const bool touching = (verdict.touching >> i & 1u) != 0;
    const bool apart = (verdict.apart >> i & 1u) != 0;
    answers.push_back(touching ? (apart ? Answer::kBoth : Answer::kTouching)
                               : (apart ? Answer::kApart : Answer::kUndecided));
  }
  return answers;
}

/// A block with the capsules that it borrows.
struct BlockOfPairs {
  CapsulePairs pairs;
  std::vector<CapsuleEnd> ends;

  explicit BlockOfPairs(double unit) : pairs(unit) { ends.reserve(4 * kCapacity); }
  void add(const Question& question) {
    const std::size_t first = ends.size();
    for (const Segment& s : {question.p, question.q}) {
      ends.push_back(firstEndOf(s));
      ends.push_back(secondEndOf(s));
    }
    pairs.add(&ends[first], &ends[first + 2], question.margin, question.error);
  }
};

/// With the instruction set in use.
std::vector<Answer> answersTo(const Block& block) {
  BlockOfPairs asked(block.unit);
  for (const Question& question : block.questions) asked.add(question);
  return answersOf(asked.pairs);
}

std::string described(const Question& question) {
  std::ostringstream out;
  out.precision(17);
  for (const Segment& s : {question.p, question.q}) {
    for (const Vec3d& v : {s.a, s.b}) out << '(' << v.x << ' ' << v.y << ' ' << v.z << ") ";
    out << "radius " << s.radius << ", ";
  }
  out << "margin " << question.margin << ", error " << question.error;
  return out.str();
}

/// No answer is wrong, and all instruction sets give the same; returns how many there are.
void expectTrueAnswers(const Block& block, std::size_t& decided) {
  const std::vector<Answer> answers = answersTo(block);
  for (const std::int64_t target : simd::availableTargets()) {
    const simd::ScopedTarget scoped(target);
    ASSERT_EQ(answersTo(block), answers) << simd::targetName(target);
  }
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const Question& question = block.questions[i];
    const Segment &p = question.p, &q = question.q;
    ASSERT_NE(answers[i], Answer::kBoth) << described(question);
    if (answers[i] == Answer::kUndecided) continue;
    ++decided;
    ASSERT_FALSE(p.isBox() || q.isBox()) << described(question);
    const Real reach = Real(p.radius) + Real(q.radius) + Real(question.margin);
    // Written so that NaN fails.
    if (answers[i] == Answer::kTouching) {
      ASSERT_TRUE(axisDistance(p, q) <= reach) << described(question);
    } else {
      ASSERT_TRUE(axisDistance(p, q) > reach + Real(question.error)) << described(question);
    }
  }
}

// --- What is asked ---

Segment randomCapsule(Random& random) {
  return {fromEigen(random.inCube(1)), fromEigen(random.inCube(1)), random.between(0, 0.2)};
}

/// Radii and a margin whose sum is the distance of the two times 1 + change; all are 0 where they
/// cross.
Question nearlyTouching(Segment p, Segment q, double change) {
  const auto reach = static_cast<double>(axisDistance(p, q) * (1 + Real(change)));
  p.radius = reach / 4;
  q.radius = reach / 2;
  return {p, q, reach / 4, 0};
}

double powerOfTen(Random& random, double low, double high) {
  return std::pow(10, random.between(low, high));
}
double sign(Random& random) { return random.unit() < 0.5 ? -1 : 1; }

Question anyQuestion(Random& random) {
  const double margin = random.below(2) == 0 ? 0 : random.between(0, 0.1);
  const double error = random.below(2) == 0 ? 0 : random.between(0, 1e-3);
  return {randomCapsule(random), randomCapsule(random), margin, error};
}
Question sometimesNearlyTouching(Random& random, const Segment& p, const Segment& q) {
  if (random.below(2) == 0) return {p, q, 0, 0};
  return nearlyTouching(p, q, sign(random) * powerOfTen(random, -8, -1));
}

Question nearlyParallel(Random& random) {
  Segment p = randomCapsule(random), q = p;
  const Vec3d along = random.between(-2, 2) * (p.b - p.a);
  q.a = p.a + random.between(-1, 1) * (p.b - p.a) + 0.3 * fromEigen(random.inCube(1));
  q.b = q.a + along + powerOfTen(random, -12, -1) * fromEigen(random.direction());
  return sometimesNearlyTouching(random, p, q);
}
Question parallel(Random& random) {
  Segment p = randomCapsule(random), q = p;
  // Few bits, so that the two are parallel to the last one.
  for (double* x : {&p.a.x, &p.a.y, &p.a.z, &p.b.x, &p.b.y, &p.b.z}) {
    *x = std::ldexp(std::round(std::ldexp(*x, 10)), -10);
  }
  const double shift = std::ldexp(static_cast<double>(random.below(64)) - 32, -4);
  const double stretch = std::ldexp(static_cast<double>(random.below(64)) - 32, -4);
  q.a = p.a + shift * (p.b - p.a) + powerOfTen(random, -7, 0) * fromEigen(random.direction());
  for (double* x : {&q.a.x, &q.a.y, &q.a.z}) *x = std::ldexp(std::round(std::ldexp(*x, 30)), -30);
  q.b = q.a + stretch * (p.b - p.a);
  return sometimesNearlyTouching(random, p, q);
}
Question collinear(Random& random) {
  Segment p = randomCapsule(random), q = p;
  q.a = p.a + random.between(-3, 3) * (p.b - p.a);
  q.b = p.a + random.between(-3, 3) * (p.b - p.a);
  return sometimesNearlyTouching(random, p, q);
}
/// Their axes cross, `gap` apart.
Question crossing(Random& random, double length, double gap) {
  const Eigen::Vector3d u = random.direction(), v = random.direction();
  const Eigen::Vector3d n = u.cross(v).normalized();
  const double s = random.unit(), t = random.unit();
  const Vec3d at = fromEigen(random.inCube(1)), across = at + gap * fromEigen(n);
  return {{at - s * length * fromEigen(u), at + (1 - s) * length * fromEigen(u), 0},
          {across - t * length * fromEigen(v), across + (1 - t) * length * fromEigen(v), 0},
          0,
          0};
}
Question crossingClosely(Random& random) {
  Question question = crossing(random, 1, 1e-6);
  question.p.radius = powerOfTen(random, -8, -4);
  question.q.radius = powerOfTen(random, -8, -4);
  return question;
}
Question sharedEnd(Random& random) {
  Segment p = randomCapsule(random), q = randomCapsule(random);
  (random.below(2) == 0 ? p.a : p.b) = random.below(2) == 0 ? q.a : q.b;
  p.radius = random.below(2) == 0 ? 0 : powerOfTen(random, -9, 0);
  q.radius = random.below(2) == 0 ? 0 : powerOfTen(random, -9, 0);
  return {p, q, 0, 0};
}
Question zeroLength(Random& random) {
  Segment p = randomCapsule(random), q = randomCapsule(random);
  p.b = p.a;
  if (random.below(2) == 0) q.b = q.a;
  if (random.below(16) == 0) q.a = q.b = p.a;
  return sometimesNearlyTouching(random, p, q);
}
Question zeroRadius(Random& random) {
  Segment p = randomCapsule(random), q = randomCapsule(random);
  p.radius = q.radius = 0;
  const double margin = random.below(2) == 0 ? 0 : static_cast<double>(axisDistance(p, q));
  return {p, q, margin * (1 + sign(random) * powerOfTen(random, -9, -3)), 0};
}
Question hugeRadius(Random& random) {
  Segment p = randomCapsule(random), q = randomCapsule(random);
  const Vec3d away = powerOfTen(random, 0, 7) * fromEigen(random.direction());
  q.a = q.a + away;
  q.b = q.b + away;
  if (random.below(2) == 0) {
    return nearlyTouching(p, q, sign(random) * powerOfTen(random, -9, -3));
  }
  p.radius = powerOfTen(random, 0, 300);
  return {p, q, 0, 0};
}
Question farFromTheOrigin(Random& random) {
  Segment p = randomCapsule(random), q = randomCapsule(random);
  const Vec3d offset = 1e6 * fromEigen(random.direction());
  for (Vec3d* v : {&p.a, &p.b, &q.a, &q.b}) *v = *v + offset;
  Question question = sometimesNearlyTouching(random, p, q);
  question.error = endPointError(p) + endPointError(q);
  return question;
}
Question boxes(Random& random) {
  Question question = anyQuestion(random);
  const std::size_t which = random.below(3);
  if (which != 0) question.p.radius = -1;
  if (which != 1) question.q.radius = -1;
  if (random.below(4) == 0) question.p.a.x = -kInfinity;
  if (random.below(4) == 0) question.margin = 1e3;
  return question;
}
Question closeCall(Random& random) {
  return nearlyTouching(randomCapsule(random), randomCapsule(random),
                        sign(random) * powerOfTen(random, -9, -3));
}
Question withoutBounds(Random& random) {
  Question question = anyQuestion(random);
  Segment &p = question.p, &q = question.q;
  double* const numbers[] = {&p.a.x,    &p.a.y,    &p.a.z,           &p.b.x,         &p.b.y, &p.b.z,
                             &q.a.x,    &q.a.y,    &q.a.z,           &q.b.x,         &q.b.y, &q.b.z,
                             &p.radius, &q.radius, &question.margin, &question.error};
  const double extremes[] = {kInfinity, 1.7e308, 1e200, 1e39, 1e20, 1e-20, 1e-45, 5e-324};
  for (std::size_t i = 0; i <= random.below(3); ++i) {
    const std::size_t which = random.below(16);
    // Radii, margins and errors are never negative.
    const double factor = which < 12 ? sign(random) : 1;
    *numbers[which] = factor * extremes[random.below(8)];
  }
  return question;
}

template <class F>
Block blockOf(Random& random, F&& question) {
  Block block;
  for (int i = 0; i < kCapacity; ++i) block.questions.push_back(question(random));
  return block;
}

Block scaled(const Block& block, int exponent) {
  Block result = block;
  const double scale = std::ldexp(1.0, exponent);
  for (Question& question : result.questions) {
    for (Segment* s : {&question.p, &question.q}) {
      *s = {scale * s->a, scale * s->b, scale * s->radius};
    }
    question.margin *= scale;
    question.error *= scale;
  }
  return result;
}

struct Family {
  const char* name;
  std::size_t least_decided;  ///< in percent: ten less than when this was written; boxes never are
  std::function<Block(Random&)> block;
};
void PrintTo(const Family& family, std::ostream* out) { *out << family.name; }

template <class F>
Family familyOf(const char* name, std::size_t least_decided, F question) {
  return {name, least_decided, [question](Random& random) { return blockOf(random, question); }};
}

/// Of another scale, with the unit that fits it or any.
Family scaledFamily(const char* name, std::size_t least_decided, bool unit_fits) {
  return {name, least_decided, [unit_fits](Random& random) {
            const auto anyExponent = [&] { return static_cast<int>(random.below(121)) - 60; };
            const int exponent = anyExponent();
            Block block =
                scaled(blockOf(random, random.below(2) == 0 ? anyQuestion : closeCall), exponent);
            block.unit = std::ldexp(1.0, unit_fits ? -exponent : anyExponent());
            return block;
          }};
}

class CapsulePairsFamily : public testing::TestWithParam<Family> {};

// A pair that touches would be missed, one that does not be reported, or the answer depend on the
// machine. There is no tolerance: what float cannot decide has to be left undecided.
TEST_P(CapsulePairsFamily, NoAnswerIsWrongAndAllInstructionSetsGiveTheSame) {
  constexpr int kBlocks = 1600;
  Random random(21);
  std::size_t decided = 0;
  for (int i = 0; i < kBlocks; ++i) {
    expectTrueAnswers(GetParam().block(random), decided);
    if (HasFatalFailure()) return;
  }
  const std::size_t percent = 100 * decided / (kBlocks * kCapacity);
  EXPECT_GE(percent, GetParam().least_decided) << "the others take ten times as long";
}

INSTANTIATE_TEST_SUITE_P(
    , CapsulePairsFamily,
    testing::Values(
        familyOf("Random", 89, anyQuestion), familyOf("NearlyParallel", 66, nearlyParallel),
        familyOf("Parallel", 59, parallel), familyOf("Collinear", 50, collinear),
        familyOf("CrossingClosely", 59, crossingClosely), familyOf("SharedEnd", 45, sharedEnd),
        familyOf("ZeroLength", 67, zeroLength), familyOf("ZeroRadius", 56, zeroRadius),
        familyOf("HugeRadius", 51, hugeRadius), familyOf("FarFromTheOrigin", 68, farFromTheOrigin),
        familyOf("Boxes", 0, boxes), familyOf("CloseCall", 22, closeCall),
        familyOf("WithoutBounds", 21, withoutBounds), scaledFamily("ScaledToFit", 56, true),
        scaledFamily("ScaledNotToFit", 11, false)),
    [](const testing::TestParamInfo<Family>& info) { return std::string(info.param.name); });

/// Hairs of a scene that is ten units wide.
Block hairs(Random& random) {
  constexpr double kLength = 0.3, kRadius = 0.0035;
  Block block = blockOf(random, [&](Random& r) {
    Question question = crossing(r, kLength, (2 + r.between(0, 5)) * kRadius);
    const Vec3d place = fromEigen(r.inCube(5));
    for (Segment* s : {&question.p, &question.q}) {
      *s = {s->a + place, s->b + place, kRadius};
      question.error += endPointError(*s);
    }
    return question;
  });
  block.unit = 4;
  return block;
}

// Every answer would be left to touch(), which takes ten times as long.
TEST(CapsulePairs, FewHairsAreLeftUndecided) {
  Random random(22);
  std::size_t decided = 0, asked = 0;
  for (int i = 0; i < 3200; ++i) {
    const Block block = hairs(random);
    asked += block.questions.size();
    expectTrueAnswers(block, decided);
    ASSERT_FALSE(HasFatalFailure());
  }
  EXPECT_LT(asked - decided, asked / 50) << "of " << asked;
}

// Hairs in millimetres would be slower than hairs in metres.
TEST(CapsulePairs, TheUnitMakesUpForTheScale) {
  Random random(23);
  for (int i = 0; i < 200; ++i) {
    const Block block = hairs(random);
    const std::vector<Answer> answers = answersTo(block);
    for (const int exponent : {-1000, -60, -10, 10, 60, 900}) {
      Block other = scaled(block, exponent);
      other.unit = std::ldexp(block.unit, -exponent);
      // Powers of two change no digit.
      ASSERT_EQ(answersTo(other), answers) << "scaled by 2^" << exponent;
    }
  }
}

// The answers of a block that is not full would be those of the block before it.
TEST(CapsulePairs, TheRestOfABlockHasNoSay) {
  Random random(25);
  for (const std::int64_t target : simd::availableTargets()) {
    const simd::ScopedTarget scoped(target);
    BlockOfPairs asked(1);
    CapsulePairs& pairs = asked.pairs;
    for (const int size : {64, 0, 1, 7, 8, 9, 15, 16, 17, 33, 49, 63, 64, 1, 0}) {
      Block block = blockOf(random, anyQuestion);
      block.questions.resize(static_cast<std::size_t>(size));
      pairs.clear();
      asked.ends.clear();
      for (const Question& question : block.questions) asked.add(question);
      ASSERT_EQ(pairs.size(), size);
      const std::vector<Answer> answers = answersOf(pairs);
      EXPECT_EQ(answersOf(pairs), answers) << "asked again";
      for (std::size_t i = 0; i < answers.size(); ++i) {
        EXPECT_EQ(answersTo({1, {block.questions[i]}})[0], answers[i])
            << i << " of " << size << " with " << simd::targetName(target);
      }
    }
  }
}

// Pairs in plain contact or plainly apart would take the slow way; or the margin, or the error of
// end points, be counted on one side only.
TEST(CapsulePairs, DecidesThePlainCases) {
  const Segment p{{0, 0, 0}, {1, 0, 0}, 0.25}, q{{0.5, -1, 1}, {0.5, 1, 1}, 0.25};  // 1/2 apart
  const auto answer = [&](double margin, double error) {
    return answersTo({1, {{p, q, margin, error}}})[0];
  };
  EXPECT_EQ(answer(0, 0), Answer::kApart);
  EXPECT_EQ(answer(0.499, 0), Answer::kApart);
  EXPECT_EQ(answer(0.501, 0), Answer::kTouching);
  EXPECT_EQ(answer(0.5, 0), Answer::kUndecided);
  EXPECT_EQ(answer(0.4, 0.099), Answer::kApart);
  EXPECT_EQ(answer(0.4, 0.101), Answer::kUndecided) << "may touch or not";
  EXPECT_EQ(answer(0.501, 0.5), Answer::kTouching);
}

}  // namespace
}  // namespace fcl_fibers::geometry
