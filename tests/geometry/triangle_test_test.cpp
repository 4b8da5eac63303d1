// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/triangle_test.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "geometry/touch.h"
#include "geometry/triangle_distance.h"
#include "support/cone_oracle.h"
#include "support/random.h"
#include "support/scoped_target.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using test::Random;
using test::Real;

constexpr int kCapacity = TrianglePairs::kCapacity;

enum class Answer { kUndecided, kTouching, kApart, kBoth };

struct Question {
  Segment capsule;
  Triangle triangle;
  double error = 0;
};

/// Pairs with the numbers that they borrow.
struct Block {
  explicit Block(const AffineMap& posing = {}, double pair_margin = 0, double unit = 1)
      : margin(pair_margin), pairs(posing, unit) {
    ends.reserve(2 * kCapacity);
    corners.reserve(3 * kCapacity);
  }

  void add(const Question& question) {
    ends.push_back(firstEndOf(question.capsule));
    ends.push_back(secondEndOf(question.capsule));
    const Triangle& t = question.triangle;
    pairs.setMayTaper(pairs.mayTaperP() || question.capsule.isTapered(), false);
    for (const Vec3d& p : {t.a, t.b, t.c}) corners.push_back({{p.x, p.y, p.z, 0}});
    const MeshPoint* const last = corners.data() + corners.size();
    pairs.add(ends.data() + ends.size() - 2, {last - 3, last - 2, last - 1}, margin,
              question.error);
  }
  void clear() {
    pairs.clear();
    ends.clear();
    corners.clear();
  }
  std::vector<Answer> answers() {
    const auto [touching, apart] = pairs.decide();
    std::vector<Answer> answers;
    for (int i = 0; i < pairs.size(); ++i) {
      const auto bits = (touching >> i & 1u) | (apart >> i & 1u) << 1;
      answers.push_back(static_cast<Answer>(bits));
    }
    return answers;
  }

  double margin;
  TrianglePairs pairs;
  std::vector<CapsuleEnd> ends;
  std::vector<MeshPoint> corners;
};

Vec3d inCube(Random& random, double half = 1) { return fromEigen(random.inCube(half)); }

Question anyQuestion(Random& random) {
  return {{inCube(random), inCube(random), random.between(0, 0.4)},
          {inCube(random), inCube(random), inCube(random)},
          random.below(2) == 0 ? 0 : random.between(0, 1e-3)};
}

/// A hair of a scene that is ten units wide, and a triangle at which it begins.
Question hairOnAHead(Random& random) {
  const Vec3d root = inCube(random, 5);
  Question question = {{root, root + 0.2 * inCube(random), 0.0035}, {root, root, root}, 0};
  Triangle& t = question.triangle;
  for (Vec3d* p : {&t.a, &t.b, &t.c}) *p = *p + 0.1 * inCube(random);
  question.error = endPointError(question.capsule);
  return question;
}

/// Radii at the ends that differ by up to 30 %.
Question taperedHair(Random& random) {
  Question question = hairOnAHead(random);
  Segment& s = question.capsule;
  s = Segment::cone(s.a, s.b, s.radius * random.between(0.7, 1), s.radius);
  if (random.below(2) == 0) s = Segment::cone(s.b, s.a, s.radius, s.radiusAtA());
  return question;
}

/// Cones of any kind, of which one ball may hold the others.
Question anyCone(Random& random) {
  Question question = anyQuestion(random);
  Segment& s = question.capsule;
  const double length = random.below(4) == 0 ? 0 : std::pow(10, random.between(-5, 0));
  s.b = s.a + length * (s.b - s.a);
  if (random.below(8) == 0) return question;
  s = Segment::cone(s.a, s.b, s.radius, random.below(3) == 0 ? 0 : s.radius * random.unit());
  Triangle& t = question.triangle;
  const auto kind = random.below(6);
  if (kind == 0) t.b = t.a + 0.7 * (s.b - s.a);
  if (kind == 1) t.c = t.a + 0.5 * (t.b - t.a) + 1e-4 * inCube(random);
  return question;
}

Real axisDistance(const Segment& s, const Triangle& t) {
  return test::segmentTriangleDistance(toPoint(s.a), toPoint(s.b),
                                       {toPoint(t.a), toPoint(t.b), toPoint(t.c)});
}

/// Of the surfaces, up to rounding of long double, which no answer is near.
Real distanceOf(const Segment& s, const Triangle& t) {
  return s.isTapered() ? test::coneDistance(s, t) : axisDistance(s, t) - Real(s.radius);
}

/// No answer is wrong, and all instruction sets give the same. The pairs are posed without
/// rounding.
/// @return how many are decided
std::size_t expectTrueAnswers(const std::vector<Question>& questions, const AffineMap& posing,
                              double margin, double unit) {
  Block block(posing, margin, unit);
  for (const Question& question : questions) block.add(question);
  const std::vector<Answer> answers = block.answers();
  for (const std::int64_t target : simd::availableTargets()) {
    const simd::ScopedTarget scoped(target);
    EXPECT_EQ(block.answers(), answers) << simd::targetName(target);
  }
  std::size_t decided = 0;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const auto& [capsule, t, error] = questions[i];
    const Triangle posed{posing(t.a), posing(t.b), posing(t.c)};
    EXPECT_NE(answers[i], Answer::kBoth);
    if (answers[i] == Answer::kUndecided) continue;
    ++decided;
    const Real distance = distanceOf(capsule, posed), reach = margin;
    const bool is_touching = answers[i] == Answer::kTouching;
    EXPECT_TRUE(is_touching ? distance <= reach : distance > reach + Real(error)) << i;
    EXPECT_EQ(is_touching, touch(capsule, posed, margin, error)) << i;
  }
  return decided;
}

/// The same, and its surface as far from the triangle, or as deep in it, as `apart`.
Question nearCone(Random& random, double apart) {
  for (;;) {
    Question question = anyCone(random);
    Segment& s = question.capsule;
    const double larger = static_cast<double>(distanceOf(s, question.triangle)) - apart;
    if (s.radiusAtA() + larger < 0 || s.radiusAtB() + larger < 0) continue;
    s.radius += larger;
    question.error = 0;
    return question;
  }
}

template <class F>
std::vector<Question> questions(Random& random, F&& question) {
  std::vector<Question> all;
  for (int i = 0; i < kCapacity; ++i) all.push_back(question(random));
  return all;
}

// A capsule that touches would be missed, or one that does not be reported, or the answer depend on
// the machine. tests/numerics asks about the pairs that are hard.
TEST(TrianglePairs, NoAnswerIsWrongAndAllInstructionSetsGiveTheSame) {
  Random random(31);
  // A quarter turn, a stretch and a shift of few bits round nothing.
  const AffineMap turned{{{0, 2, 0}, {-2, 0, 0}, {0, 0, 2}}, {0.5, -1, 0.25}};
  std::size_t decided = 0, asked = 0;
  for (int i = 0; i < 300; ++i) {
    const auto few_bits = [&](Random& r) {
      Question question = anyQuestion(r);
      Triangle& t = question.triangle;
      for (double* x : {&t.a.x, &t.a.y, &t.a.z, &t.b.x, &t.b.y, &t.b.z, &t.c.x, &t.c.y, &t.c.z}) {
        *x = std::ldexp(std::round(std::ldexp(*x, 30)), -30);
      }
      return question;
    };
    decided += expectTrueAnswers(questions(random, anyQuestion), {}, 0, 1);
    decided += expectTrueAnswers(questions(random, few_bits), turned, 0.125, 0.5);
    asked += 2 * kCapacity;
    ASSERT_FALSE(HasFailure());
  }
  EXPECT_GT(decided, asked - asked / 50) << "the others take ten times as long";
}

// Hair would be slower on its head.
TEST(TrianglePairs, FewHairsAreLeftUndecided) {
  Random random(32);
  std::size_t decided = 0, asked = 0;
  for (int i = 0; i < 300; ++i) {
    decided += expectTrueAnswers(questions(random, hairOnAHead), {}, 0, 4);
    asked += kCapacity;
    ASSERT_FALSE(HasFailure());
  }
  EXPECT_LT(asked - decided, asked / 50) << "of " << asked;
}

// Tapered hair would be much slower on its head. What is between its least and its largest radius
// is left to touch().
TEST(TrianglePairs, FewTaperedHairsAreLeftUndecided) {
  Random random(35);
  std::size_t decided = 0, asked = 0;
  for (int i = 0; i < 100; ++i) {
    decided += expectTrueAnswers(questions(random, taperedHair), {}, 0, 4);
    asked += kCapacity;
    ASSERT_FALSE(HasFailure());
  }
  EXPECT_LT(asked - decided, asked / 50) << "of " << asked;
}

// A cone that touches would be missed, as no answer is tested again; or those be left to touch()
// that no ball of the cone reaches.
TEST(TrianglePairs, NoAnswerAboutConesIsWrong) {
  Random random(36);
  std::size_t decided = 0, asked = 0;
  const auto nearly = [](Random& r) {
    return nearCone(r, (r.below(2) == 0 ? -1 : 1) * std::pow(10, r.between(-9, -5)));
  };
  const auto plain = [](Random& r) {
    return nearCone(r, (r.below(2) == 0 ? -1 : 1) * std::pow(10, r.between(-3, -1)));
  };
  for (int i = 0; i < 60; ++i) {
    expectTrueAnswers(questions(random, nearly), {}, 0, 1);
    decided += expectTrueAnswers(questions(random, plain), {}, 0, 1);
    asked += kCapacity;
    ASSERT_FALSE(HasFailure());
  }
  EXPECT_LT(asked - decided, asked / 2) << "of " << asked;
}

// Squares that overflow or vanish would decide, or the NaN that marks a box, or one in the mesh.
TEST(TrianglePairs, WhatDoesNotFitIsLeftUndecided) {
  Random random(33);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double scale : {0x1p-1000, 0x1p-120, 0x1p-40, 0x1p40, 0x1p120, 0x1p1000}) {
    Block block;
    const Question question = anyQuestion(random);
    const auto& [s, t, error] = question;
    block.add({{scale * s.a, scale * s.b, scale * s.radius},
               {scale * t.a, scale * t.b, scale * t.c},
               scale * error});
    EXPECT_EQ(block.answers()[0], Answer::kUndecided) << scale;
  }
  Block block;
  Question box = anyQuestion(random), infinite = anyQuestion(random), nan = anyQuestion(random);
  box.capsule = Segment::box({0, 0, 0}, {1, 1, 1});
  infinite.capsule.b.x = kInfinity;
  nan.triangle.c.y = std::nan("");
  for (const Question& question : {box, infinite, nan}) block.add(question);
  EXPECT_EQ(block.answers(), std::vector<Answer>(3, Answer::kUndecided));
}

// The answers of a block that is not full would be those of the block before it.
TEST(TrianglePairs, TheRestOfABlockHasNoSay) {
  Random random(34);
  for (const std::int64_t target : simd::availableTargets()) {
    const simd::ScopedTarget scoped(target);
    Block block;
    for (const int size : {64, 0, 1, 15, 16, 17, 63, 64, 1}) {
      block.clear();
      std::vector<Question> asked = questions(random, anyQuestion);
      asked.resize(static_cast<std::size_t>(size));
      for (const Question& question : asked) block.add(question);
      const std::vector<Answer> answers = block.answers();
      ASSERT_EQ(answers.size(), asked.size());
      for (std::size_t i = 0; i < asked.size(); ++i) {
        Block one;
        one.add(asked[i]);
        EXPECT_EQ(one.answers()[0], answers[i]) << simd::targetName(target);
      }
    }
  }
}

// A capsule in plain contact or plainly apart would take the slow way; or the margin, or the error
// of the points, not count.
TEST(TrianglePairs, DecidesThePlainCases) {
  const Triangle triangle{{-1, -1, 0}, {3, -1, 0}, {-1, 3, 0}};
  const auto answer = [&](const Segment& capsule, double margin = 0, double error = 0) {
    Block block({}, margin);
    block.add({capsule, triangle, error});
    return block.answers()[0];
  };
  EXPECT_EQ(answer({{0, 0, -1}, {0, 0, 1}, 0.001}), Answer::kTouching) << "it crosses";
  EXPECT_EQ(answer({{-2, 0, -1}, {-2, 0, 1}, 0.99}), Answer::kApart) << "beside an edge";
  EXPECT_EQ(answer({{-2, 0, -1}, {-2, 0, 1}, 1.01}), Answer::kTouching);
  EXPECT_EQ(answer({{-1, -2, -1}, {-2, -1, 1}, 0.7}), Answer::kApart) << "beside a corner";
  EXPECT_EQ(answer({{-1, -2, -1}, {-2, -1, 1}, 0.71}), Answer::kTouching);
  EXPECT_EQ(answer({{-9, 0, 1}, {9, 0, 1}, 0.99}), Answer::kApart) << "parallel to it";
  EXPECT_EQ(answer({{-9, 0, 1}, {9, 0, 1}, 1.01}), Answer::kTouching);
  const Segment above{{0, 0, 1}, {0, 0, 2}, 0.5};
  EXPECT_EQ(answer(above, 0.499), Answer::kApart);
  EXPECT_EQ(answer(above, 0.501), Answer::kTouching);
  EXPECT_EQ(answer(above, 0.5), Answer::kUndecided);
  EXPECT_EQ(answer(above, 0.4, 0.099), Answer::kApart);
  EXPECT_EQ(answer(above, 0.4, 0.101), Answer::kUndecided) << "may touch or not";
  EXPECT_EQ(answer(above, 0.501, 0.5), Answer::kTouching);
  EXPECT_EQ(answer({{0, 0, 1}, {0, 0, 1}, 0}, -0.5), Answer::kApart) << "less than nothing";
}

}  // namespace
}  // namespace fcl_fibers::geometry
