/// Islands: movable bodies that hang together by contacts.
#pragma once

#include <jfpx/scene.hpp>
#include <jfpx/world.hpp>

#include "src/viewer/drawing.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// For each body the lowest index in its island. What has no mass joins nothing and is alone: or
/// the ground would make one island of all that lies on it.
std::vector<std::uint32_t> islands_of(const Scene& scene, std::span<const Contact> contacts);

/// A colour for each body: the same within an island, grey for one that is alone.
std::vector<Paint> island_paints(const Scene& scene, std::span<const Contact> contacts);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
