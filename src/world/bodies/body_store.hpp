/// Storage of a world's bodies: the arrays of body_columns.hpp.
#pragma once

#include <jfpx/scene.hpp>

#include "src/world/bodies/body_view.hpp"
#include "src/world/bodies/id_pool.hpp"
#include "src/world/bodies/ignored_pairs.hpp"

#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

class BinaryReader;
class BinaryWriter;

/// [kg m^2], BodyDef::inertia of the bodies that have one, by body.
using GivenInertia = std::map<std::uint32_t, Mat3>;

/// Owns the bodies and their ids. The arrays have unused slots, so loops over the bodies iterate
/// over ids(), which is sorted by index.
class BodyStore {
 public:
  /// @param dt       [s], length of a step
  /// @param substeps number of substeps of a step
  BodyStore(Real dt, const SleepSettings& sleep, std::uint32_t substeps = 1);

  /// Reserves memory for `bodies` bodies in all, exactly. @throws std::bad_alloc
  void reserve(std::size_t bodies);
  /// @param def must have passed validation
  /// @throws std::bad_alloc; the store is then unchanged
  BodyId add(const BodyDef& def);
  /// What replace() needs memory for.
  struct Replacement {
    Shape shape;
    std::map<std::uint32_t, Mat3> inertia;  ///< of the body, if its inertia is given
  };
  /// @param def must have passed validation @throws std::bad_alloc; the store is then unchanged
  Replacement prepare(std::uint32_t body, const BodyDef& def);
  /// Gives a body another definition. Its id and its ignored pairs remain.
  /// @param prepared result of prepare() for both arguments
  void replace(std::uint32_t body, const BodyDef& def, Replacement prepared) noexcept;
  /// The body in the form that add() accepts.
  BodyDef definition(std::uint32_t body) const;
  /// The index of the body that add() adds next.
  std::uint32_t next_index() const noexcept { return pool_.next_index(); }
  /// @param id of a body in the store
  void remove(BodyId id) noexcept;
  bool contains(BodyId id) const noexcept { return pool_.contains(id); }
  /// Returns the index of a body in the store. @throws InvalidArgument for an unknown id
  std::uint32_t require(BodyId id) const;
  std::span<const BodyId> ids() const noexcept { return pool_.ids(); }
  /// Indices of the bodies that are not immovable, ascending. Valid until a body is added or
  /// removed.
  std::span<const std::uint32_t> mobile() const noexcept;
  /// Number of bodies.
  std::size_t size() const noexcept { return pool_.size(); }
  /// The id of the body that currently has the index.
  BodyId id(std::uint32_t body) const { return pool_.id(body); }
  /// Number of slots; all indices are below it.
  std::size_t capacity() const noexcept { return pool_.capacity(); }
  std::uint32_t movable_count() const noexcept { return movable_count_; }
  /// Whether the solver divides the world into several blocks
  /// (contact_solver/soft_step/blocks.hpp).
  bool has_blocks() const noexcept { return movable_count_ > most_in_one_block.load(); }
  /// soft_step::kMostBodiesInOneBlock; tests set it to a low value.
  static std::atomic<std::uint32_t> most_in_one_block;
  /// Never 0. Changes when a body of mass 0 is added or removed, or set_state() moves an immovable
  /// body.
  std::uint64_t fixed_version() const noexcept { return fixed_version_; }

  /// Writes all bodies, the ids, and the ignored pairs.
  void write(BinaryWriter* writer) const;
  /// Reads what write() has written, into an empty store. The store must not be used if it throws.
  /// @throws InvalidSnapshot; InvalidScene for a body that add() must not receive; std::bad_alloc
  void read(BinaryReader* reader);
  /// Whether a body has a place in the partition into blocks.
  bool has_places() const noexcept;
  /// Writes the places of all bodies.
  void write_places(BinaryWriter* writer) const;
  /// Reads what write_places() has written, after read(). @throws InvalidSnapshot, std::bad_alloc
  void read_places(BinaryReader* reader);
  /// Writes the motion locks of all bodies.
  void write_locks(BinaryWriter* writer) const;
  /// Reads what write_locks() has written, after read(). @throws InvalidSnapshot, std::bad_alloc
  void read_locks(BinaryReader* reader);
  /// Whether a body has the index.
  bool lives(std::uint32_t body) const noexcept { return pool_.is_used(body); }

  JFPX_API BodyState state(std::uint32_t body) const;
  /// Replaces position, orientation and velocities. Wakes a movable body; wakes a kinematic body if
  /// it has a velocity; the velocities of an immovable body remain 0.
  void set_state(std::uint32_t body, const BodyState& state);

  /// Replaces the velocities of a movable body and wakes it. Position and orientation keep their
  /// bits, which set_state() might round.
  void set_velocities(std::uint32_t body, const BodyState& state);

  /// Adds to the force or torque of the next step and wakes the body (erratum E29). Has no effect
  /// on a body of mass 0.
  void apply_force(std::uint32_t body, const Vec3& force);
  void apply_torque(std::uint32_t body, const Vec3& torque);
  /// Wakes a body and sets its mean motion to twice the sleep epsilon, so that a weak force has
  /// time to act. Has no effect on a body of mass 0.
  void wake(std::uint32_t body);
  /// Wakes a movable body and sets its mean motion to that of an awake body in contact with it.
  JFPX_API void wake_by_contact(std::uint32_t sleeper, std::uint32_t awake);
  /// Must be called after a change of the orientation in `moving`.
  JFPX_API void refresh_inertia(std::uint32_t body);

  /// Replaces the mass of a movable body, and its inertia unless that was given. @param mass > 0
  void set_mass(std::uint32_t body, Real mass);
  /// [kg m^2], body axes; zero for mass 0
  Mat3 inertia(std::uint32_t body) const;
  bool inertia_given(std::uint32_t body) const { return given_inertia_.contains(body); }
  /// Allocates the inertia columns of BodyView, which are empty while all bodies are immovable or
  /// balls with the inertia of a solid ball. @throws std::bad_alloc
  void make_inertia_arrays();
  /// Has no effect on a body of mass 0. @param given absent: the inertia of the solid shape
  /// @throws std::bad_alloc; the store is then unchanged
  void set_inertia(std::uint32_t body, const std::optional<Mat3>& given);
  void set_friction(std::uint32_t body, Real friction) { properties_.friction[body] = friction; }
  void set_restitution(std::uint32_t body, Real value) { properties_.restitution[body] = value; }
  /// [m/s^2], without the acceleration by forces
  const Vec3& acceleration(std::uint32_t body) const { return properties_.acceleration[body]; }
  void set_acceleration(std::uint32_t body, const Vec3& value) {
    properties_.acceleration[body] = value;
  }
  Real linear_damping(std::uint32_t body) const { return host_.linear_damping[body]; }
  Real angular_damping(std::uint32_t body) const { return host_.angular_damping[body]; }
  void set_damping(std::uint32_t body, Real linear, Real angular);
  std::uint64_t user_data(std::uint32_t body) const { return host_.user_data[body]; }
  void set_user_data(std::uint32_t body, std::uint64_t value) { host_.user_data[body] = value; }
  const MotionLocks& motion_locks(std::uint32_t body) const {
    return properties_.motion_locks[body];
  }
  bool has_locks(std::uint32_t body) const { return motion_locks(body) != MotionLocks{}; }
  bool any_locks() const { return locked_count_ > 0; }
  /// Has no effect on a body of mass 0. set_velocities() or set_state() must follow: it ends the
  /// motion along locked axes. @throws std::bad_alloc; the store is then unchanged
  void set_motion_locks(std::uint32_t body, const MotionLocks& locks);
  bool sensor(std::uint32_t body) const { return properties_.sensor[body] != 0; }
  bool has_sensors() const { return sensor_count_ > 0; }
  /// Whether a body has rolling or spinning friction.
  bool rolls(std::uint32_t body) const {
    return properties_.rolling_friction[body] > 0 || properties_.spinning_friction[body] > 0;
  }
  bool any_rolls() const { return rolling_count_ > 0; }
  bool has_kinematic_bodies() const { return kinematic_count_ > 0; }
  const CollisionFilter& filter(std::uint32_t body) const { return properties_.filter[body]; }
  void set_filter(std::uint32_t body, const CollisionFilter& filter) noexcept;
  bool pair_ignored(const BodyPair& pair) const noexcept { return ignored_.contains(pair); }
  /// @throws std::bad_alloc; the store is then unchanged
  void set_pair_ignored(const BodyPair& pair, bool ignored);
  /// Replaces the ignored pairs. @throws std::bad_alloc; the store is then unchanged
  void set_ignored_pairs(std::span<const BodyPair> pairs);
  /// Adds or removes a pair of bodies that do not collide because of a joint.
  /// @throws std::bad_alloc; the store is then unchanged
  void set_pair_joined(const BodyPair& pair, bool joined);
  /// Whether the filters let two bodies collide, and they are neither an ignored nor a joined pair.
  bool may_collide(std::uint32_t a, std::uint32_t b) const noexcept {
    return !filters_in_use_ || (jfpx::may_collide(properties_.filter[a], properties_.filter[b]) &&
                                !ignored_.contains({a, b}) && !joined_.contains({a, b}));
  }
  /// Pointers to the arrays. Valid until a body is added or removed, or the ignored pairs change.
  JFPX_API BodyView view() const;
  /// view() without the sorted list of ids, which takes a pass over all slots after a change.
  JFPX_API BodyView view_without_ids() const;
  MotionPointers motion_pointers();

  bool movable(std::uint32_t body) const { return properties_.inverse_mass[body] > 0; }
  bool immovable(std::uint32_t body) const { return !movable(body) && !kinematic(body); }
  bool kinematic(std::uint32_t body) const { return properties_.kinematic[body] != 0; }
  /// Whether a kinematic body is in motion.
  JFPX_API bool has_moving_kinematic_body() const;
  const Shape& shape(std::uint32_t body) const { return host_.shape[body]; }
  Real mass(std::uint32_t body) const { return host_.mass[body]; }
  Real inverse_mass(std::uint32_t body) const { return properties_.inverse_mass[body]; }
  std::span<const Real> inverse_masses() const { return properties_.inverse_mass; }
  Real friction(std::uint32_t body) const { return properties_.friction[body]; }
  Real restitution(std::uint32_t body) const { return properties_.restitution[body]; }
  /// [m]; 0 for a body that is not a sphere, as for compounds
  Real radius(std::uint32_t body) const { return properties_.radius[body]; }
  /// [m], of the bounding sphere about the centre of mass; infinite for half-spaces and planes
  Real extent(std::uint32_t body) const { return properties_.extent[body]; }
  Real dt() const { return dt_; }
  /// World::step() copies the arrays that a step may change before it can fail, so that a failed
  /// step can be undone.
  MotionArrays moving;

 private:
  template <class Visit>
  void for_each_array(const Visit& visit);
  void resize_slots(std::size_t slots);
  void add_slot();
  void put(std::uint32_t body, const BodyDef& def, Replacement prepared) noexcept;
  void derive_properties(std::uint32_t body) noexcept;
  void count_body(std::uint32_t body) noexcept;
  void uncount_body(std::uint32_t body) noexcept;
  void note_mobile(std::uint32_t body) noexcept;
  static bool needs_inertia_arrays(const Shape& shape, Real mass, bool kinematic,
                                   bool inertia_given, const MotionLocks& locks);
  void put_velocities(std::uint32_t body, const BodyState& state);
  Mat3 body_inverse_inertia(std::uint32_t body) const;
  void compute_inertia(std::uint32_t body, const std::optional<Mat3>& given);
  void set_tensor(std::uint32_t body, const Mat3& tensor);
  template <class Archive, class Self>
  static void serialize_body(Archive& archive, Self& self, std::uint32_t body);
  std::vector<bool> read_slots(BinaryReader* reader);
  void read_bodies(BinaryReader* reader, const std::vector<bool>& is_free);
  void read_pairs(BinaryReader* reader);
  void check_body(std::uint32_t body) const;
  void update_filters_in_use() noexcept;

  Real dt_, substep_;
  SleepSettings sleep_;

  PropertyColumns<ArrayColumn> properties_;
  HostArrays host_;
  GivenInertia given_inertia_;
  bool has_inertia_arrays_ = false;  ///< whether `inertia_` is in use
  InertiaColumns<ArrayColumn> inertia_;

  IgnoredPairs ignored_, joined_;
  std::uint32_t filtered_count_ = 0;  ///< number of bodies whose filter is not the default
  bool filters_in_use_ = false;       ///< whether may_collide() may return false

  IdPool<BodyId> pool_;
  Lazy<std::vector<std::uint32_t>> mobile_;
  std::uint64_t fixed_version_ = 1;
  std::uint32_t movable_count_ = 0, kinematic_count_ = 0, sensor_count_ = 0, rolling_count_ = 0;
  std::uint32_t locked_count_ = 0;  ///< number of bodies with motion locks
};

}  // namespace JFPX_ABI
}  // namespace jfpx
