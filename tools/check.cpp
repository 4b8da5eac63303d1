// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/io/export_geometry.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "answer_stream.h"
#include "commands.h"
#include "contact_list.h"
#include "found_pairs.h"
#include "output_file.h"
#include "seconds.h"
#include "several_scenes.h"

namespace fcl_fibers::tools {
namespace {

constexpr std::size_t kFew = 10;

template <typename Write>
void writePicture(const std::string& path, Write&& write) {
  if (path.empty()) return;
  progress("writing " + path);
  OutputFile file(path);
  write(file.draft());
  file.commit();
}

void writePictures(const CheckedFrame& frame, const FiberTree& tree) {
  const Request& request = frame.request;
  writePicture(request.segments_path, [&](const std::string& path) {
    io::exportSegments(path, frame.scene, frame.found.touching);
  });
  writePicture(request.contacts_path, [&](const std::string& path) {
    const FiberPolylines& other = frame.other == nullptr ? frame.scene : *frame.other;
    std::vector<Contact> contacts;
    contacts.reserve(frame.count());
    for (const FoundPair& pair : frame.found.pairs) {
      FoundContact contact = frame.contact(pair);
      if (pair.mesh != kNoMesh) {
        // A mesh counts as a fiber after the last one, and its triangles as segments.
        contact.b = {other.fiberCount() + static_cast<std::size_t>(pair.mesh),
                     static_cast<std::size_t>(pair.b)};
      }
      contacts.push_back(contact);
    }
    io::exportContacts(path, contacts);
  });
  writePicture(request.volumes_path, [&](const std::string& path) {
    io::exportVolumes(path, tree.volumes(request.depth));
  });
}

/// Checks one frame after another, and writes each answer at once.
class FrameChecker {
 public:
  explicit FrameChecker(const Request& request)
      : request_(request),
        meshes_(request.meshes.read()),
        tree_(request.tree),
        stream_(request.path) {
    if (!meshes_.empty() && request.tree.report != Report::kCapsules) {
      throw std::invalid_argument(
          "--mesh looks for capsules that touch, so give it without --report volumes");
    }
    if (!request.other) return;
    const SceneSource source = request.other->open();
    other_title_ = source.title;
    other_ = source.scene();
    other_tree_.emplace(request.tree);
    other_tree_->build(fiberArrays(*other_));
  }

  /// Returns whether there are contacts.
  bool run() {
    const bool one_source = request_.groups || request_.scenes.size() == 1;
    std::vector<SceneSource> groups;
    for (const SceneName& name : request_.scenes) {
      progress("reading " + name.text);
      SceneSource source = name.open();
      if (request_.groups) {
        groups.push_back(std::move(source));
      } else {
        checkFrames(source, one_source);
      }
    }
    if (request_.groups) checkFrames(asGroups(std::move(groups)), one_source);
    if (several_ && request_.output == Output::kJson) stream_.write("\n ]\n}");
    if (request_.output == Output::kJson) stream_.write("\n");
    stream_.finish();
    return found_;
  }

 private:
  void checkFrames(const SceneSource& source, bool one_source) {
    if (frames_ == 0) {
      samples_ = source.has_samples || (other_ && !other_->samples.empty());
      has_groups_ = !source.groups.empty();
      begin(!one_source || source.asked.size() > 1);
    }
    for (const int frame : source.asked) {
      progress("looking for contacts in " + source.title +
               (several_ ? fmt::format(", frame {}", frame) : ""));
      checkFrame(source, source.make(frame), one_source ? frame : frames_);
      ++frames_;
    }
  }

  /// Once, for the first frame that has any. The text of one frame has a line about them.
  void warnOfPairsAlong(const CheckedFrame& frame, const ContactList& list) {
    const bool is_told = request_.output == Output::kText && !several_;
    if (list.along.count() == 0 || is_told || has_warned_) return;
    warn(frame.title,
         (several_ ? fmt::format("frame {}: ", *frame.number) : "") + list.along.text());
    has_warned_ = true;
  }

  void begin(bool several) {
    several_ = several;
    const bool pictures = !request_.segments_path.empty() || !request_.contacts_path.empty() ||
                          !request_.volumes_path.empty();
    if (several && pictures) {
      throw std::invalid_argument("pictures are of one frame; give one scene without `frames`");
    }
    if (several && request_.output == Output::kText && (request_.summary || request_.top)) {
      throw std::invalid_argument(
          "--top and --summary list contacts of one frame as text; give one scene without "
          "`frames`, "
          "or --csv or --json");
    }
    if (request_.output == Output::kCsv)
      writeCsvHead(request_, several, has_groups_, samples_, stream_);
    if (request_.output == Output::kText && several) {
      stream_.write(fmt::format("{:>6} {:>12} {:>12} {:>10}  {}\n", "frame", "pairs", "distance",
                                "seconds", "scene"));
    }
    if (request_.output == Output::kJson && several) {
      stream_.write(openJson(head()) + ",\n \"frames\": [");
    }
  }

  nlohmann::ordered_json head() const {
    const FiberTreeOptions& tree = request_.tree;
    nlohmann::ordered_json head = {
        {"version", FCL_FIBERS_VERSION},
        {"report", tree.report == Report::kCapsules ? "capsules" : "volumes"},
        {"volumes", tree.volumes == FiberTreeOptions::Volumes::kLayeredBoxes ? "boxes" : "spheres"},
        {"margin", tree.margin},
        {"ignored_neighbors", tree.ignored_neighbors},
        {"ignored_arc_length", tree.ignored_arc_length}};
    if (has_groups_) head["within"] = request_.within;
    if (!meshes_.empty()) {
      head["meshes_only"] = request_.meshes_only;
      head["root_length"] = request_.meshes.root_length;
      head["root_segments"] = request_.meshes.root_segments;
    }
    return head;
  }

  void readFrame(const FiberPolylines& scene) {
    FiberArrays<double> arrays = fiberArrays(scene);
    std::vector<std::int32_t> roots = request_.meshes.roots(scene);
    if (!roots.empty()) arrays.root_segments = roots.data();
    if (request_.within) arrays.groups = nullptr;
    if (frames_ > 0 && scene.point_begin == point_begin_ && scene.closed == closed_ &&
        scene.starts_at == starts_at_ && scene.ends_at == ends_at_ && scene.groups == groups_ &&
        roots == roots_) {
      tree_.update(arrays);
    } else {
      tree_.build(arrays);
      roots_ = std::move(roots);
      point_begin_ = scene.point_begin;
      closed_ = scene.closed;
      starts_at_ = scene.starts_at;
      ends_at_ = scene.ends_at;
      groups_ = scene.groups;
    }
  }

  void checkFrame(const SceneSource& source, const FiberPolylines& scene, int number) {
    Request listed = request_;
    if (request_.output == Output::kText && !listed.top) listed.top = kFew;
    CheckedFrame frame = {
        listed,  source.title,  std::nullopt, scene, other_title_, other_ ? &*other_ : nullptr,
        meshes_, source.groups, FoundPairs{}, 0,     samples_};
    if (several_) frame.number = number;
    if (frames_ == 0) warnOfMeshSize(scene, meshes_, request_.tree.margin, source.name);
    const PairSearch search = {
        tree_,   scene, request_.limit, other_ ? &*other_tree_ : nullptr, !request_.meshes_only,
        &meshes_};
    frame.seconds = seconds([&] {
      readFrame(scene);
      frame.found = findPairs(search);
    });
    found_ = found_ || frame.count() > 0;
    writePictures(frame, tree_);
    const ContactList list(frame);
    progress("");
    warnOfMany(frame.found, search, source.name);
    warnOfPairsAlong(frame, list);
    if (request_.output == Output::kCsv) {
      writeCsv(frame, list, stream_);
    } else if (request_.output == Output::kJson) {
      if (several_) stream_.write(frames_ > 0 ? ",\n" : "\n");
      writeJson(frame, list, several_ ? nlohmann::ordered_json() : head(), stream_);
    } else if (several_) {
      const std::string distance =
          frame.count() > 0 ? fmt::format("{:.4g}", list.least_distance) : "-";
      stream_.write(fmt::format("{:>6} {:>12} {:>12} {:>10.3g}  {}\n", number,
                                (frame.found.complete ? "" : ">= ") + countText(frame.count()),
                                distance, frame.seconds, source.title));
      if (request_.path.empty()) stream_.flush();
    } else {
      writeText(frame, list, stream_);
    }
  }

  const Request& request_;
  std::vector<MeshFile> meshes_;
  FiberTree tree_;
  AnswerStream stream_;
  std::string other_title_;
  std::optional<FiberPolylines> other_;
  std::optional<FiberTree> other_tree_;
  bool several_ = false, has_groups_ = false, samples_ = false, found_ = false, has_warned_ = false;
  int frames_ = 0;  ///< that are done
  std::vector<std::size_t> point_begin_;
  std::vector<std::uint8_t> closed_;
  std::vector<std::int32_t> starts_at_, ends_at_, groups_, roots_;
};

}  // namespace

int check(const Request& request) {
  if (request.end) return checkStep(request);
  const bool found = FrameChecker(request).run();
  return found && !request.exit_zero ? kExitContacts : 0;
}

}  // namespace fcl_fibers::tools
