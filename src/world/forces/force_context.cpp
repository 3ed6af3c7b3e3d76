/// Application of forces to the bodies of a world.
#include <jfpx/force.hpp>

#include "src/world/bodies/body_store.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

void ForceContext::apply_force(BodyId id, const Vec3& force) {
  const std::uint32_t body = require(id);
  if (bodies_->moving.awake[body] != 0) bodies_->moving.force[body] += force;
}

void ForceContext::apply_torque(BodyId id, const Vec3& torque) {
  const std::uint32_t body = require(id);
  if (bodies_->moving.awake[body] != 0) bodies_->moving.torque[body] += torque;
}

void ForceContext::apply_force_at_point(BodyId id, const Vec3& force, const Vec3& point) {
  apply_force(id, force);
  apply_torque(id, cross(point - bodies_->moving.position[id.index], force));
}

void ForceContext::wake(BodyId id) { bodies_->wake(require(id)); }

void ForceContext::link(BodyId a, BodyId b) {
  const std::uint32_t first = require(a), second = require(b);
  const bool a_awake = bodies_->moving.awake[first] != 0;
  if (a_awake == (bodies_->moving.awake[second] != 0)) return;
  const std::uint32_t sleeper = a_awake ? second : first;
  if (bodies_->movable(sleeper)) bodies_->wake_by_contact(sleeper, a_awake ? first : second);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
