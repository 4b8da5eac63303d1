// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/impact_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/impact.h"
#include "support/impact_oracle.h"
#include "support/random.h"
#include "support/scoped_target.h"
#include "support/segments.h"

namespace fcl_fibers::geometry {
namespace {

using test::GivenMotion;
using test::ImpactOracle;
using test::Random;

struct Question {
  MovingSegment p, q;
  double margin = 0;
  double error = 0;
};

struct Answers {
  std::uint64_t apart = 0;
  std::vector<double> from;
  bool operator==(const Answers& other) const { return apart == other.apart && from == other.from; }
};

/// With the instruction set in use.
Answers answersTo(const std::vector<Question>& questions, double unit) {
  ImpactPairs pairs(unit);
  std::vector<CapsuleEnd> ends;
  ends.reserve(8 * questions.size());
  const auto add = [&](const Segment& s) {
    ends.push_back(firstEndOf(s));
    ends.push_back(secondEndOf(s));
    return &ends[ends.size() - 2];
  };
  for (const Question& question : questions) {
    const auto& [p, q, margin, error] = question;
    const CapsuleEnd *const p0 = add(p.start), *const p1 = add(p.end);
    const CapsuleEnd *const q0 = add(q.start), *const q1 = add(q.end);
    pairs.add({p0, p1}, {q0, q1}, margin, error);
  }
  Answers answers;
  answers.apart = pairs.decide();
  for (int i = 0; i < pairs.size(); ++i) answers.from.push_back(pairs.from(i));
  return answers;
}

GivenMotion given(const Question& question) {
  const auto array = [](const Vec3d& v) { return std::array{v.x, v.y, v.z}; };
  const auto instant = [&](const Segment& p, const Segment& q) {
    test::GivenInstant i;
    i.axis = {array(p.a), array(p.b)};
    i.corner = {array(q.a), array(q.b), array(q.b)};
    i.radii = {p.radius, q.radius};
    return i;
  };
  GivenMotion motion;
  motion.start = instant(question.p.start, question.q.start);
  motion.end = instant(question.p.end, question.q.end);
  motion.margin = question.margin + question.error;
  return motion;
}

Segment randomCapsule(Random& random, double size) {
  const Vec3d a = fromEigen(random.inCube(1));
  return {a, a + fromEigen(random.inCube(size)), 0.05 * random.unit()};
}

/// A question whose capsules come about as near as they touch.
Question anyQuestion(Random& random) {
  Question question;
  const double size = std::pow(10, random.between(-2, 0));
  question.p.start = randomCapsule(random, size);
  question.q.start = randomCapsule(random, size);
  const auto moved = [&](const Segment& s) {
    const Vec3d way = fromEigen(random.inCube(1));
    const double turn = random.below(2) == 0 ? 0 : size;
    return Segment{s.a + way + fromEigen(random.inCube(turn)),
                   s.b + way + fromEigen(random.inCube(turn)),
                   random.below(2) == 0 ? s.radius : 0.05 * random.unit()};
  };
  question.p.end = moved(question.p.start);
  question.q.end = random.below(4) == 0 ? question.q.start : moved(question.q.start);
  question.margin = random.below(2) == 0 ? 0 : 0.05 * random.unit();
  question.error = random.below(2) == 0 ? 0 : 1e-4 * random.unit();
  if (random.below(2) != 0) return question;
  double least = 1e300;
  GivenMotion motion = given(question);
  for (int k = 0; k <= 200; ++k) {
    least = std::min(least, ImpactOracle::excessAt(motion, k / 200.0));
  }
  const double change = std::pow(10, random.between(-7, -2)) * (random.below(2) == 0 ? -1 : 1);
  question.margin += least + change;
  return question;
}

/// What is told apart is apart, and nothing touches before the time that was reached. All
/// instruction sets answer the same.
TEST(ImpactPairs, AreNeverMissed) {
  Random random(1);
  std::size_t apart = 0, advanced = 0, pairs = 0;
  for (int block = 0; block < 60; ++block) {
    const double scale = std::ldexp(1.0, static_cast<int>(random.below(40)) - 20);
    std::vector<Question> questions(1 + random.below(64));
    for (Question& question : questions) {
      question = anyQuestion(random);
      for (MovingSegment* s : {&question.p, &question.q}) {
        for (Segment* t : {&s->start, &s->end}) {
          *t = {scale * t->a, scale * t->b, scale * t->radius};
        }
      }
      question.margin *= scale;
      question.error *= scale;
    }
    const double unit = block % 3 == 0 ? 1 : 1 / scale;
    const Answers answers = answersTo(questions, unit);
    for (const std::int64_t target : simd::availableTargets()) {
      const simd::ScopedTarget scoped(target);
      ASSERT_EQ(answersTo(questions, unit), answers) << simd::targetName(target);
    }
    for (std::size_t i = 0; i < questions.size(); ++i, ++pairs) {
      const GivenMotion motion = given(questions[i]);
      const double from = answers.from[i];
      ASSERT_TRUE(from >= 0 && from <= 1);
      if ((answers.apart >> i & 1u) != 0) {
        ++apart;
        ASSERT_TRUE(ImpactOracle::apartDuring(motion, 0, 1).certain) << block << ", " << i;
      } else if (from > 0) {
        ++advanced;
        ASSERT_TRUE(ImpactOracle::apartDuring(motion, 0, from).certain) << block << ", " << i;
      }
    }
  }
  // If it decides hardly any, it costs time and saves none.
  EXPECT_GT(apart, pairs / 5);
  EXPECT_GT(advanced, pairs / 10);
}

TEST(ImpactPairs, LeaveBoxesAndNoNumbersOpen) {
  Random random(2);
  const double nan = std::nan("");
  const Segment box = Segment::box({0, 0, 0}, {1, 1, 1}), far{{9, 9, 9}, {9, 9, 9}, 0};
  for (const Question& question :
       {Question{{box, box}, {far, far}}, Question{{far, far}, {box, box}},
        Question{{far, far}, {{{nan, 0, 0}, {0, 0, 0}, 0}, far}},
        Question{{far, {{1e300, 0, 0}, {0, 0, 0}, 0}}, {far, far}}}) {
    const Answers answers = answersTo({question}, 1);
    EXPECT_EQ(answers.apart & 1u, 0u);
    EXPECT_EQ(answers.from[0], 0);
  }
}

}  // namespace
}  // namespace fcl_fibers::geometry
