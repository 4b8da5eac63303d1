// SPDX-License-Identifier: BSD-3-Clause
#include "clients/client_support.h"

#include <map>
#include <string>

namespace fcl_fibers::test {
namespace {

class NamedObjects {
 public:
  explicit NamedObjects(const Swap& swap) : manager_(swap.make()) { manager_->setup(); }

  void add(const std::string& name, Object* object) {
    if (objects_.count(name) > 0) remove(name);
    objects_[name] = object;
    manager_->registerObject(object);
    manager_->update();
  }
  /// Tells the manager of what it has just forgotten.
  void remove(const std::string& name) {
    Object* object = objects_.at(name);
    manager_->unregisterObject(object);
    manager_->update(object);
    objects_.erase(name);
  }
  void move(const std::string& name, Random& random) {
    jolt(*objects_.at(name), random, 0.1, 0.5);
    manager_->update(objects_.at(name));
  }

  /// Of one with all others, for which it is not of them for a while.
  void expectNearestOfEach(const Truth& truth) {
    for (const auto& [name, object] : objects_) {
      manager_->unregisterObject(object);
      truth.expectNearest(*manager_, *object);
      manager_->registerObject(object);
    }
  }

  Manager& manager() const { return *manager_; }

 private:
  std::unique_ptr<Manager> manager_;
  std::map<std::string, Object*> objects_;
};

// A program would end where FCL passes over what it does not know.
void objectsThatComeAndGo(const Swap& swap, Random& random) {
  Scene<double> scene, tools, probes;
  scene.addFiber(wanderingChain(10, 0.2, 0.5, random), 0.04);
  addAllShapes(scene, 28, 0.4, 0.7, random);
  addAllShapes(tools, 14, 0.3, 0.7, random);
  addAllShapes(probes, 7, 0.3, 0.9, random);
  NamedObjects all(swap), other(swap);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < scene.size(); ++i) {
    names.push_back("object " + std::to_string(i));
    all.add(names[i], scene[i]);
  }
  for (std::size_t i = 0; i < tools.size(); ++i) other.add(std::to_string(i), tools[i]);
  for (int step = 0; step < 4; ++step) {
    SCOPED_TRACE("step " + std::to_string(step));
    for (int i = 0; i < 8; ++i) {
      const std::size_t gone = random.below(names.size());
      all.remove(names[gone]);
      EXPECT_EQ(all.manager().size(), scene.size() - 1);
      // Under its own name or, as a program may, in the place of what has the name.
      all.add(names[gone], scene[gone]);
      all.add(names[gone], scene[gone]);
    }
    for (const std::string& name : names) all.move(name, random);
    Truth truth(scene.objects());
    truth.read(tools.objects());
    truth.read(probes.objects());
    truth.expectAll(all.manager());
    truth.expectAll(all.manager(), other.manager());
    truth.expectNearest(all.manager());
    truth.expectNearest(all.manager(), other.manager());
    for (auto* probe : probes.objects()) {
      truth.expectAll(all.manager(), *probe);
      truth.expectNearest(all.manager(), *probe);
    }
    if (step % 2 == 1) all.expectNearestOfEach(truth);
  }
}

MANAGER_SUITE(Trimesh, ClientManagers);
TYPED_TEST(Trimesh, ObjectsThatComeAndGo) { runClient<TypeParam>(&objectsThatComeAndGo, 3501); }

}  // namespace
}  // namespace fcl_fibers::test
