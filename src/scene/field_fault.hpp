/// Validation of fields and arguments by the ranges of field.hpp.
#pragma once

#include <jfpx/error.hpp>

#include "src/scene/field.hpp"
#include "src/scene/scene_validate.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

template <class Value>
std::string fault(std::string_view field, const Value& value, std::string_view range) {
  return std::string(field) + " is " + to_text(value) + "; it must be " + std::string(range);
}

/// @throws InvalidArgument if a value is not in its range
template <class Value, class Range>
void require_in_range(std::string_view name, const Value& value, const Range& range) {
  if (!range.contains(value)) throw InvalidArgument(fault(name, value, range.text));
}

/// Separate from the functions below, so that compilers inline the latter.
template <class Value>
bool put_fault(const char* field, const Value& value, const char* range, std::string* found) {
  *found = fault(field, value, range);
  return false;
}

/// Whether all fields are in their ranges. @param found receives name, value and range of the first
/// field that is not
template <HasFields T>
bool are_in_range(const T& object, std::string* found);

/// Whether a field is in its range. @param found receives name, value and range if it is not
template <class Field, class T>
bool is_in_range(const Field& field, const T& member, std::string* found) {
  using Range = typename Field::Range;
  if constexpr (HasFields<T> && std::same_as<Range, AnyValue>) {
    if (are_in_range(member, found)) return true;
    *found = std::string(field.name) + "." + *found;
    return false;
  } else if constexpr (!std::same_as<Range, AnyValue> && !std::same_as<Range, CheckedByCode>) {
    return field.range.contains(member) || put_fault(field.name, member, field.range.text, found);
  }
  return true;
}
template <Presence kPresence>
bool is_in_range(const Field<kPresence, Interval>& field, const Mat3& member, std::string* found) {
  return std::ranges::all_of(member.row,
                             [&](const Vec3& row) { return is_in_range(field, row, found); });
}
template <class Field, class... T>
bool is_in_range(const Field&, const std::variant<T...>& member, std::string* found) {
  return std::visit([found](const auto& value) { return are_in_range(value, found); }, member);
}
template <Presence kPresence, HasFields T>
bool is_in_range(const Field<kPresence, NotEmpty>& field, const std::vector<T>& members,
                 std::string* found) {
  if (members.empty()) {
    *found = std::string(field.name) + " is empty; it must have " + field.range.text;
  }
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (are_in_range(members[i], found)) continue;
    *found = std::string(field.name) + "[" + std::to_string(i) + "]." + *found;
    return false;
  }
  return !members.empty();
}

template <Presence kPresence, class T>
requires(!HasFields<T>) bool is_in_range(const Field<kPresence, NotEmpty>& field,
                                         const std::vector<T>& members, std::string* found) {
  if (members.empty()) {
    *found = std::string(field.name) + " is empty; it must have " + field.range.text;
  }
  return !members.empty();
}

template <HasFields T>
bool are_in_range(const T& object, std::string* found) {
  bool are = true;
  each_field(object, [&are, found](const auto& field, const auto& member) {
    are = are && is_in_range(field, member, found);
  });
  return are;
}
/// Message about the first field that is not in its range, with value and range; empty if all are.
template <HasFields T>
std::string find_field_fault(const T& object) {
  std::string found;
  are_in_range(object, &found);
  return found;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
