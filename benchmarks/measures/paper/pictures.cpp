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

tools::FoundPairs findTouching(const FiberPolylines& scene) {
  return tools::findPairs({*makeTree(fiberArrays(scene), {touchingOptions(1)}), scene});
}

template <typename T>
void writeRaw(const std::string& path, const std::vector<T>& values) {
  openForWriting(path).write(reinterpret_cast<const char*>(values.data()),
                             static_cast<std::streamsize>(sizeof(T) * values.size()));
}

/// NAME.points (floats x y z), NAME.begin (32-bit first points of fibers, and their number),
/// NAME.touching (a byte a segment). Counts are numbers of the result.
void writePicture(const std::string& path, const FiberPolylines& scene, Numbers& numbers) {
  const tools::FoundPairs touching = findTouching(scene);
  std::vector<float> coordinates;
  coordinates.reserve(3 * scene.points.size());
  for (const Point& point : scene.points) {
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
}

/// The inner nodes of the paper's tree, level by level: of boxes low and high corner, of spheres
/// centre and radius.
void writeNodes(std::ofstream& file, const FiberPolylines& fibers, FiberTreeOptions::Volumes kind) {
  FiberTreeOptions options = FiberOptions{Topology::kBundle, Report::kVolumes};
  options.volumes = kind;
  options.topology = Topology::kSuperThread;
  FiberTree tree(options);
  tree.build(fiberArrays(fibers));
  std::size_t inner = 1;
  for (int depth = 0; inner > 0; ++depth) {
    inner = 0;
    for (const TreeVolume& volume : tree.volumes(depth)) {
      if (volume.segment_count < 2) continue;
      ++inner;
      const double(&c)[3] = volume.center;
      const double(&h)[3] = volume.half;
      if (kind == FiberTreeOptions::Volumes::kLayeredBoxes) {
        file << "box," << depth;
        for (const int sign : {-1, 1}) {
          for (int k = 0; k < 3; ++k) file << ',' << c[k] + sign * h[k];
        }
        file << '\n';
      } else {
        file << "sphere," << depth << ',' << c[0] << ',' << c[1] << ',' << c[2] << ',' << h[0]
             << ",0,0\n";
      }
    }
  }
}

void writeVolumes(const std::string& path, const FiberPolylines& fibers) {
  std::ofstream file = openForWriting(path);
  file << "kind,depth,a,b,c,d,e,f\n";
  writeNodes(file, fibers, FiberTreeOptions::Volumes::kLayeredBoxes);
  writeNodes(file, fibers, FiberTreeOptions::Volumes::kWrappedSpheres);
}

bool measurePictures(const Request& request) {
  const std::string& dir = request.out_dir;
  if (dir.empty()) throw std::invalid_argument("--measure=pictures: give --out_dir");
  const std::string loop = "paper-dynamic:frame=85";  // when it is nearly closed
  const std::string wisps = "paper-half-scalp:straight=1,wisp_fibers=300,length=7";
  const std::pair<const char*, std::string> kPictures[] = {{"loop", loop},
                                                           {"half_scalp", wisps},
                                                           {"strand", "paper-strand:fibers=500"},
                                                           {"volumes", loop + ",fibers=1"}};
  for (const auto& [name, text] : kPictures) {
    const std::string path = dir + "/" + name;
    const bool has_volumes = text.rfind(loop, 0) == 0;
    registerRuns("Picture/" + std::string(name), 1, [=, text = text](Numbers& numbers) {
      const FiberPolylines scene = openScene(text, {}).scene();
      writePicture(path, scene, numbers);
      if (has_volumes) writeVolumes(path + ".csv", scene);
      return 0.0;
    });
  }
  return runRegistered();
}

const AddMeasure kMeasure("pictures", measurePictures);

}  // namespace

}  // namespace fcl_fibers::benchmarks
