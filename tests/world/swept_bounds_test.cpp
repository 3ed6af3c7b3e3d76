/// Bounds of the motion of sub-shapes: solids that touch during a step have bounds that overlap.
#include "src/world/contacts/swept_bounds.hpp"

#include "src/world/bodies/sub_shape_table.hpp"
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

/// Moves all bodies by a fraction of their motion of a step.
void advance(BodyStore* store, const BodyStore& start, Real fraction) {
  for (const BodyId id : store->ids()) {
    const std::uint32_t i = id.index;
    const BodyView& view = start.view();
    store->moving.position[i] = view.position[i] + view.predicted_motion(i) * fraction;
    const Vec3& w = view.angular_velocity[i];
    const Quat turn = from_axis_angle(w, length(w) * view.dt * fraction);
    store->moving.orientation[i] = normalized(turn * view.orientation[i]);
  }
}

bool touch(const SubShapeView& sub_shapes, std::uint32_t a, std::uint32_t b) {
  detail::PairManifold manifold;
  find_contact(sub_shapes, a, b, 0, {}, {}, &manifold);
  return manifold.touch_count > 0;
}

TEST(SweptBounds, OfSolidsThatTouchWithinTheStepOverlap) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  std::size_t touches = 0, boxes = 0;
  for (int run = 0; run < 60; ++run) {
    BodyStore start(Real(1) / 60, {});
    const Real speed = random.below(2) == 0 ? 1._r : 60._r;
    for (int i = 0; i < 60; ++i) {
      BodyDef def = random_body(&random, 4);
      if (!has_volume(def.shape)) def.shape = Box{{0.3_r, 0.1_r, 0.5_r}};
      def.mass = 1;
      def.kinematic = false;
      def.velocity = random.uniform_in_box({-speed, -speed, -speed}, {speed, speed, speed});
      def.angular_velocity = random.uniform_in_box({-30, -30, -30}, {30, 30, 30});
      start.add(def);
    }
    SubShapeTable table;
    table.set_bodies(start);
    table.update_poses(start);
    const std::uint32_t count = table.ranges().fixed_begin();
    std::vector<Real> margins(count);
    std::vector<SphereInstance> swept(count);
    std::vector<Aabb> box_of(count);
    std::vector<Vec3> motion;
    for (const BodyId id : start.ids()) motion.push_back(start.view().predicted_motion(id.index));
    const SweptBounds bounds{.bodies = start.view(),
                             .sub_shapes = table.view(),
                             .motion = motion.data(),
                             .margins = margins.data(),
                             .swept = swept.data(),
                             .boxes = box_of.data(),
                             .largest_margin = 0.01_r};
    for (std::uint32_t i = 0; i < count; ++i) bounds.sweep(i);

    BodyStore now = start;
    SubShapeTable moved = table;
    for (int sample = 0; sample <= 4; ++sample) {
      advance(&now, start, Real(sample) / 4);
      moved.update_poses(now);
      const SubShapeView sub_shapes = moved.view();
      for (std::uint32_t a = 0; a < count; ++a) {
        for (std::uint32_t b = a + 1; b < count; ++b) {
          if (sub_shapes.body(a) == sub_shapes.body(b) || !touch(sub_shapes, a, b)) continue;
          ++touches;
          ASSERT_TRUE(overlap(bounds.query_bounds(a), bounds.query_bounds(b)))
              << "run " << run << ", sample " << sample << ", sub-shapes " << a << ", " << b;
          ASSERT_NE(bounds.kind_of(a, b), PairKind::none);
          if (!sub_shapes.is_sphere(a)) ++boxes;
        }
      }
    }
  }
  EXPECT_GT(touches, 2000u);
  EXPECT_GT(boxes, 1000u);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
