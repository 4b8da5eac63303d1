// SPDX-License-Identifier: BSD-3-Clause

// Reads fibers from a file into a manager, beside an object that is no fiber. Prints what touches:
//
//     file_to_manager FILE [RADIUS]
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>

#include <fcl/geometry/shape/box.h>
#include <fcl_fibers/fiber_objects.h>
#include <fcl_fibers/io/fiber_file.h>
#include <fcl_fibers/layered_aabb_tree_collision_manager.h>

namespace {

using Manager = fcl_fibers::LayeredAABBTreeCollisionManagerd;

struct Query {
  const Manager& manager;
  const fcl::CollisionObjectd& box;
};

bool printPair(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* cdata) {
  const auto& query = *static_cast<const Query*>(cdata);
  const auto name = [&](const fcl::CollisionObjectd* object) {
    if (object == &query.box) return std::string("the box");
    const auto [fiber, segment] = query.manager.fiberSegment(object);
    return "segment " + std::to_string(segment) + " of fiber " + std::to_string(fiber);
  };
  std::printf("%s touches %s\n", name(a).c_str(), name(b).c_str());
  return false;
}

void printPairs(const std::string& path, const fcl_fibers::io::FiberFileOptions& how) {
  const fcl_fibers::io::FiberFile file = fcl_fibers::io::readFibers(path, how);
  for (const std::string& warning : file.warnings) std::fprintf(stderr, "%s\n", warning.c_str());
  if (!file.has_radius) {
    throw std::invalid_argument(path + " holds no radius: give one, in the file's unit");
  }

  fcl_fibers::FiberManagerOptions options;
  options.report = fcl_fibers::Report::kCapsules;  // by default it is kVolumes
  options.ignored_neighbors = 1;
  Manager manager(options);
  const auto objects = fcl_fibers::makeObjects<double>(file.fibers);
  for (const auto& fiber : fcl_fibers::objectsByFiber(file.fibers, objects)) {
    manager.registerFiber(fiber.objects, fiber.ends, {}, {}, fiber.joints);
  }
  fcl::CollisionObjectd box(std::make_shared<fcl::Boxd>(0.1, 0.1, 0.1), fcl::Matrix3d::Identity(),
                            fcl::Vector3d(-0.5, 0, 0));
  manager.registerObject(&box);

  Query query = {manager, box};
  manager.collide(&query, printPair);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: file_to_manager FILE [RADIUS]\n");
    return 2;
  }
  try {
    fcl_fibers::io::FiberFileOptions how;
    if (argc == 3) {
      char* end = nullptr;
      how.radius = std::strtod(argv[2], &end);
      if (*end != '\0') throw std::invalid_argument(std::string(argv[2]) + " is no radius");
    }
    printPairs(argv[1], how);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
