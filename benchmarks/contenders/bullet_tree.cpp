// SPDX-License-Identifier: BSD-3-Clause
#include <BulletCollision/BroadphaseCollision/btDbvt.h>

#include <cstdint>

#include "contenders/foreign_tree.h"

namespace fcl_fibers::benchmarks {
namespace {

btDbvtVolume volume(const FloatBox& box) {
  return btDbvtVolume::FromMM(btVector3(box.least[0], box.least[1], box.least[2]),
                              btVector3(box.greatest[0], box.greatest[1], box.greatest[2]));
}

/// Built from the top by Bullet, and refitted by hand as Bullet's soft bodies do: its update()
/// inserts every leaf anew.
class BulletTree : public ForeignTree {
 public:
  BulletTree() : ForeignTree(1) {}

  void setup() override {
    readBoxes();
    leaves_.reserve(size());
    for (std::size_t i = 0; i < size(); ++i) {
      leaves_.push_back(tree_.insert(volume(boxes()[i]), reinterpret_cast<void*>(i)));
    }
    // Down to two leaves: below the default of 128 it tries all pairs, which takes minutes.
    tree_.optimizeTopDown(2);
  }

  void update() override {
    readBoxes();
    for (std::size_t i = 0; i < size(); ++i) leaves_[i]->volume = volume(boxes()[i]);
    if (tree_.m_root != nullptr) refit(*tree_.m_root);
  }

  using ForeignTree::collide;
  void collide(void* cdata, fcl::CollisionCallBack<double> callback) const override {
    forEachPair([&](std::size_t a, std::size_t b) { callback(object(a), object(b), cdata); });
  }

  std::size_t countTouching() const override {
    const auto& capsules = axesOfObjects();
    std::size_t count = 0;
    forEachPair(
        [&](std::size_t a, std::size_t b) { count += capsulesTouch(capsules[a], capsules[b]); });
    return count;
  }

  PairCount countPairs() const override {
    std::size_t pairs = 0;
    forEachPair([&](std::size_t, std::size_t) { ++pairs; });
    return {pairs, pairs};
  }

 private:
  static void refit(btDbvtNode& node) {
    if (node.isleaf()) return;
    refit(*node.childs[0]);
    refit(*node.childs[1]);
    Merge(node.childs[0]->volume, node.childs[1]->volume, node.volume);
  }

  template <typename Visit>
  void forEachPair(Visit&& visit) const {
    struct Visitor : btDbvt::ICollide {
      explicit Visitor(Visit& function) : function(function) {}
      void Process(const btDbvtNode* a, const btDbvtNode* b) override {
        function(reinterpret_cast<std::uintptr_t>(a->data),
                 reinterpret_cast<std::uintptr_t>(b->data));
      }
      Visit& function;
    };
    Visitor visitor(visit);
    // Against itself: each pair once, no leaf with itself. The tree is const in all but name.
    const_cast<btDbvt&>(tree_).collideTT(tree_.m_root, tree_.m_root, visitor);
  }

  btDbvt tree_;
  std::vector<btDbvtNode*> leaves_;
};

/// `3.24`
std::string version() {
  constexpr int kHundred = 100;
  return std::to_string(BT_BULLET_VERSION / kHundred) + "." +
         std::to_string(BT_BULLET_VERSION % kHundred);
}

const AddLibrary kBullet("Bullet", version(), {foreignContender("Bullet", "refit", [] {
                           return std::make_unique<BulletTree>();
                         })});

}  // namespace
}  // namespace fcl_fibers::benchmarks
