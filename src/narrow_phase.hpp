/// Finds the contacts of a world: spheres and boxes among themselves and against what stands still.
#pragma once

#include <jfpx/collide.hpp>
#include <jfpx/world.hpp>

#include "src/body_store.hpp"
#include "src/piece_table.hpp"
#include "src/touch_finder.hpp"

namespace jfpx::inline JFPX_ABI {

/// Sphere pairs are the collider's, and so are the candidates among movable boxes: it gets their
/// bounding spheres too, or the broad phase finds for it which may touch. Every immovable box,
/// half-space and plane is tested against every movable body. Contacts between immovable bodies,
/// and within one body, are dropped.
class NarrowPhase {
 public:
  NarrowPhase(std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase);

  /// Must be called when bodies came, went, or an immovable one was moved.
  void set_bodies(const BodyStore& bodies);

  /// Appends sphere pairs, then the others, each by (a, b), then by the pieces of a and of b; a and
  /// b are body indices, chosen as Contact says.
  /// @returns the number of sphere pairs
  /// @throws what SphereCollider::find_contacts() throws
  std::uint64_t find_contacts(const BodyStore& bodies, std::vector<Contact>* contacts);

  const SphereCollider& collider() const noexcept { return touches_.collider(); }

 private:
  using Piece = PieceTable::Piece;
  /// Two pieces that may touch, in the order of their contact.
  struct Candidate {
    std::uint32_t a = 0, b = 0;
    Piece piece_a = 0, piece_b = 0;
    friend auto operator<=>(const Candidate&, const Candidate&) = default;
  };
  /// Two spheres that touch.
  struct SphereHit {
    Candidate pair;
    std::uint64_t index = 0;  ///< in what the collider found
    friend auto operator<=>(const SphereHit&, const SphereHit&) = default;
  };

  bool comes_first(const BodyStore& bodies, std::uint32_t x, std::uint32_t y) const;
  Candidate ordered(const BodyStore& bodies, Piece x, Piece y) const;
  void find_sphere_pairs(const BodyStore& bodies, std::vector<Contact>* contacts);
  void find_obstacles(const BodyStore& bodies);
  bool may_touch(Piece piece, Piece fixed, const Vec3& centre) const;

  TouchFinder touches_;
  PieceTable pieces_;
  std::vector<SphereHit> hits_;
  std::vector<Candidate> candidates_;
};

}  // namespace jfpx::inline JFPX_ABI
