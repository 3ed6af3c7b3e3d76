/// JSON values of scenes, and the names of shapes in them.
#pragma once

#include <jfpx/body.hpp>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Floating-point numbers are stored as Real, so that the shortest text that reads back to the same
/// bits is written in either precision.
using SceneJson = nlohmann::basic_json<nlohmann::ordered_map, std::vector, std::string, bool,
                                       std::int64_t, std::uint64_t, Real>;

/// Name of a shape in the field "type".
template <class T>
inline constexpr const char* kTypeName = nullptr;
template <>
inline constexpr const char* kTypeName<Sphere> = "sphere";
template <>
inline constexpr const char* kTypeName<Box> = "box";
template <>
inline constexpr const char* kTypeName<HalfSpace> = "half_space";
template <>
inline constexpr const char* kTypeName<Plane> = "plane";
template <>
inline constexpr const char* kTypeName<Compound> = "compound";

}  // namespace detail

/// A body from the JSON of a scene. @throws InvalidScene
BodyDef body_from_value(const detail::SceneJson& json);
/// Parses a text of bounded depth whose objects have unique keys. @throws InvalidScene
detail::SceneJson parse_json(std::string_view text);

}  // namespace JFPX_ABI
}  // namespace jfpx
