// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/generations.h"

namespace fcl_fibers::broadphase {

void Generations::copy(const Generations& other) {
  main_.copy(other.main_);
  young_.copy(other.young_);
  end_ = other.end_;
}

void Generations::clear() {
  main_.clear();
  young_.clear();
  end_ = 0;
}

void Generations::build(const index::SegmentSource& source, const geometry::Frame& frame,
                        SegmentId end, const tree::Fibers& fibers) {
  keepStarts();
  main_.build(source, frame, 0, end, fibers);
  end_ = end;
}

bool Generations::buildYoung(const index::SegmentSource& source, SegmentId end,
                             const tree::Fibers& fibers) {
  end_ = youngBegin();
  // The index starts at the first object, which saves room for empty ids before it.
  const SegmentId begin = fibers.ids.empty() ? end : fibers.ids.front();
  if (!young_.tryBuild(source, frame(), begin, end, fibers)) return false;
  end_ = end;
  return true;
}

bool Generations::refitSome(const std::vector<SegmentId>& ids, const std::vector<Segment>& moved) {
  std::vector<SegmentId> part_ids;
  std::vector<Segment> part;
  bool is_good = true;
  for (const bool young : {false, true}) {
    part_ids.clear();
    part.clear();
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (isYoung(ids[i]) != young) continue;
      part_ids.push_back(ids[i]);
      part.push_back(moved[i]);
    }
    if (part_ids.empty()) continue;
    const bool is_tight = (young ? young_ : main_).refitSome(part_ids, part);
    is_good &= young || is_tight;
  }
  return is_good;
}

}  // namespace fcl_fibers::broadphase
