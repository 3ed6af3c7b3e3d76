/// Contact detection of a world: between movable bodies, and with immovable ones.
#pragma once

#include <jfpx/collide.hpp>
#include <jfpx/world.hpp>

#include "src/world/body_store.hpp"
#include "src/world/broad_phase_search.hpp"
#include "src/world/sub_shape_table.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// The broad phase and the sphere collider find the pairs of touching spheres, and, through
/// bounding spheres, the candidate pairs of movable boxes. Every immovable box, half-space and
/// plane is tested against every movable body. Contacts between immovable bodies, and within one
/// body, are discarded.
class ContactFinder {
 public:
  ContactFinder(std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase);

  /// Must be called after bodies were added or removed, or an immovable body was moved.
  void set_bodies(const BodyStore& bodies);

  /// Appends the contacts of two spheres, then all others, both sorted by the indices of (a, b),
  /// then by the sub-shapes of a and of b. Contact defines the choice of a and b.
  /// @returns the number of contacts of two spheres
  /// @throws the exceptions of SphereCollider::find_contacts()
  std::uint64_t find_contacts(const BodyStore& bodies, std::vector<Contact>* contacts);

  const SphereCollider& collider() const noexcept { return broad_phase_.collider(); }

 private:
  using SubShape = SubShapeTable::SubShape;
  /// Two sub-shapes that may touch, in the order of their contact.
  struct Candidate {
    std::uint32_t a = 0, b = 0;
    SubShape sub_shape_a = 0, sub_shape_b = 0;
    friend auto operator<=>(const Candidate&, const Candidate&) = default;
  };
  /// Two spheres that touch.
  struct SphereHit {
    Candidate pair;
    std::uint64_t index = 0;  ///< in the list of the collider
    friend auto operator<=>(const SphereHit&, const SphereHit&) = default;
  };

  bool comes_first(const BodyStore& bodies, std::uint32_t x, std::uint32_t y) const;
  Candidate ordered(const BodyStore& bodies, SubShape x, SubShape y) const;
  void find_sphere_pairs(const BodyStore& bodies, std::vector<Contact>* contacts);
  void find_fixed_candidates(const BodyStore& bodies);
  bool may_touch(SubShape sub_shape, SubShape fixed, const Vec3& centre) const;

  BroadPhaseSearch broad_phase_;
  SubShapeTable sub_shapes_;
  std::vector<SphereHit> hits_;
  std::vector<Candidate> candidates_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
