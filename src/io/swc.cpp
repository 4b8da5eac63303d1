// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/formats.h"
#include "io/text.h"

namespace fcl_fibers::io {
namespace {

constexpr std::uint64_t kShortestLine = 14;  // "0 0 0 0 0 0 0" and its end

/// Of a neuron, in the order of the file.
struct Node {
  Point point;
  double radius;
  std::int64_t id;
  std::int64_t type;
  std::int64_t parent;  ///< its id, and then its index; -1 for a root
  std::size_t children = 0;

  bool isRoot() const { return parent == -1; }
  /// A fiber begins or ends here.
  bool isEnd() const { return isRoot() || children != 1; }
  /// A root ends no fiber but its own, whose other end is the root again, if it is alone.
  bool endsFiber() const { return isRoot() ? children == 0 : children != 1; }
};

/// The next line with a node, or an empty one.
std::string_view nextLine(ByteReader& file) {
  while (!file.atEnd()) {
    const std::string_view line = trimmed(file.line());
    if (!line.empty() && line.front() != '#') return line;
  }
  return {};
}

/// Errors about a node need its line, which is looked up then, because it takes memory to keep.
template <typename... Reason>
[[noreturn]] void refuseNode(ByteReader file, std::size_t node, const Reason&... reason) {
  startText(file);
  for (std::size_t i = 0; i < node; ++i) nextLine(file);
  file.refuse(file.offsetOf(nextLine(file)), reason...);
}

/// Some programs write whole numbers with decimals, such as 1.000000.
std::int64_t wholeNumber(const ByteReader& file, std::string_view text) {
  constexpr double kLargest = 0x1p53;
  if (const std::optional<std::int64_t> number = parsedNumber<std::int64_t>(text)) return *number;
  const std::optional<double> number = parsedNumber<double>(text);
  if (number && std::abs(*number) <= kLargest && std::trunc(*number) == *number) {
    return static_cast<std::int64_t>(*number);
  }
  return file.parse<std::int64_t>(text);
}

Node readNode(const ByteReader& file, std::string_view line) {
  const std::uint64_t at = file.offsetOf(line);
  std::size_t columns = 0;
  const auto column = [&] {
    const std::string_view word = takeWord(line);
    if (word.empty()) {
      file.refuse(at, "there are ", columns, " columns; 7 are needed: id type x y z radius parent");
    }
    ++columns;
    return word;
  };
  Node node;
  node.id = wholeNumber(file, column());
  if (node.id < 0) file.refuse(at, "the id is ", node.id);
  node.type = wholeNumber(file, column());
  for (double& c : node.point) c = file.parse<double>(column());
  node.radius = file.parse<double>(column());
  if (node.radius < 0) file.refuse(at, "the radius is ", node.radius);
  node.parent = wholeNumber(file, column());
  return node;
}

/// Turns ids of parents into indices, and counts children.
void findParents(const ByteReader& file, std::vector<Node>& nodes) {
  std::vector<std::size_t> by_id(nodes.size());
  std::iota(by_id.begin(), by_id.end(), std::size_t{0});
  std::sort(by_id.begin(), by_id.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(nodes[a].id, a) < std::pair(nodes[b].id, b);
  });
  for (std::size_t i = 1; i < by_id.size(); ++i) {
    const std::int64_t id = nodes[by_id[i]].id;
    if (nodes[by_id[i - 1]].id == id) {
      refuseNode(file, by_id[i], "the id ", id, " was there before");
    }
  }
  for (Node& node : nodes) {
    if (node.isRoot()) continue;
    const auto found =
        std::lower_bound(by_id.begin(), by_id.end(), node.parent,
                         [&](std::size_t i, std::int64_t id) { return nodes[i].id < id; });
    if (found == by_id.end() || nodes[*found].id != node.parent) {
      refuseNode(file, static_cast<std::size_t>(&node - nodes.data()), "the parent ", node.parent,
                 " is not in the file; that of a root is -1");
    }
    node.parent = static_cast<std::int64_t>(*found);
    ++nodes[*found].children;
  }
}

/// Takes away tips until none is left. What remains is on a cycle, because each node has one
/// parent.
void refuseCycles(const ByteReader& file, const std::vector<Node>& nodes) {
  std::vector<std::size_t> left;
  left.reserve(nodes.size());
  for (const Node& node : nodes) left.push_back(node.children);
  for (const Node& tip : nodes) {
    if (tip.children != 0) continue;
    std::int64_t node = tip.parent;
    while (node != -1 && --left[static_cast<std::size_t>(node)] == 0) {
      node = nodes[static_cast<std::size_t>(node)].parent;
    }
  }
  const auto found = std::find_if(left.begin(), left.end(), [](std::size_t n) { return n != 0; });
  if (found == left.end()) return;
  refuseNode(file, static_cast<std::size_t>(found - left.begin()),
             "the parents of this point lead back to it");
}

std::vector<Node> readNodes(ByteReader& file) {
  std::size_t count = 0;
  for (ByteReader lines = file; !nextLine(lines).empty();) ++count;
  // Shorter lines will be refused.
  count = std::min(count, static_cast<std::size_t>((file.size() + 1) / kShortestLine));
  std::vector<Node> nodes;
  nodes.reserve(count);
  for (auto line = nextLine(file); !line.empty(); line = nextLine(file)) {
    nodes.push_back(readNode(file, line));
  }
  if (nodes.empty()) file.refuse(file.size(), "there are no points");
  findParents(file, nodes);
  refuseCycles(file, nodes);
  return nodes;
}

}  // namespace

/// Goes up from each end to where its fiber begins, so every segment is visited once.
ParsedFibers parseSwc(ByteReader& file, const FiberFileOptions& options) {
  const bool has_groups = !options.groups_from.empty();
  startText(file);
  const std::vector<Node> nodes = readNodes(file);
  std::size_t fiber_count = 0, point_count = 0;
  for (const Node& node : nodes) {
    fiber_count += node.endsFiber() ? 1 : 0;
    point_count += (!node.isRoot() || node.endsFiber() ? 1 : 0) + (node.endsFiber() ? 1 : 0);
  }
  if (point_count > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
    file.refuse(0, "there are ", point_count, " points; at most 2^31 - 1 are supported");
  }
  ParsedFibers parsed;
  parsed.reserve(point_count, fiber_count);
  std::vector<Point>& points = parsed.fibers.points;
  std::vector<std::int64_t>&samples = parsed.fibers.samples, &types = parsed.fibers.types;
  std::vector<std::int32_t>& starts_at = parsed.fibers.starts_at;
  std::vector<double> radii;
  radii.reserve(point_count);
  samples.reserve(point_count);
  types.reserve(point_count);
  starts_at.reserve(fiber_count);
  if (has_groups) parsed.groups.numbers.reserve(fiber_count);
  // By node at which fibers start: the last point of the fiber that ends there, or of a root the
  // first point of its first fiber.
  std::vector<std::int32_t> place(nodes.size(), -1);
  std::vector<const Node*> way;  // of a fiber, from its end
  for (const Node& end : nodes) {
    if (!end.endsFiber()) continue;
    const std::size_t begin = points.size();
    const Node* node = &end;
    way.assign(1, node);
    do {
      if (!node->isRoot()) node = &nodes[static_cast<std::size_t>(node->parent)];
      way.push_back(node);
    } while (!node->isEnd());
    for (auto at = way.rbegin(); at != way.rend(); ++at) {
      points.push_back((*at)->point);
      radii.push_back((*at)->radius);
      samples.push_back((*at)->id);
      types.push_back((*at)->type);
      if (!has_groups) continue;
      parsed.groups.add(static_cast<double>((*at)->type),
                        static_cast<std::size_t>(at - way.rbegin()));
    }
    parsed.endFiber();
    const auto placeOf = [&](const Node& at) -> std::int32_t& {
      return place[static_cast<std::size_t>(&at - nodes.data())];
    };
    if (!end.isRoot()) placeOf(end) = static_cast<std::int32_t>(points.size() - 1);
    if (node->isRoot() && placeOf(*node) < 0) placeOf(*node) = static_cast<std::int32_t>(begin);
    starts_at.push_back(static_cast<std::int32_t>(node - nodes.data()));
  }
  parsed.setRadii(std::move(radii));
  bool branches = false;
  for (std::size_t f = 0; f < fiber_count; ++f) {
    const std::int32_t at = place[static_cast<std::size_t>(starts_at[f])];
    const bool is_first = static_cast<std::size_t>(at) == parsed.fibers.point_begin[f];
    starts_at[f] = is_first ? -1 : at;
    branches = branches || !is_first;
  }
  if (!branches) starts_at = {};
  parsed.expectLineEnd(file);
  return parsed;
}

}  // namespace fcl_fibers::io
