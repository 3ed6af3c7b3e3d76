/// Solves a group: bodies and contacts to rows, sweeps, and back. See the header.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/error.hpp>

#include "src/bullet/prefetch.hpp"
#include "src/bullet/solver/contact_scan.hpp"
#include "src/bullet/solver/friction_directions.hpp"
#include "src/bullet/solver/gpu_island_solver.hpp"
#include "src/bullet/solver/joint_rows.hpp"
#include "src/bullet/solver/rolling_friction_rows.hpp"
#include "src/bullet/solver/row_inputs.hpp"

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <vector>

extern int gNumSplitImpulseRecoveries;  // Bullet's, counted by its solver

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kBodiesAChunk = 256;
constexpr std::size_t kBlocksAChunk = 16;
/// A residual is kept for each, and set to 0 in each group. Who asks for more means "until it is
/// solved", and takes Bullet's time.
constexpr int kMaxIterations = 1 << 16;
/// SOLVER_SIMD means nothing on Linux; SOLVER_FRICTION_SEPARATE and SOLVER_CACHE_FRIENDLY nowhere.
constexpr int kUnsupportedModes = SOLVER_RANDMIZE_ORDER | SOLVER_ENABLE_FRICTION_DIRECTION_CACHING;

/// Where a call of a virtual function leads, by the Itanium C++ ABI that g++ and clang follow: the
/// pointer to a virtual member is one more than its offset in the table.
template <class Member>
const void* target(const void* object, Member member) {
  std::ptrdiff_t offset;
  std::memcpy(&offset, &member, sizeof offset);
  const char* table;
  std::memcpy(&table, object, sizeof table);
  const void* function;
  std::memcpy(&function, table + (offset - 1), sizeof function);
  return function;
}

}  // namespace

struct ConstraintSolver::Impl {
  using Steps = std::array<const void*, 8>;

  ConstraintSolver& self;
  const Steps own_steps;                        ///< of this very class
  const btSingleConstraintRowSolver own_split;  ///< Bullet's own
  cpu::RowSolver solver;
  GpuIslandSolver device;
  std::size_t minimum_batch;
  ConstraintSolverStats stats;
  ContactScan scan;
  std::vector<std::uint8_t> marks;
  std::atomic<bool> factors{false}, warm{false};

  // One group: valid while it is solved.
  std::span<btCollisionObject*> bodies;
  std::span<btTypedConstraint*> joints;
  std::vector<std::int32_t> joint_ids;  ///< by solver body: see JointRows
  std::vector<LateBody> joint_late;     ///< bodies that only a joint has brought in
  const btContactSolverInfo* info = nullptr;
  rows::RowSettings settings{};
  bool on_device = false;

  Impl(ConstraintSolver& owner, const ConstraintSolverOptions& options, GroupSolverMaker make)
      : self((verify_build(options.headers), owner)),
        own_steps(steps()),
        own_split(owner.m_resolveSplitPenetrationImpulse),
        solver(options.threads, options.simd),
        device(options.backend, std::move(make), solver.pool().threads()),
        minimum_batch(options.minimum_batch) {}

  /// The steps of Bullet's solver that are not gone here one by one, as the object has them now.
  Steps steps() const {
    return {target(&self, &ConstraintSolver::convertContacts),
            target(&self, &ConstraintSolver::convertBodies),
            target(&self, &ConstraintSolver::convertJoints),
            target(&self, &ConstraintSolver::solveSingleIteration),
            target(&self, &ConstraintSolver::solveGroupCacheFriendlySetup),
            target(&self, &ConstraintSolver::solveGroupCacheFriendlyIterations),
            target(&self, &ConstraintSolver::solveGroupCacheFriendlySplitImpulseIterations),
            target(&self, &ConstraintSolver::solveGroupCacheFriendlyFinish)};
  }

  /// A joint may ask for more than the world does.
  int most_iterations() const {
    int most = info->m_numIterations;
    for (const btTypedConstraint* joint : joints) {
      most = std::max(most, joint->getOverrideNumSolverIterations());
    }
    return most;
  }

  std::optional<SolverFallback> obstacle(int manifold_count) const {
    if (static_cast<std::size_t>(manifold_count) < minimum_batch) return SolverFallback::small;
    if (steps() != own_steps) return SolverFallback::overridden;
    if ((info->m_solverMode & kUnsupportedModes) != 0 || info->m_numIterations <= 0 ||
        most_iterations() > kMaxIterations) {
      return SolverFallback::mode;
    }
    if (self.m_resolveSingleConstraintRowGeneric != self.getScalarConstraintRowSolverGeneric() ||
        self.m_resolveSingleConstraintRowLowerLimit !=
            self.getScalarConstraintRowSolverLowerLimit() ||
        self.m_resolveSplitPenetrationImpulse != own_split) {
      return SolverFallback::row_solver;
    }
    if (!are_known_joints(joints)) return SolverFallback::constraints;
    return std::nullopt;
  }

  /// @return why it could not be; all that Bullet's solver reads is then as it was
  std::optional<SolverFallback> solve(std::span<btPersistentManifold* const> manifolds) {
    BT_PROFILE("solveGroup");  // here and below: Bullet's own names, for those who profile
    joint_late.clear();
    scan.forget_late();
    rows::RowSweepReport report;
    try {
      set_up(manifolds);
      report = solve_rows();
    } catch (const OutOfMemory&) {
      return give_back(SolverFallback::out_of_memory);
    } catch (const std::bad_alloc&) {
      return give_back(SolverFallback::out_of_memory);
    }
    if (report.broken) return give_back(SolverFallback::not_finite);
    // Worlds of several threads share it, in Bullet as here.
    std::atomic_ref(gNumSplitImpulseRecoveries)
        .fetch_add(static_cast<int>(report.pushed), std::memory_order_relaxed);
    analyse(report, static_cast<int>(manifolds.size()));
    write_back();
    device.finished(on_device ? 0 : solver.levels());
    ++stats.groups;
    if (on_device) ++stats.on_device;
    stats.contacts += scan.contacts().size();
    stats.joints += joints.size();
    stats.sweeps += static_cast<std::uint64_t>(report.iterations);
    return std::nullopt;
  }

  void set_up(std::span<btPersistentManifold* const> manifolds) {
    BT_PROFILE("solveGroupCacheFriendlySetup");
    settings = row_settings(*info);
    set_up_bodies();
    if (!joints.empty()) set_up_joints();
    {
      BT_PROFILE("find contacts");
      scan.run(solver.pool(), manifolds, marks);
      set_up_late_bodies(manifolds);
    }
    if (!scan.any_rolling()) return;
    // Bullet's function for rows against rolling wants a solver body for the fixed body too.
    btSolverBody& fixed = self.m_tmpSolverBodyPool.expandNonInitializing();
    self.initSolverBody(&fixed, nullptr, settings.dt);
  }

  rows::RowSweepReport solve_rows() {
    on_device = false;
    if (joints.empty() && device.choose(scan, *info)) {
      const auto report = device.solve(device_group());
      stats.device_failure = device.failure();
      on_device = report.has_value();
      if (on_device) return *report;
    }
    set_up_rows();
    return sweep();
  }
  DeviceGroup device_group() {
    return {.host = solver,
            .scan = scan,
            .info = *info,
            .settings = settings,
            .bodies = solver.bodies(),
            .directions = directions(),
            .factors = factors,
            .make_rolling_frictions = [this](const ContactRef& contact, Real* to) {
              set_up_rolling_friction(contact, to, 1);
            }};
  }
  void set_up_rows() {
    BT_PROFILE("solveGroupCacheFriendlySetup");
    {
      BT_PROFILE("schedule contacts");
      solver.schedule(scan.pairs(), directions());
    }
    set_up_contacts();
    if (scan.any_rolling()) set_up_rolling_frictions();
  }

  std::uint32_t directions() const {
    return (info->m_solverMode & SOLVER_USE_2_FRICTION_DIRECTIONS) != 0 ? 2 : 1;
  }

  rows::RowSweepReport sweep() {
    BT_PROFILE("solveGroupCacheFriendlyIterations");
    btConstraintArray& rows = self.m_tmpSolverNonContactConstraintPool;
    const auto row_count = static_cast<std::size_t>(joints.empty() ? 0 : rows.size());
    JointRows joint_rows(solver, {row_count > 0 ? &rows[0] : nullptr, row_count}, joint_ids);
    cpu::RowSweepSettings sweeps{
        .iterations = info->m_numIterations,
        .threshold = info->m_leastSquaresResidualThreshold,
        .interleave =
            (info->m_solverMode & SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS) != 0,
        .warm_start = warm,
        .push = settings.split};
    if (!joints.empty()) {
      sweeps.serial = &joint_rows;
      sweeps.serial_iterations = self.m_maxOverrideNumSolverIterations;
    }
    return solver.solve(sweeps, factors);
  }

  void set_up_bodies() {
    BT_PROFILE("convertBodies");
    const std::size_t count = bodies.size();
    self.m_tmpSolverBodyPool.resizeNoInitialize(0);
    self.m_tmpSolverBodyPool.reserve(static_cast<int>(count) + 1);
    self.m_tmpSolverBodyPool.resizeNoInitialize(static_cast<int>(count));
    solver.resize_bodies(count + 1);
    marks.assign(count + 1, kLight | kUnmoved);
    factors = false;
    warm = false;
    const std::size_t chunks = (count + kBodiesAChunk - 1) / kBodiesAChunk;
    solver.pool().run(chunks, [&](std::size_t chunk) {
      const std::size_t last = std::min(count, (chunk + 1) * kBodiesAChunk);
      for (std::size_t i = chunk * kBodiesAChunk; i < last; ++i) {
        if (i + 8 < last) prefetch_bytes(bodies[i + 8], sizeof(btRigidBody));
        set_up_body(i, bodies[i]);
      }
    });
  }

  /// As Bullet's convertBodies(). A body that it would not give a solver body keeps its place, as
  /// the fixed body; nobody can see the difference.
  void set_up_body(std::size_t i, btCollisionObject* object) {
    object->setCompanionId(-1);
    btSolverBody& body = self.m_tmpSolverBodyPool[static_cast<int>(i)];
    btRigidBody* original = moving_body(object);
    self.initSolverBody(&body, original, settings.dt);
    clear_velocities(i + 1);
    if (original == nullptr) return;
    object->setCompanionId(static_cast<int>(i));
    if (original->getInvMass() != 0) add_gyroscopic_impulses(*info, &body);
    pack(body, i + 1);
    marks[i + 1] = marks_of(*original);
  }

  void pack(const btSolverBody& body, std::size_t id) {
    pack_body(body, solver.body(id));
    solver.velocity(id)[3] = solver.push(id)[3] = body.m_invMass[0];
    pack_factors(body, solver.factors(id));
    const btVector3 ones(1, 1, 1);
    if (body.m_linearFactor != ones || body.m_angularFactor != ones) {
      factors.store(true, std::memory_order_relaxed);
    }
  }

  /// Bullet makes the rows; bodies that it adds for them get ids here.
  void set_up_joints() {
    btAlignedObjectArray<btSolverBody>& pool = self.m_tmpSolverBodyPool;
    self.m_fixedBodyId = -1;
    self.m_maxOverrideNumSolverIterations = 0;
    for (btTypedConstraint* joint : joints) {
      for (btRigidBody* body : {&joint->getRigidBodyA(), &joint->getRigidBodyB()}) {
        if (body->getCompanionId() < 0) joint_late.push_back({body, body->getCompanionId()});
      }
    }
    self.convertJoints(joints.data(), static_cast<int>(joints.size()), *info);
    // Also for joints without rows: Bullet brings their bodies in when it comes to solve them.
    for (btTypedConstraint* joint : joints) {
      if (!joint->isEnabled()) continue;
      self.getOrInitSolverBody(joint->getRigidBodyA(), settings.dt);
      self.getOrInitSolverBody(joint->getRigidBodyB(), settings.dt);
    }
    const auto count = static_cast<std::size_t>(pool.size());
    solver.resize_bodies(count + 1);
    marks.resize(count + 1, kLight | kUnmoved);
    joint_ids.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const btSolverBody& body = pool[static_cast<int>(i)];
      if (i >= bodies.size()) {
        clear_velocities(i + 1);
        if (body.m_originalBody != nullptr) {
          pack(body, i + 1);
          marks[i + 1] = marks_of(*body.m_originalBody);
        }
      }
      const auto id = static_cast<std::int32_t>(i) + 1;
      const bool moved = (marks[i + 1] & kUnmoved) == 0;
      joint_ids[i] = body.m_originalBody == nullptr ? rows::kFixedBody : (moved ? id : ~id);
    }
  }
  void clear_velocities(std::size_t id) {
    std::fill_n(solver.velocity(id), rows::kVelocityFields, Real(0));
    std::fill_n(solver.push(id), rows::kVelocityFields, Real(0));
  }

  /// Leaves the companion ids as they were.
  SolverFallback give_back(SolverFallback why) {
    for (const LateBody& late : scan.late()) late.object->setCompanionId(late.companion);
    for (const LateBody& late : joint_late) late.object->setCompanionId(late.companion);
    device.abandon();
    return why;
  }

  /// As Bullet does when it meets them in a manifold.
  void set_up_late_bodies(std::span<btPersistentManifold* const> manifolds) {
    const auto next_id = static_cast<std::size_t>(self.m_tmpSolverBodyPool.size()) + 1;
    scan.find_late(manifolds, next_id);
    solver.resize_bodies(next_id + scan.late().size());
    for (const LateBody& late : scan.late()) {
      const auto id = static_cast<std::size_t>(late.object->getCompanionId()) + 1;
      btSolverBody& body = self.m_tmpSolverBodyPool.expandNonInitializing();
      self.initSolverBody(&body, late.object, settings.dt);
      clear_velocities(id);
      pack(body, id);
    }
  }

  void set_up_contacts() {
    BT_PROFILE("set up contacts");
    const std::size_t chunks = (solver.blocks() + kBlocksAChunk - 1) / kBlocksAChunk;
    solver.pool().run(chunks, [&](std::size_t chunk) {
      const auto last = static_cast<std::uint32_t>(
          std::min<std::size_t>(solver.blocks(), (chunk + 1) * kBlocksAChunk));
      for (auto block = static_cast<std::uint32_t>(chunk * kBlocksAChunk); block < last; ++block) {
        if (block + 1 < last) prefetch_block(block + 1);
        set_up_block(block);
      }
    });
  }
  void prefetch_block(std::uint32_t block) const {
    for (std::size_t lane = 0; lane < solver.lanes(); ++lane) {
      const std::uint32_t contact = solver.contacts_of(block)[lane];
      if (contact == cpu::RowSolver::kNoContact) return;
      prefetch_bytes(&scan.contacts()[contact].get(), sizeof(btManifoldPoint));
    }
  }

  void set_up_block(std::uint32_t block) {
    const std::size_t lanes = solver.lanes();
    alignas(64) Real inputs[rows::kInputFields * rows::kMaxLanes] = {};
    alignas(64) Real second[3 * rows::kMaxLanes];
    const std::uint32_t* contacts = solver.contacts_of(block);
    std::size_t used = 0;
    for (; used < lanes && contacts[used] != cpu::RowSolver::kNoContact; ++used) {
      const btManifoldPoint& point = scan.contacts()[contacts[used]].get();
      pack_contact(point, *info, lanes, inputs + used);
      if (point.m_appliedImpulse != 0) warm.store(settings.warm_start, std::memory_order_relaxed);
    }
    const unsigned has_second = solver.set_up_contacts(settings, block, inputs, second);
    Real* const one = solver.friction_rows(block);
    Real* const two = directions() == 2 ? solver.friction_rows(block, 1) : nullptr;
    for (std::size_t lane = 0; lane < used; ++lane) {
      const Real* other = (has_second >> lane & 1) != 0 ? second + lane : nullptr;
      set_friction_directions(scan.contacts()[contacts[lane]], settings, lanes, other, one + lane,
                              two != nullptr ? two + lane : nullptr);
    }
    for (std::uint32_t k = 0; k < directions(); ++k) {
      solver.set_up_frictions(settings, block, k, inputs);
    }
  }

  void set_up_rolling_frictions() {
    BT_PROFILE("set up rolling_frictions");
    const auto contact_in = [&](std::uint32_t block, std::size_t lane) -> const ContactRef* {
      const std::uint32_t contact = solver.contacts_of(block)[lane];
      return contact == cpu::RowSolver::kNoContact ? nullptr : &scan.contacts()[contact];
    };
    solver.choose_rolling_frictions([&](std::uint32_t block) {
      for (std::size_t lane = 0; lane < solver.lanes(); ++lane) {
        const ContactRef* contact = contact_in(block, lane);
        if (contact != nullptr && contact->rolling) return true;
      }
      return false;
    });
    solver.pool().run(solver.rolling_friction_blocks().size(), [&](std::size_t k) {
      const std::uint32_t block = solver.rolling_friction_blocks()[k];
      for (std::uint32_t t = 0; t < cpu::kRollingFrictionRows; ++t) {
        std::fill_n(solver.rolling_friction_rows(k, t), solver.lanes() * rows::kFrictionFields,
                    Real(0));
      }
      for (std::size_t lane = 0; lane < solver.lanes(); ++lane) {
        const ContactRef* contact = contact_in(block, lane);
        if (contact == nullptr || !contact->rolling) continue;
        set_up_rolling_friction(*contact, solver.rolling_friction_rows(k, 0) + lane,
                                solver.lanes());
      }
    });
  }
  void set_up_rolling_friction(const ContactRef& contact, Real* to, std::size_t lanes) {
    const int fixed = self.m_tmpSolverBodyPool.size() - 1;  // see set_up()
    bullet::set_up_rolling_frictions(self, fixed, settings.relaxation, contact, to, lanes);
  }

  void analyse(const rows::RowSweepReport& report, int manifold_count) {
    self.m_leastSquaresResidual = report.residual;
    btSolverAnalyticsData& data = self.m_analyticsData;
    ++data.m_numSolverCalls;
    data.m_numIterationsUsed = report.iterations;
    data.m_islandId = bodies.empty() ? -2 : (bodies[0]->getCompanionId() < 0 ? -1 : 0);
    data.m_numBodies = static_cast<int>(bodies.size());
    data.m_numContactManifolds = manifold_count;
    data.m_remainingLeastSquaresResidual = report.residual;
  }

  void write_back() {
    BT_PROFILE("solveGroupCacheFriendlyFinish");
    if (on_device) {
      device.write_back(device_group());
    } else if (settings.warm_start) {
      const std::size_t chunks = (solver.blocks() + kBlocksAChunk - 1) / kBlocksAChunk;
      solver.pool().run(chunks, [&](std::size_t chunk) {
        const auto last = static_cast<std::uint32_t>(
            std::min<std::size_t>(solver.blocks(), (chunk + 1) * kBlocksAChunk));
        for (auto i = static_cast<std::uint32_t>(chunk * kBlocksAChunk); i < last; ++i) {
          write_back_impulses(i);
        }
      });
    }
    if (!joints.empty()) {
      self.writeBackJoints(0, self.m_tmpSolverNonContactConstraintPool.size(), *info);
      self.m_tmpSolverNonContactConstraintPool.resizeNoInitialize(0);
    }
    if (scan.any_rolling()) self.m_tmpSolverBodyPool.pop_back();  // see set_up()
    const auto count = static_cast<std::size_t>(self.m_tmpSolverBodyPool.size());
    const std::size_t chunks = (count + kBodiesAChunk - 1) / kBodiesAChunk;
    solver.pool().run(chunks, [&](std::size_t chunk) {
      const std::size_t first = chunk * kBodiesAChunk;
      const std::size_t last = std::min(count, first + kBodiesAChunk);
      for (std::size_t i = first; i < last; ++i) {
        btSolverBody& body = self.m_tmpSolverBodyPool[static_cast<int>(i)];
        const Real *v = solver.velocity(i + 1), *p = solver.push(i + 1);
        body.m_deltaLinearVelocity.setValue(v[0], v[1], v[2]);
        body.m_deltaAngularVelocity.setValue(v[4], v[5], v[6]);
        body.m_pushVelocity.setValue(p[0], p[1], p[2]);
        body.m_turnVelocity.setValue(p[4], p[5], p[6]);
      }
      self.writeBackBodies(static_cast<int>(first), static_cast<int>(last), *info);
    });
    self.m_tmpSolverBodyPool.resizeNoInitialize(0);
  }
  void write_back_impulses(std::uint32_t block) {
    const std::size_t lanes = solver.lanes();
    const Real* contact = solver.contact_rows(block) + rows::kRowImpulse * lanes;
    const Real* friction = solver.friction_rows(block) + rows::kRowImpulse * lanes;
    const Real* other = solver.friction_rows(block, directions() - 1) + rows::kRowImpulse * lanes;
    const std::uint32_t* contacts = solver.contacts_of(block);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      if (contacts[lane] == cpu::RowSolver::kNoContact) return;
      btManifoldPoint& point = scan.contacts()[contacts[lane]].get();
      point.m_appliedImpulse = contact[lane];
      point.m_appliedImpulseLateral1 = friction[lane];
      if (directions() == 2) point.m_appliedImpulseLateral2 = other[lane];
    }
  }
};

ConstraintSolver::ConstraintSolver(const ConstraintSolverOptions& options)
    : impl_(std::make_unique<Impl>(*this, options, cuda_group_solver_maker(options.device))) {}
ConstraintSolver::ConstraintSolver(std::unique_ptr<GroupSolver> device,
                                   const ConstraintSolverOptions& options)
    : impl_(std::make_unique<Impl>(*this, options,
                                   [made = std::make_shared<std::unique_ptr<GroupSolver>>(
                                        std::move(device))] { return std::move(*made); })) {}
ConstraintSolver::~ConstraintSolver() = default;

btScalar ConstraintSolver::solveGroup(btCollisionObject** bodies, int body_count,
                                      btPersistentManifold** manifolds, int manifold_count,
                                      btTypedConstraint** constraints, int constraint_count,
                                      const btContactSolverInfo& info, btIDebugDraw* debug_drawer,
                                      btDispatcher* dispatcher) {
  // As Bullet does, which forgets row solvers that the user set when the mode changes.
  if (info.m_solverMode != m_cachedSolverMode) {
    setupSolverFunctions((info.m_solverMode & SOLVER_SIMD) != 0);
    m_cachedSolverMode = info.m_solverMode;
  }
  impl_->info = &info;
  impl_->bodies = {bodies, static_cast<std::size_t>(body_count)};
  impl_->joints = {constraints, static_cast<std::size_t>(constraint_count)};
  std::optional<SolverFallback> obstacle = impl_->obstacle(manifold_count);
  if (!obstacle) obstacle = impl_->solve({manifolds, static_cast<std::size_t>(manifold_count)});
  if (!obstacle) return 0;
  ++impl_->stats.fallbacks[static_cast<std::size_t>(*obstacle)];
  return btSequentialImpulseConstraintSolver::solveGroup(
      bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info,
      debug_drawer, dispatcher);
}

std::size_t ConstraintSolver::minimum_batch() const noexcept { return impl_->minimum_batch; }
void ConstraintSolver::set_minimum_batch(std::size_t manifolds) noexcept {
  impl_->minimum_batch = manifolds;
}
const ConstraintSolverStats& ConstraintSolver::stats() const noexcept { return impl_->stats; }
void ConstraintSolver::reset_stats() {
  impl_->stats = {.device_failure = std::move(impl_->stats.device_failure)};
}

std::string_view to_string(SolverFallback fallback) noexcept {
  constexpr std::string_view kTexts[kSolverFallbacks] = {
      "small group",           "step overridden", "solver mode",  "row solver replaced",
      "class of a constraint", "not finite",      "out of memory"};
  const auto i = static_cast<std::size_t>(fallback);
  return i < kSolverFallbacks ? kTexts[i] : "unknown";
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
