/// Finds the contacts of a world: spheres and boxes among themselves and against what stands still.
#pragma once

#include <jfpx/collide.hpp>
#include <jfpx/world.hpp>

#include "src/body_store.hpp"

namespace jfpx::inline JFPX_ABI {

/// Sphere pairs are the collider's, and so are the candidates among movable boxes: it gets their
/// bounding spheres too. Every immovable box and half-space is tested against every movable body.
/// Contacts between immovable bodies are dropped.
class NarrowPhase {
 public:
  explicit NarrowPhase(std::unique_ptr<SphereCollider> collider);

  /// Must be called when bodies came, went, or an immovable one was moved.
  void set_bodies(const BodyStore& bodies);

  /// Appends sphere pairs by (a, b), then the others by (a, b); a and b are body indices.
  /// @returns the number of sphere pairs
  /// @throws what SphereCollider::find_contacts() throws
  std::uint64_t find_contacts(const BodyStore& bodies, std::vector<Contact>* contacts);

  const SphereCollider& collider() const noexcept { return *collider_; }

 private:
  /// An immovable box or half-space.
  struct Obstacle {
    std::uint32_t body = 0;
    SphereInstance bounds;  ///< of a half-space: none, its radius is 0
  };
  /// Two bodies of which one is no sphere, in the order of their contact.
  struct Candidate {
    std::uint32_t a = 0, b = 0;
    friend auto operator<=>(const Candidate&, const Candidate&) = default;
  };

  void find_sphere_pairs(const BodyStore& bodies, std::vector<Contact>* contacts);
  void find_obstacles(const BodyStore& bodies);

  std::unique_ptr<SphereCollider> collider_;
  std::size_t sphere_count_ = 0;        ///< of shapes_: spheres come first, then movable boxes
  std::vector<std::uint32_t> body_;     ///< by index in bounds_
  std::vector<SphereInstance> bounds_;  ///< spheres as they are, boxes as bounding spheres
  std::vector<Obstacle> obstacles_;
  std::vector<Transform> pose_;  ///< by body; of boxes only
  std::vector<Candidate> candidates_;
};

}  // namespace jfpx::inline JFPX_ABI
