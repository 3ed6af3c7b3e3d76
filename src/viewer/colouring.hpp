/// Colours that represent a property of each body: speed, sleep, penetration, contacts or island.
#pragma once

#include <jfpx/world.hpp>

#include "src/viewer/drawing.hpp"
#include "src/viewer/run_state.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// The property that the colours represent; `bodies` only distinguishes bodies.
enum class Colouring : std::uint8_t { bodies, speed, sleep, penetration, contacts, islands };
inline constexpr const char* kColouringNames[] = {"bodies",      "speed",    "sleep",
                                                  "penetration", "contacts", "islands"};

/// One value in [0, 1] per body. Properties without a natural scale are divided by the largest
/// value of the state. Empty for Colouring::bodies and Colouring::islands.
std::vector<Real> colour_values(const Scene& scene, const RunState& run_state, Colouring colouring);

/// The lowest body index in the island of each body. Islands consist of movable bodies connected by
/// contacts. Bodies of mass 0 connect nothing; otherwise the ground would merge all islands on it.
std::vector<std::uint32_t> islands_of(const Scene& scene, std::span<const Contact> contacts);

/// One colour per body: equal within an island, grey for an isolated body.
std::vector<Paint> island_paints(const Scene& scene, std::span<const Contact> contacts);

/// One colour per body; empty for Colouring::bodies.
std::vector<Paint> body_paints(const Scene& scene, const RunState& run_state, Colouring colouring);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
