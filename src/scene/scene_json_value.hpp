/// JSON values of scenes, and the names of shapes in them.
#pragma once

#include <jfpx/shape.hpp>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
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
}  // namespace JFPX_ABI
}  // namespace jfpx
