// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/fiber_tree.h>

#include "harness/runs.h"
#include "measures.h"
#include "tools/found_pairs.h"

namespace fcl_fibers::benchmarks {
namespace {

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

template <typename T>
void writeRaw(const std::string& path, const std::vector<T>& values) {
  openForWriting(path).write(reinterpret_cast<const char*>(values.data()),
                             static_cast<std::streamsize>(sizeof(T) * values.size()));
}

/// NAME.points (floats x y z), NAME.begin (32-bit first points of fibers, and their number),
/// NAME.touching (a byte a segment), and NAME.csv with the counts, last, as the sign that all are
/// there.
void writePicture(const std::string& path, const scenes::FiberScene& scene, Numbers& numbers) {
  const tools::FoundPairs touching = findTouching(scene);
  std::vector<float> coordinates;
  coordinates.reserve(3 * scene.points.size());
  for (const scenes::Point& point : scene.points) {
    for (const double x : point) coordinates.push_back(static_cast<float>(x));
  }
  std::vector<std::int32_t> begin;
  for (const std::size_t i : scene.point_begin) begin.push_back(static_cast<std::int32_t>(i));
  writeRaw(path + ".points", coordinates);
  writeRaw(path + ".begin", begin);
  writeRaw(path + ".touching", touching.touching);

  numbers = {{"fibers", static_cast<double>(scene.fiberCount())},
             {"segments", static_cast<double>(scene.segmentCount())},
             {"touching_pairs", static_cast<double>(touching.pairs.size())},
             {"touching_segments", static_cast<double>(touching.touching_segments)}};
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

void writeVolumes(const std::string& path, const scenes::FiberScene& fiber) {
  {
    std::ofstream points = openForWriting(path + "_fiber.csv");
    points << "x,y,z\n";
    for (const auto& p : fiber.points) points << p[0] << ',' << p[1] << ',' << p[2] << '\n';
  }
  std::ofstream file = openForWriting(path + ".csv");
  file << "kind,depth,node,parent,a,b,c,d,e,f\n";
  writeNodes(file, fiber, FiberTreeOptions::Volumes::kLayeredBoxes);
  writeNodes(file, fiber, FiberTreeOptions::Volumes::kWrappedSpheres);
}

}  // namespace

bool measurePictures(const Request& request) {
  const std::string& dir = request.out_dir;
  if (dir.empty()) throw std::invalid_argument("--measure=pictures: give --out_dir");
  const std::string loop = "paper-dynamic:frame=85";  // when it is nearly closed
  const std::pair<const char*, std::string> kPictures[] = {
      {"loop", loop}, {"strand", "paper-strand:fibers=500"}, {"half_scalp", "paper-half-scalp"}};
  for (const auto& [name, scene] : kPictures) {
    registerRuns("Picture/" + std::string(name), 1,
                 [&dir, name = name, scene = scene](Numbers& numbers) {
                   writePicture(dir + "/" + name, tools::openScene(scene, {}).scene(), numbers);
                   return 0.0;
                 });
  }
  registerRuns("Picture/volumes", 1, [&](Numbers&) {
    writeVolumes(dir + "/volumes", firstFiber(tools::openScene(loop, {}).scene()));
    return 0.0;
  });
  return runRegistered();
}

}  // namespace fcl_fibers::benchmarks
