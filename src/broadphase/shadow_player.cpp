// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <fstream>
#include <istream>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fcl_fibers/shadow_manager.h>

#include "broadphase/shadow_gap.h"
#include "broadphase/shadow_record.h"
#include "joined_text.h"

namespace fcl_fibers {

using namespace broadphase;

/// Makes the calls of a record.
template <typename S>
class ShadowManager<S>::Player {
 public:
  Player(const std::string& first, const std::string& second)
      : names_{first, second}, both_(makeBoth()) {
    play({"bounds", std::vector<double>(kSizes, kUnknown)});
    play({"object", std::vector<double>(kEnd, kUnknown)});
  }

  /// @param number  that of the line
  ShadowReplay play(std::istream& lines, std::size_t& number) {
    ShadowReplay replay;
    const auto textOf = [](const std::string& recorded) {
      const std::string name = nameOf(*makeManager<S>(recorded));
      return name == recorded ? name : name + " in place of " + recorded;
    };
    replay.managers = textOf(names_[0]) + ", and beside it " + textOf(names_[1]);
    for (std::string line; ++number, std::getline(lines, line) && line != "end";) {
      if (line.substr(0, 11) == "difference ") {
        replay.recorded = line.substr(11);
      } else if (line == kLimit) {
        replay.managers += ", up to the limit of the record";
      } else if (replay.result.differences == 0) {
        play(RecordLine::parse(line));
        replay.result = both_->result();
      }
    }
    return replay;
  }

 private:
  struct Played final : Object {
    RecordedObject state;

    Played() : Object(std::shared_ptr<fcl::CollisionGeometry<S>>()) {}
    void set(RecordedObject recorded, std::shared_ptr<fcl::CollisionGeometry<S>> shape) {
      // FCL's trees may crash with boxes that are NaN or so large as those of planes.
      const auto bounded = [](double x) { return x > -1e15 ? std::min(x, 1e15) : -1e15; };
      state = std::move(recorded);
      this->cgeom = shape;
      this->cgeom_const = shape;
      this->t.affine() = state.pose().template cast<S>();
      this->aabb.min_ = state.low().unaryExpr(bounded).template cast<S>();
      this->aabb.max_ = state.high().unaryExpr(bounded).template cast<S>();
    }
  };

  std::unique_ptr<ShadowManager> makeBoth() const {
    return std::make_unique<ShadowManager>(makeManager<S>(names_[0]), makeManager<S>(names_[1]),
                                           ShadowOptions{"", 0, nullptr});
  }

  template <class Map>
  static auto& at(Map& map, double number) {
    const auto found = map.find(number);
    require(number >= kUnknown && found != map.end(), "there is no such number so far");
    return found->second;
  }

  void play(const RecordLine& line) {
    const auto& [call, n] = line;
    if (call == "object") {
      require(n.size() == kEnd, "the object has another count of numbers");
      const auto& [recorded, shape] = at(shapes_, n[1]);
      return objects_[n[0]].set({recorded, line}, shape);
    }
    if (const auto shape = makeShape<S>(line)) {
      shapes_[n[0]] = {std::make_shared<const RecordedShape>(RecordedShape{line}), shape};
      return;
    }
    const bool is_query = call.substr(0, 7) == "collide" || call.substr(0, 8) == "distance";
    require(!is_query || !n.empty(), "the query has no numbers");
    std::vector<Object*> objects;
    for (std::size_t i = is_query; i < n.size(); ++i) objects.push_back(&at(objects_, n[i]));
    if (is_query) return query(call, objects, n[0]);
    require(call.back() != 't' || objects.size() == 1, "the call needs one object");
    if (call == "unregisterObject" && names_[0].find("Naive") == std::string::npos) {
      std::vector<Object*> registered;
      both_->getObjects(registered);
      require(std::count(registered.begin(), registered.end(), objects[0]) > 0,
              "the object is not registered, and FCL's tree would crash");
    }
    both_->change(call, objects);
  }

  void query(const std::string& call, const std::vector<Object*>& objects, double most) {
    double pairs = 0;
    // The callback ends the query where the program's did, and measures what is known.
    const auto visit = [&](Object* a, Object* b, S* dist) {
      if (dist != nullptr) {
        const Gap gap = gapBetween(static_cast<Played*>(a)->state, static_cast<Played*>(b)->state,
                                   std::is_same_v<S, float>);
        if (gap.high < kInfinity) *dist = std::min(*dist, S(std::max(0.0, gap.low)));
      }
      return ++pairs == most;
    };
    const std::string kind = call[0] == 'd' ? "distance" : "collide",
                      with = call.substr(kind.size());
    if (with == "Self") return both_->query(call, nullptr, nullptr, visit);
    if (with == "Itself") return both_->query(kind + "Manager", nullptr, both_.get(), visit);
    if (with == "Object" && objects.size() == 1) {
      return both_->query(call, objects[0], nullptr, visit);
    }
    require(with == "Manager", "there is no such query");
    const std::unique_ptr<ShadowManager> other = makeBoth();
    for (Object* const object : objects) other->registerObject(object);
    other->setup();
    both_->query(call, nullptr, other.get(), visit);
  }

  static constexpr double kUnknown = -1;  // An object that the program never registered.
  const std::string names_[2];
  std::map<double, std::pair<std::shared_ptr<const RecordedShape>,
                             std::shared_ptr<fcl::CollisionGeometry<S>>>>
      shapes_;
  std::map<double, Played> objects_;
  std::unique_ptr<ShadowManager> both_;
};

ShadowReplay replayRecord(const std::string& path) {
  std::size_t number = 1;
  try {
    std::ifstream file(path, std::ios::binary);
    std::string head, scalar, first, second, tail(5, ' ');
    require(bool(std::getline(file, head)), "it cannot be read, or is empty");
    require(head == kRecordHead,
            joinedText("it is no record of this version, which begins with '", kRecordHead, "'"));
    file.seekg(-5, std::ios::end).read(&tail[0], 5);
    require(tail == "\nend\n", "the record is cut: its last line is not 'end'");
    file.seekg(std::streamoff(head.size()) + 1);
    for (std::string* line : {&scalar, &first, &second}) std::getline(file, *line);
    number = 4;
    if (scalar == "float") return ShadowManager<float>::Player(first, second).play(file, number);
    require(scalar == "double", "the scalar is neither float nor double");
    return ShadowManager<double>::Player(first, second).play(file, number);
  } catch (const std::exception& error) {
    throw std::runtime_error(joinedText(path, ":", number, ": ", error.what()));
  }
}

}  // namespace fcl_fibers
