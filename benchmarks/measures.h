// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

using Measures = std::map<std::string, bool (*)(const Request&)>;

/// What the program measures, by the names that --measure has.
const Measures& measures();

// Each measure registers its runs, runs them through Google Benchmark, which has to be initialised,
// and returns whether all of ours are right. Names of results are at the head of main.cpp.

bool measureArrays(const Request& request);
bool measureFrames(const Request& request);
bool measureCard(const Request& request);
bool measureQueries(const Request& request);
bool measureClients(const Request& request);
bool measureGrowth(const Request& request);
bool measureCosts(const Request& request);
bool measureShapes(const Request& request);
bool measureSampling(const Request& request);
bool measureObstacles(const Request& request);
bool measureCables(const Request& request);
bool measureDials(const Request& request);
bool measureMotion(const Request& request);
bool measureMotionDials(const Request& request);
bool measureNarrow(const Request& request);

// The paper's.
bool measureReplay(const Request& request);
bool measureChain(const Request& request);
bool measureRadii(const Request& request);
bool measureRods(const Request& request);
bool measureVolumeTests(const Request& request);
bool measurePictures(const Request& request);
bool measureVolumes(const Request& request);

}  // namespace fcl_fibers::benchmarks
