/// Contacts of several ranks.
#pragma once

#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/ranks/domain.hpp"
#include "src/world/contacts/detected_contacts.hpp"

#include <functional>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace contact_exchange {

using soft_step::ContactSet;

/// After contact detection: sends the contacts of bodies of this rank with bodies of other ranks to
/// these ranks, and merges theirs into the set. The set has no impulses yet.
/// @param crossing ContactFinder::crossing_spheres()
void share_detected(Domain* domain, std::span<const std::uint32_t> crossing, ContactSet* set);

/// Replaces the set of a completed step by that of other owners: all contacts of the bodies that
/// this rank owns now.
/// @param set   contacts of the bodies that this rank has owned
/// @param owner former owners, by body
void migrate(Domain* domain, std::span<const Domain::Rank> owner, ContactSet* set);

/// Removes all contacts of which this rank has no row.
void keep_own(const Domain& domain, ContactSet* set);

/// Replaces the set of a completed step by the contacts of all ranks, on every rank.
void gather(Domain* domain, ContactSet* set);
/// The same for the other contacts.
void gather(Domain* domain, DetectedContacts* contacts);

}  // namespace contact_exchange
}  // namespace JFPX_ABI
}  // namespace jfpx
