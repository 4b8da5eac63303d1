// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/capsule_test.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

#include "support/cone_oracle.h"
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
  explicit BlockOfPairs(const Block& block) : BlockOfPairs(block.unit) {
    const auto any = [&](auto&& is) {
      return std::any_of(block.questions.begin(), block.questions.end(), is);
    };
    pairs.setMayTaper(any([](const Question& question) { return question.p.isTapered(); }),
                      any([](const Question& question) { return question.q.isTapered(); }));
    for (const Question& question : block.questions) add(question);
  }
  void add(const Question& question) {
    const std::size_t first = ends.size();
    add(question.p, pairs.mayTaperP());
    add(question.q, pairs.mayTaperQ());
    pairs.add(&ends[first], &ends[first + 2], question.margin, question.error);
  }

 private:
  void add(const Segment& s, bool may_taper) {
    ends.push_back(firstEndOf(s));
    ends.push_back(secondEndOf(s));
    // In a chain that is the radius of the next capsule, or NaN before a box.
    const double others[] = {0, 1e30, std::numeric_limits<double>::quiet_NaN()};
    if (!may_taper && !s.isBox()) ends.back().numbers[3] = others[ends.size() / 2 % 3];
  }
};

/// With the instruction set in use.
std::vector<Answer> answersTo(const Block& block) {
  BlockOfPairs asked(block);
  return answersOf(asked.pairs);
}

/// Lower bounds of gaps, in the unit of the pairs; -1 where there is none.
std::vector<double> gapsOf(const Block& block) {
  BlockOfPairs asked(block);
  alignas(64) CapsulePairs::Row gaps;
  const std::uint64_t known = asked.pairs.leastGaps(gaps);
  std::vector<double> found;
  for (std::size_t i = 0; i < block.questions.size(); ++i) {
    found.push_back((known >> i & 1u) != 0 ? double{gaps[i]} / block.unit : -1);
  }
  return found;
}

std::string described(const Question& question) {
  std::ostringstream out;
  out.precision(17);
  for (const Segment& s : {question.p, question.q}) {
    for (const Vec3d& v : {s.a, s.b}) out << '(' << v.x << ' ' << v.y << ' ' << v.z << ") ";
    out << "radii " << s.radiusAtA() << ' ' << s.radiusAtB() << ", ";
  }
  out << "margin " << question.margin << ", error " << question.error;
  return out.str();
}

/// Of the surfaces, up to rounding of long double, which no answer is near.
Real distanceOf(const Segment& p, const Segment& q) {
  return p.isTapered() || q.isTapered() ? test::coneDistance(p, q) : capsuleDistance(p, q);
}

/// No answer is wrong, and all instruction sets give the same; returns how many there are.
void expectTrueAnswers(const Block& block, std::size_t& decided) {
  const std::vector<Answer> answers = answersTo(block);
  const std::vector<double> gaps = gapsOf(block);
  for (const std::int64_t target : simd::availableTargets()) {
    const simd::ScopedTarget scoped(target);
    ASSERT_EQ(answersTo(block), answers) << simd::targetName(target);
    ASSERT_EQ(gapsOf(block), gaps) << simd::targetName(target);
  }
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const Question& question = block.questions[i];
    const Segment &p = question.p, &q = question.q;
    ASSERT_NE(answers[i], Answer::kBoth) << described(question);
    if (gaps[i] >= 0) {
      const Real apart = distanceOf(p, q) - Real(question.margin);
      ASSERT_TRUE(gaps[i] <= apart - Real(question.error)) << described(question);
      ASSERT_TRUE(gaps[i] >= 0.968L * apart) << described(question);
    }
    if (answers[i] == Answer::kUndecided) continue;
    ++decided;
    ASSERT_FALSE(p.isBox() || q.isBox()) << described(question);
    const Real margin = question.margin, distance = distanceOf(p, q);
    // Written so that NaN fails.
    if (answers[i] == Answer::kTouching) {
      ASSERT_TRUE(distance <= margin) << described(question);
    } else {
      ASSERT_TRUE(distance > margin + Real(question.error)) << described(question);
    }
  }
}

// --- What is asked ---

Segment randomCapsule(Random& random) {
  return {fromEigen(random.inCube(1)), fromEigen(random.inCube(1)), random.between(0, 0.2)};
}

Question anyQuestion(Random& random) {
  const double margin = random.below(2) == 0 ? 0 : random.between(0, 0.1);
  const double error = random.below(2) == 0 ? 0 : random.between(0, 1e-3);
  return {randomCapsule(random), randomCapsule(random), margin, error};
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
/// With some numbers that are infinite or of extreme sizes, or a box.
Question withoutBounds(Random& random) {
  Question question = anyQuestion(random);
  Segment &p = question.p, &q = question.q;
  double* const numbers[] = {&p.a.x,    &p.a.y,    &p.a.z,           &p.b.x,         &p.b.y, &p.b.z,
                             &q.a.x,    &q.a.y,    &q.a.z,           &q.b.x,         &q.b.y, &q.b.z,
                             &p.radius, &q.radius, &question.margin, &question.error};
  const double extremes[] = {kInfinity, 1.7e308, 1e200, 1e39, 1e20, 1e-20, 1e-45, 5e-324};
  for (std::size_t i = 0; i <= random.below(3); ++i) {
    const std::size_t which = random.below(16);
    // Margins and errors are never negative; a box has a negative radius.
    const double sign = which < 14 && random.below(2) == 0 ? -1 : 1;
    *numbers[which] = sign * extremes[random.below(8)];
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

/// The same with radii at the ends that differ by up to 30 %.
Block taperedHairs(Random& random) {
  Block block = hairs(random);
  for (Question& question : block.questions) {
    for (Segment* s : {&question.p, &question.q}) {
      *s = Segment::cone(s->a, s->b, s->radius * random.between(0.7, 1), s->radius);
      if (random.below(2) == 0) *s = Segment::cone(s->b, s->a, s->radius, s->radiusAtA());
    }
  }
  return block;
}
/// Cones of any kind, of which one ball may hold the others.
Question anyCones(Random& random) {
  Question question = anyQuestion(random);
  for (Segment* s : {&question.p, &question.q}) {
    const double length = random.below(4) == 0 ? 0 : std::pow(10, random.between(-5, 0));
    s->b = s->a + length * (s->b - s->a);
    if (random.below(8) == 0) continue;
    const double other = random.below(3) == 0 ? 0 : s->radius * random.unit();
    *s = Segment::cone(s->a, s->b, s->radius, other);
  }
  if (random.below(4) == 0) question.q.b = question.q.a + 0.7 * (question.p.b - question.p.a);
  return question;
}

// Every answer would be left to coneWithin(), which takes a hundred times as long.
TEST(CapsulePairs, FewTaperedHairsAreLeftUndecided) {
  Random random(28);
  std::size_t decided = 0, asked = 0;
  for (int i = 0; i < 30; ++i) {
    const Block block = taperedHairs(random);
    asked += block.questions.size();
    expectTrueAnswers(block, decided);
    ASSERT_FALSE(HasFatalFailure());
  }
  EXPECT_LT(asked - decided, asked / 100) << "of " << asked;
}

// A cone that touches would be missed, as no answer is tested again.
TEST(CapsulePairs, NoAnswerAboutConesIsWrong) {
  Random random(29);
  std::size_t decided = 0, asked = 0;
  for (int i = 0; i < 30; ++i) {
    expectTrueAnswers(blockOf(random, anyCones), decided);
    asked += kCapacity;
    ASSERT_FALSE(HasFatalFailure());
  }
  EXPECT_GT(decided, asked - asked / 50) << "of " << asked;
}

// The second ends of the capsules, which have the radii of others, would count.
TEST(CapsulePairs, NoAnswerAboutConesAndCapsulesIsWrong) {
  Random random(30);
  for (const bool second_tapers : {false, true}) {
    Block block = taperedHairs(random);
    for (Question& question : block.questions) {
      Segment& capsule = second_tapers ? question.p : question.q;
      capsule = {capsule.a, capsule.b, capsule.radius};
    }
    std::size_t decided = 0;
    expectTrueAnswers(block, decided);
    EXPECT_GT(decided, block.questions.size() / 2);
  }
}

// Safe distances of hair would take several times as long.
TEST(CapsulePairs, TheGapsOfMostHairsAreTold) {
  Random random(27);
  std::size_t apart = 0, told = 0;
  for (int i = 0; i < 200; ++i) {
    const Block block = hairs(random);
    const std::vector<Answer> answers = answersTo(block);
    const std::vector<double> gaps = gapsOf(block);
    for (std::size_t k = 0; k < answers.size(); ++k) {
      apart += answers[k] == Answer::kApart ? 1 : 0;
      told += gaps[k] >= 0 ? 1 : 0;
    }
  }
  EXPECT_GT(apart, 1000u);
  EXPECT_GT(told, apart * 9 / 10) << "of " << apart;
}

// A pair that touches would be missed, one that does not be reported, or the answer depend on the
// machine. There is no tolerance: what float cannot decide has to be left undecided.
// numerics/touch_decisions_test.cpp asks about the pairs that are hard, without errors.
TEST(CapsulePairs, NoAnswerIsWrongAndAllInstructionSetsGiveTheSame) {
  Random random(21);
  std::size_t decided = 0, asked = 0;
  for (int i = 0; i < 1600; ++i) {
    expectTrueAnswers(blockOf(random, anyQuestion), decided);
    asked += kCapacity;
    expectTrueAnswers(blockOf(random, withoutBounds), decided);
    ASSERT_FALSE(HasFatalFailure());
  }
  EXPECT_GT(decided, asked) << "the others take ten times as long";
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
