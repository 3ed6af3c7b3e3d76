/// JSON values of scenes.
#pragma once

#include <jfpx/body.hpp>
#include <jfpx/scene.hpp>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Floating-point numbers are stored as Real, so that each precision writes the shortest text that
/// reads back to the same bits.
using SceneJson = nlohmann::basic_json<nlohmann::ordered_map, std::vector, std::string, bool,
                                       std::int64_t, std::uint64_t, Real>;

}  // namespace detail

/// A body from the JSON of a scene. @throws InvalidScene
BodyDef body_from_value(const detail::SceneJson& json);
/// Parses a text of bounded depth whose objects have unique keys. @throws InvalidScene
JFPX_API detail::SceneJson parse_json(std::string_view text);
/// A scene from its JSON, as from_json(). @throws InvalidScene
JFPX_API Scene scene_from_value(const detail::SceneJson& json);

}  // namespace JFPX_ABI
}  // namespace jfpx
