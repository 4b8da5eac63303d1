// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tools/answer_stream.h"
#include "tools/commands.h"
#include "tools/output_file.h"
#include "tools/step_impacts.h"
#include "tools/trade/front.h"
#include "tools/trade/measure.h"

namespace fcl_fibers::tools {
namespace {

using nlohmann::ordered_json;
using namespace trade;

constexpr double kMostTests = 4e9;  ///< of the judge: some ten seconds

ordered_json jsonOf(const Errors& errors) {
  return {{"median", errors.median}, {"worst", errors.worst}, {"count", errors.count}};
}
Errors errorsOf(const ordered_json& json) {
  return {json.at("median"), json.at("worst"), json.at("count")};
}

ordered_json jsonOf(const Outcome& o) {
  if (o.is_ended) return {{"ended", true}, {"bytes", o.bytes}};
  return {{"ended", false},
          {"seconds", o.seconds},
          {"lower_quartile", o.low},
          {"upper_quartile", o.high},
          {"times_default", o.times},
          {"bytes", o.bytes},
          {"reported", o.reported},
          {"contacts", o.contacts},
          {"missed", o.missed},
          {"missed_share", o.missed_share},
          {"missed_share_at_most", o.most_missed},
          {"judged", o.judged},
          {"false", o.wrong},
          {"false_share", o.false_share},
          {"false_share_at_most", o.most_false},
          {"depth_error", jsonOf(o.depth)},
          {"normal_error", jsonOf(o.normal)},
          {"place_error", jsonOf(o.place)}};
}
Outcome outcomeOf(const ordered_json& json) {
  Outcome o;
  o.is_ended = json.at("ended");
  o.bytes = json.at("bytes");
  if (o.is_ended) return o;
  o.seconds = json.at("seconds");
  o.low = json.at("lower_quartile");
  o.high = json.at("upper_quartile");
  o.times = json.at("times_default");
  o.reported = json.at("reported");
  o.contacts = json.at("contacts");
  o.missed = json.at("missed");
  o.missed_share = json.at("missed_share");
  o.most_missed = json.at("missed_share_at_most");
  o.false_share = json.at("false_share");
  o.most_false = json.at("false_share_at_most");
  o.judged = json.at("judged");
  o.wrong = json.at("false");
  o.depth = errorsOf(json.at("depth_error"));
  o.normal = errorsOf(json.at("normal_error"));
  o.place = errorsOf(json.at("place_error"));
  return o;
}

/// FNV-1a (Fowler, Noll and Vo).
class Hash {
 public:
  template <typename T>
  void add(const std::vector<T>& values) {
    const auto* const bytes = reinterpret_cast<const unsigned char*>(values.data());
    for (std::size_t i = 0; i < values.size() * sizeof(T); ++i) {
      value_ = (value_ ^ bytes[i]) * 0x100000001B3u;
    }
  }
  void add(const FiberPolylines& fibers) {
    add(fibers.points);
    add(fibers.point_begin);
    add(fibers.radii);
    add(fibers.closed);
    add(fibers.starts_at);
    add(fibers.ends_at);
    add(std::vector<double>{fibers.radius, fibers.hasRadiiOfPoints() ? 1.0 : 0.0});
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325u;
};

/// The rows that a run has measured, in the user's cache until all are: a run that is stopped is
/// gone on with.
class Notes {
 public:
  Notes(const Scene& scene, double longest, bool again) {
    Hash hash;
    hash.add(scene.fibers);
    for (const FiberPolylines& end : scene.end) hash.add(end);
    for (const MeshFile& mesh : scene.meshes) {
      hash.add(mesh.points);
      hash.add(mesh.triangles);
    }
    hash.add(std::vector<double>{longest});
    hash.add(scene.before);
    // Another program measures anew.
#ifdef NDEBUG
    const std::string program = programName() + FCL_FIBERS_VERSION;
#else
    const std::string program = programName() + FCL_FIBERS_VERSION + " debug";
#endif
    hash.add(std::vector<char>(program.begin(), program.end()));
    const char* const cache = std::getenv("XDG_CACHE_HOME");
    const char* const home = std::getenv("HOME");
    if (cache != nullptr && *cache != '\0') {
      path_ = cache;
    } else if (home != nullptr && *home != '\0') {
      path_ = std::filesystem::path(home) / ".cache";
    } else {
      return;  // then a run that is stopped is lost
    }
    path_ = path_ / "fcl_fibers" / fmt::format("trade-{:016x}.json", hash.value());
    if (again) return;
    // What cannot be read counts as nothing.
    std::ifstream file(path_);
    const ordered_json json = ordered_json::parse(file, nullptr, /*allow_exceptions=*/false);
    if (!json.is_object()) return;
    try {
      for (const auto& [name, outcome] : json.items()) outcomes_[name] = outcomeOf(outcome);
    } catch (const ordered_json::exception&) {
      outcomes_.clear();
    }
  }

  const Outcome* find(const std::string& name) const {
    const auto found = outcomes_.find(name);
    return found == outcomes_.end() ? nullptr : &found->second;
  }
  bool isEmpty() const { return outcomes_.empty(); }

  void add(const std::string& name, const Outcome& outcome) {
    outcomes_[name] = outcome;
    if (path_.empty()) return;
    ordered_json json;
    for (const auto& [other, known] : outcomes_) json[other] = jsonOf(known);
    std::error_code ignored;
    std::filesystem::create_directories(path_.parent_path(), ignored);
    try {
      OutputFile file(path_.string());
      file.write(json.dump());
      file.commit();
    } catch (const std::runtime_error& error) {
      warn("trade", std::string(error.what()) + "; a run that is stopped cannot be gone on with");
      path_.clear();
    }
  }

  void remove() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove(path_, ignored);
  }

 private:
  std::filesystem::path path_;
  std::map<std::string, Outcome> outcomes_;
};

void tellProgress(const std::string& what, double share) {
  constexpr int kWidth = 30;
  const int done = std::clamp(static_cast<int>(share * kWidth), 0, kWidth);
  progress(fmt::format("[{:#<{}}{:.<{}}] {}", "", done, "", kWidth - done, what));
}

/// What the question is about: pairs of fibers, fibers and meshes, or a step.
const char* questionOf(const Scene& scene) {
  if (scene.isStep()) return "pairs that touch during the step";
  return scene.meshes.empty() ? "pairs of segments that touch" : "segments that touch the mesh";
}

std::string errorText(const Errors& errors) {
  return errors.count > 0 ? fmt::format("{:.1g}", errors.median) : "-";
}

void printRows(const std::vector<Row>& rows, std::size_t segments, AnswerStream& stream) {
  std::size_t width = 8;
  for (const Row& row : rows) width = std::max(width, row.dial.size() + 2 + row.value.size());
  stream.write(fmt::format("\n  {:<{}} {:>9} {:>6} {:>6} {:>9} {:>9} {:>8} {:>8} {:>8}\n", "",
                           width, "time", "times", "bytes", "missed", "false", "depth", "normal",
                           "place"));
  std::string same;
  for (const Row& row : rows) {
    const Outcome& o = row.outcome;
    const std::string name = row.dial + ": " + row.value;
    if (&row != &rows.front() && showsNoDifference(row, rows.front())) {
      same += (same.empty() ? "" : "; ") + name;
      continue;
    }
    const double bytes_of_one = static_cast<double>(o.bytes) / static_cast<double>(segments);
    const std::string bytes = o.bytes > 0 ? fmt::format("{:.0f}", bytes_of_one) : "-";
    if (o.is_ended) {
      stream.write(fmt::format("  {:<{}} {:>9} {:>6} {:>6}\n", name, width, "ended", "", bytes));
      continue;
    }
    stream.write(fmt::format("{} {:<{}} {:>9} {:>6.2f} {:>6} {:>9} {:>9} {:>8} {:>8} {:>8}\n",
                             row.is_on_front ? "*" : " ", name, width, timeText(o.seconds), o.times,
                             bytes, shareText(o.missed_share), shareText(o.false_share),
                             errorText(o.depth), errorText(o.normal), errorText(o.place)));
  }
  if (!same.empty()) stream.write("\nAs the first row: " + same + "\n");
  stream.write(
      "\n* No other is better in time, missed and false together. Times are medians of a frame, "
      "and "
      "their\nmultiples of those of the first row, which took turns with it. Bytes are of a "
      "segment. "
      "Depth and place\nare median errors in radii, normal in degrees, of the contacts that were "
      "found. What is ended took too\nlong, or found more than 10,000,000 pairs.\n");
}

std::string indented(const std::string& lines, const char* first) {
  std::string text;
  std::size_t begin = 0;
  while (begin < lines.size()) {
    const std::size_t end = lines.find('\n', begin);
    text += fmt::format("  {:<8}{}\n", begin == 0 ? first : "", lines.substr(begin, end - begin));
    begin = end + 1;
  }
  return text;
}

void printChoice(const std::vector<Row>& rows, const Wish& wish, bool is_sample,
                 AnswerStream& stream) {
  // Shares that are asked for are of all pairs; what is not asked for is of those that were judged.
  std::string wished = wish.missed > 0 ? "missing at most " + shareText(wish.missed)
                       : is_sample     ? "missing nothing of the sample"
                                       : "missing nothing";
  if (wish.wrong > 0) wished += ", with at most " + shareText(wish.wrong) + " false pairs";
  if (wish.wrong == 0)
    wished += is_sample ? ", without false pairs of the sample" : ", without false pairs";
  if (wish.seconds) wished += ", within " + timeText(*wish.seconds);
  const Row* const best = choose(rows, wish);
  if (best == nullptr) {
    stream.write("\nNo setting is " + wished + ". Ask for less: --miss, --false, --budget.\n");
    return;
  }
  std::string bounds;
  if (is_sample) {
    bounds = fmt::format(" (at most {} missed and {} false, with 97.5 % confidence)",
                         shareText(best->outcome.most_missed), shareText(best->outcome.most_false));
  }
  stream.write(fmt::format("\nThe fastest, {}: {}: {}, {}{}\n{}{}", wished, best->dial, best->value,
                           timeText(best->outcome.seconds), bounds, indented(best->cpp, "C++"),
                           indented(best->python, "Python")));
}

ordered_json jsonOf(const Row& row) {
  ordered_json json = {{"dial", row.dial}, {"value", row.value}};
  json.update(jsonOf(row.outcome));
  json["front"] = row.is_on_front;
  json["cpp"] = row.cpp;
  json["python"] = row.python;
  return json;
}

Scene readScene(const Request& request, std::string& title) {
  if (request.scenes.size() != 1) throw std::invalid_argument("trade takes one scene");
  if (request.end && !request.meshes.paths.empty()) {
    throw std::invalid_argument("--end is about pairs of fibers; leave out --mesh");
  }
  progress("reading " + request.scenes.front().text);
  const SceneSource source = request.scenes.front().open();
  title = source.title;
  Scene scene;
  if (request.end) {
    StepScene step = readStep(source, request.end->open());
    title += " to " + step.end_title;
    scene.end.push_back(std::move(step.end));
    scene.fibers = std::move(step.start);
  } else {
    scene.fibers = source.scene();
    const bool has_next = source.is_file || source.frame + 1 < source.frame_count;
    scene.before = source.make(has_next ? source.frame + 1 : source.frame - 1);
  }
  scene.meshes = request.meshes.read();
  if (scene.fibers.segmentCount() == 0) {
    throw std::invalid_argument("'" + title + "' has no segment");
  }
  warnOfMeshSize(scene.fibers, scene.meshes, 0, source.name);
  return scene;
}

/// What a user can do if nothing touches.
std::string wayToContact(const Scene& scene) {
  if (scene.isStep()) return "give a larger --radius or a longer step";
  if (!scene.meshes.empty()) {
    return "give a larger --radius, or a mesh in the frame and the unit of the fibers";
  }
  return "`" + programName() + " info` tells at which radius contact begins";
}

}  // namespace

int tradeOff(const Request& request, const PeerSettings& peers) {
  std::string title;
  const Scene scene = readScene(request, title);
  const Verdict verdict =
      judge(scene, kMostTests, [](double share) { tellProgress("judge all distances", share); });
  if (verdict.contacts.empty()) {
    progress("");
    throw std::invalid_argument("'" + title + "' has no contact" +
                                (verdict.isWhole() ? "" : " in the sample that was judged") +
                                ", so nothing can be missed; " + wayToContact(scene));
  }
  std::vector<Setting> settings = settingsOf(scene, verdict);
  if (peers) {
    for (Setting& setting : peers(scene, defaultOptions(scene, verdict))) {
      settings.push_back(std::move(setting));
    }
  }
  Notes notes(scene, request.trade.longest, request.trade.again);
  if (!notes.isEmpty()) {
    const auto isKnown = [&](const Setting& setting) {
      return notes.find(setting.name()) != nullptr;
    };
    const auto count = std::count_if(settings.begin(), settings.end(), isKnown);
    warn(title, fmt::format("goes on with a run that was stopped, which had measured {} of {}; "
                            "--again measures all",
                            count, counted(settings.size(), "setting")));
  }
  const std::unique_ptr<Trial> usual = settings.front().make();
  std::vector<Row> rows;
  for (const Setting& setting : settings) {
    tellProgress(fmt::format("{} of {}: {}", rows.size() + 1, settings.size(), setting.name()),
                 static_cast<double>(rows.size()) / static_cast<double>(settings.size()));
    const Outcome* const known = notes.find(setting.name());
    const Outcome outcome =
        known != nullptr ? *known : measure(scene, verdict, setting, *usual, request.trade.longest);
    if (rows.empty() && outcome.is_ended) {
      progress("");
      throw std::runtime_error(fmt::format(
          "'{}': a frame of the default takes longer than {}, or finds more than {} pairs, so "
          "nothing "
          "can be compared with it; is the radius too large? --longest allows more time",
          title, timeText(request.trade.longest), countText(kPairLimit)));
    }
    if (known == nullptr) notes.add(setting.name(), outcome);
    rows.push_back({setting.dial, setting.value, setting.cpp, setting.python, outcome});
  }
  progress("");
  markFront(rows);
  if (!request.trade.picture.empty()) {
    OutputFile file(request.trade.picture);
    file.write(frontPicture(title, rows));
    file.commit();
  }

  AnswerStream stream(request.path);
  const std::size_t segments = scene.fibers.segmentCount();
  if (request.output == Output::kJson) {
    ordered_json json = {{"version", FCL_FIBERS_VERSION},
                         {"scene", title},
                         {"fibers", scene.fibers.fiberCount()},
                         {"segments", segments},
                         {"question", questionOf(scene)},
                         {"contacts", verdict.contacts.size()},
                         {"open", verdict.open.size()},
                         {"pieces", verdict.pieces},
                         {"judged_pieces", verdict.judged_pieces},
                         {"rows", ordered_json::array()}};
    for (const Row& row : rows) json["rows"].push_back(jsonOf(row));
    const Row* const best = choose(rows, request.trade.wish);
    json["chosen"] = best == nullptr ? ordered_json() : jsonOf(*best);
    stream.write(json.dump(1) + "\n");
  } else {
    const std::string sample =
        verdict.isWhole()
            ? "all pairs were judged by their distances"
            : fmt::format(
                  "a sample of {} of {} runs of 64 segments was judged by the distances to all "
                  "others; a setting that misses none of the sample misses at most {} of all "
                  "contacts, with 97.5 % confidence",
                  countText(verdict.judged_pieces), countText(verdict.pieces),
                  shareText(mostHidden(verdict)));
    stream.write(fmt::format("{}: {} of {}\n{} {}; {}\n", title, counted(segments, "segment"),
                             counted(scene.fibers.fiberCount(), "fiber"),
                             countText(verdict.contacts.size()), questionOf(scene), sample));
    printRows(rows, segments, stream);
    printChoice(rows, request.trade.wish, !verdict.isWhole(), stream);
  }
  stream.finish();
  notes.remove();
  return 0;
}

}  // namespace fcl_fibers::tools
