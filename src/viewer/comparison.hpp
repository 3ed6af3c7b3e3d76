/// What differs between runs: contacts bit by bit, drift, energy.
#pragma once

#include <jfpx/scene.hpp>
#include <jfpx/world.hpp>

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Contacts that only one of the two lists has, each counted as often as it is there; two are the
/// same if all their bits are. The order of the lists does not matter.
std::vector<Contact> different_contacts(std::span<const Contact> expected,
                                        std::span<const Contact> actual);

/// Mean distance between the same movable bodies in two runs [m].
double drift(const Scene& scene, std::span<const BodyState> a, std::span<const BodyState> b);

/// Kinetic energy, and potential energy in each body's own constant acceleration [J].
double energy(const Scene& scene, std::span<const BodyState> states);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
