/// Memory of a soft step on a device.
#pragma once

#include <jfpx/cuda/sphere_collider.hpp>

#include "src/contact_solver/soft_step/blocks.hpp"
#include "src/contact_solver/soft_step/contact_lookup.hpp"
#include "src/contact_solver/soft_step/row_setup.hpp"
#include "src/world/contacts/candidate_test.hpp"
#include "src/world/device/body_cells.hpp"
#include "src/world/device/division.hpp"
#include "src/world/device/striped_array.hpp"
#include "src/world/device/tuning.hpp"
#include "src/world/step/islands.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

using soft_step::kBins;
using soft_step::kBodiesPerBlock;

/// The blocks of a world.
struct BlockCounts {
  std::uint32_t places = 0;         ///< end of the places of all movable bodies
  std::uint32_t without_place = 0;  ///< number of movable bodies without a place

  /// Number of blocks of bodies with places, which precede the blocks of the other bodies.
  JFPX_HD std::uint32_t placed() const { return (places + kBodiesPerBlock - 1) / kBodiesPerBlock; }
  JFPX_HD std::uint32_t all() const {
    return placed() + (without_place + kBodiesPerBlock - 1) / kBodiesPerBlock;
  }
  /// First solver index of the bodies without a place, which start a block.
  JFPX_HD std::uint32_t first_without_place() const { return placed() * kBodiesPerBlock; }
  /// Number of solver indices, some of which may be of no body.
  JFPX_HD std::uint32_t indices() const { return first_without_place() + without_place; }
  /// The solver indices of a block.
  JFPX_HD Range indices_of(std::uint32_t block) const {
    const std::uint32_t begin = block * kBodiesPerBlock, end = begin + kBodiesPerBlock;
    return {begin, end < indices() ? end : indices()};
  }
};

/// Where the row of a contact or joint is.
struct RowPlace {
  /// kNone: there is no row. An inner row: kInner, kind and color. Any other row: the number of its
  /// part times kBins + 1, and its bin.
  std::uint16_t code;

  static constexpr std::uint16_t kNone = 0xffff, kInner = 0x8000;
  static_assert(kMostParts * (kBins + 1) < kInner);
  static_assert(soft_step::kRowKinds * soft_step::kColorsPerClass < kNone - kInner);

  JFPX_HD static std::uint16_t inner(soft_step::RowKind kind, std::uint32_t color) {
    return static_cast<std::uint16_t>(kInner + kind * soft_step::kColorsPerClass + color);
  }
  JFPX_HD bool is_row() const { return code != kNone; }
  JFPX_HD bool is_inner() const { return is_row() && code >= kInner; }
  JFPX_HD soft_step::RowKind kind() const {
    return static_cast<soft_step::RowKind>(is_inner() ? (code - kInner) / soft_step::kColorsPerClass
                                                      : code % (kBins + 1) / soft_step::kGroups);
  }
  JFPX_HD std::uint32_t color() const {  ///< of an inner row
    return (code - kInner) % soft_step::kColorsPerClass;
  }
};

/// The rows of a part, sorted by bin, except inner rows.
struct RowBins {
  std::uint32_t begin[kBins + 1];             ///< first row of a bin, and the end
  std::uint32_t first[soft_step::kRowKinds];  ///< the row that has number 0 in its kind
  std::uint32_t crossing_colors;              ///< Counters::crossing_colors
  BlockCounts blocks;                         ///< Counters::blocks
};

/// Bytes of the shared memory of a block that partition() of a team needs.
inline constexpr std::size_t kBytesOfBins = kMostParts * (kBins + 1) * sizeof(std::uint32_t);

/// Capacities of lists whose size is known only on the device. A step that exceeds a capacity does
/// not change the state of the world; the host reserves Counters::needed and repeats the step.
struct Capacity {
  std::uint64_t pairs = 0;       ///< of swept bounds
  std::uint32_t spheres = 0;     ///< contacts of two spheres
  std::uint32_t candidates = 0;  ///< pairs of other sub-shapes, also the capacity of manifolds
  std::uint32_t candidates_of_part = 0;  ///< of a part, if there are several parts
  std::uint32_t points = 0;              ///< of manifolds
  std::uint32_t touches = 0;  ///< points of World::contacts(), except contacts of two spheres
  /// Of a part: rows of manifolds, including contacts of spheres without SphereRow.
  std::uint32_t manifold_rows = 0;
  std::uint32_t row_points = 0;  ///< of a part: points of these rows
  std::uint32_t rows = 0;        ///< of a part: rows of any kind, if there are several parts
  std::uint32_t indices = 0;     ///< solver indices of a world with blocks
  std::uint32_t unused = 0;      ///< instead of padding

  /// Gives each list room for `needed`, if it is not 0, and slack, so that few steps are repeated
  /// while a heap falls: a quarter of the need, but as much as the need for lists of less than half
  /// an item a body.
  /// @param doubles the slack is as much as the need
  void grow(const Capacity& needed, bool doubles, std::size_t bodies) {
    const auto grow_one = [&](auto* capacity, auto count) {
      if (count == 0) return;
      using Count = decltype(count);
      const std::uint64_t need = count, half = bodies / 2;
      const std::uint64_t slack = doubles ? need : std::max(need / 4, std::min(need, half));
      const std::uint64_t most = std::numeric_limits<Count>::max();
      *capacity = std::max(*capacity, static_cast<Count>(std::min(need + slack + 64, most)));
    };
    grow_one(&pairs, needed.pairs);
    grow_one(&spheres, needed.spheres);
    grow_one(&candidates, needed.candidates);
    grow_one(&candidates_of_part, needed.candidates_of_part);
    grow_one(&points, needed.points);
    grow_one(&touches, needed.touches);
    grow_one(&manifold_rows, needed.manifold_rows);
    grow_one(&row_points, needed.row_points);
    grow_one(&rows, needed.rows);
    grow_one(&indices, needed.indices);
  }
};

/// Sizes of the contact set of a step, and of its list of touches.
struct ContactSizes {
  std::uint32_t spheres = 0, manifolds = 0, points = 0, touches = 0;
};

/// Progress of the steps, which later steps and the host read; the host may have enqueued many
/// steps. A step that cannot be completed, and all later ones, have no effect until the host
/// repeats them.
struct Progress {
  std::uint64_t completed = 0;  ///< number of complete steps since the upload
  std::uint64_t deferred = 0;   ///< number of steps without effect since the last complete one
  std::uint64_t offset = 0;     ///< World::steps() minus `completed`
  std::uint32_t started = 0;    ///< 1: SavedColumns belong to an incomplete step
  std::uint32_t held = 0;       ///< 1: the host has changes that must precede the next step
  ContactSizes contacts[2];     ///< of two steps, by the parity of `completed` before them
};

/// Counters that the stages of a step exchange with each other and the host.
struct StepCounters {
  std::uint32_t failed = 0;  ///< 1: a list has no room, or must_wake: the step has no effect
  std::uint32_t invalid_bounds = 0;  ///< 1: swept bounds are not finite, the step has no effect
  Capacity needed;

  std::uint32_t any_asleep = 0;     ///< 1: a movable body sleeps at the start of the step
  std::uint32_t any_rebound = 0;    ///< 1: a manifold has a rebound speed
  std::uint32_t any_rests = 0;      ///< 1: a body has been slow for long enough to sleep
  std::uint32_t runaway = kNone;    ///< index of the first body for which is_in_world() is false
  std::uint32_t uncolored[3] = {};  ///< number of contacts without a color, by round modulo 3
  BlockCounts blocks;
  std::uint32_t manifold_rows = 0;       ///< number of rows of manifolds
  std::uint32_t crossing_colors = 0;     ///< end of the colors of crossing rows
  std::uint32_t any_fast = 0;            ///< 1: ContinuousCollision::is_fast() of a sub-shape
  std::uint32_t any_hiding = 0;          ///< 1: a contact may_hide()
  std::uint32_t unused = 0;              ///< instead of padding
  std::uint64_t largest_coordinate = 0;  ///< partition::magnitude_of()

  std::uint32_t pairs = 0;            ///< of swept bounds
  std::uint32_t flat_candidates = 0;  ///< candidates whose contacts may be recycled
  std::uint32_t candidates = 0, touches = 0;
  std::uint32_t spheres = 0, manifolds = 0, points = 0;  ///< sizes of the contact set
  std::uint32_t touching_spheres = 0;  ///< contacts of two spheres that touched during the step
  std::uint32_t begun_points = 0;      ///< points of manifolds: soft_step::has_begun()
  std::uint32_t sphere_touches = 0;    ///< items of the list of touches of two spheres
  std::uint32_t awake = 0;             ///< movable bodies awake after the step
  /// 1: a force must wake a body, the step has no effect. A full word, because padding would be
  /// reported by initcheck.
  std::uint32_t must_wake = 0;
};
struct Counters : StepCounters {
  Progress progress;
};
static_assert(std::has_unique_object_representations_v<Counters>);

/// What the threads of a part read or count often, in the memory of its device.
struct PartState {
  std::uint32_t parity = 0;  ///< of Progress::completed at the start of the step
  ContactSizes now, last;    ///< of the contact set, as far as it is known, and of the last one
  // Sizes of the lists of the part.
  std::uint32_t flat_candidates = 0;        ///< whose contacts may be recycled
  std::uint32_t other_candidates = 0;       ///< all others
  std::uint32_t full_tests = 0;             ///< flat candidates whose contacts are not recycled
  std::uint32_t hiding = 0;                 ///< contacts that may_hide()
  std::uint32_t bodies_with_manifolds = 0;  ///< bodies a of the part
  std::uint32_t inner_rows[soft_step::kRowKinds] = {};  ///< number of inner rows, by kind
  std::uint32_t inner_points = 0;                       ///< points of inner rows of manifolds
  std::uint32_t points_of_rows = 0;                     ///< points of other rows of manifolds
  /// By part and bin: number of rows of that part whose contacts are in the share of this part.
  std::uint32_t bin_sizes[kMostParts * (kBins + 1)] = {};
};

/// The contact of two spheres.
struct alignas(16) NormalDistance {
  Vec3 normal;
  Real distance = 0;
};

/// A point of World::contacts() and its sort key. Contacts of two simple spheres that are no
/// sensors are not in the list: they are in the contact set.
struct Touch {
  Candidate pair;
  std::uint32_t number = 0;              ///< of the point in its pair
  std::uint16_t of_spheres = 0;          ///< 1: both sub-shapes are spheres
  std::uint16_t is_of_removed_body = 0;  ///< 1: a body was removed after the step
  Vec3 normal, point;
  Real distance = 0;
};

/// The contacts of a step on the device.
struct DeviceContacts {
  soft_step::ContactView view;    ///< without the counts: see StepData::contacts()
  Range* spheres_of = nullptr;    ///< by body a: its contacts of two spheres
  Range* manifolds_of = nullptr;  ///< by body a
  Touch* touches = nullptr;
  Vec3* position_before = nullptr;  ///< by body, at the start of the step
  /// The same; null in worlds without hit events.
  Vec3 *velocity_before = nullptr, *angular_velocity_before = nullptr;
};

/// The joints on the device.
struct DeviceJoints {
  const soft_step::JointInput* inputs = nullptr;
  soft_step::KeptJoint* kept[2] = {};  ///< of the last two steps, indexed as Progress::contacts
  std::uint32_t count = 0;             ///< number of slots
  /// By kind of row of joints: number of joints.
  std::uint32_t of_kind[soft_step::kRowKinds - soft_step::kContactRowKinds] = {};
};

/// What rows of spheres read of a body besides RowBody.
struct alignas(4 * sizeof(Real)) BallProperties {
  Real radius = 0;  ///< [m]
  Real friction = 0, restitution = 0;
  Real unused = 0;  ///< instead of padding
};

/// Arrays that are sorted by key, and as much memory for the sort.
struct SortedCodes {
  std::uint64_t *keys = nullptr, *other_keys = nullptr;
  std::uint32_t *items = nullptr, *other_items = nullptr;
};

/// Everything that the programs of a step use, passed to kernels by value.
struct StepData {
  soft_step::StepBodies step;
  SweptBounds swept_bounds;
  FixedTreesView trees;
  DeviceContacts contacts_of[2];  ///< indexed as Progress::contacts
  DeviceJoints world_joints;
  MaterialSettings materials;
  soft_step::StepConstants constants;
  std::uint32_t substeps = 0;
  Capacity capacity;
  Counters* counters = nullptr;
  /// Number of devices that share the step, each with its part of the rows; 1 in a world of one
  /// block. No result depends on it.
  std::uint32_t parts = 1;
  std::uint32_t part = 0;              ///< of the threads that use this object
  PartState* states[kMostParts] = {};  ///< by part
  Divisions divisions;                 ///< if there are several parts

  Vec3* motion = nullptr;              ///< by body
  SphereInstance* searched = nullptr;  ///< copy of the swept bounds, if there are several parts
  SpherePair* pairs = nullptr;         ///< of swept bounds
  cuda::ContactCount* pair_count = nullptr;
  NormalDistance* pair_results = nullptr;  ///< by pair
  std::uint8_t* pair_found = nullptr;      ///< by pair: 1 if it is a contact of two spheres
  /// By part: two lists of candidates in memory for candidate_capacity() of them: from its
  /// begin PartState::other_candidates, and from its end backwards PartState::flat_candidates.
  Candidate* candidates = nullptr;
  std::uint32_t *full_tests = nullptr, *hiding = nullptr;  ///< by part: candidates
  CandidateManifold* tested = nullptr;                     ///< by candidate
  std::uint32_t* first_candidate = nullptr;  ///< by body a: list of candidates that have points
  std::uint32_t* next_candidate = nullptr;   ///< by candidate
  /// By body a: its number of manifolds, and in the lower half that of their points.
  std::uint64_t* manifold_sizes = nullptr;

  /// The movable bodies by place, with kNone in unused places, then the
  /// bodies without a place, once kPrepareBodies has put them there. If there are several
  /// parts, the blocks of places are in the order of `block_number`. The solver index of a body is
  /// its index in this array, so that the bodies of a block are neighbors in memory. In a world of
  /// one block, it is that of the body.
  std::uint32_t* body_at = nullptr;
  std::uint32_t* solver_index = nullptr;  ///< by body, of movable bodies in a world with blocks
  std::uint32_t* unplaced = nullptr;      ///< the bodies without a place, in any order
  /// By block of places, if there are several parts: its first body, and the number of the block.
  std::uint32_t *first_of_block = nullptr, *block_number = nullptr;

  soft_step::UsedColors* used_colors = nullptr;  ///< by body
  /// By body: lowest color_order() of its uncolored contacts, and the lowest of those contacts.
  std::uint64_t* first_order = nullptr;
  std::uint32_t* first_contact = nullptr;
  std::uint32_t *uncolored = nullptr, *still_uncolored = nullptr;
  /// By contact or joint that has a row: the number of the row in its kind. In the memory of
  /// `uncolored`, which is not in use when rows are built.
  std::uint32_t* row_of = nullptr;

  std::uint32_t* parent = nullptr;      ///< by body, of the islands
  std::uint8_t* marked = nullptr;       ///< by label of an island
  std::uint8_t* constrained = nullptr;  ///< by body: StepBodies::constrained

  std::uint16_t* row_places = nullptr;  ///< RowPlace by contact or joint, as RowSetup numbers them
  RowBins* bins = nullptr;              ///< by part
  /// By row of any kind, except inner rows: index of its contact or joint.
  std::uint32_t* row_contact = nullptr;
  StripedArray<soft_step::SphereRow> sphere_rows;
  std::uint32_t row_capacity = 0;  ///< of a part: rows of any kind
  soft_step::ManifoldRow* manifold_rows = nullptr;
  soft_step::PointRow* point_rows = nullptr;
  soft_step::DistanceRow* distance_rows = nullptr;
  soft_step::FrameRow* frame_rows = nullptr;
  std::uint32_t* first_fixed = nullptr;  ///< by solver index: list of its rows with fixed bodies
  std::uint32_t* next_fixed = nullptr;   ///< by row of any kind
  /// By block, kind and color: the first inner row, as a number in its kind; see inner_begin().
  std::uint32_t* inner_rows = nullptr;
  /// By kind and inner row; null for rows of spheres.
  std::uint32_t* inner_contacts[soft_step::kRowKinds] = {};
  std::uint32_t* first_inner_joint = nullptr;  ///< by block: list of the joints of inner rows
  std::uint32_t* next_inner_joint = nullptr;   ///< by joint
  /// The overflow rows: by kind, then in the order of contacts.
  std::uint32_t* overflow = nullptr;
  CellColumns columns;                                  ///< by solver index
  RowBody* row_bodies = nullptr;                        ///< by solver index
  BallProperties* balls = nullptr;                      ///< by solver index
  StripedArray<soft_step::SubstepBody> substep_bodies;  ///< by solver index
  /// By solver index: the orientation during the step, of movable bodies. In a world of one block,
  /// it is step.orientation.
  Quat* orientation = nullptr;
  OrientationCells* orientation_cells = nullptr;  ///< by body, of bodies with joints
  SavedColumns<PointerColumn> saved;              ///< values at the start of the step
  /// By body. In the memory of `columns`, which are not in use when the partition is renewed.
  SortedCodes codes;

  /// The rows of a kind other than spheres, by their number in this kind.
  template <class Row>
  JFPX_HD Row* rows() const {
    if constexpr (std::is_same_v<Row, soft_step::ManifoldRow>) {
      return manifold_rows;
    } else if constexpr (std::is_same_v<Row, soft_step::DistanceRow>) {
      return distance_rows;
    } else {
      static_assert(std::is_same_v<Row, soft_step::FrameRow>);
      return frame_rows;
    }
  }
  /// A row of any kind by its number in this kind.
  template <class Row>
  JFPX_HD decltype(auto) row(std::uint32_t number) const {
    if constexpr (std::is_same_v<Row, soft_step::SphereRow>) {
      return sphere_rows.load(number);
    } else {
      return (rows<Row>()[number]);
    }
  }
  /// The parts of a row; null if it has none.
  template <class Row>
  JFPX_HD typename Row::Part* parts_of(const Row& row) const {
    if constexpr (soft_step::kHasParts<Row>) {
      static_assert(std::is_same_v<typename Row::Part, soft_step::PointRow>);
      return point_rows + row.first;
    } else {
      return nullptr;
    }
  }
  /// Of a part: capacity of the rows of a kind.
  JFPX_HD std::uint32_t capacity_of(soft_step::RowKind kind) const {
    if (kind == soft_step::kKindOf<soft_step::SphereRow>) return row_capacity;
    if (kind == soft_step::kKindOf<soft_step::ManifoldRow>) return capacity.manifold_rows;
    return world_joints.of_kind[kind - soft_step::kContactRowKinds];
  }
  /// Of a part: capacity of its lists of candidates.
  JFPX_HD std::uint32_t candidate_capacity() const {
    return parts == 1 ? capacity.candidates : capacity.candidates_of_part;
  }
  /// Index of a flat candidate of the part.
  JFPX_HD std::uint32_t flat_candidate(std::uint32_t number) const {
    return (part + 1) * candidate_capacity() - 1 - number;
  }
  /// First inner row of a block, kind and color, of kColorsPerClass + 1 colors: the last element is
  /// the end.
  JFPX_HD std::uint32_t* inner_begin(std::uint32_t block, soft_step::RowKind kind) const {
    constexpr std::uint32_t kStride = soft_step::kColorsPerClass + 1u;
    return inner_rows + (block * soft_step::kRowKinds + kind) * kStride;
  }

  /// The state of the part of the threads that use this object.
  JFPX_HD PartState& state() const { return *states[part]; }

  /// Solver index of a movable body, and the reverse.
  JFPX_HD std::uint32_t index_of(std::uint32_t body) const {
    return step.bodies.has_blocks ? solver_index[body] : body;
  }
  JFPX_HD std::uint32_t body_of(std::uint32_t index) const {
    return step.bodies.has_blocks ? body_at[index] : index;
  }
  /// @param index solver index
  JFPX_HD soft_step::RowSetup::SphereProperties sphere(std::uint32_t index) const {
    const RowBody& body = row_bodies[index];
    const BallProperties& ball = balls[index];
    return {body.inverse_mass, body.inverse_inertia, ball.radius, ball.friction, ball.restitution};
  }
  /// The contacts of the step in progress, and those of the last completed step. The device selects
  /// them, because the host does not track the number of completed steps. Not valid before the
  /// first barrier of a step.
  JFPX_HD const DeviceContacts& now() const { return contacts_of[parity()]; }
  JFPX_HD const DeviceContacts& last() const { return contacts_of[1 - parity()]; }
  JFPX_HD soft_step::ContactView contacts() const { return with_sizes(now().view, state().now); }
  JFPX_HD soft_step::ContactView last_contacts() const {
    return with_sizes(last().view, state().last);
  }
  /// Finds a contact of the last step in the range of its body a. EditProgram has marked contacts
  /// of removed bodies as uncolored.
  /// @param offset number of the first contact of the list
  /// @returns its index in the list; kNone if there is none
  template <class Contact>
  JFPX_HD std::uint32_t find_last(const Contact* contacts, const Range& range,
                                  const soft_step::ContactKey& key, std::uint32_t offset) const {
    const std::uint32_t found =
        soft_step::find_contact(contacts, range.begin, range.end, key, kNone);
    if (found == kNone || last().view.colors[offset + found] == soft_step::kNoColor) return kNone;
    return found;
  }
  JFPX_HD std::uint32_t find_last_manifold(const soft_step::ContactKey& key) const {
    const soft_step::ContactView contacts = last_contacts();
    return find_last(contacts.manifolds, last().manifolds_of[key.a], key, contacts.sphere_count);
  }
  JFPX_HD soft_step::JointView joints() const {
    const DeviceJoints& all = world_joints;
    return {all.inputs, all.kept[1 - parity()], all.kept[parity()], all.count};
  }
  /// Number of sweeps over joints in a substep.
  JFPX_HD std::uint32_t joint_sweeps() const {
    return world_joints.count > 0 ? constants.joint_sweeps : 0;
  }
  JFPX_HD soft_step::Islands islands() const {
    return {.step = step,
            .contacts = contacts(),
            .joints = joints(),
            .sets = {parent},
            .marked = marked};
  }
  JFPX_HD soft_step::RowSetup row_setup() const {
    const BodyView& bodies = step.bodies;
    return {contacts(),
            joints(),
            {bodies.inverse_inertia, bodies.last_acceleration, bodies.radius, step.traits,
             step.constrained, bodies.friction, bodies.restitution, bodies.rolling_friction,
             bodies.spinning_friction, materials, bodies.position, step.orientation,
             bodies.orientation},
            step.solver,
            constants.restitution_threshold,
            constants.inverse_friction_gap};
  }
  /// Whether the step has no effect, because an earlier step was not completed or changes of the
  /// host are pending.
  JFPX_HD bool is_skipped() const {
    return counters->progress.deferred != 0 || counters->progress.held != 0;
  }
  /// Whether an earlier stage has failed, so that the step cannot be completed.
  JFPX_HD bool has_failed() const {
    return is_skipped() || counters->failed != 0 || counters->invalid_bounds != 0;
  }

 private:
  JFPX_HD std::uint32_t parity() const { return state().parity; }
  JFPX_HD static soft_step::ContactView with_sizes(soft_step::ContactView view,
                                                   const ContactSizes& sizes) {
    view.sphere_count = sizes.spheres;
    view.manifold_count = sizes.manifolds;
    view.point_count = sizes.points;
    return view;
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
