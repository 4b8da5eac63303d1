// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "contender.h"
#include "parts.h"
#include "tree/pair_search.h"

namespace fcl_fibers::benchmarks {
namespace {

using geometry::Segment;
using geometry::Vec3d;
using scenes::FiberScene;

constexpr int kRuns = 5;

/// Runs in capsules thicker than so many fibers would be tried for minutes.
constexpr double kThickest = 50;

Vec3d vec(const scenes::Point& p) { return {p[0], p[1], p[2]}; }

double distanceToSegment(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const Vec3d along = b - a;
  const double squared = dot(along, along);
  const double t = squared > 0 ? std::clamp(dot(p - a, along) / squared, 0.0, 1.0) : 0;
  return norm(p - (a + t * along));
}

/// Self-collision of a tree whose leaves are runs of segments of one fiber. A run is in the capsule
/// about its chord that holds its points, thickened by their greatest distance from it.
class RunTree {
 public:
  explicit RunTree(std::size_t run_length) : run_length_(run_length) {
    FiberTreeOptions options;
    options.report = Report::kCapsules;
    tree_ = std::make_unique<FiberTree>(options);
  }

  void build(const FiberScene& scene) {
    point_begin_ = {0};
    first_.clear();
    for (std::size_t f = 0; f < scene.fiberCount(); ++f) {
      const std::size_t begin = scene.point_begin[f], last = scene.point_begin[f + 1] - 1;
      for (std::size_t i = begin; i < last; i += run_length_) first_.push_back(i);
      first_.push_back(last);
      point_begin_.push_back(first_.size());
    }
    read(scene);
    tree_->build(runs());
  }
  void update(const FiberScene& scene) {
    read(scene);
    tree_->update(runs());
  }

  struct Found {
    std::size_t touching = 0, run_pairs = 0, tests = 0;
  };

  Found find() const {
    Found found;
    const tree::CapsuleFilter filter(segments_.data(), segments_.data(), nullptr, 0, unit_);
    std::vector<tree::Pair> pairs;
    const auto flush = [&] {
      found.tests += pairs.size();
      found.touching += filter.keepTouching(pairs.data(), pairs.size());
      pairs.clear();
    };
    const auto add = [&](std::size_t a, std::size_t b) {
      pairs.push_back({static_cast<tree::SegmentId>(a), static_cast<tree::SegmentId>(b)});
    };
    const auto flush_if_full = [&] {
      if (pairs.size() > 1024) flush();
    };
    if (run_length_ == 1) {
      tree_->visitPairs([&](SegmentPair) { ++found.touching; });
      found.run_pairs = found.touching;
      return found;
    }
    tree_->visitPairs([&](SegmentPair run) {
      ++found.run_pairs;
      const auto a = static_cast<std::size_t>(run.a), b = static_cast<std::size_t>(run.b);
      for (std::size_t i = first_[a]; i < first_[a + 1]; ++i) {
        for (std::size_t j = first_[b]; j < first_[b + 1]; ++j) add(i, j);
      }
      flush_if_full();
    });
    for (std::size_t f = 0; f + 1 < point_begin_.size(); ++f) {
      for (std::size_t r = point_begin_[f]; r + 1 < point_begin_[f + 1]; ++r) {
        for (std::size_t i = first_[r]; i < first_[r + 1]; ++i) {
          for (std::size_t j = i + 1; j < first_[r + 1]; ++j) add(i, j);
        }
        flush_if_full();
      }
    }
    flush();
    return found;
  }

  std::size_t memoryUsage() const { return tree_->memoryUsage(); }

  /// Of the capsules about the chords, on average.
  double meanRadius() const {
    return std::accumulate(radii_.begin(), radii_.end(), 0.0) / static_cast<double>(radii_.size());
  }

 private:
  void read(const FiberScene& scene) {
    points_.resize(3 * first_.size());
    radii_.resize(first_.size());
    segments_.resize(scene.points.size());
    for (std::size_t i = 0; i + 1 < scene.points.size(); ++i) {
      segments_[i] = {vec(scene.points[i]), vec(scene.points[i + 1]), scene.radiusAt(i)};
    }
    unit_ =
        std::ldexp(1.0, -std::ilogb(norm(segments_[0].b - segments_[0].a) + segments_[0].radius));
    for (std::size_t r = 0; r < first_.size(); ++r) {
      const scenes::Point& p = scene.points[first_[r]];
      std::copy(p.begin(), p.end(), points_.begin() + static_cast<std::ptrdiff_t>(3 * r));
    }
    for (std::size_t f = 0; f + 1 < point_begin_.size(); ++f) {
      for (std::size_t r = point_begin_[f]; r + 1 < point_begin_[f + 1]; ++r) {
        const Vec3d a = vec(scene.points[first_[r]]), b = vec(scene.points[first_[r + 1]]);
        double radius = 0, off = 0;
        for (std::size_t i = first_[r]; i < first_[r + 1]; ++i) {
          radius = std::max(radius, scene.radiusAt(i));
          off = std::max(off, distanceToSegment(vec(scene.points[i]), a, b));
        }
        radii_[r] = (radius + off) * (1 + 1e-12);
      }
    }
  }

  FiberArrays<double> runs() const {
    FiberArrays<double> arrays;
    arrays.points = points_.data();
    arrays.point_count = first_.size();
    arrays.point_begin = point_begin_.data();
    arrays.fiber_count = point_begin_.size() - 1;
    arrays.radii = radii_.data();
    arrays.radii_are = FiberArrays<double>::Radii::kPerSegment;
    return arrays;
  }

  std::size_t run_length_;
  std::unique_ptr<FiberTree> tree_;
  std::vector<std::size_t> point_begin_;
  std::vector<std::size_t> first_;  ///< by run: its first segment, and where the fiber ends
  std::vector<double> points_, radii_;
  std::vector<Segment> segments_;
  double unit_ = 1;
};

}  // namespace

void registerLeaves(const Frames& frames) {
  const auto touching = std::make_shared<std::optional<std::size_t>>();
  for (const std::size_t length : {1u, 2u, 4u, 8u}) {
    const auto tree = std::make_shared<RunTree>(length);
    tree->build(frames.frame[0]);
    if (tree->meanRadius() > kThickest * frames.frame[0].radiusAt(0)) continue;
    registerRuns("Leaves/" + std::to_string(length) + "/" + frames.name, kRuns,
                 [&frames, tree, touching](Numbers& numbers) {
                   numbers["build"] = seconds([&] { tree->build(frames.frame[0]); });
                   numbers["update"] = seconds([&] { tree->update(frames.frame[1]); });
                   RunTree::Found found;
                   numbers["detection"] = seconds([&] { found = tree->find(); });
                   if (!*touching) *touching = found.touching;
                   if (**touching != found.touching) {
                     throw std::runtime_error("other touching pairs than with other leaves");
                   }
                   numbers["touching"] = static_cast<double>(found.touching);
                   numbers["run_pairs"] = static_cast<double>(found.run_pairs);
                   numbers["tests"] = static_cast<double>(found.tests);
                   numbers["bytes"] = static_cast<double>(tree->memoryUsage());
                   return numbers["update"] + numbers["detection"];
                 });
  }
}

}  // namespace fcl_fibers::benchmarks
