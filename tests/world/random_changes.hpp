/// Random changes of worlds between steps.
#pragma once

#include <jfpx/force.hpp>

#include "src/world/world_impl.hpp"
#include "tests/world/random_bodies.hpp"

#include <cstdint>
#include <tuple>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Bodies of all shapes in a small room.
inline Scene random_room(Random* random) {
  Scene scene;
  scene.soft_step.substeps = 1 + static_cast<std::uint32_t>(random->below(4));
  const std::uint64_t count = 2 + random->below(40);
  for (std::uint64_t i = 0; i < count; ++i) {
    BodyDef def = random_body(random, 3);
    if (def.mass > 0) def.velocity = random->uniform_in_box({-3, -3, -3}, {3, 3, 3});
    def.restitution = random->below(2) == 0 ? Real(0) : random->uniform(0, 1);
    def.sensor = random->below(10) == 0;
    scene.bodies.push_back(def);
  }
  scene.bodies.push_back(half_space({0, 1, 0}, -3));
  add_random_joints(random, &scene);
  return scene;
}

/// A change that is applied to both worlds.
class Change {
 public:
  Change(Random* random, double time)
      : action_(random->below(18)),
        i_(random->below(1000)),
        j_(random->below(1000)),
        def_(random_body(random, 3)),
        locks_(random_locks(random)),
        vector_(random->uniform_in_box({-9, -9, -9}, {9, 9, 9})),
        joint_(random_joint(random, {},
                            random->below(4) == 0 ? std::nullopt : std::optional(BodyId{}))),
        start_(static_cast<Real>(time) + random->uniform(0, Real(0.1))) {}

  void make(World* world) const {
    const BodyId id = world->bodies()[i_ % world->bodies().size()];
    if (action_ == 0) world->add(def_);
    if (action_ == 1 && world->bodies().size() > 3) world->remove(id);
    if (action_ == 2) world->apply_force(id, vector_);
    if (action_ == 3) world->set_friction(id, absolute(vector_.x));
    if (action_ == 4) world->set_state(id, {def_.position, def_.orientation, vector_, {}});
    if (action_ == 5) world->apply_force_at_point(id, vector_, {});
    if (action_ == 6) world->set_filter(id, {.category = 2, .mask = 0xfffffffdu});
    if (action_ == 7 && world->mass(id) > 0) world->set_mass(id, Real(0.3) + absolute(vector_.z));
    if (action_ == 8 && world->forces().size() < 6) {
      world->add_force(Explosion{.centre = vector_ * Real(0.3),
                                 .start = start_,
                                 .peak_force = 20,
                                 .speed = 9,
                                 .thickness = 2,
                                 .duration = Real(0.2)});
    }
    if (action_ == 9 && world->forces().size() < 6)
      world->add_force(Gravity{vector_ * Real(0.3), id});
    if (action_ == 10 && !world->forces().empty()) world->remove_force(world->forces()[0]);
    if (action_ == 11) {
      for (const ForceId force : world->forces()) {
        auto* gravity = WorldAccess::impl(*world).forces.find(force)->target<Gravity>();
        if (gravity != nullptr) world->force<Gravity>(force).acceleration = vector_;
      }
    }
    if (action_ == 16) world->set_motion_locks(id, locks_);
    if (action_ == 17) replace(world, id);
    if (action_ >= 12 && action_ < 16) change_joints(world, id);
  }

 private:
  /// Another shape at the same place, or a mass of 0 instead of a mass, or a body at another place.
  void replace(World* world, BodyId id) const {
    BodyDef def = world->definition(id);
    if (j_ % 3 == 0) def.shape = def_.shape;
    if (j_ % 3 == 1) def.mass = def.mass > 0 ? Real(0) : Real(2);
    if (j_ % 3 == 2) def = def_;
    try {
      world->replace(id, def);
    } catch (const Error&) {
      // A wall with a mass, or a joint without a movable body. Both worlds refuse it.
    }
  }
  void change_joints(World* world, BodyId id) const {
    const std::span<const JointId> joints = world->joints();
    Joint joint = joint_;
    const auto bodies_of = [](auto& of) {
      return std::visit([](auto& j) { return std::tie(j.a, j.b); }, of);
    };
    const auto [a, b] = bodies_of(joint);
    if (action_ < 14) {
      const BodyId other = world->bodies()[j_ % world->bodies().size()];
      a = id;
      if (b) b = other;
      const bool any_movable = world->mass(a) > 0 || (b && world->mass(*b) > 0);
      if (any_movable && !(b && *b == a)) world->add_joint(joint);
      return;
    }
    if (joints.empty()) return;
    const JointId changed = joints[i_ % joints.size()];
    if (action_ == 14) return world->remove_joint(changed);
    const Joint& before = world->joint(changed);
    if (joint.index() != before.index()) return;
    std::tie(a, b) = bodies_of(before);
    world->set_joint(changed, joint);
  }

  std::uint64_t action_, i_, j_;
  BodyDef def_;
  MotionLocks locks_;
  Vec3 vector_;
  Joint joint_;
  Real start_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
