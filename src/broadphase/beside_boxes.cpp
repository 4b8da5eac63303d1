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

BesideBoxes::BesideBoxes(double margin) : main_(boxOptions(margin)), young_(boxOptions(margin)) {}

void BesideBoxes::clear() {
  main_.clear();
  young_.clear();
}

void BesideBoxes::setStep(bool has_step) {
  has_step_ = has_step;
  main_.endStep();
  young_.endStep();
}

void BesideBoxes::build(SegmentIndex& part, Place begin, Place end, const BoxOf& boxOf) {
  tree::Fibers one_each;
  for (Place place = begin; place < end; ++place) {
    one_each.ids.push_back(place);
    one_each.endFiber();
  }
  part.build(BoxSource(boxOf, &MovingSegment::end), frame_, begin, end, one_each);
  fitStart(part, boxOf);
}

void BesideBoxes::fitStart(SegmentIndex& part, const BoxOf& boxOf) {
  if (has_step_) part.fitStart(BoxSource(boxOf, &MovingSegment::start));
}

void BesideBoxes::readAll(const Frame& frame, Place count, const BoxOf& boxOf) {
  const bool is_refit = frame_ == frame && !hasYoung() && main_.end() == count;
  frame_ = frame;
  if (count == 0) return clear();
  if (is_refit && main_.refit(BoxSource(boxOf, &MovingSegment::end), frame)) {
    return fitStart(main_, boxOf);
  }
  young_.clear();
  build(main_, 0, count, boxOf);
}

void BesideBoxes::readNew(Place count, const BoxOf& boxOf) {
  const auto added = static_cast<std::size_t>(count - main_.end());
  if (added > Generations::mostYoung(static_cast<std::size_t>(count))) {
    young_.clear();
    return build(main_, 0, count, boxOf);
  }
  build(young_, main_.end(), count, boxOf);
}

void BesideBoxes::readSome(const std::vector<Place>& places, const BoxOf& boxOf) {
  for (SegmentIndex* part : {&main_, &young_}) {
    std::vector<Place> moved;
    std::vector<Segment> boxes;
    for (const Place place : places) {
      if (place < part->begin() || place >= part->end()) continue;
      moved.push_back(place);
      boxes.push_back(boxOf(place).end);
    }
    if (moved.empty()) continue;
    if (part->refitSome(moved, boxes)) {
      fitStart(*part, boxOf);
    } else {
      build(*part, part->begin(), part->end(), boxOf);
    }
  }
}

Visit BesideBoxes::search(index::PairSink& sink) const {
  const index::Question question = index::Question::ofStep();
  if (main_.search(sink, question) == Visit::kStop) return Visit::kStop;
  if (!hasYoung()) return Visit::kContinue;
  return main_.search(young_, nullptr, sink, question) == Visit::kStop
             ? Visit::kStop
             : young_.search(sink, question);
}

Visit BesideBoxes::search(index::NearestSink& sink) const {
  if (main_.search(sink) == Visit::kStop) return Visit::kStop;
  if (!hasYoung()) return Visit::kContinue;
  return main_.search(young_, nullptr, sink) == Visit::kStop ? Visit::kStop : young_.search(sink);
}

/// Calls search(part) with both parts.
template <class Search>
Visit BesideBoxes::within(const Search& search) const {
  for (const SegmentIndex* part : {&main_, &young_}) {
    if (part->begin() < part->end() && search(*part) == Visit::kStop) return Visit::kStop;
  }
  return Visit::kContinue;
}

Visit BesideBoxes::search(const MovingSegment& segment, double error, index::PairSink& sink) const {
  return within([&](const SegmentIndex& part) {
    return part.search(segment, error, tree::kNoGroup, 0, sink, index::Question::ofStep());
  });
}

Visit BesideBoxes::search(const MovingSegment& segment, double error,
                          index::NearestSink& sink) const {
  return within([&](const SegmentIndex& part) {
    return part.search(segment, error, tree::kNoGroup, 0, sink);
  });
}

}  // namespace fcl_fibers::broadphase
