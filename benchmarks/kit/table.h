// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <benchmark/benchmark.h>

#include <map>
#include <string>
#include <vector>

namespace fcl_fibers::benchmarks {

/// A manager on a scene, as the table shows it.
struct TableRow {
  std::string manager;
  std::string note;     ///< why it is not timed, or empty
  std::string entries;  ///< its entries are `ENTRIES/construction` and so on
  std::size_t pairs = 0;
  std::size_t bytes = 0;
};

struct TableOfScene {
  std::string title;
  std::vector<TableRow> rows;
};

/// Makes one table for each scene: medians, a row for each manager.
class TableReporter : public benchmark::BenchmarkReporter {
 public:
  /// @param tables  outlive it
  explicit TableReporter(const std::vector<TableOfScene>& tables) : tables_(tables) {}

  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override;

  /// When all is measured. Google Benchmark would not call a reporter where nothing is.
  void print();

 private:
  std::string median(const std::string& entry) const;

  const std::vector<TableOfScene>& tables_;
  std::map<std::string, std::vector<double>> seconds_;  ///< of all runs, by entry
  std::map<std::string, std::string> errors_;
};

}  // namespace fcl_fibers::benchmarks
