/// The native engine: a world of rigid bodies that steps by itself (thesis 4.3).
#pragma once

#include <jfpx/broad_phase.hpp>
#include <jfpx/contact_generator.hpp>
#include <jfpx/error.hpp>
#include <jfpx/force.hpp>
#include <jfpx/query.hpp>
#include <jfpx/scene.hpp>
#include <jfpx/sphere_collider.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

struct WorldSettings {
  SphereColliderOptions collider;              ///< who finds sphere contacts, and how; what else
                                               ///< a step does takes one thread
  BroadPhase broad_phase = BroadPhase::cells;  ///< who finds which bounds touch
};

/// One contact of the native engine; boxes that touch along a face have several, and so have
/// compounds. Of two spheres `a` has the lower index; `a` is the sphere where a sphere meets a
/// box, half-space or plane, else the movable one where the other is not, else the lower index.
struct Contact {
  /// BodyId::index, for World::body_at(); the place in the scene until a body is removed
  std::uint32_t a = 0, b = 0;
  Vec3 normal;           ///< [-], unit, from b to a
  Vec3 point;            ///< [m], world, the middle of the overlap
  Real distance = 0;     ///< [m], <= 0: minus the penetration
  Real friction = 0;     ///< [-], >= 0, of the pair
  Real restitution = 0;  ///< [-], in [0, 1], of the pair
  friend bool operator==(const Contact&, const Contact&) = default;
};

enum class ContactPhase : std::uint8_t {
  begin,  ///< the bodies touch and did not after the step before
  stay,   ///< they touch and did
  end     ///< they don't touch and did
};

/// What a step found out about two bodies; an immovable one may be among them, two never.
struct ContactEvent {
  ContactPhase phase = ContactPhase::begin;
  BodyId a, b;                 ///< a.index < b.index; at an end, they may have been removed
  std::uint32_t contacts = 0;  ///< how many contacts the bodies have, > 0
  Vec3 normal;                 ///< [-], unit, from b to a: of the first of the deepest contacts
  Vec3 point;                  ///< [m], world: of the same contact
  Real distance = 0;           ///< [m], <= 0: of the same contact
  friend bool operator==(const ContactEvent&, const ContactEvent&) = default;
};

/// What one step did. Times are wall clock.
struct StepReport {
  std::uint64_t step = 0;                ///< number of the last step that was completed, from 1
  std::uint64_t contacts = 0;            ///< contacts found
  std::uint64_t sphere_contacts = 0;     ///< of these, between two spheres
  std::uint64_t generated_contacts = 0;  ///< made by contact generators, besides those found
  std::uint64_t position_iterations = 0;
  std::uint64_t velocity_iterations = 0;
  bool iterations_exhausted = false;  ///< a loop stopped at its limit with work left
  /// A body left the finite numbers; the state is as before the step. Look at it: until that body
  /// is removed or put elsewhere, no step happens any more.
  bool non_finite = false;
  BodyId non_finite_body;                                  ///< the first such body
  std::uint32_t awake = 0;                                 ///< movable bodies awake after the step
  Backend backend = Backend::cpu;                          ///< who found sphere contacts
  SphereAlgorithm algorithm = SphereAlgorithm::automatic;  ///< and how
  ChoiceReason choice = ChoiceReason::fixed;               ///< and why they did
  std::string device_failure;  ///< why x86 took over from a device in this step; else empty
  double integrate_ms = 0, detect_ms = 0, resolve_ms = 0, total_ms = 0;
};

/// Rigid bodies and their motion. One owner: const functions may run concurrently with each other,
/// everything else excludes all other calls. Steps are deterministic to the last bit.
class JFPX_API World {
 public:
  /// Validates the scene. Half-spaces and planes must be immovable.
  /// @throws InvalidScene, BackendUnavailable, OutOfMemory; InvalidArgument for a bad setting;
  ///   BuildMismatch (build.hpp)
  explicit World(const Scene& scene, const WorldSettings& settings = {});
  /// The same with sphere contacts from the given collider, which may be the caller's own.
  /// @throws InvalidArgument if it is null, InvalidScene, OutOfMemory
  World(const Scene& scene, std::unique_ptr<SphereCollider> collider,
        BroadPhase broad_phase = BroadPhase::cells);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// Adds a body. @throws InvalidScene if the definition is bad; std::bad_alloc, here and wherever
  ///   something is added: nothing has changed then. To remove needs no memory.
  BodyId add(const BodyDef& body);
  /// Takes a body out and wakes what touched it.
  /// @throws InvalidArgument if the id is not of a living body of this world.
  void remove(BodyId id);

  /// One step of the scene's dt: forces, integrate, detect, resolve. Throws nothing for physics.
  /// When a value stops being finite, or a coordinate passes kMaxCoordinate, the step is undone and
  /// reported; so are further steps, until the cause is removed or given another state.
  /// @throws OutOfMemory, DeviceError, what a force throws; the state is then as before the step.
  StepReport step();

  /// Living bodies in the order of their indices. Valid until a body is added or removed.
  std::span<const BodyId> bodies() const;
  /// Whether the body lives in this world.
  bool contains(BodyId id) const noexcept;
  /// The living body of an index, as contacts name it.
  /// @throws InvalidArgument if there is none, or no body ever had that index.
  BodyId body_at(std::uint32_t index) const;
  /// @throws InvalidArgument for an unknown id. Valid until a body is added or removed.
  const Shape& shape(BodyId id) const;
  /// States in the order of bodies().
  std::vector<BodyState> states() const;
  /// @throws InvalidArgument for an unknown id.
  BodyState state(BodyId id) const;
  /// Replaces the moving state, wakes the body and what touched it. An immovable body is put to
  /// its new place and stays at rest; a kinematic one goes on with the new velocities.
  /// @throws InvalidArgument for an unknown id or a value out of the range of validate().
  void set_state(BodyId id, const BodyState& state);
  /// Of mass 0, only kinematic bodies are awake, while they move.
  /// @throws InvalidArgument for an unknown id, as do mass() and inverse_inertia().
  bool awake(BodyId id) const;
  /// Wakes the body, as a push does; one of mass 0 stays as it is. Whom it then touches wakes too.
  /// @throws InvalidArgument for an unknown id.
  void wake(BodyId id);
  Real mass(BodyId id) const;  ///< [kg]; 0: immovable or kinematic
  /// [1/(kg m^2)], world axes, about the centre of mass; zero for mass 0.
  Mat3 inverse_inertia(BodyId id) const;
  /// Acceleration of the centre of mass that the last step used [m/s^2]: constant part and forces,
  /// without contacts and damping. @throws InvalidArgument for an unknown id.
  Vec3 last_acceleration(BodyId id) const;

  /// Adds to the force [N] at the centre of mass, or at a point of the world [m], and to the torque
  /// [N m], of the coming step; in world axes. Wakes the body (erratum E29); an immovable one stays
  /// as it is (erratum E19). @throws InvalidArgument for an unknown id or a value not finite.
  void apply_force(BodyId id, const Vec3& force);
  void apply_force_at_point(BodyId id, const Vec3& force, const Vec3& point);
  void apply_torque(BodyId id, const Vec3& torque);

  /// Adds a force that acts in every step, from force.hpp or of one's own; wakes all bodies.
  /// Forces act in the order in which they were added. A force of force.hpp whose body is removed
  /// does nothing from then on. A force must not call back into its World.
  /// @throws InvalidArgument if a force of force.hpp has a bad field or an unknown body.
  template <Force F>
  ForceId add_force(F force) {
    if constexpr (CheckedForce<F>) force.validate(force_context());
    return add_any(std::move(force));
  }
  /// The force, to steer it: world.force<AeroControl>(id).control = 1. Stays where it is until it
  /// is removed. A change is not validated and wakes nobody: call wake() for sleeping bodies that
  /// must feel it.
  /// @throws InvalidArgument if the id is unknown or of a force of another type.
  template <Force F>
  F& force(ForceId id) {
    if (F* found = any_force(id).template target<F>()) return *found;
    throw InvalidArgument("force " + std::to_string(id.number) + " is of another type");
  }
  /// Wakes all bodies. @throws InvalidArgument for an unknown id.
  void remove_force(ForceId id);
  /// In the order in which they act. Valid until one is added or removed.
  std::span<const ForceId> forces() const;

  /// Adds a contact generator, which is called in every step; wakes all bodies. Generators act in
  /// the order in which they were added. One must not call back into its World.
  template <ContactGenerator G>
  ContactGeneratorId add_contact_generator(G generator) {
    return add_any_generator(std::move(generator));
  }
  /// The generator, to change it, which wakes nobody. Stays where it is until it is removed.
  /// @throws InvalidArgument if the id is unknown or of another type.
  template <ContactGenerator G>
  G& contact_generator(ContactGeneratorId id) {
    if (G* found = any_generator(id).template target<G>()) return *found;
    throw InvalidArgument("contact generator " + std::to_string(id.number) + " is of another type");
  }
  /// Wakes all bodies. @throws InvalidArgument for an unknown id.
  void remove_contact_generator(ContactGeneratorId id);
  /// In the order in which they act. Valid until one is added or removed.
  std::span<const ContactGeneratorId> contact_generators() const;

  /// What a ray hits first; of bodies at the same distance, the one with the lowest index. Each
  /// query looks at every body, asleep or not, immovable or not: O(bodies), a few nanoseconds each.
  /// @throws InvalidArgument for a field of the ray that is out of its range
  std::optional<RayHit> cast_ray(const Ray& ray, const BodyFilter& filter = {}) const;
  /// All that it hits, by distance, then index: one hit a body.
  std::vector<RayHit> cast_ray_through(const Ray& ray, const BodyFilter& filter = {}) const;
  /// Bodies that a sphere or a box touches, in the order of bodies(). An exact touch counts, as it
  /// does for contacts, and with the same arithmetic.
  /// @throws InvalidArgument for a size, place or orientation that no body could have
  std::vector<BodyId> overlapping(const Sphere& sphere, const Vec3& centre) const;
  std::vector<BodyId> overlapping(const Box& box, const Vec3& centre,
                                  const Quat& orientation = {}) const;

  double time() const;  ///< [s], completed steps times dt
  /// Contacts of the last step, in order: where spheres, or spheres of compounds, touch each
  /// other, by (a, b); then all others by (a, b); then those of contact generators in their order.
  /// Those of the same a and b come by a's part, then b's part, spheres before boxes; the points of
  /// two parts in the order of their test. None after a failed step, or when bodies were added or
  /// removed since. Valid until then, or until the next step.
  std::span<const Contact> contacts() const;
  /// Who touched whom in the last step, who began to and who ended, of contacts that were found and
  /// not generated; sorted by (a.index, b.index);
  /// where an index has got a new body, the end of the old pair comes first. A contact is as the
  /// step found it, before it was resolved; at an end, as it was last found. Sleepers stay in
  /// contact. A body that is removed, or put elsewhere, ends its contacts in the next step. None
  /// after a failed step; the next one that succeeds compares with the last that did. The list
  /// stays as it is until the next step, so that bodies may come and go while it is read.
  std::span<const ContactEvent> contact_events() const;
  /// state_hash() of states().
  std::uint64_t state_hash() const;
  const Scene& scene() const;  ///< settings as given; its bodies are those of construction

 private:
  ForceContext force_context();
  ForceId add_any(std::function<void(ForceContext&)> force);
  std::function<void(ForceContext&)>& any_force(ForceId id);
  ContactGeneratorId add_any_generator(std::function<void(ContactContext&)> generator);
  std::function<void(ContactContext&)>& any_generator(ContactGeneratorId id);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
