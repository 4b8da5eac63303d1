// SPDX-License-Identifier: BSD-3-Clause
#include "live/inside.h"

#include <cstddef>

#include "live/live_list.h"
#include "parallel/executor.h"

namespace fcl_fibers::live {

using tree::SegmentId;

void Inside::set(const Pairing& pairing, const std::vector<SegmentId>& deep) {
  const index::KeptSegments& segments = *pairing.side(0).segments;
  deep_ = SegmentFlags(segments.begin(), segments.end());
  for (const SegmentId id : deep) deep_.set(id);
}

std::vector<SegmentId> Inside::find(const Pairing& pairing, const SegmentFlags& near,
                                    const SegmentFlags& touching) const {
  const index::KeptSegments& segments = *pairing.side(0).segments;
  // Segments of one side of the surface, which share ends.
  struct Run {
    SegmentId first, last;
    bool is_inside, is_known;
  };
  std::vector<Run> runs;
  const auto isOpen = [&](SegmentId id) { return near.has(id) && !touching.has(id); };
  const auto isSettled = [&](SegmentId id) { return !near.has(id) && pairing.mayMeet(id); };
  for (SegmentId id = near.begin(); id < near.end(); ++id) {
    Run run{id, id, true, true};
    if (isOpen(id)) {
      while (segments.sharesSecondEnd(id) && isOpen(id + 1)) run.last = ++id;
      if (segments.sharesFirstEnd(run.first) && isSettled(run.first - 1)) {
        run.is_inside = deep_.has(run.first - 1);
      } else if (segments.sharesSecondEnd(id) && isSettled(id + 1)) {
        run.is_inside = deep_.has(id + 1);
      } else {
        run.is_known = false;
      }
    } else if (near.has(id) || !deep_.has(id)) {
      continue;
    }
    runs.push_back(run);
  }
  constexpr std::size_t kAtOnce = 64;
  parallel::forRanges(pairing.executor(), runs.size(), kAtOnce,
                      [&](std::size_t begin, std::size_t end) {
                        for (std::size_t i = begin; i < end; ++i) {
                          if (!runs[i].is_known)
                            runs[i].is_inside = pairing.isInside(runs[i].first);
                        }
                      });
  std::vector<SegmentId> inside;
  for (const Run& run : runs) {
    for (SegmentId id = run.first; run.is_inside && id <= run.last; ++id) inside.push_back(id);
  }
  return inside;
}

}  // namespace fcl_fibers::live
