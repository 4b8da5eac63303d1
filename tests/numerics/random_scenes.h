// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "support/assembly.h"

namespace fcl_fibers::test {

enum class RandomKind {
  kDense,       ///< locks of hair, most segments touching others
  kSparse,      ///< a cube with few contacts
  kCurled,      ///< few fibers, each curled up over and over
  kDegenerate,  ///< whole coordinates: exact contact, coincident, collinear, of no length or radius
  kContact,     ///< pairs within 1e-12 of contact, or 1 ulp of S, or exactly there
  kHair,        ///< neighbouring strands of a TressFX file
  kTapered,     ///< rounded cones: of the scenes above but hair, or within 1e-12 of contact
};
constexpr RandomKind kRandomKinds[] = {
    RandomKind::kDense,   RandomKind::kSparse, RandomKind::kCurled, RandomKind::kDegenerate,
    RandomKind::kContact, RandomKind::kHair,   RandomKind::kTapered};
std::string nameOf(RandomKind kind);

/// Strands of hair to choose from.
class HairFiles {
 public:
  /// Of TressFX, in the folder that the environment variable FCL_FIBERS_DATA names; there may be
  /// none.
  static HairFiles find();
  static HairFiles none() { return {}; }

  bool empty() const { return files_.empty(); }
  std::size_t size() const { return files_.size(); }

  struct Strands {
    std::vector<std::array<double, 3>> points;
    std::size_t points_per_strand;
  };
  const Strands& operator[](std::size_t i) const { return files_[i]; }

 private:
  std::vector<Strands> files_;
};

/// About `capsules` capsules that depend on the seed alone. Without files there is no hair: none.
template <typename S>
Assembly<S> randomScene(RandomKind kind, std::size_t capsules, std::uint64_t seed,
                        const HairFiles& hair);

extern template Assembly<float> randomScene(RandomKind, std::size_t, std::uint64_t,
                                            const HairFiles&);
extern template Assembly<double> randomScene(RandomKind, std::size_t, std::uint64_t,
                                             const HairFiles&);

}  // namespace fcl_fibers::test
