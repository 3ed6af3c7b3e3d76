/// Checks of the arguments of queries.
#include "src/world/queries/query_arguments.hpp"

#include <jfpx/error.hpp>

#include "src/collide/shapes.hpp"
#include "src/scene/field_fault.hpp"
#include "src/scene/shape_fields.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {

void throw_invalid_query(const char* name, const std::string& value, const char* range) {
  throw InvalidArgument(std::string(name) + " is " + value + "; it must be " + range);
}

Transform checked_pose(const SolidShape& shape, const Vec3& position, const Quat& orientation) {
  const auto check = [&](const auto& solid) {
    std::string fault = find_field_fault(solid);
    if (fault.empty()) fault = find_fault(BodyState{position, orientation, {}, {}});
    if (!fault.empty())
      throw InvalidArgument(detail::kShapeName<std::decay_t<decltype(solid)>> + (" " + fault));
  };
  std::visit(check, shape);
  return make_transform(normalized(orientation), position);
}

Transform checked_pose(const DistanceQuery& query) {
  const Sphere* ball = std::get_if<Sphere>(&query.shape);
  const bool is_point = ball != nullptr && ball->radius == 0;
  if (!(query.max_distance >= 0)) {
    throw_invalid_query("max_distance", to_text(query.max_distance), ">= 0; infinity is allowed");
  }
  return checked_pose(is_point ? SolidShape(Sphere{}) : query.shape, query.position,
                      query.orientation);
}

/// The components are scaled by a power of two before, because the square of the length may
/// overflow or underflow.
ScaledLength::ScaledLength(const Vec3& v) {
  int exponent = 0;
  std::frexp(std::max({absolute(v.x), absolute(v.y), absolute(v.z)}), &exponent);
  const auto scaled = [exponent](Real x) { return std::ldexp(x, -exponent); };
  const Vec3 mantissas{scaled(v.x), scaled(v.y), scaled(v.z)};
  unit = normalized(mantissas);
  length = std::ldexp(jfpx::length(mantissas), exponent);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
