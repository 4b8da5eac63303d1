// SPDX-License-Identifier: BSD-3-Clause
#include "measures/live_motions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <fcl_fibers/fiber_polylines.h>

#include "scenes/random.h"

namespace fcl_fibers::benchmarks {
namespace {

double meanDistance(const std::vector<Point>& some, const std::vector<Point>& others) {
  double sum = 0;
  for (std::size_t i = 0; i < some.size(); ++i) sum += distance(some[i], others[i]);
  return sum / static_cast<double>(some.size());
}

/// How far points move in a step, in radii.
struct Pace {
  double turn;   ///< by the turn of the whole scene, in the mean
  double wave;   ///< by the waves of their fiber, at most
  double noise;  ///< along each axis to either side of where they would be, at most
};
constexpr Pace kSlow{0.02, 0.012, 0.02}, kFast{0.2, 0.04, 0}, kStorm{5, 5, 0};

/// The scene turns as a whole about an axis through its middle. Three waves of sideways motion run
/// along each fiber, in a direction and from a phase of its own, so that fibers move against each
/// other. Spells of two paces take turns.
class Turning {
 public:
  Turning(FiberPolylines start, const Pace& one, const Pace& other)
      : start_(std::move(start)), paces_{one, other} {
    scenes::Random random(kSeed);
    for (const Point& p : start_.points) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        middle_[axis] += p[axis] / static_cast<double>(start_.points.size());
      }
    }
    // About z: its distance from the axis is how far a point moves by a turn of 1 rad.
    for (const Point& p : start_.points) {
      lever_ += std::hypot(p[0] - middle_[0], p[1] - middle_[1]);
    }
    lever_ /= static_cast<double>(start_.points.size());
    for (std::size_t f = 0; f < start_.fiberCount(); ++f) {
      const double x = random.normal(), y = random.normal(), z = random.normal();
      const double norm = std::hypot(x, y, z);
      ways_.push_back({{x / norm, y / norm, z / norm}, 2 * kPi * random.uniform()});
    }
  }

  void operator()(std::vector<Point>& points) {
    const Pace& pace = paces_[step_++ / kSpell % 2];
    angle_ += pace.turn * start_.radius / lever_;
    phase_ += pace.wave / kAmplitude;
    const double c = std::cos(angle_), s = std::sin(angle_);
    for (std::size_t f = 0; f < start_.fiberCount(); ++f) {
      const std::size_t begin = start_.point_begin[f], end = start_.point_begin[f + 1];
      const double turn = 2 * kPi * kWaves / static_cast<double>(end - begin);
      const double c_turn = std::cos(turn), s_turn = std::sin(turn);
      double c_wave = std::cos(ways_[f].phase + phase_), s_wave = std::sin(ways_[f].phase + phase_);
      for (std::size_t i = begin; i < end; ++i) {
        const Point& p = start_.points[i];
        const double x = p[0] - middle_[0], y = p[1] - middle_[1];
        points[i] = {middle_[0] + c * x - s * y, middle_[1] + s * x + c * y, p[2]};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          double offset = kAmplitude * s_wave * ways_[f].direction[axis];
          if (pace.noise > 0) offset += pace.noise * (2 * noise_.uniform() - 1);
          points[i][axis] += start_.radius * offset;
        }
        // The sine and cosine of the next point's phase.
        const double next = s_wave * c_turn + c_wave * s_turn;
        c_wave = c_wave * c_turn - s_wave * s_turn;
        s_wave = next;
      }
    }
  }

 private:
  struct Way {
    Point direction;
    double phase;
  };
  static constexpr double kPi = 3.141592653589793, kWaves = 3, kAmplitude = 3;  // of radii
  static constexpr std::size_t kSpell = 20;
  static constexpr std::uint64_t kSeed = 7;

  const FiberPolylines start_;
  const std::array<Pace, 2> paces_;
  Point middle_ = {0, 0, 0};
  double lever_ = 0;
  std::vector<Way> ways_;  ///< by fiber
  scenes::Random noise_{kSeed + 1};
  std::size_t step_ = 0;
  double angle_ = 0, phase_ = 0;
};

/// From one frame of the scene straight to the next, by so many radii a step in the mean. Few
/// fibers of a cap fall to another side meanwhile.
class Creeping {
 public:
  Creeping(SceneSource source, double radii)
      : source_(std::move(source)), frame_(source_.frame), to_(source_.make(frame_)) {
    next();
    part_ = radii * from_.radius / meanDistance(from_.points, to_.points);
  }

  void operator()(std::vector<Point>& points) {
    for (time_ += part_; time_ > 1; time_ -= 1) next();
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        points[i][axis] = (1 - time_) * from_.points[i][axis] + time_ * to_.points[i][axis];
      }
    }
  }

 private:
  void next() {
    from_ = std::move(to_);
    to_ = source_.make(++frame_);
  }

  const SceneSource source_;
  int frame_;
  FiberPolylines from_, to_;
  double part_ = 0, time_ = 0;  ///< of a frame
};

/// The frames of the scene, of a motion without an end there and back again.
class Frames {
 public:
  explicit Frames(SceneSource source)
      : source_(std::move(source)),
        count_(std::clamp(source_.frame_count - source_.frame, 2, kMost)) {}

  void operator()(std::vector<Point>& points) {
    const int place = ++step_ % (2 * (count_ - 1));
    points = source_.make(source_.frame + std::min(place, 2 * (count_ - 1) - place)).points;
  }

 private:
  static constexpr int kMost = 101;
  const SceneSource source_;
  const int count_;
  int step_ = 0;
};

}  // namespace

Mover makeMover(const std::string& motion, const SceneSource& source) {
  if (motion == "slow") return Turning(source.scene(), kSlow, kSlow);
  if (motion == "fast") return Turning(source.scene(), kFast, kFast);
  if (motion == "weather") return Turning(source.scene(), kSlow, kStorm);
  if (motion == "creeping") return Creeping(source, 0.4);
  return Frames(source);
}

}  // namespace fcl_fibers::benchmarks
