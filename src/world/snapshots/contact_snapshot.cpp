/// Writing and checked reading of contacts; see the header.
#include "src/world/snapshots/contact_snapshot.hpp"

#include "src/world/snapshots/snapshot_fields.hpp"

#include <algorithm>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

void serialize(auto& archive, Is<ContactKey> auto& key) {
  auto& [a, b, part_a, part_b] = key;
  archive(a, b, part_a, part_b);
}
void serialize(auto& archive, Is<KeptImpulse> auto& impulse) {
  auto& [friction, normal] = impulse;
  archive(friction, normal);
}
void serialize(auto& archive, Is<TestedPoses> auto& tested) {
  auto& [orientation_a, orientation_b, offset] = tested;
  archive(orientation_a, orientation_b, offset);
}

}  // namespace soft_step
namespace {

using soft_step::ContactKey;
using soft_step::ContactSet;
using soft_step::KeptImpulse;
using soft_step::ManifoldInput;
using soft_step::PointInput;

constexpr std::uint32_t kMostPoints = detail::PairManifold::kMaxPoints;

/// Checks the invariants of contact lists on which the next step depends.
class Checker {
 public:
  Checker(const BodyStore& bodies, SnapshotColors* colors) : bodies_(bodies), colors_(*colors) {}

  void start_list() { last_ = {}; }
  void check(const ContactKey& key, const Vec3& rolling_impulse, std::uint8_t color) {
    BinaryReader::require(!(key < last_), "its contacts are not sorted");
    last_ = key;
    BinaryReader::require(key.a != key.b && bodies_.lives(key.a) && bodies_.lives(key.b),
                          "a contact is not of two bodies");
    BinaryReader::require(rolling_impulse == Vec3{} || bodies_.rolls(key.a) || bodies_.rolls(key.b),
                          "a contact of bodies without rolling friction has a rolling impulse");
    colors_.add(bodies_, key.a, key.b, color,
                {.immovable = "a contact with an immovable body has a color",
                 .same = "two contacts of a body have the same color"});
  }

 private:
  const BodyStore& bodies_;
  SnapshotColors& colors_;
  ContactKey last_;
};

/// Bytes of a contact of two spheres, of a manifold without points and of a point.
std::size_t sphere_size() {
  return least_size<ContactKey>() + least_size<Vec3>() + 1 + least_size<KeptImpulse>();
}
std::size_t manifold_size() { return least_size<ContactKey>() + 2 * least_size<Vec3>() + 1 + 8; }
std::size_t point_size() { return least_size<Vec3>() + 4 + least_size<KeptImpulse>(); }

void read_spheres(BinaryReader& reader, Checker* checker, ContactSet* set) {
  const std::size_t count = reader.count(sphere_size());
  set->spheres.resize(count);
  set->impulses.resize(count);
  set->rolling_impulses.resize(count);
  set->colors.resize(count);
  checker->start_list();
  for (std::size_t i = 0; i < count; ++i) {
    ContactKey& key = set->spheres[i].key;
    reader(key, set->rolling_impulses[i], set->colors[i], set->impulses[i]);
    checker->check(key, set->rolling_impulses[i], set->colors[i]);
  }
}

void read_points(BinaryReader& reader, ManifoldInput* manifold, ContactSet* set) {
  const std::size_t count = reader.count(point_size());
  manifold->first = static_cast<std::uint32_t>(set->points.size());
  manifold->count = static_cast<std::uint32_t>(count);
  set->points.reserve(set->points.size() + count);
  for (std::size_t i = 0; i < count; ++i) {
    PointInput& point = set->points.emplace_back();
    reader(point.arm_a, point.feature, set->impulses.emplace_back());
  }
}

void read_manifolds(BinaryReader& reader, Checker* checker, ContactSet* set) {
  const std::size_t count = reader.count(manifold_size());
  set->manifolds.resize(count);
  checker->start_list();
  for (ManifoldInput& manifold : set->manifolds) {
    Vec3& rolling_impulse = set->rolling_impulses.emplace_back();
    std::uint8_t& color = set->colors.emplace_back();
    reader(manifold.key, rolling_impulse, color, manifold.normal);
    checker->check(manifold.key, rolling_impulse, color);
    read_points(reader, &manifold, set);
  }
}

}  // namespace

void write_contacts(BinaryWriter* writer, const ContactSet& set) {
  BinaryWriter& write = *writer;
  write(std::uint64_t{set.spheres.size()});
  for (std::size_t i = 0; i < set.spheres.size(); ++i) {
    write(set.spheres[i].key, set.rolling_impulse(i), set.colors[i], set.impulses[i]);
  }
  write(std::uint64_t{set.manifolds.size()});
  for (std::size_t m = 0; m < set.manifolds.size(); ++m) {
    const ManifoldInput& manifold = set.manifolds[m];
    const std::size_t contact = set.spheres.size() + m;
    write(manifold.key, set.rolling_impulse(contact), set.colors[contact], manifold.normal);
    write(std::uint64_t{manifold.count});
    // Skips points and impulses of contacts that ContactCache::forget() has removed.
    for (std::uint32_t p = manifold.first; p < manifold.first + manifold.count; ++p) {
      const PointInput& point = set.points[p];
      write(point.arm_a, point.feature, set.impulses[set.spheres.size() + p]);
    }
  }
}

ContactSet read_contacts(BinaryReader* reader, const BodyStore& bodies, SnapshotColors* colors) {
  ContactSet set;
  Checker checker(bodies, colors);
  read_spheres(*reader, &checker, &set);
  read_manifolds(*reader, &checker, &set);
  BinaryReader::require(
      set.impulses.size() + set.size() <= std::numeric_limits<std::uint32_t>::max(),
      "it has too many contacts");
  return set;
}

bool any_recyclable(const ContactSet& set) {
  return std::ranges::any_of(set.manifolds,
                             [](const ManifoldInput& m) { return m.tested.are_set(); });
}

void write_tests(BinaryWriter* writer, const ContactSet& set) {
  BinaryWriter& write = *writer;
  for (const ManifoldInput& manifold : set.manifolds) {
    write(manifold.tested.are_set());
    if (!manifold.tested.are_set()) continue;
    write(manifold.tested);
    for (std::uint32_t p = manifold.first; p < manifold.first + manifold.count; ++p) {
      write(set.points[p].arm_b, set.points[p].tested_distance);
    }
  }
}

void read_tests(BinaryReader* reader, ContactSet* set) {
  const auto is_unit = [](Real length2) {
    return absolute(length2 - 1) < Real(0.01);  // false for NaN
  };
  for (ManifoldInput& manifold : set->manifolds) {
    if (!reader->get<bool>()) continue;
    soft_step::TestedPoses& tested = manifold.tested;
    (*reader)(tested);
    bool is_valid = manifold.count > 0 && manifold.count <= kMostPoints &&
                    is_unit(length_squared(manifold.normal)) &&
                    is_unit(length_squared(tested.orientation_a)) &&
                    is_unit(length_squared(tested.orientation_b)) && is_finite(tested.offset);
    for (std::uint32_t p = manifold.first; p < manifold.first + manifold.count; ++p) {
      PointInput& point = set->points[p];
      (*reader)(point.arm_b, point.tested_distance);
      is_valid &= is_finite(point.arm_a) && is_finite(point.arm_b);
      is_valid &= is_finite(point.tested_distance);
    }
    BinaryReader::require(is_valid, "a contact has no valid test");
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
