// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/new_objects.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <mutex>

namespace fcl_fibers::broadphase {
namespace {

using geometry::Frame;
using geometry::Segment;

/// Whether the two share an end point, within 4 ulp of the largest coordinate.
template <typename S>
bool shareEnd(const Segment& p, const Segment& q) {
  constexpr double kTolerance = 4 * double{std::numeric_limits<S>::epsilon()};
  // Most capsules begin where the one before ends, which takes the shortest test.
  if (maxNorm(q.a - p.b) <= kTolerance * maxNorm(q.a)) return true;
  const double largest = std::max({maxNorm(p.a), maxNorm(p.b), maxNorm(q.a), maxNorm(q.b)});
  const double tolerance = kTolerance * largest;
  for (const auto& end : {p.a, p.b}) {
    if (maxNorm(end - q.a) <= tolerance || maxNorm(end - q.b) <= tolerance) return true;
  }
  return false;
}

}  // namespace

template <typename S>
NewObjects<S>::NewObjects(const char* call, const std::vector<Object*>& objects,
                          const FiberManagerOptions& options)
    : starts_fiber(objects.size()),
      lengths(options.ignored_arc_length > 0 ? objects.size() : 0),
      call_(call),
      objects_(objects),
      bounds_(options.bounds == Bounds::kObjects ? Bounds::kObjects : Bounds::kShapes) {}

template <typename S>
void NewObjects<S>::read(bool is_fiber, const Segment* before, parallel::Executor* executor) {
  if (is_fiber && !objects_.empty()) starts_fiber[0] = 1;
  // A task takes some hundredths of a millisecond.
  constexpr std::size_t kRange = 512;
  if (executor == nullptr || objects_.size() <= kRange) {
    return readRange(0, objects_.size(), is_fiber, before, others);
  }
  std::mutex mutex;  // of `others` and what is below
  std::exception_ptr error;
  std::size_t refused = objects_.size();  // where the first range begins that has an error
  parallel::forRanges(executor, objects_.size(), kRange, [&](std::size_t begin, std::size_t end) {
    std::vector<std::size_t> others_here;
    std::exception_ptr error_here;
    try {
      std::optional<Segment> capsule;
      if (begin > 0 && !is_fiber) capsule = capsuleAt(begin - 1);
      readRange(begin, end, is_fiber,
                begin == 0 ? before
                : capsule  ? &*capsule
                           : nullptr,
                others_here);
    } catch (...) {
      error_here = std::current_exception();
    }
    const std::lock_guard<std::mutex> lock(mutex);
    others.insert(others.end(), others_here.begin(), others_here.end());
    if (error_here == nullptr || refused < begin) return;
    refused = begin;
    error = error_here;
  });
  if (error != nullptr) std::rethrow_exception(error);
  std::sort(others.begin(), others.end());
}

/// One that was read by another range, or will be refused there.
template <typename S>
std::optional<Segment> NewObjects<S>::capsuleAt(std::size_t place) const {
  const Object* object = objects_[place];
  if (object == nullptr || kindOf(*object) != ObjectKind::kCapsule) return std::nullopt;
  return readNew(call_, objects_, place, Bounds::kShapes);
}

template <typename S>
void NewObjects<S>::readRange(std::size_t begin, std::size_t end, bool is_fiber,
                              const Segment* before, std::vector<std::size_t>& others_here) {
  // The last two, in turn, because to copy one waits for its numbers to be written.
  Segment read[2];
  const Segment* previous = before;
  for (std::size_t i = begin; i < end; ++i) {
    prefetchObject<S>([&](std::size_t k) { return objects_[k]; }, i, end);
    Segment& segment = read[i % 2];
    readNew(call_, objects_, i, bounds_, segment);
    const ObjectKind kind = kindOf(*objects_[i]);
    // If its box counts instead, there are no end points to compare, and nobody has checked the
    // length.
    if (bounds_ == Bounds::kObjects && mayBeInFiber(kind)) {
      readNew(call_, objects_, i, Bounds::kShapes, segment);
    }
    if (!isRound(kind)) others_here.push_back(i);
    if (!lengths.empty()) lengths[i] = lengthInFiber(*objects_[i]);
    if (!is_fiber) {
      const bool is_capsule = kind == ObjectKind::kCapsule;
      starts_fiber[i] = !(is_capsule && previous != nullptr && shareEnd<S>(*previous, segment));
      previous = is_capsule ? &segment : nullptr;
    } else if (!mayBeInFiber(kind)) {
      fibers::throwInvalidArgument(
          call_, nameOf(i) + " is not a capsule, cylinder or box; register it by registerObject()");
    }
  }
  if (end == objects_.size() && !is_fiber && previous != nullptr) last = *previous;
}

template class NewObjects<float>;
template class NewObjects<double>;

}  // namespace fcl_fibers::broadphase
