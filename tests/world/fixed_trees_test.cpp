/// Tests of the trees of the solids of mass 0: a test of every pair finds the same.
#include "src/world/contacts/fixed_trees.hpp"

#include "src/scene/compound.hpp"
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

using SubShapes = std::vector<std::uint32_t>;

/// A store, its sub-shapes and their bounds, with trees that are kept from step to step.
class Search {
 public:
  explicit Search(BodyStore* store) : store_(store) {}

  void set_bodies() {
    table_.set_bodies(*store_);
    is_new_ = true;
  }
  /// Updates poses and trees as a step does.
  void update() {
    table_.update_poses(*store_);
    margins_.resize(table_.ranges().bounded());
    swept_.resize(table_.ranges().bounded());
    boxes_.resize(table_.ranges().fixed_begin());
    motion_.resize(store_->capacity());
    for (std::uint32_t i = 0; i < store_->capacity(); ++i) {
      motion_[i] = store_->view().predicted_motion(i);
    }
    bounds_ = {.bodies = store_->view(),
               .sub_shapes = table_.view(),
               .motion = motion_.data(),
               .margins = margins_.data(),
               .swept = swept_.data(),
               .boxes = boxes_.data(),
               .largest_margin = 0.01_r};
    for (std::uint32_t i = 0; i < table_.ranges().bounded(); ++i) bounds_.sweep(i);
    is_new_ ? trees_.set_bodies(table_, bounds_) : trees_.move_kinematic(bounds_);
    is_new_ = false;
  }
  std::uint32_t size() const { return table_.ranges().fixed_begin(); }
  bool is_movable(std::uint32_t i) const { return store_->movable(bounds_.sub_shapes.body(i)); }

  SubShapes found(std::uint32_t i) const {
    SubShapes list;
    bounds_.visit_fixed(i, trees_.view(),
                        [&](std::uint32_t fixed, std::uint32_t) { list.push_back(fixed); });
    std::ranges::sort(list);
    return list;
  }
  SubShapes expected(std::uint32_t i) const {
    SubShapes list;
    const std::uint32_t body = bounds_.sub_shapes.body(i);
    for (std::uint32_t fixed = size(); fixed < table_.ranges().all(); ++fixed) {
      const bool near = bounds_.sub_shapes.is_wall(fixed) ||
                        overlap(bounds_.tree_bounds(fixed), bounds_.query_bounds(i));
      if (near && store_->may_collide(body, bounds_.sub_shapes.body(fixed)) &&
          bounds_.may_meet(i, fixed)) {
        list.push_back(fixed);
      }
    }
    return list;
  }

 private:
  BodyStore* store_;
  SubShapeTable table_;
  FixedTrees trees_;
  std::vector<Real> margins_;
  std::vector<SphereInstance> swept_;
  std::vector<Aabb> boxes_;
  std::vector<Vec3> motion_;
  SweptBounds bounds_;
  bool is_new_ = true;
};

TEST(FixedTrees, FindWhatATestOfEveryPairFinds) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  std::size_t found = 0;
  for (int run = 0; run < 40; ++run) {
    BodyStore store(Real(1) / 60, {});
    const std::uint64_t count = random.below(400);
    const Real far = random.below(3) == 0 ? Real(1e5) : Real(0);
    const auto body = [&] {
      BodyDef def = random_body(&random, 8);
      if (random.below(4) == 0) def.shape = Box{{6, 0.1_r, 6}};
      if (!has_volume(def.shape) && !is_wall(def.shape)) def.shape = Sphere{};
      def.mass = random.below(3) == 0 && !is_wall(def.shape) ? Real(1) : Real(0);
      def.kinematic = def.mass == 0 && !is_wall(def.shape) && random.below(3) == 0;
      def.position.x += far;
      def.velocity = random.uniform_in_box({-3, -3, -3}, {3, 3, 3});
      return def;
    };
    for (std::uint64_t i = 0; i < count; ++i) store.add(body());
    Search search(&store);
    search.set_bodies();
    for (int step = 0; step < 40; ++step) {
      if (random.below(8) == 0) {
        const auto ids = store.ids();
        if (!ids.empty() && random.below(2) == 0) store.remove(ids[random.below(ids.size())]);
        store.add(body());
        search.set_bodies();
      }
      for (const BodyId id : store.ids()) {
        if (!store.kinematic(id.index)) continue;
        store.moving.position[id.index] += random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
      }
      search.update();
      for (std::uint32_t i = 0; i < search.size(); ++i) {
        if (!search.is_movable(i)) continue;
        const SubShapes expected = search.expected(i);
        ASSERT_EQ(search.found(i), expected) << "run " << run << ", step " << step;
        found += expected.size();
      }
    }
  }
  EXPECT_GT(found, 10000u);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
