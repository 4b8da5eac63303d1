// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <algorithm>
#include <string>
#include <utility>

#include <fcl_fibers/contact.h>

#include "arrays/array_source.h"
#include "arrays/fiber_index.h"
#include "arrays/located_segment.h"
#include "arrays/pair_sinks.h"
#include "arrays/tree_volume.h"
#include "arrays/triangle_mesh.h"
#include "fibers/fiber_table.h"
#include "fibers/mesh_contacts.h"
#include "fibers/options.h"
#include "geometry/contact.h"
#include "index/moving_mesh.h"
#include "index/posed_triangles.h"
#include "index/segment_index.h"
#include "joined_text.h"
#include "tree/volumes.h"

namespace fcl_fibers {
namespace {

using arrays::PairsOfOne;
using arrays::PairsOfTwo;
using arrays::PairsTo;
using arrays::refuse;
using arrays::SegmentsOf;
using fibers::FiberTable;
using geometry::Frame;
using geometry::Segment;
using index::SegmentId;
using tree::Visit;

/// Contacts that one thread computes in a row.
constexpr std::size_t kContactsAtOnce = 512;

/// Makes what hands all that it takes to a visitor.
template <class Runs>
auto handTo(Runs& runs) {
  return [&runs](const auto* found, std::size_t count) { return runs.take(found, count); };
}

/// Makes what appends all that it takes.
template <class Found>
auto appendTo(std::vector<Found>& all) {
  return [&all](const Found* found, std::size_t count) {
    all.insert(all.end(), found, found + count);
    return false;
  };
}

}  // namespace

class FiberTree::Impl {
 public:
  explicit Impl(const FiberTreeOptions& options) : index_(options) {}

  arrays::FiberIndex& index() { return index_; }
  const arrays::FiberIndex& index() const { return index_; }
  std::size_t segmentCount() const { return index_->leaves().size(); }

  template <class F>
  bool visitPairs(F take) const {
    index_.requireValid("visitPairs");
    PairsTo sink(PairsOfOne(index_.table()), std::move(take));
    return index_->search(sink) == Visit::kStop;
  }

  template <class F>
  bool visitPairs(const Impl& other, F take) const {
    requirePartner("visitPairs", other.index_);
    PairsTo sink(PairsOfTwo<SegmentPair>(), std::move(take));
    return index_->search(*other.index_, nullptr, sink) == Visit::kStop;
  }

  // What calls a visitor takes copies of the meshes, because the visitor may change the originals.

  template <class F>
  bool visitMesh(const TriangleMesh mesh, F take) const {
    const index::PosedMesh posed = posedMesh("visitMesh", mesh);
    PairsTo sink(PairsOfTwo<TrianglePair>(), std::move(take));
    return index_->searchTriangles(posed, index_->options().margin, sink) == Visit::kStop;
  }

  void findTouching(const TriangleMesh& mesh, std::vector<std::int32_t>& segments) const {
    const index::PosedMesh posed = posedMesh("findTouching", mesh);
    segments.clear();
    PairsTo sink(SegmentsOf(), appendTo(segments));
    index_->searchMesh(posed, index_->options().margin, sink);
  }

  void findNearest(const TriangleMesh& mesh, double distance,
                   std::vector<TrianglePair>& pairs) const {
    const index::PosedMesh posed = posedMesh("findNearest", mesh);
    if (!(distance >= 0)) {
      refuse("findNearest", joinedText("distance is ", distance, "; give 0 or more"));
    }
    std::vector<tree::Pair> found;
    index_->findNearest(posed, distance, found);
    pairs.clear();
    pairs.reserve(found.size());
    for (const tree::Pair& pair : found) pairs.push_back({pair.a, pair.b});
  }

  template <class F>
  bool visitOverlaps(const CapsuleShape& capsule, F take) const {
    index_.requireValid("visitOverlaps");
    return visitOverlaps(inFrame("capsule", arrays::toSegment(capsule)), SegmentsOf(),
                         std::move(take));
  }

  template <class F>
  bool visitOverlaps(const BoxShape& box, F take) const {
    index_.requireValid("visitOverlaps");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (box.low[axis] > box.high[axis]) {
        refuse("visitOverlaps", "low exceeds high of the box; exchange the two");
      }
    }
    Segment segment = inFrame("box", arrays::toSegment({box.low, box.high, 0}));
    segment.radius = Segment::box({}, {}).radius;
    return visitOverlaps(segment, arrays::SegmentsAtBox(*index_, segment), std::move(take));
  }

  template <class F>
  bool visitImpacts(F take) const {
    index_.requireCapsules("visitImpacts");
    const index::Step step = index_.step("visitImpacts");
    const arrays::NoNeighbors wanted(index_.table());
    arrays::ImpactsTo sink(arrays::ImpactsOfOne(), std::move(take));
    return step.searchImpacts(&wanted, sink) == Visit::kStop;
  }

  template <class F>
  bool visitImpacts(const Impl& other, F take) const {
    index_.requireCapsules("visitImpacts");
    const Steps steps = stepsWith(other, "visitImpacts", "visitImpacts: the other tree");
    arrays::ImpactsTo sink(arrays::ImpactsOfTwo(), std::move(take));
    return steps.own.searchImpacts(steps.other, nullptr, sink) == Visit::kStop;
  }

  template <class F>
  bool visitImpacts(const TriangleMesh start, const TriangleMesh end, F take) const {
    const index::Step step = index_.step("visitImpacts");
    const index::MovingMesh mesh = movingMesh("visitImpacts", start, end);
    arrays::ImpactsTo sink(arrays::ImpactsOfMesh(), std::move(take));
    return step.searchImpacts(mesh, index_->options().margin, sink) == Visit::kStop;
  }

  template <class F>
  bool visitMovingPairs(F take) const {
    const index::Step step = index_.step("visitMovingPairs");
    PairsTo sink(PairsOfOne(index_.table()), std::move(take));
    return step.searchMoving(nullptr, sink) == Visit::kStop;
  }

  template <class F>
  bool visitMovingPairs(const Impl& other, F take) const {
    const Steps steps = stepsWith(other, "visitMovingPairs", "visitMovingPairs: the other tree");
    PairsTo sink(PairsOfTwo<SegmentPair>(), std::move(take));
    return steps.own.searchMoving(steps.other, nullptr, sink) == Visit::kStop;
  }

  double safeStep() const {
    index_.requireCapsules("safeStep");
    const index::Step step = index_.step("safeStep");
    const arrays::NoNeighbors wanted(index_.table());
    return step.safeTime(&wanted);
  }

  double safeStep(const Impl& other) const {
    index_.requireCapsules("safeStep");
    const Steps steps = stepsWith(other, "safeStep", "safeStep: the other tree");
    return steps.own.safeTime(steps.other);
  }

  double safeStep(const TriangleMesh& start, const TriangleMesh& end) const {
    const index::Step step = index_.step("safeStep");
    return step.safeTime(movingMesh("safeStep", start, end));
  }

  template <typename S>
  void findContacts(const FiberArrays<S>& fibers, std::vector<Contact>& contacts) const {
    requireContacts(fibers);
    std::vector<SegmentPair> pairs;
    visitPairs(appendTo(pairs));
    contacts.resize(pairs.size());
    writeContacts(fibers, pairs.data(), pairs.size(), contacts.data());
  }

  template <typename S>
  void findContacts(const FiberArrays<S>& fibers, const SegmentPair* pairs, std::size_t count,
                    Contact* contacts) const {
    requireContacts(fibers);
    writeContacts(fibers, pairs, count, contacts);
  }

  template <typename S>
  void findContacts(const FiberArrays<S>& fibers, const TriangleMesh& mesh,
                    std::vector<MeshContact>& contacts) const {
    requireContacts(fibers);
    std::vector<TrianglePair> pairs;
    visitMesh(mesh, appendTo(pairs));
    contacts.resize(pairs.size());
    writeContacts(fibers, mesh, pairs.data(), pairs.size(), contacts.data());
  }

  template <typename S>
  void findContacts(const FiberArrays<S>& fibers, const TriangleMesh& mesh,
                    const TrianglePair* pairs, std::size_t count, MeshContact* contacts) const {
    requireContacts(fibers);
    for (std::size_t i = 0; i < count; ++i) {
      requireTriangle("FiberTree::findContacts", mesh, pairs[i].triangle);
    }
    writeContacts(fibers, mesh, pairs, count, contacts);
  }

  std::vector<TreeVolume> volumes(int depth) const {
    index_.requireValid("volumes");
    if (depth < 0) refuse("volumes", "depth is " + std::to_string(depth) + "; give 0 or more");
    std::vector<TreeVolume> volumes;
    std::visit(
        [&](const auto& tree) {
          visitVolumes(tree, depth, [&](const auto& volume, std::int32_t begin, std::int32_t end) {
            volumes.push_back(arrays::toWorld(volume, index_->frame()));
            volumes.back().segments = index_->leaves().data() + begin;
            volumes.back().segment_count = static_cast<std::size_t>(end - begin);
          });
        },
        index_->tree());
    return volumes;
  }

  FiberSegment fiberSegment(std::int32_t segment) const {
    if (segment < 0 || segment >= index_.table().idCount() || index_.table().isBehind(segment)) {
      refuse("fiberSegment", "no capsule starts at point " + std::to_string(segment) +
                                 "; pass a number of a pair that this tree has reported");
    }
    return index_.table().placeOf(segment);
  }

 private:
  /// Refuses what capsuleContact() would, before a contact is written.
  template <typename S>
  void requireContacts(const FiberArrays<S>& fibers) const {
    const double largest = arrays::checkArrays("FiberTree::findContacts", fibers);
    if (const char* problem = geometry::contactProblem({{largest, 0, 0}, {0, 0, 0}, 0})) {
      refuse("findContacts", problem);
    }
    if (!index_.hasFibersOf(fibers)) {
      refuse("findContacts",
             "the fibers have other numbers of points than those of the tree; pass the arrays of "
             "its last build() or update()");
    }
  }

  template <typename S>
  void writeContacts(const FiberArrays<S>& fibers, const SegmentPair* pairs, std::size_t count,
                     Contact* contacts) const {
    index_->forRanges(count, kContactsAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) contacts[i] = capsuleContact(fibers, pairs[i]);
    });
  }

  template <typename S>
  void writeContacts(const FiberArrays<S>& fibers, const TriangleMesh& mesh,
                     const TrianglePair* pairs, std::size_t count, MeshContact* contacts) const {
    const fibers::MeshContacts contact(MeshReader::posed(mesh));
    index_->forRanges(count, kContactsAtOnce, [&](std::size_t begin, std::size_t end) {
      constexpr std::size_t kAhead = 16;
      for (std::size_t i = begin; i < end; ++i) {
        // A point that does not exist is refused later.
        const auto next = static_cast<std::size_t>(pairs[std::min(i + kAhead, end - 1)].segment);
        if (next < fibers.point_count) __builtin_prefetch(fibers.points + 3 * next);
        const auto capsule = arrays::locate("FiberTree::findContacts", fibers, pairs[i].segment);
        contacts[i] = contact(contact.inFrame(capsule.segment), capsule.place, pairs[i].triangle);
      }
    });
  }

  /// Takes a capsule, or the diagonal of a box, to the frame of the index.
  Segment inFrame(const char* name, const Segment& shape) const {
    const auto refuseIt = [name](const char* problem) {
      refuse("visitOverlaps", std::string("the ") + name + ": " + problem);
    };
    if (const char* problem = geometry::contactProblem(shape)) refuseIt(problem);
    const Frame& frame = index_->frame();
    const Segment moved{frame.fromWorld(shape.a), frame.fromWorld(shape.b),
                        frame.scale * shape.radius};
    if (!isFinite(moved)) {
      refuseIt("its coordinates overflow in the unit of the fibers; bring it nearer to them");
    }
    return moved;
  }

  template <class Convert, class F>
  bool visitOverlaps(const Segment& shape, const Convert& convert, F take) const {
    PairsTo sink(convert, std::move(take));
    return index_->search(shape, endPointError(shape), tree::kNoGroup, /*second=*/0, sink) ==
           Visit::kStop;
  }

  struct Steps {
    index::Step own, other;
  };
  Steps stepsWith(const Impl& other, const char* call, const char* call_of_other) const {
    requirePartner(call, other.index_);
    return {index_.step(call), other.index_.step(call_of_other)};
  }

  /// Refuses a tree that this one cannot be searched with.
  void requirePartner(const char* call, const arrays::FiberIndex& other) const {
    index_.requireValid(call);
    other.requireValid(call);
    if (!index_->matches(*other)) {
      refuse(call, "the trees have different volumes or topologies; construct both with the same");
    }
    if (index_->keepsSegments() && !other->keepsSegments()) {
      refuse(call,
             "the other tree reports volumes and keeps no capsules; construct it with "
             "Report::kCapsules");
    }
  }

  index::MovingMesh movingMesh(const char* call, const TriangleMesh& mesh_start,
                               const TriangleMesh& mesh_end) const {
    const index::PosedMesh start = posedMesh(call, mesh_start), end = posedMesh(call, mesh_end);
    if (start.is_solid != end.is_solid || start.categories != end.categories ||
        !start.mesh.hasTrianglesOf(end.mesh)) {
      refuse(call,
             "the mesh at the end has other triangles, another kind or other categories than the "
             "one at the start; copy the mesh and move the copy");
    }
    return {start, end, index_->frame(), index_->executor()};
  }

  /// The mesh for a search. Refuses what no search can be right for.
  index::PosedMesh posedMesh(const char* call, const TriangleMesh& mesh) const {
    index_.requireCapsules(call);
    const index::PosedMesh posed = MeshReader::posed(mesh);
    if (!index::fitsIn(index_->frame(), posed)) {
      refuse(call,
             "the coordinates of the mesh overflow in the unit of the fibers; bring it nearer to "
             "them");
    }
    return posed;
  }

  arrays::FiberIndex index_;
};

FiberTree::FiberTree(const FiberTreeOptions& options) : impl_(std::make_shared<Impl>(options)) {}
FiberTree::~FiberTree() = default;
FiberTree::FiberTree(FiberTree&&) noexcept = default;
FiberTree& FiberTree::operator=(FiberTree&&) noexcept = default;

/// Returns the state for a call that changes it, unless a query holds it.
FiberTree::Impl& FiberTree::change(const char* call) {
  if (impl_.use_count() > 1) fibers::throwQueryRuns(std::string("FiberTree::") + call);
  // A query of another thread may just have ended. To copy the pointer and let go of it orders what
  // that query has read before what is written now.
  std::shared_ptr<Impl>(impl_).reset();
  return *impl_;
}

/// Returns the state for a query, which holds it until it ends: a visitor may even destroy the
/// tree.
std::shared_ptr<const FiberTree::Impl> FiberTree::held() const { return impl_; }

void FiberTree::build(const FiberArrays<float>& fibers) { change("build").index().build(fibers); }
void FiberTree::build(const FiberArrays<double>& fibers) { change("build").index().build(fibers); }
void FiberTree::update(const FiberArrays<float>& fibers) {
  change("update").index().update<float>(nullptr, fibers);
}
void FiberTree::update(const FiberArrays<double>& fibers) {
  change("update").index().update<double>(nullptr, fibers);
}
void FiberTree::update(const FiberArrays<float>& start, const FiberArrays<float>& end) {
  change("update").index().update(&start, end);
}
void FiberTree::update(const FiberArrays<double>& start, const FiberArrays<double>& end) {
  change("update").index().update(&start, end);
}

bool FiberTree::visitRuns(Runs<SegmentPair>& runs) const {
  return held()->visitPairs(handTo(runs));
}
bool FiberTree::visitRuns(const FiberTree& other, Runs<SegmentPair>& runs) const {
  if (&other == this) return visitRuns(runs);
  return held()->visitPairs(*other.held(), handTo(runs));
}
bool FiberTree::visitRuns(const TriangleMesh& mesh, Runs<TrianglePair>& runs) const {
  return held()->visitMesh(mesh, handTo(runs));
}
bool FiberTree::visitRuns(const TriangleMesh& start, const TriangleMesh& end,
                          Runs<MeshImpact>& runs) const {
  return held()->visitImpacts(start, end, handTo(runs));
}
bool FiberTree::visitRuns(Runs<Impact>& runs) const { return held()->visitImpacts(handTo(runs)); }
bool FiberTree::visitRuns(const FiberTree& other, Runs<Impact>& runs) const {
  if (&other == this) return visitRuns(runs);
  return held()->visitImpacts(*other.held(), handTo(runs));
}
bool FiberTree::visitMovingRuns(Runs<SegmentPair>& runs) const {
  return held()->visitMovingPairs(handTo(runs));
}
bool FiberTree::visitMovingRuns(const FiberTree& other, Runs<SegmentPair>& runs) const {
  if (&other == this) return visitMovingRuns(runs);
  return held()->visitMovingPairs(*other.held(), handTo(runs));
}
bool FiberTree::visitRuns(const CapsuleShape& capsule, Runs<std::int32_t>& runs) const {
  return held()->visitOverlaps(capsule, handTo(runs));
}
bool FiberTree::visitRuns(const BoxShape& box, Runs<std::int32_t>& runs) const {
  return held()->visitOverlaps(box, handTo(runs));
}

void FiberTree::findPairs(std::vector<SegmentPair>& pairs) const {
  pairs.clear();
  held()->visitPairs(appendTo(pairs));
}

void FiberTree::findImpacts(std::vector<Impact>& impacts) const {
  impacts.clear();
  held()->visitImpacts(appendTo(impacts));
}
double FiberTree::safeStep() const { return held()->safeStep(); }
double FiberTree::safeStep(const FiberTree& other) const {
  return &other == this ? safeStep() : held()->safeStep(*other.held());
}
double FiberTree::safeStep(const TriangleMesh& start, const TriangleMesh& end) const {
  return held()->safeStep(start, end);
}

void FiberTree::findTouching(const TriangleMesh& mesh, std::vector<std::int32_t>& segments) const {
  held()->findTouching(mesh, segments);
}
void FiberTree::findNearest(const TriangleMesh& mesh, double distance,
                            std::vector<TrianglePair>& pairs) const {
  held()->findNearest(mesh, distance, pairs);
}
void FiberTree::findContacts(const FiberArrays<float>& fibers,
                             std::vector<Contact>& contacts) const {
  held()->findContacts(fibers, contacts);
}
void FiberTree::findContacts(const FiberArrays<double>& fibers,
                             std::vector<Contact>& contacts) const {
  held()->findContacts(fibers, contacts);
}
void FiberTree::findContacts(const FiberArrays<float>& fibers, const SegmentPair* pairs,
                             std::size_t count, Contact* contacts) const {
  held()->findContacts(fibers, pairs, count, contacts);
}
void FiberTree::findContacts(const FiberArrays<double>& fibers, const SegmentPair* pairs,
                             std::size_t count, Contact* contacts) const {
  held()->findContacts(fibers, pairs, count, contacts);
}
void FiberTree::findContacts(const FiberArrays<float>& fibers, const TriangleMesh& mesh,
                             const TrianglePair* pairs, std::size_t count,
                             MeshContact* contacts) const {
  held()->findContacts(fibers, mesh, pairs, count, contacts);
}
void FiberTree::findContacts(const FiberArrays<double>& fibers, const TriangleMesh& mesh,
                             const TrianglePair* pairs, std::size_t count,
                             MeshContact* contacts) const {
  held()->findContacts(fibers, mesh, pairs, count, contacts);
}
void FiberTree::findContacts(const FiberArrays<float>& fibers, const TriangleMesh& mesh,
                             std::vector<MeshContact>& contacts) const {
  held()->findContacts(fibers, mesh, contacts);
}
void FiberTree::findContacts(const FiberArrays<double>& fibers, const TriangleMesh& mesh,
                             std::vector<MeshContact>& contacts) const {
  held()->findContacts(fibers, mesh, contacts);
}

std::vector<TreeVolume> FiberTree::volumes(int depth) const { return held()->volumes(depth); }
FiberSegment FiberTree::fiberSegment(std::int32_t segment) const {
  return impl_->fiberSegment(segment);
}
std::size_t FiberTree::fiberCount() const { return impl_->index().table().fiberCount(); }
std::size_t FiberTree::segmentCount() const { return impl_->segmentCount(); }
const FiberTreeOptions& FiberTree::options() const { return impl_->index().options(); }
std::size_t FiberTree::memoryUsage() const { return impl_->index().memoryUsage(); }

}  // namespace fcl_fibers
