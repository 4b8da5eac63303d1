// SPDX-License-Identifier: BSD-3-Clause

// The step of steps.py in C++, to tell what Python adds to it.
//
//     fcl_fibers_step_in_cpp write SCENE FILE    two frames of a scene, for both programs
//     fcl_fibers_step_in_cpp step FILE           answers requests on standard input
//     fcl_fibers_step_in_cpp compiler            name of the compiler, and build type
//
// A request is `QUERY THREADS REPETITIONS`. Each repetition is answered by its seconds and the
// number of pairs. QUERY is pairs or contacts, or new_pairs or new_contacts: into a vector that is
// new each time, as Python's arrays are. Numbers of the file are those of the machine: how many
// fibers and points there are, 64 bits each; the radius; where each fiber begins, 64 bits each; the
// points of two frames.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>

#include "scenes.h"

namespace fcl_fibers::benchmarks {
namespace {

struct Scene {
  std::vector<std::size_t> point_begin;
  double radius = 0;
  std::vector<double> frames[2];

  FiberArrays<double> arrays(std::size_t frame) const {
    return {frames[frame].data(), point_begin.back(), point_begin.data(), point_begin.size() - 1,
            &radius};
  }
};

void writeScene(const std::string& name, const std::string& path) {
  SceneRequest request;
  request.text = name;
  const auto frames = twoFrames(request);
  std::ofstream file(path, std::ios::binary);
  const auto write = [&](const auto* values, std::size_t count) {
    file.write(reinterpret_cast<const char*>(values),
               static_cast<std::streamsize>(count * sizeof(*values)));
  };
  const std::uint64_t counts[] = {frames[0].fiberCount(), frames[0].points.size()};
  write(counts, 2);
  write(&frames[0].radius, 1);
  write(frames[0].point_begin.data(), frames[0].point_begin.size());
  for (const FiberPolylines& frame : frames) write(frame.points.data(), frame.points.size());
  file.close();
  if (!file) throw std::runtime_error(path + " cannot be written");
}

Scene readScene(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const auto read = [&](auto* values, std::size_t count) {
    file.read(reinterpret_cast<char*>(values),
              static_cast<std::streamsize>(count * sizeof(*values)));
    if (!file) throw std::runtime_error(path + " cannot be read, or it is too short");
  };
  std::uint64_t counts[2];
  Scene scene;
  read(counts, 2);
  read(&scene.radius, 1);
  scene.point_begin.resize(counts[0] + 1);
  read(scene.point_begin.data(), scene.point_begin.size());
  for (std::vector<double>& frame : scene.frames) {
    frame.resize(3 * counts[1]);
    read(frame.data(), frame.size());
  }
  return scene;
}

/// A tree and what its queries fill, which keep their memory from step to step.
class Stepper {
 public:
  Stepper(const Scene& scene, int threads) : scene_(scene), tree_(options(threads)) {
    tree_.build(scene.arrays(0));
  }

  /// Returns seconds.
  double step(const std::string& query) {
    frame_ = 1 - frame_;
    const auto start = std::chrono::steady_clock::now();
    const FiberArrays<double> fibers = scene_.arrays(frame_);
    tree_.update(fibers);
    // An assignment of {} would keep the memory.
    if (query == "new_pairs") pairs_ = std::vector<SegmentPair>();
    if (query == "new_contacts") contacts_ = std::vector<fcl_fibers::Contact>();
    const bool pairs_alone = query == "pairs" || query == "new_pairs";
    if (pairs_alone) {
      tree_.find(Pairs{}, pairs_);
    } else {
      tree_.find(Contacts{fibers}, contacts_);
    }
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
    found_ = pairs_alone ? pairs_.size() : contacts_.size();
    return time.count();
  }

  std::size_t found() const { return found_; }

 private:
  static FiberTreeOptions options(int threads) {
    FiberTreeOptions options;
    options.report = Report::kCapsules;
    options.ignored_neighbors = 1;
    options.threads = threads;
    return options;
  }

  const Scene& scene_;
  FiberTree tree_;
  std::vector<SegmentPair> pairs_;
  std::vector<fcl_fibers::Contact> contacts_;
  std::size_t frame_ = 0, found_ = 0;
};

void answer(const std::string& path) {
  const Scene scene = readScene(path);
  std::map<int, Stepper> steppers;
  std::string query;
  for (int threads = 0, repetitions = 0; std::cin >> query >> threads >> repetitions;) {
    Stepper& stepper = steppers.try_emplace(threads, scene, threads).first->second;
    for (int i = 0; i < repetitions; ++i) {
      const double seconds = stepper.step(query);
      std::printf("%.9f %zu\n", seconds, stepper.found());
    }
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace fcl_fibers::benchmarks

int main(int argc, char** argv) {
  using namespace fcl_fibers::benchmarks;
  try {
    const std::vector<std::string> words(argv + 1, argv + argc);
    if (words.size() == 3 && words[0] == "write") {
      writeScene(words[1], words[2]);
    } else if (words.size() == 2 && words[0] == "step") {
      answer(words[1]);
    } else if (words.size() == 1 && words[0] == "compiler") {
#ifdef __clang__
      std::puts("clang " __clang_version__ "\n" FCL_FIBERS_BUILD_TYPE);
#else
      std::puts("g++ " __VERSION__ "\n" FCL_FIBERS_BUILD_TYPE);
#endif
    } else {
      throw std::invalid_argument("see the head of benchmarks/python/step_in_cpp.cpp");
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fcl_fibers_step_in_cpp: %s\n", error.what());
    return 1;
  }
  return 0;
}
