// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/load_trajectory.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "arguments.h"

namespace fcl_fibers::scenes {
namespace {

constexpr double kPi = 3.141592653589793;
constexpr std::string_view kHeader = "step,fx,fy,fz,tx,ty,tz";
constexpr std::size_t kLoads = 6;  // numbers in a row besides the step
constexpr int kLoopSteps = 100;
constexpr double kGuideLength = 15;      // cm
constexpr double kGuideStiffness = 4.7;  // dyn cm2
constexpr double kLoopForce = 0.05;      // dyn

// So that the rows are the same on every platform, whatever its sine; never -0.
double rounded(double x) { return std::round(x * 1e6) / 1e6 + 0.0; }

double load(const TipLoad& state, std::size_t k) {
  const auto i = static_cast<Eigen::Index>(k % 3);
  return k < 3 ? state.force[i] : state.torque[i];
}

class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path), stream_(path) {
    if (!stream_) throw std::runtime_error("readLoadTrajectory: '" + path + "' cannot be opened");
  }

  LoadTrajectory read() {
    LoadTrajectory trajectory;
    bool has_header = false;
    std::string line;
    while (std::getline(stream_, line)) {
      ++line_number_;
      if (!line.empty() && line.back() == '\r') line.pop_back();
      if (line.empty() || line.front() == '#') continue;
      if (has_header) {
        trajectory.states.push_back(row(line, trajectory.states.size()));
      } else if (line == kHeader) {
        has_header = true;
      } else {
        refuse("the header is '" + line + "', expected is '" + std::string(kHeader) + "'");
      }
    }
    if (stream_.bad()) refuse("reading failed after this line");
    if (!has_header) refuse("the file ends before the header '" + std::string(kHeader) + "'");
    if (trajectory.states.empty()) refuse("the file ends before the first state");
    return trajectory;
  }

 private:
  TipLoad row(std::string_view line, std::size_t step) const {
    std::array<std::string_view, kLoads + 1> fields;
    std::size_t count = 0;
    for (std::size_t begin = 0;; ++count) {
      const std::size_t end = line.find(',', begin);
      if (count < fields.size()) fields[count] = line.substr(begin, end - begin);
      if (end == std::string_view::npos) break;
      begin = end + 1;
    }
    ++count;
    if (count != fields.size()) {
      refuse("there are " + std::to_string(count) + " fields, expected are " +
             std::to_string(fields.size()));
    }
    if (fields[0] != std::to_string(step)) {
      refuse("the step is '" + std::string(fields[0]) + "', expected is " + std::to_string(step));
    }
    const auto vector = [&](std::size_t first) {
      return Eigen::Vector3d(number(fields[first]), number(fields[first + 1]),
                             number(fields[first + 2]));
    };
    return {vector(1), vector(4)};
  }

  double number(std::string_view text) const {
    double value = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc() || stop != end || !std::isfinite(value)) {
      refuse("'" + std::string(text) + "' is not a finite number");
    }
    return value;
  }

  [[noreturn]] void refuse(const std::string& reason) const {
    throw std::runtime_error("readLoadTrajectory: '" + path_ + "', line " +
                             std::to_string(line_number_) + ": " + reason);
  }

  std::string path_;
  std::ifstream stream_;
  std::size_t line_number_ = 0;
};

void requireFiniteLoads(const LoadTrajectory& trajectory) {
  for (std::size_t step = 0; step < trajectory.states.size(); ++step) {
    for (std::size_t k = 0; k < kLoads; ++k) {
      const double value = load(trajectory.states[step], k);
      if (std::isfinite(value)) continue;
      const std::string name = "a load of step " + std::to_string(step);
      refuseArgument("writeLoadTrajectory", name.c_str(), value, "give finite loads");
    }
  }
}

}  // namespace

LoadTrajectory loopTrajectory() {
  LoadTrajectory trajectory;
  const double loop_torque = kGuideStiffness * 2 * kPi / kGuideLength;
  for (int step = 0; step <= kLoopSteps; ++step) {
    const double a = static_cast<double>(step) / kLoopSteps;
    const double b = a * a * (3 - 2 * a);
    const double wave = std::sin(kPi * a);
    const double double_wave = std::sin(2 * kPi * a);
    TipLoad state;
    state.force = kLoopForce * Eigen::Vector3d(b, -wave, double_wave);
    state.torque = loop_torque * Eigen::Vector3d(b, 0.1 * wave, 0.2 * double_wave);
    trajectory.states.push_back(
        {state.force.unaryExpr(&rounded), state.torque.unaryExpr(&rounded)});
  }
  return trajectory;
}

LoadTrajectory readLoadTrajectory(const std::string& path) { return Reader(path).read(); }

void writeLoadTrajectory(const std::string& path, const LoadTrajectory& trajectory) {
  if (trajectory.states.empty()) {
    refuseArgument("writeLoadTrajectory", "the number of states", 0, "give at least the start");
  }
  requireFiniteLoads(trajectory);

  std::string text =
      "# Force and torque on the tip of a rod, in the frame of its base.\n"
      "# Forces are in dyn, torques in dyn cm.\n";
  text += kHeader;
  text += '\n';
  for (std::size_t step = 0; step < trajectory.states.size(); ++step) {
    text += std::to_string(step);
    for (std::size_t k = 0; k < kLoads; ++k) {
      // The shortest text that reads back as the same number has at most 24 characters.
      std::array<char, 32> digits;
      const auto end = std::to_chars(digits.data(), digits.data() + digits.size(),
                                     load(trajectory.states[step], k));
      text += ',';
      text.append(digits.data(), end.ptr);
    }
    text += '\n';
  }

  std::ofstream stream(path, std::ios::binary);
  if (!stream) throw std::runtime_error("writeLoadTrajectory: '" + path + "' cannot be opened");
  stream << text;
  stream.close();
  if (!stream) throw std::runtime_error("writeLoadTrajectory: '" + path + "': writing failed");
}

}  // namespace fcl_fibers::scenes
