/// The soft step of a world (Catto, Solver2D, 2023; Macklin et al., Small Steps in Physics
/// Simulation, 2019).
///
/// Substeps after the first need no warm start by contacts: as normals and anchors are constant
/// within a step, the impulses of a substep changed a body's velocity by what it has gained since
/// the accelerations of that substep, and applying them again changes it by the same amount.
#include "src/world/soft_step.hpp"

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"
#include "src/world/integrate.hpp"

#include <algorithm>
#include <atomic>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::ContactKey;
using soft_step::ContactSet;
using soft_step::SolverBody;

constexpr std::size_t kBodiesPerChunk = 512, kContactsPerChunk = 2048;

}  // namespace

SoftStep::SoftStep(const SoftStepSettings& settings, const MaterialSettings& materials, Real dt,
                   ThreadPool* pool)
    : constants_(soft_step::make_step_constants(settings, dt)),
      settings_(settings),
      materials_(materials),
      pool_(pool) {}

/// Generated contacts of the same bodies are identified by their sequence.
void SoftStep::add_generated(const BodyStore& bodies, std::span<const Contact> generated) {
  if (generated.empty()) return;
  ContactSet& set = cache_.current();
  const auto by_key = [](const auto& x, const auto& y) { return x.key < y.key; };
  for (std::uint32_t i = 0; i < generated.size(); ++i) {
    const Contact& c = generated[i];
    const auto point = static_cast<std::uint32_t>(set.points.size());
    set.points.push_back({c.point - bodies.moving.position[c.a.index],
                          c.point - bodies.moving.position[c.b.index], c.distance, 0});
    const ContactKey key{c.a.index, c.b.index, ContactKey::kGenerated, i};
    set.manifolds.push_back({key, c.normal, point, 1, c.friction, c.restitution});
  }
  std::ranges::sort(set.manifolds, by_key);
  // Numbered for each pair of bodies, so that a contact that comes or goes renames no other pair's.
  const ContactKey* before = nullptr;
  for (soft_step::ManifoldInput& manifold : set.manifolds) {
    ContactKey& key = manifold.key;
    if (!key.is_generated()) continue;
    const bool same_pair = before != nullptr && before->a == key.a && before->b == key.b;
    key.part_b = same_pair ? before->part_b + 1 : 0;
    before = &key;
  }
}

/// Sizes all buffers, so that commit() does not allocate.
void SoftStep::prepare(const BodyStore& bodies) {
  const std::size_t capacity = bodies.capacity();
  bodies_.resize(capacity);
  orientation_.resize(capacity);
  free_velocity_.resize(capacity);
  free_angular_velocity_.resize(capacity);
  marked_.resize(capacity);
  islands_.reserve(capacity);
}

/// Whether condition(distance of a point, its normal impulse) holds for a point of a contact.
template <class Condition>
bool SoftStep::any_point(std::uint32_t contact, const Condition& condition) const {
  const ContactSet& set = cache_.current();
  const std::uint32_t first = set.first_impulse(contact);
  for (std::uint32_t i = 0; i < set.impulse_count(contact); ++i) {
    if (condition(set.distance(contact, i), set.impulses[first + i].normal)) return true;
  }
  return false;
}

/// Whether the bodies of a contact touch, or meet during the step at their velocities.
bool SoftStep::will_touch(const BodyStore& bodies, std::uint32_t contact) const {
  const ContactKey& key = cache_.current().key(contact);
  const Vec3 motion = bodies.predicted_motion(key.a) - bodies.predicted_motion(key.b);
  const Real opening = dot(motion, cache_.current().normal(contact));
  return any_point(contact, [opening](Real distance, Real impulse) {
    return distance <= 0 || distance + opening <= 0 || impulse > 0;
  });
}

/// Unites the movable bodies of the contacts for which touches(contact) holds, and marks the
/// islands that touch a kinematic body in motion: a sleeping body has no velocity and could not be
/// carried by it.
template <class Touches>
void SoftStep::find_islands(const BodyStore& bodies, const Touches& touches) {
  islands_.reset(bodies.capacity());
  std::ranges::fill(marked_, std::uint8_t{0});
  const ContactSet& set = cache_.current();
  parallel_for(pool_, set.size(), kContactsPerChunk, [&](std::size_t first, std::size_t last) {
    for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
      const ContactKey& key = set.key(i);
      if (bodies.movable(key.a) && bodies.movable(key.b) && touches(i)) {
        islands_.unite(key.a, key.b);
      }
    }
  });
  const auto carries = [&](std::uint32_t body) {
    return !bodies.movable(body) && bodies.moving.awake[body] != 0;
  };
  for (std::uint32_t i = 0; i < set.size(); ++i) {
    const ContactKey& key = set.key(i);
    if ((carries(key.a) || carries(key.b)) && touches(i)) {
      marked_[islands_.find(carries(key.a) ? key.b : key.a)] = 1;
    }
  }
}

/// Wakes the islands that touch an awake body or a kinematic body in motion.
void SoftStep::wake_touched(BodyStore* bodies) {
  const auto rests = [&](BodyId id) {
    return bodies->movable(id.index) && bodies->moving.awake[id.index] == 0;
  };
  if (std::ranges::none_of(bodies->ids(), rests)) return;
  find_islands(*bodies, [&](std::uint32_t contact) { return will_touch(*bodies, contact); });
  for (const BodyId id : bodies->ids()) {
    if (bodies->movable(id.index) && !rests(id)) marked_[islands_.find(id.index)] = 1;
  }
  for (const BodyId id : bodies->ids()) {
    if (rests(id) && marked_[islands_.find(id.index)] != 0) bodies->wake(id.index);
  }
}

/// Marks the bodies that have a contact in this step.
void SoftStep::find_near() {
  assign_geometric(&near_, bodies_.size(), 0);
  const ContactSet& set = cache_.current();
  parallel_for(pool_, set.size(), kContactsPerChunk, [&](std::size_t first, std::size_t last) {
    for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
      for (const std::uint32_t body : {set.key(i).a, set.key(i).b}) {
        std::atomic_ref(near_[body]).store(1, std::memory_order_relaxed);
      }
    }
  });
}

void SoftStep::load_bodies(BodyStore* bodies) {
  const std::span<const BodyId> ids = bodies->ids();
  parallel_for(pool_, ids.size(), kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
    for (const BodyId id : ids.subspan(first, last - first)) {
      const std::uint32_t i = id.index;
      const MotionArrays& moving = bodies->moving;
      if (bodies->movable(i) && moving.awake[i] != 0) bodies->update_acceleration(i);
      SolverBody& body = bodies_[i];
      body = {};
      body.velocity = moving.velocity[i];
      body.angular_velocity = moving.angular_velocity[i];
      body.inverse_mass = bodies->inverse_mass(i);
      if (bodies->is_round(i)) body.inverse_inertia = moving.inverse_inertia[i](0, 0);
      orientation_[i] = moving.orientation[i];
    }
  });
}

/// Starts a substep: applies accelerations, and, unless it is the first of the step, the contact
/// impulses of the last substep again. A body without contacts moves by the mean of its velocities
/// before and after, so that its path is an exact parabola; with contacts, the mean would contain a
/// part of the acceleration that impulses have cancelled. Forces may depend on the position, and
/// are constant in a step: they move the body as in the semi-implicit Euler method for the whole
/// step, because a spring would gain energy otherwise.
void SoftStep::accelerate(const BodyStore& bodies, bool is_first) {
  const Real half_step = constants_.h * bodies.dt() * Real(0.5);
  const std::span<const BodyId> ids = bodies.ids();
  parallel_for(pool_, ids.size(), kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
    for (const BodyId id : ids.subspan(first, last - first)) {
      const std::uint32_t i = id.index;
      if (!bodies.movable(i) || bodies.moving.awake[i] == 0) continue;
      SolverBody& body = bodies_[i];
      Vec3 velocity = body.velocity, angular_velocity = body.angular_velocity;
      bodies.accelerate(i, orientation_[i], &velocity, &angular_velocity);
      if (near_[i] == 0) {
        body.shift = add_scaled(body.shift, body.velocity - velocity, constants_.h * Real(0.5));
        if (!(bodies.moving.force[i] == Vec3{})) {
          body.shift = add_scaled(body.shift, bodies.moving.last_acceleration[i], half_step);
        }
      }
      const Vec3 gained = is_first ? Vec3{} : body.velocity - free_velocity_[i];
      const Vec3 spun = is_first ? Vec3{} : body.angular_velocity - free_angular_velocity_[i];
      free_velocity_[i] = velocity;
      free_angular_velocity_[i] = angular_velocity;
      body.velocity = velocity + gained;
      body.angular_velocity = angular_velocity + spun;
    }
  });
}

/// Ends a substep: integrates the velocities of all bodies that move.
void SoftStep::move(const BodyStore& bodies) {
  const std::span<const BodyId> ids = bodies.ids();
  parallel_for(pool_, ids.size(), kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
    for (const BodyId id : ids.subspan(first, last - first)) {
      const std::uint32_t i = id.index;
      if (bodies.moving.awake[i] == 0) continue;
      SolverBody& body = bodies_[i];
      body.shift = add_scaled(body.shift, body.velocity, constants_.h);
      body.rotation = add_scaled(body.rotation, body.angular_velocity, constants_.h);
      // After an overflow it is zero, and remains so until the step is undone.
      Quat& orientation = orientation_[i];
      if (orientation == Quat{0, 0, 0, 0}) continue;
      orientation =
          detail::integrated_orientation(orientation, body.angular_velocity, constants_.h);
    }
  });
}

/// State of an awake body at the end of the step.
BodyState SoftStep::state(const BodyStore& bodies, std::uint32_t i) const {
  return {bodies.moving.position[i] + bodies_[i].shift, orientation_[i], bodies_[i].velocity,
          bodies_[i].angular_velocity};
}

std::optional<BodyId> SoftStep::find_runaway(const BodyStore& bodies) {
  const std::span<const BodyId> ids = bodies.ids();
  std::atomic<std::size_t> found{ids.size()};
  parallel_for(pool_, ids.size(), kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const std::uint32_t body = ids[i].index;
      if (bodies.moving.awake[body] == 0 || is_in_world(state(bodies, body))) continue;
      std::size_t lowest = found.load();
      while (i < lowest && !found.compare_exchange_weak(lowest, i)) {
      }
      return;
    }
  });
  return found < ids.size() ? std::optional(ids[found]) : std::nullopt;
}

/// @returns whether a body has been slow for long enough to sleep
bool SoftStep::store_bodies(BodyStore* bodies) {
  const std::span<const BodyId> ids = bodies->ids();
  std::atomic<bool> any_rests{false};
  parallel_for(pool_, ids.size(), kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
    for (const BodyId id : ids.subspan(first, last - first)) {
      const std::uint32_t i = id.index;
      MotionArrays& moving = bodies->moving;
      if (moving.awake[i] != 0) {
        bodies->end_step(i, state(*bodies, i));
        const bool is_driven = !(moving.force[i] == Vec3{} && moving.torque[i] == Vec3{});
        if (bodies->movable(i)) {
          bodies->update_rest_time(i, is_driven);
          if (bodies->is_at_rest(i)) any_rests.store(true, std::memory_order_relaxed);
        }
      }
      moving.force[i] = moving.torque[i] = {};
    }
  });
  return any_rests;
}

/// Islands whose bodies have all been slow for long enough fall asleep.
void SoftStep::put_islands_to_sleep(BodyStore* bodies) {
  const auto is_awake = [&](BodyId id) {
    return bodies->movable(id.index) && bodies->moving.awake[id.index] != 0;
  };
  find_islands(*bodies, [this](std::uint32_t contact) {
    return any_point(contact,
                     [](Real distance, Real impulse) { return distance <= 0 || impulse > 0; });
  });
  for (const BodyId id : bodies->ids()) {
    if (is_awake(id) && !bodies->is_at_rest(id.index)) marked_[islands_.find(id.index)] = 1;
  }
  for (const BodyId id : bodies->ids()) {
    if (is_awake(id) && marked_[islands_.find(id.index)] == 0) bodies->put_to_sleep(id.index);
  }
}

std::optional<BodyId> SoftStep::solve(BodyStore* bodies) {
  prepare(*bodies);
  cache_.match(bodies->inverse_masses(), pool_);
  wake_touched(bodies);
  find_near();
  load_bodies(bodies);
  const soft_step::BodyProperties properties{
      .inverse_inertia = bodies->moving.inverse_inertia,
      .acceleration = bodies->moving.last_acceleration,
      .radius = bodies->radii(),
      .awake = bodies->moving.awake,
      .friction = bodies->frictions(),
      .restitution = bodies->restitutions(),
      .rolling_friction = bodies->rolling_frictions(),
      .spinning_friction = bodies->spinning_frictions(),
      .rules = materials_,
      .restitution_threshold = settings_.restitution_threshold};
  solver_.build(cache_.current(), properties, constants_, bodies_);
  for (std::uint32_t substep = 0; substep < settings_.substeps; ++substep) {
    accelerate(*bodies, substep == 0);
    if (substep == 0) solver_.warm_start(bodies_);
    solver_.solve(bodies_, true);
    move(*bodies);
    solver_.solve(bodies_, false);
  }
  solver_.restitute(bodies_);
  solver_.store(&cache_.current());
  return find_runaway(*bodies);
}

void SoftStep::commit(BodyStore* bodies) noexcept {
  if (store_bodies(bodies)) put_islands_to_sleep(bodies);
  cache_.commit();
}

}  // namespace JFPX_ABI
}  // namespace jfpx
