// SPDX-License-Identifier: BSD-3-Clause
#include <fcl_fibers/shadow_manager.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <stdexcept>
#include <string_view>
#include <unordered_set>

#include <fcl/broadphase/broadphase_bruteforce.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree_array.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

#include "broadphase/recorded_object.h"
#include "broadphase/shadow_record.h"
#include "joined_text.h"

namespace fcl_fibers {
namespace {

using namespace broadphase;

[[noreturn]] void refuse(std::string_view word, const char* problem) {
  throw std::invalid_argument(joinedText("'", word.substr(0, 40), "' ", problem));
}

/// The words of a line.
class Words {
 public:
  explicit Words(std::string_view line) : rest_(line) {}

  bool empty() const { return rest_.empty(); }
  std::string_view rest() const { return rest_; }
  std::string_view next() {
    const std::size_t end = std::min(rest_.find(' '), rest_.size());
    const std::string_view word = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    return word;
  }
  bool take(std::string_view word) {
    Words after = *this;
    if (after.next() != word) return false;
    *this = after;
    return true;
  }
  std::size_t integer(std::size_t most = std::numeric_limits<std::int64_t>::max()) {
    const std::string_view word = next();
    const char* const end = word.data() + word.size();
    std::size_t value = 0;
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    if (error != std::errc() || stop != end || value > most) refuse(word, "is no number in range");
    return value;
  }
  double number() {
    const std::string_view word = next();
    double value = 0;
    if (!readNumber(word, value)) refuse(word, "is no number");
    return value;
  }
  template <std::size_t kCount>
  void numbers(std::array<double, kCount>& values) {
    for (double& value : values) value = number();
  }
  void requireEnd() const {
    if (!empty()) refuse(rest_, "is more than the line should have");
  }

 private:
  std::string_view rest_;
};

/// A box that is NaN or so large, as that of a plane, that FCL's trees may crash.
struct BoxTooLarge {};

/// Makes the calls of a record.
template <typename S>
class Player {
 public:
  using Manager = fcl::BroadPhaseCollisionManager<S>;
  using Object = fcl::CollisionObject<S>;
  using Objects = std::vector<Object*>;

  /// @param is_naive  whether FCL's trees may crash
  Player(const std::string& first, const std::string& second, bool is_naive)
      : first_(first), second_(second), is_naive_(is_naive), manager_(makeBoth()) {}

  std::string managers() const {
    const auto text = [](const Manager& manager, const std::string& recorded) {
      const std::string name = managerLine(manager);
      return name == recorded ? name : name + " in place of " + recorded;
    };
    return text(manager_->first(), first_) + ", and beside it " + text(manager_->second(), second_);
  }
  ShadowResult result() const { return manager_->result(); }

  void play(Words words) {
    const std::string_view call = words.next();
    if (call == "shape") return readShape(words);
    if (call == "object") return readObject(words);
    if (call == "snapshot") return;
    if (call == "collide") return query(words, &Player::stops);
    if (call == "distance") return query(words, &Player::nears);
    const Objects objects = readObjects(words);
    words.requireEnd();
    if (call == "unregisterObject" && isUnknownToTree(objects)) {
      throw std::invalid_argument("the object is not registered, and FCL's tree would crash");
    }
    makeChange<S>(*manager_, call, objects);
    if (call == "unregisterObject") registered_.erase(objects[0]);
    if (call == "clear") registered_.clear();
    if (call.substr(0, 8) == "register") registered_.insert(objects.begin(), objects.end());
  }

 private:
  struct Answer {  // What a callback needs to end a query where the program's did.
    std::size_t pairs = 0, most = 0;
  };

  static bool stops(Object*, Object*, void* data) {
    auto& answer = *static_cast<Answer*>(data);
    return ++answer.pairs == answer.most;
  }
  static bool nears(Object* a, Object* b, void* data, S& dist) {
    const auto state = [](Object* object) {
      return static_cast<RecordedObject<S>*>(object)->state();
    };
    const Gap gap = gapBetween(state(a), state(b), std::is_same_v<S, float>,
                               std::numeric_limits<double>::infinity());
    const auto distance = static_cast<S>(std::max(0.0, (gap.low + gap.high) / 2));
    if (distance < dist) dist = distance;
    return stops(a, b, data);
  }

  /// Whether FCL can square the sizes of the boxes around several such objects.
  static bool isBounded(const Object* object) {
    const fcl::AABB<S>& box = object->getAABB();
    return std::isfinite(16 * (box.min_.squaredNorm() + box.max_.squaredNorm()));
  }
  bool isUnknownToTree(const Objects& objects) const {
    return dynamic_cast<const fcl::NaiveCollisionManager<S>*>(&manager_->first()) == nullptr &&
           (objects.empty() || registered_.count(objects[0]) == 0);
  }

  std::unique_ptr<ShadowManager<S>> makeBoth() const {
    ShadowOptions options;
    options.file.clear();
    options.record_limit = 0;
    return std::make_unique<ShadowManager<S>>(make(first_, false), make(second_, true), options);
  }

  /// The manager of a managerLine(). If that is unknown, FCL's tree comes first and ours second.
  std::unique_ptr<Manager> make(const std::string& line, bool is_second) const {
    Words words(line);
    const bool is_boxes = words.take("boxes");
    FiberManagerOptions options;
    if (is_boxes || words.take("spheres")) {
      options.topology = static_cast<Topology>(words.integer(1));
      options.report = static_cast<Report>(words.integer(1));
      options.ignored_neighbors = static_cast<int>(words.integer(std::numeric_limits<int>::max()));
      options.ignored_arc_length = words.number();
      options.margin = words.number();
      options.bounds = static_cast<Bounds>(words.integer(2));
      options.motion = words.integer(1) == 1;
      words.requireEnd();
      if (is_boxes) return std::make_unique<LayeredAABBTreeCollisionManager<S>>(options);
      return std::make_unique<WrappedSphereTreeCollisionManager<S>>(options);
    }
    if (is_second) return std::make_unique<LayeredAABBTreeCollisionManager<S>>();
    std::unique_ptr<Manager> naive = std::make_unique<fcl::NaiveCollisionManager<S>>();
    if (is_naive_ || managerLine(*naive) == line) return naive;
    std::unique_ptr<Manager> array =
        std::make_unique<fcl::DynamicAABBTreeCollisionManager_Array<S>>();
    if (managerLine(*array) == line) return array;
    return std::make_unique<fcl::DynamicAABBTreeCollisionManager<S>>();
  }

  void readShape(Words& words) {
    RecordedShape shape;
    shape.number = words.integer();
    shape.kind = words.next();
    while (!words.take("/")) shape.numbers.push_back(words.number());
    while (!words.take("/")) shape.indices.push_back(static_cast<std::int64_t>(words.integer()));
    words.numbers(shape.bounds);
    words.requireEnd();
    auto made = makeShape<S>(shape);
    shapes_[shape.number] = {std::make_shared<const RecordedShape>(shape), std::move(made)};
  }

  void readObject(Words& words) {
    const std::size_t number = words.integer(), shape_number = words.integer();
    const auto shape = shapes_.find(shape_number);
    if (shape == shapes_.end()) throw std::invalid_argument("there is no such shape so far");
    RecordedState state;
    state.shape = shape->second.first;
    words.numbers(state.pose);
    words.numbers(state.box);
    words.requireEnd();
    std::unique_ptr<RecordedObject<S>>& object = objects_[number];
    if (object == nullptr) {
      object = std::make_unique<RecordedObject<S>>(shape->second.second, state);
    } else {
      object->set(shape->second.second, state);
    }
    if (!is_naive_ && !isBounded(object.get())) throw BoxTooLarge();
  }

  Objects readObjects(Words& words) {
    Objects objects;
    while (!words.empty() && words.rest().substr(0, 7) != "stopped") {
      if (words.take("unknown")) {
        objects.push_back(&unknown_);
        continue;
      }
      const auto object = objects_.find(words.integer());
      if (object == objects_.end()) throw std::invalid_argument("there is no such object so far");
      objects.push_back(object->second.get());
    }
    return objects;
  }

  template <class Callback>
  void query(Words& words, Callback callback) {
    const std::string_view with = words.next();
    const Objects objects = readObjects(words);
    Answer answer;
    if (words.take("stopped")) answer.most = words.integer();
    words.requireEnd();
    const auto ask = [&](auto... to) {
      if constexpr (std::is_same_v<Callback, fcl::CollisionCallBack<S>>) {
        manager_->collide(to..., &answer, callback);
      } else {
        manager_->distance(to..., &answer, callback);
      }
    };
    if (with == "self" && objects.empty()) return ask();
    if (with == "object" && objects.size() == 1) return ask(objects[0]);
    if (with == "itself" && objects.empty()) return ask(static_cast<Manager*>(manager_.get()));
    if (with != "manager") throw std::invalid_argument("there is no such query");
    const std::unique_ptr<Manager> other = makeBoth();
    for (Object* const object : objects) other->registerObject(object);
    other->setup();
    ask(other.get());
  }

  const std::string first_, second_;
  const bool is_naive_;
  std::map<std::size_t, std::pair<std::shared_ptr<const RecordedShape>,
                                  std::shared_ptr<fcl::CollisionGeometry<S>>>>
      shapes_;
  std::map<std::size_t, std::unique_ptr<RecordedObject<S>>> objects_;
  Object unknown_{std::make_shared<fcl::Sphere<S>>(S(1))};  // That the program never registered.
  std::unordered_set<const Object*> registered_;
  std::unique_ptr<ShadowManager<S>> manager_;
};

/// The lines of a file that has been read whole.
class Lines {
 public:
  explicit Lines(const std::string& text) : rest_(text) {}

  std::string_view next() {
    ++number_;
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    return line;
  }
  std::string after(std::string_view word) {
    Words words(next());
    if (!words.take(word)) throw std::invalid_argument(joinedText("it should begin with ", word));
    return std::string(words.rest());
  }
  std::size_t number() const { return number_; }

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
};

template <typename S>
ShadowReplay replay(Lines& lines, bool is_naive) {
  const std::string first = lines.after("first"), second = lines.after("second");
  Player<S> player(first, second, is_naive);
  ShadowReplay replay;
  replay.managers = player.managers();
  for (std::string_view line = lines.next(); line != "end"; line = lines.next()) {
    Words words(line);
    if (words.take("difference")) {
      replay.recorded = words.rest();
    } else if (replay.result.differences == 0) {
      player.play(words);
      replay.result = player.result();
    }
  }
  return replay;
}

template <typename S>
ShadowReplay replay(Lines& lines) {
  const Lines start = lines;
  try {
    return replay<S>(lines, false);
  } catch (const BoxTooLarge&) {
    lines = start;
    return replay<S>(lines, true);
  }
}

}  // namespace

ShadowReplay replayRecord(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file || text.empty()) throw std::runtime_error(path + ": it cannot be read, or is empty");
  Lines lines(text);
  try {
    if (lines.next() != kRecordHead) {
      throw std::invalid_argument(
          joinedText("it is no record of this version, which begins with '", kRecordHead, "'"));
    }
    constexpr std::string_view kEnd = "\nend\n";
    if (text.size() < kEnd.size() || text.substr(text.size() - kEnd.size()) != kEnd) {
      throw std::invalid_argument("the record is cut: its last line is not 'end'");
    }
    const std::string scalar = lines.after("scalar");
    if (scalar == "double") return replay<double>(lines);
    if (scalar == "float") return replay<float>(lines);
    throw std::invalid_argument("the scalar is neither float nor double");
  } catch (const std::exception& error) {
    throw std::runtime_error(joinedText(path, ":", lines.number(), ": ", error.what()));
  }
}

}  // namespace fcl_fibers
