// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fcl_fibers/contact.h>
#include <nlohmann/json.hpp>

#include "along_fibers.h"
#include "answer_stream.h"
#include "commands.h"
#include "contact_json.h"
#include "found_pairs.h"

namespace fcl_fibers::tools {

/// A frame of check, and what was found in it.
struct CheckedFrame {
  const Request& request;
  std::string title;
  std::optional<int> number;  ///< unless there is one frame only
  const FiberPolylines& scene;
  std::string other_title;      ///< of --against
  const FiberPolylines* other;  ///< of --against, or null
  const std::vector<MeshFile>& meshes;
  const std::vector<SceneGroup>& groups;
  FoundPairs found;
  double seconds = 0;    ///< that build or update and search took
  bool samples = false;  ///< see writeCsvHead()

  std::size_t count() const { return found.pairs.size(); }
  FoundContact contact(const FoundPair& pair) const {
    return contactOf(pair, scene, other, meshes);
  }

  /// Its number, from 1 on; 0 for none.
  std::size_t groupOf(std::size_t fiber) const {
    return scene.groups.empty() ? 0 : static_cast<std::size_t>(scene.groups[fiber]);
  }

  /// A contact whose fibers count in their own files, as answers tell them, with the numbers of
  /// their groups.
  struct Listed : FoundContact {
    std::array<std::optional<double>, 2> groups{};
  };
  Listed listed(const FoundPair& pair) const;
};

/// A contact, or all contacts of two fibers or of a fiber and a mesh, by the deepest of them.
struct ListRow {
  double distance;
  FoundPair pair;
  std::uint32_t contacts;
  bool along;  ///< the pair touches because the fiber between them is thick, see PairsAlong
};

/// Pairs of one fiber, or of fibers that branch from each other, whose part between them is so
/// short that it cannot turn back: at most half a circle whose diameter is the sum of the radii. An
/// option leaves them out.
class PairsAlong {
 public:
  /// Returns whether a pair of one fiber is one of these.
  /// @param radii  the sum of both
  bool add(const NearAlong& pair, double radii);

  bool branches = false;  ///< pairs of two fibers are among them

  std::size_t count() const { return count_; }

  /// How many they are, which options leave them out, and how many other pairs of one fiber
  /// besides.
  std::string text() const;

 private:
  std::size_t count_ = 0;
  double half_circle_ = 0;    ///< the longest
  NearAlong farthest_{0, 0};  ///< by number and by length
  std::vector<NearAlong> others_;
};

/// The contacts of a frame, as they are listed.
struct ContactList {
  /// Depths relative to the radius or to the sum of both, from each number to the next one.
  static constexpr std::array<double, 8> kDepths = {0, 0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 1};

  explicit ContactList(const CheckedFrame& frame);

  std::vector<ListRow> rows;
  std::size_t row_count = 0;  ///< including those that --top leaves out
  double least_distance = 0;  ///< if there is a contact
  /// Without pairs along a fiber; infinite if there is no other.
  double least_of_others = std::numeric_limits<double>::infinity();
  std::array<std::size_t, kDepths.size() - 1> depths{}, depths_along{};
  std::size_t deeper = 0;                            ///< than the radius, as only meshes allow
  std::size_t apart = 0, apart_along = 0;            ///< pairs that do not touch
  std::size_t other_segments = 0, other_fibers = 0;  ///< of --against, that touch
  PairsAlong along;

  struct OfGroups {
    std::size_t count = 0;
    double least_distance = std::numeric_limits<double>::infinity();
  };
  std::map<std::pair<std::size_t, std::size_t>, OfGroups> groups;  ///< by number, from 1 on

  struct OfMesh {
    std::size_t segments = 0, fibers = 0;  ///< that touch it
    double least_distance = 0;             ///< if there are any
    std::size_t last_fiber = 0;

    /// Contacts come in the order of their fibers.
    void add(const Contact& contact);
  };
  std::vector<OfMesh> meshes;

 private:
  void countDepth(const FoundContact& contact, double radii, bool is_along);
};

/// By side of a pair of segments.
using PairSamples = std::array<std::optional<Sample>, 2>;

/// Columns that tell samples at the end of a row, after what comes before them, and their names.
std::string sampleNames(Output output);
std::string sampleColumns(Output output, const PairSamples& samples);

/// Beginning, rows and end of a list of contacts.
/// @param groups  whether rows tell groups
/// @param samples  whether rows tell samples, see sampleOf()
void writeCsvHead(const Request& request, bool several, bool groups, bool samples,
                  AnswerStream& stream);
void writeCsv(const CheckedFrame& frame, const ContactList& list, AnswerStream& stream);

/// The frame as a JSON object that begins with `head`.
void writeJson(const CheckedFrame& frame, const ContactList& list, nlohmann::ordered_json head,
               AnswerStream& stream);

/// An object without its closing brace.
std::string openJson(const nlohmann::ordered_json& object);

void writeText(const CheckedFrame& frame, const ContactList& list, AnswerStream& stream);

}  // namespace fcl_fibers::tools
