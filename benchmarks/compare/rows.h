// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <fcl_fibers/fiber_polylines.h>

namespace compare {

/// What a call has found, as a number that depends on the order.
class Hash {
 public:
  void add(std::int32_t a, std::int32_t b) {
    value_ = (value_ ^ static_cast<std::uint32_t>(a)) * 0x9e3779b97f4a7c15u;
    value_ = ((value_ ^ static_cast<std::uint32_t>(b)) * 0x9e3779b97f4a7c15u) ^ (value_ >> 29);
    ++count_;
  }
  void add(double number);
  std::uint64_t value() const { return value_; }
  std::int64_t count() const { return count_; }

 private:
  std::uint64_t value_ = 1;
  std::int64_t count_ = 0;
};

/// A scene that is built and answers. Each call may be repeated; an update goes to another state.
struct Scene {
  virtual ~Scene() = default;
  virtual void build() = 0;
  virtual void update() = 0;
  virtual void query(Hash& found) = 0;
};

/// A call that is measured.
struct Row {
  enum class Call { kBuild, kUpdate, kQuery };
  std::string name;
  Call call;
  std::function<std::unique_ptr<Scene>()> open;
};

/// Adds the query of a scene and, if they are not measured elsewhere, its build and update.
void addRows(const std::string& name, const std::vector<Row::Call>& calls,
             const std::function<std::unique_ptr<Scene>()>& open, std::vector<Row>& rows);

void addManagerRows(std::vector<Row>& rows);

/// Hair: wisps of 20 fibers that curl together, in a state of their swing. Here and there two
/// touch.
fcl_fibers::FiberPolylines makeHair(int fibers, int segments, double swing);

}  // namespace compare
