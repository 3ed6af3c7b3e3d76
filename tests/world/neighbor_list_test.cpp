/// Tests of NeighborList against a search in every call.
#include "src/world/contacts/neighbor_list.hpp"

#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <random>
#include <vector>

namespace jfpx {
namespace {

/// Counts the searches.
class CountedCollider final : public SphereCollider {
 public:
  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override {
    return collider_->find_contacts(spheres);
  }
  std::span<const SpherePair> find_pairs(std::span<const SphereInstance> spheres) override {
    ++searches;
    return collider_->find_pairs(spheres);
  }
  std::span<const PairContact> find_touching(std::span<const SphereInstance> spheres,
                                             std::span<const SpherePair> pairs) override {
    return collider_->find_touching(spheres, pairs);
  }
  Backend backend() const noexcept override { return Backend::cpu; }
  SphereAlgorithm algorithm() const noexcept override { return collider_->algorithm(); }
  int searches = 0;

 private:
  std::unique_ptr<SphereCollider> collider_ = make_sphere_collider({.backend = Backend::cpu});
};

/// The touching pairs that a list finds.
std::vector<SpherePair> find(NeighborList* list, std::span<const SphereInstance> spheres,
                             SphereCollider* collider, ThreadPool* pool) {
  const NeighborPairs found = list->find(spheres, collider, pool);
  std::vector<SpherePair> all;
  found.for_each_touching(spheres, 0, found.pairs.size(), [&all](std::span<const SpherePair> part) {
    all.insert(all.end(), part.begin(), part.end());
  });
  return all;
}

class Cloud {
 public:
  Cloud(std::uint64_t seed, std::size_t count) : random_(seed) {
    for (std::size_t i = 0; i < count; ++i) spheres.push_back(fresh());
  }
  void move(Real distance) {
    for (SphereInstance& s : spheres) s.centre += Vec3{in(-1, 1), in(-1, 1), in(-1, 1)} * distance;
  }
  void teleport_one() { one() = fresh(); }
  void grow_one() { one().radius *= Real(1.5); }
  void remove_one() {
    one() = spheres.back();
    spheres.pop_back();
  }
  std::vector<SphereInstance> spheres;

 private:
  Real in(Real low, Real high) {
    return low + (high - low) * static_cast<Real>(random_() % 65536) / 65536;
  }
  SphereInstance fresh() { return {{in(0, 10), in(0, 10), in(0, 10)}, in(Real(0.4), Real(0.6))}; }
  SphereInstance& one() { return spheres[random_() % spheres.size()]; }
  std::mt19937_64 random_;
};

TEST(NeighborList, FindsThePairsOfASearchWhateverMoves) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  for (const unsigned threads : {1u, 3u}) {
    ThreadPool pool(threads);
    CountedCollider collider, reference;
    NeighborList list;
    Cloud cloud(seed, 1500);
    std::mt19937_64 random(seed);
    Real speed = Real(1e-3);
    for (int n = 0; n < 150; ++n) {
      switch (random() % 16) {
        case 0:
          cloud.teleport_one();
          break;
        case 1:
          cloud.grow_one();
          break;
        case 2:
          cloud.remove_one();
          break;
        case 3:
          speed = Real(random() % 2 == 0 ? 1e-4 : 0.2);
          break;
        default:
          break;
      }
      cloud.move(speed);
      const auto found = find(&list, cloud.spheres, &collider, &pool);
      const auto expected = reference.find_pairs(cloud.spheres);
      ASSERT_TRUE(std::ranges::equal(found, expected)) << n;
    }
    EXPECT_LT(collider.searches, reference.searches);
  }
}

TEST(NeighborList, SearchesOnceWhileSpheresMoveLittle) {
  CountedCollider collider, reference;
  NeighborList list;
  Cloud cloud(1, 1000);
  for (int n = 0; n < 20; ++n) {
    ASSERT_TRUE(std::ranges::equal(find(&list, cloud.spheres, &collider, nullptr),
                                   reference.find_pairs(cloud.spheres)));
    cloud.move(Real(1e-4));
  }
  EXPECT_EQ(collider.searches, 2);  // the second one knows how far the spheres move
}

TEST(NeighborList, FindsAnInvalidSphereAmongMany) {
  constexpr std::size_t kSpheres = 10000;  // in several chunks
  for (const std::size_t bad : {std::size_t{0}, kSpheres / 2, kSpheres - 1}) {
    ThreadPool pool(bad == 0 ? 1 : 3);
    CountedCollider collider;
    NeighborList list;
    Cloud cloud(1, kSpheres);
    for (int n = 0; n < 2; ++n) {  // the second list has a slack
      find(&list, cloud.spheres, &collider, &pool);
      cloud.move(Real(1e-4));
    }
    cloud.spheres[bad].centre.y = std::numeric_limits<Real>::quiet_NaN();
    EXPECT_THROW(find(&list, cloud.spheres, &collider, &pool), InvalidArgument) << bad;
  }
}

TEST(NeighborList, KeepsPairsThatTouchWithinRoundingAtTheEdgeOfTheirBounds) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  CountedCollider collider, reference;
  NeighborList list;
  // Pairs that separate and meet again along an axis, with the slack as largest distance.
  Cloud cloud(seed, 2000);
  for (std::size_t i = 0; i + 1 < cloud.spheres.size(); i += 2) {
    const Real x = static_cast<Real>(i) * 3;
    cloud.spheres[i].centre = {x, 0, 0};
    cloud.spheres[i + 1].centre = {x + cloud.spheres[i].radius + cloud.spheres[i + 1].radius, 0, 0};
  }
  const std::vector<SphereInstance> start = cloud.spheres;
  for (int n = 0; n < 60; ++n) {
    const Real shift = Real(0.002) * static_cast<Real>(n % 12);
    for (std::size_t i = 0; i < start.size(); ++i) {
      cloud.spheres[i].centre.x = start[i].centre.x + (i % 2 == 0 ? -shift : shift);
    }
    ASSERT_TRUE(std::ranges::equal(find(&list, cloud.spheres, &collider, nullptr),
                                   reference.find_pairs(cloud.spheres)))
        << n;
  }
  EXPECT_LT(collider.searches, reference.searches / 2);
}

}  // namespace
}  // namespace jfpx
