// SPDX-License-Identifier: BSD-3-Clause
//
// The same fibers in arrays of other layouts: apart in memory, and with points of no fiber.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/array_fibers.h"
#include "arrays/meshes.h"
#include "arrays/motion.h"
#include "support/scalars.h"

namespace fcl_fibers {
namespace {

using test::Assembly;
using test::Motion;
using test::PairList;
using test::pairsOf;
using test::Random;

struct Strides {
  std::ptrdiff_t point, axis;  ///< in scalars; 0 as in FiberArrays
};

/// Points in memory of just the size that they need, and NaN wherever no point of a fiber is.
template <typename S>
struct Spread {
  std::vector<S> memory;
  const S* points = nullptr;

  Spread() = default;
  /// @param count  of all points
  Spread(Strides strides, std::size_t count) {
    const std::ptrdiff_t point = strides.point != 0 ? strides.point : 3;
    const std::ptrdiff_t axis = strides.axis != 0 ? strides.axis : 1;
    const auto last = static_cast<std::ptrdiff_t>(count) - 1;
    const std::ptrdiff_t low =
        std::min<std::ptrdiff_t>(0, point * last) + std::min<std::ptrdiff_t>(0, 2 * axis);
    const std::ptrdiff_t high =
        std::max<std::ptrdiff_t>(0, point * last) + std::max<std::ptrdiff_t>(0, 2 * axis);
    memory.assign(static_cast<std::size_t>(high - low + 1), std::numeric_limits<S>::quiet_NaN());
    point_ = point;
    axis_ = axis;
    points = memory.data() - low;
  }
  void set(std::size_t i, const S* from) {
    for (std::ptrdiff_t k = 0; k < 3; ++k) {
      const_cast<S*>(points)[static_cast<std::ptrdiff_t>(i) * point_ + k * axis_] = from[k];
    }
  }

 private:
  std::ptrdiff_t point_ = 3, axis_ = 1;
};

/// Fibers in another layout, and where their points are in it.
template <typename S>
class Relaid {
 public:
  /// @param gaps  before the first fiber and behind each
  Relaid(const Assembly<S>& fibers, Strides strides, const std::vector<std::size_t>& gaps)
      : radii_are_(fibers.radii_are), strides_(strides) {
    std::size_t next = gaps[0];
    for (std::size_t f = 0; f < fibers.fiberCount(); ++f) {
      begin_.push_back(next);
      for (std::size_t i = fibers.point_begin[f]; i < fibers.point_begin[f + 1]; ++i) {
        place_.push_back(static_cast<std::int32_t>(next++));
      }
      end_.push_back(next);
      next += gaps[f + 1];
    }
    begin_.push_back(next);
    has_gaps_ = next > fibers.pointCount();
    if (strides_.point == kColumns.point && strides_.axis == kColumns.axis) {
      strides_ = {1, static_cast<std::ptrdiff_t>(std::max<std::size_t>(next, 1))};
    }
    spread_ = Spread<S>(strides_, std::max<std::size_t>(next, 1));
    for (std::size_t i = 0; i < place_.size(); ++i) {
      spread_.set(static_cast<std::size_t>(place_[i]), &fibers.points[3 * i]);
    }
    if (radii_are_ != Radii::kPerFirstPoint) {
      radii_ = fibers.radii;
      return;
    }
    radii_.assign(next, std::numeric_limits<S>::quiet_NaN());
    fibers.visitCapsules([&](std::size_t, std::size_t i) {
      radii_[static_cast<std::size_t>(place_[i])] = fibers.radii[i];
    });
  }

  /// All x, then all y, then all z: the second stride is the number of points.
  static constexpr Strides kColumns{1, 0};

  FiberArrays<S> view() const {
    constexpr auto kSize = static_cast<std::ptrdiff_t>(sizeof(S));
    FiberArrays<S> view;
    view.points = spread_.points;
    view.point_count = begin_.back();
    view.point_begin = begin_.data();
    view.fiber_count = end_.size();
    view.radii = radii_.data();
    view.radii_are = radii_are_;
    view.point_stride = kSize * strides_.point;
    view.axis_stride = kSize * strides_.axis;
    if (has_gaps_) view.point_end = end_.data();
    return view;
  }
  std::int32_t place(std::int32_t point) const { return place_[static_cast<std::size_t>(point)]; }

 private:
  using Radii = typename Assembly<S>::Radii;
  Radii radii_are_;
  Strides strides_;
  Spread<S> spread_;
  std::vector<std::size_t> begin_, end_;
  std::vector<std::int32_t> place_;
  std::vector<S> radii_;
  bool has_gaps_ = false;
};

const std::vector<Strides> kStrides = {{0, 0}, {3, 1},  {4, 0},  {4, 1},   Relaid<double>::kColumns,
                                       {5, 2}, {-3, 1}, {3, -1}, {-7, -2}, {9, 3}};

std::vector<std::size_t> randomGaps(Random& random, std::size_t fibers) {
  std::vector<std::size_t> gaps(fibers + 1);
  for (std::size_t& gap : gaps) gap = random.below(4);
  return gaps;
}

/// A hash tells apart the layouts, so it is left out.
template <class Record>
auto numbersOf(const Record& c) {
  if constexpr (std::is_same_v<Record, Contact>) {
    return std::tuple(c.a.fiber, c.a.number, c.b.fiber, c.b.number, c.s, c.t, c.distance, c.normal,
                      c.point_a, c.point_b);
  } else {
    return std::tuple(c.distance, c.normal, c.weights, c.triangle);
  }
}

template <typename S>
class ArrayLayouts : public ::testing::Test {};
TYPED_TEST_SUITE(ArrayLayouts, test::Scalars, test::ScalarName);

// Numbers would be read from elsewhere, a point of no fiber would count, or a capsule would have
// another's name.
TYPED_TEST(ArrayLayouts, TheSameFibersHaveTheSameAnswers) {
  using S = TypeParam;
  using Radii = typename Assembly<S>::Radii;
  auto motion = Motion<S>::random(31, 50, 0.2);
  motion.closeAndGroup();
  const auto soup = test::soup<S>(32, 60, 0.4);
  const TriangleMesh mesh(soup.view());
  Random random(33);
  for (std::size_t round = 0; round < 2 * kStrides.size(); ++round) {
    const Strides strides = kStrides[round % kStrides.size()];
    const bool has_gaps = round >= kStrides.size() || round % 3 == 1;
    SCOPED_TRACE(testing::Message() << round << ": " << strides.point << ' ' << strides.axis);
    const Radii radii_are = round % 3 == 0   ? Radii::kPerFirstPoint
                            : round % 3 == 1 ? Radii::kPerFiber
                                             : Radii::kOne;
    motion.start.radii_are = motion.end.radii_are = radii_are;
    const std::vector<std::size_t> none(motion.start.fiberCount() + 1, 0);
    const auto gaps = has_gaps ? randomGaps(random, motion.start.fiberCount()) : none;
    Relaid<S> start(motion.start, strides, gaps), end(motion.end, strides, gaps);
    const auto given = [&](FiberArrays<S> view) {
      view.closed = motion.closed.data();
      view.groups = motion.groups.data();
      return view;
    };

    FiberTreeOptions options;
    options.report = Report::kCapsules;
    options.ignored_neighbors = round % 2 == 0 ? 2 : 0;
    options.ignored_arc_length = round % 2 == 0 ? 0 : 0.15;
    FiberTree plain(options), tree(options);
    plain.build(given(motion.start.view()));
    tree.build(given(start.view()));
    const auto expectSame = [&](const Assembly<S>& fibers, const Relaid<S>& relaid) {
      PairList expected = pairsOf(plain);
      EXPECT_GT(expected.size(), 20u);
      for (auto& [a, b] : expected) a = relaid.place(a), b = relaid.place(b);
      EXPECT_EQ(pairsOf(tree), expected);
      for (const auto& [a, b] : expected) {
        const Contact contact = capsuleContact(relaid.view(), {a, b});
        EXPECT_EQ(tree.fiberSegment(a).fiber, contact.a.fiber);
        EXPECT_EQ(tree.fiberSegment(a).number, contact.a.number);
      }

      std::vector<Contact> contacts, contacts_expected;
      plain.find(Contacts<S>{fibers.view()}, contacts_expected);
      tree.find(Contacts<S>{relaid.view()}, contacts);
      ASSERT_EQ(contacts.size(), contacts_expected.size());
      for (std::size_t i = 0; i < contacts.size(); ++i) {
        EXPECT_EQ(numbersOf(contacts[i]), numbersOf(contacts_expected[i]));
        EXPECT_EQ(contacts[i].pair.a, relaid.place(contacts_expected[i].pair.a));
        EXPECT_EQ(contacts[i].layout == contacts_expected[i].layout, !has_gaps);
      }

      std::vector<MeshContact> with_mesh, with_mesh_expected;
      plain.find(Contacts<S>{fibers.view()}, mesh, with_mesh_expected);
      tree.find(Contacts<S>{relaid.view()}, mesh, with_mesh);
      ASSERT_EQ(with_mesh.size(), with_mesh_expected.size());
      EXPECT_GT(with_mesh.size(), 20u);
      for (std::size_t i = 0; i < with_mesh.size(); ++i) {
        EXPECT_EQ(numbersOf(with_mesh[i]), numbersOf(with_mesh_expected[i]));
        EXPECT_EQ(with_mesh[i].segment, relaid.place(with_mesh_expected[i].segment));
      }
      EXPECT_EQ(rootSegments(relaid.view(), 0.1), rootSegments(fibers.view(), 0.1));
    };
    expectSame(motion.start, start);
    plain.update(motion.end.view());
    tree.update(end.view());
    expectSame(motion.end, end);

    plain.update(motion.start.view(), motion.end.view());
    tree.update(start.view(), end.view());
    std::vector<Impact> impacts, expected;
    plain.find(Impacts{}, expected);
    tree.find(Impacts{}, impacts);
    ASSERT_EQ(impacts.size(), expected.size());
    EXPECT_GT(impacts.size(), 20u);
    for (std::size_t i = 0; i < impacts.size(); ++i) {
      EXPECT_EQ(impacts[i].pair.b, start.place(expected[i].pair.b));
      EXPECT_EQ(impacts[i].time, expected[i].time);
      EXPECT_EQ(numbersOf(impactContact(start.view(), end.view(), impacts[i])),
                numbersOf(impactContact(motion.start.view(), motion.end.view(), expected[i])));
    }
  }
}

// Corners would be read from elsewhere.
TYPED_TEST(ArrayLayouts, AMeshMayBeApartInMemory) {
  using S = TypeParam;
  const auto fibers = test::curledFibers<S>(41);
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 0;
  FiberTree tree(options);
  tree.build(fibers.view());
  const auto ball = test::ball<S>(0.3, 8, 12), larger = test::ball<S>(0.35, 8, 12);
  for (const Strides strides :
       {Strides{4, 0}, {-5, 2}, {1, static_cast<std::ptrdiff_t>(ball.pointCount())}}) {
    std::vector<std::vector<TrianglePair>> found;
    for (const bool is_apart : {false, true}) {
      Spread<S> memory(strides, ball.pointCount());
      const auto view = [&](const test::Triangles<S>& mesh) {
        MeshArrays<S> view = mesh.view();
        for (std::size_t i = 0; i < mesh.pointCount(); ++i) memory.set(i, &mesh.points[3 * i]);
        constexpr auto kSize = static_cast<std::ptrdiff_t>(sizeof(S));
        if (!is_apart) return view;
        view.points = memory.points;
        view.point_stride = kSize * strides.point;
        view.axis_stride = kSize * strides.axis;
        return view;
      };
      TriangleMesh mesh(view(ball), TriangleMesh::Kind::kSolid);
      tree.find(Pairs{}, mesh, found.emplace_back());
      mesh.update(view(larger));
      tree.find(Pairs{}, mesh, found.emplace_back());
    }
    const auto list = [](const std::vector<TrianglePair>& pairs) {
      std::vector<std::pair<std::int32_t, std::int32_t>> list;
      for (const TrianglePair& pair : pairs) list.emplace_back(pair.segment, pair.triangle);
      return list;
    };
    EXPECT_GT(found[0].size(), 20u);
    EXPECT_EQ(list(found[2]), list(found[0]));
    EXPECT_EQ(list(found[3]), list(found[1]));
    EXPECT_NE(list(found[0]), list(found[1]));
  }
}

auto refuses(const std::string& text) {
  return testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(text));
}

// Memory that is not the program's would be read, or a wrong answer given.
TYPED_TEST(ArrayLayouts, WrongLayoutsAreRefused) {
  using S = TypeParam;
  Assembly<S> fibers;
  fibers.addFiber({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, 0.1);
  fibers.addFiber({}, 0.1);
  fibers.addFiber({{0, 1, 0}, {1, -1, 0}}, 0.1);
  const Relaid<S> good(fibers, {4, 1}, {2, 1, 3, 2});
  FiberTreeOptions options;
  options.report = Report::kCapsules;
  options.ignored_neighbors = 1;
  FiberTree tree(options);
  tree.build(good.view());
  const PairList pairs = pairsOf(tree);
  ASSERT_EQ(pairs, (PairList{{2, 9}}));

  const auto expectRefused = [&](const FiberArrays<S>& bad, const std::string& text) {
    FiberTree other(options);
    EXPECT_THAT([&] { other.build(bad); }, refuses("FiberTree::build: " + text));
    EXPECT_THAT([&] { tree.update(bad); }, refuses("FiberTree::update: " + text));
    EXPECT_THAT([&] { rootSegments(bad, 1); }, refuses("rootSegments: " + text));
    EXPECT_EQ(pairsOf(tree), pairs);
  };
  FiberArrays<S> bad = good.view();
  ++bad.point_stride;
  expectRefused(bad,
                "point_stride is " + std::to_string(4 * sizeof(S) + 1) + " bytes; give a multiple");
  EXPECT_THAT([&] { capsuleContact(bad, {2, 9}); }, refuses("point_stride is"));
  bad = good.view();
  bad.axis_stride = -2;
  expectRefused(bad, "axis_stride is -2 bytes; give a multiple");
  bad = good.view();
  bad.point_stride = 0;
  expectRefused(bad, "axis_stride is given without point_stride");
  bad = good.view();
  bad.points = reinterpret_cast<const S*>(reinterpret_cast<const char*>(bad.points) + 2);
  expectRefused(bad, "points are not aligned");

  std::vector<std::size_t> end(good.view().point_end, good.view().point_end + 3);
  ASSERT_THAT(end, testing::ElementsAre(5, 6, 11));
  bad = good.view();
  bad.point_end = end.data();
  for (const auto& [f, wrong, text] :
       {std::tuple<std::size_t, std::size_t, const char*>{
            0, 1, "point_end of fiber 0 is 1; give a number from 2, where the fiber begins, to 6"},
        {0, 7, "point_end of fiber 0 is 7"},
        {2, 14, "point_end of fiber 2 is 14"},
        {1, std::size_t{0} - 1, "point_end of fiber 1 is 18446744073709551615"}}) {
    const std::size_t right = std::exchange(end[f], wrong);
    expectRefused(bad, text);
    capsuleContact(bad, {9, 9});  // is read within the arrays
    end[f] = right;
  }
  bad.point_end = nullptr;
  expectRefused(bad, "point_begin runs from 2 to 13; it has to run from 0 to 13");

  // Another number of points in a fiber, in the place of a point of none.
  end[0] = 4;
  bad.point_end = end.data();
  EXPECT_THAT([&] { tree.update(bad); }, refuses("other numbers of points"));
  EXPECT_THAT(
      [&] {
        std::vector<Contact> c;
        tree.find(Contacts<S>{bad}, c);
      },
      refuses("other numbers of points"));
  FiberTree shorter(options);
  shorter.build(bad);
  std::vector<Contact> contacts, others;
  tree.find(Contacts<S>{good.view()}, contacts);
  shorter.find(Contacts<S>{bad}, others);
  ASSERT_EQ(contacts.size(), 1u);
  ASSERT_EQ(others.size(), 1u);
  EXPECT_NE(contacts[0].layout, others[0].layout);

  for (const std::int32_t point : {-1, 0, 1, 4, 5, 6, 8, 10, 11, 12, 13}) {
    EXPECT_THAT([&] { tree.fiberSegment(point); }, refuses("no capsule starts at point"));
    EXPECT_THROW(capsuleContact(good.view(), {2, point}), std::invalid_argument) << point;
  }
  for (const std::int32_t point : {2, 3, 9}) {
    EXPECT_EQ(tree.fiberSegment(point).fiber, point == 9 ? 2u : 0u);
    capsuleContact(good.view(), {point, 9});
  }
}

// The point that is wrong would not be named.
TYPED_TEST(ArrayLayouts, APointThatIsNotFiniteIsNamed) {
  using S = TypeParam;
  for (const Strides strides : kStrides) {
    Assembly<S> fibers;
    for (int f = 0; f < 3; ++f) fibers.addFiber({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, 0.1);
    for (const S wrong :
         {std::numeric_limits<S>::infinity(), std::numeric_limits<S>::quiet_NaN()}) {
      for (const std::size_t number : {3 * 3 + 0UL, 3 * 4 + 1UL, 3 * 8 + 2UL}) {
        const Relaid<S> good(fibers, strides, {0, 0, 0, 0});
        FiberTree tree;
        tree.build(good.view());
        const S right = std::exchange(fibers.points[number], wrong);
        const Relaid<S> moved(fibers, strides, {0, 0, 0, 0});
        EXPECT_THAT([&] { tree.update(moved.view()); }, refuses("is NaN or infinite"));
        for (const std::vector<std::size_t>& gaps :
             {std::vector<std::size_t>{0, 0, 0, 0}, {2, 1, 3, 1}}) {
          const Relaid<S> bad(fibers, strides, gaps);
          const std::int32_t point = bad.place(static_cast<std::int32_t>(number / 3));
          EXPECT_THAT([&] { FiberTree().build(bad.view()); },
                      refuses("point " + std::to_string(point) + " is NaN or infinite"));
        }
        fibers.points[number] = right;
      }
    }
  }
}

// A tree of no fiber, or of none with a point, would read what is not there.
TEST(ArrayLayouts, AllPointsMayBeOfNoFiber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double points[] = {nan, nan, nan, nan, nan, nan};
  const std::size_t begin[] = {2, 2}, end[] = {2};
  const double radius = 1;
  for (const std::size_t fibers : {0u, 1u}) {
    FiberArrays<double> arrays{points, 2, begin, fibers, &radius};
    arrays.point_end = end;
    FiberTree tree;
    tree.build(arrays);
    tree.update(arrays);
    EXPECT_TRUE(pairsOf(tree).empty());
    EXPECT_EQ(tree.segmentCount(), 0u);
    EXPECT_EQ(tree.fiberCount(), fibers);
    for (const std::int32_t point : {0, 1, 2}) {
      EXPECT_THAT([&] { tree.fiberSegment(point); }, refuses("no capsule starts at point"));
      EXPECT_THROW(capsuleContact(arrays, {point, point}), std::invalid_argument);
    }
  }
}

}  // namespace
}  // namespace fcl_fibers
