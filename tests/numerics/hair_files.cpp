// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <fcl_fibers/io/fiber_file.h>

#include "numerics/random_scenes.h"

namespace fcl_fibers::test {

HairFiles HairFiles::find() {
  HairFiles found;
  const char* configured = std::getenv("FCL_FIBERS_DATA");
  if (configured == nullptr) return found;
  const std::filesystem::path folder(configured);
  if (!std::filesystem::is_directory(folder)) return found;
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".tfx") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  for (const auto& path : paths) {
    const FiberPolylines scene = io::readFibers(path.string()).fibers;
    found.files_.push_back({scene.points, scene.point_begin[1]});
  }
  return found;
}

}  // namespace fcl_fibers::test
