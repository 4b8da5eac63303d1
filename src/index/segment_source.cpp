// SPDX-License-Identifier: BSD-3-Clause
#include "index/segment_source.h"

#include <array>
#include <cstddef>

namespace fcl_fibers::index {

using geometry::Frame;
using geometry::Segment;

bool readOne(const SegmentSource& source, SegmentId id, const Frame& frame, Segment& segment) {
  std::uint64_t present = 0;
  if (source.read(id, id + 1, frame, &segment, present) == id) source.refuse(id, frame);
  return present != 0;
}

Frame frameFor(const SegmentSource& source, SegmentId begin, SegmentId end) {
  constexpr std::size_t kSamples = 255;
  std::array<Segment, kSamples> samples;
  // If so many ids are empty that few samples are found, the steps become smaller.
  std::size_t found = 0;
  SegmentId step = (end - begin) / SegmentId{kSamples} + 1;
  for (; found < kSamples / 4; step /= 2) {
    found = 0;
    for (SegmentId id = begin; id < end && found < kSamples; id += step) {
      std::uint64_t present = 0;
      const bool is_read = source.read(id, id + 1, Frame{}, &samples[found], present) != id;
      found += is_read && present != 0 && isBounded(samples[found]);
    }
    if (step == 1) break;
  }
  return geometry::frameFor(samples.data(), found);
}

}  // namespace fcl_fibers::index
