// SPDX-License-Identifier: BSD-3-Clause

// Hair falls on a head that nods: contacts with a solid triangle mesh push it out. Plain arrays,
// metres and seconds.
//
//     hair_head [FOLDER]    also writes what tutorials.py draws to the folder
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include <fcl_fibers/contact.h>
#include <fcl_fibers/fiber_tree.h>
#include <fcl_fibers/io/export_geometry.h>
#include <fcl_fibers/triangle_mesh.h>

namespace {

using namespace fcl_fibers;

constexpr std::size_t kHairs = 200, kPoints = 12, kFixed = 2;  // points of a hair; those that stay
constexpr double kHead = 0.1, kRootDepth = 0.01, kSegment = 0.015, kRadius = 0.001, kStep = 0.002;
constexpr int kRounds = 3;  // of contacts in a step
constexpr double kPi = 3.141592653589793;

struct Vec {
  double x, y, z;
};
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(double f, Vec a) { return {f * a.x, f * a.y, f * a.z}; }
double length(Vec a) { return std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z); }
Vec onSphere(double z, double turn) {
  const double across = std::sqrt(1 - z * z);
  return {across * std::cos(turn), across * std::sin(turn), z};
}

/// A ball about the origin: rings of points between two poles. Neighbours share their points, and
/// the points of each triangle are counterclockwise, seen from outside.
void addBall(std::vector<Vec>& points, std::vector<std::int32_t>& triangles) {
  constexpr int kRings = 32, kSectors = 64, kSouth = 1 + (kRings - 1) * kSectors;
  points.push_back({0, 0, kHead});
  for (int i = 0; i < (kRings - 1) * kSectors; ++i) {
    const double z = std::cos(kPi * (1 + i / kSectors) / kRings);
    points.push_back(kHead * onSphere(z, 2 * kPi * (i % kSectors) / kSectors));
  }
  points.push_back({0, 0, -kHead});

  for (int sector = 0; sector < kSectors; ++sector) {
    const int next = (sector + 1) % kSectors, last = kSouth - kSectors;
    triangles.insert(triangles.end(), {0, 1 + sector, 1 + next});
    triangles.insert(triangles.end(), {kSouth, last + next, last + sector});
    for (int ring = 1; ring < last; ring += kSectors) {
      const int a = ring + sector, b = ring + next, c = a + kSectors, d = b + kSectors;
      triangles.insert(triangles.end(), {a, c, b, b, c, d});
    }
  }
}

/// The head nods about a point in the neck, once a second.
MeshPose nod(int step) {
  const double angle = 0.5 * std::sin(2 * kPi * step * kStep), neck = -0.15;
  const double c = std::cos(angle), s = std::sin(angle);
  return {{1, 0, 0, 0, c, -s, 0, s, c}, {0, s * neck, (1 - c) * neck}};
}

Vec apply(const MeshPose& pose, Vec p) {
  const auto& [r, t] = pose;
  return {r[0] * p.x + r[1] * p.y + r[2] * p.z + t[0], r[3] * p.x + r[4] * p.y + r[5] * p.z + t[1],
          r[6] * p.x + r[7] * p.y + r[8] * p.z + t[2]};
}

/// Roots go with the head. All other points fall, and then segments get their length again.
void move(std::vector<Vec>& now, std::vector<Vec>& before, const std::vector<Vec>& rest,
          const MeshPose& pose) {
  for (std::size_t i = 0; i < now.size(); ++i) {
    const Vec motion = 0.99 * (now[i] - before[i]) + Vec{0, 0, -9.81 * kStep * kStep};
    before[i] = now[i];
    now[i] = i % kPoints < kFixed ? apply(pose, rest[i]) : now[i] + motion;
  }
  for (int round = 0; round < 20; ++round) {
    for (std::size_t i = 0; i + 1 < now.size(); ++i) {
      const std::size_t number = i % kPoints;
      if (number + 1 < kFixed || number + 1 == kPoints) continue;
      const Vec along = now[i + 1] - now[i];
      const Vec excess = (1 - kSegment / length(along)) * along;
      const double share = number < kFixed ? 0 : 0.5;  // of the first point
      now[i] = now[i] + share * excess;
      now[i + 1] = now[i + 1] - (1 - share) * excess;
    }
  }
}

// [push]
/// Moves each segment out of the head. A point takes the mean of what its contacts ask of it.
void pushOut(const FiberTree& tree, const std::vector<MeshContact>& contacts,
             std::vector<Vec>& points) {
  std::vector<double> pushes;  // along the normals, from the head
  std::vector<int> counts(points.size(), 0);
  for (const MeshContact& contact : contacts) {
    const auto [nodes, weights] = contact.nodes();
    pushes.push_back(-contact.distance / (weights[0] * weights[0] + weights[1] * weights[1]));
    for (std::size_t end = 0; end < 2; ++end) {
      if (weights[end] > 0) ++counts[static_cast<std::size_t>(nodes[end])];
    }
  }
  std::vector<Vec> sums(points.size(), {0, 0, 0});
  tree.accumulate({contacts, pushes}, {&sums[0].x, sums.size()});
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (counts[i] > 0 && i % kPoints >= kFixed) points[i] = points[i] + 1.0 / counts[i] * sums[i];
  }
}
// [push]

/// Writes the hairs, the corners of the head as one line more, and the contacts.
void write(const std::string& path, const std::vector<Vec>& hair, const std::vector<Vec>& head,
           const MeshPose& pose, const std::vector<MeshContact>& contacts) {
  FiberPolylines lines;
  for (const Vec& p : hair) {
    lines.points.push_back({p.x, p.y, p.z});
    if (lines.points.size() % kPoints == 0) lines.point_begin.push_back(lines.points.size());
  }
  for (const Vec& corner : head) {
    const Vec p = apply(pose, corner);
    lines.points.push_back({p.x, p.y, p.z});
  }
  lines.point_begin.push_back(lines.points.size());
  io::exportFibers(path + "_fibers.vtp", lines);

  std::vector<Contact> points(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    points[i].point_a = points[i].point_b = contacts[i].point_b;
  }
  io::exportContacts(path + "_contacts.vtp", points);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<Vec> corners;
  std::vector<std::int32_t> triangles;
  addBall(corners, triangles);
  // [head]
  const MeshArrays<double> arrays = {&corners[0].x, corners.size(), triangles.data(),
                                     triangles.size() / 3};
  TriangleMesh head(arrays, TriangleMesh::Kind::kSolid);
  // [head]

  std::vector<Vec> now;
  std::vector<std::size_t> point_begin = {0};
  for (std::size_t hair = 0; hair < kHairs; ++hair) {
    const double part = static_cast<double>(hair) / kHairs;
    const Vec outward = onSphere(1 - 0.9 * part, 2.4 * static_cast<double>(hair));
    for (std::size_t i = 0; i < kPoints; ++i) {
      now.push_back((kHead - kRootDepth + static_cast<double>(i) * kSegment) * outward);
    }
    point_begin.push_back(now.size());
  }
  const std::vector<Vec> rest = now;
  std::vector<Vec> before = now;
  FiberArrays<double> hair = {&now[0].x, now.size(), point_begin.data(), kHairs, &kRadius};

  FiberTree tree;
  std::vector<MeshContact> contacts;
  tree.build(hair);
  tree.find(Contacts{hair}, head, contacts);
  std::printf("with roots: %zu contacts\n", contacts.size());

  // [roots]
  const std::vector<std::int32_t> roots = rootSegments(hair, kRootDepth);
  hair.root_segments = roots.data();
  tree.build(hair);
  tree.find(Contacts{hair}, head, contacts);
  std::printf("without roots: %zu contacts\n", contacts.size());
  // [roots]

  for (int step = 1; step <= 500; ++step) {
    // [loop]
    const MeshPose pose = nod(step);
    head.setPose(pose);
    move(now, before, rest, pose);
    for (int round = 0; round < kRounds; ++round) {
      tree.update(hair);
      tree.find(Contacts{hair}, head, contacts);
      pushOut(tree, contacts, now);
    }
    // [loop]

    if (step % 50 != 0) continue;
    double deepest = 0, lowest = kHead;  // lowest above the ball, without asking the library
    for (const MeshContact& contact : contacts) deepest = std::max(deepest, -contact.distance);
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (i % kPoints < kFixed) continue;
      lowest = std::min(lowest, length(now[i] - apply(pose, {0, 0, 0})) - kHead);
    }
    std::printf("step %3d: %4zu contacts, deepest %.2f mm; then the lowest point is at %.2f mm\n",
                step, contacts.size(), 1000 * deepest, 1000 * lowest);
    if (argc > 1) {
      const std::string path = std::string(argv[1]) + "/hair_head_" + std::to_string(step);
      write(path, now, corners, pose, contacts);
    }
  }
  return 0;
}
