// SPDX-License-Identifier: BSD-3-Clause
#include "numerics/recorded_scenes.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace fcl_fibers::test {
namespace {

std::string pathOf(const std::string& name) {
  return FCL_FIBERS_SOURCE_DIR "/tests/data/pair_order/" + name + ".txt";
}

}  // namespace

std::vector<std::string> recordedNames() {
  return {"dense", "sparse", "curled", "degenerate", "contact", "contact_float"};
}

template <typename S>
Assembly<S> recordedScene(const std::string& name) {
  std::ifstream file(pathOf(name));
  Assembly<S> fibers;
  for (std::string line; std::getline(file, line);) {
    if (line.empty()) {
      fibers.endFiber();
      continue;
    }
    // Streams do not read hexadecimal numbers everywhere.
    double numbers[4];
    char* rest = &line[0];
    for (double& number : numbers) number = std::strtod(rest, &rest);
    fibers.addPoint({numbers[0], numbers[1], numbers[2]}, numbers[3]);
  }
  if (fibers.fiberCount() == 0) throw std::runtime_error("cannot read " + pathOf(name));
  return fibers;
}

void recordScene(const std::string& name, const Assembly<double>& fibers) {
  std::FILE* file = std::fopen(pathOf(name).c_str(), "w");
  if (file == nullptr) throw std::runtime_error("cannot write " + pathOf(name));
  for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
    for (std::size_t i = fibers.point_begin[f]; i < fibers.point_begin[f + 1]; ++i) {
      const auto p = fibers.point(i);
      std::fprintf(file, "%a %a %a %a\n", p[0], p[1], p[2], fibers.radii[i]);
    }
    std::fputc('\n', file);
  }
  if (std::fclose(file) != 0) throw std::runtime_error("cannot write " + pathOf(name));
}

template Assembly<float> recordedScene(const std::string&);
template Assembly<double> recordedScene(const std::string&);

}  // namespace fcl_fibers::test
