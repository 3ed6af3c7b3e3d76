/// Tests of the body store: ids and poses.
#include "src/world/bodies/body_store.hpp"

#include "src/collide/shapes.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

namespace jfpx {
namespace {

using test::operator""_r;

BodyStore make_store() { return BodyStore(0.01_r, SleepSettings{}); }

TEST(BodyStore, AnIdIsNeverReusedThoughItsIndexIs) {
  BodyStore store = make_store();
  const BodyId a = store.add(test::ball({0, 0, 0}));
  const BodyId b = store.add(test::ball({1, 0, 0}));
  const BodyId c = store.add(test::ball({2, 0, 0}));
  store.remove(b);
  EXPECT_FALSE(store.contains(b));
  EXPECT_TRUE(store.contains(a) && store.contains(c));
  const BodyId d = store.add(test::ball({3, 0, 0}));
  EXPECT_EQ(d.index, b.index);
  EXPECT_NE(d, b);
  EXPECT_FALSE(store.contains(b));
  EXPECT_EQ(std::vector<BodyId>(store.ids().begin(), store.ids().end()),
            (std::vector<BodyId>{a, d, c}));
  EXPECT_EQ(store.state(d.index).position, (Vec3{3, 0, 0}));
}

TEST(BodyStore, KeepsIdsInOrderThroughRandomAddsAndRemoves) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  BodyStore store = make_store();
  std::vector<std::pair<BodyId, Real>> living;
  for (int i = 0; i < 5000; ++i) {
    if (living.empty() || random.below(5) < 3) {
      const Real x = static_cast<Real>(i);
      living.push_back({store.add(test::ball({x, 0, 0})), x});
    } else {
      const std::size_t k = random.below(living.size());
      store.remove(living[k].first);
      EXPECT_FALSE(store.contains(living[k].first));
      living.erase(living.begin() + static_cast<std::ptrdiff_t>(k));
    }
    if (random.below(8) == 0) {
      ASSERT_EQ(store.ids().size(), living.size());
    }
  }
  ASSERT_EQ(store.ids().size(), living.size());
  ASSERT_EQ(store.movable_count(), living.size());
  for (std::size_t i = 1; i < living.size(); ++i) {
    ASSERT_LT(store.ids()[i - 1].index, store.ids()[i].index);
  }
  for (const auto& [id, x] : living) ASSERT_EQ(store.state(id.index).position.x, x);
}

TEST(Erratum, E23_inertia_of_a_box_is_a_third_of_the_half_sizes) {
  // m/3 (b^2 + c^2) = 1/3 * 2 for a cube of half size 1.
  EXPECT_NEAR(detail::moments_of_inertia(Box{{1, 1, 1}}, 1).x, Real(2) / 3, kEpsilon);
  const Vec3 moments = detail::moments_of_inertia(Box{{1, 2, 3}}, 3);
  EXPECT_EQ(moments, (Vec3{13, 10, 5}));
}

TEST(Erratum, E24_a_body_starts_unturned_and_a_tiny_quaternion_turns_nothing) {
  BodyStore store = make_store();
  const std::uint32_t i = store.add(test::ball({})).index;
  EXPECT_EQ(store.moving.orientation[i], (Quat{1, 0, 0, 0}));
  store.set_state(i, {{}, {0, Real(1e-25), 0, 0}, {}, {}});
  EXPECT_EQ(store.moving.orientation[i], (Quat{1, 0, 0, 0}));
}

}  // namespace
}  // namespace jfpx
