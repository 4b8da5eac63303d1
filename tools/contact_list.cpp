// SPDX-License-Identifier: BSD-3-Clause
#include "contact_list.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include "along_fibers.h"
#include "contact_json.h"
#include "first_of.h"

namespace fcl_fibers::tools {
namespace {

using nlohmann::ordered_json;

constexpr double kPi = 3.14159265358979323846;

bool isDeeper(const ListRow& a, const ListRow& b) {
  return std::tie(a.distance, a.pair.a, a.pair.mesh, a.pair.b) <
         std::tie(b.distance, b.pair.a, b.pair.mesh, b.pair.b);
}

/// Text lists few, and pairs along a fiber would be the deepest.
bool isListedEarlier(const ListRow& a, const ListRow& b) {
  return a.along != b.along ? b.along : isDeeper(a, b);
}

std::size_t countOnes(const std::vector<unsigned char>& flags) {
  return static_cast<std::size_t>(std::count(flags.begin(), flags.end(), 1));
}

/// None of a mesh.
PairSamples samplesOf(const CheckedFrame& frame, const FoundPair& pair) {
  const FiberPolylines& other = frame.other == nullptr ? frame.scene : *frame.other;
  return {sampleOf(frame.scene, pair.a),
          pair.mesh == kNoMesh ? sampleOf(other, pair.b) : std::nullopt};
}

/// Columns that tell the groups of both sides at the end of a row.
std::string groupColumns(Output output, const CheckedFrame::Listed& contact) {
  std::string text;
  for (const std::optional<double>& group : contact.groups) {
    const bool is_csv = output == Output::kCsv;
    text += group    ? fmt::format(is_csv ? ",{}" : " {:>8}", *group)
            : is_csv ? ","
                     : fmt::format(" {:>8}", "-");
  }
  return text;
}

/// A whole number without decimals.
ordered_json numberJson(double number) {
  const auto whole = static_cast<std::int64_t>(std::clamp(number, -9e15, 9e15));
  return number == static_cast<double>(whole) ? ordered_json(whole) : ordered_json(number);
}

struct GroupSize {
  std::size_t fibers = 0, segments = 0;
};

std::vector<GroupSize> groupSizes(const CheckedFrame& frame) {
  std::vector<GroupSize> sizes(frame.groups.size() + 1);
  for (std::size_t f = 0; f < frame.scene.fiberCount(); ++f) {
    ++sizes[frame.groupOf(f)].fibers;
    sizes[frame.groupOf(f)].segments += frame.scene.segmentCount(f);
  }
  return sizes;
}

/// The first ones, and how many more there are.
std::string fewLines(const std::vector<std::string>& lines, const char* what) {
  constexpr std::size_t kFew = 10;
  std::string text;
  for (std::size_t i = 0; i < std::min(lines.size(), kFew); ++i) text += lines[i] + "\n";
  if (lines.size() > kFew) {
    text += fmt::format("and {} more {}\n", countText(lines.size() - kFew), what);
  }
  return text;
}

}  // namespace

CheckedFrame::Listed CheckedFrame::listed(const FoundPair& pair) const {
  Listed listed{contact(pair)};
  for (const std::size_t side : {0U, 1U}) {
    if (side == 1 && pair.mesh != kNoMesh) break;
    std::size_t& fiber = (side == 0 ? listed.a : listed.b).fiber;
    const std::size_t group = other == nullptr ? groupOf(fiber) : 0;
    if (group == 0) continue;
    listed.groups[side] = groups[group - 1].number;
    fiber -= groups[group - 1].first_fiber;
  }
  return listed;
}

void ContactList::OfMesh::add(const Contact& contact) {
  if (segments == 0 || contact.a.fiber != last_fiber) ++fibers;
  least_distance = segments == 0 ? contact.distance : std::min(least_distance, contact.distance);
  last_fiber = contact.a.fiber;
  ++segments;
}

bool PairsAlong::add(const NearAlong& pair, double radii) {
  const double half_circle = kPi / 2 * radii;
  if (pair.length_between > half_circle) {
    others_.push_back(pair);
    return false;
  }
  ++count_;
  half_circle_ = std::max(half_circle_, half_circle);
  farthest_ = {std::max(farthest_.numbers_apart, pair.numbers_apart),
               std::max(farthest_.length_between, pair.length_between)};
  return true;
}

std::string PairsAlong::text() const {
  const auto fewOthers = [&](auto&& leavesOut) {
    const auto count =
        static_cast<std::size_t>(std::count_if(others_.begin(), others_.end(), leavesOut));
    return count > 0 ? fmt::format(" (and {})", counted(count, "other")) : std::string();
  };
  const auto byLength = [&](double length) {
    const std::string text = fmt::format("{:.4g}", 1.0005 * length);  // rounded up
    double advised = 0;
    std::from_chars(text.data(), text.data() + text.size(), advised);
    return text +
           fewOthers([&](const NearAlong& other) { return other.length_between <= advised; });
  };
  const std::string by_number = fmt::format("--ignored-neighbors {}{}", farthest_.numbers_apart,
                                            fewOthers([&](const NearAlong& other) {
                                              return other.numbers_apart <= farthest_.numbers_apart;
                                            }));
  // Half a circle will do for other poses, too, unless it leaves out more. A length of 0 leaves out
  // nothing.
  const std::string longer = byLength(half_circle_), shorter = byLength(farthest_.length_between);
  const bool is_shorter = longer.back() == ')' && farthest_.length_between > 0;
  const std::string by_length =
      half_circle_ > 0 ? fmt::format("--ignored-arc-length {}, or ", is_shorter ? shorter : longer)
                       : "";
  return fmt::format(
      "{} of the pairs {} near along {} thick beside its segments; {}{}, leaves {} out",
      countText(count_), count_ == 1 ? "is" : "are",
      branches ? "a fiber or across a branch, which is" : "one fiber, which is", by_length,
      by_number, count_ == 1 ? "it" : "them");
}

void ContactList::countDepth(const FoundContact& contact, double radii, bool is_along) {
  const double depth = radii > 0 ? -contact.distance / radii : 0;
  if (contact.distance > 0) {
    ++apart;
    apart_along += is_along ? 1 : 0;
  } else if (contact.mesh != kNoMesh && -contact.distance > radii) {
    ++deeper;
  } else {
    const auto bin = std::upper_bound(kDepths.begin() + 1, kDepths.end() - 1, depth);
    const auto number = static_cast<std::size_t>(bin - kDepths.begin()) - 1;
    ++depths[number];
    depths_along[number] += is_along ? 1 : 0;
  }
}

ContactList::ContactList(const CheckedFrame& frame) : meshes(frame.meshes.size()) {
  const bool by_depth = frame.request.order == Request::Order::kDepth;
  const std::size_t top = frame.request.top.value_or(std::numeric_limits<std::size_t>::max());
  const auto isEarlier = frame.request.output == Output::kText ? isListedEarlier : isDeeper;
  FirstOf<ListRow> deepest(top, isEarlier);
  const AlongFibers along_fibers(frame.scene);
  const FiberPolylines& other = frame.other == nullptr ? frame.scene : *frame.other;
  std::vector<unsigned char> segments(other.points.size()), fibers(other.fiberCount());
  least_distance = std::numeric_limits<double>::infinity();

  std::size_t fiber_a = 0;
  // Of fiber a: its row with each fiber b, and after these with each mesh.
  std::map<std::pair<std::int32_t, std::size_t>, ListRow> of_fiber;
  const auto add = [&](const ListRow& row) {
    ++row_count;
    if (by_depth) {
      deepest.add(row);
    } else if (rows.size() < top) {
      rows.push_back(row);
    }
  };
  const auto endFiber = [&] {
    for (const auto& [with, row] : of_fiber) add(row);
    of_fiber.clear();
  };

  for (const FoundPair& pair : frame.found.pairs) {
    const FoundContact contact = frame.contact(pair);
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    double radii = frame.scene.radiusAt(a), radii_there = frame.scene.radiusAt(a, contact.s);
    bool is_along = false;
    if (pair.mesh != kNoMesh) {
      meshes[static_cast<std::size_t>(pair.mesh)].add(contact);
    } else {
      segments[b] = fibers[contact.b.fiber] = 1;
      radii += other.radiusAt(b);
      radii_there += other.radiusAt(b, contact.t);
      std::optional<NearAlong> near;
      if (frame.other == nullptr && contact.a.fiber == contact.b.fiber) {
        near = along_fibers.near(contact.a.fiber, contact.pair);
      } else if (frame.other == nullptr && along_fibers.hasBranches()) {
        near = along_fibers.nearAcross(contact.pair, kPi / 2 * radii, 0);
        along.branches = along.branches || near;
      }
      is_along = near && along.add(*near, radii);
      if (!frame.groups.empty()) {
        const auto numbers =
            std::minmax({frame.groupOf(contact.a.fiber), frame.groupOf(contact.b.fiber)});
        OfGroups& of_groups = groups[numbers];
        ++of_groups.count;
        of_groups.least_distance = std::min(of_groups.least_distance, contact.distance);
      }
    }
    least_distance = std::min(least_distance, contact.distance);
    if (!is_along) least_of_others = std::min(least_of_others, contact.distance);
    countDepth(contact, radii_there, is_along);
    const ListRow row = {contact.distance, pair, 1, is_along};
    if (!frame.request.summary) {
      add(row);
      continue;
    }
    if (contact.a.fiber != fiber_a) endFiber();
    fiber_a = contact.a.fiber;
    ListRow& group =
        of_fiber.try_emplace({pair.mesh, contact.b.fiber}, ListRow{row.distance, pair, 0, is_along})
            .first->second;
    const std::uint32_t contacts = group.contacts + 1;
    if (isEarlier(row, group)) group = row;
    group.contacts = contacts;
  }
  endFiber();
  if (by_depth) rows = deepest.take();
  other_segments = countOnes(segments);
  other_fibers = countOnes(fibers);
}

std::string sampleNames(Output output) {
  if (output == Output::kCsv) return ",sample_a,type_a,sample_b,type_b";
  const std::string side = fmt::format(" {:>8} {:>6}", "sample", "type");
  return side + side;
}

std::string sampleColumns(Output output, const PairSamples& samples) {
  std::string text;
  for (const std::optional<Sample>& sample : samples) {
    const bool is_csv = output == Output::kCsv;
    text += sample   ? fmt::format(is_csv ? ",{},{}" : " {:>8} {:>6}", sample->number, sample->type)
            : is_csv ? ",,"
                     : fmt::format(" {:>8} {:>6}", "-", "-");
  }
  return text;
}

void writeCsvHead(const Request& request, bool several, bool groups, bool samples,
                  AnswerStream& stream) {
  stream.write(several ? "frame," : "");
  stream.write(request.summary ? "contacts," : "");
  stream.write(
      "fiber_a,number_a,s,fiber_b,number_b,t,distance,point_a_x,point_a_y,point_a_z,point_b_x,"
      "point_b_y,point_b_z,normal_x,normal_y,normal_z");
  if (!request.meshes.paths.empty()) {
    stream.write(",mesh,triangle,weight_0,weight_1,weight_2,solid");
  }
  stream.write(groups ? ",group_a,group_b" : "");
  stream.write((samples ? sampleNames(Output::kCsv) : "") + "\n");
}

void writeCsv(const CheckedFrame& frame, const ContactList& list, AnswerStream& stream) {
  for (const ListRow& row : list.rows) {
    const CheckedFrame::Listed c = frame.listed(row.pair);
    const bool is_mesh = c.mesh != kNoMesh;
    if (frame.number) stream.write(fmt::format("{},", *frame.number));
    if (frame.request.summary) stream.write(fmt::format("{},", row.contacts));
    stream.write(fmt::format("{},{},{},", c.a.fiber, c.a.number, c.s));
    stream.write(is_mesh ? ",,," : fmt::format("{},{},{},", c.b.fiber, c.b.number, c.t));
    stream.write(fmt::format("{}", c.distance));
    for (const std::array<double, 3>& vector : {c.point_a, c.point_b, c.normal}) {
      stream.write(fmt::format(",{},{},{}", vector[0], vector[1], vector[2]));
    }
    if (is_mesh) {
      stream.write(fmt::format(",{},{},{},{},{},{:d}", c.mesh, c.triangle, c.weights[0],
                               c.weights[1], c.weights[2], c.solid));
    } else if (!frame.meshes.empty()) {
      stream.write(",,,,,,");
    }
    if (!frame.groups.empty()) stream.write(groupColumns(Output::kCsv, c));
    if (frame.samples) stream.write(sampleColumns(Output::kCsv, samplesOf(frame, row.pair)));
    stream.write("\n");
  }
}

std::string openJson(const ordered_json& object) {
  std::string text = object.dump(1);
  text.resize(text.size() - 2);  // "\n}"
  return text;
}

void writeJson(const CheckedFrame& frame, const ContactList& list, ordered_json head,
               AnswerStream& stream) {
  if (frame.number) head["frame"] = *frame.number;
  head["scene"] = frame.title;
  head["fibers"] = frame.scene.fiberCount();
  head["segments"] = frame.scene.segmentCount();
  head["radius"] = radiusJson(frame.scene);
  const std::vector<GroupSize> sizes = groupSizes(frame);
  for (std::size_t g = 0; g < frame.groups.size(); ++g) {
    const SceneGroup& group = frame.groups[g];
    ordered_json item = {{"group", numberJson(group.number)}};
    if (!group.name.empty()) item["scene"] = group.name;
    item.update({{"fibers", sizes[g + 1].fibers}, {"segments", sizes[g + 1].segments}});
    head["groups"].push_back(item);
  }
  if (frame.other != nullptr) {
    head["against"] = {{"scene", frame.other_title},
                       {"fibers", frame.other->fiberCount()},
                       {"segments", frame.other->segmentCount()},
                       {"radius", radiusJson(*frame.other)},
                       {"touching_segments", list.other_segments},
                       {"touching_fibers", list.other_fibers}};
  }
  for (std::size_t m = 0; m < frame.meshes.size(); ++m) {
    const MeshFile& mesh = frame.meshes[m];
    const ContactList::OfMesh& of_mesh = list.meshes[m];
    head["meshes"].push_back(
        {{"mesh", mesh.name},
         {"triangles", mesh.mesh.triangleCount()},
         {"solid", mesh.mesh.kind() == TriangleMesh::Kind::kSolid},
         {"touching_segments", of_mesh.segments},
         {"touching_fibers", of_mesh.fibers},
         {"least_distance",
          of_mesh.segments > 0 ? ordered_json(of_mesh.least_distance) : ordered_json()}});
  }
  head["seconds"] = frame.seconds;
  head["complete"] = frame.found.complete;
  head["contact_count"] = frame.count();
  head["touching_segments"] = frame.found.touching_segments;
  head["touching_fibers"] = frame.found.touching_fibers;
  head["least_distance"] = frame.count() > 0 ? ordered_json(list.least_distance) : ordered_json();
  head["along_count"] = list.along.count();
  head["least_distance_of_others"] =
      std::isfinite(list.least_of_others) ? ordered_json(list.least_of_others) : ordered_json();
  if (!frame.groups.empty()) head["group_pairs"] = ordered_json::array();
  for (const auto& [numbers, of_groups] : list.groups) {
    const auto number = [&](std::size_t group) {
      return group == 0 ? ordered_json() : numberJson(frame.groups[group - 1].number);
    };
    head["group_pairs"].push_back({{"group_a", number(numbers.first)},
                                   {"group_b", number(numbers.second)},
                                   {"contact_count", of_groups.count},
                                   {"least_distance", of_groups.least_distance}});
  }
  ordered_json& depths = head["depths"] = ordered_json::array();
  for (std::size_t i = 0; i < list.depths.size(); ++i) {
    depths.push_back({{"from", ContactList::kDepths[i]},
                      {"to", ContactList::kDepths[i + 1]},
                      {"pairs", list.depths[i]},
                      {"along", list.depths_along[i]}});
  }
  if (!frame.meshes.empty()) {
    depths.push_back({{"from", 1.0}, {"to", nullptr}, {"pairs", list.deeper}});
  }
  stream.write(openJson(head));
  stream.write(frame.request.summary ? ",\n \"fiber_pairs\": [" : ",\n \"contacts\": [");
  const char* between = "\n  ";
  for (const ListRow& row : list.rows) {
    const CheckedFrame::Listed c = frame.listed(row.pair);
    ordered_json item;
    if (frame.request.summary) item["contacts"] = row.contacts;
    const FiberPolylines& other = frame.other == nullptr ? frame.scene : *frame.other;
    item.update(c.mesh == kNoMesh ? contactJson(c, frame.scene, other)
                                  : meshContactJson(c, frame.scene));
    if (c.groups[0]) item["group_a"] = numberJson(*c.groups[0]);
    if (c.groups[1]) item["group_b"] = numberJson(*c.groups[1]);
    stream.write(between + item.dump());
    between = ",\n  ";
  }
  stream.write("\n ]\n}");
}

namespace {

std::string histogram(const ContactList& list) {
  constexpr std::size_t kWidth = 30;
  std::string text = "\ndepth, in percent of the sum of the radii";
  text += list.meshes.empty() ? "\n" : "; in a mesh, of the radius\n";
  std::array<std::size_t, std::tuple_size_v<decltype(list.depths)>> depths = list.depths;
  for (std::size_t i = 0; i < depths.size(); ++i) depths[i] -= list.depths_along[i];
  const std::size_t apart = list.apart - list.apart_along;
  const std::size_t most = std::max(
      {apart, list.deeper, list.along.count(), *std::max_element(depths.begin(), depths.end())});
  const auto line = [&](const std::string& name, std::size_t pairs) {
    // Any pair gets a mark.
    const std::size_t width = (pairs * kWidth + most - 1) / most;
    text += fmt::format("{:>12} {:>13}  {}", name, countText(pairs), std::string(width, '#'));
    text.erase(text.find_last_not_of(' ') + 1);
    text += '\n';
  };
  if (apart > 0) line("apart", apart);
  for (std::size_t i = 0; i < list.depths.size(); ++i) {
    line(fmt::format("{:.0f} to {:.0f}", 100 * ContactList::kDepths[i],
                     100 * ContactList::kDepths[i + 1]),
         depths[i]);
  }
  if (!list.meshes.empty()) line("over 100", list.deeper);
  if (list.along.count() > 0) line("along", list.along.count());
  return text;
}

}  // namespace

void writeText(const CheckedFrame& frame, const ContactList& list, AnswerStream& stream) {
  const Request& request = frame.request;
  const auto size = [](std::size_t segments, std::size_t fibers) {
    return counted(segments, "segment") + " of " + counted(fibers, "fiber");
  };
  std::string text =
      frame.title + ": " + size(frame.scene.segmentCount(), frame.scene.fiberCount()) + "\n";
  if (frame.other != nullptr) {
    text += "against " + frame.other_title + ": " +
            size(frame.other->segmentCount(), frame.other->fiberCount()) + "\n";
  }
  const std::vector<GroupSize> sizes = groupSizes(frame);
  std::vector<std::string> lines;
  for (std::size_t g = 0; g < frame.groups.size(); ++g) {
    lines.push_back(frame.groups[g].text() + ": " +
                    size(sizes[g + 1].segments, sizes[g + 1].fibers));
  }
  text += fewLines(lines, "groups");
  for (const MeshFile& mesh : frame.meshes) {
    text += "with " + mesh.name + ": " + counted(mesh.mesh.triangleCount(), "triangle") +
            (mesh.mesh.kind() == TriangleMesh::Kind::kSolid ? ", solid\n" : "\n");
  }
  const bool one = frame.count() == 1;
  const char* const what = request.tree.report == Report::kCapsules
                               ? (one ? "pair touches" : "pairs touch")
                           : one ? "pair of volumes overlaps"
                                 : "pairs of volumes overlap";
  text +=
      fmt::format("{}{} {}: {}", frame.found.complete ? "" : "at least ", countText(frame.count()),
                  what, size(frame.found.touching_segments, frame.found.touching_fibers));
  if (frame.other != nullptr) text += " against " + size(list.other_segments, list.other_fibers);
  for (std::size_t m = 0; m < frame.meshes.size(); ++m) {
    const ContactList::OfMesh& of_mesh = list.meshes[m];
    text += fmt::format("\n{} touches {}", frame.meshes[m].name,
                        size(of_mesh.segments, of_mesh.fibers));
  }
  if (list.along.count() > 0) text += "\n" + list.along.text();
  text += "\n";
  lines.clear();
  for (const auto& [numbers, of_groups] : list.groups) {
    const auto name = [&](std::size_t group) {
      return group == 0 ? "none" : fmt::format("{}", frame.groups[group - 1].number);
    };
    lines.push_back(fmt::format("groups {} and {}: {}", name(numbers.first), name(numbers.second),
                                counted(of_groups.count, "pair")));
  }
  if (lines.size() > 1) text += fewLines(lines, "pairs of groups");
  text += fmt::format("built and searched in {:.3g} s\n", frame.seconds);
  stream.write(text);
  if (frame.count() == 0) return;

  std::size_t width = 8;  // of what touches
  for (const MeshFile& mesh : frame.meshes) width = std::max(width, mesh.name.size());
  const bool meshes = !frame.meshes.empty();
  const char* const fiber = meshes ? "with" : "fiber";
  stream.write(
      fmt::format("\n{:>8} {:>8}   {:>{}} {:>8}", "fiber", "number", fiber, width, "number"));
  if (request.summary) stream.write(fmt::format(" {:>8}", "contacts"));
  stream.write(fmt::format(" {:>12}", "distance"));
  if (!frame.groups.empty()) stream.write(fmt::format(" {:>8} {:>8}", "group", "group"));
  if (frame.samples) stream.write(sampleNames(Output::kText));
  if (request.summary) stream.write(fmt::format(" {:>10} {:>10} {:>10}", "x", "y", "z"));
  stream.write("\n");
  for (const ListRow& row : list.rows) {
    const CheckedFrame::Listed c = frame.listed(row.pair);
    const bool is_mesh = c.mesh != kNoMesh;
    const std::string with = is_mesh  ? frame.meshes[static_cast<std::size_t>(c.mesh)].name
                             : meshes ? fmt::format("fiber {}", c.b.fiber)
                                      : fmt::format("{}", c.b.fiber);
    const std::size_t number = is_mesh ? static_cast<std::size_t>(c.triangle) : c.b.number;
    stream.write(
        fmt::format("{:>8} {:>8}   {:>{}} {:>8}", c.a.fiber, c.a.number, with, width, number));
    if (request.summary) stream.write(fmt::format(" {:>8}", countText(row.contacts)));
    stream.write(fmt::format(" {:>12.4g}", c.distance));
    if (!frame.groups.empty()) stream.write(groupColumns(Output::kText, c));
    if (frame.samples) stream.write(sampleColumns(Output::kText, samplesOf(frame, row.pair)));
    if (request.summary) {
      const auto& [x, y, z] = c.point_a;
      stream.write(fmt::format(" {:>10.4g} {:>10.4g} {:>10.4g}", x, y, z));
    }
    stream.write(row.along ? "  along\n" : "\n");
  }
  if (const std::size_t more = list.row_count - list.rows.size(); more > 0) {
    stream.write(fmt::format("and {} more; --top N lists more, --csv and --json list all\n",
                             countText(more)));
  }
  if (frame.count() > 1) stream.write(histogram(list));
}

}  // namespace fcl_fibers::tools
