// SPDX-License-Identifier: BSD-3-Clause
#include "measures/paper/chain_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

namespace fcl_fibers::benchmarks {
namespace {

/// Numbers of lattice points, x fastest.
using Path = std::vector<std::size_t>;

/// A Hamiltonian cycle of a cubic lattice: one cycle in each cube of 2 x 2 x 2 points, joined at
/// random. Two cycles are joined where they pass each other: their facing parallel edges are cut
/// and the ends connected across.
class RandomCycle {
 public:
  RandomCycle(std::size_t edge, std::uint64_t seed)
      : edge_(edge), links_(edge * edge * edge), parent_(links_.size() / 8), random_(seed) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    for (std::size_t cube = 0; cube < parent_.size(); ++cube) addCube(cube);
    joinCubes();
  }

  /// From point 0, round the cycle that it lies on.
  Path path() const {
    Path path = {0, links_[0][0]};
    while (true) {
      const auto& [p, q] = links_[path.back()];
      const std::size_t next = p == path[path.size() - 2] ? q : p;
      if (next == 0) return path;
      path.push_back(next);
    }
  }

 private:
  std::size_t stride(std::size_t axis) const {
    return axis == 0 ? 1 : axis == 1 ? edge_ : edge_ * edge_;
  }
  std::size_t cubesPerEdge() const { return edge_ / 2; }
  std::size_t cubeStride(std::size_t axis) const {
    return axis == 0 ? 1 : axis == 1 ? cubesPerEdge() : cubesPerEdge() * cubesPerEdge();
  }
  std::size_t cubeCoordinate(std::size_t cube, std::size_t axis) const {
    return cube / cubeStride(axis) % cubesPerEdge();
  }
  std::size_t firstPoint(std::size_t cube) const {
    std::size_t point = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      point += 2 * cubeCoordinate(cube, axis) * stride(axis);
    }
    return point;
  }

  /// A Gray code over the corners, its axes in random order.
  void addCube(std::size_t cube) {
    std::array<std::size_t, 3> axes = {0, 1, 2};
    std::shuffle(axes.begin(), axes.end(), random_);
    std::array<std::size_t, 8> corners;
    for (std::size_t i = 0; i < 8; ++i) {
      const std::size_t gray = i ^ (i >> 1);
      corners[i] = firstPoint(cube);
      for (std::size_t k = 0; k < 3; ++k) corners[i] += (gray >> k & 1) * stride(axes[k]);
    }
    for (std::size_t i = 0; i < 8; ++i) {
      links_[corners[i]] = {corners[(i + 7) % 8], corners[(i + 1) % 8]};
    }
  }

  void joinCubes() {
    std::vector<std::pair<std::size_t, std::size_t>> faces;  // a cube and the axis to the next
    for (std::size_t cube = 0; cube < parent_.size(); ++cube) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (cubeCoordinate(cube, axis) + 1 < cubesPerEdge()) faces.emplace_back(cube, axis);
      }
    }
    std::shuffle(faces.begin(), faces.end(), random_);
    for (const auto& [cube, axis] : faces) {
      const std::size_t next = cube + cubeStride(axis);
      if (root(cube) != root(next) && joinAcross(cube, axis)) parent_[root(cube)] = root(next);
    }
  }

  bool joinAcross(std::size_t cube, std::size_t axis) {
    const std::size_t across = stride(axis);
    const std::size_t origin = firstPoint(cube) + across;
    for (std::size_t k = 1; k <= 2; ++k) {
      const std::size_t along = stride((axis + k) % 3), beside = stride((axis + 3 - k) % 3);
      for (const std::size_t p : {origin, origin + beside}) {
        const std::size_t q = p + along;
        if (!areLinked(p, q) || !areLinked(p + across, q + across)) continue;
        relink(p, q, p + across);
        relink(q, p, q + across);
        relink(p + across, q + across, p);
        relink(q + across, p + across, q);
        return true;
      }
    }
    return false;
  }

  bool areLinked(std::size_t p, std::size_t q) const {
    return links_[p][0] == q || links_[p][1] == q;
  }
  void relink(std::size_t p, std::size_t from, std::size_t to) {
    links_[p][links_[p][0] == from ? 0 : 1] = to;
  }
  std::size_t root(std::size_t cube) {
    while (parent_[cube] != cube) cube = parent_[cube] = parent_[parent_[cube]];
    return cube;
  }

  std::size_t edge_;
  std::vector<std::array<std::size_t, 2>> links_;  ///< by point: the two next to it
  std::vector<std::size_t> parent_;                ///< of joined cubes
  std::mt19937_64 random_;
};

Path randomPath(std::size_t edge) {
  // A cube now and then finds no edge to be joined by.
  for (std::uint64_t seed = 1; seed < 1000; ++seed) {
    Path path = RandomCycle(edge, seed).path();
    if (path.size() == edge * edge * edge) return path;
  }
  throw std::runtime_error("makeChain: no cycle through all points was found");
}

Path snakePath(std::size_t edge) {
  Path path;
  for (std::size_t z = 0; z < edge; ++z) {
    for (std::size_t i = 0; i < edge; ++i) {
      const std::size_t y = z % 2 == 0 ? i : edge - 1 - i;
      for (std::size_t j = 0; j < edge; ++j) {
        const std::size_t x = i % 2 == 0 ? j : edge - 1 - j;
        path.push_back((z * edge + y) * edge + x);
      }
    }
  }
  return path;
}

Point turned(double x, double y, double z) {
  const double c = std::sqrt(0.5);
  const double turned_x = c * (x + z), turned_z = c * (z - x);
  return {turned_x, c * (y - turned_z), c * (y + turned_z)};
}

}  // namespace

Chain chainOfName(const std::string& name) {
  if (name == "straight") return Chain::kStraight;
  if (name == "random") return Chain::kRandom;
  if (name == "snake") return Chain::kSnake;
  throw std::invalid_argument("--chain=" + name + ": there are straight, random and snake");
}

FiberPolylines makeChain(Chain chain, int edge) {
  if (edge < 2 || edge % 2 != 0) throw std::invalid_argument("makeChain: the edge has to be even");
  const auto m = static_cast<std::size_t>(edge);
  FiberPolylines scene;
  scene.radius = 0.2;
  if (chain == Chain::kStraight) {
    for (std::size_t i = 0; i < m * m * m; ++i) {
      scene.points.push_back(turned(0, 0, static_cast<double>(i)));
    }
  } else {
    for (const std::size_t p : chain == Chain::kSnake ? snakePath(m) : randomPath(m)) {
      scene.points.push_back(turned(static_cast<double>(p % m), static_cast<double>(p / m % m),
                                    static_cast<double>(p / (m * m))));
    }
  }
  scene.point_begin.push_back(scene.points.size());
  return scene;
}

}  // namespace fcl_fibers::benchmarks
