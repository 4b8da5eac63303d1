// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "contenders/foreign_tree.h"
#include "harness/runs.h"
#include "index/posed_mesh.h"
#include "index/tree_search.h"
#include "measures/head_scene.h"
#include "measures/paper/tree_scene.h"

namespace fcl_fibers::benchmarks {
namespace {

struct CountingSink final : index::PairSink {
  tree::Visit take(const index::PairRun& run) override {
    pairs += run.count;
    return tree::Visit::kContinue;
  }
  std::size_t pairs = 0;
};

/// The search of FiberTree for Pairs of a mesh without its filter: pairs of a segment's and a
/// triangle's box that overlap. No public call ends there.
class OurBoxes {
 public:
  explicit OurBoxes(const HeadScene& scene) : world_(scene.objects), mesh_(indexOf(scene.head)) {
    segments_ = Tree(bundle(world_.fibers, world_.middles()));
    segments_.refit(world_.segments, 0);
  }

  std::size_t countOverlaps() const {
    const index::PosedTriangles posed({mesh_, {}}, geometry::Frame());
    const auto pair =
        meshPair(segments_, mesh_.tree(), posed.fromTree(), posed.error(), {}, kAllCategories);
    CountingSink sink;
    index::BlockPool pool;
    findPairs(index::TreeSearch(pair), nullptr, nullptr, pool, sink);
    return sink.pairs;
  }

 private:
  using Tree = tree::LayeredBoxTree<8>;
  static constexpr tree::Categories kAllCategories = tree::kAllCategories;

  static index::MeshIndex indexOf(const scenes::Triangles& mesh) {
    std::vector<geometry::MeshPoint> points;
    std::vector<geometry::TriangleIndices> triangles;
    for (const Point& p : mesh.points) points.push_back({{p[0], p[1], p[2], 0}});
    for (std::size_t i = 0; i < mesh.corners.size(); i += 3) {
      triangles.push_back({mesh.corners[i], mesh.corners[i + 1], mesh.corners[i + 2]});
    }
    return {std::move(points), std::move(triangles)};
  }

  TreeScene world_;
  index::MeshIndex mesh_;
  Tree segments_;
};

void registerCount(const std::string& name, const std::function<std::size_t()>& count, bool ours) {
  registerRuns(
      "Boxes/" + name, runsOf(ours, HeadScene::kRuns),
      [count](Numbers& numbers) {
        std::size_t pairs = 0;
        const double taken = seconds([&] { pairs = count(); });
        numbers["pairs"] = static_cast<double>(pairs);
        return taken;
      },
      ours);
}

/// The least that a refit can do: it reads the corners of each triangle and writes a box.
void writeBoxes(const scenes::Triangles& mesh, std::vector<FloatBox>& boxes) {
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Point& a = mesh.points[static_cast<std::size_t>(mesh.corners[3 * i])];
    const Point& b = mesh.points[static_cast<std::size_t>(mesh.corners[3 * i + 1])];
    const Point& c = mesh.points[static_cast<std::size_t>(mesh.corners[3 * i + 2])];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      boxes[i].least[axis] = static_cast<float>(std::min({a[axis], b[axis], c[axis]}));
      boxes[i].greatest[axis] = static_cast<float>(std::max({a[axis], b[axis], c[axis]}));
    }
  }
  benchmark::DoNotOptimize(boxes.data());
  benchmark::ClobberMemory();
}

}  // namespace

void registerBoxes(const HeadScene& scene) {
  const auto ours = std::make_shared<OurBoxes>(scene);
  registerCount(
      "ours", [ours] { return ours->countOverlaps(); }, true);
#ifdef FCL_FIBERS_WITH_EMBREE
  std::vector<FloatBox> segments, triangles;
  for (const Object* object : scene.objects.objects()) {
    segments.push_back(floatBox(static_cast<const CapsuleObject*>(object)->tightBox()));
  }
  for (const Corners& t : scene.corners) {
    triangles.push_back(floatBox(fcl::AABBd(t[0], t[1], t[2])));
  }
  for (const bool morton : {false, true}) {
    registerCount(morton ? "embree_morton" : "embree_rebuild",
                  embreeOverlaps(segments, triangles, morton), false);
  }
#endif
}

/// A head that breathes: all of its points move.
void registerRefit(const HeadScene& scene) {
  const auto larger = std::make_shared<scenes::Triangles>(
      moved(scene.head, fcl::Transform3d(Eigen::Scaling(1.01))));
  const auto mesh = std::make_shared<TriangleMesh>(scene.head.arrays());
  const auto boxes = std::make_shared<std::vector<FloatBox>>(scene.corners.size());
  registerRuns("Refit/mesh", HeadScene::kRuns, [=, &scene](Numbers& numbers) {
    writeBoxes(scene.head, *boxes);
    numbers["loop"] = seconds([&] { writeBoxes(*larger, *boxes); });
    mesh->update(scene.head.arrays());
    return seconds([&] { mesh->update(larger->arrays()); });
  });
}

}  // namespace fcl_fibers::benchmarks
