// SPDX-License-Identifier: BSD-3-Clause
#include "tree.h"

#include <algorithm>
#include <string>
#include <type_traits>
#include <utility>

namespace fcl_fibers::python {
namespace {

/// Contacts that are computed between two looks at signals.
constexpr std::size_t kContactsAtOnce = std::size_t{1} << 18;

py::dtype contactType() {
  const std::size_t a = offsetof(Contact, a), b = offsetof(Contact, b);
  const std::size_t fiber = offsetof(FiberSegment, fiber),
                    segment = offsetof(FiberSegment, segment);
  return structType<Contact>({{"fiber_a", "i8", a + fiber},
                              {"segment_a", "i8", a + segment},
                              {"fiber_b", "i8", b + fiber},
                              {"segment_b", "i8", b + segment},
                              {"s", "f8", offsetof(Contact, s)},
                              {"t", "f8", offsetof(Contact, t)},
                              {"distance", "f8", offsetof(Contact, distance)},
                              {"point_a", "3f8", offsetof(Contact, point_a)},
                              {"point_b", "3f8", offsetof(Contact, point_b)},
                              {"normal", "3f8", offsetof(Contact, normal)}});
}

py::dtype meshContactType() {
  const std::size_t a = offsetof(MeshContact, a);
  return structType<MeshContact>({{"fiber", "i8", a + offsetof(FiberSegment, fiber)},
                                  {"segment", "i8", a + offsetof(FiberSegment, segment)},
                                  {"triangle", "i4", offsetof(MeshContact, triangle)},
                                  {"s", "f8", offsetof(MeshContact, s)},
                                  {"weights", "3f8", offsetof(MeshContact, weights)},
                                  {"distance", "f8", offsetof(MeshContact, distance)},
                                  {"solid", "?", offsetof(MeshContact, solid)},
                                  {"point_a", "3f8", offsetof(MeshContact, point_a)},
                                  {"point_b", "3f8", offsetof(MeshContact, point_b)},
                                  {"normal", "3f8", offsetof(MeshContact, normal)}});
}

py::dtype impactType() {
  return structType<Impact>({{"a", "i4", offsetof(Impact, pair) + offsetof(SegmentPair, a)},
                             {"b", "i4", offsetof(Impact, pair) + offsetof(SegmentPair, b)},
                             {"time", "f8", offsetof(Impact, time)},
                             {"s", "f8", offsetof(Impact, s)},
                             {"t", "f8", offsetof(Impact, t)}});
}

py::dtype meshImpactType() {
  const std::size_t pair = offsetof(MeshImpact, pair);
  return structType<MeshImpact>({{"segment", "i4", pair + offsetof(TrianglePair, segment)},
                                 {"triangle", "i4", pair + offsetof(TrianglePair, triangle)},
                                 {"time", "f8", offsetof(MeshImpact, time)}});
}

static_assert(sizeof(SegmentPair) == 2 * sizeof(std::int32_t) &&
              sizeof(TrianglePair) == 2 * sizeof(std::int32_t));

template <class Pair>
py::array toPairs(std::vector<Pair>&& pairs) {
  return toArray(std::move(pairs), py::dtype::of<std::int32_t>(), 2);
}

py::array toSegments(std::vector<std::int32_t>&& segments) {
  return toArray(std::move(segments), py::dtype::of<std::int32_t>());
}

/// Returns the structs of an array that a query returned.
template <typename Struct>
std::vector<Struct> fromArray(const py::array& array, const py::dtype& type) {
  if (!array.dtype().equal(type) || array.ndim() != 1 ||
      (array.flags() & py::array::c_style) == 0) {
    throw py::type_error("impacts are not an array that impacts() returned");
  }
  const auto* const begin = static_cast<const Struct*>(array.data());
  return std::vector<Struct>(begin, begin + array.size());
}

/// Returns the contacts of all pairs, which write(pairs, count, contacts) computes block by block.
template <class Found, class Pair, class Write>
Unwritten<Found> inBlocks(const std::vector<Pair>& pairs, Write&& write) try {
  Unwritten<Found> contacts(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); i += kContactsAtOnce) {
    const std::size_t count = std::min(kContactsAtOnce, pairs.size() - i);
    {
      const Unlocked unlocked;
      write(pairs.data() + i, count, contacts.data() + i);
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  return contacts;
} catch (const std::bad_alloc&) {
  throw TooMany(pairs.size());
}

/// Calls use(arrays of a, arrays of b), which have one scalar type.
template <class Use>
auto withBoth(const FiberNumbers& a, const FiberLayout& a_layout, const FiberNumbers& b,
              const FiberLayout& b_layout, Use&& use) {
  if (a.isFloat() && b.isFloat()) return use(a.view<float>(a_layout), b.view<float>(b_layout));
  const FiberNumbers a_doubles = a.asDouble(), b_doubles = b.asDouble();
  return use(a_doubles.view<double>(a_layout), b_doubles.view<double>(b_layout));
}

}  // namespace

FiberNumbers Tree::noFibers() {
  return {py::array_t<double>(std::vector<std::size_t>{0, 3}), py::array_t<double>(1), 0};
}

void Tree::build(FiberNumbers numbers, FiberLayout layout) {
  const Change change(users_);
  withArrays(numbers, layout, [&](const auto& fibers) {
    const Unlocked unlocked;
    tree_.build(fibers);
  });
  numbers_ = std::move(numbers);
  layout_ = std::move(layout);
  start_.reset();
}

void Tree::update(FiberNumbers numbers) {
  const Change change(users_);
  withArrays(numbers, layout_, [&](const auto& fibers) {
    const Unlocked unlocked;
    tree_.update(fibers);
  });
  numbers_ = std::move(numbers);
  start_.reset();
}

void Tree::update(FiberNumbers start, FiberNumbers end) {
  const Change change(users_);
  withBoth(start, layout_, end, layout_, [&](const auto& from, const auto& to) {
    const Unlocked unlocked;
    tree_.update(from, to);
  });
  numbers_ = std::move(end);
  start_ = std::move(start);
}

py::array Tree::offsets() const {
  return toArray(std::vector<std::int64_t>(layout_.begin.begin(), layout_.begin.end()),
                 py::dtype::of<std::int64_t>());
}

template <class Question, class Partner>
auto Tree::query(const Question& question, const Partner& partner) const {
  const Query own(users_);
  using Found = FoundBy<Question, Partner>;
  const auto visit = [&](auto&& take) { tree_.visit(question, partner, take); };
  if constexpr (!std::is_same_v<Found, SegmentPair>) {
    return collect<Found>(0, visit);
  } else {
    auto pairs = collect<SegmentPair>(pairs_before_, visit);
    pairs_before_ = pairs.size();
    return pairs;
  }
}

template <class Question>
auto Tree::query(const Question& question, const Tree* other) const {
  const Query others(partner(other).users_);
  return query(question, partner(other).tree_);
}

py::array Tree::pairs(const Tree* other) const { return toPairs(query(Touching{}, other)); }

py::array Tree::pairs(const TriangleMesh& mesh) const { return toPairs(query(Touching{}, mesh)); }

py::array Tree::movingPairs(const Tree* other) const {
  return toPairs(query(MovingPairs{}, other));
}

bool Tree::visitPairs(const py::function& visit, const Tree* other, std::size_t block) const {
  const Query own(users_);
  const Query others(partner(other).users_);
  std::vector<SegmentPair> pairs;
  Signals signals;
  bool failed = false;
  // An exception of Python stays set while C++ returns from the query.
  const auto hand = [&] {
    const Locked lock;
    try {
      const py::object result = visit(toPairs(std::exchange(pairs, {})));
      const int stop = PyObject_IsTrue(result.ptr());
      failed = stop < 0;
      return stop != 0;
    } catch (py::error_already_set& error) {
      error.restore();
      failed = true;
      return true;
    }
  };
  const auto take = [&](SegmentPair pair) {
    pairs.push_back(pair);
    if (signals.raised()) return true;
    return pairs.size() == block && hand();
  };
  bool ended = false;
  {
    const Unlocked unlocked;
    ended = tree_.visit(Touching{}, partner(other).tree_, take);
  }
  signals.rethrow();
  if (!ended && !pairs.empty()) ended = hand();
  if (failed) throw py::error_already_set();
  return ended;
}

py::array Tree::contacts(const Tree* other) const {
  const Query own(users_);
  const Query others(partner(other).users_);
  const auto pairs = query(Touching{}, other);
  return withBoth(numbers_, layout_, partner(other).numbers_, partner(other).layout_,
                  [&](const auto& a, const auto& b) {
                    const auto write = [&](const SegmentPair* some, std::size_t count,
                                           Contact* to) {
                      tree_.writeContacts(Contacts{a, &b}, partner(other).tree_, some, count, to);
                    };
                    return toArray(inBlocks<Contact>(pairs, write), contactType());
                  });
}

py::array Tree::contacts(const TriangleMesh& mesh) const {
  const Query own(users_);
  const auto pairs = query(Touching{}, mesh);
  return withArrays(numbers_, layout_, [&](const auto& fibers) {
    const auto write = [&](const TrianglePair* some, std::size_t count, MeshContact* to) {
      tree_.writeContacts(Contacts{fibers}, mesh, some, count, to);
    };
    return toArray(inBlocks<MeshContact>(pairs, write), meshContactType());
  });
}

py::array Tree::impacts(const Tree* other) const {
  return toArray(query(Impacts{}, other), impactType());
}

py::array Tree::impacts(const TriangleMesh& start, const TriangleMesh& end) const {
  return toArray(query(Impacts{}, MeshStep{start, end}), meshImpactType());
}

const FiberNumbers& Tree::startOfStep() const {
  if (start_) return *start_;
  throw py::value_error("the fibers rest; call update(start, end) before");
}

py::array Tree::impactContacts(const py::array& impacts, const Tree* other) const {
  const Query own(users_);
  const auto all = fromArray<Impact>(impacts, impactType());
  const FiberNumbers& start = startOfStep();
  const auto contactsOf = [&](auto&& contact) {
    return toArray(makeEach<Contact>(all, contact), contactType());
  };
  if (other == nullptr || other == this) {
    return withBoth(start, layout_, numbers_, layout_, [&](const auto& from, const auto& to) {
      return contactsOf([&](const Impact& impact) { return impactContact(from, to, impact); });
    });
  }
  const Query others(other->users_);
  // Four arrays of one type: doubles hold all floats.
  const FiberNumbers from_a = start.asDouble(), to_a = numbers_.asDouble(),
                     from_b = other->startOfStep().asDouble(), to_b = other->numbers_.asDouble();
  const auto a_start = from_a.view<double>(layout_), a_end = to_a.view<double>(layout_),
             b_start = from_b.view<double>(other->layout_),
             b_end = to_b.view<double>(other->layout_);
  return contactsOf(
      [&](const Impact& impact) { return impactContact(a_start, a_end, b_start, b_end, impact); });
}

py::array Tree::impactContacts(const py::array& impacts, const TriangleMesh& mesh_start,
                               const TriangleMesh& mesh_end) const {
  const Query own(users_);
  const auto all = fromArray<MeshImpact>(impacts, meshImpactType());
  const MeshStep mesh{mesh_start, mesh_end};
  return withBoth(startOfStep(), layout_, numbers_, layout_, [&](const auto& from, const auto& to) {
    return toArray(
        makeEach<MeshContact>(
            all, [&](const MeshImpact& impact) { return impactContact(from, to, mesh, impact); }),
        meshContactType());
  });
}

double Tree::safeStep(const Tree* other) const {
  const Query own(users_);
  const Query others(partner(other).users_);
  const Unlocked unlocked;
  return tree_.safeStep(partner(other).tree_);
}

double Tree::safeStep(const TriangleMesh& start, const TriangleMesh& end) const {
  const Query own(users_);
  const Unlocked unlocked;
  return tree_.safeStep(MeshStep{start, end});
}

py::array Tree::touching(const TriangleMesh& mesh) const {
  return toSegments(query(TouchingSegments{}, mesh));
}

py::array Tree::nearest(const TriangleMesh& mesh, double distance) const {
  return toPairs(query(Nearest{distance}, mesh));
}

py::array Tree::overlaps(const CapsuleShape& capsule) const {
  return toSegments(query(Touching{}, capsule));
}

py::array Tree::overlaps(const BoxShape& box) const { return toSegments(query(Touching{}, box)); }

py::array Tree::fiberSegments(const py::array& segments) const {
  const Query own(users_);
  const auto* const begin = requireArray<std::int32_t>("segments", segments);
  const std::vector<std::int32_t> all(begin, begin + segments.size());
  static_assert(sizeof(FiberSegment) == 2 * sizeof(std::int64_t));
  return toArray(makeEach<FiberSegment>(
                     all, [&](std::int32_t segment) { return tree_.fiberSegment(segment); }),
                 py::dtype::of<std::int64_t>(), 2);
}

py::tuple Tree::volumes(int depth) const {
  const Query own(users_);
  using Vector = std::array<double, 3>;
  std::vector<Vector> centers, halves;
  std::vector<std::int64_t> offsets = {0};
  std::vector<std::int32_t> segments;
  {
    const Unlocked unlocked;
    for (const TreeVolume& volume : tree_.volumes(depth)) {
      centers.push_back({volume.center[0], volume.center[1], volume.center[2]});
      halves.push_back({volume.half[0], volume.half[1], volume.half[2]});
      segments.insert(segments.end(), volume.segments, volume.segments + volume.segment_count);
      offsets.push_back(static_cast<std::int64_t>(segments.size()));
    }
  }
  const py::dtype number = py::dtype::of<double>();
  return py::make_tuple(
      toArray(std::move(centers), number, 3), toArray(std::move(halves), number, 3),
      toArray(std::move(offsets), py::dtype::of<std::int64_t>()), toSegments(std::move(segments)));
}

}  // namespace fcl_fibers::python
