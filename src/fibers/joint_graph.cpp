// SPDX-License-Identifier: BSD-3-Clause
#include "fibers/joint_graph.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <queue>
#include <vector>

namespace fcl_fibers::fibers {
namespace {

bool isBefore(const FiberPoint& p, const FiberPoint& q) {
  return std::pair(p.fiber, p.number) < std::pair(q.fiber, q.number);
}

}  // namespace

// The ways to where there is no place. Two may be added, and no rule reaches so far.
constexpr SegmentId kFar = std::numeric_limits<SegmentId>::max() / 2;
constexpr double kFarAway = 0x1p1000;

JointGraph::JointGraph(const NeighborRule& rule, const std::vector<Place>& joined,
                       SegmentId id_count)
    : rule_(std::min(rule.reach, kFar), std::min(rule.arc_length, kFarAway / 2)),
      places_(joined),
      goes_beyond_(rule.reach > 1 || rule.arc_length > 0),
      near_(static_cast<std::size_t>(id_count), -1) {
  const auto precedes = [](const Place& p, const Place& q) { return isBefore(p.point, q.point); };
  std::sort(places_.begin(), places_.end(), precedes);
  const auto end = std::unique(places_.begin(), places_.end(),
                               [&](const Place& p, const Place& q) { return !precedes(p, q); });
  places_.erase(end, places_.end());
  places_.shrink_to_fit();
  const auto at = [](Node i) { return static_cast<std::size_t>(i); };

  // Each place leads to one before it of the same node, and the first one to itself.
  nodes_.resize(places_.size());
  std::iota(nodes_.begin(), nodes_.end(), 0);
  const auto firstOf = [&](const Place& place) {
    auto i = static_cast<Node>(std::lower_bound(places_.begin(), places_.end(), place, precedes) -
                               places_.begin());
    while (nodes_[at(i)] != i) i = nodes_[at(i)] = nodes_[at(nodes_[at(i)])];
    return i;
  };
  for (std::size_t k = 0; k < joined.size(); k += 2) {
    const auto [first, last] = std::minmax({firstOf(joined[k]), firstOf(joined[k + 1])});
    nodes_[at(last)] = first;
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const bool is_first = nodes_[i] == static_cast<Node>(i);
    nodes_[i] = is_first ? node_count_++ : nodes_[at(nodes_[i])];
  }

  if (rule_.reach > 1) {
    by_number_.find(*this, rule_.reach - 1, [](const Place& p, const Place& q) {
      return static_cast<double>(q.point.number - p.point.number);
    });
  }
  if (rule_.arc_length > 0) {
    by_length_.find(*this, rule_.arc_length,
                    [](const Place& p, const Place& q) { return q.arc - p.arc; });
  }
}

template <class DistanceOf>
void JointGraph::Distances::find(const JointGraph& graph, double limit, DistanceOf&& distanceOf) {
  const std::vector<Place>& places = graph.places_;
  const auto count = static_cast<std::size_t>(graph.node_count_);
  std::vector<std::size_t> begin(count + 1), of_node(places.size());
  for (const Node node : graph.nodes_) ++begin[static_cast<std::size_t>(node) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::size_t> next = begin;
  for (std::size_t i = 0; i < places.size(); ++i) {
    of_node[next[static_cast<std::size_t>(graph.nodes_[i])]++] = i;
  }

  // Nodes of many fibers come first, because many paths run through them. The others come in no
  // order, because in their order along a fiber each would be a hub of all.
  std::vector<std::size_t> ranked(count);
  std::iota(ranked.begin(), ranked.end(), std::size_t{0});
  const auto keyOf = [&](std::size_t node) {
    return std::pair(begin[node] - begin[node + 1],
                     static_cast<std::uint32_t>(node) * std::uint32_t{0x9E3779B1});
  };
  std::sort(ranked.begin(), ranked.end(),
            [&](std::size_t p, std::size_t q) { return keyOf(p) < keyOf(q); });

  std::vector<std::vector<Label>> found(count);
  const auto isKnown = [&](std::size_t p, std::size_t q, double distance) {
    const Label* const labels[] = {found[p].data(), found[q].data()};
    return areWithin(labels[0], labels[0] + found[p].size(), labels[1], labels[1] + found[q].size(),
                     distance);
  };
  using Reached = std::pair<double, std::size_t>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<Reached>> reached;
  for (std::size_t rank = 0; rank < count; ++rank) {
    const std::size_t hub = ranked[rank];
    reached.emplace(0, hub);
    while (!reached.empty()) {
      const double distance = reached.top().first;
      const std::size_t node = reached.top().second;
      reached.pop();
      if (isKnown(hub, node, distance)) continue;
      found[node].push_back({static_cast<Node>(rank), distance});
      for (std::size_t k = begin[node]; k < begin[node + 1]; ++k) {
        const std::size_t i = of_node[k];
        const auto goTo = [&](std::size_t place, double way) {
          if (distance + way > limit) return;
          reached.emplace(distance + way, static_cast<std::size_t>(graph.nodes_[place]));
        };
        const std::uint32_t fiber = places[i].point.fiber;
        if (i > 0 && places[i - 1].point.fiber == fiber) {
          goTo(i - 1, distanceOf(places[i - 1], places[i]));
        }
        if (i + 1 < places.size() && places[i + 1].point.fiber == fiber) {
          goTo(i + 1, distanceOf(places[i], places[i + 1]));
        }
      }
    }
  }

  begin_.assign(1, 0);
  begin_.reserve(count + 1);
  for (const auto& labels : found) begin_.push_back(begin_.back() + labels.size());
  labels_.reserve(begin_.back());
  for (const auto& labels : found) labels_.insert(labels_.end(), labels.begin(), labels.end());
}

bool JointGraph::Distances::areWithin(const Label* p, const Label* p_end, const Label* q,
                                      const Label* q_end, double most) {
  while (p != p_end && q != q_end) {
    if (p->hub == q->hub && p->distance + q->distance <= most) return true;
    p->hub <= q->hub ? ++p : ++q;
  }
  return false;
}

bool JointGraph::Distances::areWithin(Node p, Node q, double most) const {
  const auto i = static_cast<std::size_t>(p), j = static_cast<std::size_t>(q);
  const Label* const labels = labels_.data();
  return areWithin(labels + begin_[i], labels + begin_[i + 1], labels + begin_[j],
                   labels + begin_[j + 1], most);
}

void JointGraph::addNear(SegmentId id, const Place& from, const Place& to, const Place* before,
                         const Place* after) {
  std::int32_t& near = near_[static_cast<std::size_t>(id)];
  if (near >= 0) return;
  near = static_cast<std::int32_t>(exits_.size());
  Exits exits{{0, 0}, {kFar, kFar}, {kFarAway, kFarAway}};
  const auto set = [&](int i, const Place& place, const Place& first, const Place& last) {
    exits.node[i] = nodes_[static_cast<std::size_t>(&place - places_.data())];
    exits.segments[i] = last.point.number - first.point.number;
    exits.length[i] = last.arc - first.arc;
  };
  if (before != nullptr) set(0, *before, *before, from);
  if (after != nullptr) set(1, *after, to, *after);
  exits_.push_back(exits);
}

bool JointGraph::areNear(const Exits& a, const Exits& b) const {
  for (const int i : {0, 1}) {
    for (const int k : {0, 1}) {
      const SegmentId segments = rule_.reach - 1 - (a.segments[i] + b.segments[k]);
      if (segments > 0 && by_number_.areWithin(a.node[i], b.node[k], segments)) return true;
      const double length = rule_.arc_length - (a.length[i] + b.length[k]);
      if (rule_.arc_length > 0 && length >= 0 &&
          by_length_.areWithin(a.node[i], b.node[k], length)) {
        return true;
      }
    }
  }
  return false;
}

std::size_t JointGraph::memoryUsage() const {
  return sizeof(*this) + places_.capacity() * sizeof(Place) + nodes_.capacity() * sizeof(Node) +
         near_.capacity() * sizeof(near_[0]) + exits_.capacity() * sizeof(Exits) +
         by_number_.memoryUsage() + by_length_.memoryUsage();
}

}  // namespace fcl_fibers::fibers
