/// What the host has of a World whose state is on a device.
#pragma once

#include "src/world/bodies/bodies_of_step.hpp"
#include "src/world/device/device_world.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Which of the host and the device has the state, what the host has fetched, and what it has yet
/// to send. All but `holder` and `departures` has a meaning while the device has the state.
struct HostMirror {
  enum class Holder { host, device };
  /// What the arrays of the bodies have of the motion on the device.
  enum class Motion {
    stale,
    states,  ///< what BodyState has, of all bodies but those with edits
    all,
  };
  enum class Joints { equal, newer_on_host, newer_on_device };

  bool is_resident() const noexcept { return holder == Holder::device; }

  /// The device has received the state.
  void enter() noexcept {
    holder = Holder::device;
    motion = Motion::all;
    joints = Joints::equal;
    has_contact_set = true;
  }
  /// The host has the state, and the device no longer.
  void leave() noexcept {
    holder = Holder::host;
    ++departures;
    edits.clear();
    changed.clear();
    changed_before.clear();
    joints = Joints::equal;
  }
  /// An edit changes more on the device than BodyState.
  void invalidate_other_motion() noexcept { motion = std::min(motion, Motion::states); }
  /// The device has completed steps.
  void complete_steps(std::uint64_t count, bool any_joints) {
    if (count > 1) changed.clear();  // the step before the last is one of them
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
  BodyEdits edits;  ///< which the device does not have yet
  /// Bodies that contact lists of the last step, and of the step before it, show otherwise than
  /// they are now.
  ListedBodies changed, changed_before;
  /// Bodies whose forces on the host are those of the next step; those of all others are 0 there.
  std::vector<std::uint32_t> forced_bodies;
  /// Number of times that leave() was called.
  std::atomic<std::uint64_t> departures{0};
};

}  // namespace JFPX_ABI
}  // namespace jfpx
