/// Finds the contacts of a world: spheres and boxes among themselves and against what stands still.
#pragma once

#include <jfpx/collide.hpp>
#include <jfpx/world.hpp>

#include "src/world/body_store.hpp"
#include "src/world/broad_phase_search.hpp"
#include "src/world/sub_shape_table.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Sphere pairs are the collider's, and so are the candidates among movable boxes: it gets their
/// bounding spheres too, or the broad phase finds for it which may touch. Every immovable box,
/// half-space and plane is tested against every movable body. Contacts between immovable bodies,
/// and within one body, are dropped.
class ContactFinder {
 public:
  ContactFinder(std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase);

  /// Must be called when bodies came, went, or an immovable one was moved.
  void set_bodies(const BodyStore& bodies);

  /// Appends sphere pairs, then the others, each by (a, b), then by the sub_shapes of a and of b; a
  /// and b are body indices, chosen as Contact says.
  /// @returns the number of sphere pairs
  /// @throws what SphereCollider::find_contacts() throws
  std::uint64_t find_contacts(const BodyStore& bodies, std::vector<Contact>* contacts);

  const SphereCollider& collider() const noexcept { return touches_.collider(); }

 private:
  using SubShape = SubShapeTable::SubShape;
  /// Two sub_shapes that may touch, in the order of their contact.
  struct Candidate {
    std::uint32_t a = 0, b = 0;
    SubShape sub_shape_a = 0, sub_shape_b = 0;
    friend auto operator<=>(const Candidate&, const Candidate&) = default;
  };
  /// Two spheres that touch.
  struct SphereHit {
    Candidate pair;
    std::uint64_t index = 0;  ///< in what the collider found
    friend auto operator<=>(const SphereHit&, const SphereHit&) = default;
  };

  bool comes_first(const BodyStore& bodies, std::uint32_t x, std::uint32_t y) const;
  Candidate ordered(const BodyStore& bodies, SubShape x, SubShape y) const;
  void find_sphere_pairs(const BodyStore& bodies, std::vector<Contact>* contacts);
  void find_obstacles(const BodyStore& bodies);
  bool may_touch(SubShape sub_shape, SubShape fixed, const Vec3& centre) const;

  BroadPhaseSearch touches_;
  SubShapeTable sub_shapes_;
  std::vector<SphereHit> hits_;
  std::vector<Candidate> candidates_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
