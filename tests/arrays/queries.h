// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/triangle_mesh.h>

#include "arrays/meshes.h"
#include "arrays/motion.h"

namespace fcl_fibers::test {

/// What a query hands out, in its order.
class Record {
 public:
  using Row = std::array<double, 5>;

  void operator()(SegmentPair pair) { add(pair.a, pair.b); }
  void operator()(TrianglePair pair) { add(pair.segment, pair.triangle); }
  void operator()(const Impact& impact) {
    add(impact.pair.a, impact.pair.b, impact.time, impact.s, impact.t);
  }
  void operator()(const MeshImpact& impact) {
    add(impact.pair.segment, impact.pair.triangle, impact.time);
  }
  void operator()(const ShapeImpact& impact) { add(impact.segment, impact.time); }
  void operator()(const Contact& contact) {
    add(contact.a.fiber, contact.a.number, contact.b.fiber, contact.b.number, contact.distance);
  }
  void operator()(const MeshContact& contact) {
    add(contact.place.fiber, contact.place.number, contact.triangle, contact.s, contact.distance);
  }
  void operator()(const ShapeContact& contact) {
    add(contact.place.fiber, contact.place.number, contact.s, contact.distance);
  }
  void operator()(std::int32_t segment) { add(segment); }
  template <class Found>
  void addAll(const std::vector<Found>& all) {
    for (const Found& found : all) (*this)(found);
  }
  void add(const Record& other) {
    rows_.insert(rows_.end(), other.rows_.begin(), other.rows_.end());
  }
  template <typename... Numbers>
  void add(Numbers... numbers) {
    rows_.push_back({static_cast<double>(numbers)...});
  }

  std::size_t size() const { return rows_.size(); }
  Record sorted() const {
    Record record = *this;
    std::sort(record.rows_.begin(), record.rows_.end());
    return record;
  }
  bool operator==(const Record& other) const { return rows_ == other.rows_; }
  /// Whether the numbers are equal, up to the digits of times that the library leaves open.
  bool is(const Record& other) const {
    const auto near = [](double a, double b) { return std::abs(a - b) < 1e-8; };
    return std::equal(rows_.begin(), rows_.end(), other.rows_.begin(), other.rows_.end(),
                      [&](const Row& a, const Row& b) {
                        return std::equal(a.begin(), a.end(), b.begin(), near);
                      });
  }

 private:
  std::vector<Row> rows_;
};

/// What queries are asked of.
struct Asked {
  const FiberTree& tree;
  const FiberTree& other;
  FiberArrays<double> fibers;  ///< those of the tree, at the end of its step
};

struct TreeQuery {
  const char* name;
  std::function<void(const Asked&, Record&)> ask;
};

/// One of every kind that any tree has.
inline std::vector<TreeQuery> volumeQueries() {
  using A = const Asked&;
  using R = Record&;
  return {
      {"visit(Pairs)", [](A asked, R record) { asked.tree.visit(Pairs{}, record); }},
      {"visit(Pairs, other)",
       [](A asked, R record) { asked.tree.visit(Pairs{}, asked.other, record); }},
      {"the other's visit(Pairs, tree)",
       [](A asked, R record) { asked.other.visit(Pairs{}, asked.tree, record); }},
      {"find(Pairs)",
       [](A asked, R record) {
         std::vector<SegmentPair> pairs;
         asked.tree.find(Pairs{}, pairs);
         record.addAll(pairs);
       }},
      {"volumes",
       [](A asked, R record) {
         for (const TreeVolume& volume : asked.tree.volumes(5)) {
           const FiberSegment first = asked.tree.fiberSegment(volume.segments[0]);
           record.add(first.fiber, first.number, volume.segment_count);
         }
         record.add(asked.tree.fiberCount(), asked.tree.segmentCount(),
                    asked.tree.memoryUsage() > 0);
       }},
      {"visit(Pairs, capsule)",
       [](A asked, R record) {
         asked.tree.visit(Pairs{}, CapsuleShape{{-0.2, 0, 0}, {0.2, 0.1, 0}, 0.1}, record);
       }},
      {"visit(Pairs, box)",
       [](A asked, R record) {
         asked.tree.visit(Pairs{}, BoxShape{{-0.2, 0, 0}, {0.2, 0.1, 0.1}}, record);
       }},
      {"visit(Pairs, half-space)",
       [](A asked, R record) {
         asked.tree.visit(Pairs{}, HalfSpaceShape{{0.3, 0.1, 1}, 0.01}, record);
       }},
  };
}

/// Of the mesh in the queries: it has about 3 * rings^2 triangles.
constexpr int kFewRings = 16;

/// And of every kind that needs capsules. Those with a mesh share it.
inline std::vector<TreeQuery> capsuleQueries(int rings = kFewRings) {
  using A = const Asked&;
  using R = Record&;
  const TriangleMesh mesh(ball<double>(0.3, rings, 3 * rings / 2).view(),
                          TriangleMesh::Kind::kSolid);
  return {
      {"visit(Pairs, mesh)",
       [mesh](A asked, R record) { asked.tree.visit(Pairs{}, mesh, record); }},
      {"find(TouchingSegments, mesh)",
       [mesh](A asked, R record) {
         std::vector<std::int32_t> segments;
         asked.tree.find(TouchingSegments{}, mesh, segments);
         record.addAll(segments);
       }},
      {"find(Nearest, mesh)",
       [mesh](A asked, R record) {
         std::vector<TrianglePair> pairs;
         asked.tree.find(Nearest{0.1}, mesh, pairs);
         record.addAll(pairs);
       }},
      {"find(Nearest) and find(Nearest, other)",
       [](A asked, R record) {
         std::vector<SegmentPair> pairs;
         asked.tree.find(Nearest{0.1}, pairs);
         record.addAll(pairs);
         asked.tree.find(Nearest{0.1}, asked.other, pairs);
         record.addAll(pairs);
       }},
      {"find(Contacts) and closest",
       [](A asked, R record) {
         std::vector<Contact> contacts;
         asked.tree.find(Contacts{asked.fibers}, contacts);
         record.addAll(contacts);
         record(asked.tree.closest(Contacts{asked.fibers}));
       }},
      {"find(Contacts, mesh) and closest(mesh)",
       [mesh](A asked, R record) {
         std::vector<MeshContact> contacts;
         asked.tree.find(Contacts{asked.fibers}, mesh, contacts);
         record.addAll(contacts);
         record(asked.tree.closest(Contacts{asked.fibers}, mesh));
       }},
      {"find(Contacts, box)",
       [](A asked, R record) {
         std::vector<ShapeContact> contacts;
         asked.tree.find(Contacts{asked.fibers}, BoxShape{{-0.2, 0, 0}, {0.2, 0.1, 0.1}}, contacts);
         record.addAll(contacts);
       }},
      {"writeContacts",
       [](A asked, R record) {
         std::vector<SegmentPair> pairs;
         asked.tree.find(Pairs{}, pairs);
         std::vector<Contact> contacts(pairs.size());
         asked.tree.writeContacts(Contacts{asked.fibers}, asked.tree, pairs.data(), pairs.size(),
                                  contacts.data());
         record.addAll(contacts);
       }},
      {"writeContacts(mesh)",
       [mesh](A asked, R record) {
         std::vector<TrianglePair> pairs;
         asked.tree.find(Nearest{0.1}, mesh, pairs);
         std::vector<MeshContact> contacts(pairs.size());
         asked.tree.writeContacts(Contacts{asked.fibers}, mesh, pairs.data(), pairs.size(),
                                  contacts.data());
         record.addAll(contacts);
       }},
  };
}

/// And of every kind that asks about a step. Those with a mesh share it.
inline std::vector<TreeQuery> stepQueries(int rings = kFewRings) {
  using A = const Asked&;
  using R = Record&;
  const TriangleMesh start(ball<double>(0.3, rings, 3 * rings / 2).view(),
                           TriangleMesh::Kind::kSolid);
  TriangleMesh end = start;
  end.setPose({{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.1, 0, 0.05}});
  return {
      {"visit(MovingPairs)", [](A asked, R record) { asked.tree.visit(MovingPairs{}, record); }},
      {"visit(MovingPairs, other)",
       [](A asked, R record) { asked.tree.visit(MovingPairs{}, asked.other, record); }},
      {"visit(Impacts) and safeStep",
       [](A asked, R record) {
         asked.tree.visit(Impacts{}, record);
         record.add(asked.tree.safeStep());
       }},
      {"visit(Impacts, other) and safeStep(other)",
       [](A asked, R record) {
         asked.tree.visit(Impacts{}, asked.other, record);
         record.add(asked.tree.safeStep(asked.other));
       }},
      {"visit(Impacts, mesh) and safeStep(mesh)",
       [start, end](A asked, R record) {
         asked.tree.visit(Impacts{}, MeshStep{start, end}, record);
         record.add(asked.tree.safeStep(MeshStep{start, end}));
       }},
      {"visit(Impacts, shape) and safeStep(shape)",
       [](A asked, R record) {
         for (const Shape& shape : std::initializer_list<Shape>{
                  BoxShape{{-0.2, 0, 0}, {0.2, 0.1, 0.1}}, PlaneShape{{0.3, 0.1, 1}, 0.01},
                  SphereShape{{0.1, 0, 0}, 0.1}}) {
           asked.tree.visit(Impacts{}, shape, record);
           record.add(asked.tree.safeStep(shape));
         }
       }},
      {"find(Impacts)",
       [](A asked, R record) {
         std::vector<Impact> impacts;
         asked.tree.find(Impacts{}, impacts);
         record.addAll(impacts);
       }},
  };
}

/// Every query that trees with these options answer. Trees of boxes have to have had a step.
inline std::vector<TreeQuery> allQueries(const FiberTreeOptions& options, int rings = kFewRings) {
  std::vector<TreeQuery> queries = volumeQueries();
  const auto add = [&](std::vector<TreeQuery> more) {
    std::move(more.begin(), more.end(), std::back_inserter(queries));
  };
  if (options.report != Report::kCapsules) return queries;
  add(capsuleQueries(rings));
  if (options.volumes == FiberTreeOptions::Volumes::kLayeredBoxes) add(stepQueries(rings));
  return queries;
}

/// A tree of any kind, with a step if it can have one.
inline FiberTree steppedTree(const Motion<double>& motion, const FiberTreeOptions& options) {
  FiberTree tree(options);
  tree.build(motion.viewOf(motion.end));
  if (options.volumes == FiberTreeOptions::Volumes::kLayeredBoxes) {
    tree.update(motion.viewOf(motion.start), motion.viewOf(motion.end));
  }
  return tree;
}

}  // namespace fcl_fibers::test
