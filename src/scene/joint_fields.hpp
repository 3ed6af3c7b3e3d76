/// Fields of joints; see field.hpp.
#pragma once

#include <jfpx/joint.hpp>

#include "src/scene/field.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Names of the types of joints in JSON.
template <class T>
inline constexpr const char* kJointName = nullptr;
template <>
inline constexpr const char* kJointName<DistanceJoint> = "distance";

void each_field(Is<DistanceJoint> auto& joint, const auto& visit) {
  constexpr Interval kLength{0, kMaxCoordinate, "in [0, 1e9]"};
  auto& [a, b, anchor_a, anchor_b, min_length, max_length, rest_length, hertz, damping_ratio,
         collide_connected, user_data] = joint;
  visit(required_field("a"), a);
  visit(newer_field("b"), b);
  visit(field("anchor_a", kInWorld), anchor_a);
  visit(field("anchor_b", kInWorld), anchor_b);
  visit(field("min_length", kLength), min_length);
  visit(field("max_length", kLength), max_length);
  visit(field("rest_length", kLength), rest_length);
  visit(field("hertz", Interval{0, Real(1e6), "in [0, 1e6]"}), hertz);
  visit(field("damping_ratio", Interval{0, 1000, "in [0, 1000]"}), damping_ratio);
  visit(field("collide_connected"), collide_connected);
  visit(newer_field("user_data"), user_data);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
