/// Finds the contacts of a group for which Bullet's solver creates rows.
#pragma once

#include "src/base/buffer.hpp"
#include "src/contact_solver/sequential_impulse/cpu/row_solver.hpp"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Properties of a body that the scan uses.
enum BodyFlag : std::uint8_t {
  kInfiniteMass = 1,        ///< the inverse mass is zero within Bullet's tolerance
  kImmovable = 2,           ///< rows do not change its velocities
  kAnisotropic = 4,         ///< has anisotropic friction
  kAnisotropicRolling = 8,  ///< has anisotropic rolling friction
};

struct ContactRef {
  btPersistentManifold* manifold;
  int point;
  bool anisotropic;          ///< one of the bodies has anisotropic friction
  bool rolling;              ///< the contact has rolling friction
  bool anisotropic_rolling;  ///< ... and one of the bodies has anisotropic rolling friction

  btManifoldPoint& get() const { return manifold->getContactPoint(point); }
};

/// A kinematic body of a contact or joint that is not in the list of the group and therefore has no
/// id yet.
struct UnlistedBody {
  btCollisionObject* object;
  int companion;  ///< its previous companion id
};

class ContactScan {
 public:
  /// Lists the contacts in Bullet's order. An id is the companion id plus one; bodies without
  /// companion id are fixed or unlisted.
  /// @param flags by id: BodyFlag bits
  void run(ThreadPool& pool, std::span<btPersistentManifold* const> manifolds,
           std::span<const std::uint8_t> flags);
  /// Assigns ids from `first_id` on, and the matching companion ids, to unlisted bodies.
  void register_unlisted(std::span<btPersistentManifold* const> manifolds, std::size_t first_id);

  std::span<const ContactRef> contacts() const { return {refs_.data(), count_}; }
  std::span<const cpu::RowPair> pairs() const { return {pairs_.data(), count_}; }
  std::span<const UnlistedBody> unlisted() const { return unlisted_; }
  void clear_unlisted() noexcept { unlisted_.clear(); }
  bool any_rolling() const { return any_rolling_; }
  bool any_anisotropic() const { return any_anisotropic_; }

 private:
  struct Chunk {
    std::uint32_t count;
    bool rolling, unlisted, anisotropic;
  };
  void scan(std::span<btPersistentManifold* const> manifolds, std::size_t chunk,
            std::span<const std::uint8_t> flags);

  Buffer<ContactRef> found_, refs_;
  Buffer<cpu::RowPair> found_pairs_, pairs_;
  Buffer<Chunk> chunks_;
  std::vector<UnlistedBody> unlisted_;
  std::size_t count_ = 0;
  bool any_unlisted_ = false, any_rolling_ = false, any_anisotropic_ = false;
};

/// Returns the object as a rigid body if Bullet's solver uses its motion (finite mass or
/// kinematic); otherwise null.
btRigidBody* moving_body(btCollisionObject* object);
/// The BodyFlag bits of a body.
std::uint8_t body_flags(const btRigidBody& body);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
