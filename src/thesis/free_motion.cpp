/// Semi-implicit Euler steps of bodies, and the recency-weighted mean of their motion.
#include "src/thesis/free_motion.hpp"

#include "src/base/power.hpp"
#include "src/world/bodies/integrate.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace thesis {
namespace {

/// Integrates the velocities of a movable body.
void accelerate(const BodyView& bodies, std::uint32_t i, MotionArrays* moving) {
  moving->last_acceleration[i] = bodies.acceleration_of_step(i);
  const Vec3 angular_acceleration = moving->inverse_inertia[i] * moving->torque[i];
  Vec3 &v = moving->velocity[i], &w = moving->angular_velocity[i];
  v = detail::integrated_velocity(v, moving->last_acceleration[i], bodies.dt,
                                  bodies.velocity_kept[i]);
  w = detail::integrated_velocity(w, angular_acceleration, bodies.dt,
                                  bodies.angular_velocity_kept[i]);
  if (bodies.has_gyroscopic_term(i)) {
    w = detail::precessed(w, bodies.tensor[i], to_matrix(moving->orientation[i]), bodies.dt);
  }
}

void move(std::uint32_t i, BodyStore* bodies) {
  MotionArrays& moving = bodies->moving;
  moving.position[i] =
      detail::integrated_position(moving.position[i], moving.velocity[i], bodies->dt());
  moving.orientation[i] = detail::integrated_orientation(moving.orientation[i],
                                                         moving.angular_velocity[i], bodies->dt());
  bodies->refresh_inertia(i);
}

/// Recency-weighted mean of v.v + w.w. `kept` is bias^dt. The upper limit bounds the time that a
/// fast body stays awake after it has stopped.
Real mean_motion(Real mean, const Vec3& velocity, const Vec3& angular_velocity, Real kept,
                 Real cap) {
  const Real now = length_squared(velocity) + length_squared(angular_velocity);
  const Real next = kept * mean + (1 - kept) * now;
  return next > cap ? cap : next;
}

}  // namespace

FreeMotion::FreeMotion(Real dt, const SleepSettings& sleep)
    : sleep_epsilon_(sleep.epsilon),
      motion_kept_(static_cast<Real>(detail::power(sleep.bias, dt))) {}

void FreeMotion::integrate(BodyStore* bodies) const {
  const BodyView view = bodies->view();
  MotionArrays& moving = bodies->moving;
  for (const BodyId id : bodies->ids()) {
    const std::uint32_t i = id.index;
    if (view.is_active(i)) {
      accelerate(view, i, &moving);
      if (view.can_sleep[i] == 0 || !falls_asleep(i, &moving)) move(i, bodies);
    } else if (view.is_carrier(i)) {
      move(i, bodies);
    }
    moving.force[i] = moving.torque[i] = {};
  }
}

/// Updates the mean motion, and puts the body to sleep if the mean is small. Must be called before
/// move(): the velocity already contains the gravity of this step, and a resting body that moved
/// before falling asleep would remain deeper in the ground.
bool FreeMotion::falls_asleep(std::uint32_t i, MotionArrays* moving) const {
  Real& mean = moving->mean_motion[i];
  mean = mean_motion(mean, moving->velocity[i], moving->angular_velocity[i], motion_kept_,
                     10 * sleep_epsilon_);
  if (!(mean < sleep_epsilon_)) return false;
  moving->awake[i] = 0;
  moving->velocity[i] = moving->angular_velocity[i] = {};
  return true;
}

void displace(BodyStore* bodies, std::uint32_t i, const Vec3& shift, const Vec3& rotation) {
  MotionArrays& moving = bodies->moving;
  moving.position[i] += shift;
  if (rotation == Vec3{}) return;
  moving.orientation[i] = rotated_by(moving.orientation[i], rotation);
  bodies->refresh_inertia(i);
}

}  // namespace thesis
}  // namespace JFPX_ABI
}  // namespace jfpx
