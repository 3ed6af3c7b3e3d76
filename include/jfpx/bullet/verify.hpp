/// Cross-checks: two Bullet worlds against each other, and Bullet's contacts against jfpx's own.
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

/// The first place where two things differ.
struct Difference {
  std::uint64_t step = 0;   ///< as the caller counts
  std::string what;         ///< "world", "body", "manifold", "pair"
  std::uint64_t index = 0;  ///< in the array of bodies or manifolds; of a pair: the lower body
  std::uint64_t other = 0;  ///< of a pair: the other body; of a manifold: the point; else 0
  std::string field;        ///< for example "m_localPointA.x"
  double expected = 0, actual = 0;
  std::uint64_t expected_bits = 0, actual_bits = 0;  ///< 32 bits wide for float and int
};

/// One line for a user: step, place, field, both values, both in hex.
JFPX_API std::string to_text(const Difference& difference);

/// Compares two worlds bit by bit: all manifolds in the order of the dispatchers' arrays, with
/// their bodies, thresholds and every field of every point (of m_userPersistentData only whether
/// it is set); then all bodies in array order with transforms, velocities and activation.
/// @param step is only passed on.
/// @return the first difference, or nothing if the worlds are the same.
JFPX_API std::optional<Difference> first_difference(btDynamicsWorld& expected,
                                                    btDynamicsWorld& actual, std::uint64_t step);

/// Compares what SphereCollider::find_contacts says about the spheres of a Bullet world with the
/// points that Bullet made of them in the same step: same pairs, and the same bits of normal,
/// distance and point on sphere b.
class JFPX_API ContactCheck {
 public:
  explicit ContactCheck(std::unique_ptr<SphereCollider> collider = make_sphere_collider());
  ~ContactCheck();
  ContactCheck(ContactCheck&&) noexcept;
  ContactCheck& operator=(ContactCheck&&) noexcept;

  /// Remembers the world as a step will see it. To be called right before the step, which must be
  /// a single one, of a world whose bodies move by themselves (no motion states).
  void capture(const btDynamicsWorld& world);
  /// Compares after the step. Left out are pairs that Bullet's filters keep apart: groups and
  /// masks, static against static, ignore lists. Two sleeping bodies keep the points that they
  /// had, which are compared, and get no new ones, so that missing points are no difference.
  /// @return the contacts compared
  /// @throws InvalidArgument if a captured sphere is not finite, or nothing was captured.
  std::uint64_t compare(btDynamicsWorld& world, std::uint64_t step);

  std::uint64_t compared() const noexcept;    ///< contacts compared so far
  std::uint64_t mismatches() const noexcept;  ///< of these, different, missing or too many
  const std::optional<Difference>& first() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
