// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

namespace fcl_fibers::scenes {

/// Random numbers that are the same on every platform, normal deviates up to the rounding of the
/// platform's log and cos. The standard fixes its engines but not its distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// Uniform over the multiples of 2^-53 in [0, 1). Takes one word of the engine.
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

  /// Standard normal. Always takes two words of the engine: keeping the second deviate of Box and
  /// Muller, A Note on the Generation of Random Normal Deviates, 1958, would make the numbers
  /// depend on how many were drawn before.
  double normal() {
    // 1 - u is never 0.
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    const double angle = kTwoPi * uniform();
    return radius * std::cos(angle);
  }

 private:
  static constexpr double kTwoPi = 6.283185307179586;

  std::mt19937_64 engine_;
};

/// The random numbers of one fiber, which depend on seed and fiber alone. The increment is that of
/// Steele, Lea and Flood, Fast Splittable Pseudorandom Number Generators, OOPSLA 2014.
inline Random fiberRandom(std::uint64_t seed, std::size_t fiber) {
  return Random(seed + 0x9e3779b97f4a7c15U * (fiber + 1));
}

}  // namespace fcl_fibers::scenes
