/// Contacts of a step for the soft-step solver, with their impulses and colors for the warm start
/// of the next step.
#pragma once

#include "src/collide/pair_manifold.hpp"

#include <compare>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Identifies a contact from step to step: two bodies, and a part of each.
struct ContactKey {
  std::uint32_t a = 0, b = 0;
  std::uint32_t part_a = 0, part_b = 0;
  /// `part_a` of the contacts of contact generators; parts of shapes have lower numbers.
  static constexpr std::uint32_t kGenerated = 0xffffffffu;
  /// `part_a` of joints; `part_b` is the slot of its id.
  static constexpr std::uint32_t kJoint = kGenerated - 1;
  JFPX_HD bool is_generated() const { return part_a == kGenerated; }
  friend auto operator<=>(const ContactKey&, const ContactKey&) = default;
};

/// Material of a contact that replaces the combined material of the bodies. Not in snapshots, nor
/// sent between ranks: contact generators set it again in every step, and run with one rank only.
struct OwnMaterial {
  Real friction = -1;    ///< [-], >= 0; < 0: not set
  Real restitution = 0;  ///< [-], in [0, 1]
  JFPX_HD bool is_set() const { return friction >= 0; }
};

/// Two spheres that touch, or that may touch during the step.
struct alignas(16) SphereContactInput {
  ContactKey key;
  Vec3 normal;        ///< unit, from b to a
  Real distance = 0;  ///< [m], along the normal; > 0: a gap
};

/// Poses of two bodies at the last full test of their shapes; see recycle(). Contacts that are not
/// recycled have none: all numbers are 0.
struct TestedPoses {
  Quat orientation_a{0, 0, 0, 0}, orientation_b{0, 0, 0, 0};
  Vec3 offset;  ///< [m], position of a minus position of b
  JFPX_HD bool are_set() const { return !(orientation_a == Quat{0, 0, 0, 0}); }
};

/// Any other contact, with one normal and one or several points.
struct ManifoldInput {
  ContactKey key;
  Vec3 normal;                         ///< unit, from b to a
  std::uint32_t first = 0, count = 0;  ///< range of points
  OwnMaterial material;                ///< set for generated contacts
  TestedPoses tested;
};
using PointInput = detail::SolverPoint;

/// Impulses of a contact point on body a [N s], in world axes.
struct alignas(16) KeptImpulse {
  Vec3 friction;
  Real normal = 0;  ///< >= 0, or kReleased
  /// `normal` of bodies that pushed each other during the step, but not at its end
  static constexpr Real kReleased = -1;
  JFPX_HD bool has_pushed() const { return normal != 0; }
};

/// The arrays of a ContactSet, in host memory or on a device. Both lists are sorted by key. Contact
/// numbers: first contacts of spheres, then manifolds. Impulse numbers: first one impulse for each
/// contact of spheres, then one for each point.
struct ContactView {
  SphereContactInput* spheres = nullptr;
  ManifoldInput* manifolds = nullptr;
  PointInput* points = nullptr;
  KeptImpulse* impulses = nullptr;  ///< by contact of spheres or point
  /// [N m s], by contact: torque impulse on body a; null: all are zero.
  Vec3* rolling_impulses = nullptr;
  std::uint8_t* colors = nullptr;  ///< by contact
  std::uint32_t sphere_count = 0, manifold_count = 0, point_count = 0;
  const OwnMaterial* sphere_materials = nullptr;  ///< by contact of spheres; null: none is set

  JFPX_HD std::uint32_t size() const { return sphere_count + manifold_count; }
  JFPX_HD bool is_sphere(std::uint32_t contact) const { return contact < sphere_count; }
  JFPX_HD const ManifoldInput& manifold(std::uint32_t contact) const {
    return manifolds[contact - sphere_count];
  }
  JFPX_HD const ContactKey& key(std::uint32_t contact) const {
    return is_sphere(contact) ? spheres[contact].key : manifold(contact).key;
  }
  JFPX_HD const Vec3& normal(std::uint32_t contact) const {
    return is_sphere(contact) ? spheres[contact].normal : manifold(contact).normal;
  }
  JFPX_HD OwnMaterial own_material(std::uint32_t contact) const {
    if (!is_sphere(contact)) return manifold(contact).material;
    return sphere_materials != nullptr ? sphere_materials[contact] : OwnMaterial{};
  }
  /// Distance of a point of a contact. A contact of two spheres has point 0 only.
  JFPX_HD Real distance(std::uint32_t contact, std::uint32_t point) const {
    return is_sphere(contact) ? spheres[contact].distance
                              : points[manifold(contact).first + point].distance;
  }
  /// Index of the first impulse of a contact.
  JFPX_HD std::uint32_t first_impulse(std::uint32_t contact) const {
    return is_sphere(contact) ? contact : sphere_count + manifold(contact).first;
  }
  /// Number of impulses of a contact.
  JFPX_HD std::uint32_t impulse_count(std::uint32_t contact) const {
    return is_sphere(contact) ? 1 : manifold(contact).count;
  }
  /// Whether condition(distance of a point, its impulse) is true for any point of a contact.
  template <class Condition>
  JFPX_HD bool any_point(std::uint32_t contact, const Condition& condition) const {
    const std::uint32_t first = first_impulse(contact);
    for (std::uint32_t i = 0; i < impulse_count(contact); ++i) {
      if (condition(distance(contact, i), impulses[first + i])) return true;
    }
    return false;
  }
};

/// Contacts of one step, in host memory.
struct ContactSet {
  std::vector<SphereContactInput> spheres;
  std::vector<ManifoldInput> manifolds;
  std::vector<PointInput> points;
  std::vector<KeptImpulse> impulses;
  std::vector<Vec3> rolling_impulses;  ///< empty if no body has rolling or spinning friction
  std::vector<std::uint8_t> colors;
  std::vector<OwnMaterial> sphere_materials;  ///< by contact of spheres; empty if none is set

  std::uint32_t size() const {
    return static_cast<std::uint32_t>(spheres.size() + manifolds.size());
  }
  bool has_rolling() const { return !rolling_impulses.empty(); }
  Vec3 rolling_impulse(std::size_t contact) const {
    return has_rolling() ? rolling_impulses[contact] : Vec3{};
  }
  /// Valid until an array changes its size.
  ContactView view() {
    return {spheres.data(),
            manifolds.data(),
            points.data(),
            impulses.data(),
            has_rolling() ? rolling_impulses.data() : nullptr,
            colors.data(),
            static_cast<std::uint32_t>(spheres.size()),
            static_cast<std::uint32_t>(manifolds.size()),
            static_cast<std::uint32_t>(points.size()),
            sphere_materials.empty() ? nullptr : sphere_materials.data()};
  }
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
