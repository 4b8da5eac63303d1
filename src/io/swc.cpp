// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/formats.h"
#include "io/point_radii.h"
#include "io/text.h"

namespace fcl_fibers::io {
namespace {

constexpr std::uint64_t kShortestLine = 14;  // "0 0 0 0 0 0 0" and its end
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// The next line with a node, or an empty one.
struct NodeLine {
  std::uint64_t at = 0;
  std::string_view text;
};

NodeLine nextLine(ByteReader& file) {
  while (!file.atEnd()) {
    const NodeLine line = {file.offset(), trimmed(file.line())};
    if (!line.text.empty() && line.text.front() != '#') return line;
  }
  return {};
}

/// A neuron's points in the order of the file.
struct Nodes {
  std::vector<Point> points;
  std::vector<double> radii;
  std::vector<std::size_t> parents;   ///< kNone for a root
  std::vector<std::size_t> children;  ///< their number

  std::size_t size() const { return points.size(); }
  bool isRoot(std::size_t node) const { return parents[node] == kNone; }
  /// A fiber ends here, and those of the children begin. A root begins fibers but ends none.
  bool isEnd(std::size_t node) const { return children[node] != 1; }
};

/// Errors about a node need its line, which is looked up then, because it takes memory to keep.
template <typename... Reason>
[[noreturn]] void refuseNode(ByteReader file, std::size_t node, const Reason&... reason) {
  startText(file);
  NodeLine line;
  for (std::size_t i = 0; i <= node; ++i) line = nextLine(file);
  file.refuse(line.at, reason...);
}

struct Ids {
  std::vector<std::int64_t> own, parent;
};

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

void readNode(ByteReader& file, const NodeLine& line, Nodes& nodes, Ids& ids) {
  std::size_t columns = 0;
  std::string_view rest = line.text;
  const auto column = [&] {
    const std::string_view word = takeWord(rest);
    if (word.empty()) {
      file.refuse(line.at, "there are ", columns,
                  " columns; 7 are needed: id type x y z radius parent");
    }
    ++columns;
    return word;
  };
  ids.own.push_back(wholeNumber(file, column()));
  if (ids.own.back() < 0) file.refuse(line.at, "the id is ", ids.own.back());
  wholeNumber(file, column());  // The type is checked, because it tells what a column is.
  Point point;
  for (double& c : point) c = file.parse<double>(column());
  nodes.points.push_back(point);
  nodes.radii.push_back(file.parse<double>(column()));
  if (nodes.radii.back() < 0) file.refuse(line.at, "the radius is ", nodes.radii.back());
  ids.parent.push_back(wholeNumber(file, column()));
}

Ids readNodes(ByteReader& file, Nodes& nodes) {
  std::uint64_t count = 0;
  for (ByteReader lines = file; !nextLine(lines).text.empty();) ++count;
  // Shorter lines will be refused.
  count = std::min(count, (file.size() + 1) / kShortestLine);
  Ids ids;
  const auto reserve = [&](auto& vector) { vector.reserve(static_cast<std::size_t>(count)); };
  reserve(nodes.points);
  reserve(nodes.radii);
  reserve(ids.own);
  reserve(ids.parent);
  for (NodeLine line = nextLine(file); !line.text.empty(); line = nextLine(file)) {
    readNode(file, line, nodes, ids);
  }
  if (nodes.points.empty()) file.refuse(file.size(), "there are no points");
  return ids;
}

void findParents(const ByteReader& file, const Ids& ids, Nodes& nodes) {
  std::vector<std::size_t> by_id(nodes.size());
  std::iota(by_id.begin(), by_id.end(), std::size_t{0});
  std::sort(by_id.begin(), by_id.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(ids.own[a], a) < std::pair(ids.own[b], b);
  });
  for (std::size_t i = 1; i < by_id.size(); ++i) {
    if (ids.own[by_id[i - 1]] != ids.own[by_id[i]]) continue;
    refuseNode(file, by_id[i], "the id ", ids.own[by_id[i]], " was there before");
  }
  nodes.parents.reserve(nodes.size());
  for (std::size_t node = 0; node < nodes.size(); ++node) {
    const std::int64_t parent = ids.parent[node];
    if (parent == -1) {
      nodes.parents.push_back(kNone);
      continue;
    }
    const auto found =
        std::lower_bound(by_id.begin(), by_id.end(), parent,
                         [&](std::size_t i, std::int64_t id) { return ids.own[i] < id; });
    if (found == by_id.end() || ids.own[*found] != parent) {
      refuseNode(file, node, "the parent ", parent, " is not in the file; that of a root is -1");
    }
    nodes.parents.push_back(*found);
  }
}

void countChildren(Nodes& nodes) {
  nodes.children.resize(nodes.size());
  for (const std::size_t parent : nodes.parents) {
    if (parent != kNone) ++nodes.children[parent];
  }
}

/// Takes away tips until none is left. What remains is on a cycle, because each node has one
/// parent.
void refuseCycles(const ByteReader& file, const Nodes& nodes) {
  std::vector<std::size_t> left = nodes.children;
  for (std::size_t tip = 0; tip < nodes.size(); ++tip) {
    if (nodes.children[tip] != 0) continue;
    std::size_t node = nodes.parents[tip];
    while (node != kNone && --left[node] == 0) node = nodes.parents[node];
  }
  const auto found = std::find_if(left.begin(), left.end(), [](std::size_t n) { return n != 0; });
  if (found == left.end()) return;
  refuseNode(file, static_cast<std::size_t>(found - left.begin()),
             "the parents of this point lead back to it");
}

Nodes readNeurons(ByteReader& file) {
  Nodes nodes;
  const Ids ids = readNodes(file, nodes);
  findParents(file, ids, nodes);
  countChildren(nodes);
  refuseCycles(file, nodes);
  return nodes;
}

/// Goes up from each end to where its fiber begins, so every segment is visited once.
class FiberMaker {
 public:
  FiberMaker(const Nodes& nodes, ParsedFibers& parsed) : nodes_(nodes), parsed_(parsed) {}

  std::vector<double> make() {
    reserve();
    for (std::size_t node = 0; node < nodes_.size(); ++node) {
      if (!nodes_.isEnd(node)) continue;
      if (!nodes_.isRoot(node)) {
        addFiber(node);
      } else if (nodes_.children[node] == 0) {
        add(node);
        add(node);
        parsed_.endFiber();
      }
    }
    return std::move(radii_);
  }

 private:
  void reserve() {
    std::size_t fibers = 0, points = 0;
    for (std::size_t node = 0; node < nodes_.size(); ++node) {
      const bool is_lone = nodes_.isRoot(node) && nodes_.children[node] == 0;
      const bool is_segment = !nodes_.isRoot(node);
      const bool is_fiber = is_lone || (is_segment && nodes_.isEnd(node));
      fibers += is_fiber ? 1 : 0;
      points += (is_segment || is_lone ? 1 : 0) + (is_fiber ? 1 : 0);
    }
    parsed_.fibers.points.reserve(points);
    parsed_.fibers.point_begin.reserve(fibers + 1);
    radii_.reserve(points);
  }

  void add(std::size_t node) {
    parsed_.fibers.points.push_back(nodes_.points[node]);
    radii_.push_back(nodes_.radii[node]);
  }

  void addFiber(std::size_t node) {
    add(node);
    do {
      node = nodes_.parents[node];
      add(node);
    } while (!nodes_.isRoot(node) && !nodes_.isEnd(node));
    const auto begin = static_cast<std::ptrdiff_t>(parsed_.fibers.point_begin.back());
    std::reverse(parsed_.fibers.points.begin() + begin, parsed_.fibers.points.end());
    std::reverse(radii_.begin() + begin, radii_.end());
    parsed_.endFiber();
  }

  const Nodes& nodes_;
  ParsedFibers& parsed_;
  std::vector<double> radii_;
};

void warnOfBranches(const Nodes& nodes, ParsedFibers& parsed) {
  const auto branches = std::count_if(nodes.children.begin(), nodes.children.end(),
                                      [](std::size_t children) { return children > 1; });
  if (branches == 0) return;
  parsed.warnings.push_back((branches == 1 ? "1 branching point is"
                                           : std::to_string(branches) + " branching points are") +
                            " split, which gives " + std::to_string(parsed.fibers.fiberCount()) +
                            " fibers that touch where they meet.");
}

}  // namespace

ParsedFibers parseSwc(ByteReader& file) {
  startText(file);
  const Nodes nodes = readNeurons(file);
  ParsedFibers parsed;
  std::vector<double> radii = FiberMaker(nodes, parsed).make();
  setPointRadii(parsed.fibers, std::move(radii));
  parsed.holds_radii = true;
  warnOfBranches(nodes, parsed);
  expectLineEnd(file, parsed);
  return parsed;
}

}  // namespace fcl_fibers::io
