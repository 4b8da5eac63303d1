// SPDX-License-Identifier: BSD-3-Clause

// A lock of hair swings into one that hangs: position based dynamics over plain arrays, with
// contacts and friction. Units are metres and seconds.
//
//     hair_step [FOLDER]    also writes what tutorials.py draws to the folder
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/export_geometry.h>

namespace {

using namespace fcl_fibers;

constexpr std::size_t kHairs = 50, kPoints = 21;  // hairs of both locks, points of a hair
constexpr float kSegment = 0.015F, kRadius = 0.002F, kStep = 0.001F;
constexpr float kFriction = 0.3F, kKept = 0.999F;  // the part of a motion that air leaves

struct Vec {
  float x, y, z;
};
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(float f, Vec a) { return {f * a.x, f * a.y, f * a.z}; }
float dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
float length(Vec a) { return std::sqrt(dot(a, a)); }

struct Hair {
  std::vector<Vec> now, before;  // the points, and where they were a step ago
};

/// 5 x 5 hairs, straight along a direction.
void addLock(Vec root, Vec direction, std::vector<Vec>& points) {
  for (int hair = 0; hair < 25; ++hair) {
    const Vec place = {static_cast<float>(hair % 5), static_cast<float>(hair / 5), 0};
    for (std::size_t i = 0; i < kPoints; ++i) {
      points.push_back(root + 0.008F * place + static_cast<float>(i) * kSegment * direction);
    }
  }
}

/// Free fall: every point goes on as in the last step. Roots stay.
void fall(Hair& hair) {
  for (std::size_t i = 0; i < hair.now.size(); ++i) {
    const Vec motion = kKept * (hair.now[i] - hair.before[i]) + Vec{0, 0, -9.81F * kStep * kStep};
    hair.before[i] = hair.now[i];
    if (i % kPoints != 0) hair.now[i] = hair.now[i] + motion;
  }
}

/// Gives all segments their length again, from root to tip.
void keepLengths(std::vector<Vec>& points) {
  for (int round = 0; round < 10; ++round) {
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      if ((i + 1) % kPoints == 0) continue;  // the next point is a root
      const Vec along = points[i + 1] - points[i];
      const Vec excess = (1 - kSegment / length(along)) * along;
      const float share = i % kPoints == 0 ? 0 : 0.5F;  // of the first point
      points[i] = points[i] + share * excess;
      points[i + 1] = points[i + 1] - (1 - share) * excess;
    }
  }
}

// [contact]
/// What moves the second segment of a contact from the first along the normal, and back along
/// their slip by friction.
std::array<double, 3> push(const Hair& hair, const Contact& contact) {
  const auto [points, weights] = contact.nodes();  // two of a, then two of b
  const auto number = [](double n) { return static_cast<float>(n); };
  const auto& n = contact.normal;  // from a to b
  const Vec normal = {number(n[0]), number(n[1]), number(n[2])};
  const float depth = number(-contact.distance);

  Vec slip = {0, 0, 0};  // of b's contact point against a's
  float weight = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto i = static_cast<std::size_t>(points[k]);
    slip = slip + number(k < 2 ? -weights[k] : weights[k]) * (hair.now[i] - hair.before[i]);
    weight += number(weights[k] * weights[k]);
  }
  slip = slip - dot(slip, normal) * normal;
  // Coulomb: friction moves by no more than its coefficient times the depth, and never beyond rest.
  const float held = std::min(1.0F, kFriction * depth / std::max(length(slip), 1e-9F));
  const Vec on_b = 1 / weight * (depth * normal - held * slip);
  return {on_b.x, on_b.y, on_b.z};
}
// [contact]

void write(const std::string& folder, int step, const Hair& hair,
           const std::vector<Contact>& contacts) {
  FiberPolylines fibers;
  fibers.radius = kRadius;
  for (const Vec& p : hair.now) fibers.points.push_back({p.x, p.y, p.z});
  for (std::size_t f = 1; f <= kHairs; ++f) fibers.point_begin.push_back(f * kPoints);
  const std::string name = folder + "/hair_step_" + std::to_string(step);
  io::exportFibers(name + "_fibers.vtp", fibers);
  io::exportContacts(name + "_contacts.vtp", contacts);
}

}  // namespace

int main(int argc, char** argv) {
  // [arrays]
  Hair hair;
  addLock({-0.06F, 0, 0}, {-0.8F, 0, -0.6F}, hair.now);
  addLock({0, 0.017F, 0}, {0, 0, -1}, hair.now);
  hair.before = hair.now;

  std::vector<std::size_t> point_begin;
  for (std::size_t f = 0; f <= kHairs; ++f) point_begin.push_back(f * kPoints);
  // The arrays stay where they are, so this holds for all steps.
  const FiberArrays<float> arrays = {&hair.now[0].x, hair.now.size(), point_begin.data(), kHairs,
                                     &kRadius};
  FiberTree tree;  // leaves out adjacent segments, which share a point and always touch
  tree.build(arrays);
  // [arrays]

  std::map<std::pair<int, int>, int> ages;  // for how many steps a pair has touched
  for (int step = 0; step <= 440; ++step) {
    // [loop]
    fall(hair);
    tree.update(arrays);

    std::map<std::pair<int, int>, int> touching;
    std::vector<Contact> contacts;
    std::vector<std::array<double, 3>> pushes;
    std::vector<Vec> sums(hair.now.size(), {0, 0, 0});
    std::vector<int> counts(hair.now.size(), 0);  // of the pushes on a point
    double deepest = 0;
    tree.find(Contacts{arrays}, contacts);
    for (const Contact& contact : contacts) {
      pushes.push_back(push(hair, contact));
      for (const int point : contact.nodes().points) ++counts[static_cast<std::size_t>(point)];
      deepest = std::min(deepest, contact.distance);
      // A segment keeps its name, so a pair is the same pair in every step.
      const auto [a, b] = contact.pair;
      const auto known = ages.find({a, b});
      touching[{a, b}] = known == ages.end() ? 1 : known->second + 1;
    }
    ages.swap(touching);
    tree.accumulate({contacts, pushes}, {&sums[0].x, sums.size()});
    for (std::size_t i = 0; i < hair.now.size(); ++i) {
      if (i % kPoints == 0 || counts[i] == 0) continue;
      hair.now[i] = hair.now[i] + 1 / static_cast<float>(counts[i]) * sums[i];
    }
    keepLengths(hair.now);
    // [loop]

    if (step < 240 || step % 40 != 0) continue;
    int oldest = 0;
    for (const auto& [pair, age] : ages) oldest = std::max(oldest, age);
    std::printf("step %3d: %3zu pairs touch, the oldest for %2d steps, deepest %.2f mm\n", step,
                contacts.size(), oldest, 1000 * std::abs(deepest));
    if (argc > 1) write(argv[1], step, hair, contacts);
  }
  return 0;
}
