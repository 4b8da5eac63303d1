// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/paper_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments.h"
#include "scenes/cosserat_rod.h"
#include "scenes/hair.h"

namespace fcl_fibers::scenes {
namespace {

// Case 3. The head is a spheroid about y, which points to the back; x points to its left, z up.
constexpr double kHeadWidth = 7.75;  // cm, half of it, as is its height
constexpr double kHeadLength = 9.5;  // cm, half of it
constexpr int kHalfScalpFibers = 50000;
constexpr double kScalpFront = -0.62;  // y of the area's ends, of half the head's length
constexpr double kScalpBack = 0.72;
constexpr double kParting = 0.02;  // rad, from the top
constexpr double kLongest = 30;    // cm
constexpr int kGrid = 25;
constexpr double kLift = 0.3;              // rad, of the root's direction from the skin
constexpr double kTipPull = 0.002;         // dyn
constexpr double kTipSway = 0.003;         // dyn
constexpr double kTipSwayPerFrame = 0.05;  // rad
constexpr int kGuesses = 17;
constexpr double kLiftStep = 0.05;  // rad
constexpr int kLiftSteps = 20;

struct Style {
  double comb;                           // rad, towards the back
  double top_curvature, side_curvature;  // 1 / cm, at the parting and at the lower end of the area
  double curvature(double down) const {
    return top_curvature + down * (side_curvature - top_curvature);
  }
};
constexpr Style kCombed = {0.25, 1 / 9.5, 1 / 20.0};
constexpr Style kHanging = {0, 1 / 9.5, 0};

// Area of the head between y = 0 and y = length * t, over 2 pi.
double zone(double t) {
  const double y = kHeadLength * t;
  const double e = std::sqrt(1 - kHeadWidth * kHeadWidth / (kHeadLength * kHeadLength));
  const double x = e * y / kHeadLength;
  return kHeadWidth * (0.5 * y * std::sqrt(1 - x * x) + 0.5 * kHeadLength / e * std::asin(x));
}

// The t with that zone, by Newton's method.
double zoneInverse(double area) {
  const double e2 = 1 - kHeadWidth * kHeadWidth / (kHeadLength * kHeadLength);
  double t = area / (kHeadWidth * kHeadLength);
  for (int i = 0; i < 20; ++i) {
    t -= (zone(t) - area) / (kHeadWidth * kHeadLength * std::sqrt(1 - e2 * t * t));
  }
  return t;
}

bool isOutsideHead(const Point& p) {
  const double x = p[0] / kHeadWidth;
  const double y = p[1] / kHeadLength;
  const double z = p[2] / kHeadWidth;
  return x * x + y * y + z * z >= 1;
}

// The area of the roots, and a rectangle of it: the whole is 1 x 1.
struct Patch {
  double across = 0, down = 0;  // of its lowest corner, from front to back, and from the parting
  double width = 1, height = 1;
};

// What a hair deviates by, or the guide hair of its wisp.
struct Deviates {
  double lift = 0, comb = 0, curvature = 0;

  static Deviates draw(Random& random, double deviation) {
    Deviates drawn;
    drawn.lift = deviation * random.normal();
    drawn.comb = deviation * random.normal();
    drawn.curvature = deviation * random.normal();
    return drawn;
  }
};

// The patches and the guide hairs of the wisps. Patches are in rows, forth and back, and each is as
// large as its part of the fibers. Without wisps each fiber is drawn by itself, from all of the
// area.
class Wisps {
 public:
  Wisps(int fibers, int per_wisp) : fibers_(fibers), per_wisp_(per_wisp) {
    if (per_wisp == 0) return;
    const int wisps = (fibers + per_wisp - 1) / per_wisp;
    const int rows = static_cast<int>(std::lround(std::sqrt(wisps)));
    for (int row = 0; row <= rows; ++row) {
      row_begin_.push_back(std::min(fibers, row * wisps / rows * per_wisp));
    }
  }

  Patch patchOf(int fiber) const {
    Patch patch;
    if (per_wisp_ == 0) return patch;
    const auto row_end = std::upper_bound(row_begin_.begin(), row_begin_.end(), fiber);
    const int begin = row_end[-1], in_row = *row_end - begin;
    const int first = fiber / per_wisp_ * per_wisp_ - begin;
    patch.down = static_cast<double>(begin) / fibers_;
    patch.height = static_cast<double>(in_row) / fibers_;
    patch.across = static_cast<double>(first) / in_row;
    patch.width = static_cast<double>(std::min(per_wisp_, in_row - first)) / in_row;
    const bool leads_back = (row_end - row_begin_.begin()) % 2 == 0;
    if (leads_back) patch.across = 1 - patch.across - patch.width;
    return patch;
  }

  Deviates guideOf(int fiber, std::uint64_t seed, double deviation) const {
    if (per_wisp_ == 0) return {};
    const auto wisp = static_cast<std::size_t>(kHalfScalpFibers + fiber / per_wisp_);
    Random random = fiberRandom(seed, wisp);
    return Deviates::draw(random, deviation);
  }

 private:
  int fibers_, per_wisp_;
  std::vector<int> row_begin_;  // first fiber of each row, and the number of fibers
};

// A root on the head, its frame without lift and comb, and how far down it is.
struct Root {
  Vector place, normal, along;
  double down;
};

// The roots of so many fibers, in the middle of the whole area.
class Scalp {
 public:
  explicit Scalp(int fibers) : share_(std::sqrt(fibers / static_cast<double>(kHalfScalpFibers))) {}

  Root draw(Random& random, const Patch& patch) const {
    const double across = inWhole(patch.across + patch.width * random.uniform());
    const double down = inWhole(patch.down + patch.height * random.uniform());
    const double t = zoneInverse(front_ + across * (back_ - front_));
    const double widest = kHalfScalpFibers / kRootsPerArea / (back_ - front_);  // rad
    const double angle = kParting + down * widest;
    const double ring = std::sqrt((1 - t) * (1 + t));
    const Vector up(std::sin(angle), 0, std::cos(angle));
    Root root;
    root.place = kHeadWidth * ring * up + kHeadLength * t * Vector::UnitY();
    root.normal = (ring / kHeadWidth * up + t / kHeadLength * Vector::UnitY()).normalized();
    root.along = {std::cos(angle), 0, -std::sin(angle)};
    root.down = down;
    return root;
  }

 private:
  double inWhole(double x) const { return 0.5 + share_ * (x - 0.5); }

  double front_ = zone(kScalpFront), back_ = zone(kScalpBack);
  double share_;
};

// Outward is d1, along the hair d3.
Quaternion frameOf(const Root& root, double lift, double comb) {
  const Vector back = root.along.cross(-root.normal);
  const Vector combed = std::cos(comb) * root.along + std::sin(comb) * back;
  Eigen::Matrix3d frame;
  frame.col(2) = std::cos(lift) * combed + std::sin(lift) * root.normal;
  frame.col(0) = std::cos(lift) * root.normal - std::sin(lift) * combed;
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return Quaternion(frame).normalized();
}

void requireStyle(const char* call, const PaperHalfScalpParameters& parameters) {
  if (parameters.wisp_fibers < 0) {
    refuseArgument(call, "wisp_fibers", parameters.wisp_fibers, "give 0 or more");
  }
  if (!(parameters.length > 0 && parameters.length <= kLongest)) {
    refuseArgument(call, "length", parameters.length, "give one above 0 and up to 30, in cm");
  }
  if (!(parameters.deviation >= 0 && parameters.deviation <= 1)) {
    refuseArgument(call, "deviation", parameters.deviation, "give one from 0 to 1");
  }
  if (!(parameters.tip_deviation >= 0 && parameters.tip_deviation <= parameters.length)) {
    refuseArgument(call, "tip_deviation", parameters.tip_deviation, "give one from 0 to length");
  }
}

}  // namespace

FiberPolylines makePaperHalfScalp(const PaperHalfScalpParameters& parameters) {
  const char* call = "makePaperHalfScalp";
  FiberPolylines scene = emptyScene(call, parameters);
  if (parameters.fibers > kHalfScalpFibers) {
    refuseArgument(call, "fibers", parameters.fibers,
                   "ask for no more than the half of the head has room for, 50000");
  }
  requireStyle(call, parameters);
  const RodGrid grid(parameters.segments, kGrid);
  const Style& style = parameters.hanging ? kHanging : kCombed;
  const Wisps wisps(parameters.fibers, parameters.wisp_fibers);
  const double guide_deviation = parameters.tip_deviation / parameters.length;
  const Scalp scalp(parameters.fibers);

  CosseratRod rod = hair(parameters.length);
  const double sway = kTipSway * std::sin(kTipSwayPerFrame * parameters.frame);
  RodLoad load;
  load.tip_force = {kTipPull, sway, 0};
  // In the plane of d1 and d3, a torque at the tip bends a straight rod as if it was curved.
  const auto bend = [&](double curvature) {
    if (parameters.straight) {
      load.tip_torque = {0, -rod.bending_stiffness.y() * curvature, 0};
    } else {
      rod.reference_curvature = {0, -curvature, 0};
    }
  };
  std::vector<RodShape> guesses;
  for (int i = 0; i < kGuesses; ++i) {
    bend(style.curvature(static_cast<double>(i) / (kGuesses - 1)));
    guesses.push_back(
        solveRod(rod, load, grid.solved(), guesses.empty() ? nullptr : &guesses.back()));
  }

  for (int f = 0; f < parameters.fibers; ++f) {
    Random random = fiberRandom(parameters.seed, static_cast<std::size_t>(f));
    const Root root = scalp.draw(random, wisps.patchOf(f));
    const Deviates guide = wisps.guideOf(f, parameters.seed, guide_deviation);
    const Deviates own = Deviates::draw(random, parameters.deviation);
    double lift = kLift + guide.lift + own.lift;
    const double comb = style.comb + guide.comb + own.comb;
    bend(style.curvature(root.down) * (1 + guide.curvature + own.curvature));
    rod.base_point = root.place;
    const RodShape& guess =
        guesses[static_cast<std::size_t>(std::lround(root.down * (kGuesses - 1)))];

    const std::size_t begin = scene.points.size();
    for (int attempt = 0;; ++attempt, lift += kLiftStep) {
      rod.base_frame = frameOf(root, lift, comb);
      const RodLoad in_world = turned(load, Quaternion(rod.base_frame));
      grid.append(solveRod(rod, in_world, grid.solved(), &guess), scene);
      const auto first = scene.points.begin() + static_cast<std::ptrdiff_t>(begin) + 1;
      if (std::all_of(first, scene.points.end(), isOutsideHead)) break;
      if (attempt == kLiftSteps) {
        throw std::runtime_error(std::string(call) + ": fiber " + std::to_string(f) +
                                 " does not leave the head; take another seed");
      }
      scene.points.resize(begin);
      scene.point_begin.pop_back();
    }
  }
  return scene;
}

}  // namespace fcl_fibers::scenes
