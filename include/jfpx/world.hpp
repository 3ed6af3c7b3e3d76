/// The native engine: a world of rigid bodies with its own step (thesis 4.3).
#pragma once

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

/// Algorithm that finds the pairs of touching bounds. All of them give the same contacts, bit for
/// bit. Queries (World::cast_ray() and others) do not use it.
enum class BroadPhase : std::uint8_t {
  cells,        ///< the search of the sphere collider, as its options select
  hierarchy,    ///< the thesis' tree of bounding spheres (4.4.5); the collider tests its pairs
  brute_force,  ///< the collider tests every pair; a reference for tests
};

struct WorldSettings {
  /// Device and algorithm that find sphere contacts. The rest of a step runs in the calling thread.
  SphereColliderOptions collider;
  BroadPhase broad_phase = BroadPhase::cells;
};

/// One contact point of two bodies. Boxes that touch along a face have several points, and so have
/// compounds. Body `a` is chosen as follows: of two spheres, the one with the lower index; where a
/// sphere meets a box, half-space or plane, the sphere; otherwise the movable body if only one is
/// movable, else the body with the lower index.
struct Contact {
  BodyId a, b;
  Vec3 normal;           ///< [-], unit, from b to a
  Vec3 point;            ///< [m], world, the middle of the overlap
  Real distance = 0;     ///< [m], <= 0: minus the penetration
  Real friction = 0;     ///< [-], >= 0, of the pair
  Real restitution = 0;  ///< [-], in [0, 1], of the pair
  friend bool operator==(const Contact&, const Contact&) = default;
};

enum class ContactPhase : std::uint8_t {
  begin,  ///< the bodies touch, and did not touch after the previous step
  stay,   ///< the bodies touch, and touched after the previous step
  end     ///< the bodies do not touch, and touched after the previous step
};

/// Change of the contact between two bodies in a step. At most one of them is immovable.
struct ContactEvent {
  ContactPhase phase = ContactPhase::begin;
  BodyId a, b;  ///< a.index < b.index; the bodies of an end event may have been removed
  std::uint32_t contacts = 0;  ///< number of contact points of the two bodies, > 0
  Vec3 normal;                 ///< [-], unit, from b to a: of the first of the deepest points
  Vec3 point;                  ///< [m], world: of the same point
  Real distance = 0;           ///< [m], <= 0: of the same point
  friend bool operator==(const ContactEvent&, const ContactEvent&) = default;
};

/// Result of one step. Times are wall-clock times.
struct StepReport {
  std::uint64_t step = 0;                ///< number of the last completed step, from 1
  std::uint64_t contacts = 0;            ///< contacts found
  std::uint64_t sphere_contacts = 0;     ///< of these, contacts between two spheres
  std::uint64_t generated_contacts = 0;  ///< contacts made by contact generators, in addition
  std::uint64_t position_iterations = 0;
  std::uint64_t velocity_iterations = 0;
  bool iterations_exhausted = false;  ///< a solver loop stopped at its limit with work left
  /// A value of a body is no longer finite, or the body has left the world; the step was undone.
  /// Check this field: no further step takes place until that body is removed or moved.
  bool non_finite = false;
  BodyId non_finite_body;                                  ///< the first such body
  std::uint32_t awake = 0;                                 ///< movable bodies awake after the step
  Backend backend = Backend::cpu;                          ///< device that found sphere contacts
  SphereAlgorithm algorithm = SphereAlgorithm::automatic;  ///< algorithm that found them
  ChoiceReason choice = ChoiceReason::fixed;               ///< reason for the two above
  std::string device_failure;  ///< error of a device that the CPU replaced in this step, or empty
  double integrate_ms = 0, detect_ms = 0, resolve_ms = 0, total_ms = 0;
};

/// Rigid bodies and their motion. Const functions may run concurrently with each other; every other
/// function excludes all other calls. Steps are deterministic to the last bit.
class JFPX_API World {
 public:
  /// Validates the scene. Half-spaces and planes must be immovable.
  /// @throws InvalidScene, BackendUnavailable, OutOfMemory; InvalidArgument for a bad setting
  explicit World(const Scene& scene, const WorldSettings& settings = {});
  /// The same with sphere contacts from the given collider, which may be a user's implementation.
  /// @throws InvalidArgument if it is null; InvalidScene, OutOfMemory
  World(const Scene& scene, std::unique_ptr<SphereCollider> collider,
        BroadPhase broad_phase = BroadPhase::cells);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// Adds a body. @throws InvalidScene if the definition is bad. This and all other functions that
  ///   add something throw std::bad_alloc without a change. Removal needs no memory.
  BodyId add(const BodyDef& body);
  /// Removes a body and wakes the bodies in contact with it.
  /// @throws InvalidArgument if the id is not of a living body of this world
  void remove(BodyId id);

  /// Advances the world by the dt of the scene: forces, integration, detection, resolution. Physics
  /// throws no exceptions: when a value is no longer finite, or a coordinate exceeds
  /// kMaxCoordinate, the step is undone and reported. Further steps end in the same way until the
  /// cause is removed or gets another state.
  /// @throws OutOfMemory, DeviceError and the exceptions of forces and contact generators; the
  ///   state is then as before the step
  StepReport step();

  /// Living bodies in the order of their indices. Valid until a body is added or removed.
  std::span<const BodyId> bodies() const;
  /// Whether the body lives in this world.
  bool contains(BodyId id) const noexcept;
  /// The living body with a given BodyId::index.
  /// @throws InvalidArgument if there is none, or no body ever had that index
  BodyId body_at(std::uint32_t index) const;
  /// Valid until a body is added or removed. @throws InvalidArgument for an unknown id
  const Shape& shape(BodyId id) const;
  /// States in the order of bodies().
  std::vector<BodyState> states() const;
  /// @throws InvalidArgument for an unknown id
  BodyState state(BodyId id) const;
  /// Replaces the state of motion, and wakes the body and the bodies in contact with it. An
  /// immovable body is moved and stays at rest; a kinematic body continues with the new velocities.
  /// @throws InvalidArgument for an unknown id or a value out of the range of validate()
  void set_state(BodyId id, const BodyState& state);
  /// Of the bodies of mass 0, only kinematic ones are awake, while they move.
  /// @throws InvalidArgument for an unknown id, as do mass() and inverse_inertia()
  bool awake(BodyId id) const;
  /// Wakes the body, as a force does; a body of mass 0 stays as it is. The next step also wakes the
  /// bodies in contact with it.
  /// @throws InvalidArgument for an unknown id
  void wake(BodyId id);
  Real mass(BodyId id) const;  ///< [kg]; 0: immovable or kinematic
  /// [1/(kg m^2)], world axes, about the centre of mass; zero for mass 0.
  Mat3 inverse_inertia(BodyId id) const;
  /// Acceleration of the centre of mass in the last step [m/s^2]: constant part and forces, without
  /// contacts and damping. @throws InvalidArgument for an unknown id
  Vec3 last_acceleration(BodyId id) const;

  /// Adds to the force [N] at the centre of mass, or at a point of the world [m], and to the torque
  /// [N m], of the next step; in world axes. Wakes the body (erratum E29); has no effect on an
  /// immovable body (erratum E19). @throws InvalidArgument for an unknown id or a non-finite value
  void apply_force(BodyId id, const Vec3& force);
  void apply_force_at_point(BodyId id, const Vec3& force, const Vec3& point);
  void apply_torque(BodyId id, const Vec3& torque);

  /// Adds a force that acts in every step, either one of force.hpp or a user's own; wakes all
  /// bodies. Forces act in the order of their addition. A force of force.hpp has no effect after
  /// its body is removed. A force must not call its World.
  /// @throws InvalidArgument if a force of force.hpp has a bad field or an unknown body
  template <Force F>
  ForceId add_force(F force) {
    if constexpr (CheckedForce<F>) force.validate(force_context());
    return add_any(std::move(force));
  }
  /// The force itself, for changes: world.force<AeroControl>(id).control = 1. Its address is valid
  /// until it is removed. A change is not validated and wakes no body; call wake() for sleeping
  /// bodies that it must affect.
  /// @throws InvalidArgument if the id is unknown or of a force of another type
  template <Force F>
  F& force(ForceId id) {
    if (F* found = any_force(id).template target<F>()) return *found;
    throw InvalidArgument("force " + std::to_string(id.number) + " is of another type");
  }
  /// Wakes all bodies. @throws InvalidArgument for an unknown id
  void remove_force(ForceId id);
  /// Forces in the order in which they act. Valid until one is added or removed.
  std::span<const ForceId> forces() const;

  /// Adds a contact generator, which is called in every step; wakes all bodies. Generators act in
  /// the order of their addition. A generator must not call its World.
  template <ContactGenerator G>
  ContactGeneratorId add_contact_generator(G generator) {
    return add_any_generator(std::move(generator));
  }
  /// The generator itself, for changes, which wake no body. Its address is valid until it is
  /// removed.
  /// @throws InvalidArgument if the id is unknown or of another type
  template <ContactGenerator G>
  G& contact_generator(ContactGeneratorId id) {
    if (G* found = any_generator(id).template target<G>()) return *found;
    throw InvalidArgument("contact generator " + std::to_string(id.number) + " is of another type");
  }
  /// Wakes all bodies. @throws InvalidArgument for an unknown id
  void remove_contact_generator(ContactGeneratorId id);
  /// Generators in the order in which they act. Valid until one is added or removed.
  std::span<const ContactGeneratorId> contact_generators() const;

  /// The first hit of a ray; of bodies at the same distance, the one with the lowest index. Every
  /// query tests all bodies, asleep or not, immovable or not: O(bodies), a few nanoseconds each.
  /// @throws InvalidArgument for a field of the ray that is out of its range
  std::optional<RayHit> cast_ray(const Ray& ray, const BodyFilter& filter = {}) const;
  /// All hits of a ray, sorted by distance, then by index; one hit per body.
  std::vector<RayHit> cast_ray_through(const Ray& ray, const BodyFilter& filter = {}) const;
  /// Bodies that overlap a sphere or a box, in the order of bodies(). An exact touch counts, as for
  /// contacts, and the arithmetic is that of contacts.
  /// @throws InvalidArgument for a size, position or orientation that no body could have
  std::vector<BodyId> overlapping(const Sphere& sphere, const Vec3& centre) const;
  std::vector<BodyId> overlapping(const Box& box, const Vec3& centre,
                                  const Quat& orientation = {}) const;

  double time() const;  ///< [s], completed steps times dt
  /// Contacts of the last step, in this order: contacts of two spheres (bodies or parts of
  /// compounds), by the indices of (a, b); then all others, by the same; then those of contact
  /// generators, in the order of the generators. Contacts with the same a and b are sorted by the
  /// part of a, then by the part of b, spheres before boxes; the points of two parts keep the order
  /// of their test. Empty after a failed step, and after bodies were added or removed. Valid until
  /// then, or until the next step.
  std::span<const Contact> contacts() const;
  /// Pairs of bodies that began to touch, stay in contact or ceased to touch in the last step, from
  /// detected contacts only, not generated ones. Sorted by (a.index, b.index); where a new body has
  /// the index of an old one, the end of the old pair comes first. An event describes the contact
  /// as detected, before it was resolved; an end event describes the last detection. Sleeping
  /// bodies stay in contact. The contacts of a body that is removed or moved end in the next step.
  /// Empty after a failed step; the next successful step compares with the last successful one. The
  /// list is valid until the next step, even if bodies are added or removed while it is read.
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
