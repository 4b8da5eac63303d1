// SPDX-License-Identifier: BSD-3-Clause
#include "fibers/joint_graph.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <queue>
#include <vector>

namespace fcl_fibers::fibers {

JointGraph::JointGraph(const NeighborRule& rule, const std::vector<Place>& joined,
                       SegmentId id_count)
    : most_{rule.reach - 1.0, rule.arc_length > 0 ? rule.arc_length : -1},
      places_(joined),
      near_(static_cast<std::size_t>(id_count), -1) {
  const auto precedes = [](const Place& p, const Place& q) {
    return std::pair(p.fiber, p.way[0]) < std::pair(q.fiber, q.way[0]);
  };
  std::sort(places_.begin(), places_.end(), precedes);
  const auto end = std::unique(places_.begin(), places_.end(),
                               [&](const Place& p, const Place& q) { return !precedes(p, q); });
  places_.erase(end, places_.end());
  places_.shrink_to_fit();

  // Each place leads to one before it that is the same point, and the first one to itself.
  nodes_.resize(places_.size());
  std::iota(nodes_.begin(), nodes_.end(), Node{0});
  const auto firstOf = [&](const Place& place) {
    auto i = static_cast<Node>(std::lower_bound(places_.begin(), places_.end(), place, precedes) -
                               places_.begin());
    while (nodes_[i] != i) i = nodes_[i] = nodes_[nodes_[i]];
    return i;
  };
  for (std::size_t k = 0; k < joined.size(); k += 2) {
    const auto [first, last] = std::minmax({firstOf(joined[k]), firstOf(joined[k + 1])});
    nodes_[last] = first;
  }
  for (Node& node : nodes_) node = nodes_[node];

  for (const std::size_t k : {0u, 1u}) {
    if (most_[k] <= 0) continue;
    std::vector<Labels> edges(places_.size());
    for (std::size_t i = 1; i < places_.size(); ++i) {
      if (places_[i - 1].fiber != places_[i].fiber) continue;
      const double distance = places_[i].way[k] - places_[i - 1].way[k];
      edges[nodes_[i - 1]].push_back({nodes_[i], distance});
      edges[nodes_[i]].push_back({nodes_[i - 1], distance});
    }
    hubs_[k] = hubs(edges, most_[k]);
  }
}

/// Returns the hubs of nodes, as far as they count.
/// @param edges  by node: the next ones along fibers
std::vector<JointGraph::Labels> JointGraph::hubs(const std::vector<Labels>& edges, double most) {
  // Nodes of many fibers come first, because many paths run through them. The others come in no
  // order, because in their order along a fiber each would be a hub of all.
  std::vector<Node> ranked(edges.size());
  std::iota(ranked.begin(), ranked.end(), Node{0});
  std::sort(ranked.begin(), ranked.end(), [&](Node p, Node q) {
    const auto keyOf = [&](Node node) { return std::pair(edges[node].size(), node * 0x9E3779B1u); };
    return keyOf(p) > keyOf(q);
  });

  std::vector<Labels> found(edges.size());
  using Reached = std::pair<double, Node>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> reached;
  for (Node rank = 0; rank < ranked.size(); ++rank) {
    const Node hub = ranked[rank];
    if (edges[hub].empty()) break;
    reached.emplace(0, hub);
    while (!reached.empty()) {
      const auto [distance, node] = reached.top();
      reached.pop();
      if (!(distance <= most) || areWithin(found[hub], found[node], distance)) continue;
      found[node].push_back({rank, distance});
      for (const Label& edge : edges[node]) reached.emplace(distance + edge.distance, edge.node);
    }
  }
  for (Labels& labels : found) labels.shrink_to_fit();
  return found;
}

bool JointGraph::areWithin(const Labels& of_p, const Labels& of_q, double most) {
  for (auto p = of_p.begin(), q = of_q.begin(); p != of_p.end() && q != of_q.end();) {
    if (p->node == q->node && p->distance + q->distance <= most) return true;
    p->node <= q->node ? ++p : ++q;
  }
  return false;
}

void JointGraph::add(SegmentId id, const Place& from, const Place& to, std::size_t next) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Exits exits{{0, 0}, {{kFar, kFar}, {kFar, kFar}}};
  bool is_near = false;
  for (const std::size_t end : {0u, 1u}) {
    const std::size_t i = next - 1 + end;
    if (i >= places_.size() || places_[i].fiber != from.fiber) continue;
    exits.node[end] = nodes_[i];
    for (const std::size_t k : {0u, 1u}) {
      double& way = exits.way[end][k];
      way = end == 0 ? from.way[k] - places_[i].way[k] : places_[i].way[k] - to.way[k];
      is_near |= way <= most_[k];
    }
  }
  if (!is_near) return;
  near_[static_cast<std::size_t>(id)] = static_cast<std::int32_t>(exits_.size());
  exits_.push_back(exits);
}

bool JointGraph::areNear(const Exits& a, const Exits& b) const {
  for (const int i : {0, 1}) {
    for (const int j : {0, 1}) {
      const Node p = a.node[i], q = b.node[j];
      for (const std::size_t k : {0u, 1u}) {
        const double left = most_[k] - (a.way[i][k] + b.way[j][k]);
        if (left < 0) continue;
        if (p == q || (!hubs_[k].empty() && areWithin(hubs_[k][p], hubs_[k][q], left))) return true;
      }
    }
  }
  return false;
}

std::size_t JointGraph::memoryUsage() const {
  std::size_t bytes = sizeof(*this) + places_.capacity() * sizeof(Place) +
                      nodes_.capacity() * sizeof(Node) + near_.capacity() * sizeof(near_[0]) +
                      exits_.capacity() * sizeof(Exits);
  for (const std::vector<Labels>& of_nodes : hubs_) {
    bytes += of_nodes.capacity() * sizeof(Labels);
    for (const Labels& labels : of_nodes) bytes += labels.capacity() * sizeof(Label);
  }
  return bytes;
}

}  // namespace fcl_fibers::fibers
