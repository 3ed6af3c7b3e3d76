/// Solves a group: bodies and contacts to rows, sweeps, and back. See the header.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/error.hpp>

#include "src/bullet/contact_scan.hpp"
#include "src/bullet/joint_rows.hpp"

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <span>
#include <string>
#include <vector>

extern int gNumSplitImpulseRecoveries;  // Bullet's, counted by its solver

namespace jfpx::inline JFPX_ABI::bullet {
namespace {

constexpr std::size_t kBodiesAChunk = 256;
constexpr std::size_t kBlocksAChunk = 16;
/// SOLVER_SIMD means nothing on Linux; SOLVER_FRICTION_SEPARATE and SOLVER_CACHE_FRIENDLY nowhere.
constexpr int kUnsupportedModes = SOLVER_RANDMIZE_ORDER | SOLVER_USE_2_FRICTION_DIRECTIONS |
                                  SOLVER_ENABLE_FRICTION_DIRECTION_CACHING;

unsigned checked_threads(unsigned threads) {
  if (threads > 256) {
    throw InvalidArgument("threads is " + std::to_string(threads) + "; it must be at most 256");
  }
  return threads;
}

rows::RowSettings row_settings(const btContactSolverInfo& info) {
  return {.dt = info.m_timeStep,
          .inverse_dt = btScalar(1) / info.m_timeStep,
          .relaxation = info.m_sor,
          .restitution_threshold = info.m_restitutionVelocityThreshold,
          .slop = info.m_linearSlop,
          .split_threshold = info.m_splitImpulsePenetrationThreshold,
          .friction_erp = info.m_frictionERP,
          .warm_factor = info.m_warmstartingFactor,
          .epsilon = SIMD_EPSILON,
          .split = info.m_splitImpulse != 0,
          .warm_start = (info.m_solverMode & SOLVER_USE_WARMSTARTING) != 0,
          .friction_follows_velocity =
              (info.m_solverMode & SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION) == 0};
}

void put(Real* to, const btVector3& v) { std::copy_n(v.m_floats, 3, to); }

/// Fills the body as gather_body() reads it.
void pack_body(const btSolverBody& body, Real* to) {
  const btRigidBody& original = *body.m_originalBody;
  const btVector3 factor = original.getAngularFactor();
  const btVector3 columns[] = {original.getWorldTransform().getOrigin(), body.m_linearVelocity,
                               body.m_angularVelocity,
                               body.m_linearVelocity + body.m_externalForceImpulse,
                               body.m_angularVelocity + body.m_externalTorqueImpulse};
  for (int i = 0; i < 5; ++i) put(to + 4 * i, columns[i]);
  for (int i = 0; i < 3; ++i) put(to + 20 + 4 * i, original.getInvInertiaTensorWorld()[i]);
  to[3] = original.getInvMass();
  for (int i = 0; i < 3; ++i) to[7 + 4 * i] = factor[i];
  to[19] = to[23] = to[27] = to[31] = 0;
}

/// Softness and error reduction of a contact.
void contact_softness(const btManifoldPoint& point, const btContactSolverInfo& info, Real* cfm,
                      Real* erp) {
  const int flags = point.m_contactPointFlags;
  *cfm = info.m_globalCfm;
  *erp = info.m_erp2;
  if ((flags & (BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP)) != 0) {
    if ((flags & BT_CONTACT_FLAG_HAS_CONTACT_CFM) != 0) *cfm = point.m_contactCFM;
    if ((flags & BT_CONTACT_FLAG_HAS_CONTACT_ERP) != 0) *erp = point.m_contactERP;
  } else if ((flags & BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING) != 0) {
    btScalar denominator =
        info.m_timeStep * point.m_combinedContactStiffness1 + point.m_combinedContactDamping1;
    if (denominator < SIMD_EPSILON) denominator = SIMD_EPSILON;
    *cfm = btScalar(1) / denominator;
    *erp = (info.m_timeStep * point.m_combinedContactStiffness1) / denominator;
  }
}

/// Writes the contact into its lane.
void pack_contact(const btManifoldPoint& point, const btContactSolverInfo& info, std::size_t lanes,
                  Real* to) {
  const auto put3 = [&](std::size_t field, const btVector3& v) {
    for (std::size_t i = 0; i < 3; ++i) to[(field + i) * lanes] = v.m_floats[i];
  };
  put3(rows::kInNormal, point.m_normalWorldOnB);
  put3(rows::kInPointA, point.m_positionWorldOnA);
  put3(rows::kInPointB, point.m_positionWorldOnB);
  to[rows::kInDistance * lanes] = point.m_distance1;
  to[rows::kInFriction * lanes] = point.m_combinedFriction;
  to[rows::kInRestitution * lanes] = point.m_combinedRestitution;
  to[rows::kInImpulse * lanes] = point.m_appliedImpulse;
  contact_softness(point, info, to + rows::kInCfm * lanes, to + rows::kInErp * lanes);
  to[rows::kInAnchor * lanes] =
      (point.m_contactPointFlags & BT_CONTACT_FLAG_FRICTION_ANCHOR) != 0 ? Real(1) : Real(0);
}

}  // namespace

struct ConstraintSolver::Impl {
  ConstraintSolver& self;
  x86::RowSolver solver;
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

  Impl(ConstraintSolver& owner, const ConstraintSolverOptions& options)
      : self(owner),
        solver(checked_threads(options.threads), options.simd),
        minimum_batch(options.minimum_batch) {}

  std::optional<SolverFallback> obstacle(int manifold_count) const {
    if (static_cast<std::size_t>(manifold_count) < minimum_batch) return SolverFallback::small;
    if ((info->m_solverMode & kUnsupportedModes) != 0 || info->m_numIterations <= 0) {
      return SolverFallback::mode;
    }
    if (self.m_resolveSingleConstraintRowGeneric != self.getScalarConstraintRowSolverGeneric() ||
        self.m_resolveSingleConstraintRowLowerLimit !=
            self.getScalarConstraintRowSolverLowerLimit()) {
      return SolverFallback::row_solver;
    }
    if (!std::all_of(joints.begin(), joints.end(),
                     [](const btTypedConstraint* joint) { return is_known_joint(*joint); })) {
      return SolverFallback::constraints;
    }
    return std::nullopt;
  }

  /// @return why it could not be; all that Bullet's solver reads is then as it was
  std::optional<SolverFallback> solve(std::span<btPersistentManifold* const> manifolds) {
    BT_PROFILE("solveGroup");  // here and below: Bullet's own names, for those who profile
    if (!set_up(manifolds)) {
      forget_late_bodies();
      return SolverFallback::rolling;
    }
    const x86::RowSweepReport report = sweep();
    if (report.broken) {
      forget_late_bodies();
      return SolverFallback::not_finite;
    }
    gNumSplitImpulseRecoveries += static_cast<int>(report.pushed);
    analyse(report, static_cast<int>(manifolds.size()));
    write_back();
    ++stats.groups;
    stats.contacts += scan.contacts().size();
    stats.joints += joints.size();
    stats.sweeps += static_cast<std::uint64_t>(report.iterations);
    return std::nullopt;
  }

  bool set_up(std::span<btPersistentManifold* const> manifolds) {
    BT_PROFILE("solveGroupCacheFriendlySetup");
    settings = row_settings(*info);
    set_up_bodies();
    if (!joints.empty()) set_up_joints();
    {
      BT_PROFILE("find contacts");
      if (!scan.run(solver.pool(), manifolds, marks)) return false;
      set_up_late_bodies(manifolds);
    }
    {
      BT_PROFILE("schedule contacts");
      solver.schedule(scan.pairs());
    }
    set_up_contacts();
    return true;
  }

  x86::RowSweepReport sweep() {
    BT_PROFILE("solveGroupCacheFriendlyIterations");
    btConstraintArray& rows = self.m_tmpSolverNonContactConstraintPool;
    const auto row_count = static_cast<std::size_t>(joints.empty() ? 0 : rows.size());
    JointRows joint_rows(solver, {row_count > 0 ? &rows[0] : nullptr, row_count}, joint_ids);
    x86::RowSweepSettings sweeps{
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
        if (i + 8 < last) prefetch(bodies[i + 8]);
        set_up_body(i, bodies[i]);
      }
    });
  }
  static void prefetch(const btCollisionObject* object) {
    const char* at = reinterpret_cast<const char*>(object);
    for (std::size_t line = 0; line < sizeof(btRigidBody); line += 64) {
      __builtin_prefetch(at + line);
    }
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
    if (original->getInvMass() != 0) add_gyroscopic_forces(*original, &body);
    pack(body, i + 1);
    marks[i + 1] = marks_of(*original);
  }

  void add_gyroscopic_forces(const btRigidBody& original, btSolverBody* body) const {
    const int flags = original.getFlags();
    if ((flags & BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT) != 0) {
      body->m_externalTorqueImpulse -=
          original.computeGyroscopicForceExplicit(info->m_maxGyroscopicForce) *
          original.getInvInertiaTensorWorld() * info->m_timeStep;
    }
    if ((flags & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD) != 0) {
      body->m_externalTorqueImpulse +=
          original.computeGyroscopicImpulseImplicit_World(info->m_timeStep);
    }
    if ((flags & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY) != 0) {
      body->m_externalTorqueImpulse +=
          original.computeGyroscopicImpulseImplicit_Body(info->m_timeStep);
    }
  }

  void pack(const btSolverBody& body, std::size_t id) {
    pack_body(body, solver.body(id));
    solver.velocity(id)[3] = solver.push(id)[3] = body.m_invMass[0];
    Real* f = solver.factors(id);
    std::fill_n(f, rows::kFactorFields, Real(0));
    put(f, body.m_invMass);
    put(f + 4, body.m_linearFactor);
    put(f + 8, body.m_angularFactor);
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
    joint_late.clear();
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
  void forget_late_bodies() {
    for (const LateBody& late : scan.late()) late.object->setCompanionId(late.companion);
    if (joints.empty()) return;
    for (const LateBody& late : joint_late) late.object->setCompanionId(late.companion);
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
  void prefetch_block(std::uint32_t block) {
    for (std::size_t lane = 0; lane < solver.lanes(); ++lane) {
      const std::uint32_t contact = solver.contacts_of(block)[lane];
      if (contact == x86::RowSolver::kNoContact) return;
      const char* at = reinterpret_cast<const char*>(&scan.contacts()[contact].get());
      for (std::size_t line = 0; line < sizeof(btManifoldPoint); line += 64) {
        __builtin_prefetch(at + line);
      }
    }
  }

  void set_up_block(std::uint32_t block) {
    constexpr std::size_t kMostLanes = 8;
    const std::size_t lanes = solver.lanes();
    alignas(64) Real inputs[rows::kInputFields * kMostLanes] = {};
    alignas(64) Real second[3 * kMostLanes];
    const std::uint32_t* contacts = solver.contacts_of(block);
    std::size_t used = 0;
    for (; used < lanes && contacts[used] != x86::RowSolver::kNoContact; ++used) {
      const btManifoldPoint& point = scan.contacts()[contacts[used]].get();
      pack_contact(point, *info, lanes, inputs + used);
      if (point.m_appliedImpulse != 0) warm.store(settings.warm_start, std::memory_order_relaxed);
    }
    const unsigned has_second = solver.set_up_contacts(settings, block, inputs, second);
    Real* const axes = solver.friction_rows(block);
    for (std::size_t lane = 0; lane < used; ++lane) {
      const ContactRef& contact = scan.contacts()[contacts[lane]];
      btManifoldPoint& point = contact.get();
      point.m_lateralFrictionDir1.setValue(axes[lane], axes[lanes + lane], axes[2 * lanes + lane]);
      if ((has_second >> lane & 1) != 0) {
        for (std::size_t i = 0; i < 3; ++i) {
          point.m_lateralFrictionDir2.m_floats[i] = second[i * lanes + lane];
        }
      }
      if (contact.anisotropic) turn_friction(contact, lanes, axes + lane);
    }
    solver.set_up_frictions(settings, block, inputs);
  }

  /// Friction that depends on the direction, which is a matter for Bullet.
  static void turn_friction(const ContactRef& contact, std::size_t lanes, Real* axis) {
    btManifoldPoint& point = contact.get();
    for (const btCollisionObject* object :
         {contact.manifold->getBody0(), contact.manifold->getBody1()}) {
      applyAnisotropicFriction(const_cast<btCollisionObject*>(object), point.m_lateralFrictionDir1,
                               btCollisionObject::CF_ANISOTROPIC_FRICTION);
    }
    for (std::size_t i = 0; i < 3; ++i) axis[i * lanes] = point.m_lateralFrictionDir1.m_floats[i];
  }

  void analyse(const x86::RowSweepReport& report, int manifold_count) {
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
    if (settings.warm_start) {
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
    const std::uint32_t* contacts = solver.contacts_of(block);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      if (contacts[lane] == x86::RowSolver::kNoContact) return;
      btManifoldPoint& point = scan.contacts()[contacts[lane]].get();
      point.m_appliedImpulse = contact[lane];
      point.m_appliedImpulseLateral1 = friction[lane];
    }
  }
};

ConstraintSolver::ConstraintSolver(const ConstraintSolverOptions& options)
    : impl_(std::make_unique<Impl>(*this, options)) {}
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
void ConstraintSolver::reset_stats() noexcept { impl_->stats = {}; }

}  // namespace jfpx::inline JFPX_ABI::bullet
