// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tools/commands.h"
#include "tools/trade/trial.h"

namespace fcl_fibers::tools::trade {

/// A setting and its outcome.
struct Row {
  std::string dial, value, cpp, python;
  Outcome outcome;
  bool is_on_front = false;  ///< no other takes less time and misses and adds no more
};

/// Marks the rows that are on the front.
void markFront(std::vector<Row>& rows);

/// Whether a row is as the default in time, bytes and answers, to within 10 % of time and bytes.
bool showsNoDifference(const Row& row, const Row& usual);

/// The fastest row that keeps a wish, or null. Of those that are as fast it is the first. What a
/// sample has not missed counts as none missed, if no share is given; else the bound counts.
const Row* choose(const std::vector<Row>& rows, const Wish& wish);

/// The rows by time, beside the share that is missed and that of false pairs, as SVG.
std::string frontPicture(const std::string& title, const std::vector<Row>& rows);

/// `24.4 ms`, `0.0251 %`
std::string timeText(double seconds);
std::string shareText(double share);

}  // namespace fcl_fibers::tools::trade
