/// Finds the contacts of a group that Bullet's solver would make rows of.
#pragma once

#include "src/base/buffer.hpp"
#include "src/contact_solver/cpu/row_solver.hpp"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// What the scan must know of a body, by the body's id.
enum BodyMark : std::uint8_t {
  kLight = 1,        ///< inverse mass is zero by Bullet's measure
  kUnmoved = 2,      ///< rows change no velocity of it
  kAnisotropic = 4,  ///< its friction depends on the direction
};

struct ContactRef {
  btPersistentManifold* manifold;
  int point;
  bool anisotropic;  ///< one of the bodies has anisotropic friction
  bool rolling;      ///< has rolling friction

  btManifoldPoint& get() const { return manifold->getContactPoint(point); }
};

/// A body that takes part and has no id yet: kinematic and not in the group's list.
struct LateBody {
  btCollisionObject* object;
  int companion;  ///< Bullet's companion id before
};

class ContactScan {
 public:
  /// Lists the contacts in Bullet's order. Ids are companion ids plus one; bodies without one are
  /// fixed, or late.
  void run(ThreadPool& pool, std::span<btPersistentManifold* const> manifolds,
           std::span<const std::uint8_t> marks);
  /// Gives late bodies ids from `first_id` on, and the companion ids that belong to them.
  void find_late(std::span<btPersistentManifold* const> manifolds, std::size_t first_id);

  std::span<const ContactRef> contacts() const { return {refs_.data(), count_}; }
  std::span<const cpu::RowPair> pairs() const { return {pairs_.data(), count_}; }
  std::span<const LateBody> late() const { return late_; }
  void forget_late() noexcept { late_.clear(); }
  bool any_rolling() const { return any_rolling_; }
  bool any_anisotropic() const { return any_anisotropic_; }

 private:
  struct Chunk {
    std::uint32_t count;
    bool rolling, late, anisotropic;
  };
  void scan(std::span<btPersistentManifold* const> manifolds, std::size_t chunk,
            std::span<const std::uint8_t> marks);

  Buffer<ContactRef> found_, refs_;
  Buffer<cpu::RowPair> found_pairs_, pairs_;
  Buffer<Chunk> chunks_;
  std::vector<LateBody> late_;
  std::size_t count_ = 0;
  bool any_late_ = false, any_rolling_ = false, any_anisotropic_ = false;
};

/// The object as a body if Bullet's solver takes notice of its motion: it has a finite mass or is
/// kinematic. Else null.
btRigidBody* moving_body(btCollisionObject* object);
std::uint8_t marks_of(const btRigidBody& body);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
