// SPDX-License-Identifier: BSD-3-Clause

// A tassel is tied: a band pulls hairs together, and none ever touches another one. Each iteration
// moves each point no further than is safe. Plain arrays; lengths are in radii of a hair.
//
//     safe_steps [FOLDER]    also writes what tutorials.py draws to the folder
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/io/export_geometry.h>
#include <fcl_fibers/live_pairs.h>

namespace {

using namespace fcl_fibers;

constexpr std::size_t kPoints = 61, kFixed = 3;  // points of a hair; those that stay
constexpr double kSegment = 2, kRadius = 1, kBand = -60;
constexpr double kNear = 0.5;  // hairs that are nearer push each other off
constexpr double kSkin = 1;    // so a point may move by up to half a radius in an iteration
constexpr int kIterations = 500;

struct Vec {
  double x, y, z;
};
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(double f, Vec a) { return {f * a.x, f * a.y, f * a.z}; }
double length(Vec a) { return std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z); }

/// Hairs that hang from a disc, in rows that are shifted against each other.
std::vector<Vec> hanging() {
  std::vector<Vec> points;
  for (int row = -6; row <= 6; ++row) {
    for (int column = -6; column <= 6; ++column) {
      const Vec root = {5.0 * column + 2.5 * (row & 1), 4.4 * row, 0};
      if (length(root) > 24) continue;
      for (std::size_t i = 0; i < kPoints; ++i) {
        points.push_back(root + static_cast<double>(i) * Vec{0, 0, -kSegment});
      }
    }
  }
  return points;
}

/// The band pulls to the axis what is near its height, and all hangs down.
void pull(std::vector<Vec>& points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % kPoints < kFixed) continue;
    Vec& p = points[i];
    const double across = std::sqrt(p.x * p.x + p.y * p.y);
    const double strength = std::max(0.0, 1 - std::abs(p.z - kBand) / 10);
    const double inward = across > 0 ? std::min(0.15 * strength / across, 1.0) : 0;
    p = p + Vec{-inward * p.x, -inward * p.y, -0.02};
  }
}

/// Gives all segments their length again.
void keepLengths(std::vector<Vec>& points) {
  for (int round = 0; round < 10; ++round) {
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      if ((i + 1) % kPoints == 0) continue;  // the next point is a root
      const Vec along = points[i + 1] - points[i];
      const Vec excess = (1 - kSegment / length(along)) * along;
      const bool stays = i % kPoints < kFixed, next_stays = (i + 1) % kPoints < kFixed;
      if (next_stays) continue;
      const double share = stays ? 0 : 0.5;  // of the first point
      points[i] = points[i] + share * excess;
      points[i + 1] = points[i + 1] - (1 - share) * excess;
    }
  }
}

/// What is nearer than kNear is moved apart, the more the nearer it is.
void push(const FiberTree& tree, const std::vector<BareContact>& contacts,
          std::vector<Vec>& points) {
  std::vector<double> pushes;
  std::vector<int> counts(points.size(), 0);
  for (const BareContact& contact : contacts) {
    const auto [ends, weights] = contact.nodes();
    double share = 0;
    for (const double weight : weights) share += weight * weight;
    pushes.push_back((kNear - contact.distance) * kNear / (contact.distance * share));
    for (const int end : ends) ++counts[static_cast<std::size_t>(end)];
  }
  std::vector<Vec> sums(points.size(), {0, 0, 0});
  tree.accumulate({contacts, pushes}, {&sums[0].x, sums.size()});
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (counts[i] > 0 && i % kPoints >= kFixed) points[i] = points[i] + 1.0 / counts[i] * sums[i];
  }
}

/// Moves each point to where it wants to be, or as far towards it as is safe. Returns how many
/// points are not there.
std::size_t move(std::vector<Vec>& points, const std::vector<Vec>& wanted,
                 const std::vector<double>& safe) {
  std::size_t cut = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec way = wanted[i] - points[i];
    const double far = length(way), most = 0.999 * safe[i];  // the sum below is rounded
    points[i] = far <= most ? wanted[i] : points[i] + most / far * way;
    cut += far > most;
  }
  return cut;
}

void write(const std::string& folder, int iteration, const std::vector<Vec>& points) {
  FiberPolylines fibers;
  fibers.radius = kRadius;
  for (const Vec& p : points) fibers.points.push_back({p.x, p.y, p.z});
  for (std::size_t i = kPoints; i <= points.size(); i += kPoints) fibers.point_begin.push_back(i);
  io::exportFibers(folder + "/safe_steps_" + std::to_string(iteration) + ".vtp", fibers);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<Vec> points = hanging();
  std::vector<std::size_t> point_begin;
  for (std::size_t i = 0; i <= points.size(); i += kPoints) point_begin.push_back(i);
  const FiberArrays<double> fibers = {&points[0].x, points.size(), point_begin.data(),
                                      point_begin.size() - 1, &kRadius};
  std::printf("%zu hairs\n", fibers.fiber_count);

  FiberTreeOptions options;
  options.ignored_neighbors = 2;  // segments of a straight hair that touch
  FiberTree tree(options), judge(options);
  options.margin = kNear;
  FiberTree near_tree(options);
  tree.build(fibers);
  near_tree.build(fibers);
  judge.build(fibers);
  LivePairsOptions list;
  list.skin = kSkin;  // not chosen, so that there always is a list
  LivePairs<> live(tree, list), near(near_tree);

  std::vector<BareContact> contacts;
  std::vector<double> safe;
  double least = judge.closest(Contacts{fibers}).distance;
  for (int iteration = 0; iteration <= kIterations; ++iteration) {
    // [loop]
    live.update();
    near.update();
    near.find(Contacts{fibers}, contacts);
    std::vector<Vec> wanted = points;
    pull(wanted);
    keepLengths(wanted);
    push(near_tree, contacts, wanted);
    live.safeDistances(safe);
    const std::size_t cut = move(points, wanted, safe);
    tree.update(fibers);
    near_tree.update(fibers);
    // [loop]

    // A search of its own tells whether any two hairs touch.
    judge.update(fibers);
    const double gap = judge.closest(Contacts{fibers}).distance;
    if (gap <= 0) {
      std::printf("hairs touch in iteration %d\n", iteration);
      return 1;
    }
    least = std::min(least, gap);
    if (iteration % 100 != 0) continue;
    double width = 0;
    for (const Vec& p : points) {
      if (std::abs(p.z - kBand) < 1) width = std::max(width, 2 * std::sqrt(p.x * p.x + p.y * p.y));
    }
    std::printf(
        "iteration %d: %zu pairs are near, %zu points are cut, the least gap is %.4f, "
        "the waist is %.1f wide\n",
        iteration, contacts.size(), cut, gap, width + 2 * kRadius);
    if (argc > 1) write(argv[1], iteration, points);
  }
  std::printf("no hair has touched another one; the least gap of all was %.4f radii\n", least);
  return 0;
}
