/// Checks of the arguments of queries.
#pragma once

#include <jfpx/query.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

/// @throws InvalidArgument with name, value and range
[[noreturn]] void throw_invalid_query(const char* name, const std::string& value,
                                      const char* range);
/// throw_invalid_query() unless the argument is valid.
inline void require_in_query(bool valid, const char* name, const std::string& value,
                             const char* range) {
  if (!valid) throw_invalid_query(name, value, range);
}

/// The pose of a solid. @throws InvalidArgument for a shape, position or orientation that is
/// invalid for a body
Transform checked_pose(const SolidShape& shape, const Vec3& position, const Quat& orientation);

/// The pose of the solid of a query, of which a sphere may have the radius 0.
/// @throws InvalidArgument for any argument that is out of its range
Transform checked_pose(const DistanceQuery& query);

/// Direction and length of a finite vector that is not zero.
struct ScaledLength {
  Vec3 unit;
  Real length = 0;

  explicit ScaledLength(const Vec3& v);
};

}  // namespace JFPX_ABI
}  // namespace jfpx
