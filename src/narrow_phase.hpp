/// Finds the contacts of a world: spheres among themselves, and spheres against what stands still.
#pragma once

#include <jfpx/world.hpp>

#include "src/body_store.hpp"

namespace jfpx::inline JFPX_ABI {

/// Sphere pairs are the collider's; every immovable box and half-space is tested against every
/// movable sphere. Contacts between immovable bodies are dropped.
class NarrowPhase {
 public:
  explicit NarrowPhase(std::unique_ptr<SphereCollider> collider);

  /// Must be called when bodies came, went, or an immovable one was moved.
  void set_bodies(const BodyStore& bodies);

  /// Appends sphere pairs by (a, b), then the others by (a, b); a and b are body indices.
  /// @returns the number of sphere pairs
  /// @throws what SphereCollider::find_contacts() throws
  std::uint64_t find_contacts(const BodyStore& bodies, std::vector<Contact>* contacts);

  Backend backend() const noexcept { return collider_->backend(); }

 private:
  /// An immovable box or half-space.
  struct Obstacle {
    std::uint32_t body = 0;
    Shape shape;
    Transform pose;
    Real reach = 0;  ///< [m], from the origin of the pose to the farthest point; half-space: none
  };

  std::unique_ptr<SphereCollider> collider_;
  std::vector<std::uint32_t> sphere_body_;  ///< by index in spheres_
  std::vector<SphereInstance> spheres_;
  std::vector<Obstacle> obstacles_;
};

}  // namespace jfpx::inline JFPX_ABI
