/// The columns of bodies: the values that a body has in a world, on the host and on a device.
///
/// The template argument `Column` selects the storage: an array indexed by BodyId::index, a pointer
/// to one, a buffer of a device, or the value of one body. A function each_...() calls
/// visit(column...) for each column; a missing column is a compile error. These functions also
/// accept other structs whose members have the names of the columns.
#pragma once

#include <jfpx/scene.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

template <class T>
using ArrayColumn = std::vector<T>;
template <class T>
using PointerColumn = T*;
template <class T>
using ConstPointerColumn = const T*;
template <class T>
using ValueColumn = T;

/// State that a step changes.
template <template <class> class Column>
struct MotionColumns {
  Column<Vec3> position{};           ///< [m]
  Column<Quat> orientation{};        ///< unit quaternions
  Column<Vec3> velocity{};           ///< [m/s]
  Column<Vec3> angular_velocity{};   ///< [rad/s], world axes
  Column<Vec3> force{};              ///< [N], for the next step
  Column<Vec3> torque{};             ///< [N m], for the next step
  Column<Vec3> last_acceleration{};  ///< [m/s^2], in the last step in which the body was awake
  Column<Mat3> inverse_inertia{};    ///< [1/(kg m^2)], world axes
  /// [m^2/s^2], recency-weighted mean of v^2 + w^2, compared with SleepSettings::epsilon (thesis
  /// 4.4.2)
  Column<Real> mean_motion{};
  Column<Real> rest_time{};       ///< [s], for which the body has been slow; soft_step
  Column<std::uint8_t> awake{};   ///< 1 or 0; a body of mass 0: 1 if kinematic and moving
  Column<std::uint32_t> place{};  ///< in the partition into blocks (partition.hpp), or kNoPlace
};

/// Properties, which a step reads and does not change.
template <template <class> class Column>
struct PropertyColumns {
  Column<std::uint8_t> kinematic{}, sensor{}, can_sleep{};  ///< 1 or 0
  Column<Vec3> acceleration{};                              ///< BodyDef::acceleration
  Column<Real> friction{}, restitution{}, rolling_friction{}, spinning_friction{};
  Column<CollisionFilter> filter{};    ///< the default in unused slots
  Column<MotionLocks> motion_locks{};  ///< none for mass 0
  Column<Real> radius{};               ///< [m]; 0 for a body that is not a sphere, as for compounds
  /// [m], of the bounding sphere about the centre of mass; infinite for half-spaces and planes
  Column<Real> extent{};
  Column<Real> inverse_mass{};
  Column<Real> velocity_kept{}, angular_velocity_kept{};  ///< damping^substep
};

/// Inertia in body axes. The columns are empty while all bodies are immovable or balls with the
/// inertia of a solid ball.
template <template <class> class Column>
struct InertiaColumns {
  Column<Mat3> body_inverse_inertia{};
  /// Divided by its largest diagonal entry, for the gyroscopic term; zero if that term is zero
  /// (isotropic inertia or mass 0), or if the rotation about an axis is locked.
  Column<Mat3> tensor{};
};

/// Columns of the motion that a step changes before it can fail.
template <template <class> class Column>
struct SavedColumns {
  Column<Vec3> last_acceleration{};
  Column<Real> mean_motion{}, rest_time{};
  Column<std::uint8_t> awake{};
};

using MotionArrays = MotionColumns<ArrayColumn>;

/// Columns that no step reads.
struct HostArrays {
  std::vector<Shape> shape;
  std::vector<Real> mass, linear_damping, angular_damping;  ///< as in BodyDef
  std::vector<std::uint64_t> user_data;
};

/// The columns of BodyState.
template <class Visit, class... Columns>
JFPX_HD constexpr void each_state(const Visit& visit, Columns&... columns) {
  visit(columns.position...);
  visit(columns.orientation...);
  visit(columns.velocity...);
  visit(columns.angular_velocity...);
}
/// The columns of SavedColumns.
template <class Visit, class... Columns>
JFPX_HD constexpr void each_saved(const Visit& visit, Columns&... columns) {
  visit(columns.last_acceleration...);
  visit(columns.mean_motion...);
  visit(columns.rest_time...);
  visit(columns.awake...);
}
/// The columns of MotionColumns that BodyState does not have.
template <class Visit, class... Columns>
JFPX_HD constexpr void each_other_motion(const Visit& visit, Columns&... columns) {
  visit(columns.force...);
  visit(columns.torque...);
  visit(columns.last_acceleration...);
  visit(columns.inverse_inertia...);
  visit(columns.mean_motion...);
  visit(columns.rest_time...);
  visit(columns.awake...);
  visit(columns.place...);
}
template <class Visit, class... Columns>
JFPX_HD constexpr void each_motion(const Visit& visit, Columns&... columns) {
  each_state(visit, columns...);
  each_other_motion(visit, columns...);
}
template <class Visit, class... Columns>
JFPX_HD constexpr void each_property(const Visit& visit, Columns&... columns) {
  visit(columns.kinematic...);
  visit(columns.sensor...);
  visit(columns.can_sleep...);
  visit(columns.acceleration...);
  visit(columns.friction...);
  visit(columns.restitution...);
  visit(columns.rolling_friction...);
  visit(columns.spinning_friction...);
  visit(columns.filter...);
  visit(columns.motion_locks...);
  visit(columns.radius...);
  visit(columns.extent...);
  visit(columns.inverse_mass...);
  visit(columns.velocity_kept...);
  visit(columns.angular_velocity_kept...);
}
template <class Visit, class... Columns>
JFPX_HD constexpr void each_inertia(const Visit& visit, Columns&... columns) {
  visit(columns.body_inverse_inertia...);
  visit(columns.tensor...);
}

namespace detail {

/// Whether a function visits as many columns as a struct of pointers has.
template <class Pointers, class Each>
constexpr bool visits_all(const Each& each) {
  std::size_t count = 0;
  Pointers pointers;
  each([&count](const auto&) { ++count; }, pointers);
  return sizeof(Pointers) == count * sizeof(void*);
}
static_assert(visits_all<MotionColumns<PointerColumn>>([](const auto& visit, auto& columns) {
  each_motion(visit, columns);
}));
static_assert(visits_all<PropertyColumns<PointerColumn>>([](const auto& visit, auto& columns) {
  each_property(visit, columns);
}));
static_assert(visits_all<InertiaColumns<PointerColumn>>([](const auto& visit, auto& columns) {
  each_inertia(visit, columns);
}));
static_assert(visits_all<SavedColumns<PointerColumn>>([](const auto& visit, auto& columns) {
  each_saved(visit, columns);
}));

}  // namespace detail

/// Calls visit(column, member) for each member of a BodyDef and its column, in the order of
/// snapshots.
/// @param given_inertia argument of the visitor for BodyDef::inertia
template <class Motion, class Properties, class Host, class Inertia, class Def, class Visit>
void each_given(Motion& motion, Properties& properties, Host& host, Inertia& given_inertia,
                Def& def, const Visit& visit) {
  auto& [shape, mass, kinematic, inertia, position, orientation, velocity, angular_velocity,
         acceleration, linear_damping, angular_damping, friction, restitution, rolling_friction,
         spinning_friction, can_sleep, filter, sensor, motion_locks, user_data] = def;
  visit(host.shape, shape);
  visit(host.mass, mass);
  visit(properties.kinematic, kinematic);
  visit(properties.sensor, sensor);
  visit(properties.can_sleep, can_sleep);
  visit(given_inertia, inertia);
  visit(properties.acceleration, acceleration);
  visit(host.linear_damping, linear_damping);
  visit(host.angular_damping, angular_damping);
  visit(properties.friction, friction);
  visit(properties.restitution, restitution);
  visit(properties.rolling_friction, rolling_friction);
  visit(properties.spinning_friction, spinning_friction);
  visit(properties.filter, filter);
  visit(properties.motion_locks, motion_locks);
  visit(host.user_data, user_data);
  visit(motion.position, position);
  visit(motion.orientation, orientation);
  visit(motion.velocity, velocity);
  visit(motion.angular_velocity, angular_velocity);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
