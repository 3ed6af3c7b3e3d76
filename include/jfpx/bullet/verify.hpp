/// Comparison of two Bullet worlds, and of Bullet's contacts with those of SphereCollider.
#pragma once

#include <jfpx/bullet/abi.hpp>
#include <jfpx/sphere_collider.hpp>

#include <BulletDynamics/Dynamics/btDynamicsWorld.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// The first difference between two worlds or lists of contacts.
struct Difference {
  std::uint64_t step = 0;   ///< as passed by the caller
  std::string what;         ///< "world", "body", "joint", "manifold", "pair"
  std::uint64_t index = 0;  ///< into the array of bodies, joints or manifolds; pair: the lower body
  std::uint64_t other = 0;  ///< pair: the other body; manifold: the point; otherwise 0
  std::string field;        ///< for example "m_localPointA.x"
  double expected = 0, actual = 0;
  std::uint64_t expected_bits = 0, actual_bits = 0;  ///< 32 bits wide for float and int
};

/// One line of text: step, location, field, and both values in decimal and hexadecimal.
JFPX_BULLET_API std::string to_text(const Difference& difference);

/// Compares two worlds bit by bit: all manifolds in the order of the dispatchers' arrays, with
/// their bodies, thresholds and every field of every point (for m_userPersistentData, only whether
/// it is set, and not the unused component of the normal, which Bullet does not initialize for two
/// capsules at one place); then all bodies in array order with transforms, velocities, activation,
/// forces, hit fractions and bounds in the broadphase; then all joints with type, applied impulse
/// and whether they are enabled. Definitions, such as shapes and masses, are not compared.
/// @param step is copied into the result.
/// @return the first difference; empty if the worlds are identical.
JFPX_BULLET_API std::optional<Difference> first_difference(btDynamicsWorld& expected,
                                                           btDynamicsWorld& actual,
                                                           std::uint64_t step);

/// Compares the contacts that SphereCollider::find_contacts() finds among the spheres of a Bullet
/// world with the points that Bullet creates in the same step: pairs, and the bits of normal,
/// distance and point on sphere b.
class JFPX_BULLET_API ContactCheck {
 public:
  explicit ContactCheck(std::unique_ptr<SphereCollider> collider = make_sphere_collider());
  ~ContactCheck();
  ContactCheck(ContactCheck&&) noexcept;
  ContactCheck& operator=(ContactCheck&&) noexcept;

  /// Stores the spheres. Call it directly before each step. The world must have no motion states,
  /// and the step no substeps.
  void capture(const btDynamicsWorld& world);
  /// Compares after the step. Pairs that Bullet filters out are skipped: groups and masks, two
  /// static bodies, ignore lists. Two sleeping bodies keep their existing points, which are
  /// compared, and get no new ones, so a missing point is not a difference.
  /// @return the number of contacts compared
  /// @throws InvalidArgument if a captured sphere is not finite, or nothing was captured.
  std::uint64_t compare(btDynamicsWorld& world, std::uint64_t step);

  std::uint64_t compared() const noexcept;    ///< contacts compared so far
  std::uint64_t mismatches() const noexcept;  ///< different, missing or extra contacts
  const std::optional<Difference>& first() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
