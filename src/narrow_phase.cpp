/// Gathers spheres, asks the collider, and tests the surroundings.
#include "src/narrow_phase.hpp"

#include <jfpx/collide.hpp>

#include <utility>

namespace jfpx::inline JFPX_ABI {
namespace {

/// False only where the full test would find no touch: its result is wrong by a few roundings of
/// the distance at most, and the margin is larger.
bool near(const SphereInstance& sphere, const Vec3& origin, Real reach) {
  constexpr Real kMargin = 1 + 64 * kEpsilon;
  const Real most = reach + sphere.radius;
  return length_squared(sphere.centre - origin) <= most * most * kMargin;
}

}  // namespace

NarrowPhase::NarrowPhase(std::unique_ptr<SphereCollider> collider)
    : collider_(std::move(collider)) {}

void NarrowPhase::set_bodies(const BodyStore& bodies) {
  sphere_body_.clear();
  spheres_.clear();
  obstacles_.clear();
  for (const BodyId id : bodies.ids()) {
    const Shape& shape = bodies.shape(id.index);
    if (const auto* sphere = std::get_if<Sphere>(&shape)) {
      sphere_body_.push_back(id.index);
      spheres_.push_back({bodies.moving.position[id.index], sphere->radius});
      continue;
    }
    const auto* box = std::get_if<Box>(&shape);
    obstacles_.push_back(
        {id.index, shape,
         make_transform(bodies.moving.orientation[id.index], bodies.moving.position[id.index]),
         box != nullptr ? length(box->half_extents) : Real(0)});
  }
}

std::uint64_t NarrowPhase::find_contacts(const BodyStore& bodies, std::vector<Contact>* contacts) {
  for (std::size_t i = 0; i < spheres_.size(); ++i) {
    spheres_[i].centre = bodies.moving.position[sphere_body_[i]];
  }
  std::uint64_t sphere_contacts = 0;
  for (const SphereContact& c : collider_->find_contacts(spheres_)) {
    const std::uint32_t a = sphere_body_[c.a], b = sphere_body_[c.b];
    if (!bodies.movable(a) && !bodies.movable(b)) continue;
    const Vec3 point = middle_point(c.normal, c.distance, spheres_[c.b]);
    contacts->push_back({a, b, c.normal, point, c.distance});
    ++sphere_contacts;
  }

  for (std::size_t i = 0; i < spheres_.size(); ++i) {
    if (!bodies.movable(sphere_body_[i])) continue;
    for (const Obstacle& obstacle : obstacles_) {
      Touch touch;
      if (const auto* half_space = std::get_if<HalfSpace>(&obstacle.shape)) {
        touch = collide(spheres_[i], *half_space);
      } else if (near(spheres_[i], obstacle.pose.origin, obstacle.reach)) {
        touch = collide(spheres_[i], std::get<Box>(obstacle.shape), obstacle.pose);
      }
      if (!touch.touching) continue;
      contacts->push_back(
          {sphere_body_[i], obstacle.body, touch.normal, touch.point, touch.distance});
    }
  }
  return sphere_contacts;
}

}  // namespace jfpx::inline JFPX_ABI
