// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>

#include "harness/runs.h"
#include "measures.h"
#include "measures/live_motions.h"

// Steps of fibers whose pairs are found by two programs, one of which keeps them.

namespace fcl_fibers::benchmarks {

/// Pairs without an order. Other pairs, or one twice, have another sum of their hashes.
struct PairSet {
  std::size_t count = 0;
  std::uint64_t sum = 0;

  void operator()(SegmentPair pair) {
    const auto [a, b] = std::minmax(pair.a, pair.b);
    // The finalizer of SplitMix64.
    std::uint64_t hash = (static_cast<std::uint64_t>(a) << 32) + static_cast<std::uint64_t>(b);
    hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9u;
    hash = (hash ^ (hash >> 27)) * 0x94d049bb133111ebu;
    sum += hash ^ (hash >> 31);
    ++count;
  }
  bool operator==(const PairSet& other) const { return count == other.count && sum == other.sum; }
};

template <class Finder>
std::size_t countOf(const Finder& finder) {
  std::size_t count = 0;
  finder.visit([&count](SegmentPair) { ++count; });
  return count;
}

template <class Finder>
PairSet pairsOf(const Finder& finder) {
  PairSet pairs;
  finder.visit(pairs);
  return pairs;
}

/// Seconds of all steps of one of the two.
class Times {
 public:
  template <class Work>
  void setUp(Work&& work) {
    set_up_ = seconds(work);
  }
  template <class Update, class Query>
  void step(Update&& update, Query&& query) {
    updates_.push_back(seconds(update));
    steps_.push_back(updates_.back() + seconds(query));
  }

  double total() const { return std::accumulate(steps_.begin(), steps_.end(), set_up_); }
  void write(const std::string& name, Numbers& numbers) const {
    numbers[name + "_set_up"] = set_up_;
    numbers[name + "_update"] = median(updates_);
    numbers[name + "_step"] = median(steps_);
    numbers[name + "_longest"] = *std::max_element(steps_.begin(), steps_.end());
    numbers[name + "_total"] = total();
  }
  /// How many times as long a step takes as one of the other, which took turns with it: the median
  /// and the ranks that hold that of all steps in 95 of 100 cases.
  void writeRatio(const Times& other, Numbers& numbers) const {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < steps_.size(); ++i) ratios.push_back(steps_[i] / other.steps_[i]);
    std::sort(ratios.begin(), ratios.end());
    const auto count = static_cast<double>(ratios.size());
    const auto low = static_cast<std::size_t>(std::max(0.0, (count - 1.96 * std::sqrt(count)) / 2));
    numbers["ratio"] = ratios[ratios.size() / 2];
    numbers["ratio_low"] = ratios[low];
    numbers["ratio_high"] = ratios[ratios.size() - 1 - low];
  }
  static double median(std::vector<double> times) {
    const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
    std::nth_element(times.begin(), middle, times.end());
    return *middle;
  }

 private:
  double set_up_ = 0;
  std::vector<double> updates_, steps_;
};

using Vec3f = std::array<float, 3>;

/// The least that a step can do: it reads every point and writes how far it is from where it was
/// listed.
inline void writeDisplacements(const std::vector<Point>& points, const std::vector<Vec3f>& listed,
                               std::vector<Vec3f>& displacements) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      displacements[i][axis] = static_cast<float>(points[i][axis]) - listed[i][axis];
    }
  }
  benchmark::DoNotOptimize(displacements.data());
  benchmark::ClobberMemory();
}

/// How far points move in all steps.
class Motions {
 public:
  void add(const std::vector<Point>& before, const std::vector<Point>& after) {
    double sum = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      const double moved = distance(before[i], after[i]);
      sum += moved;
      largest_ = std::max(largest_, moved);
    }
    mean_ += sum / static_cast<double>(before.size());
    ++steps_;
  }
  void write(double radius, Numbers& numbers) const {
    numbers["motion"] = mean_ / steps_ / radius;
    numbers["largest_motion"] = largest_ / radius;
  }

 private:
  double mean_ = 0, largest_ = 0;
  int steps_ = 0;
};

/// Moves the fibers so many steps. In each of them two finders find the pairs, in turns the one
/// first and the other, and have to find the same. A finder has moveTo(fibers), whose time does not
/// count, update() and visit(visitor).
/// @param makeSearched, makeListed  make one of where fibers are, which has found all there
/// @return what makeListed has made
template <class MakeSearched, class MakeListed>
auto runSteps(const std::string& motion, const SceneRequest& request, Numbers& numbers,
              const MakeSearched& makeSearched, const MakeListed& makeListed) {
  const SceneSource source = openScene(request.text, request.radius);
  FiberPolylines fibers = source.scene();
  const Mover move = makeMover(motion, source);
  move(fibers.points);  // the waves are there from the start
  std::vector<Vec3f> listed, displacements(fibers.points.size());
  for (const Point& p : fibers.points) {
    listed.push_back(
        {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
  }

  decltype(makeSearched(fibers)) searched;
  decltype(makeListed(fibers)) live;
  Times without, with;
  std::vector<double> loops;
  std::size_t found = 0, due = 0, touching = 0;
  without.setUp([&] {
    searched = makeSearched(fibers);
    due = countOf(*searched);
  });
  with.setUp([&] {
    live = makeListed(fibers);
    found = countOf(*live);
  });
  if (found != due) throw std::runtime_error("other pairs live at the start");

  Motions motions;
  for (int step = 0; step < request.steps; ++step) {
    const std::vector<Point> before = fibers.points;
    move(fibers.points);
    motions.add(before, fibers.points);
    loops.push_back(seconds([&] { writeDisplacements(fibers.points, listed, displacements); }));
    const auto search = [&] {
      searched->moveTo(fibers);
      without.step([&] { searched->update(); }, [&] { due = countOf(*searched); });
    };
    if (step % 2 == 0) search();
    live->moveTo(fibers);
    with.step([&] { live->update(); }, [&] { found = countOf(*live); });
    if (step % 2 != 0) search();
    if (found != due || !(pairsOf(*live) == pairsOf(*searched))) {
      throw std::runtime_error("in step " + std::to_string(step) + " " + std::to_string(found) +
                               " pairs live, and a search finds other ones, " +
                               std::to_string(due));
    }
    touching += found;
  }

  without.write("without", numbers);
  with.write("with", numbers);
  without.writeRatio(with, numbers);
  numbers["loop"] = Times::median(loops);
  motions.write(fibers.radius, numbers);
  numbers["segments"] = static_cast<double>(fibers.segmentCount());
  numbers["steps"] = request.steps;
  numbers["touching"] = static_cast<double>(touching) / request.steps;
  return live;
}

/// Registers runs of each motion that was asked for. run(motion, numbers) returns seconds.
template <class Run>
void registerMotions(const std::string& name, const Request& request, const Run& run) {
  for (const std::string& motion : request.motions) {
    registerRuns(name + "/" + motion, request.runs,
                 [run, motion](Numbers& numbers) { return run(motion, numbers); });
  }
}

}  // namespace fcl_fibers::benchmarks
