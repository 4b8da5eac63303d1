// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/load_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <system_error>

namespace fcl_fibers::scenes {
namespace {

constexpr std::size_t kMostStates = 10000;  // all are solved at once, and their shapes kept
constexpr std::size_t kNumbers = 6;
constexpr std::string_view kBlanks = " \t\r,";

/// What is wrong with a line, or nothing.
std::string read(std::string_view line, std::array<double, kNumbers>& numbers) {
  std::size_t count = 0;
  for (std::size_t at = line.find_first_not_of(kBlanks); at != std::string_view::npos;
       at = line.find_first_not_of(kBlanks, at)) {
    std::string_view word = line.substr(at, line.find_first_of(kBlanks, at) - at);
    at += word.size();
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
    double number = 0;
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, number);
    if (error != std::errc() || stop != end || !std::isfinite(number)) {
      return "'" + std::string(word.substr(0, 40)) + "' is not a finite number";
    }
    if (count < kNumbers) numbers[count] = number;
    ++count;
  }
  if (count == kNumbers) return "";
  return "there are " + std::to_string(count) + " numbers; give six, a force and a torque";
}

}  // namespace

std::vector<RodLoad> readLoads(const std::string& path) {
  const auto refuse = [&](const std::string& why) {
    throw std::runtime_error("loads '" + path + "': " + why);
  };
  std::ifstream file(path);
  if (!file) refuse("the file cannot be opened");
  std::vector<RodLoad> loads;
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    line.erase(std::min(line.find('#'), line.size()));
    if (line.find_first_not_of(kBlanks) == std::string::npos) continue;
    std::array<double, kNumbers> n{};
    const std::string problem = read(line, n);
    if (!problem.empty()) refuse("line " + std::to_string(number) + ": " + problem);
    if (loads.size() == kMostStates) {
      refuse("line " + std::to_string(number) + ": there are more than 10,000 states");
    }
    RodLoad& load = loads.emplace_back();
    load.tip_force = {n[0], n[1], n[2]};
    load.tip_torque = {n[3], n[4], n[5]};
  }
  if (!file.eof()) refuse("the file cannot be read to its end");
  if (loads.empty()) refuse("there is no state; give a line of six numbers for each");
  return loads;
}

}  // namespace fcl_fibers::scenes
