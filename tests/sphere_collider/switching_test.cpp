/// States do not depend on the sequence of backends, algorithms and vector widths.
#include <jfpx/random.hpp>
#include <jfpx/world.hpp>

#include "src/scenes/scenes.hpp"
#include "tests/support/sphere_fixtures.hpp"

#include <gtest/gtest.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

bool cuda_is_usable() { return available_backends()[1].usable; }

/// Forwards each call to a random collider.
class RandomSwitcher final : public SphereCollider {
 public:
  explicit RandomSwitcher(std::uint64_t seed) : random_(seed) {
    for (const auto algorithm : {SphereAlgorithm::all_pairs, SphereAlgorithm::grid}) {
      for (const auto simd : {SimdLevel::scalar, SimdLevel::sse2, SimdLevel::automatic}) {
        add({.backend = Backend::cpu, .algorithm = algorithm, .simd = simd});
      }
      add({.backend = Backend::cpu, .algorithm = algorithm, .threads = 3});
      if (cuda_is_usable()) add({.backend = Backend::cuda, .algorithm = algorithm});
    }
  }

  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override {
    return next().find_contacts(spheres);
  }
  std::span<const PairContact> find_touching(std::span<const SphereInstance> spheres,
                                             std::span<const SpherePair> pairs) override {
    return next().find_touching(spheres, pairs);
  }
  Backend backend() const noexcept override { return colliders_[current_]->backend(); }
  SphereAlgorithm algorithm() const noexcept override { return colliders_[current_]->algorithm(); }

 private:
  void add(const SphereColliderOptions& options) {
    colliders_.push_back(make_sphere_collider(options));
  }
  SphereCollider& next() {
    current_ = random_.below(colliders_.size());
    return *colliders_[current_];
  }

  Random random_;
  std::vector<std::unique_ptr<SphereCollider>> colliders_;
  std::size_t current_ = 0;
};

constexpr int kSteps = 60;

std::uint64_t hash_after_steps(World world) {
  for (int n = 0; n < kSteps; ++n) world.step();
  return world.state_hash();
}

TEST(Switching, AtRandomInEveryStepGivesTheSameHash) {
  for (const char* name : {"pile", "gas", "polydisperse", "boxes-and-balls"}) {
    const Scene scene = scenes::make(name, {.spheres = 150, .seed = base_seed()});
    const std::uint64_t expected = hash_after_steps(World(scene));
    for (std::uint64_t k = 0; k < 3; ++k) {
      EXPECT_EQ(hash_after_steps(World(scene, std::make_unique<RandomSwitcher>(base_seed() + k))),
                expected)
          << name << ", " << seed_note();
    }
  }
}

TEST(Switching, ByAnyCostModelGivesTheSameHash) {
  const Scene scene = scenes::make("pile", {.spheres = 150, .seed = base_seed()});
  const std::uint64_t expected = hash_after_steps(World(scene));
  Random random(base_seed());
  for (int k = 0; k < 10; ++k) {
    WorldSettings settings;
    CostModel& costs = settings.collider.costs;
    costs.cuda_start_ms = 0;
    for (CostTerms* terms :
         {&costs.cpu_all_pairs, &costs.cpu_grid, &costs.cuda_all_pairs, &costs.cuda_grid}) {
      terms->sphere_ns = static_cast<double>(random.uniform(0, 1000));
      terms->pair_ns = static_cast<double>(random.uniform(0, 10));
    }
    EXPECT_EQ(hash_after_steps(World(scene, settings)), expected) << seed_note();
  }
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
