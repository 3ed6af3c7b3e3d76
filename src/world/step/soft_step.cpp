/// The soft step of a world (Catto, Solver2D, 2023; Macklin et al., Small Steps in Physics
/// Simulation, 2019).
///
/// Box2D applies the accumulated impulse of every contact at the start of each substep. Here this
/// is done per body. FreeMotion stores the velocities of the body after its accelerations. The
/// difference to its current velocity is the sum of the contact impulses of the substep;
/// accelerate() applies it again. The results agree, because normals and anchors are constant
/// within a step.
#include "src/world/step/soft_step.hpp"

#include "src/base/parallel_for.hpp"
#include "src/base/pool_team.hpp"
#include "src/base/reserve.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <functional>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::ContactKey;
using soft_step::ContactSet;
using soft_step::ContactView;

constexpr std::size_t kContactsPerChunk = 1024;
constexpr std::size_t kBodiesPerKernel = 64;
constexpr std::size_t body_chunk(std::size_t bodies) { return chunk_size(bodies, 32, 128); }

}  // namespace

SoftStep::SoftStep(const SoftStepSettings& settings, const MaterialSettings& materials, Real dt,
                   ThreadPool* pool, SimdLevel simd, WorldRanks* ranks)
    : constants_(soft_step::make_step_constants(settings, dt)),
      settings_(settings),
      materials_(materials),
      pool_(pool),
      ranks_(ranks),
      solver_(pool, simd) {}

void SoftStep::restore(const SoftStepSettings& settings, const MaterialSettings& materials, Real dt,
                       ContactSet last) noexcept {
  constants_ = soft_step::make_step_constants(settings, dt);
  settings_ = settings;
  materials_ = materials;
  cache_.restore(std::move(last));
}

/// Generated contacts of the same bodies are identified by their sequence number.
void SoftStep::add_generated(const BodyStore& bodies, std::span<const Contact> generated) {
  if (generated.empty()) return;
  ContactSet& set = cache_.current();
  const auto by_key = [](const auto& x, const auto& y) { return x.key < y.key; };
  for (std::uint32_t i = 0; i < generated.size(); ++i) {
    const Contact& c = generated[i];
    const auto point = static_cast<std::uint32_t>(set.points.size());
    set.points.push_back({c.point - bodies.moving.position[c.a.index],
                          c.point - bodies.moving.position[c.b.index], c.distance, 0, 0});
    const ContactKey key{c.a.index, c.b.index, ContactKey::kGenerated, i};
    set.manifolds.push_back({key, c.normal, point, 1, {c.friction, c.restitution}, {}});
  }
  std::ranges::sort(set.manifolds, by_key);
  // Numbered per pair of bodies, so that a new or missing contact does not renumber other pairs.
  const ContactKey* before = nullptr;
  for (soft_step::ManifoldInput& manifold : set.manifolds) {
    ContactKey& key = manifold.key;
    if (!key.is_generated()) continue;
    const bool same_pair = before != nullptr && before->a == key.a && before->b == key.b;
    key.part_b = same_pair ? before->part_b + 1 : 0;
    before = &key;
  }
}

void SoftStep::ignore(std::span<const BodyPair> pairs) {
  if (!pairs.empty() || !ignored_.empty()) ignored_.assign(pairs);
}

/// Sizes all buffers, so that commit() does not allocate.
void SoftStep::prepare(const BodyStore& bodies) {
  const std::size_t capacity = bodies.capacity();
  bodies_.resize(capacity);
  traits_.resize(capacity);
  orientation_.resize(capacity);
  if (joints_.count > 0) moved_rotation_.resize(capacity);
  free_.resize(capacity);
  if (bodies.view().tensor != nullptr && solver_.body_kernels() != nullptr) {
    gyroscopic_.resize(capacity);
  }
  marked_.resize(capacity);
  parent_.resize(capacity);
  partition_.reserve(bodies);
}

/// The bodies whose motion this rank computes: all that are not immovable, in a world of one rank.
std::span<const std::uint32_t> SoftStep::moved(const BodyStore& bodies) const {
  return ranks_ == nullptr ? bodies.mobile() : ranks_->domain().mine();
}

/// The same and the ghosts.
std::span<const std::uint32_t> SoftStep::present(const BodyStore& bodies) const {
  return ranks_ == nullptr ? bodies.mobile() : ranks_->domain().present();
}

bool SoftStep::any_rank(bool condition) {
  return ranks_ == nullptr ? condition : ranks_->domain().any(condition);
}

soft_step::Islands SoftStep::islands_of(const BodyStore& bodies,
                                        std::span<const std::uint32_t> mobile) {
  return {.step = step_,
          .contacts = cache_.current().view(),
          .joints = joints_,
          .sets = {parent_.data()},
          .marked = marked_.data(),
          .any_carriers = bodies.has_kinematic_bodies(),
          .mobile = mobile.data(),
          .mobile_count = static_cast<std::uint32_t>(mobile.size())};
}

/// Marks the bodies with a contact or joint in this step.
void SoftStep::mark_constrained() {
  assign_geometric(&constrained_, bodies_.size(), 0);
  const ContactView contacts = cache_.current().view();
  const std::size_t chunk = chunk_size(contacts.size(), 128, kContactsPerChunk);
  parallel_for(pool_, contacts.size(), chunk, [&](std::size_t first, std::size_t last) {
    for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
      for (const std::uint32_t body : {contacts.key(i).a, contacts.key(i).b}) {
        std::atomic_ref(constrained_[body])
            .store(soft_step::kHasContact, std::memory_order_relaxed);
      }
    }
  });
  for (std::uint32_t joint = 0; joint < joints_.count; ++joint) {
    if (!joints_.is_used(joint)) continue;
    const soft_step::JointInput& input = joints_.inputs[joint];
    const std::uint8_t value = input.drives != 0 ? soft_step::kHasDrive : soft_step::kHasJoint;
    for (const std::uint32_t body : {input.a, input.b}) {
      if (body != soft_step::kWorld) constrained_[body] = std::max(constrained_[body], value);
    }
  }
}

/// Combines the marks of islands that have bodies of several ranks: each rank passes on the marks
/// of its ghosts and of the bodies that are ghosts elsewhere, until no mark changes.
void SoftStep::share_marks(const soft_step::Islands& islands) {
  if (ranks_ == nullptr) return;
  Domain& domain = ranks_->domain();
  const auto read = [&](std::uint32_t body) { return islands.mark_of(body); };
  bool changed = false;
  const auto combine = [&](std::uint32_t body, std::uint8_t mark) {
    changed |= islands.combine_mark(body, mark);
  };
  do {
    changed = false;
    // Bodies of one island have one mark.
    domain.exchange_in_order(domain.lent(), domain.ghosts(), read, combine);
    domain.exchange_in_order(domain.ghosts(), domain.lent(), read, combine);
  } while (domain.any(changed));
}

void SoftStep::wake_touched(const BodyStore& bodies) {
  const auto is_asleep = [this](std::uint32_t i) { return step_.bodies.is_asleep(i); };
  if (!any_rank(any_body(present(bodies), is_asleep))) return;
  const soft_step::Islands islands = islands_of(bodies, present(bodies));
  const PoolTeam team(pool_);
  islands.mark_touched(team);
  share_marks(islands);
  islands.wake_marked(team);
}

void SoftStep::put_to_sleep(const BodyStore& bodies) {
  const soft_step::Islands islands = islands_of(bodies, moved(bodies));
  const PoolTeam team(pool_);
  islands.mark_restless(team);
  share_marks(islands);
  islands.put_unmarked_to_sleep(team);
}

/// Updates the orientations of the ghosts after a move, for the rows of joints.
void SoftStep::share_orientations() {
  if (ranks_ == nullptr || joints_.count == 0) return;
  Domain& domain = ranks_->domain();
  domain.exchange(
      domain.lent(), domain.ghosts(), [this](std::uint32_t i) { return orientation_[i]; },
      [this](std::uint32_t i, const Quat& q) { orientation_[i] = q; });
}

/// Calls stage(index) for all bodies that are not immovable, and with several ranks for those that
/// are present.
template <class Stage>
void SoftStep::for_each_body(const BodyStore& store, const Stage& stage) {
  const std::span<const std::uint32_t> bodies = present(store);
  parallel_for(pool_, bodies.size(), body_chunk(bodies.size()),
               [&](std::size_t first, std::size_t last) {
                 for (const std::uint32_t i : bodies.subspan(first, last - first)) stage(i);
               });
}

/// @returns whether test(index) is true for any body
template <class Test>
bool SoftStep::any_body(std::span<const std::uint32_t> bodies, const Test& test) {
  return parallel_reduce(
      pool_, bodies.size(), body_chunk(bodies.size()), false,
      [&](std::size_t first, std::size_t last) {
        bool any = false;
        for (const std::uint32_t i : bodies.subspan(first, last - first)) any |= test(i);
        return any;
      },
      std::logical_or<>());
}

/// Loads the bodies of a step, except immovable bodies without contacts and joints.
void SoftStep::load(const BodyStore& store) {
  const bool any_kernels = solver_.body_kernels() != nullptr;
  for_each_body(store, [&](std::uint32_t i) {
    step_.load(i);
    const bool is_gyroscopic = step_.bodies.is_active(i) && step_.bodies.has_gyroscopic_term(i);
    if (any_kernels && is_gyroscopic) gyroscopic_[i] = step_.substep_body(i);
  });
  if (store.mobile().size() == store.size()) return;
  const std::span<const BodyId> ids = store.ids();
  parallel_for(pool_, ids.size(), body_chunk(ids.size()), [&](std::size_t first, std::size_t last) {
    for (const BodyId id : ids.subspan(first, last - first)) {
      if (constrained_[id.index] != 0 && store.immovable(id.index)) step_.load(id.index);
    }
  });
}

std::optional<BodyId> SoftStep::find_runaway(const BodyStore& store) {
  constexpr std::uint32_t kNone = BodyId{}.index;
  const std::span<const std::uint32_t> bodies = moved(store);
  std::uint32_t found = parallel_reduce(
      pool_, bodies.size(), body_chunk(bodies.size()), kNone,
      [&](std::size_t first, std::size_t last) {
        for (const std::uint32_t i : bodies.subspan(first, last - first)) {
          if (store.moving.awake[i] != 0 && !is_in_world(step_.state(i))) return i;
        }
        return kNone;
      },
      [](std::uint32_t x, std::uint32_t y) { return std::min(x, y); });
  if (ranks_ != nullptr) found = std::ranges::min(ranks_->domain().gather(found));
  return found == kNone ? std::nullopt : std::optional(store.id(found));
}

std::optional<BodyId> SoftStep::solve(BodyStore* bodies, const soft_step::JointView& joints) {
  joints_ = joints;
  prepare(*bodies);
  cache_.match({bodies->inverse_masses(), bodies->moving.place, bodies->has_blocks()},
               bodies->any_rolls(), joints, pool_, domain());
  mark_constrained();
  step_ = {.bodies = bodies->view(),
           .motion = bodies->motion_pointers(),
           .solver = bodies_.data(),
           .traits = traits_.data(),
           .orientation = orientation_.data(),
           .constrained = constrained_.data(),
           .moved_rotation = moved_rotation_.data(),
           .h = constants_.h};
  wake_touched(*bodies);
  load(*bodies);
  const BodyView& view = step_.bodies;
  solver_.build({.contacts = cache_.current().view(),
                 .joints = joints,
                 .properties = {.inverse_inertia = view.inverse_inertia,
                                .acceleration = view.last_acceleration,
                                .radius = view.radius,
                                .traits = traits_.data(),
                                .constrained = constrained_.data(),
                                .friction = view.friction,
                                .restitution = view.restitution,
                                .rolling_friction = view.rolling_friction,
                                .spinning_friction = view.spinning_friction,
                                .rules = materials_,
                                .position = view.position,
                                .orientation = orientation_.data(),
                                .start_orientation = view.orientation},
                 .start = bodies_.data(),
                 .restitution_threshold = constants_.restitution_threshold,
                 .inverse_friction_gap = constants_.inverse_friction_gap},
                bodies_, present(*bodies), bodies->moving.place, bodies->has_blocks(),
                {step_.bodies.last_acceleration, free_.data()}, constants_, domain());
  if (ranks_ != nullptr) ranks_->check_owners(solver_.stray());
  run_substeps(*bodies);
  solver_.store();
  return find_runaway(*bodies);
}

cpu::BodySweep SoftStep::body_sweep(bool is_first) {
  using soft_step::FreeMotion;
  using soft_step::SubstepBody;
  constexpr std::size_t kReal = sizeof(Real);
  static_assert(sizeof(Quat) == 4 * kReal && offsetof(Quat, w) == 0);
  static_assert(sizeof(FreeMotion) == cpu::kFreeStride * kReal);
  static_assert(offsetof(FreeMotion, angular_velocity) == 3 * kReal);
  static_assert(sizeof(SubstepBody) == cpu::kConstantsStride * kReal);
  static_assert(offsetof(SubstepBody, velocity_kept) == 3 * kReal);
  static_assert(offsetof(SubstepBody, angular_acceleration) == 4 * kReal);
  static_assert(offsetof(SubstepBody, angular_velocity_kept) == 7 * kReal);
  static_assert(sizeof(Mat3) == cpu::kMatrixStride * kReal);
  return {.bodies = reinterpret_cast<Real*>(step_.solver),
          .orientations = reinterpret_cast<Real*>(step_.orientation),
          .free = reinterpret_cast<Real*>(free_.data()),
          .constants = reinterpret_cast<const Real*>(gyroscopic_.data()),
          .inertia = reinterpret_cast<const Real*>(step_.bodies.tensor),
          .inverse_inertia = reinterpret_cast<const Real*>(step_.bodies.body_inverse_inertia),
          .substep = step_.bodies.substep,
          .h = step_.h,
          .shortest2 = kEpsilon * kEpsilon,
          .two_iterations = detail::kSlowerRotation,
          .three_iterations = detail::kSlowRotation,
          .is_first = is_first};
}

/// Calls stage(bodies) for parts of the bodies whose motion this rank computes.
template <class Stage>
void SoftStep::for_each_part(const BodyStore& store, const Stage& stage) {
  const std::span<const std::uint32_t> bodies = moved(store);
  parallel_for(pool_, bodies.size(), body_chunk(bodies.size()),
               [&](std::size_t first, std::size_t last) {
                 for (; first < last; first += kBodiesPerKernel) {
                   stage(bodies.subspan(first, std::min(kBodiesPerKernel, last - first)));
                 }
               });
}

/// StepBodies::hold() for the kernels, which do not know locks.
void SoftStep::hold(std::span<const std::uint32_t> bodies) {
  if (!step_.bodies.any_locks) return;
  for (const std::uint32_t i : bodies) step_.hold(i, &step_.solver[i]);
}

/// Starts a substep of all active bodies.
void SoftStep::accelerate_bodies(const BodyStore& store, bool is_first) {
  using soft_step::SubstepBody;
  const cpu::BodySweepKernels* kernels = solver_.body_kernels();
  const cpu::BodySweep sweep = body_sweep(is_first);
  const auto accelerate = [&](std::uint32_t i, const SubstepBody& body) {
    step_.accelerate(i, body, step_.orientation[i], &step_.solver[i], &free_[i], is_first);
  };
  for_each_part(store, [&](std::span<const std::uint32_t> part) {
    std::array<std::uint32_t, kBodiesPerKernel> items[2], left;
    std::size_t counts[2] = {};
    for (const std::uint32_t i : part) {
      if (!step_.bodies.is_active(i)) continue;
      if (kernels == nullptr || !step_.bodies.has_gyroscopic_term(i)) {
        accelerate(i, step_.substep_body(i));
        continue;
      }
      const SubstepBody& body = gyroscopic_[i];
      const bool is_free = body.has(SubstepBody::kIsFree);
      if (is_free && body.has(SubstepBody::kHasForce)) {
        accelerate(i, body);
      } else {
        items[is_free][counts[is_free]++] = i;
      }
    }
    for (std::size_t kind = 0; kind < 2; ++kind) {
      if (counts[kind] == 0) continue;
      const std::size_t count =
          kernels->accelerate[kind](sweep, items[kind].data(), counts[kind], left.data());
      for (const std::uint32_t i : std::span(left).first(count)) accelerate(i, gyroscopic_[i]);
      hold(std::span(items[kind]).first(counts[kind]));
    }
  });
}

/// Integrates the velocities of all awake bodies over a substep.
void SoftStep::move_bodies(const BodyStore& store) {
  const cpu::BodySweepKernels* kernels = solver_.body_kernels();
  const cpu::BodySweep sweep = body_sweep(false);
  for_each_part(store, [&](std::span<const std::uint32_t> part) {
    std::array<std::uint32_t, kBodiesPerKernel> items;
    std::size_t count = 0;
    for (const std::uint32_t i : part) {
      if (step_.bodies.awake[i] == 0) continue;
      const bool has_joints = step_.constrained[i] >= soft_step::kHasJoint;
      if (kernels != nullptr && !has_joints && !step_.bodies.is_conveyor(i)) {
        items[count++] = i;
      } else {
        step_.move(i, has_joints, &step_.orientation[i], &step_.solver[i]);
      }
    }
    if (count == 0) return;
    hold(std::span(items).first(count));
    kernels->move(sweep, items.data(), count);
  });
}

void SoftStep::run_substeps(const BodyStore& bodies) {
  using soft_step::Sweep;
  for (std::uint32_t substep = 0; substep < settings_.substeps; ++substep) {
    accelerate_bodies(bodies, substep == 0);
    if (substep == 0) solver_.sweep(Sweep::warm_start);
    if (joints_.count > 0) {
      solver_.sweep(Sweep::first_joints);
      for (std::uint32_t k = 1; k < constants_.joint_sweeps; ++k) solver_.sweep(Sweep::joints);
    }
    solver_.sweep(Sweep::bias);
    move_bodies(bodies);
    share_orientations();
    for (std::uint32_t k = 0; k < soft_step::kRelaxSweeps; ++k) solver_.sweep(Sweep::relax);
  }
  if (any_rank(solver_.needs_restitution())) solver_.sweep(Sweep::restitution);
}

void SoftStep::commit(BodyStore* bodies, std::uint64_t steps, const SubShapeView& sub_shapes,
                      const FixedTreesView& trees, std::span<const std::uint32_t> present) {
  stop_fast_bodies(*bodies, sub_shapes, trees, present);
  const bool any_rests =
      any_body(moved(*bodies), [this](std::uint32_t i) { return step_.store(i); });
  if (any_rank(any_rests)) put_to_sleep(*bodies);
  cache_.commit();
  if (ranks_ == nullptr || ranks_->prepare_partition(bodies, steps)) {
    partition_.update(bodies, steps, pool_);
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
