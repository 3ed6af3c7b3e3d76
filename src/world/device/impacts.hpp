/// Impacts of rows of spheres on a device; see soft_step::rebound().
#pragma once

#include "src/world/device/body_cells.hpp"
#include "src/world/device/striped_array.hpp"
#include "src/world/step/soft_step_stages.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Accelerations of the bodies of a row.
struct Accelerations {
  const StripedArray<soft_step::SubstepBody>& bodies;
  std::uint32_t first;  ///< solver index of the body of index 0

  JFPX_HD Vec3 operator[](std::uint32_t i) const { return bodies.load(first + i).acceleration; }
};

/// The free motion of a body after the rows of a sweep.
template <class Cells>
struct BodyFree {
  bool is_read = false, is_changed = false;
  soft_step::FreeMotion motion;

  JFPX_HD void read(const Cells& cells, const typename Cells::Version& version) {
    if (!is_read) motion = cells.read_free(version);
    is_read = true;
  }
};

/// The impact of a row that publishes the motion of its bodies as cells: it changes their free
/// motion before it publishes the velocities.
class PendingImpact {
 public:
  Accelerations acceleration;

  /// @param a body a of the row
  JFPX_HD PendingImpact(const Accelerations& of_bodies, const CellColumns&, std::uint32_t a)
      : acceleration(of_bodies), a_(a) {}

  JFPX_HD void add(std::uint32_t body, const Vec3& change, const Vec3& spun) const {
    is_pending_ = true;
    (body == a_ ? of_a_ : of_b_) = {change, spun};
  }
  /// Writes the free motion of a body of the row, if it has changed.
  JFPX_HD void write(std::uint32_t body, const BodyCells& cells,
                     BodyCells::Version* version) const {
    if (!is_pending_) return;
    const soft_step::FreeMotion change = body == a_ ? of_a_ : of_b_;
    soft_step::FreeMotion free = cells.read_free(*version);
    free.add(change.velocity, change.angular_velocity);
    cells.write_free(free, version);
  }
  /// Changes the free motion of body a, of a row with a fixed body.
  JFPX_HD void change(BodyFree<BodyCells>* free, const BodyCells& cells,
                      const BodyCells::Version& version) const {
    if (!is_pending_) return;
    free->read(cells, version);
    free->motion.add(of_a_.velocity, of_a_.angular_velocity);
    free->is_changed = true;
  }

 private:
  std::uint32_t a_;
  mutable bool is_pending_ = false;
  mutable soft_step::FreeMotion of_a_ = {}, of_b_ = {};
};

/// The impact of a row in a world with blocks, where only one row at a time accesses a body: it
/// changes the free motion at once, so that the change is not in registers until the row ends.
class DirectImpact {
 public:
  Accelerations acceleration;

  JFPX_HD DirectImpact(const Accelerations& of_bodies, const CellColumns& columns, std::uint32_t)
      : acceleration(of_bodies), columns_(columns) {}

  JFPX_HD void add(std::uint32_t body, const Vec3& change, const Vec3& spun) const {
    const BodyMotion stored(columns_, acceleration.first + body);
    soft_step::FreeMotion free = stored.read_free({});
    free.add(change, spun);
    stored.write_free(free);
    has_added_ = true;
  }
  /// Nothing is left to write.
  JFPX_HD void write(std::uint32_t, const BodyMotion&, BodyMotion::Version*) const {}
  /// Reads the free motion of body a again if it was read before the impact.
  JFPX_HD void change(BodyFree<BodyMotion>* free, const BodyMotion& stored,
                      const BodyMotion::Version& version) const {
    if (has_added_ && free->is_read) free->motion = stored.read_free(version);
  }

 private:
  const CellColumns& columns_;
  mutable bool has_added_ = false;
};

/// @tparam Cells BodyCells or BodyMotion
template <class Cells>
struct ImpactOf {
  using Type = PendingImpact;
};
template <>
struct ImpactOf<BodyMotion> {
  using Type = DirectImpact;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
