// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "support/random.h"

namespace fcl_fibers::test {

/// How programs come by matrices that are not quite rotations.
enum class Drift { kDigits4, kDigits5, kDigits6, kDigits7, kFloats, kProduct, kSheared };
inline constexpr std::array kDrifts = {Drift::kDigits4, Drift::kDigits5, Drift::kDigits6,
                                       Drift::kDigits7, Drift::kFloats,  Drift::kProduct,
                                       Drift::kSheared};
inline constexpr const char* kDriftNames[] = {"4 digits", "5 digits", "6 digits", "7 digits",
                                              "floats",   "product",  "sheared"};

/// The largest entry of R^T R - I.
template <typename S>
double driftOf(const Eigen::Matrix<S, 3, 3>& rotation) {
  const Eigen::Matrix3d r = rotation.template cast<double>();
  return (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
}

/// A matrix R with all entries of R^T R - I at `deviation` at most, and some of them at it.
template <typename S>
Eigen::Matrix<S, 3, 3> shearedRotation(const Eigen::Quaterniond& turn, double deviation,
                                       Random& random) {
  Eigen::Matrix3d gram = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      const double share = random.below(2) == 0 ? 1 : random.between(0, 1);
      gram(i, j) += (random.below(2) == 0 ? -1 : 1) * share * deviation;
      gram(j, i) = gram(i, j);
    }
  }
  gram(1, 1) = 1 + (random.below(2) == 0 ? -1 : 1) * deviation;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(gram);
  return (turn.toRotationMatrix() * solver.operatorSqrt()).template cast<S>();
}

/// A matrix that deviates from a rotation by less than 1e-3, and about as much if it is sheared.
template <typename S>
Eigen::Matrix<S, 3, 3> driftedRotation(Drift drift, Random& random) {
  const Eigen::Quaterniond turn = random.rotation();
  switch (drift) {
    case Drift::kFloats:
      return turn.toRotationMatrix().cast<float>().template cast<S>();
    case Drift::kProduct: {
      Eigen::Matrix3f product = turn.toRotationMatrix().cast<float>();
      for (std::size_t i = 20 + random.below(81); i > 0; --i) {
        product = product * random.rotation().toRotationMatrix().cast<float>();
      }
      return product.template cast<S>();
    }
    case Drift::kSheared:
      return shearedRotation<S>(turn, 0.999e-3, random);
    default: {
      const double unit = std::pow(10.0, 4 + static_cast<int>(drift));
      Eigen::Quaterniond rounded;
      for (int i = 0; i < 4; ++i) {
        rounded.coeffs()[i] = std::round(turn.coeffs()[i] * unit) / unit;
      }
      return rounded.toRotationMatrix().template cast<S>();
    }
  }
}

}  // namespace fcl_fibers::test
