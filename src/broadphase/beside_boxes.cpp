// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/beside_boxes.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "broadphase/generations.h"

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::MovingSegment;
using geometry::Segment;
using index::SegmentIndex;
using tree::Visit;

/// Reads the boxes at the start or at the end.
class BoxSource final : public index::SegmentSource {
 public:
  BoxSource(const BesideBoxes::BoxOf& boxOf, Segment MovingSegment::*time)
      : box_of_(boxOf), time_(time) {}

  bool read(const index::SegmentId* ids, int count, int /*ahead*/, const Frame& /*frame*/,
            index::SegmentBlock& out, index::BlockMask& present) const override {
    for (int i = 0; i < count; ++i) out.set(i, box_of_(ids[i]).*time_);
    present = geometry::firstOfBlock(count);
    return true;
  }
  bool staysFiniteIn(const Frame& /*frame*/) const override { return true; }
  bool isFasterInOrder() const override { return false; }
  [[noreturn]] void refuse(index::SegmentId /*id*/, const Frame& /*frame*/) const override {
    throw std::logic_error("fcl_fibers: every box can be read");
  }

 private:
  const BesideBoxes::BoxOf& box_of_;
  Segment MovingSegment::*time_;
};

index::IndexOptions boxOptions(double margin) {
  index::IndexOptions options;
  options.capsules = true;  // then boxes are compared in double
  options.margin = margin;
  return options;
}

}  // namespace

BesideBoxes::BesideBoxes(double margin, bool moves)
    : moves_(moves),
      main_{SegmentIndex(boxOptions(margin)), nullptr},
      young_{SegmentIndex(boxOptions(margin)), nullptr} {}

void BesideBoxes::clear() {
  for (Part* part : {&main_, &young_}) {
    part->end.clear();
    part->start = nullptr;
  }
}

void BesideBoxes::build(Part& part, Place begin, Place end, const BoxOf& boxOf) {
  tree::Fibers one_each;
  for (Place place = begin; place < end; ++place) {
    one_each.ids.push_back(place);
    one_each.endFiber();
  }
  part.start = nullptr;
  part.end.build(BoxSource(boxOf, &MovingSegment::end), frame_, begin, end, one_each);
  fitStart(part, boxOf);
}

void BesideBoxes::fitStart(Part& part, const BoxOf& boxOf) {
  if (!moves_) return;
  if (part.start == nullptr) {
    part.start = std::make_unique<SegmentIndex>(part.end.options());
    part.start->copy(part.end);
  }
  part.start->tryRefit(BoxSource(boxOf, &MovingSegment::start), frame_);
}

void BesideBoxes::readAll(const Frame& frame, Place count, const BoxOf& boxOf) {
  const bool is_refit = frame_ == frame && !hasYoung() && main_.end.end() == count;
  frame_ = frame;
  if (count == 0) return clear();
  if (is_refit && main_.end.refit(BoxSource(boxOf, &MovingSegment::end), frame)) {
    return fitStart(main_, boxOf);
  }
  young_.end.clear();
  young_.start = nullptr;
  build(main_, 0, count, boxOf);
}

void BesideBoxes::readNew(Place count, const BoxOf& boxOf) {
  const auto added = static_cast<std::size_t>(count - main_.end.end());
  if (added > Generations::mostYoung(static_cast<std::size_t>(count))) {
    young_.end.clear();
    young_.start = nullptr;
    return build(main_, 0, count, boxOf);
  }
  build(young_, main_.end.end(), count, boxOf);
}

void BesideBoxes::readSome(const std::vector<Place>& places, const BoxOf& boxOf) {
  for (Part* part : {&main_, &young_}) {
    std::vector<Place> moved;
    std::vector<Segment> starts, ends;
    for (const Place place : places) {
      if (place < part->end.begin() || place >= part->end.end()) continue;
      const MovingSegment box = boxOf(place);
      moved.push_back(place);
      starts.push_back(box.start);
      ends.push_back(box.end);
    }
    if (moved.empty()) continue;
    if (moves_ && part->start == nullptr) fitStart(*part, boxOf);
    if (!part->end.refitSome(moved, ends)) {
      build(*part, part->end.begin(), part->end.end(), boxOf);
    } else if (moves_) {
      part->start->refitSome(moved, starts);
    }
  }
}

void BesideBoxes::beginStep() {
  main_.start = nullptr;
  young_.start = nullptr;
}

Visit BesideBoxes::search(index::PairSink& sink) const {
  const auto within = [&](const Part& part) {
    return moves_ ? part.step().searchImpacts(nullptr, sink) : part.end.search(sink);
  };
  if (within(main_) == Visit::kStop) return Visit::kStop;
  if (!hasYoung()) return Visit::kContinue;
  const Visit across = moves_ ? main_.step().searchImpacts(young_.step(), nullptr, sink)
                              : main_.end.search(young_.end, nullptr, sink);
  return across == Visit::kStop ? Visit::kStop : within(young_);
}

Visit BesideBoxes::search(index::NearestSink& sink) const {
  if (main_.end.search(sink) == Visit::kStop) return Visit::kStop;
  if (!hasYoung()) return Visit::kContinue;
  return main_.end.search(young_.end, nullptr, sink) == Visit::kStop ? Visit::kStop
                                                                     : young_.end.search(sink);
}

Visit BesideBoxes::search(const MovingSegment& segment, double error, index::PairSink& sink) const {
  for (const Part* part : {&main_, &young_}) {
    if (part->end.begin() == part->end.end()) continue;
    const Visit visit =
        moves_ ? part->step().searchImpacts(segment, error, tree::kNoGroup, 0, nullptr, sink)
               : part->end.search(segment.end, error, tree::kNoGroup, 0, sink);
    if (visit == Visit::kStop) return visit;
  }
  return Visit::kContinue;
}

Visit BesideBoxes::search(const MovingSegment& segment, double error,
                          index::NearestSink& sink) const {
  for (const Part* part : {&main_, &young_}) {
    if (part->end.begin() == part->end.end()) continue;
    if (part->end.search(segment.end, error, tree::kNoGroup, 0, sink) == Visit::kStop) {
      return Visit::kStop;
    }
  }
  return Visit::kContinue;
}

std::size_t BesideBoxes::memoryUsage() const {
  std::size_t bytes = 0;
  for (const Part* part : {&main_, &young_}) {
    bytes += part->end.memoryUsage() +
             (part->start ? sizeof(SegmentIndex) + part->start->memoryUsage() : 0);
  }
  return bytes;
}

}  // namespace fcl_fibers::broadphase
