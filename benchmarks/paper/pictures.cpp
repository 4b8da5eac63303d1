// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/scenes/paper_scenes.h>

#include "parts.h"
#include "progress.h"
#include "tools/found_pairs.h"

namespace fcl_fibers::benchmarks {
namespace {

/// Of Fig. 6, and of the loop when it is nearly closed.
constexpr int kStrandFibers = 500;
constexpr int kLoopStep = 85;

std::ofstream openForWriting(const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  file.exceptions(std::ios::badbit | std::ios::failbit);
  return file;
}

tools::FoundPairs findTouching(const scenes::FiberScene& scene) {
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 1;
  FiberTree tree(options);
  tree.build(fiberArrays(scene));
  return tools::findPairs(tree, scene);
}

/// NAME.points (floats x y z), NAME.begin (32-bit first points of fibers, and their number),
/// NAME.touching (a byte a segment), and NAME.csv with the counts, last, as the sign that all are
/// there.
void writePicture(const std::string& dir, const std::string& name,
                  const scenes::FiberScene& scene) {
  showProgress("pictures: " + name);
  const tools::FoundPairs touching = findTouching(scene);
  const std::string path = dir + "/" + name;

  std::vector<float> coordinates;
  coordinates.reserve(3 * scene.points.size());
  for (const scenes::Point& point : scene.points) {
    for (const double x : point) coordinates.push_back(static_cast<float>(x));
  }
  openForWriting(path + ".points")
      .write(reinterpret_cast<const char*>(coordinates.data()),
             static_cast<std::streamsize>(sizeof(float) * coordinates.size()));

  std::vector<std::int32_t> begin;
  std::transform(scene.point_begin.begin(), scene.point_begin.end(), std::back_inserter(begin),
                 [](std::size_t i) { return static_cast<std::int32_t>(i); });
  openForWriting(path + ".begin")
      .write(reinterpret_cast<const char*>(begin.data()),
             static_cast<std::streamsize>(sizeof(std::int32_t) * begin.size()));

  openForWriting(path + ".touching")
      .write(reinterpret_cast<const char*>(touching.touching.data()),
             static_cast<std::streamsize>(touching.touching.size()));

  openForWriting(path + ".csv") << "fibers,segments,radius,touching_pairs,touching_segments\n"
                                << scene.fiberCount() << ',' << scene.segmentCount() << ','
                                << scene.radius << ',' << touching.pairs.size() << ','
                                << touching.touching_segments << '\n';
}

scenes::FiberScene firstFiber(const scenes::FiberScene& scene) {
  scenes::FiberScene fiber;
  fiber.radius = scene.radius;
  fiber.points.assign(scene.points.begin(),
                      scene.points.begin() + static_cast<std::ptrdiff_t>(scene.point_begin[1]));
  fiber.point_begin.push_back(fiber.points.size());
  return fiber;
}

/// The inner nodes of the paper's tree over one fiber, level by level: of boxes low and high
/// corner, of spheres centre and radius.
void writeNodes(std::ofstream& file, const scenes::FiberScene& fiber,
                FiberTreeOptions::Volumes kind) {
  const bool boxes = kind == FiberTreeOptions::Volumes::kLayeredBoxes;
  FiberTreeOptions options;
  options.volumes = kind;
  options.topology = Topology::kSuperThread;
  FiberTree tree(options);
  tree.build(fiberArrays(fiber));
  struct Node {
    int number;
    const std::int32_t* segments;
  };
  std::vector<Node> level, above;
  int count = 0;
  for (int depth = 0; depth == 0 || !level.empty(); ++depth) {
    above = std::exchange(level, {});
    std::size_t parent = 0;
    for (const TreeVolume& volume : tree.volumes(depth)) {
      if (volume.segment_count < 2) continue;
      // Children share out their parent's segments, in order.
      while (parent + 1 < above.size() && above[parent + 1].segments <= volume.segments) ++parent;
      level.push_back({count++, volume.segments});
      file << (boxes ? "box," : "sphere,") << depth << ',' << level.back().number << ','
           << (above.empty() ? -1 : above[parent].number);
      const double(&c)[3] = volume.center;
      const double(&h)[3] = volume.half;
      if (boxes) {
        for (const int sign : {-1, 1}) {
          for (int k = 0; k < 3; ++k) file << ',' << c[k] + sign * h[k];
        }
      } else {
        file << ',' << c[0] << ',' << c[1] << ',' << c[2] << ',' << h[0] << ",0,0";
      }
      file << '\n';
    }
  }
}

void writeVolumes(const std::string& dir, const std::string& name,
                  const scenes::FiberScene& fiber) {
  showProgress("pictures: " + name);
  {
    std::ofstream points = openForWriting(dir + "/" + name + "_fiber.csv");
    points << "x,y,z\n";
    for (const auto& p : fiber.points) points << p[0] << ',' << p[1] << ',' << p[2] << '\n';
  }
  std::ofstream file = openForWriting(dir + "/" + name + ".csv");
  file << "kind,depth,node,parent,a,b,c,d,e,f\n";
  writeNodes(file, fiber, FiberTreeOptions::Volumes::kLayeredBoxes);
  writeNodes(file, fiber, FiberTreeOptions::Volumes::kWrappedSpheres);
}

}  // namespace

void writePictures(const PartRequest& request) {
  if (request.out_dir.empty()) throw std::invalid_argument("--part=pictures: give --out_dir");
  scenes::PaperDynamicParameters parameters;
  parameters.seed = request.scene.seed;
  const scenes::PaperDynamic assembly(parameters);
  const scenes::FiberScene loop = assembly.scene(std::min(kLoopStep, assembly.steps() - 1));
  writeVolumes(request.out_dir, "volumes", firstFiber(loop));
  writePicture(request.out_dir, "loop", loop);

  PaperSceneRequest scene = request.scene;
  scene.name = "strand";
  scene.fibers = kStrandFibers;
  writePicture(request.out_dir, "strand", makePaperScene(scene, 0));
  scene = request.scene;
  scene.name = "half_scalp";
  writePicture(request.out_dir, "half_scalp", makePaperScene(scene, 0));
}

}  // namespace fcl_fibers::benchmarks
