// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/cosserat_rod.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene_support.h"

namespace fcl_fibers::scenes {
namespace {

using Eigen::Vector3d;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

CosseratRod rodOf(double length, const Vector3d& bending_stiffness) {
  CosseratRod rod;
  rod.length = length;
  rod.bending_stiffness = bending_stiffness;
  return rod;
}

// Curved and loaded in every way.
CosseratRod generalRod() {
  CosseratRod rod;
  rod.length = 8;
  rod.bending_stiffness = {2, 3, 1.5};
  rod.shear_stiffness = {50, 70, 200};
  rod.reference_curvature = {0.3, 0.1, 0.4};
  rod.base_point = {1, -2, 3};
  rod.base_frame = Rotation(Eigen::AngleAxisd(0.7, Vector3d(1, 2, -1).normalized()));
  return rod;
}

RodLoad generalLoad() {
  RodLoad load;
  load.tip_force = {0.05, -0.2, 0.1};
  load.tip_torque = {0.3, 0.2, -0.4};
  load.distributed_force = {0.01, 0.02, -0.03};
  load.distributed_torque = {-0.02, 0.03, 0.05};
  return load;
}

double arcLength(const CosseratRod& rod, std::size_t i, int segments) {
  return rod.length * static_cast<double>(i) / segments;
}

double largestDistance(const RodShape& shape, const RodShape& fine) {
  const std::size_t step = (fine.points.size() - 1) / (shape.points.size() - 1);
  double largest = 0;
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    largest = std::max(largest, (shape.points[i] - fine.points[i * step]).norm());
  }
  return largest;
}

// Kirchhoff's helix: an isotropic rod under a wrench along the axis of the helix (Love, A Treatise
// on the Mathematical Theory of Elasticity, 1927, chapter XIX). With curvature k, torsion t, twist
// q and w^2 = k^2 + t^2, the balance of moments asks for the force w (C q - K t) along the axis and
// the moment K k binormal + C q tangent.
struct KirchhoffHelix {
  double curvature = 0.8, torsion = 0.5, twist = 0.9;  // per length
  double bending = 1.5, twisting = 1.1;                // stiffnesses
  double length = 12;

  double rate() const { return std::hypot(curvature, torsion); }

  // In the Frenet frame at the base: x the normal, y the binormal, z the tangent.
  Vector3d axis() const { return Vector3d(0, curvature, torsion) / rate(); }
  Vector3d turned(const Vector3d& v, double s) const {
    return Eigen::AngleAxisd(rate() * s, axis()) * v;
  }
  Vector3d at(double s) const {
    const double radius = curvature / (rate() * rate());
    const Vector3d outward = -Vector3d::UnitX();
    return radius * (turned(outward, s) - outward) + torsion / rate() * s * axis();
  }
  CosseratRod rod() const { return rodOf(length, {bending, bending, twisting}); }
  RodLoad load() const {
    RodLoad load;
    load.tip_force = rate() * (twisting * twist - bending * torsion) * axis();
    load.tip_torque = turned({0, bending * curvature, twisting * twist}, length);
    return load;
  }
  double largestError(int segments) const {
    const RodShape shape = solveRod(rod(), load(), segments);
    double largest = 0;
    for (std::size_t i = 0; i < shape.points.size(); ++i) {
      const double s = arcLength(rod(), i, segments);
      largest = std::max(largest, (shape.points[i] - at(s)).norm());
    }
    return largest;
  }
};

TEST(CosseratRod, ErrorIsOfFourthOrder) {
  // If this fails, a rule of integration is wrong, or a term of the equations missing.
  const KirchhoffHelix helix;
  for (const int segments : {50, 100, 200}) {
    EXPECT_NEAR(std::log2(helix.largestError(segments) / helix.largestError(2 * segments)), 4, 0.1)
        << segments;
  }
  const RodShape fine = solveRod(generalRod(), generalLoad(), 1600);
  for (const int segments : {25, 50, 100}) {
    const double error = largestDistance(solveRod(generalRod(), generalLoad(), segments), fine);
    const double half = largestDistance(solveRod(generalRod(), generalLoad(), 2 * segments), fine);
    EXPECT_NEAR(std::log2(error / half), 4, 0.1) << segments;
  }
}

TEST(CosseratRod, BendsAtTheBaseOnlyWhereLongAndSoft) {
  // If this fails, errors grow along rods of many bending lengths. The half-infinite elastica
  // tan(a / 4) = tan(pi / 8) exp(-s / c) of length c has its tip at (L - (2 - sqrt 2) c, sqrt 2 c).
  for (const double force : {1e3, 1e4, 1e5}) {
    const CosseratRod rod = rodOf(1, {1, 1, 1});
    RodLoad load;
    load.tip_force = {force, 0, 0};
    const RodShape shape = solveRod(rod, load, 1600);
    const double c = 1 / std::sqrt(force);
    EXPECT_NEAR(shape.points.back().x(), 1 - (2 - std::sqrt(2.0)) * c, 1e-4 * c) << force;
    EXPECT_NEAR(shape.points.back().z(), std::sqrt(2.0) * c, 1e-4 * c) << force;
  }
}

TEST(CosseratRod, StretchesAndShearsByHooke) {
  // If this fails, force does not strain: stretch F L / EA; a cantilever's F L / GA beside
  // F L^3 / 3 EI (Timoshenko).
  CosseratRod rod = rodOf(3, {5, 5, 5});
  rod.shear_stiffness = {40, 40, 100};
  RodLoad pull;
  pull.tip_force = {0, 0, 10};
  const RodShape pulled = solveRod(rod, pull, 10);
  for (std::size_t i = 0; i < pulled.points.size(); ++i) {
    EXPECT_LE((pulled.points[i] - Vector3d(0, 0, 1.1 * arcLength(rod, i, 10))).norm(), 1e-14);
  }
  RodLoad push;
  const double force = 1e-5;
  push.tip_force = {force, 0, 0};
  const double shear = force * 3 / 40;
  const double bending = force * 27 / (3 * 5);
  EXPECT_NEAR(solveRod(rod, push, 100).points.back().x(), shear + bending, 1e-6 * shear);

  pull.tip_force = {0, 0, -101};
  rod.length = 0.1;  // too short to buckle
  rod.bending_stiffness = {100, 100, 100};
  EXPECT_THAT([&] { solveRod(rod, pull, 10); },
              ThrowsMessage<std::runtime_error>(HasSubstr("presses a piece of the rod to -0.01")));
}

TEST(CosseratRod, TorqueAlongTheRodAddsUpToItsBase) {
  // If this fails, a torque per length acts as none: m = g (L - s), so that the twist is
  // g (L s - s^2 / 2) / C, and in a plane the angle that bending turns d3 by is the same over B.
  const double torque = 0.3, length = 2;
  const CosseratRod rod = rodOf(length, {4, 3, 1.5});
  RodLoad load;
  for (const int axis : {0, 1, 2}) {
    load.distributed_torque = torque * Vector3d::Unit(axis);
    const RodShape shape = solveRod(rod, load, 40);
    for (std::size_t i = 0; i < shape.points.size(); ++i) {
      const double s = arcLength(rod, i, 40);
      const double angle = torque * (length * s - s * s / 2) / rod.bending_stiffness[axis];
      const Rotation expected(Eigen::AngleAxisd(angle, Vector3d::Unit(axis)));
      EXPECT_LE(shape.frames[i].angularDistance(expected), 1e-10) << axis << " at " << s;
      EXPECT_LE((shape.moments[i] - (length - s) * load.distributed_torque).norm(), 1e-12);
    }
  }
}

TEST(CosseratRod, ForcesAndMomentsBalanceAlongTheShape) {
  // If this fails, the shape is not in equilibrium: Antman, Nonlinear Problems of Elasticity, 2005,
  // chapter 8, integrated from s to the tip.
  const CosseratRod rod = generalRod();
  const RodLoad load = generalLoad();
  const int segments = 400;
  const RodShape shape = solveRod(rod, load, segments);
  const double h = rod.length / segments;
  Vector3d weighed = Vector3d::Zero();  // the integral of r from s to the tip
  for (std::size_t i = shape.points.size(); i-- > 0;) {
    if (i + 1 < shape.points.size()) {
      weighed += h / 2 * (shape.points[i] + shape.points[i + 1]) -
                 h * h / 12 * (shape.tangents[i + 1] - shape.tangents[i]);
    }
    const double s = arcLength(rod, i, segments);
    const Vector3d arm = weighed - (rod.length - s) * shape.points[i];
    const Vector3d expected =
        load.tip_torque + (shape.points.back() - shape.points[i]).cross(load.tip_force) +
        arm.cross(load.distributed_force) + (rod.length - s) * load.distributed_torque;
    EXPECT_LE((shape.moments[i] - expected).norm(), 1e-8) << s;
  }
  EXPECT_LE(shape.residual, 1e-10);
}

TEST(CosseratRod, StrainsObeyTheirLaws) {
  // If this fails, frames and points do not follow from moment and force: differences of the shape
  // against K^-1 and I^-1, to second order of their distance.
  const CosseratRod rod = generalRod();
  const RodLoad load = generalLoad();
  const int segments = 4000;
  const RodShape shape = solveRod(rod, load, segments);
  const double h = rod.length / segments;
  EXPECT_EQ(shape.points.front(), rod.base_point);
  EXPECT_LE(shape.frames.front().angularDistance(rod.base_frame), 1e-12);
  for (std::size_t i = 1; i + 1 < shape.points.size(); ++i) {
    const Eigen::Matrix3d frame = shape.frames[i].toRotationMatrix();
    const Vector3d v = frame.transpose() * (shape.points[i + 1] - shape.points[i - 1]) / (2 * h);
    const Vector3d force =
        load.tip_force + (rod.length - arcLength(rod, i, segments)) * load.distributed_force;
    const Vector3d strain = v - Vector3d::UnitZ();
    EXPECT_LE((strain.cwiseProduct(rod.shear_stiffness) - frame.transpose() * force).norm(), 4e-4);
    const Eigen::AngleAxisd turn(shape.frames[i - 1].conjugate() * shape.frames[i + 1]);
    const Vector3d u = turn.angle() * turn.axis() / (2 * h);
    EXPECT_LE(((u - rod.reference_curvature).cwiseProduct(rod.bending_stiffness) -
               frame.transpose() * shape.moments[i])
                  .norm(),
              2e-5);
  }
}

TEST(CosseratRod, AGuessSavesStepsAndNothingElse) {
  // If this fails, neighbouring rods cost as much as the first, or a guess shows in the answer.
  const CosseratRod rod = generalRod();
  RodLoad load = generalLoad();
  const RodShape first = solveRod(rod, load, 50);
  load.tip_force *= 1.02;
  const RodShape cold = solveRod(rod, load, 50);
  const RodShape warm = solveRod(rod, load, 50, &first);
  EXPECT_LE(warm.iterations, 3);
  EXPECT_GT(cold.iterations, 10);
  EXPECT_LE(largestDistance(warm, cold), 1e-10);

  const RodShape poor = solveRod(rodOf(1, {1, 1, 1}), {}, 50);
  EXPECT_LE(largestDistance(solveRod(rod, load, 50, &poor), cold), 1e-10);
  EXPECT_LE(solveRod(rod, load, 50, &warm).iterations, 1);
}

TEST(CosseratRod, AColumnBucklesToTheSideItIsPushedTo) {
  // If this fails, hair stands on end. Beyond Euler's pi^2 / 4, the straight column is unstable.
  const CosseratRod rod = rodOf(1, {1, 1, 1});
  RodLoad load;
  load.tip_force = {0, 0.001, -2.4};
  EXPECT_GT(solveRod(rod, load, 50).points.back().z(), 0.95);
  for (const double force : {4.0, 40.0, 400.0}) {
    load.tip_force = {0, 0.001 * force, -force};
    const RodShape shape = solveRod(rod, load, 100);
    EXPECT_TRUE(shape.is_stable);
    EXPECT_LT(shape.points.back().z(), 0.3) << force;
    EXPECT_GT(shape.points.back().y(), 0.01) << force;
  }
  load.tip_force = {0, 0, -4};  // To no side: the straight column is an equilibrium, too.
  const RodShape hanging = solveRod(rod, load, 50);
  EXPECT_TRUE(hanging.is_stable);
  EXPECT_LT(hanging.points.back().z(), 0.3);
}

TEST(CosseratRod, AColumnThatShearsBucklesSooner) {
  // If this fails, a soft column stands that would fall: beyond P (1 + P / 10 - P / 20) = pi^2 / 4,
  // P = 2.2208, instead of Euler's 2.4674 (Haringx, On Highly Compressible Helical Springs, 1948).
  CosseratRod rod = rodOf(1, {1, 1, 1});
  rod.shear_stiffness = {10, 10, 20};
  RodLoad load;
  load.tip_force = {0, 1e-6, -2.2};
  EXPECT_NEAR(solveRod(rod, load, 100).points.back().z(), 1 - 2.2 / 20, 1e-3);
  load.tip_force = {0, 1e-6, -2.24};
  const RodShape fallen = solveRod(rod, load, 100);
  EXPECT_TRUE(fallen.is_stable);
  EXPECT_GT(fallen.points.back().y(), 0.1);
}

TEST(CosseratRod, RefinedPointsLieOnTheCentreLine) {
  // If this fails, a scene of many segments is not the rod of its few. The quintic's own error
  // falls by 2^6; the error of the solver's frames, of fourth order, falls by 2^5 over a segment's
  // length. Cubics would be of fourth order.
  KirchhoffHelix helix;
  double last = 0;
  for (const int segments : {50, 100}) {
    const RodShape coarse = solveRod(helix.rod(), helix.load(), segments);
    const RodShape fine = solveRod(helix.rod(), helix.load(), 8 * segments);
    const std::vector<Vector3d> points = refinedPoints(coarse, 8);
    ASSERT_EQ(points.size(), fine.points.size());
    double largest = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      // The solver's own, which is of lower order, changes little from one point to the next.
      const std::size_t k = i / 8, next = std::min(k + 1, coarse.points.size() - 1);
      const double t = static_cast<double>(i % 8) / 8;
      const Vector3d solver_error = (1 - t) * (coarse.points[k] - fine.points[8 * k]) +
                                    t * (coarse.points[next] - fine.points[8 * next]);
      largest = std::max(largest, (points[i] - fine.points[i] - solver_error).norm());
      if (i % 8 == 0) {
        EXPECT_EQ(points[i], coarse.points[i / 8]);
      }
    }
    EXPECT_LE(largest, 1e-5);
    if (last > 0) {
      EXPECT_GT(std::log2(last / largest), 5);
    }
    last = largest;
  }
  EXPECT_EQ(refinedPoints(solveRod(helix.rod(), helix.load(), 50), 1).size(), 51U);
}

TEST(CosseratRod, SaysSoWhereItFindsNoEquilibrium) {
  // If this fails, a shape is returned that is none, or the reason is not told.
  CosseratRod rod = rodOf(10, {1, 1, 1});
  RodLoad load;
  load.tip_force = {0, 0, -20};
  load.tip_torque = {10, 0, 10};
  EXPECT_THAT([&] { solveRod(rod, load, 200); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("solveRod: no equilibrium found"),
                                                      HasSubstr("residual is"),
                                                      HasSubstr("give more segments"))));
}

TEST(CosseratRod, RefusesTooFewSegments) {
  // If this fails, a shape is returned that its points do not resolve.
  CosseratRod rod = rodOf(10, {1, 1, 1});
  RodLoad load;
  load.tip_force = {4, 0, 0};
  EXPECT_THAT([&] { solveRod(rod, load, 19); },
              ThrowsMessage<std::runtime_error>(
                  AllOf(HasSubstr("19 segments are too few"), HasSubstr("give at least 20"))));
  EXPECT_NO_THROW(solveRod(rod, load, 20));
  rod.reference_curvature = {2, 0, 0};
  EXPECT_THAT([&] { solveRod(rod, {}, 19); },
              ThrowsMessage<std::runtime_error>(
                  AllOf(HasSubstr("the angle from one to the next is 1.05"), HasSubstr("20"))));
}

TEST(CosseratRod, RefusesParametersThatAreNone) {
  // If this fails, a mistyped parameter gives a shape of NaN, or no reason.
  const auto refuses = [](const auto& spoil, const std::string& reason) {
    CosseratRod rod;
    RodLoad load;
    int segments = 5;
    spoil(rod, load, segments);
    EXPECT_THAT([&] { solveRod(rod, load, segments); },
                ThrowsMessage<std::invalid_argument>(
                    AllOf(HasSubstr("solveRod: " + reason), HasSubstr("; "))));
  };
  for (const double bad : {0.0, -1.0, std::nan(""), kInfinity}) {
    refuses([=](auto& rod, auto&, int&) { rod.length = bad; }, "length is ");
    refuses([=](auto& rod, auto&, int&) { rod.bending_stiffness[1] = bad; },
            "a bending stiffness is ");
  }
  for (const double bad : {0.0, -1.0, std::nan("")}) {
    refuses([=](auto& rod, auto&, int&) { rod.shear_stiffness[2] = bad; }, "a shear stiffness is ");
  }
  for (const double bad : {std::nan(""), kInfinity}) {
    refuses([=](auto& rod, auto&, int&) { rod.reference_curvature[0] = bad; },
            "a reference curvature is ");
    refuses([=](auto& rod, auto&, int&) { rod.base_point[0] = bad; }, "a coordinate of the base");
    refuses([=](auto& rod, auto&, int&) { rod.base_frame.x() = bad; }, "the norm of the base");
    refuses([=](auto&, auto& load, int&) { load.tip_force[2] = bad; },
            "a component of the tip force");
    refuses([=](auto&, auto& load, int&) { load.tip_torque[2] = bad; },
            "a component of the tip torque");
    refuses([=](auto&, auto& load, int&) { load.distributed_force[2] = bad; },
            "a component of the distributed force");
    refuses([=](auto&, auto& load, int&) { load.distributed_torque[1] = bad; },
            "a component of the distributed torque");
  }
  refuses([](auto& rod, auto&, int&) { rod.base_frame.w() = 2; },
          "the norm of the base frame is 2");
  refuses([](auto&, auto&, int& segments) { segments = 0; }, "segments is 0");

  const RodShape other = solveRod(CosseratRod(), {}, 6);
  EXPECT_THAT([&] { solveRod(CosseratRod(), {}, 5, &other); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("guess's points is 7")));
  EXPECT_THAT([&] { refinedPoints(other, 0); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("refinedPoints: pieces is 0")));
  EXPECT_THAT([&] { refinedPoints(RodShape(), 1); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("number of points is 0")));
}

}  // namespace
}  // namespace fcl_fibers::scenes
