// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "moving_fibers.h"

namespace fcl_fibers::benchmarks {

inline void addHairOptions(CLI::App& app, HairRequest& hair) {
  CLI::Option* const path =
      app.add_option("--hair", hair.path, "Fibers of a .hair, .tfx, .bcc, .vtk, .vtp or text file")
          ->check(CLI::ExistingFile);
  app.add_option("--radius", hair.radius,
                 "Radius of the fibers, in the file's unit; may be left out if the file has one")
      ->needs(path);
}

/// The arguments that `app` does not know, as Google Benchmark takes them: the program's name,
/// `defaults`, and the user's, which win. Google Benchmark keeps the pointer to the name, so that
/// it has to be main()'s.
class BenchmarkArguments {
 public:
  BenchmarkArguments(const CLI::App& app, char* program, std::vector<std::string> defaults)
      : texts_(std::move(defaults)), pointers_{program} {
    for (const std::string& text : app.remaining()) texts_.push_back(text);
    for (std::string& text : texts_) pointers_.push_back(text.data());
    count = static_cast<int>(pointers_.size());
  }

  int count;
  char** values() { return pointers_.data(); }

  bool has(const std::string& flag) const {
    return std::any_of(texts_.begin(), texts_.end(),
                       [&](const std::string& text) { return text.find(flag) == 0; });
  }

 private:
  std::vector<std::string> texts_;
  std::vector<char*> pointers_;
};

}  // namespace fcl_fibers::benchmarks
