// SPDX-License-Identifier: BSD-3-Clause
//
// Arrays that are null or do not fit each other: a tree takes them if and only if they are sound,
// and else is as it was; contacts of the tree's pairs are there in the arrays that it has, and
// those of other arrays or of any pair are refused or read within the arrays, and so are roots.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "fuzz_input.h"

namespace {

using fcl_fibers::FiberArrays;
using fcl_fibers::FiberTree;
using fcl_fibers::FiberTreeOptions;
using fcl_fibers::MeshArrays;
using fcl_fibers::Report;
using fcl_fibers::SegmentPair;
using fcl_fibers::TriangleMesh;
using fcl_fibers::TrianglePair;
using fcl_fibers::fuzz::isRefused;
using fcl_fibers::fuzz::readByte;
using fcl_fibers::fuzz::require;
using PairList = std::vector<std::pair<int, int>>;

/// Arrays on the heap of exactly the sizes that they say, so that a read beyond one is seen. Any of
/// them may be null, and point_begin and point_end may hold anything.
template <typename S>
class AnyArrays {
 public:
  explicit AnyArrays(FuzzedDataProvider& data) {
    view_.point_count = data.ConsumeIntegralInRange<std::size_t>(0, 6);
    view_.fiber_count = data.ConsumeIntegralInRange<std::size_t>(0, 3);
    view_.radii_are = data.PickValueInArray(
        {Radii::kOne, Radii::kPerFiber, Radii::kPerFirstPoint, Radii::kPerPoint});
    const std::size_t points = view_.point_count, fibers = view_.fiber_count;

    const bool tidy = data.ConsumeBool();
    view_.point_begin = fill(data, fibers + 1, point_begin_, [&] {
      return data.ConsumeIntegralInRange<std::size_t>(0, points + (tidy ? 0 : 2));
    });
    if (tidy && view_.point_begin != nullptr) {
      std::sort(point_begin_.get(), point_begin_.get() + fibers);
      point_begin_[0] = 0;
      point_begin_[fibers] = points;
    }
    if (data.ConsumeBool()) {
      view_.point_end = fill(data, fibers, point_end_, [&] {
        return data.ConsumeIntegralInRange<std::size_t>(0, points + (tidy ? 0 : 2));
      });
    }
    for (std::size_t f = 0; tidy && f < fibers && view_.point_end != nullptr; ++f) {
      if (view_.point_begin == nullptr) break;
      point_end_[f] = std::clamp(point_end_[f], point_begin_[f], point_begin_[f + 1]);
    }
    constexpr auto kSize = static_cast<std::ptrdiff_t>(sizeof(S));
    const auto columns = static_cast<std::ptrdiff_t>(points);
    const auto [point, axis] = data.PickValueInArray<std::pair<std::ptrdiff_t, std::ptrdiff_t>>(
        {{0, 0}, {4, 0}, {1, columns}, {-3, 1}, {3, -1}, {0, 1}});
    view_.point_stride = kSize * point;
    view_.axis_stride = kSize * axis;
    const std::ptrdiff_t step = point != 0 ? point : 3, last = points > 0 ? columns - 1 : 0;
    const std::ptrdiff_t across = axis != 0 ? 2 * axis : 2;
    const auto size = static_cast<std::size_t>(std::abs(step * last) + std::abs(across) + 1);
    view_.points = fill(data, points > 0 ? size : 0, points_,
                        [&] { return S(data.ConsumeIntegral<std::int8_t>()) / 16; });
    if (view_.points != nullptr && points > 0) {
      view_.points += std::max<std::ptrdiff_t>(0, -step * last);
      view_.points += std::max<std::ptrdiff_t>(0, -across);
    }
    if (readByte(data) == 1) ++view_.point_stride;
    view_.radii = fill(data, radiusCount(), radii_,
                       [&] { return S(data.ConsumeIntegral<std::uint8_t>()) / 64; });
    view_.closed = fill(data, fibers, closed_, [&] { return data.ConsumeBool(); });
    view_.groups = fill(data, fibers, groups_, [&] { return data.ConsumeIntegralInRange(0, 2); });
    const std::uint8_t features = readByte(data);
    if ((features & 1) != 0) {
      view_.meets = fill(data, fibers, meets_, [&] { return readByte(data); });
      view_.categories = fill(data, fibers, categories_, [&] { return readByte(data); });
    }
    if ((features & 2) != 0) {
      view_.root_segments = fill(data, fibers, roots_, [&] { return readByte(data) % 16 - 1; });
    }
    if ((features & 4) != 0) {
      const auto any = [&] { return readByte(data) % (static_cast<int>(points) + 3) - 2; };
      view_.starts_at = fill(data, fibers, starts_, any);
      view_.ends_at = fill(data, fibers, ends_, any);
    }
    // So that all points may be joined.
    if ((features & 8) != 0 && points_ != nullptr && points > 0) {
      std::fill_n(points_.get(), size, S(0));
    }
  }

  const FiberArrays<S>& view() const { return view_; }
  /// Begin and end of each fiber, and the number of points.
  std::vector<std::size_t> runs() const {
    std::vector<std::size_t> runs;
    if (view_.point_begin == nullptr) return runs;
    for (std::size_t f = 0; f < view_.fiber_count; ++f) {
      runs.push_back(view_.point_begin[f]);
      runs.push_back(view_.point_end != nullptr ? view_.point_end[f] : view_.point_begin[f + 1]);
    }
    runs.push_back(view_.point_begin[view_.fiber_count]);
    return runs;
  }

  bool isSound() const {
    const std::vector<std::size_t> runs = this->runs();
    constexpr auto kAlign = static_cast<std::ptrdiff_t>(alignof(S));
    return !runs.empty() && (view_.point_end != nullptr || view_.point_begin[0] == 0) &&
           runs.back() == view_.point_count && std::is_sorted(runs.begin(), runs.end()) &&
           view_.point_stride % kAlign == 0 &&
           (view_.point_stride != 0 || view_.axis_stride == 0) &&
           (view_.points != nullptr || view_.point_count == 0) &&
           (view_.radii != nullptr || radiusCount() == 0);
  }
  /// Where fibers start, and where they end; -1 if they do nowhere.
  std::vector<std::int32_t> joints() const {
    std::vector<std::int32_t> joints;
    for (const std::int32_t* at : {view_.starts_at, view_.ends_at}) {
      for (std::size_t f = 0; f < view_.fiber_count; ++f) {
        joints.push_back(at != nullptr ? at[f] : -1);
      }
    }
    return joints;
  }
  /// Whether the fibers may have these joints, which are those of an array or of the last build.
  /// @pre isSound()
  bool maySoundlyHave(const std::vector<std::int32_t>& joints) const {
    const std::size_t fibers = view_.fiber_count;
    const std::vector<std::size_t> runs = this->runs();
    for (std::size_t i = 0; i < joints.size(); ++i) {
      const std::size_t f = i % fibers, begin = runs[2 * f], end = runs[2 * f + 1];
      if (joints[i] == -1) continue;
      const auto point = static_cast<std::size_t>(joints[i]);
      std::size_t g = 0;
      while (g < fibers && (point < runs[2 * g] || point >= runs[2 * g + 1])) ++g;
      const std::size_t own = i < fibers ? begin : end - 1;
      if (joints[i] < 0 || g == fibers || begin == end || point == own || !areEqual(point, own)) {
        return false;
      }
    }
    return true;
  }
  /// Whether an update may have these arrays after a build with these joints.
  bool fitsJoints(const std::vector<std::int32_t>& built) const {
    const std::vector<std::int32_t> own = joints();
    for (std::size_t i = 0; i < own.size(); ++i) {
      const bool is_given =
          i < view_.fiber_count ? view_.starts_at != nullptr : view_.ends_at != nullptr;
      if (is_given && own[i] != built[i]) return false;
    }
    return maySoundlyHave(built);
  }
  /// An update does not read them.
  bool hasSoundRoots() const {
    return view_.root_segments == nullptr ||
           std::all_of(view_.root_segments, view_.root_segments + view_.fiber_count,
                       [](std::int32_t count) { return count >= 0; });
  }

 private:
  using Radii = typename FiberArrays<S>::Radii;

  std::size_t radiusCount() const {
    if (view_.radii_are == Radii::kPerFiber) return view_.fiber_count;
    return view_.radii_are != Radii::kOne ? view_.point_count : view_.point_count > 0;
  }
  bool areEqual(std::size_t p, std::size_t q) const {
    constexpr auto kSize = static_cast<std::ptrdiff_t>(sizeof(S));
    const std::ptrdiff_t point = view_.point_stride != 0 ? view_.point_stride / kSize : 3;
    const std::ptrdiff_t axis = view_.axis_stride != 0 ? view_.axis_stride / kSize : 1;
    for (std::ptrdiff_t k = 0; k < 3; ++k) {
      const auto at = [&](std::size_t i) {
        return view_.points[static_cast<std::ptrdiff_t>(i) * point + k * axis];
      };
      if (!(at(p) == at(q))) return false;
    }
    return true;
  }

  template <typename T, typename Next>
  static const T* fill(FuzzedDataProvider& data, std::size_t size, std::unique_ptr<T[]>& array,
                       Next&& next) {
    if (data.ConsumeIntegralInRange(0, 3) == 1) return nullptr;
    array.reset(new T[size]);
    std::generate_n(array.get(), size, next);
    return array.get();
  }

  std::unique_ptr<S[]> points_, radii_;
  std::unique_ptr<std::size_t[]> point_begin_, point_end_;
  std::unique_ptr<std::uint8_t[]> closed_;
  std::unique_ptr<std::int32_t[]> groups_, roots_, starts_, ends_;
  std::unique_ptr<std::uint32_t[]> meets_, categories_;
  FiberArrays<S> view_;
};

PairList pairsOf(const FiberTree& tree) {
  PairList pairs;
  tree.visit(fcl_fibers::Pairs{}, [&](SegmentPair pair) { pairs.emplace_back(pair.a, pair.b); });
  return pairs;
}

template <typename S>
void fuzz(FuzzedDataProvider& data) {
  FiberTreeOptions options;
  options.ignored_neighbors = data.ConsumeIntegralInRange(0, 1);
  options.ignored_arc_length = data.ConsumeBool() ? 0.5 : 0;
  options.report = (readByte(data) & 1) != 0 ? Report::kCapsules : Report::kVolumes;
  FiberTree tree(options);
  std::vector<std::size_t> built = {0};  // runs()
  std::vector<std::int32_t> joined;      // joints()
  while (data.remaining_bytes() > 0) {
    const AnyArrays<S> arrays(data);
    const FiberArrays<S>& view = arrays.view();
    const PairList before = pairsOf(tree);
    const bool updates = data.ConsumeBool();
    const bool refused = isRefused([&] { updates ? tree.update(view) : tree.build(view); });
    require(refused !=
            (arrays.isSound() &&
             (updates ? arrays.runs() == built && arrays.fitsJoints(joined)
                      : arrays.hasSoundRoots() && arrays.maySoundlyHave(arrays.joints()))));
    if (!refused) built = arrays.runs();
    if (!refused && !updates) joined = arrays.joints();
    const PairList after = pairsOf(tree);
    require(!refused || after == before);
    for (const auto& pair : after) {
      require(!isRefused([&] { capsuleContact(view, {pair.first, pair.second}); }) || refused);
    }
    const SegmentPair any{data.ConsumeIntegralInRange(-2, 9), data.ConsumeIntegralInRange(-2, 9)};
    isRefused([&] { capsuleContact(view, any); });
    isRefused([&] { tree.fiberSegment(any.a); });
    const double length = readByte(data) / 16.0;
    std::vector<std::int32_t> roots;
    if (isRefused([&] { roots = fcl_fibers::rootSegments(view, length); })) continue;
    require(roots.size() == view.fiber_count);
    if (refused || options.report == Report::kVolumes) continue;
    const double points[] = {-1, -1, 0, 1, -1, 0, 0, 2, 0};
    const std::int32_t triangle[] = {0, 1, 2};
    TriangleMesh mesh(MeshArrays<double>{points, 3, triangle, 1});
    mesh.setCategories(readByte(data));
    mesh.setMeets(readByte(data));
    tree.visit(fcl_fibers::Pairs{}, mesh,
               [&](TrianglePair pair) { fcl_fibers::meshContact(view, mesh, pair); });
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  FuzzedDataProvider data(bytes, size);
  data.ConsumeBool() ? fuzz<float>(data) : fuzz<double>(data);
  return 0;
}
