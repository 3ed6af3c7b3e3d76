/// Description of the fields of public types: their names, ranges, and presence in JSON.
///
/// A function each_field(object, visit) calls visit(field, member) with a Field for each field of a
/// type. It lists all members of its type in a structured binding, so that a missing member is a
/// compile error. The reader and the writer of JSON, validation, snapshots and recordings use these
/// lists.
#pragma once

#include <jfpx/scene.hpp>

#include "src/base/is.hpp"

#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {

/// Range of a field for which every value is valid, or whose members have ranges. Other ranges have
/// a function contains(value), and `text`, the end of the sentence "it must be ...".
struct AnyValue {};

/// Range of a field with further conditions, or with different conditions than its members.
struct CheckedByCode {};

/// Numbers from `least` to `most`, and vectors of such numbers.
struct Interval {
  Real least, most;
  const char* text;
  bool is_open = false;  ///< whether `least` is excluded from the interval

  constexpr bool contains(Real x) const { return (is_open ? x > least : x >= least) && x <= most; }
  constexpr bool contains(std::uint32_t x) const { return contains(static_cast<Real>(x)); }
  constexpr bool contains(const Vec3& v) const {
    return contains(v.x) && contains(v.y) && contains(v.z);
  }
};

/// Vectors or quaternions of unit length, to kUnitTolerance.
struct UnitLength {
  const char* text;
  constexpr bool contains(const auto& v) const {
    return absolute(length_squared(v) - 1) <= kUnitTolerance;
  }
};

/// The values of an enumeration that have names.
struct Enumerator {
  const char* text;
  constexpr bool contains(auto value) const { return to_string(value) != nullptr; }
};

/// Lists with at least one item, whose items are valid. The text is the end of the sentence "it
/// must have ...".
struct NotEmpty {
  const char* text;
};

inline constexpr Real kMostReal = std::numeric_limits<Real>::max();
inline constexpr Interval kFinite{-kMostReal, kMostReal, "finite"};
inline constexpr Interval kNotNegative{0, kMostReal, "finite and >= 0"};
inline constexpr Interval kPositive{0, kMostReal, "finite and > 0", true};
inline constexpr Interval kZeroToOne{0, 1, "in [0, 1]"};
inline constexpr Interval kAboveZeroToOne{0, 1, "in (0, 1]", true};
inline constexpr Interval kSize{0, kMaxCoordinate, "> 0 and at most 1e9", true};
inline constexpr Interval kSizes{0, kMaxCoordinate, "> 0 and at most 1e9 each", true};
inline constexpr Interval kInWorld{-kMaxCoordinate, kMaxCoordinate, "between -1e9 and 1e9"};
/// A denormal step length, and all values computed from it, would lose digits.
inline constexpr Interval kStepLength{std::numeric_limits<Real>::min(), kMostReal,
                                      "finite, > 0 and not denormal"};
inline constexpr UnitLength kUnitVector{"a unit vector, to a thousandth"};
inline constexpr UnitLength kUnitQuaternion{"a unit quaternion, to a thousandth"};

/// Presence of a field in JSON.
enum class Presence : std::uint8_t {
  required,  ///< must be present
  optional,  ///< always written; an absent field has the default
  newer,     ///< written only if not the default, so that older versions can read the file
};

template <Presence kPresenceOf, class RangeOf>
struct Field {
  static constexpr Presence kPresence = kPresenceOf;
  using Range = RangeOf;
  const char* name;
  Range range;
};

template <class Range = AnyValue>
constexpr Field<Presence::optional, Range> field(const char* name, Range range = {}) {
  return {name, range};
}
template <class Range = AnyValue>
constexpr Field<Presence::required, Range> required_field(const char* name, Range range = {}) {
  return {name, range};
}
template <class Range = AnyValue>
constexpr Field<Presence::newer, Range> newer_field(const char* name, Range range = {}) {
  return {name, range};
}

/// A type with a function each_field().
template <class T>
concept HasFields = requires(T& object) {
  each_field(object, [](const auto&, auto&) {});
};

}  // namespace JFPX_ABI
}  // namespace jfpx
