/// The bodies of a world in a snapshot: BodyStore::write() and read().
///
/// Derived values are recomputed with the same bits. The inertia in world axes is stored, because
/// that of a sphere is not updated by every rotation.
#include "src/contact_solver/soft_step/blocks.hpp"
#include "src/scene/scene_validate.hpp"
#include "src/world/bodies/body_store.hpp"
#include "src/world/snapshots/snapshot_checks.hpp"
#include "src/world/snapshots/snapshot_fields.hpp"

#include <algorithm>
#include <functional>
#include <type_traits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Bytes of the smallest body, a sphere without a given inertia; somewhat less is sufficient.
constexpr std::size_t kLeastBodySize = 32 * sizeof(Real);

constinit const BodyDef kAnyBody{};
constexpr const char* kNoFlag = "a flag of a body is neither 0 nor 1";

/// Validation tolerates normals of slightly different length. BodyStore::add() normalizes them and
/// scales the offset by the same factor, so the offset may exceed kMaxCoordinate by that factor.
template <class Wall>
void check_wall(Wall* wall) {
  constexpr Real kMost = kMaxCoordinate * (1 + kUnitTolerance);
  BinaryReader::require(absolute(wall->offset) <= kMost, "a wall has no finite offset");
  wall->offset = std::clamp(wall->offset, -kMaxCoordinate, kMaxCoordinate);
}

}  // namespace

/// All members of a body in the order of the bytes. `Self` is const for a writer.
template <class Archive, class Self>
void BodyStore::serialize_body(Archive& archive, Self& self, std::uint32_t i) {
  const auto inertia = [&](auto& given) {
    std::uint8_t is_given = self.inertia_given(i) ? 1 : 0;
    archive(is_given);
    BinaryReader::require(is_given <= 1, kNoFlag);
    if (is_given == 0) return;
    if constexpr (std::is_const_v<Self>) {
      archive(given.at(i));
    } else {
      archive(given[i]);
    }
  };
  const auto column = [&](auto& values, const auto& member) {
    if constexpr (Is<std::remove_reference_t<decltype(values)>, GivenInertia>) {
      inertia(values);
    } else if constexpr (!Is<std::remove_reference_t<decltype(member)>, MotionLocks>) {
      // Motion locks are in a later part of a snapshot.
      archive(values[i]);
    }
  };
  each_given(self.moving, self.properties_, self.host_, self.given_inertia_, kAnyBody, column);
  each_other_motion(
      [&](auto& values) {
        if (static_cast<const void*>(&values) != &self.moving.place) archive(values[i]);
      },
      self.moving);
}

void BodyStore::write(BinaryWriter* writer) const {
  BinaryWriter& write = *writer;
  write(pool_.generations(), pool_.unused(), std::uint64_t{size()});
  for (const BodyId id : ids()) {
    write(id.index);
    serialize_body(write, *this, id.index);
  }
  write(std::uint64_t{ignored_.keys().size()});
  for (const std::uint64_t key : ignored_.keys()) write(key);
}

void BodyStore::read(BinaryReader* reader) {
  read_bodies(reader, read_slots(reader));
  read_pairs(reader);
}

bool BodyStore::has_places() const noexcept {
  return std::ranges::any_of(
      ids(), [this](BodyId id) { return moving.place[id.index] != soft_step::kNoPlace; });
}

void BodyStore::write_places(BinaryWriter* writer) const {
  for (const BodyId id : ids()) (*writer)(moving.place[id.index]);
}

void BodyStore::read_places(BinaryReader* reader) {
  std::vector<bool> is_taken(capacity());  // by place
  for (const BodyId id : ids()) {
    const auto place = reader->get<std::uint32_t>();
    moving.place[id.index] = place;
    if (place == soft_step::kNoPlace) continue;
    BinaryReader::require(movable(id.index) && place < is_taken.size() && !is_taken[place],
                          "a body has no valid place in the partition");
    is_taken[place] = true;
  }
}

void BodyStore::write_locks(BinaryWriter* writer) const {
  for (const BodyId id : ids()) (*writer)(motion_locks(id.index));
}

void BodyStore::read_locks(BinaryReader* reader) {
  for (const BodyId id : ids()) {
    const auto locks = reader->get<MotionLocks>();
    set_motion_locks(id.index, locks);
    const Vec3 &v = moving.velocity[id.index], &w = moving.angular_velocity[id.index];
    const bool stays = detail::free_linear(locks, v) == v && detail::free_angular(locks, w) == w;
    BinaryReader::require(
        motion_locks(id.index) == locks && (stays || kinematic(id.index)),
        "an immovable body has locked axes, or a body moves along or about a locked axis");
  }
  BinaryReader::require(any_locks(), "it has locks of no body");
}

/// Reads generations and unused slots. @returns by slot: whether it is unused
std::vector<bool> BodyStore::read_slots(BinaryReader* reader) {
  SnapshotSlots slots;
  slots.generations = reader->get<std::vector<std::uint32_t>>();
  validate_body_count(slots.generations.size());
  resize_slots(slots.generations.size());
  slots.read_unused(reader, "its list of unused ids is invalid");
  pool_.assign(slots.generations, slots.unused);
  return slots.is_free;
}

void BodyStore::read_bodies(BinaryReader* reader, const std::vector<bool>& is_free) {
  for (std::size_t left = reader->count(kLeastBodySize); left > 0; --left) {
    const auto i = reader->get<std::uint32_t>();
    BinaryReader::require(
        i < capacity() && !is_free[i] && (ids().empty() || ids().back().index < i),
        "its list of bodies is invalid");
    serialize_body(*reader, *this, i);
    moving.place[i] = soft_step::kNoPlace;
    check_body(i);
    pool_.use(i);
    derive_properties(i);
    if (needs_inertia_arrays(host_.shape[i], host_.mass[i], kinematic(i), inertia_given(i), {})) {
      make_inertia_arrays();
    }
    inertia_given(i) ? set_tensor(i, given_inertia_.at(i)) : compute_inertia(i, std::nullopt);
  }
}

BodyDef BodyStore::definition(std::uint32_t i) const {
  BodyDef def;
  const auto get = [i](const auto& column, auto& value) {
    if constexpr (Is<std::remove_cvref_t<decltype(column)>, GivenInertia>) {
      if (const auto found = column.find(i); found != column.end()) value = found->second;
    } else {
      value = column[i];
    }
  };
  each_given(moving, properties_, host_, given_inertia_, def, get);
  return def;
}

/// Checks a body like add() and set_state(), and the further invariants of the engine.
void BodyStore::check_body(std::uint32_t i) const {
  BodyDef def = definition(i);
  if (auto* half_space = std::get_if<HalfSpace>(&def.shape)) check_wall(half_space);
  if (auto* plane = std::get_if<Plane>(&def.shape)) check_wall(plane);
  validate_body(def, i, Solver::soft_step);  // without motion locks
  const auto check_flag = [i](const auto& column) {
    using Value = typename std::remove_cvref_t<decltype(column)>::value_type;
    if constexpr (std::is_same_v<Value, std::uint8_t>) {
      BinaryReader::require(column[i] <= 1, kNoFlag);
    }
  };
  each_property(check_flag, properties_);
  check_flag(moving.awake);
  BinaryReader::require(!inertia_given(i) || host_.mass[i] > 0,
                        "an immovable body has a given inertia");
  BinaryReader::require(moving.awake[i] == 0 || host_.mass[i] > 0 || kinematic(i),
                        "an immovable body is awake");
}

void BodyStore::read_pairs(BinaryReader* reader) {
  const auto keys = reader->get<std::vector<std::uint64_t>>();
  std::vector<BodyPair> pairs;
  pairs.reserve(keys.size());
  for (const std::uint64_t key : keys) {
    const BodyPair pair{static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)};
    BinaryReader::require(pair.a < pair.b && lives(pair.a) && lives(pair.b),
                          "an ignored pair is not of two bodies");
    pairs.push_back(pair);
  }
  BinaryReader::require(std::ranges::is_sorted(keys, std::less_equal<>()),
                        "its ignored pairs are not sorted");
  set_ignored_pairs(pairs);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
