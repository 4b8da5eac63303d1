// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_polylines.h>
#include <fcl_fibers/fiber_tree.h>

#include "mesh_file.h"

namespace fcl_fibers::tools {

/// Pairs after which a search ends, because a radius that is far too large would fill the memory.
constexpr std::size_t kPairLimit = 10'000'000;

constexpr std::int32_t kNoMesh = -1;

/// Two segments, or a segment and that triangle of a mesh into which it is deepest.
struct FoundPair {
  std::int32_t a;
  std::int32_t b;               ///< a segment; a triangle, if there is a mesh
  std::int32_t mesh = kNoMesh;  ///< among the meshes of the search
};

/// Where to look for pairs. The trees are built from their scenes.
struct PairSearch {
  const FiberTree& tree;
  const FiberPolylines& scene;
  std::size_t limit = kPairLimit;    ///< pairs, with each triangle, after which a search ends
  const FiberTree* other = nullptr;  ///< else pairs are within the scene
  bool fibers = true;                ///< false leaves out pairs of two segments
  const std::vector<MeshFile>* meshes = nullptr;
};

struct FoundPairs {
  std::vector<FoundPair> pairs;         ///< ascending by a; of equal a, those without mesh first
  std::vector<unsigned char> touching;  ///< by first point: 1 if it is in a pair
  std::size_t touching_segments = 0;    ///< of this scene, not of another one
  std::size_t touching_fibers = 0;
  bool complete = true;  ///< else a search ended at the limit
};

FoundPairs findPairs(const PairSearch& search);

/// A contact of two segments or, if there is a mesh, of segment a with a triangle of it.
struct FoundContact : Contact {
  std::int32_t mesh = kNoMesh;
  std::int32_t triangle = 0;
  std::array<double, 3> weights{};
  bool solid = false;

  explicit FoundContact(const Contact& contact) : Contact(contact) {}
  FoundContact(const MeshContact& contact, std::int32_t mesh);
};

/// The contact of a pair.
/// @param other  the scene of the second segment, if it is another one
FoundContact contactOf(const FoundPair& pair, const FiberPolylines& scene,
                       const FiberPolylines* other, const std::vector<MeshFile>& meshes);

/// Tells on stderr that a search ended at its limit, or that there are so many pairs that the
/// radius may be wrong.
void warnOfMany(const FoundPairs& found, const PairSearch& search, const std::string& scene);

}  // namespace fcl_fibers::tools
