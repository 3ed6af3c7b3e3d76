/// The forces of force.hpp in a soft step on a device.
#pragma once

#include "src/world/device/start_step.hpp"
#include "src/world/forces/force_on_body.hpp"
#include "src/world/forces/force_view.hpp"

#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// A body that accumulates forces in order.
class ForcedBody {
 public:
  JFPX_HD ForcedBody(const StepData& data, const ForceView& forces, std::uint32_t body)
      : data_(data),
        forces_(forces),
        body_(body),
        force_(data.step.motion.force[body]),
        torque_(data.step.motion.torque[body]) {}

  JFPX_HD BodyState state() const { return state_of(body_); }
  JFPX_HD Real mass() const { return forces_.mass[body_]; }
  JFPX_HD void apply(const Vec3& force) { force_ += force; }
  JFPX_HD void apply_at(const Vec3& force, const Vec3& point) {
    force_ += force;
    torque_ += cross(point - data_.step.bodies.position[body_], force);
  }
  JFPX_HD void wake() const {
    if (!data_.step.bodies.movable(body_)) return;
    is_awake() ? data_.step.motion.wake(data_.step.bodies, body_) : leave_to_host();
  }
  template <class Visit>
  JFPX_HD void for_each_part(const Visit& visit) const {
    for (std::uint32_t i = forces_.first_part[body_]; i < forces_.first_part[body_ + 1]; ++i) {
      visit(forces_.parts[i]);
    }
  }

  JFPX_HD bool is_awake() const { return data_.step.bodies.awake[body_] != 0; }
  JFPX_HD const Vec3& force() const { return force_; }
  JFPX_HD const Vec3& torque() const { return torque_; }

  /// Applies a spring to the end at this body.
  template <class S>
  JFPX_HD void act_on_end(const S& spring, const ForceItem& item) {
    const BodyView& bodies = data_.step.bodies;
    const bool is_b = item.is_end_b != 0, joins_bodies = item.other != ForceItem::kNoBody;
    if (joins_bodies && bodies.awake[item.other] == 0 && bodies.movable(item.other)) {
      leave_to_host();
    }
    const Vec3 &own_point = is_b ? spring.b.point : spring.a.point,
               &other_point = is_b ? spring.a.point : spring.b.point;
    const detail::MovingPoint own = detail::moving_point(state(), own_point);
    detail::MovingPoint other{other_point, {}};
    if (joins_bodies) other = detail::moving_point(state_of(item.other), other_point);
    const Vec3 force = detail::force_on_end_a(spring, is_b ? other : own, is_b ? own : other);
    apply_at(is_b ? -force : force, own.position);
  }

 private:
  JFPX_HD BodyState state_of(std::uint32_t body) const {
    const BodyView& bodies = data_.step.bodies;
    return {bodies.position[body], bodies.orientation[body], bodies.velocity[body],
            bodies.angular_velocity[body]};
  }
  /// Defers the step to the host, because a force must wake a body.
  JFPX_HD void leave_to_host() const { data_.counters->failed = data_.counters->must_wake = 1; }

  const StepData& data_;
  const ForceView& forces_;
  std::uint32_t body_;
  Vec3 force_, torque_;
};

/// Starts the step, and adds all forces to the accumulated forces of the bodies. Bodies are
/// independent, because steps in which a force would wake a body are deferred to the host.
struct ForceProgram {
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kForce;
  StepData data;
  ForceView forces;
  Vec3 *force_sum = nullptr, *torque_sum = nullptr;  ///< by body

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (data.is_skipped()) return;
    start_counters(team, data);
    team.for_each(data.step.bodies.capacity, [&](std::uint32_t i) { save(data, i); });
    const Progress& progress = data.counters->progress;
    const double time = static_cast<double>(progress.offset + progress.completed) *
                        static_cast<double>(data.step.bodies.dt);  // as World::time()
    team.for_each_nowait(data.step.bodies.capacity, [&](std::uint32_t i) { add_forces(i, time); });
  }

 private:
  /// @param time [s], start of the step
  JFPX_HD void add_forces(std::uint32_t i, double time) const {
    ForcedBody body(data, forces, i);
    const bool is_awake = body.is_awake();
    if (is_awake || forces.array<Explosion>().count > 0) {
      forces.for_each_on(i, [&](const ForceItem& item) {
        forces.visit(item, [&](const auto& force) {
          using F = std::remove_cvref_t<decltype(force)>;
          if constexpr (std::is_same_v<F, Explosion>) {
            detail::act_on(force, time, &body);
          } else if (is_awake) {
            if constexpr (std::is_same_v<F, Spring> || std::is_same_v<F, Bungee>) {
              body.act_on_end(force, item);
            } else {
              detail::act_on(force, &body);
            }
          }
        });
      });
    }
    force_sum[i] = body.force();
    torque_sum[i] = body.torque();
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
