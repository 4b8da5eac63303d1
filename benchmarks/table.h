// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "contender.h"
#include "preflight.h"
#include "timings.h"

namespace fcl_fibers::benchmarks {

/// What kept results carry beside the numbers.
struct Circumstances {
  std::string machine;
  std::string compiler;
  std::string build_type;
  std::string commit;  ///< FCL_FIBERS_COMMIT of the environment
  std::string command;
};
Circumstances circumstances(int argc, char** argv);

/// Aligned in a terminal, a table in Markdown.
class TextTable {
 public:
  using Row = std::vector<std::string>;
  explicit TextTable(Row header) : rows_{std::move(header)} {}
  void add(Row row) { rows_.push_back(std::move(row)); }
  void print() const;

 private:
  std::vector<Row> rows_;
};

/// Three significant digits: `12.3 ms`, `1.25 s`.
std::string timeText(double seconds);
/// Three significant digits: `0.412`, `1.25`, `13.1`.
std::string ratioText(double ratio);
/// `1,234,567`
std::string countText(std::size_t count);

/// Smallest update + self-collision among FCL's contenders that read such boxes; null if none.
const Timing* fclBest(const std::vector<Contender>& contenders, const std::vector<Timing>& timings,
                      const std::vector<Boxes>& boxes);

void printScene(const std::vector<Contender>& contenders, const std::vector<Preflight>& preflights,
                const std::vector<Timing>& timings, const MovingFibers& fibers,
                const Circumstances& circumstances);

}  // namespace fcl_fibers::benchmarks
