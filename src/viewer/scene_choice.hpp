/// Choosing what runs, in a panel.
#pragma once

#include <jfpx/config.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// A list of all named scenes and demos. @return the one that the user has chosen just now
std::optional<std::string> choose_scene(const std::string& current);

/// True for demos that are more than a scene: those with controls beyond a new start.
bool is_playable(std::string_view name);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
