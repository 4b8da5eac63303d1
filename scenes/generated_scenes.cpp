// SPDX-License-Identifier: BSD-3-Clause
#include "scenes/generated_scenes.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <iterator>
#include <map>
#include <memory>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "scenes/cap.h"
#include "scenes/helix.h"
#include "scenes/load_file.h"
#include "scenes/neuron.h"
#include "scenes/paper_scenes.h"
#include "tools/messages.h"

namespace fcl_fibers::scenes {
namespace {

using Keys = std::map<std::string, std::string>;
constexpr int kManyFrames = 1000;

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw std::invalid_argument("'" + text + "': " + why);
}

/// The fewest digits that identify the number.
std::string shortest(double number) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
  return std::string(text.data(), end);
}

/// The keys of one scene. Known keys are taken one by one, so that unknown ones are left.
class Parameters {
 public:
  Parameters(std::string text, const std::string& list, int part)
      : text_(std::move(text)), part_(part) {
    for (std::size_t begin = 0; begin < list.size();) {
      const std::size_t end = std::min(list.find(',', begin), list.size());
      const std::string item = list.substr(begin, end - begin);
      const std::size_t equals = item.find('=');
      if (equals == std::string::npos || equals == 0) {
        refuse(text_, "'" + item + "' is not key=value");
      }
      add(item.substr(0, equals), item.substr(equals + 1));
      begin = end + 1;
    }
  }

  bool has(const char* key) const { return keys_.count(key) > 0; }

  void add(const std::string& key, const std::string& value) {
    if (!keys_.emplace(key, value).second) refuse(text_, "'" + key + "' is given twice");
  }

  template <typename Number>
  Number take(const char* key, Number otherwise) {
    const auto found = keys_.find(key);
    if (found == keys_.end()) return otherwise;
    const Number number = parsed<Number>(key, found->second);
    keys_.erase(found);
    return number;
  }

  std::vector<RodLoad> takeLoads() {
    const auto found = keys_.find("loads");
    if (found == keys_.end()) return {};
    std::vector<RodLoad> loads = readLoads(found->second);
    keys_.erase(found);
    return loads;
  }

  int takeFibers(int otherwise) {
    const int fibers = take("fibers", otherwise);
    return part_ == 1 ? fibers : std::max(1, fibers / part_);
  }

  /// `7`, `0:100` or `0:100:2`.
  std::vector<int> takeFrames(const char* key, int count) {
    const auto found = keys_.find(key);
    if (found == keys_.end()) return {};
    std::vector<int> numbers;
    const std::string text = found->second;
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find(':', begin), text.size());
      numbers.push_back(parsed<int>(key, text.substr(begin, end - begin)));
      begin = end + 1;
    }
    keys_.erase(found);
    if (numbers.size() == 1) numbers.push_back(numbers[0]);
    if (numbers.size() == 2) numbers.push_back(1);
    if (numbers.size() != 3 || numbers[0] < 0 || numbers[1] < numbers[0] || numbers[1] >= count ||
        numbers[2] < 1) {
      refuse(text_, key + ("=" + text) + ": give FIRST:LAST or FIRST:LAST:STEP within 0:" +
                        std::to_string(count - 1));
    }
    std::vector<int> frames;
    for (int frame = numbers[0]; frame <= numbers[1]; frame += numbers[2]) frames.push_back(frame);
    return frames;
  }

  void requireNoMore() const {
    if (!keys_.empty()) {
      refuse(text_, "there is no key '" + keys_.begin()->first + "' here; see " +
                        tools::programName() + " --help");
    }
  }

 private:
  template <typename Number>
  Number parsed(const char* key, const std::string& value) const {
    Number number{};
    const char* const end = value.data() + value.size();
    const auto [stop, error] = std::from_chars(value.data(), end, number);
    if (error != std::errc() || stop != end) {
      refuse(text_, key + ("=" + value) + ": give a " +
                        (std::is_integral_v<Number> ? "whole number" : "number"));
    }
    return number;
  }

  std::string text_;
  int part_;
  Keys keys_;
};

template <typename Struct>
using Make = FiberPolylines (*)(const Struct&);

/// What all scenes have.
template <typename Struct>
void takeCommon(Parameters& keys, Struct& parameters) {
  parameters.fibers = keys.takeFibers(parameters.fibers);
  parameters.segments = keys.take("segments", parameters.segments);
  parameters.seed = keys.take<std::uint64_t>("seed", parameters.seed);
  parameters.radius = keys.take("radius", parameters.radius);
}

/// A scene whose parameters have a frame.
template <typename Struct>
SceneSource movingScene(Parameters& keys, Make<Struct> make, Struct parameters = {}) {
  takeCommon(keys, parameters);
  SceneSource source;
  source.frame_count = kManyFrames;
  source.make = [parameters, make](int frame) {
    auto at_frame = parameters;
    at_frame.frame = frame;
    return make(at_frame);
  };
  return source;
}

SceneSource staticScene(Parameters& keys) {
  PaperStaticParameters parameters;
  parameters.turned = keys.take("turned", 1) != 0;
  parameters.state = keys.take("state", parameters.state);
  return movingScene(keys, makePaperStatic, parameters);
}

SceneSource halfScalpScene(Parameters& keys) {
  PaperHalfScalpParameters parameters;
  parameters.length = keys.take("length", parameters.length);
  parameters.hanging = keys.take("hanging", 0) != 0;
  parameters.straight = keys.take("straight", 0) != 0;
  parameters.wisp_fibers = keys.take("wisp_fibers", parameters.wisp_fibers);
  parameters.deviation = keys.take("deviation", parameters.deviation);
  parameters.tip_deviation = keys.take("tip_deviation", parameters.tip_deviation);
  return movingScene(keys, makePaperHalfScalp, parameters);
}

SceneSource strandScene(Parameters& keys) {
  PaperStrandParameters parameters;
  parameters.area = keys.take("area", parameters.area);
  parameters.turns = keys.take("turns", parameters.turns);
  parameters.helix_radius = keys.take("helix_radius", parameters.helix_radius);
  parameters.turned = keys.take("turned", 0) != 0;
  parameters.straight = keys.take("straight", 0) != 0;
  parameters.deviation = keys.take("deviation", parameters.deviation);
  return movingScene(keys, makePaperStrand, parameters);
}

SceneSource dynamicScene(Parameters& keys) {
  PaperDynamicParameters parameters;
  takeCommon(keys, parameters);
  parameters.turned = keys.take("turned", 0) != 0;
  parameters.loads = keys.takeLoads();
  const auto assembly = std::make_shared<PaperDynamic>(parameters);
  SceneSource source;
  source.frame_count = assembly->steps();
  // The loop is nearly closed then.
  source.frame = parameters.loads.empty() ? 85 : source.frame_count - 1;
  for (int frame = 0; frame < source.frame_count; frame += 2) source.playable.push_back(frame);
  if (!parameters.turned) {
    const CosseratRod rod = guideFilament();
    source.guide = {rod.length, rod.bending_stiffness.x()};
  }
  source.make = [assembly](int frame) { return assembly->scene(frame); };
  return source;
}

struct Kind {
  const char* name;
  const char* what;
  SceneSource (*make)(Parameters& keys);
};

constexpr Kind kKinds[] = {
    {"helix", "helices like a strand of hair, 1,000 x 100",
     [](Parameters& keys) { return movingScene(keys, makeHelix); }},
    {"cap", "a head of hair, 50,000 x 50",
     [](Parameters& keys) { return movingScene(keys, makeCap); }},
    {"combed", "hair that lies on its head, 50,000 x 50",
     [](Parameters& keys) { return movingScene(keys, makeCombed); }},
    {"neuron", "a neuron whose dendrites taper and branch, 6 x 8 and what grows from them",
     [](Parameters& keys) { return movingScene(keys, makeNeuron); }},
    {"paper-static", "the paper's static assembly, 1,000 x 100; turned=0: along z, state=1: unbent",
     staticScene},
    {"paper-dynamic",
     "the paper's dynamic assembly, 150 x 100; loads=FILE: of a recording, turned=1", dynamicScene},
    {"paper-half-scalp", "the paper's half scalp, 50,000 x 50; length=7,wisp_fibers=300,straight=1",
     halfScalpScene},
    {"paper-strand", "the paper's strand, 1,000 x 2,000; turns=2,helix_radius=0.5,straight=1",
     strandScene},
};

SceneSource makeScene(const tools::SceneName& scene, int part) {
  const std::string& text = scene.text;
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string name = text.substr(0, colon);
  const auto* const kind = std::find_if(std::begin(kKinds), std::end(kKinds),
                                        [&](const Kind& k) { return name == k.name; });
  if (kind == std::end(kKinds)) {
    refuse(text, "there is neither a file nor a scene of that name; see " + tools::programName() +
                     " --help");
  }
  if (scene.options.radius) {
    refuse(text, "--radius is for files; for a generated scene give " + text +
                     (colon < text.size() ? ",radius=" : ":radius=") +
                     shortest(*scene.options.radius));
  }
  Parameters keys(text, colon < text.size() ? text.substr(colon + 1) : "", part);
  // Not as a part of the text, because a path may hold commas.
  if (scene.loads) keys.add("loads", *scene.loads);
  SceneSource source = kind->make(keys);
  source.name = name;
  source.title = text;
  if (keys.has("frame") && keys.has("frames")) {
    refuse(text, "frame and frames are both given; give one of them");
  }
  const std::vector<int> frames = keys.takeFrames("frames", source.frame_count);
  if (!frames.empty()) {
    source.playable = frames;
    source.frame = frames.back();
  }
  if (keys.has("frame") || source.playable.empty()) {
    source.frame = keys.take("frame", source.frame);
    source.playable = {source.frame};
  }
  source.asked = frames.empty() ? std::vector<int>{source.frame} : frames;
  if (keys.has("loads")) refuse(text, "only paper-dynamic has loads");
  keys.requireNoMore();
  if (source.frame < 0 || source.frame >= source.frame_count) {
    refuse(text, "frame=" + std::to_string(source.frame) + ": give a frame from 0 to " +
                     std::to_string(source.frame_count - 1));
  }
  return source;
}

std::string help() {
  std::string text = "A generated scene is NAME or NAME:key=value,... with one of these names:\n\n";
  for (const Kind& kind : kKinds) {
    std::string name = kind.name;
    name.resize(17, ' ');
    text += "  " + name + ' ' + kind.what + '\n';
  }
  text +=
      "\nKeys are fibers, segments (of each fiber), radius, seed and frame. `check` goes through\n"
      "frames=FIRST:LAST:STEP, and `view` plays them:  helix:fibers=200,segments=50,frames=0:40\n";
  return text;
}

}  // namespace

tools::GeneratedScenes generatedScenes(int part) {
  return {[part](const tools::SceneName& scene) { return makeScene(scene, part); }, help()};
}

SceneSource openScene(const std::string& text, std::optional<double> radius, int part) {
  io::FiberFileOptions options;
  options.radius = radius;
  const tools::GeneratedScenes generated = generatedScenes(part);
  return tools::SceneName{text, options, &generated}.open();
}

}  // namespace fcl_fibers::scenes
