/// Search for the contacts of a step of Solver::worst_first.
#pragma once

#include "src/world/contacts/contact_finder.hpp"

#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace thesis {

/// Owns its buffers, which grow and never shrink.
class ContactSearch {
 public:
  /// Finds the contacts at the current poses: contacts of two spheres, then all others, both sorted
  /// by (a.index, b.index), then by the sub-shapes of a and of b. Contact defines which body is a.
  /// Friction and restitution are 0.
  /// @param contacts empty; receives the contacts
  /// @returns the number of contacts of two spheres
  /// @throws the exceptions of SphereCollider::find_contacts()
  std::uint64_t find_contacts(const BodyStore& bodies, ContactFinder* finder,
                              std::vector<Contact>* contacts);

 private:
  /// Two spheres that touch, sortable by body and sub-shape.
  struct SphereHit {
    Candidate pair;
    std::uint64_t index = 0;  ///< in the contacts that the collider returned
    friend auto operator<=>(const SphereHit&, const SphereHit&) = default;
  };

  void find_sphere_pairs(const BodyStore& bodies, ContactFinder* finder,
                         std::vector<Contact>* contacts);

  std::vector<SphereHit> hits_;
  std::vector<Candidate> candidates_;
};

}  // namespace thesis
}  // namespace JFPX_ABI
}  // namespace jfpx
