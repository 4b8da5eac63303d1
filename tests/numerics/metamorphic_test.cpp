// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numeric>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "numerics/random_scenes.h"
#include "numerics/specimen.h"
#include "support/random.h"
#include "support/scalars.h"

namespace fcl_fibers::test {
namespace {

/// An assembly made of another, and which capsule of that each of its capsules is.
template <typename S>
struct Image {
  std::string name;
  Assembly<S> fibers;
  std::vector<std::int32_t> original;
};

/// The same capsules, every point changed.
template <typename S, class Change>
Image<S> withPoints(std::string name, const Assembly<S>& fibers, Change&& change) {
  Image<S> image{std::move(name), fibers, std::vector<std::int32_t>(fibers.capsules().size())};
  std::iota(image.original.begin(), image.original.end(), 0);
  for (std::size_t i = 0; i < fibers.points.size(); i += 3) change(&image.fibers.points[i]);
  return image;
}

/// The same points, fibers in another order and in other senses.
template <typename S>
Image<S> withFibers(std::string name, const Assembly<S>& fibers, std::vector<std::size_t> order,
                    const std::function<bool(std::size_t)>& reversed) {
  std::vector<std::int32_t> first_of_fiber(fibers.fiberCount());
  std::int32_t count = 0;
  fibers.visitCapsules([&](std::size_t f, std::size_t i) {
    if (i == fibers.point_begin[f]) first_of_fiber[f] = count;
    ++count;
  });
  Image<S> image{std::move(name), {}, {}};
  for (const std::size_t f : order) {
    const std::size_t begin = fibers.point_begin[f], end = fibers.point_begin[f + 1];
    for (std::size_t k = 0; k < end - begin; ++k) {
      const bool last = k + 1 == end - begin;
      const std::size_t point = reversed(f) ? end - 1 - k : begin + k;
      const std::size_t starts = reversed(f) && !last ? point - 1 : point;
      image.fibers.addPoint(fibers.point(point), static_cast<double>(fibers.radii[starts]));
      if (last) continue;
      image.original.push_back(first_of_fiber[f] + static_cast<std::int32_t>(starts - begin));
    }
    image.fibers.endFiber();
  }
  return image;
}

/// All of it exact in S: coordinates are multiples of 2^-10, less than 2^4.
template <typename S>
std::vector<Image<S>> imagesOf(const Assembly<S>& fibers) {
  std::vector<Image<S>> images;
  images.push_back(withPoints("translated", fibers, [](S* p) {
    p[0] += 512;
    p[1] -= 256;
    p[2] += 3;
  }));
  images.push_back(withPoints("x and z swapped", fibers, [](S* p) { std::swap(p[0], p[2]); }));
  images.push_back(withPoints("axes turned", fibers, [](S* p) { std::rotate(p, p + 1, p + 3); }));
  images.push_back(withPoints("mirrored in x", fibers, [](S* p) { p[0] = -p[0]; }));
  images.push_back(withPoints("mirrored in all", fibers, [](S* p) {
    for (int i = 0; i < 3; ++i) p[i] = -p[i];
  }));
  for (const int exponent : {-50, 3, 70}) {
    const S scale = std::ldexp(S(1), exponent);
    images.push_back(withPoints("scaled by 2^" + std::to_string(exponent), fibers, [scale](S* p) {
      for (int i = 0; i < 3; ++i) p[i] *= scale;
    }));
    for (S& radius : images.back().fibers.radii) radius *= scale;
  }
  std::vector<std::size_t> order(fibers.fiberCount());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto all = [](std::size_t) { return true; };
  images.push_back(withFibers<S>("reversed", fibers, order, all));
  Random random(77);
  random.shuffle(order);
  images.push_back(withFibers<S>("permuted", fibers, order, [](std::size_t) { return false; }));
  images.push_back(withFibers<S>("permuted, every other one reversed", fibers, order,
                                 [](std::size_t f) { return f % 2 == 0; }));
  return images;
}

/// As unordered pairs of the originals, ascending.
std::vector<NumberPair> mapped(std::vector<NumberPair> pairs,
                               const std::vector<std::int32_t>& original) {
  for (NumberPair& pair : pairs) {
    const auto [low, high] = std::minmax(original[static_cast<std::size_t>(pair.a)],
                                         original[static_cast<std::size_t>(pair.b)]);
    pair = {low, high};
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

template <typename S>
Assembly<S> roundedScene(RandomKind kind, std::uint64_t seed) {
  Assembly<S> fibers = randomScene<S>(kind, 250, seed, HairFiles::none());
  for (S& x : fibers.points) x = std::round(x * 1024) / 1024;
  return fibers;
}

/// Where contact is exact as arrays, objects, whose poses are rounded, have it within rounding.
std::vector<Form> formsOf(RandomKind kind) {
  if (kind == RandomKind::kDegenerate) return {Form::kArrays};
  return {Form::kArrays, Form::kObjects};
}

template <typename S>
class MetamorphicTest : public testing::Test {};
TYPED_TEST_SUITE(MetamorphicTest, Scalars, ScalarName);

constexpr RandomKind kKinds[] = {RandomKind::kDense, RandomKind::kSparse, RandomKind::kCurled,
                                 RandomKind::kDegenerate};

// Answers would depend on where a scene stands, on its axes, its unit, or on the order of fibers.
TYPED_TEST(MetamorphicTest, ImagesOfASceneHaveTheImagesOfItsPairs) {
  for (const RandomKind kind : kKinds) {
    const Assembly<TypeParam> fibers = roundedScene<TypeParam>(kind, 31);
    const std::vector<Image<TypeParam>> images = imagesOf(fibers);
    for (const Form form : formsOf(kind)) {
      const Specimen<TypeParam> specimen(fibers, form);
      const std::vector<NumberPair> touching = touchingPairs(specimen.truth());
      ASSERT_GT(touching.size(), 20u);
      for (const Image<TypeParam>& image : images) {
        const Specimen<TypeParam> other(image.fibers, form);
        const std::vector<NumberPair> other_touching = touchingPairs(other.truth());
        ASSERT_TRUE(mapped(other_touching, image.original) == touching)
            << nameOf(kind) << ", " << image.name << ": the image is not exact";
        for (const FiberTreeOptions& options : allKinds()) {
          const std::vector<NumberPair> pairs = other.pairs(options);
          const auto where = [&] {
            return nameOf(kind) + ", " + image.name + ", " + describe(form, options);
          };
          if (options.report == Report::kCapsules) {
            EXPECT_TRUE(mapped(pairs, image.original) == touching) << where();
          } else {
            EXPECT_TRUE(examine(other.truth(), other_touching, options, pairs).isRight())
                << where();
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace fcl_fibers::test
