/// Differences between runs: contacts bit by bit, drift and energy.
#pragma once

#include <jfpx/scene.hpp>
#include <jfpx/world.hpp>

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// The multiset symmetric difference of two lists of contacts. Contacts are equal if all their bits
/// are equal; the order of the lists is irrelevant.
std::vector<Contact> different_contacts(std::span<const Contact> expected,
                                        std::span<const Contact> actual);

/// Mean distance between corresponding movable bodies of two runs [m].
double drift(const Scene& scene, std::span<const BodyState> a, std::span<const BodyState> b);

/// Kinetic energy plus potential energy in the constant acceleration of each body [J].
double energy(const Scene& scene, std::span<const BodyState> states);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
