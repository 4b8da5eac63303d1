// SPDX-License-Identifier: BSD-3-Clause
#include "index/segment_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace fcl_fibers::index {

using geometry::Frame;
using geometry::Segment;

bool readOne(const SegmentSource& source, SegmentId id, const Frame& frame, Segment& segment) {
  SegmentBlock block;
  BlockMask present = 0;
  if (!source.read(&id, 1, 0, frame, block, present)) source.refuse(id, frame);
  if (present == 0) return false;
  segment = block[0];
  return true;
}

void refuseLeast(const SegmentSource& source, tree::SegmentIds ids, const Frame& frame) {
  std::sort(ids.begin(), ids.end());
  Segment segment;
  for (const SegmentId id : ids) readOne(source, id, frame, segment);
  // Another thread has changed it meanwhile.
  for (;;) source.refuse(ids.front(), frame);
}

Frame frameFor(const SegmentSource& source, const tree::SegmentIds& ids) {
  constexpr std::size_t kSamples = 255;
  std::array<Segment, kSamples> samples;
  // If too few samples can be used, the steps become smaller.
  std::size_t found = 0;
  std::size_t step = ids.size() / kSamples + 1;
  for (; found < kSamples / 4; step /= 2) {
    found = 0;
    for (std::size_t i = 0; i < ids.size() && found < kSamples; i += step) {
      SegmentBlock block;
      BlockMask present = 0;
      if (!source.read(&ids[i], 1, 0, Frame{}, block, present) || present == 0) continue;
      samples[found] = block[0];
      found += isBounded(samples[found]);
    }
    if (step == 1) break;
  }
  Frame frame = geometry::frameFor(samples.data(), found);
  while (!source.staysFiniteIn(frame) && std::isnormal(frame.scale)) frame.scale *= 0x1p-32;
  return frame;
}

}  // namespace fcl_fibers::index
