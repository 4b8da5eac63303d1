// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "index/tree_search.h"
#include "support/volume_tests.h"

namespace fcl_fibers::test {

/// What a search on several threads shares among them. Work is in tests of volumes.
struct JobCounts {
  std::size_t tasks, jobs, barriers;
  double least, median, most;  ///< work of a job
  double tests;                ///< work of all
};

/// Runs all on the calling thread, so that no job is divided because another thread has none.
class OneThread final : public parallel::Executor {
 public:
  int threads() const override { return 2; }
  void parallelForWithForeground(parallel::FunctionRef<> foreground, int count,
                                 parallel::FunctionRef<int> task) override {
    ++calls_;
    foreground();
    for (int i = 0; i < count; ++i) task(i);
  }
  std::size_t calls() const { return calls_; }

 private:
  std::size_t calls_ = 0;
};

/// Counts the work of each job. One thread may use it.
template <class Tree>
class JobsOfSearch final : public index::PairSearch {
 public:
  explicit JobsOfSearch(const Tree& tree) : tree_(tree), search_(tree) {}

  std::int32_t leafCount() const override { return search_.leafCount(); }
  tree::Visit split(const tree::TraversalTask& task, std::int32_t grain,
                    tree::TaskSink& out) const override {
    return search_.split(task, grain, out);
  }
  tree::Visit run(const tree::TraversalTask& task, tree::PairBuffer& out) const override {
    VolumeTests count;
    visitTask(tree_, task, count);
    work_ += static_cast<double>(count.tests);
    ++tasks_;
    return search_.run(task, out);
  }
  void endJob() const override { jobs_.push_back(std::exchange(work_, 0)); }

  std::size_t tasks() const { return tasks_; }
  const std::vector<double>& jobs() const { return jobs_; }

 private:
  const Tree& tree_;
  const index::TreeSearch<Tree> search_;
  mutable std::size_t tasks_ = 0;
  mutable double work_ = 0;
  mutable std::vector<double> jobs_;
};

/// Of a search for the pairs of a tree, which has more than tree::kLeastGrain leaves.
template <class Tree>
JobCounts countJobs(const Tree& tree) {
  const JobsOfSearch<Tree> search(tree);
  OneThread executor;
  index::BlockPool pool;
  index::NoSink sink;
  findPairs(search, nullptr, &executor, pool, sink);
  std::vector<double> jobs = search.jobs();
  std::sort(jobs.begin(), jobs.end());
  return {search.tasks(),
          jobs.size(),
          executor.calls(),
          jobs.front(),
          jobs[jobs.size() / 2],
          jobs.back(),
          std::accumulate(jobs.begin(), jobs.end(), 0.0)};
}

}  // namespace fcl_fibers::test
