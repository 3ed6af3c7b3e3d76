/// The host's copy of a World whose state is on a device.
#pragma once

#include "src/world/bodies/bodies_of_step.hpp"
#include "src/world/device/device_world.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Tracks whether the host or the device owns the state, which data the host has fetched, and which
/// changes are pending. All members but `holder` and `departures` apply only while the device owns
/// the state.
struct HostMirror {
  enum class Holder { host, device };
  /// Validity of the motion columns on the host.
  enum class Motion {
    stale,
    states,  ///< the columns of BodyState are valid for all bodies without edits
    all,
  };
  enum class Joints { equal, newer_on_host, newer_on_device };

  bool is_resident() const noexcept { return holder == Holder::device; }

  /// Records that the device owns the state, but not the joints.
  void enter() noexcept {
    holder = Holder::device;
    motion = Motion::all;
    joints = Joints::newer_on_host;
    has_contact_set = true;
  }
  /// Records that the host owns the state and the device copy is invalid.
  void leave() noexcept {
    holder = Holder::host;
    ++departures;
    edits.clear();
    changed.clear();
    changed_before.clear();
    joints = Joints::equal;
  }
  /// Records an edit that changes columns outside BodyState on the device.
  void invalidate_other_motion() noexcept { motion = std::min(motion, Motion::states); }
  /// Records completed steps of the device.
  void complete_steps(std::uint64_t count, bool any_joints) {
    if (count > 1) changed.clear();  // the step before the last is part of this call
    changed_before.swap(changed);
    changed.clear();
    forced_bodies.clear();
    motion = Motion::stale;
    has_contact_set = false;
    joints = any_joints ? Joints::newer_on_device : Joints::equal;
  }

  Holder holder = Holder::host;
  Motion motion = Motion::all;
  Joints joints = Joints::equal;
  bool has_contact_set = true;
  BodyEdits edits;  ///< pending edits
  /// Former values of bodies that have changed since the last step, or since the step before it,
  /// for their contact lists.
  ListedBodies changed, changed_before;
  /// Bodies with accumulated forces on the host; the host columns are 0 for all other bodies.
  std::vector<std::uint32_t> forced_bodies;
  /// Number of times that leave() was called.
  std::atomic<std::uint64_t> departures{0};
};

}  // namespace JFPX_ABI
}  // namespace jfpx
