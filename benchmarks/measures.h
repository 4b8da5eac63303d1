// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "contenders/contender.h"
#include "scenes.h"

namespace fcl_fibers::benchmarks {

/// What a measure is told.
struct Request {
  SceneRequest scene;
  std::string against = "headline";  ///< see readAgainst()
  std::string scalar = "double";     ///< of the card: or float
  double limit = 120;                ///< seconds that a phase may take while it is checked
  int triangles = 102400;            ///< of the head, and of an arm
  int cables = 150;
  int fibers = 50000;        ///< of the cap in motion
  double radii = 50;         ///< of its mean motion
  std::vector<int> threads;  ///< 1, 2, 4, ... and all that the machine has, if there are none
  int runs = 5;              ///< of each number of threads, or of each motion
  /// Of the fibers whose pairs live: slow, fast, weather, creeping or frames.
  std::vector<std::string> motions = {"slow", "fast"};
  std::string out_dir;  ///< of files that are not Google Benchmark's
};

/// Registers its runs, runs them through Google Benchmark, which has to be initialised, and returns
/// whether all of ours are right. Names of results are at the head of main.cpp.
using Measure = bool (*)(const Request&);

/// What the program measures, by the names that --measure has.
std::map<std::string, Measure>& measures();

/// Adds a measure before main().
struct AddMeasure {
  AddMeasure(const char* name, Measure measure) { measures().emplace(name, measure); }
};

/// What a tree or a manager is told that reports what touches.
/// @param neighbors  in a fiber, of which so many are left out
inline FiberOptions touchingOptions(int neighbors = 0, int threads = 1, double margin = 0) {
  FiberOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = neighbors;
  options.threads = threads;
  options.margin = margin;
  return options;
}

inline std::shared_ptr<FiberTree> makeTree(const FiberArrays<double>& fibers,
                                           const FiberTreeOptions& options) {
  auto tree = std::make_shared<FiberTree>(options);
  tree->build(fibers);
  return tree;
}

/// Seconds of a query that does nothing but count.
template <class Question>
double secondsOfCount(const FiberTree& tree, const Question& question, double& count) {
  std::size_t found = 0;
  const double taken = seconds([&] { tree.visit(question, [&found](const auto&) { ++found; }); });
  count = static_cast<double>(found);
  return taken;
}

/// Pairs of segments, by their numbers.
using PairList = std::vector<std::pair<std::int32_t, std::int32_t>>;

/// How many of `some` are not among the others, both in order.
template <typename Items>
std::size_t countWithout(const Items& some, const Items& others) {
  Items only;
  std::set_difference(some.begin(), some.end(), others.begin(), others.end(),
                      std::back_inserter(only));
  return only.size();
}

}  // namespace fcl_fibers::benchmarks
