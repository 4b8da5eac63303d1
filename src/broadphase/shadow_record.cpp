// SPDX-License-Identifier: BSD-3-Clause
#include "broadphase/shadow_record.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <typeinfo>

#include <cxxabi.h>

#include <fcl_fibers/shadow_manager.h>
#include <fcl_fibers/wrapped_sphere_tree_collision_manager.h>

namespace fcl_fibers::broadphase {

template <typename S>
std::string managerLine(const fcl::BroadPhaseCollisionManager<S>& manager) {
  if (const auto* ours = dynamic_cast<const FiberCollisionManager<S>*>(&manager)) {
    const FiberManagerOptions& options = ours->options();
    std::string line = dynamic_cast<const WrappedSphereTreeCollisionManager<S>*>(ours) != nullptr
                           ? "spheres"
                           : "boxes";
    for (const double number : {double(options.topology), double(options.report),
                                double(options.ignored_neighbors), options.ignored_arc_length,
                                options.margin, double(options.bounds), double(options.motion)}) {
      appendNumber(line, number);
    }
    return line;
  }
  const std::unique_ptr<char, void (*)(void*)> name(
      abi::__cxa_demangle(typeid(manager).name(), nullptr, nullptr, nullptr), std::free);
  return name == nullptr ? typeid(manager).name() : name.get();
}

template <typename S>
void makeChange(fcl::BroadPhaseCollisionManager<S>& manager, std::string_view call,
                const std::vector<fcl::CollisionObject<S>*>& objects) {
  const bool is_ring = call == "registerRing";
  if (is_ring || call == "registerFiber") {
    const FiberEnds ends = is_ring ? FiberEnds::kClosed : FiberEnds::kOpen;
    if (auto* const fibers = dynamic_cast<FiberCollisionManager<S>*>(&manager)) {
      return fibers->registerFiber(objects, ends);
    }
    if (auto* const shadow = dynamic_cast<ShadowManager<S>*>(&manager)) {
      return shadow->registerFiber(objects, ends);
    }
    return manager.registerObjects(objects);
  }
  if (call == "registerObjects") return manager.registerObjects(objects);
  if (call == "updateObjects") return manager.update(objects);
  if (objects.size() == 1) {
    if (call == "registerObject") return manager.registerObject(objects[0]);
    if (call == "unregisterObject") return manager.unregisterObject(objects[0]);
    if (call == "updateObject") return manager.update(objects[0]);
  }
  if (objects.empty()) {
    if (call == "setup") return manager.setup();
    if (call == "update") return manager.update();
    if (call == "clear") return manager.clear();
  }
  throw std::invalid_argument("there is no such call, or it has another count of objects");
}

void Record::append(const std::string& line) {
  if (!is_kept_) return;
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  if (blocks_.empty() || blocks_.back().size() + line.size() >= kBlock) {
    blocks_.emplace_back().reserve(std::max(kBlock, line.size() + 1));
  }
  (blocks_.back() += line) += '\n';
  bytes_ += line.size() + 1;
}

void Record::clear() {
  blocks_.clear();
  bytes_ = 0;
}

void Record::write(const std::string& path, const std::string& head,
                   const std::string& last) const {
  const std::string draft = path + ".part";
  std::error_code error;
  {
    std::ofstream file(draft, std::ios::binary);
    file << head;
    for (const std::string& block : blocks_) file << block;
    file << last << "end\n";
    file.close();
    if (!file) error = std::make_error_code(std::errc::io_error);
  }
  if (!error) std::filesystem::rename(draft, path, error);
  if (!error) return;
  std::error_code ignored;
  std::filesystem::remove(draft, ignored);
  throw std::runtime_error(path + ": the record cannot be written; check the folder and its space");
}

std::string shapeLine(const RecordedShape& shape) {
  std::string line = "shape " + std::to_string(shape.number) + " " + shape.kind;
  for (const double number : shape.numbers) appendNumber(line, number);
  line += " /";
  for (const std::int64_t index : shape.indices) line += " " + std::to_string(index);
  line += " /";
  for (const double number : shape.bounds) appendNumber(line, number);
  return line;
}

std::string objectLine(std::size_t number, const RecordedState& state) {
  std::string line = "object " + std::to_string(number) + " " + std::to_string(state.shape->number);
  for (const double number : state.pose) appendNumber(line, number);
  for (const double number : state.box) appendNumber(line, number);
  return line;
}

template std::string managerLine(const fcl::BroadPhaseCollisionManager<float>&);
template std::string managerLine(const fcl::BroadPhaseCollisionManager<double>&);
template void makeChange(fcl::BroadPhaseCollisionManager<float>&, std::string_view,
                         const std::vector<fcl::CollisionObject<float>*>&);
template void makeChange(fcl::BroadPhaseCollisionManager<double>&, std::string_view,
                         const std::vector<fcl::CollisionObject<double>*>&);

}  // namespace fcl_fibers::broadphase
