// SPDX-License-Identifier: BSD-3-Clause
#include "kit/table.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>

#include "harness/runs.h"
#include "tools/messages.h"

namespace fcl_fibers::benchmarks {
namespace {

constexpr std::array kEntries = {"construction", "update", "detection", "touching"};

/// Three digits and a unit.
std::string timeText(double seconds) {
  if (seconds < 1e-6) return "<1 us";  // which one reading of the clock does not tell apart
  struct Unit {
    const char* name;
    double scale;
  };
  constexpr std::array kUnits = {Unit{"s", 1}, Unit{"ms", 1e-3}, Unit{"us", 1e-6}};
  const auto* const unit = std::find_if(kUnits.begin(), kUnits.end() - 1, [seconds](const Unit& u) {
    return seconds >= 0.9995 * u.scale;
  });
  const double value = seconds / unit->scale;
  const int decimals = value < 9.995 ? 2 : value < 99.95 ? 1 : 0;
  std::array<char, 64> text = {};
  std::snprintf(text.data(), text.size(), "%.*f %s", decimals, value, unit->name);
  return text.data();
}

std::string padded(const std::string& text, std::size_t width) {
  return std::string(width - std::min(width, text.size()), ' ') + text;
}

}  // namespace

void TableReporter::ReportRuns(const std::vector<Run>& runs) {
  for (const Run& run : runs) {
    if (run.run_type != Run::RT_Iteration) continue;
    const std::string& name = run.run_name.function_name;
    const std::string error = errorOf(run);
    if (!error.empty()) {
      errors_[name] = error;
    } else {
      seconds_[name].push_back(run.GetAdjustedRealTime() /
                               benchmark::GetTimeUnitMultiplier(run.time_unit));
    }
  }
}

std::string TableReporter::median(const std::string& entry) const {
  if (errors_.count(entry) > 0) return "error";
  const auto found = seconds_.find(entry);
  if (found == seconds_.end()) return "-";
  std::vector<double> sorted = found->second;
  std::sort(sorted.begin(), sorted.end());
  return timeText(sorted[sorted.size() / 2]);
}

void TableReporter::print() {
  constexpr std::size_t kColumn = 14;
  std::size_t names = 0;
  for (const TableOfScene& table : tables_) {
    for (const TableRow& row : table.rows) names = std::max(names, row.manager.size());
  }
  std::string text;
  for (const TableOfScene& table : tables_) {
    text += table.title + "\n\n" + std::string(names, ' ');
    for (const char* const entry : kEntries) text += padded(entry, kColumn);
    text += padded("pairs", kColumn) + padded("bytes", kColumn) + '\n';
    for (const TableRow& row : table.rows) {
      text += row.manager + std::string(names - row.manager.size(), ' ');
      if (!row.note.empty()) {
        text += "  " + row.note + '\n';
        continue;
      }
      for (const char* const entry : kEntries) {
        text += padded(median(row.entries + "/" + entry), kColumn);
      }
      text += padded(tools::countText(row.pairs), kColumn) +
              padded(tools::countText(row.bytes), kColumn) + '\n';
    }
    text += '\n';
  }
  for (const auto& [name, error] : errors_) text += name + ": " + error + '\n';
  tools::print(text);
}

}  // namespace fcl_fibers::benchmarks
