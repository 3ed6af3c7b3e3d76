/// Validation of fields by the ranges of field.hpp.
#pragma once

#include "src/scene/field.hpp"
#include "src/scene/scene_validate.hpp"

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

/// Finds the first field that is not in its range. @param found gets name, value and range
template <HasFields T>
void find_field_fault(const T& object, std::string* found);

/// The same for one field. `found` must be empty.
template <class Field, class T>
void find_fault_of(const Field& field, const T& member, std::string* found) {
  using Range = typename Field::Range;
  if constexpr (HasFields<T> && std::same_as<Range, AnyValue>) {
    find_field_fault(member, found);
    if (!found->empty()) *found = std::string(field.name) + "." + *found;
  } else if constexpr (!std::same_as<Range, AnyValue> && !std::same_as<Range, CheckedByCode>) {
    if (!field.range.contains(member)) *found = fault(field.name, member, field.range.text);
  }
}
template <Presence kPresence>
void find_fault_of(const Field<kPresence, Interval>& field, const Mat3& member,
                   std::string* found) {
  for (const Vec3& row : member.row) {
    if (found->empty()) find_fault_of(field, row, found);
  }
}
template <class Field, class... T>
void find_fault_of(const Field&, const std::variant<T...>& member, std::string* found) {
  std::visit([found](const auto& value) { find_field_fault(value, found); }, member);
}
template <Presence kPresence, HasFields T>
void find_fault_of(const Field<kPresence, NotEmpty>& field, const std::vector<T>& members,
                   std::string* found) {
  if (members.empty()) {
    *found = std::string(field.name) + " is empty; it must have " + field.range.text;
  }
  for (std::size_t i = 0; i < members.size() && found->empty(); ++i) {
    find_field_fault(members[i], found);
    if (!found->empty()) *found = std::string(field.name) + "[" + std::to_string(i) + "]." + *found;
  }
}

template <HasFields T>
void find_field_fault(const T& object, std::string* found) {
  each_field(object, [found](const auto& field, const auto& member) {
    if (found->empty()) find_fault_of(field, member, found);
  });
}
/// The first field that is not in its range, with value and range; empty if there is none.
template <HasFields T>
std::string find_field_fault(const T& object) {
  std::string found;
  find_field_fault(object, &found);
  return found;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
