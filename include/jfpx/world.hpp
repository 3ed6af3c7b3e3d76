/// The native engine: a world of rigid bodies with its own step (thesis 4.3).
#pragma once

#include <jfpx/communicator.hpp>
#include <jfpx/contact_generator.hpp>
#include <jfpx/error.hpp>
#include <jfpx/force.hpp>
#include <jfpx/joint.hpp>
#include <jfpx/query.hpp>
#include <jfpx/scene.hpp>
#include <jfpx/snapshot.hpp>
#include <jfpx/sphere_collider.hpp>

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Algorithm that finds the pairs of touching bounds. All algorithms yield the same contacts, bit
/// for bit. Queries (World::cast_ray() and others) do not use it.
enum class BroadPhase : std::uint8_t {
  cells,        ///< the collider's own search, by SphereColliderOptions::algorithm
  hierarchy,    ///< after thesis::enable(): the thesis' tree of bounding spheres (4.4.5)
  brute_force,  ///< after thesis::enable(): every pair; a reference for tests
};

struct WorldSettings {
  /// Device and algorithm that find sphere contacts; `collider.threads` must be left at 1. With
  /// Backend::cuda and Solver::soft_step, the state of the world is on the device, and the whole
  /// step runs there (docs/cuda.md); functions that read or change the state may then also throw
  /// DeviceError. With Backend::automatic and Solver::soft_step, the world moves to the device or
  /// back, whichever is predicted to be faster.
  SphereColliderOptions collider = {};
  /// Numbers of the GPUs that share the world, at most 8, as in available_gpus(); empty:
  /// collider.device alone. If they are given, collider.device has no effect, Backend::automatic is
  /// Backend::cuda, the solver is Solver::soft_step, and the GPUs must be linked (Gpu::linked). The
  /// bits do not depend on them. A GPU may occur several times, which is for tests.
  std::vector<int> devices = {};
  /// Number of threads of a step on the CPU, at most 256; 0: one per core. With
  /// Solver::worst_first, only the search for sphere contacts uses them.
  unsigned threads = 1;
  /// Enqueues a task that any thread of the program calls once, and returns without waiting for it,
  /// as the task system of Box2D or the dispatcher of PhysX; empty: jfpx starts worker threads. A
  /// step on the CPU enqueues `threads` - 1 tasks, unless the world is at rest; with several ranks,
  /// a step that is repeated enqueues them again. A task takes part in the step, and occupies its
  /// thread until the step ends: where there is nothing to do, it polls for up to a millisecond,
  /// then sleeps. A task that begins later returns at once, even after the World is destroyed, and
  /// so does one that the stepping thread calls. A step therefore waits for no task that has not
  /// begun, and may itself be a job of the program, but not one of several ranks. Forces, contact
  /// generators and filters must not wait for other jobs. The bits do not depend on the tasks.
  /// Other functions of the world use the calling thread only.
  std::function<void(std::function<void()> task)> enqueue_task = {};
  BroadPhase broad_phase = BroadPhase::cells;
  /// [m/s], > 0: the least approach speed of World::hit_events(), for example 1. If it is infinite,
  /// there are no hit events. Has no effect on the motion.
  Real hit_speed = std::numeric_limits<Real>::infinity();
  /// The ranks that hold the world together (docs/ranks.md); null: the world is of this process
  /// alone. With several ranks, the solver is Solver::soft_step and the backend the CPU.
  std::shared_ptr<Communicator> communicator = nullptr;
};

/// One contact point of two bodies. Boxes in contact along a face have several points; compounds
/// may also have several. The first rule that applies selects body `a`; compounds are not spheres:
///   - two spheres: the one with the lower index;
///   - a sphere and a box, half-space or plane: the sphere;
///   - only one body is movable (has a mass other than 0): that body;
///   - otherwise: the body with the lower index.
///
/// A contact of a contact generator has the bodies, the point and the direction of the normal of
/// its GeneratedContact.
struct Contact {
  BodyId a, b;
  Vec3 normal;  ///< [-], unit, from b to a
  /// [m], world: the middle of the overlap, or a point of b if the contact began during the step
  Vec3 point;
  Real distance = 0;     ///< [m], <= 0: negative penetration depth; 0 if it began in the step
  Real friction = 0;     ///< [-], >= 0, of the pair, or as a contact generator has set it
  Real restitution = 0;  ///< [-], in [0, 1], likewise
  /// Whether a or b is a sensor; the contact is then not resolved. False for contacts of contact
  /// generators.
  bool sensor = false;
  friend bool operator==(const Contact&, const Contact&) = default;
};

enum class ContactPhase : std::uint8_t {
  begin,  ///< the bodies touch, and did not touch after the previous step
  stay,   ///< the bodies touch, and touched after the previous step
  end     ///< the bodies do not touch, and touched after the previous step
};

/// Change of the contact of two bodies in a step. At least one of the bodies is movable. One or
/// both may be sensors.
struct ContactEvent {
  ContactPhase phase = ContactPhase::begin;
  BodyId a, b;  ///< a.index < b.index; the bodies of an end event may have been removed
  std::uint32_t contacts = 0;  ///< number of contact points of the two bodies, > 0
  Vec3 normal;        ///< [-], unit, from b to a, at the deepest point (the first of equal ones)
  Vec3 point;         ///< [m], world: the deepest point
  Real distance = 0;  ///< [m], <= 0, at the deepest point
  friend bool operator==(const ContactEvent&, const ContactEvent&) = default;
};

/// Two bodies that hit each other in a step: they pushed each other apart, and approached at a
/// point of their contact with at least WorldSettings::hit_speed at the start of the step.
struct HitEvent {
  BodyId a, b;  ///< a.index < b.index; the bodies may have been removed
  Vec3 normal;  ///< [-], unit, from b to a
  /// [m], world, at the start of the step: the fastest point of the contact, as in Contact
  Vec3 point;
  Real approach_speed = 0;  ///< [m/s], > 0, of the point along the normal, at the start of the step
  /// Of a and b: number of the part in Compound::parts, of the triangle in
  /// TriangleMesh::triangles() or, as in HeightfieldDef, of the triangle of a heightfield; 0 for
  /// other shapes.
  std::uint32_t part_a = 0, part_b = 0;
  friend bool operator==(const HitEvent&, const HitEvent&) = default;
};

/// Force of a contact point: the mean force over the last substep of a step.
struct ContactForce {
  BodyId a, b;
  Vec3 normal;        ///< [-], unit, from b to a
  Vec3 arm_a, arm_b;  ///< [m], world axes: from the centres of mass to the point
  /// [N], world axes, on a at the point, of normal force and friction; b has the opposite force
  Vec3 force;
  /// [N m], world axes, on a in addition to that of the force: the point's share in the torque of
  /// rolling and spinning friction; b has the opposite torque
  Vec3 torque;
  /// As in HitEvent; 0 for contacts of contact generators.
  std::uint32_t part_a = 0, part_b = 0;
  friend bool operator==(const ContactForce&, const ContactForce&) = default;
};

/// Result of one step. Times are wall-clock times.
struct StepReport {
  std::uint64_t step = 0;                 ///< number of completed steps, without undone ones
  std::uint64_t contacts = 0;             ///< size of World::contacts(), without generated contacts
  std::uint64_t sphere_contacts = 0;      ///< of these, contacts between two spheres
  std::uint64_t generated_contacts = 0;   ///< contacts of generators, not included in `contacts`
  std::uint64_t position_iterations = 0;  ///< of Solver::worst_first, as the two fields below
  std::uint64_t velocity_iterations = 0;
  bool iterations_exhausted = false;  ///< a solver loop stopped at its limit with work left
  /// A value of a body is no longer finite, or a coordinate exceeds kMaxCoordinate; the step was
  /// undone. Check this field: further steps are also undone until the body is removed or its state
  /// is replaced.
  bool non_finite = false;
  BodyId non_finite_body;   ///< the first such body
  std::uint32_t awake = 0;  ///< movable bodies awake after the step
  /// cuda: the GPU performed the whole step, or found the sphere contacts of a step on the CPU.
  Backend backend = Backend::cpu;
  /// Algorithm that found the sphere contacts; `automatic` in a step on a GPU.
  SphereAlgorithm algorithm = SphereAlgorithm::automatic;
  ChoiceReason choice = ChoiceReason::fixed;  ///< reason for backend and algorithm
  /// Error of a device that the CPU replaced in this step; empty if there was none.
  std::string device_failure;
  /// With Solver::soft_step, `integrate_ms` is the time of forces, and `resolve_ms` includes the
  /// integration in substeps. In a step on a GPU, the first three are device times, without
  /// launches, transfers and forces that the host applies; `total_ms` includes all of these. All
  /// are 0 in a step that is skipped because the world sleeps.
  double integrate_ms = 0, detect_ms = 0, resolve_ms = 0, total_ms = 0;
};

/// Rigid bodies and their motion. Const functions may run concurrently with each other; no other
/// function may run concurrently with any call on the same world. Steps are deterministic to the
/// last bit.
class JFPX_API World {
 public:
  /// Validates the scene. Half-spaces and planes must be immovable.
  /// @throws InvalidScene, BackendUnavailable, OutOfMemory; InvalidArgument for a bad setting
  explicit World(const Scene& scene, const WorldSettings& settings = {});
  /// Creates a world with the given collider, which may be user-defined. Steps of Solver::soft_step
  /// call its find_pairs(), and only if spheres have moved enough.
  /// @param threads of the other parts of a step, like SphereColliderOptions::threads
  /// @throws InvalidArgument if the collider is null, `broad_phase` is not a value of the
  ///   enumeration or `threads` is too large; InvalidScene, OutOfMemory
  World(const Scene& scene, std::unique_ptr<SphereCollider> collider,
        BroadPhase broad_phase = BroadPhase::cells, unsigned threads = 1);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// Adds a body. If an allocation fails, this and all other functions that change bodies throw
  /// std::bad_alloc and leave the world unchanged. Functions that wake or report neighbors may
  /// allocate memory for contacts() once after each step. For a world on a GPU, these functions
  /// throw DeviceError and leave the world unchanged if copying it to the host fails.
  /// @throws InvalidScene if the definition is invalid
  BodyId add(const BodyDef& body);
  /// Removes a body and wakes the bodies in contact with it.
  /// @throws InvalidArgument for an id of no living body of this world
  void remove(BodyId id);
  /// The definition of a body in its current state: add() of another world makes the same body.
  /// @throws InvalidArgument for an unknown id
  BodyDef definition(BodyId id) const;
  /// Gives a body another definition: another shape, a mass of 0 instead of a mass, or any other
  /// fields of BodyDef. Its id, its joints and its ignored pairs remain; its contacts end, as by
  /// remove(). Wakes the body and the bodies in contact with it. A world on a GPU is copied to the
  /// host, and back in the next step.
  /// @throws InvalidArgument for an unknown id, or if a joint would have no movable body;
  ///   InvalidScene if the definition is invalid. The world is then unchanged.
  void replace(BodyId id, const BodyDef& body);

  /// Advances the world by the dt of the scene. Scene::solver selects the stages: forces, detection
  /// and substeps, or forces, integration, detection and resolution. Physics throws no exceptions:
  /// if a value is no longer finite, or a coordinate exceeds kMaxCoordinate, the step is undone and
  /// StepReport::non_finite is set. Further steps are also undone until that body is removed or its
  /// state is replaced.
  /// @throws OutOfMemory, DeviceError and the exceptions of forces, contact generators and
  ///   WorldSettings::enqueue_task; the step is then undone
  StepReport step();

  /// Living bodies in the order of their indices. Valid until a body is added or removed.
  std::span<const BodyId> bodies() const;
  /// Whether the id is of a living body of this world.
  bool contains(BodyId id) const noexcept;
  /// The living body with a given BodyId::index.
  /// @throws InvalidArgument if there is none
  BodyId body_at(std::uint32_t index) const;
  /// Valid until a body is added or removed. @throws InvalidArgument for an unknown id
  const Shape& shape(BodyId id) const;
  /// States in the order of bodies().
  std::vector<BodyState> states() const;
  /// The same into a vector whose memory is reused, with all threads of the world: faster for many
  /// bodies in every step. @param states receives the states
  void states(std::vector<BodyState>* states) const;
  /// @throws InvalidArgument for an unknown id
  BodyState state(BodyId id) const;
  /// Replaces the state of motion, and wakes the body and the bodies in contact with it. An
  /// immovable body is moved and stays at rest; a kinematic body continues with the new velocities.
  /// @throws InvalidArgument for an unknown id or a value out of the range of validate()
  void set_state(BodyId id, const BodyState& state);
  /// Whether the body is awake. A body of mass 0 is awake only if it is kinematic and moves.
  /// @throws InvalidArgument for an unknown id, as do mass(), inverse_inertia() and inertia()
  bool awake(BodyId id) const;
  /// Wakes the body, like apply_force(). Has no effect on a body of mass 0. The next step also
  /// wakes the bodies in contact with it, except through contacts of sensors.
  /// @throws InvalidArgument for an unknown id
  void wake(BodyId id);
  Real mass(BodyId id) const;  ///< [kg]; 0: immovable or kinematic
  /// [1/(kg m^2)], world axes, about the centre of mass; zero for mass 0, and for axes about which
  /// the rotation is locked.
  Mat3 inverse_inertia(BodyId id) const;
  /// [kg m^2], body axes, about the centre of mass; zero for mass 0.
  Mat3 inertia(BodyId id) const;

  /// Acceleration of the centre of mass [m/s^2] in the last step in which the body was awake:
  /// BodyDef::acceleration and forces, without contacts and damping; zero for mass 0.
  /// @throws InvalidArgument for an unknown id
  Vec3 last_acceleration(BodyId id) const;

  /// Fields of BodyDef. A new value takes effect in the next step. A change of friction wakes the
  /// body and the bodies in contact with it; a change of acceleration, mass or inertia wakes the
  /// body. Restitution and damping do not affect bodies at rest.
  /// @throws InvalidArgument, as do all functions up to set_user_data(), for an unknown id or a
  ///   value out of the range of validate()
  Real friction(BodyId id) const;
  void set_friction(BodyId id, Real friction);
  Real restitution(BodyId id) const;
  void set_restitution(BodyId id, Real restitution);
  Vec3 acceleration(BodyId id) const;  ///< [m/s^2], BodyDef::acceleration
  void set_acceleration(BodyId id, const Vec3& acceleration);
  Real linear_damping(BodyId id) const;
  Real angular_damping(BodyId id) const;
  void set_damping(BodyId id, Real linear, Real angular);
  /// [kg], > 0. The inertia becomes that of the solid shape with this mass, unless it was given by
  /// BodyDef::inertia or set_inertia(). A mass of 0 cannot be changed or set: see replace().
  void set_mass(BodyId id, Real mass);
  /// [kg m^2], as BodyDef::inertia; absent: that of the solid shape. Has no effect on a body of
  /// mass 0.
  void set_inertia(BodyId id, const std::optional<Mat3>& inertia);
  /// BodyDef::motion_locks. A change wakes the body, and velocities of a movable body along or
  /// about the locked axes become 0. Has no effect on an immovable body. @throws InvalidArgument
  /// also if the solver is worst_first
  MotionLocks motion_locks(BodyId id) const;
  void set_motion_locks(BodyId id, const MotionLocks& locks);
  std::uint64_t user_data(BodyId id) const;
  void set_user_data(BodyId id, std::uint64_t user_data);

  /// BodyDef::sensor. @throws InvalidArgument for an unknown id, as do the functions of filters
  bool sensor(BodyId id) const;
  CollisionFilter filter(BodyId id) const;
  /// Replaces the filter from the next step on. A change wakes the body and the bodies in contact
  /// with it.
  void set_filter(BodyId id, const CollisionFilter& filter);
  /// Whether the two bodies do not collide, whatever their filters. The order has no effect.
  bool pair_ignored(BodyId a, BodyId b) const;
  /// Adds the pair to the ignored pairs or removes it, from the next step on; the removal of a body
  /// removes its pairs. A change wakes both bodies and the bodies in contact with them.
  /// @throws InvalidArgument also if both are the same body
  void set_pair_ignored(BodyId a, BodyId b, bool ignored);

  /// Adds a joint, which acts from the next step on, and wakes its bodies. Contacts between the two
  /// bodies end unless the joint has collide_connected. Joints are removed with their bodies.
  /// @throws InvalidArgument, as do all functions of joints, for an unknown id or a field out of
  ///   its range; if both bodies are the same or have mass 0; if the solver is worst_first
  JointId add_joint(const Joint& joint);
  /// Removes a joint and wakes its bodies.
  void remove_joint(JointId id);
  /// Whether the id is of a joint of this world.
  bool contains_joint(JointId id) const noexcept;
  /// Joints in the order of their indices. Valid until a joint or a body is added or removed.
  std::span<const JointId> joints() const;
  /// Valid until a joint or a body is added or removed.
  const Joint& joint(JointId id) const;
  /// Replaces a joint by one of the same type and bodies, for example with another length or
  /// another spring. Wakes its bodies.
  void set_joint(JointId id, const Joint& joint);
  /// The joint after the last step. The length is computed from the current states of the bodies;
  /// the force is that of the last step.
  JointState joint_state(JointId id) const;

  /// Applies a force [N] at the centre of mass or at a point in the world [m], or a torque [N m],
  /// in the next step. Vectors are in world axes. Several calls add up. Wakes the body (erratum
  /// E29); has no effect on a body of mass 0 (erratum E19).
  /// @throws InvalidArgument for an unknown id or a non-finite value
  void apply_force(BodyId id, const Vec3& force);
  void apply_force_at_point(BodyId id, const Vec3& force, const Vec3& point);
  void apply_torque(BodyId id, const Vec3& torque);

  /// Applies an impulse [N s] at the centre of mass or at a point in the world [m], or an angular
  /// impulse [N m s]: changes the velocities of the body at once, so that state() returns the new
  /// ones. Vectors are in world axes. Wakes the body; has no effect on a body of mass 0. In a world
  /// on a GPU, copies the motion of all bodies to the host, if no call since the step has done it.
  /// @throws InvalidArgument for an unknown id, a non-finite value, or if a velocity would not
  /// be finite; the body is then unchanged
  void apply_impulse(BodyId id, const Vec3& impulse);
  void apply_impulse_at_point(BodyId id, const Vec3& impulse, const Vec3& point);
  void apply_angular_impulse(BodyId id, const Vec3& impulse);

  /// Adds a force that acts in every step, either one of force.hpp or a user-defined one; wakes all
  /// bodies. Forces act in the order of their addition. A force of force.hpp has no effect after
  /// its body is removed. A force must not call its World. In a world on a GPU, forces of force.hpp
  /// act there; with a user-defined force, each step copies the motion of all bodies to the host.
  /// @throws InvalidArgument if a force of force.hpp has an invalid field or an unknown body
  template <Force F>
  ForceId add_force(F force) {
    if constexpr (CheckedForce<F>) force.validate(force_context());
    return add_any(std::move(force));
  }
  /// Reference to the force, to change its parameters: world.force<AeroControl>(id).control = 1.
  /// The reference is valid until the force is removed. A change is not validated and wakes no
  /// body; call wake() for sleeping bodies that it must affect.
  /// @throws InvalidArgument if the id is unknown or of a force of another type
  template <Force F>
  F& force(ForceId id) {
    if (F* found = any_force(id).template target<F>()) return *found;
    throw InvalidArgument("force " + std::to_string(id.number) + " is of another type");
  }
  /// Removes a force and wakes all bodies. @throws InvalidArgument for an unknown id
  void remove_force(ForceId id);
  /// Forces in the order in which they act. Valid until one is added or removed.
  std::span<const ForceId> forces() const;

  /// Adds a contact generator, which is called in every step; wakes all bodies. Generators act in
  /// the order of their addition. A generator must not call its World.
  template <ContactGenerator G>
  ContactGeneratorId add_contact_generator(G generator) {
    return add_any_generator(std::move(generator));
  }
  /// Reference to the generator, to change its parameters. The reference is valid until the
  /// generator is removed. A change wakes no body.
  /// @throws InvalidArgument if the id is unknown or of a generator of another type
  template <ContactGenerator G>
  G& contact_generator(ContactGeneratorId id) {
    if (G* found = any_generator(id).template target<G>()) return *found;
    throw InvalidArgument("contact generator " + std::to_string(id.number) + " is of another type");
  }
  /// Removes a generator and wakes all bodies. @throws InvalidArgument for an unknown id
  void remove_contact_generator(ContactGeneratorId id);
  /// Generators in the order in which they act. Valid until one is added or removed.
  std::span<const ContactGeneratorId> contact_generators() const;

  /// The first hit of a ray; among bodies at the same distance, the one with the lowest index.
  /// A ray does not hit the back of a one-sided triangle. Queries include sleeping and immovable
  /// bodies and sensors, and ignore collision filters. They use a bounding-volume tree and take
  /// O(log bodies) time for usual scenes, plus the time of the results. The first query after a
  /// step, and after a body was added, removed or moved by set_state(), builds the tree in
  /// O(bodies) time, about 20 ns per body; concurrent queries wait for it. Half-spaces and planes
  /// are not in the tree and are always tested.
  /// @throws InvalidArgument for a field of the ray that is out of its range; std::bad_alloc
  std::optional<RayHit> cast_ray(const Ray& ray, const BodyFilter& filter = {}) const;
  /// All hits of a ray, sorted by distance, then by index; one hit per body.
  /// @throws as cast_ray()
  std::vector<RayHit> cast_ray_through(const Ray& ray, const BodyFilter& filter = {}) const;
  /// The first body that a solid touches while it moves along a line; among bodies at the same
  /// fraction, the one with the lowest index. Bodies that the solid overlaps at the start are hit
  /// at the fraction 0; exact contact counts. As for contacts, a one-sided triangle is hit if the
  /// centre of the solid starts in front of it, and a plane from the side where the centre starts.
  ///
  /// The gap at the fraction of a hit is below 10^-6 (in double 10^-13) of the sizes of both shapes
  /// and of the translation. Without a hit, the solid does not come deeper into a body than that,
  /// unless it starts in a mesh, whose triangles it overlaps without contacts.
  /// @throws InvalidArgument for a shape, position, orientation or translation that is out of its
  ///   range; std::bad_alloc
  std::optional<ShapeHit> cast_shape(const ShapeCast& cast, const BodyFilter& filter = {}) const;
  /// All bodies that a moving solid touches, sorted by fraction, then by index; one hit per body.
  /// @throws as cast_shape()
  std::vector<ShapeHit> cast_shape_through(const ShapeCast& cast,
                                           const BodyFilter& filter = {}) const;
  /// The body that is closest to a point or a solid; among bodies at the same distance, the one
  /// with the lowest index. The distance of a body is that of its closest part, as closest_points()
  /// (collide.hpp) computes it. Bodies that the solid overlaps have negative distances, so the
  /// deepest one is closest. As for contacts, a one-sided triangle counts if the centre of the
  /// solid is in front of it, and a plane from the side of the centre. The depth in a mesh is that
  /// of the deepest contact with a triangle, or 0 if there is none.
  /// @throws InvalidArgument for a shape, position, orientation or distance that is out of its
  ///   range; std::bad_alloc
  std::optional<BodyDistance> closest_body(const DistanceQuery& query,
                                           const BodyFilter& filter = {}) const;
  /// All bodies up to the distance of a query, sorted by distance, then by index.
  /// @throws as closest_body()
  std::vector<BodyDistance> bodies_within(const DistanceQuery& query,
                                          const BodyFilter& filter = {}) const;
  /// Bodies that overlap a solid, in the order of bodies(). Exact contact counts; the arithmetic is
  /// that of contacts().
  /// @param position [m], of the origin of the shape's axes
  /// @param filter called for the bodies that overlap
  /// @throws InvalidArgument for a shape, position or orientation that is invalid for a body;
  ///   std::bad_alloc
  std::vector<BodyId> overlapping(const SolidShape& shape, const Vec3& position,
                                  const Quat& orientation = {},
                                  const BodyFilter& filter = {}) const;

  /// Copies all data that affect the following steps: bodies, joints, ids, ignored pairs, settings,
  /// sleep, accumulated forces, contacts with their impulses, and forces of force.hpp. Depends on
  /// the state only. User-defined forces and contact generators are recorded by id.
  /// @throws OutOfMemory, DeviceError
  Snapshot snapshot() const;
  /// Replaces the state. All following steps have the bits of the steps after snapshot(), on any
  /// machine, regardless of the WorldSettings and the previous state of this world. Spans and
  /// references of this world become invalid. Ids are those of the snapshot; later ids become
  /// unknown and will be reused. contacts() are those of the snapshot. contact_events() is empty
  /// until the next step, which has the same events as without the restoration.
  ///
  /// Forces of force.hpp are restored with their parameters; references from force() remain valid
  /// if the snapshot has a force of the same id and type. User-defined forces and contact
  /// generators are not stored: this world must have them with the same ids, and they are
  /// unchanged. Another process has the same ids if it has added all forces and generators in the
  /// same order.
  /// @throws InvalidSnapshot if the bytes are not of snapshot() in this format and precision, or
  ///   the user-defined callbacks differ; OutOfMemory; InvalidArgument without thesis::enable().
  ///   The world is then unchanged.
  void restore(const Snapshot& snapshot);

  std::uint64_t steps() const;  ///< number of completed steps, without undone ones
  double time() const;          ///< [s], completed steps times dt
  /// Contacts of the last step: those at its start, and with Solver::soft_step also those that
  /// began during the step and pushed the bodies apart. Three consecutive lists:
  ///   - contacts of two spheres (bodies or parts of compounds), sorted by (a.index, b.index);
  ///   - other detected contacts, in the same order;
  ///   - contacts of contact generators, in the order of the generators. Detected contacts with the
  ///   same a and b are sorted by the part of a, then by the part of b, spheres before boxes;
  ///   contact points of the same two parts have the order of their pair test. Contacts that began
  ///   during the step follow. Empty after a failed step, and after bodies were added or removed.
  ///   Valid until a body is added or removed, or until the next step. The first call after a step
  ///   builds the list.
  /// @throws std::bad_alloc
  std::span<const Contact> contacts() const;
  /// Begin, stay and end events of the pairs of bodies in the last step. Contacts of contact
  /// generators have no events. Sorted by (a.index, b.index); if a new body reuses the index of a
  /// removed one, the end event of the old pair comes first. Begin and stay events have the values
  /// of contacts(), end events those of contacts() after the step before. Sleeping bodies stay in
  /// contact. The contacts of a removed body end in the next step. The list is empty after a failed
  /// step; the next successful step compares with the last successful one. Valid until the next
  /// step, even if bodies are added or removed while the list is read. The first call after a step
  /// computes the list.
  /// @throws std::bad_alloc
  std::span<const ContactEvent> contact_events() const;
  /// The pairs of bodies that hit each other in the last step, one event for each, sorted by
  /// (a.index, b.index). Contacts of sensors and of contact generators have no events. The speed is
  /// that before the forces and contacts of the step, so a body that rests or slides has none; a
  /// pair that is pressed together again after a rebound has another event. Empty with
  /// Solver::worst_first, after restore() until the next step, after a failed step, and unless
  /// WorldSettings::hit_speed is finite. Valid like contact_events(). The first call after a step
  /// computes the list.
  /// @throws std::bad_alloc, DeviceError
  std::span<const HitEvent> hit_events() const;
  /// Forces of the contact points that push the bodies apart at the end of the last step, including
  /// those of contact generators: first between two spheres, then all others, both sorted by
  /// (a.index, b.index). Impacts are not included: a point that pushed in the step but not in its
  /// last substep has no force. Sleeping bodies keep their forces. Empty with Solver::worst_first,
  /// after restore() until the next step, and whenever contacts() is. Valid like contacts(). The
  /// first call after a step makes the list.
  /// @throws std::bad_alloc, DeviceError
  std::span<const ContactForce> contact_forces() const;
  /// state_hash() of states().
  std::uint64_t state_hash() const;
  /// Name and settings of the world, as a Scene without bodies, joints and ignored pairs; restore()
  /// replaces them.
  const Scene& settings() const;

 private:
  ForceContext force_context();
  ForceId add_any(std::function<void(ForceContext&)> force);
  std::function<void(ForceContext&)>& any_force(ForceId id);
  ContactGeneratorId add_any_generator(std::function<void(ContactContext&)> generator);
  std::function<void(ContactContext&)>& any_generator(ContactGeneratorId id);

  struct Impl;
  friend struct WorldAccess;
  std::unique_ptr<Impl> impl_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
