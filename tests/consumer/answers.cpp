// SPDX-License-Identifier: BSD-3-Clause

// Prints all bits of what a tree answers, so that programs compiled with other flags can be
// compared. The scene is made in whole numbers, which no flag changes.
#include <cstdint>
#include <cstdio>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/live_pairs.h>
#include <fcl_fibers/shapes.h>
#include <fcl_fibers/triangle_mesh.h>

namespace {

using namespace fcl_fibers;

struct Scene {
  std::vector<double> points;
  std::vector<std::size_t> point_begin{0};
  double radius = 24;

  /// Every other fiber lies on a grid, so distances are often those of contact.
  Scene() {
    std::uint32_t state = 1;
    const auto next = [&state](std::uint32_t below) {
      state = 1664525 * state + 1013904223;
      return static_cast<int>((state >> 8) % below);
    };
    for (int fiber = 0; fiber < 60; ++fiber) {
      const int grid = fiber % 2 == 0 ? 48 : 1;
      int p[3] = {grid * next(1024 / grid), grid * next(1024 / grid), grid * next(1024 / grid)};
      for (int i = 0; i < 12; ++i) {
        for (int& x : p) {
          points.push_back(x);
          x += grid * (next(256 / grid) - 128 / grid);
        }
      }
      point_begin.push_back(points.size() / 3);
    }
  }
  FiberArrays<double> view() const {
    return {points.data(), points.size() / 3, point_begin.data(), point_begin.size() - 1, &radius};
  }
};

void print(const Contact& c) {
  std::printf("%d %d %a %a %a", c.pair.a, c.pair.b, c.s, c.t, c.distance);
  for (const auto* p : {&c.normal, &c.point_a, &c.point_b}) {
    std::printf(" %a %a %a", (*p)[0], (*p)[1], (*p)[2]);
  }
  std::printf("\n");
}
void print(SegmentPair pair) { std::printf("%d %d\n", pair.a, pair.b); }
void print(const MeshContact& c) {
  std::printf("%d %d %a %a %a\n", c.segment, c.triangle, c.s, c.distance, c.weights[0]);
}
void print(const ShapeContact& c) { std::printf("%d %a %a\n", c.segment, c.s, c.distance); }
void print(const Impact& i) { std::printf("%d %d %a\n", i.pair.a, i.pair.b, i.time); }

template <class... Asked>
void answer(const FiberTree& tree, const Asked&... asked) {
  int count = 0;
  tree.visit(asked..., [&count](const auto& found) {
    print(found);
    ++count;
  });
  std::printf("%d\n", count);
}

}  // namespace

int main() {
  const Scene scene;
  Scene moved = scene;
  for (std::size_t i = 0; i < moved.points.size(); i += 5) moved.points[i] += 32;
  FiberTree tree;
  tree.build(scene.view());
  answer(tree, Pairs{});
  answer(tree, Nearest{1e9});
  answer(tree, Contacts{scene.view()});
  print(tree.closest(Contacts{scene.view()}));

  const double corners[] = {0, 0, 0, 1024, 0, 512, 0, 1024, 512, 0, 0, 1024};
  const std::int32_t triangles[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  const TriangleMesh mesh({corners, 4, triangles, 4}, TriangleMesh::Kind::kSolid);
  answer(tree, Contacts{scene.view()}, mesh);
  answer(tree, Contacts{scene.view()}, BoxShape{{256, 256, 256}, {512, 512, 768}});

  LivePairs live(tree);
  live.update();
  tree.update(scene.view(), moved.view());
  answer(tree, Impacts{});
  std::printf("%a\n", tree.safeStep());
  live.update();
  live.visit([](SegmentPair pair, std::int32_t slot) {
    print(pair);
    std::printf("%d\n", slot);
  });
}
