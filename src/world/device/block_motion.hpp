/// Motion of the bodies of a block during a sweep, in memory that the threads of the block share.
#pragma once

#include "src/contact_solver/soft_step/blocks.hpp"
#include "src/contact_solver/soft_step/colors.hpp"
#include "src/contact_solver/soft_step/row_kinds.hpp"
#include "src/world/device/body_cells.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Indexed by the place of a body in its block.
/// @tparam kKinds number of kinds of rows that occur, which are the first ones
template <soft_step::RowKind kKinds>
class BlockMotion {
  static constexpr std::uint32_t kBodies = soft_step::kBodiesPerBlock;
  static constexpr std::uint32_t kColorEnds = soft_step::kColorsPerClass + 1u;
  struct alignas(4 * sizeof(Real)) Quad {
    Vec3 vector;
    Real scalar;
  };

 public:
  /// Whether a row reads SolverBody::rotation.
  static constexpr bool kHasRotation = kKinds > soft_step::kKindOf<soft_step::SphereRow> + 1;
  static constexpr std::size_t kBytes =
      kBodies * ((kHasRotation ? 4 : 3) * sizeof(Quad) + sizeof(std::uint32_t)) +
      kKinds * kColorEnds * sizeof(std::uint32_t);

  /// @param memory kBytes, aligned to the size of four Reals
  JFPX_HD explicit BlockMotion(void* memory)
      : quads_(static_cast<Quad*>(memory)),
        words_(reinterpret_cast<std::uint32_t*>(quads_ + (kHasRotation ? 4 : 3) * kBodies)) {}

  /// First rows by color, and the end.
  JFPX_HD std::uint32_t* row_begin(std::uint32_t kind) const {
    return words_ + kBodies + kind * kColorEnds;
  }

  JFPX_HD soft_step::SolverBody load(std::uint32_t i) const {
    soft_step::SolverBody body;
    const Quad velocity = quads_[i], angular = quads_[kBodies + i];
    body.velocity = velocity.vector;
    body.inverse_mass = velocity.scalar;
    body.angular_velocity = angular.vector;
    body.inverse_inertia = angular.scalar;
    body.shift = quads_[2 * kBodies + i].vector;
    if constexpr (kHasRotation) body.rotation = quads_[3 * kBodies + i].vector;
    return body;
  }
  JFPX_HD void store_velocities(std::uint32_t i, const soft_step::SolverBody& body) const {
    quads_[i] = {body.velocity, body.inverse_mass};
    quads_[kBodies + i] = {body.angular_velocity, body.inverse_inertia};
  }
  JFPX_HD void store_shift(std::uint32_t i, const soft_step::SolverBody& body) const {
    quads_[2 * kBodies + i] = {body.shift, 0};
  }
  JFPX_HD void store_rotation(std::uint32_t i, const soft_step::SolverBody& body) const {
    if constexpr (kHasRotation) quads_[3 * kBodies + i] = {body.rotation, 0};
  }

  /// What has changed since the motion of a body was read.
  struct Changes {
    bool shift = false, rotation = false;
  };
  JFPX_HD Changes changes(std::uint32_t i) const {
    return {(words_[i] & kShift) != 0, (words_[i] & kRotation) != 0};
  }
  JFPX_HD void set_changes(std::uint32_t i, const Changes& changes) const {
    words_[i] = (changes.shift ? kShift : 0) | (changes.rotation ? kRotation : 0);
  }

 private:
  static constexpr std::uint32_t kShift = 1, kRotation = 2;

  Quad* quads_;
  std::uint32_t* words_;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
