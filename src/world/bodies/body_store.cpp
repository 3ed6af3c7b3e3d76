/// Addition, removal and waking of bodies.
#include "src/world/bodies/body_store.hpp"

#include <jfpx/error.hpp>

#include "src/base/power.hpp"
#include "src/base/reserve.hpp"
#include "src/contact_solver/soft_step/blocks.hpp"
#include "src/scene/compound.hpp"
#include "src/scene/inertia.hpp"
#include "src/scene/inertia_tensor.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

Real kept_per_step(Real kept_per_second, Real dt) {
  return static_cast<Real>(detail::power(kept_per_second, dt));
}

/// The shape with normals and quaternions scaled to unit length; validation tolerates deviations up
/// to kUnitTolerance.
Shape normalized(Shape shape) {
  const auto scale = [](auto* wall) {
    const Real k = Real(1) / length(wall->normal);
    wall->normal *= k;
    wall->offset *= k;
  };
  if (auto* half_space = std::get_if<HalfSpace>(&shape)) scale(half_space);
  if (auto* plane = std::get_if<Plane>(&shape)) scale(plane);
  if (auto* compound = std::get_if<Compound>(&shape)) {
    for (CompoundPart& part : compound->parts) part.orientation = normalized(part.orientation);
  }
  return shape;
}

constexpr auto point_to = [](auto& pointer, auto& array) { pointer = array.data(); };

/// Puts the members of a BodyDef into the columns, except those that need memory.
struct PutValue {
  std::uint32_t body;
  void operator()(auto& column, const auto& value) const { column[body] = value; }
  void operator()(std::vector<Shape>&, const Shape&) const {}
  void operator()(GivenInertia&, const std::optional<Mat3>&) const {}
};

}  // namespace

std::atomic<std::uint32_t> BodyStore::most_in_one_block = soft_step::kMostBodiesInOneBlock;

BodyStore::BodyStore(Real dt, const SleepSettings& sleep, std::uint32_t substeps)
    : dt_(dt), substep_(dt / static_cast<Real>(substeps)), sleep_(sleep) {}

/// Calls visit(array) for the arrays that have an item per slot.
template <class Visit>
void BodyStore::for_each_array(const Visit& visit) {
  each_motion(visit, moving);
  each_property(visit, properties_);
  auto& [shape, mass, linear_damping, angular_damping, user_data] = host_;
  const auto all = [&visit](auto&... arrays) { (visit(arrays), ...); };
  all(shape, mass, linear_damping, angular_damping, user_data);
  if (has_inertia_arrays_) each_inertia(visit, inertia_);
}

void BodyStore::reserve(std::size_t bodies) {
  pool_.reserve(bodies);
  mobile_.storage()->reserve(bodies);
  for_each_array([bodies](auto& array) { array.reserve(bodies); });
}

void BodyStore::resize_slots(std::size_t slots) {
  for_each_array([slots](auto& array) { array.resize(slots); });
}

/// Adds an unused slot. If an allocation fails, capacity() is unchanged, because the pool is last.
void BodyStore::add_slot() {
  resize_slots(capacity() + 1);
  reserve_geometric(mobile_.storage(), capacity() + 1);
  pool_.add_slot();
}

/// Computes the properties that follow from the given ones, and counts the body.
void BodyStore::derive_properties(std::uint32_t i) noexcept {
  const Shape& shape = host_.shape[i];
  const auto* sphere = std::get_if<Sphere>(&shape);
  properties_.radius[i] = sphere != nullptr ? sphere->radius : Real(0);
  properties_.extent[i] =
      is_wall(shape) ? std::numeric_limits<Real>::infinity() : outer_radius(shape);
  properties_.inverse_mass[i] = host_.mass[i] > 0 ? Real(1) / host_.mass[i] : Real(0);
  set_damping(i, host_.linear_damping[i], host_.angular_damping[i]);
  if (properties_.filter[i] != CollisionFilter{}) ++filtered_count_;
  update_filters_in_use();
  count_body(i);
}

void BodyStore::count_body(std::uint32_t i) noexcept {
  if (movable(i)) ++movable_count_;
  if (kinematic(i)) ++kinematic_count_;
  if (sensor(i)) ++sensor_count_;
  if (rolls(i)) ++rolling_count_;
  if (has_locks(i)) ++locked_count_;
  note_mobile(i);
}

void BodyStore::uncount_body(std::uint32_t i) noexcept {
  if (!immovable(i)) mobile_.invalidate();
  if (movable(i)) --movable_count_;
  if (kinematic(i)) --kinematic_count_;
  if (sensor(i)) --sensor_count_;
  if (rolls(i)) --rolling_count_;
  if (has_locks(i)) --locked_count_;
}

std::span<const std::uint32_t> BodyStore::mobile() const noexcept {
  return mobile_.get([this](std::vector<std::uint32_t>* bodies) {
    bodies->clear();  // has the capacity of the slots
    for (const BodyId id : ids()) {
      if (!immovable(id.index)) bodies->push_back(id.index);
    }
  });
}

/// Keeps the list of mobile() up to date when a body is added.
void BodyStore::note_mobile(std::uint32_t i) noexcept {
  if (immovable(i)) return;
  std::vector<std::uint32_t>* bodies = mobile_.current();
  const bool is_last = bodies != nullptr && (bodies->empty() || bodies->back() < i);
  is_last ? bodies->push_back(i) : mobile_.invalidate();
}

BodyStore::Replacement BodyStore::prepare(std::uint32_t i, const BodyDef& def) {
  Replacement prepared{normalized(def.shape), {}};
  if (def.inertia && def.mass > 0) prepared.inertia[i] = {};
  if (needs_inertia_arrays(def.shape, def.mass, def.kinematic, def.inertia.has_value(),
                           def.motion_locks)) {
    make_inertia_arrays();
  }
  return prepared;
}

BodyId BodyStore::add(const BodyDef& def) {
  Replacement prepared = prepare(next_index(), def);  // may throw, hence before any change
  if (pool_.is_full()) add_slot();
  const BodyId id = pool_.add();  // from here on nothing allocates
  moving.place[id.index] = soft_step::kNoPlace;
  put(id.index, def, std::move(prepared));
  return id;
}

void BodyStore::replace(std::uint32_t i, const BodyDef& def, Replacement prepared) noexcept {
  const bool was_movable = movable(i);
  if (!was_movable) ++fixed_version_;
  uncount_body(i);
  set_filter(i, {});
  given_inertia_.erase(i);
  put(i, def, std::move(prepared));
  if (movable(i) != was_movable) moving.place[i] = soft_step::kNoPlace;
}

/// Sets all columns of a body but its place in the partition. Does not allocate.
void BodyStore::put(std::uint32_t i, const BodyDef& def, Replacement prepared) noexcept {
  given_inertia_.merge(prepared.inertia);
  each_given(moving, properties_, host_, given_inertia_, def, PutValue{i});
  host_.shape[i] = std::move(prepared.shape);
  if (!sleep_.enabled) properties_.can_sleep[i] = 0;
  if (!(def.mass > 0) && !def.kinematic) properties_.motion_locks[i] = {};
  derive_properties(i);
  compute_inertia(i, def.inertia);
  moving.force[i] = moving.torque[i] = moving.last_acceleration[i] = {};
  moving.mean_motion[i] = moving.rest_time[i] = 0;
  moving.awake[i] = 0;
  if (!movable(i)) ++fixed_version_;
  set_state(i, {def.position, def.orientation, def.velocity, def.angular_velocity});
}

void BodyStore::set_mass(std::uint32_t i, Real mass) {
  host_.mass[i] = mass;
  properties_.inverse_mass[i] = Real(1) / mass;
  if (!inertia_given(i)) set_inertia(i, std::nullopt);
}

Mat3 BodyStore::inertia(std::uint32_t i) const {
  if (!movable(i)) return diagonal({0, 0, 0});
  return inertia_given(i) ? given_inertia_.at(i) : solid_inertia(host_.shape[i], host_.mass[i]);
}

bool BodyStore::needs_inertia_arrays(const Shape& shape, Real mass, bool kinematic,
                                     bool inertia_given, const MotionLocks& locks) {
  const bool is_solid_ball = std::holds_alternative<Sphere>(shape) && !inertia_given;
  const bool turns_alike = !detail::any_angular(locks) || detail::all_angular(locks);
  return kinematic || (mass > 0 && !(is_solid_ball && turns_alike));
}

void BodyStore::make_inertia_arrays() {
  if (has_inertia_arrays_) return;
  inertia_.body_inverse_inertia.reserve(host_.shape.capacity());
  inertia_.body_inverse_inertia.resize(host_.shape.size());
  inertia_.tensor.reserve(host_.shape.capacity());
  inertia_.tensor.assign(host_.shape.size(), diagonal({0, 0, 0}));
  for (const BodyId id : ids())
    inertia_.body_inverse_inertia[id.index] = body_inverse_inertia(id.index);
  has_inertia_arrays_ = true;
}

Mat3 BodyStore::body_inverse_inertia(std::uint32_t i) const {
  if (has_inertia_arrays_) return inertia_.body_inverse_inertia[i];
  return movable(i) ? inverse_inertia(inertia(i)) : diagonal({0, 0, 0});
}

void BodyStore::set_inertia(std::uint32_t i, const std::optional<Mat3>& given) {
  if (given && movable(i)) make_inertia_arrays();
  compute_inertia(i, given);
  refresh_inertia(i);
}

void BodyStore::compute_inertia(std::uint32_t i, const std::optional<Mat3>& given) {
  if (given && movable(i)) {
    given_inertia_[i] = symmetric_part(*given);
  } else {
    given_inertia_.erase(i);
  }
  if (!has_inertia_arrays_) return;
  if (movable(i)) {
    set_tensor(i, inertia(i));
  } else {  // infinite inertia: the inverse is zero (erratum E26)
    inertia_.body_inverse_inertia[i] = inertia_.tensor[i] = diagonal({0, 0, 0});
  }
}

/// @param tensor inertia of a movable body in body axes, symmetric
void BodyStore::set_tensor(std::uint32_t i, const Mat3& tensor) {
  inertia_.body_inverse_inertia[i] = inverse_inertia(tensor);
  // The largest entry of a positive definite matrix is on its diagonal.
  const Vec3 moments{tensor(0, 0), tensor(1, 1), tensor(2, 2)};
  const bool isotropic = moments.x == moments.y && moments.y == moments.z && is_diagonal(tensor);
  inertia_.tensor[i] = isotropic || detail::any_angular(motion_locks(i))
                           ? diagonal({0, 0, 0})
                           : tensor * (Real(1) / std::max({moments.x, moments.y, moments.z}));
}

void BodyStore::set_motion_locks(std::uint32_t i, const MotionLocks& locks) {
  if (immovable(i)) return;
  const bool moves_freely = movable(i);
  if (moves_freely &&
      needs_inertia_arrays(host_.shape[i], host_.mass[i], false, inertia_given(i), locks)) {
    make_inertia_arrays();
  }
  if (has_locks(i)) --locked_count_;
  properties_.motion_locks[i] = locks;
  if (has_locks(i)) ++locked_count_;
  if (moves_freely && has_inertia_arrays_) set_tensor(i, inertia(i));
}

void BodyStore::set_damping(std::uint32_t i, Real linear, Real angular) {
  host_.linear_damping[i] = linear;
  host_.angular_damping[i] = angular;
  properties_.velocity_kept[i] = kept_per_step(linear, substep_);
  properties_.angular_velocity_kept[i] = kept_per_step(angular, substep_);
}

void BodyStore::remove(BodyId id) noexcept {
  if (!movable(id.index)) ++fixed_version_;
  pool_.remove(id);
  uncount_body(id.index);
  moving.awake[id.index] = 0;
  given_inertia_.erase(id.index);
  ignored_.erase_body(id.index);
  joined_.erase_body(id.index);
  set_filter(id.index, {});
}

std::uint32_t BodyStore::require(BodyId id) const {
  if (contains(id)) return id.index;
  throw InvalidArgument("body id (index " + std::to_string(id.index) + ", generation " +
                        std::to_string(id.generation) +
                        ") is unknown; it must be of a living body of this world");
}

BodyState BodyStore::state(std::uint32_t i) const {
  return {moving.position[i], moving.orientation[i], moving.velocity[i],
          moving.angular_velocity[i]};
}

void BodyStore::set_state(std::uint32_t i, const BodyState& state) {
  if (immovable(i)) ++fixed_version_;
  moving.position[i] = state.position;
  moving.orientation[i] = normalized(state.orientation);
  const bool moves = movable(i) || kinematic(i);
  put_velocities(i, moves ? state : BodyState{});
  refresh_inertia(i);
  wake(i);
  if (!kinematic(i)) return;
  moving.awake[i] = moving.velocity[i] == Vec3{} && moving.angular_velocity[i] == Vec3{} ? 0 : 1;
  moving.mean_motion[i] = 2 * sleep_.epsilon;  // wake_by_contact() copies it to bodies in contact
}

void BodyStore::set_velocities(std::uint32_t i, const BodyState& state) {
  put_velocities(i, state);
  wake(i);
}

/// Replaces the velocities, of a movable body except along and about locked axes.
void BodyStore::put_velocities(std::uint32_t i, const BodyState& state) {
  const MotionLocks locks = movable(i) ? motion_locks(i) : MotionLocks{};
  moving.velocity[i] = detail::free_linear(locks, state.velocity);
  moving.angular_velocity[i] = detail::free_angular(locks, state.angular_velocity);
}

void BodyStore::set_filter(std::uint32_t i, const CollisionFilter& filter) noexcept {
  if (properties_.filter[i] != CollisionFilter{}) --filtered_count_;
  properties_.filter[i] = filter;
  if (properties_.filter[i] != CollisionFilter{}) ++filtered_count_;
  update_filters_in_use();
}

void BodyStore::set_pair_ignored(const BodyPair& pair, bool ignored) {
  ignored ? ignored_.insert(pair) : ignored_.erase(pair);
  update_filters_in_use();
}

void BodyStore::set_pair_joined(const BodyPair& pair, bool joined) {
  joined ? joined_.insert(pair) : joined_.erase(pair);
  update_filters_in_use();
}

void BodyStore::set_ignored_pairs(std::span<const BodyPair> pairs) {
  ignored_.assign(pairs);
  update_filters_in_use();
}

void BodyStore::update_filters_in_use() noexcept {
  filters_in_use_ = filtered_count_ > 0 || !ignored_.empty() || !joined_.empty();
}

void BodyStore::apply_force(std::uint32_t i, const Vec3& force) {
  if (!movable(i)) return;
  moving.force[i] += force;
  wake(i);
}

void BodyStore::apply_torque(std::uint32_t i, const Vec3& torque) {
  if (!movable(i)) return;
  moving.torque[i] += torque;
  wake(i);
}

void BodyStore::wake(std::uint32_t i) {
  if (!movable(i)) return;
  moving.awake[i] = 1;
  moving.mean_motion[i] = 2 * sleep_.epsilon;
  moving.rest_time[i] = 0;
}

void BodyStore::wake_by_contact(std::uint32_t sleeper, std::uint32_t awake) {
  // The sleeper gets a copy of the mean motion. With a lower limit instead, two touching bodies
  // would wake each other alternately and never sleep.
  moving.awake[sleeper] = 1;
  moving.mean_motion[sleeper] = moving.mean_motion[awake];
  moving.rest_time[sleeper] = 0;
}

bool BodyStore::has_moving_kinematic_body() const {
  return kinematic_count_ > 0 && std::ranges::any_of(ids(), [this](BodyId id) {
           return kinematic(id.index) && moving.awake[id.index] != 0;
         });
}

BodyView BodyStore::view() const {
  BodyView view = view_without_ids();
  view.ids = ids().data();
  return view;
}

BodyView BodyStore::view_without_ids() const {
  BodyView view;
  each_motion(point_to, view, moving);
  each_property(point_to, view, properties_);
  if (has_inertia_arrays_) each_inertia(point_to, view, inertia_);
  view.ignored = ignored_.keys().data();
  view.ignored_count = static_cast<std::uint32_t>(ignored_.keys().size());
  view.joined = joined_.keys().data();
  view.joined_count = static_cast<std::uint32_t>(joined_.keys().size());
  view.filters_in_use = filters_in_use_;
  view.any_locks = locked_count_ > 0;
  view.count = static_cast<std::uint32_t>(size());
  view.capacity = static_cast<std::uint32_t>(capacity());
  view.movable_count = movable_count_;
  view.has_blocks = has_blocks();
  view.dt = dt_;
  view.substep = substep_;
  view.sleep_speed = sleep_.speed;
  view.sleep_time = sleep_.time;
  view.woken_motion = 2 * sleep_.epsilon;
  return view;
}

MotionPointers BodyStore::motion_pointers() {
  MotionPointers pointers;
  each_motion(point_to, pointers, moving);
  return pointers;
}

void BodyStore::refresh_inertia(std::uint32_t i) {
  const Mat3 inverse = body_inverse_inertia(i), axes = to_matrix(moving.orientation[i]);
  moving.inverse_inertia[i] = detail::any_angular(motion_locks(i))
                                  ? detail::locked_inverse_inertia(motion_locks(i), inverse, axes)
                                  : detail::in_world_axes(inverse, axes);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
