// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <string>

#include "contenders/contender.h"
#include "scenes.h"

namespace fcl_fibers::benchmarks {

/// What a measure is told.
struct Request {
  SceneRequest scene;
  std::string against = "headline";  ///< see readAgainst()
  std::string scalar = "double";     ///< of the card: or float
  double limit = 120;                ///< seconds that a phase may take while it is checked
  std::string chain = "random";      ///< see makeChain()
  int edge = 16;
  int triangles = 102400;  ///< of the head, and of an arm
  int cables = 150;
  int fibers = 50000;   ///< of the cap in motion
  double radii = 50;    ///< of its mean motion
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

/// How many of `some` are not among the others, both in order.
template <typename Items>
std::size_t countWithout(const Items& some, const Items& others) {
  Items only;
  std::set_difference(some.begin(), some.end(), others.begin(), others.end(),
                      std::back_inserter(only));
  return only.size();
}

}  // namespace fcl_fibers::benchmarks
