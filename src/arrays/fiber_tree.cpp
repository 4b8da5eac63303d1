// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/fiber_tree.h>

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include <fcl_fibers/contact.h>

#include "arrays/accumulate.h"
#include "arrays/array_source.h"
#include "arrays/coordinates.h"
#include "arrays/fiber_index.h"
#include "arrays/located_segment.h"
#include "arrays/nearest.h"
#include "arrays/pair_order.h"
#include "arrays/pair_sinks.h"
#include "arrays/shapes.h"
#include "arrays/triangle_mesh.h"
#include "fibers/capsule_contact.h"
#include "fibers/mesh_contacts.h"
#include "fibers/options.h"
#include "index/posed_mesh.h"
#include "index/segment_index.h"
#include "joined_text.h"
#include "parallel/unwritten.h"

namespace fcl_fibers {
namespace {

using arrays::Output;
using arrays::refuse;
using arrays::Take;
using index::PairSink;
using parallel::UnwrittenVector;
using tree::Visit;

/// In the order of FiberTree::Questions. That of safeStep() is named by the call.
constexpr const char* kQuestions[] = {"Pairs",   "TouchingSegments", "Nearest",
                                      "Impacts", "MovingPairs",      nullptr};

template <class Question>
constexpr bool kNeedsStep = kHasAnswer<Question, MeshStep> || std::is_same_v<Question, MovingPairs>;
template <class Question, class Partner>
constexpr bool kNeedsCapsules =
    kHasAnswer<Question, MeshStep> || std::is_same_v<Partner, TriangleMesh> ||
    std::is_same_v<Question, Nearest>;

/// Contacts that one thread computes in a row.
constexpr std::size_t kContactsAtOnce = 512;

/// A call with a question. It refuses what cannot be answered.
struct Call {
  const char* name;
  const char* question;  ///< null if the name tells

  std::string text() const {
    const std::string text = std::string("FiberTree::") + name;
    return question != nullptr ? text + '(' + question + ')' : text;
  }
  [[noreturn]] void refuse(const std::string& what) const {
    fibers::throwInvalidArgument(text(), what);
  }
  void require(const char* problem) const {
    if (problem != nullptr) refuse(problem);
  }
};

bool isNearer(const Contact& p, const Contact& q) {
  return std::tie(p.distance, p.pair.a, p.pair.b) < std::tie(q.distance, q.pair.a, q.pair.b);
}
bool isNearer(const MeshContact& p, const MeshContact& q) {
  return std::tie(p.distance, p.segment, p.triangle) < std::tie(q.distance, q.segment, q.triangle);
}

/// Whether p, of two contacts of one segment with a mesh, is its way off the mesh: the shortest one
/// out of a solid, or else that off the nearest triangle.
bool isWayRatherThan(const MeshContact& p, const MeshContact& q) {
  if (p.solid != q.solid) return p.solid;
  return p.solid ? p.distance > q.distance : p.distance < q.distance;
}

// Of a partner: what requireFew() counts.
std::size_t elementsOf(const FiberTree& tree) { return tree.segmentCount(); }
std::size_t elementsOf(const TriangleMesh& mesh) { return mesh.triangleCount(); }
std::size_t elementsOf(const MeshStep& step) { return step.end.triangleCount(); }
std::size_t elementsOf(const Shape& /*shape*/) { return 1; }

/// Hands on what search(sink) finds. Returns whether the output ended it.
/// @param own  sifts the pairs of one tree; null for others
template <class Found, class Search>
bool handOn(Output& output, const arrays::PairsOfOne* own, Search&& search) {
  arrays::SinkTo<Found> sink(output, own);
  return search(static_cast<PairSink&>(sink)) == Visit::kStop;
}

}  // namespace

class FiberTree::Impl {
 public:
  explicit Impl(const FiberTreeOptions& options) : index_(options) {}

  arrays::FiberIndex& index() { return index_; }
  const arrays::FiberIndex& index() const { return index_; }

  static bool answer(const FiberTree& tree, const Query& query, Output& output);

  template <class Question, class Partner>
  bool answer(const Call& call, const Question& question, const Partner& partner,
              Output& output) const {
    call.require(index_.problem(kNeedsCapsules<Question, Partner>, kNeedsStep<Question>));
    if constexpr (std::is_same_v<Question, Pairs>) {
      if (question.order != Order::kFound && output.delivery() != PairSink::Delivery::kAtOnce) {
        return answerInOrder(call, question, partner, output);
      }
    }
    return search(call, question, partner, output);
  }
  template <class Partner>
  bool answerInOrder(const Call& call, const Pairs& question, const Partner& partner,
                     Output& output) const {
    using Found = FoundBy<Pairs, Partner>;
    if (output.delivery() != PairSink::Delivery::kPlaced) {
      UnwrittenVector<Found> all;
      collect(call, partner, all,
              [&](Output& found) { answerInOrder(call, question, partner, found); });
      return !all.empty() && output.take(all.data(), all.size(), 0);
    }
    search(call, question, partner, output);
    output.makeRoom<Found>(0);  // behind all
    const std::size_t count = output.count();
    Found* const all = output.at<Found>(0) - count;
    if constexpr (std::is_same_v<Partner, FiberTree>) {
      arrays::sortFound(question.order, index_.table(), partner.impl()->index_.table(), all, count);
    } else {
      arrays::sortFound(all, count);
    }
    return false;
  }
  /// Replaces the content of a vector by what search(output) finds.
  /// @param bytes  that each will take, if that is more than what is found itself
  template <class Partner, class Found, class Search>
  void collect(const Call& call, const Partner& partner, UnwrittenVector<Found>& all,
               Search&& search, std::size_t bytes = 0) const {
    const arrays::Room room = [&all](std::size_t count) {
      if (count > all.size()) all.resize(count);
      return static_cast<void*>(all.data());
    };
    Output output(room, call.text(), elements(partner), bytes);
    search(output);
    all.resize(output.count());
  }
  /// What requireFew() counts of this tree and the partner.
  template <class Partner>
  std::size_t elements(const Partner& partner) const {
    return std::max(index_->leaves().size(), elementsOf(partner));
  }
  template <class Partner>
  UnwrittenVector<FoundBy<Pairs, Partner>> pairs(const Call& call, Order order,
                                                 const Partner& partner, std::size_t bytes) const {
    UnwrittenVector<FoundBy<Pairs, Partner>> pairs;
    collect(
        call, partner, pairs, [&](Output& found) { answer(call, Pairs{order}, partner, found); },
        bytes);
    return pairs;
  }
  /// Computes the contacts of what is found on the thread that finds it.
  template <typename S, class Partner>
  bool visitContacts(const Call& call, const Contacts<S>& question, const Partner& partner,
                     const Take& take) const {
    const auto held = hold(call, question, partner);
    const Take computeAndTake = [&](const void* found, std::size_t count, int worker) {
      constexpr std::size_t kRun = 64;
      std::array<FoundBy<Contacts<S>, Partner>, kRun> contacts;
      const auto pairs = static_cast<const FoundBy<Pairs, Partner>*>(found);
      for (std::size_t i = 0; i < count; i += kRun) {
        const std::size_t size = std::min(kRun, count - i);
        compute(held, pairs + i, size, contacts.data());
        if (take(contacts.data(), size, worker)) return true;
      }
      return false;
    };
    Output output(PairSink::Delivery::kAtOnce, computeAndTake);
    return answer(call, Pairs{}, partner, output);
  }

  // What contacts are computed from, taken before anything is visited: a visitor may change or
  // destroy the partner.

  template <typename S>
  struct HeldTree {
    FiberArrays<S> fibers, others;
    std::uint32_t layout;
  };
  template <typename S>
  struct HeldMesh {
    HeldMesh(const Call& call, const FiberArrays<S>& arrays, const TriangleMesh& partner)
        : text(call.text()), fibers(arrays), mesh(partner), contact(MeshReader::placed(mesh)) {}

    const std::string text;
    const FiberArrays<S> fibers;
    const TriangleMesh mesh;
    const fibers::MeshContacts contact;
  };
  template <typename S>
  struct HeldShape {
    FiberArrays<S> fibers;
    Shape shape;
  };

  // hold() refuses what capsuleContact() would.

  template <typename S>
  HeldTree<S> hold(const Call& call, const Contacts<S>& question, const FiberTree& partner) const {
    requireArrays(call, question.fibers);
    const std::shared_ptr<const Impl> other = partner.impl();
    const std::uint32_t layout = index_.layout(&other->index_);
    if (isOf(partner)) return {question.fibers, question.fibers, layout};
    if (question.others == nullptr) call.refuse("give Contacts the fibers of the other tree too");
    other->requireArrays(call, *question.others);
    return {question.fibers, *question.others, layout};
  }
  template <typename S>
  HeldMesh<S> hold(const Call& call, const Contacts<S>& question, const TriangleMesh& mesh) const {
    requireArrays(call, question.fibers);
    return HeldMesh<S>(call, question.fibers, mesh);
  }
  template <typename S>
  HeldShape<S> hold(const Call& call, const Contacts<S>& question, const Shape& shape) const {
    requireArrays(call, question.fibers);
    arrays::requireShape(call.text(), shape);
    return {question.fibers, shape};
  }
  template <typename S>
  void requireArrays(const Call& call, const FiberArrays<S>& fibers) const {
    const double largest = arrays::checkArrays(call.text().c_str(), fibers, index_->executor());
    call.require(fibers::contactProblem({{largest, 0, 0}, {0, 0, 0}, 0}));
    if (!index_.hasFibersOf(fibers)) {
      call.refuse(
          "the fibers have other numbers of points than those of the tree; pass the arrays of its "
          "last build() or update()");
    }
  }

  /// Writes contacts, or what is in BareContact of them.
  template <typename S, class Found>
  void compute(const HeldTree<S>& held, const SegmentPair* pairs, std::size_t count,
               Found* contacts) const {
    index_->forRanges(count, kContactsAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        contacts[i] = capsuleContact(held.fibers, held.others, pairs[i]);
        contacts[i].layout = held.layout;
      }
    });
  }

  template <typename S>
  void compute(const HeldMesh<S>& held, const TrianglePair* pairs, std::size_t count,
               MeshContact* contacts) const {
    const fibers::MeshContacts& contact = held.contact;
    const FiberArrays<S>& fibers = held.fibers;
    index_->forRanges(count, kContactsAtOnce, [&](std::size_t begin, std::size_t end) {
      constexpr std::size_t kAtOnce = fibers::MeshContacts::kAtOnce, kAhead = 16;
      std::array<fibers::MeshContacts::Pair, kAtOnce> several;
      for (std::size_t i = begin; i < end; i += kAtOnce) {
        const std::size_t size = std::min(kAtOnce, end - i);
        for (std::size_t k = 0; k < size; ++k) {
          // A point that does not exist is refused later.
          const auto next =
              static_cast<std::size_t>(pairs[std::min(i + k + kAhead, end - 1)].segment);
          if (next < fibers.point_count) __builtin_prefetch(arrays::addressOf(fibers, next));
          const auto capsule = arrays::locate(held.text.c_str(), fibers, pairs[i + k].segment);
          several[k] = {contact.frame().fromWorld(capsule.segment), capsule.place,
                        pairs[i + k].triangle};
        }
        contact.compute(several.data(), size, contacts + i);
        for (std::size_t k = i; k < i + size; ++k) {
          contacts[k].segment = pairs[k].segment;
          contacts[k].layout = index_.layout();
        }
      }
    });
  }

  template <typename S>
  void compute(const HeldShape<S>& held, const std::int32_t* segments, std::size_t count,
               ShapeContact* contacts) const {
    index_->forRanges(count, kContactsAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        contacts[i] = shapeContact(held.fibers, held.shape, segments[i]);
        contacts[i].layout = index_.layout();
      }
    });
  }

  /// Whether a tree has this state. One that was moved from has that of any empty tree.
  bool isOf(const FiberTree& tree) const {
    return tree.impl_.get() == this || (tree.impl_ == nullptr && index_->leaves().empty());
  }

  // The pairs of which one has the least distance: all that touch or, if none does, candidates.
  void closestPairs(const Call& call, const FiberTree& partner,
                    UnwrittenVector<SegmentPair>& pairs) const {
    const std::shared_ptr<const Impl> held = partner.impl();
    call.require(index_.problem(/*needs_capsules=*/true));
    collect(call, partner, pairs, [&](Output& found) { search(call, Pairs{}, partner, found); });
    if (pairs.empty()) arrays::findClosest(call.text(), index_, held->index_, pairs);
  }
  void closestPairs(const Call& call, const TriangleMesh& partner,
                    UnwrittenVector<TrianglePair>& pairs) const {
    call.require(index_.problem(/*needs_capsules=*/true));
    const index::PosedMesh mesh(placed(call, partner), index_->frame());
    collect(call, partner, pairs, [&](Output& found) {
      handOn<TrianglePair>(
          found, nullptr, [&](PairSink& sink) { return index_->search(mesh, /*margin=*/0, sink); });
    });
    if (pairs.empty()) arrays::findClosest(index_, mesh, pairs);
    arrays::sortFound(pairs.data(), pairs.size());  // the triangles of a segment follow each other
  }

  FiberSegment fiberSegment(std::int32_t segment) const {
    if (segment < 0 || segment >= index_.table().idCount() || index_.table().isBehind(segment)) {
      refuse("fiberSegment", "no capsule starts at point " + std::to_string(segment) +
                                 "; pass a number of a pair that this tree has reported");
    }
    return index_.table().placeOf(segment);
  }

 private:
  // search() exists for each kind of partner. It holds trees and copies meshes, because a visitor
  // may change or destroy them.

  template <class Question>
  bool search(const Call& call, const Question& question, const FiberTree& partner,
              Output& output) const {
    const std::shared_ptr<const Impl> held = partner.impl();
    const arrays::FiberIndex& other = held->index_;
    if (!index_->matches(*other)) {
      call.refuse("the trees have different volumes or topologies; construct both with the same");
    }
    if (const char* problem = other.problem(index_->keepsSegments(), kNeedsStep<Question>)) {
      call.refuse(std::string("the other tree: ") + problem);
    }
    const bool is_own = held.get() == this;
    const arrays::PairsOfOne own(index_.table());
    const index::SegmentSource* const kept = nullptr;
    index::Question asked;
    asked.of_step = kNeedsStep<Question>;
    asked.of_volumes = std::is_same_v<Question, MovingPairs>;
    if (is_own && std::is_same_v<Question, Impacts>) asked.wanted = &own;
    if constexpr (std::is_same_v<Question, Nearest>) {
      requireDistance(call, question);
      return handOn<SegmentPair>(output, nullptr, [&](PairSink& sink) {
        return arrays::findNearest(call.text(), index_, other, question.distance, sink);
      });
    } else if constexpr (!std::is_same_v<Question, SafeStep>) {
      using Found = FoundBy<Question, FiberTree>;
      return handOn<Found>(output, is_own ? &own : nullptr, [&](PairSink& sink) {
        return is_own ? index_->search(sink, asked) : index_->search(*other, kept, sink, asked);
      });
    } else {
      const double time = is_own ? index_->firstTime(elements(partner), &own)
                                 : index_->firstTime(elements(partner), nullptr, *other, kept);
      return output.take(&time, 1, 0);
    }
  }

  template <class Question>
  bool search(const Call& call, const Question& question, const TriangleMesh& partner,
              Output& output) const {
    const TriangleMesh copy = partner;
    const index::PosedMesh mesh(placed(call, copy), index_->frame());
    const double margin = index_->options().margin;
    return handOn<FoundBy<Question, TriangleMesh>>(output, nullptr, [&](PairSink& sink) {
      if constexpr (std::is_same_v<Question, Pairs>) {
        return index_->search(mesh, margin, sink);
      } else if constexpr (std::is_same_v<Question, TouchingSegments>) {
        index::Question asked;
        asked.once = true;
        return index_->search(mesh, margin, sink, asked);
      } else {
        requireDistance(call, question);
        return index_->findNearest(mesh, question.distance, sink);
      }
    });
  }

  static void requireDistance(const Call& call, const Nearest& question) {
    if (question.distance >= 0) return;
    call.refuse(joinedText("distance is ", question.distance, "; give 0 or more"));
  }

  template <class Question>
  bool search(const Call& call, Question, const MeshStep& partner, Output& output) const {
    const MeshStep copy = partner;
    const index::PlacedMesh start = placed(call, copy.start), end = placed(call, copy.end);
    if (start.is_solid != end.is_solid || start.categories != end.categories ||
        !start.mesh.hasTrianglesOf(end.mesh)) {
      call.refuse(
          "the mesh at the end has other triangles, another kind or other categories than the one "
          "at the start; copy the mesh and move the copy");
    }
    const index::PosedMesh mesh(start, end, index_->frame(), index_->executor());
    const double margin = index_->options().margin;
    if constexpr (std::is_same_v<Question, Impacts>) {
      return handOn<MeshImpact>(output, nullptr, [&](PairSink& sink) {
        return index_->search(mesh, margin, sink, index::Question::ofStep());
      });
    } else {
      const double time = index_->firstTime(elements(copy), nullptr, mesh, margin);
      return output.take(&time, 1, 0);
    }
  }

  template <class Question>
  bool search(const Call& call, Question, const Shape& partner, Output& output) const {
    arrays::requireShape(call.text(), partner);
    const geometry::Obstacle shape = arrays::obstacleOf(partner, index_->frame());
    if (!isFinite(shape)) {
      call.refuse(
          "the coordinates of the shape overflow in the unit of the fibers; bring it nearer to "
          "them");
    }
    if constexpr (std::is_same_v<Question, SafeStep>) {
      const double time = index_->firstTime(elements(partner), nullptr, shape);
      return output.take(&time, 1, 0);
    } else {
      index::Question asked;
      asked.of_step = kNeedsStep<Question>;
      return handOn<FoundBy<Question, Shape>>(
          output, nullptr, [&](PairSink& sink) { return index_->search(shape, sink, asked); });
    }
  }

  /// The mesh for a search. Refuses what no search can be right for.
  index::PlacedMesh placed(const Call& call, const TriangleMesh& mesh) const {
    const index::PlacedMesh placed = MeshReader::placed(mesh);
    if (!index::fitsIn(index_->frame(), placed)) {
      call.refuse(
          "the coordinates of the mesh overflow in the unit of the fibers; bring it nearer to "
          "them");
    }
    return placed;
  }

  arrays::FiberIndex index_;
};

FiberTree::FiberTree(const FiberTreeOptions& options)
    : options_(options), impl_(std::make_shared<Impl>(options)) {}

/// The state. After a move each call has an empty one of its own, because several threads may ask.
std::shared_ptr<FiberTree::Impl> FiberTree::impl() const {
  return impl_ != nullptr ? impl_ : std::make_shared<Impl>(options_);
}

/// Returns the state for a call that changes it, unless a query holds it.
std::shared_ptr<arrays::FiberIndex> FiberTree::index() const {
  const std::shared_ptr<Impl> held = impl();
  return {held, &held->index()};
}
FiberTree::Impl& FiberTree::change(const char* call) {
  if (impl_ == nullptr) impl_ = impl();
  if (impl_.use_count() > 1) fibers::throwQueryRuns(std::string("FiberTree::") + call);
  // A query of another thread may just have ended. To copy the pointer and let go of it orders what
  // that query has read before what is written now.
  std::shared_ptr<Impl>(impl_).reset();
  return *impl_;
}

// A query holds the state until it ends: a visitor may even destroy the tree.

bool FiberTree::Impl::answer(const FiberTree& tree, const Query& query, Output& output) {
  const std::shared_ptr<const Impl> held = tree.impl();
  const Call call{query.call, kQuestions[query.question.index()]};
  return std::visit(
      [&](const auto& question, const auto* partner) {
        if constexpr (kHasAnswer<std::decay_t<decltype(question)>,
                                 std::remove_cv_t<std::remove_pointer_t<decltype(partner)>>>) {
          return held->answer(call, question, *partner, output);
        } else {
          return false;  // no call has asked this
        }
      },
      query.question, query.partner);
}
bool FiberTree::ask(const Query& query, const Take& take) const {
  const bool is_parallel = query.on_all_threads;
  Output output(is_parallel ? PairSink::Delivery::kAtOnce : PairSink::Delivery::kInOrder, take);
  return Impl::answer(*this, query, output);
}
std::size_t FiberTree::fill(const Query& query, const Room& room) const {
  const Call call{query.call, kQuestions[query.question.index()]};
  const std::shared_ptr<const Impl> held = impl();
  const std::size_t elements =
      std::visit([&](const auto* partner) { return held->elements(*partner); }, query.partner);
  Output output(room, call.text(), elements);
  Impl::answer(*this, query, output);
  return output.count();
}

template <class Partner, typename S>
bool FiberTree::visitContacts(const Contacts<S>& question, const Partner& partner,
                              const Take& take) const {
  const std::shared_ptr<const Impl> held = impl();
  return held->visitContacts({"visitInParallel", "Contacts"}, question, partner, take);
}

template <class Partner, typename S, class Found>
void FiberTree::findContacts(const Contacts<S>& question, const Partner& partner,
                             std::vector<Found>& contacts) const {
  const std::shared_ptr<const Impl> own = impl();
  const Call call{"find", "Contacts"};
  const auto held = own->hold(call, question, partner);
  const auto pairs = own->pairs(call, question.order, partner, sizeof(Found));
  contacts.resize(pairs.size());
  own->compute(held, pairs.data(), pairs.size(), contacts.data());
}

template <typename S, class Partner, class Found>
void FiberTree::findClosest(const Contacts<S>& question, const Partner& partner,
                            Found& closest) const {
  const std::shared_ptr<const Impl> own = impl();
  const Call call{"closest", nullptr};
  const auto held = own->hold(call, question, partner);
  UnwrittenVector<FoundBy<Pairs, Partner>> pairs;
  own->closestPairs(call, partner, pairs);
  constexpr std::size_t kBlock = 16384;
  std::vector<Found> contacts(std::min(kBlock, pairs.size()));
  Found way;  // of the segment at hand, with a mesh
  way.distance = closest.distance = std::numeric_limits<double>::infinity();
  for (std::size_t begin = 0; begin < pairs.size(); begin += kBlock) {
    contacts.resize(std::min(kBlock, pairs.size() - begin));
    own->compute(held, pairs.data() + begin, contacts.size(), contacts.data());
    for (const Found& contact : contacts) {
      if constexpr (std::is_same_v<Found, MeshContact>) {
        if (contact.segment != way.segment) {
          if (isNearer(way, closest)) closest = way;
          way = contact;
        } else if (isWayRatherThan(contact, way)) {
          way = contact;
        }
      } else if (isNearer(contact, closest)) {
        closest = contact;
      }
    }
  }
  if (isNearer(way, closest)) closest = way;
}

template <class Partner, typename S, class Found>
void FiberTree::writeAsked(const Contacts<S>& question, const Partner& partner,
                           const FoundBy<Pairs, Partner>* pairs, std::size_t count,
                           Found* contacts) const {
  const std::shared_ptr<const Impl> own = impl();
  const Call call{"writeContacts", nullptr};
  const auto held = own->hold(call, question, partner);
  if constexpr (std::is_same_v<Partner, TriangleMesh>) {
    const std::string text = call.text();
    for (std::size_t i = 0; i < count; ++i) {
      requireTriangle(text.c_str(), partner, pairs[i].triangle);
    }
  }
  own->compute(held, pairs, count, contacts);
}

void FiberTree::accumulate(const ContactForces& forces, const PointSums& sums) const {
  const std::shared_ptr<const Impl> held = impl();
  arrays::accumulate("FiberTree::accumulate", forces, held->index(), nullptr, nullptr, sums, {});
}
void FiberTree::accumulate(const ContactForces& forces, const FiberTree& other,
                           const PointSums& sums, const PointSums& other_sums) const {
  const std::shared_ptr<const Impl> held = impl(), others = other.impl();
  arrays::accumulate("FiberTree::accumulate", forces, held->index(), &others->index(), nullptr,
                     sums, other_sums);
}
void FiberTree::accumulate(const ContactForces& forces, const TriangleMesh& mesh,
                           const PointSums& sums, const PointSums& mesh_sums) const {
  const std::shared_ptr<const Impl> held = impl();
  const TriangleMesh copy = mesh;
  arrays::accumulate("FiberTree::accumulate", forces, held->index(), nullptr, &copy, sums,
                     mesh_sums);
}
std::uint32_t FiberTree::layout(const FiberTree& other) const {
  const std::shared_ptr<const Impl> held = impl(), others = other.impl();
  return held->index().layout(&others->index());
}

template <typename S>
void FiberTree::build(const FiberArrays<S>& fibers) {
  change("build").index().build(fibers);
}
template <typename S>
void FiberTree::update(const FiberArrays<S>& fibers) {
  change("update").index().template update<S>(nullptr, fibers);
}
template <typename S>
void FiberTree::update(const FiberArrays<S>& start, const FiberArrays<S>& end) {
  change("update").index().update(&start, end);
}

// clang hides what has a type of ours among its template arguments, unless it is marked again.
#define FCL_FIBERS_INSTANTIATE(S)                                                                 \
  template void FiberTree::build(const FiberArrays<S>&);                                          \
  template void FiberTree::update(const FiberArrays<S>&);                                         \
  template void FiberTree::update(const FiberArrays<S>&, const FiberArrays<S>&);                  \
  template FCL_FIBERS_TREE_EXPORT void FiberTree::findContacts(                                   \
      const Contacts<S>&, const FiberTree&, std::vector<Contact>&) const;                         \
  template FCL_FIBERS_TREE_EXPORT void FiberTree::findContacts(                                   \
      const Contacts<S>&, const FiberTree&, std::vector<BareContact>&) const;                     \
  template FCL_FIBERS_TREE_EXPORT void FiberTree::findContacts(                                   \
      const Contacts<S>&, const TriangleMesh&, std::vector<MeshContact>&) const;                  \
  template FCL_FIBERS_TREE_EXPORT void FiberTree::findClosest(const Contacts<S>&,                 \
                                                              const FiberTree&, Contact&) const;  \
  template FCL_FIBERS_TREE_EXPORT void FiberTree::findClosest(                                    \
      const Contacts<S>&, const TriangleMesh&, MeshContact&) const;                               \
  template FCL_FIBERS_TREE_EXPORT void FiberTree::findContacts(const Contacts<S>&, const Shape&,  \
                                                               std::vector<ShapeContact>&) const; \
  template FCL_FIBERS_TREE_EXPORT bool FiberTree::visitContacts(                                  \
      const Contacts<S>&, const FiberTree&, const Take&) const;                                   \
  template FCL_FIBERS_TREE_EXPORT bool FiberTree::visitContacts(                                  \
      const Contacts<S>&, const TriangleMesh&, const Take&) const;                                \
  template FCL_FIBERS_TREE_EXPORT bool FiberTree::visitContacts(const Contacts<S>&, const Shape&, \
                                                                const Take&) const;               \
  template FCL_FIBERS_TREE_EXPORT void FiberTree::writeAsked(                                     \
      const Contacts<S>&, const FiberTree&, const SegmentPair*, std::size_t, Contact*) const;     \
  template FCL_FIBERS_TREE_EXPORT void FiberTree::writeAsked(                                     \
      const Contacts<S>&, const FiberTree&, const SegmentPair*, std::size_t, BareContact*) const; \
  template FCL_FIBERS_TREE_EXPORT void FiberTree::writeAsked(                                     \
      const Contacts<S>&, const TriangleMesh&, const TrianglePair*, std::size_t, MeshContact*)    \
      const;                                                                                      \
  template FCL_FIBERS_TREE_EXPORT void FiberTree::writeAsked(                                     \
      const Contacts<S>&, const Shape&, const std::int32_t*, std::size_t, ShapeContact*) const;
FCL_FIBERS_INSTANTIATE(float)
FCL_FIBERS_INSTANTIATE(double)
#undef FCL_FIBERS_INSTANTIATE

std::vector<TreeVolume> FiberTree::volumes(int depth) const {
  const std::shared_ptr<const Impl> held = impl();
  if (const char* problem = held->index().problem()) refuse("volumes", problem);
  if (depth < 0) refuse("volumes", "depth is " + std::to_string(depth) + "; give 0 or more");
  return held->index().volumes(depth);
}
FiberSegment FiberTree::fiberSegment(std::int32_t segment) const {
  return (impl_ != nullptr ? *impl_ : *impl()).fiberSegment(segment);
}
std::vector<std::int32_t> FiberTree::segments() const { return impl()->index().segments(); }
std::size_t FiberTree::fiberCount() const { return impl()->index().table().fiberCount(); }
std::size_t FiberTree::segmentCount() const { return impl()->index()->leaves().size(); }
const FiberTreeOptions& FiberTree::options() const { return options_; }
int FiberTree::workerCount() const { return impl()->index()->workerCount(); }
std::size_t FiberTree::memoryUsage() const { return impl()->index().memoryUsage(); }

}  // namespace fcl_fibers
