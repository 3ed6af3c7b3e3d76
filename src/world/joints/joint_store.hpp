/// Joints of a world.
#pragma once

#include <jfpx/joint.hpp>

#include "src/contact_solver/soft_step/joint_set.hpp"
#include "src/world/bodies/id_pool.hpp"

#include <cstdint>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// The bodies of a joint, by their indices; b may be soft_step::kWorld.
struct JoinedBodies {
  std::uint32_t a = 0, b = soft_step::kWorld;
  /// Whether the joint connects two bodies that must not collide with each other.
  bool excludes_contacts = false;

  /// Calls f(body) for the bodies, except the world.
  template <class F>
  void for_each(const F& f) const {
    f(a);
    if (b != soft_step::kWorld) f(b);
  }
  /// Whether one of the bodies is movable, which every joint requires. @param bodies a BodyStore
  template <class Bodies>
  bool any_movable(const Bodies& bodies) const {
    bool any = false;
    for_each([&](std::uint32_t body) { any |= bodies.movable(body); });
    return any;
  }
};
JoinedBodies joined_bodies(const Joint& joint) noexcept;

/// Whether a joint has axes, in addition to anchors.
inline bool has_frames(const Joint& joint) noexcept {
  return !std::holds_alternative<DistanceJoint>(joint);
}

/// Owns the joints, their ids, and their impulses and colors for warm starting.
class JointStore {
 public:
  bool empty() const noexcept { return pool_.size() == 0; }
  std::size_t size() const noexcept { return pool_.size(); }
  /// Number of slots; all indices are below it.
  std::size_t capacity() const noexcept { return pool_.capacity(); }
  std::span<const JointId> ids() const noexcept { return pool_.ids(); }
  bool contains(JointId id) const noexcept { return pool_.contains(id); }
  /// Returns the slot of a joint in the store. @throws InvalidArgument for an unknown id
  std::uint32_t require(JointId id) const;
  JointId id(std::uint32_t joint) const { return pool_.id(joint); }
  const Joint& joint(std::uint32_t joint) const { return joints_[joint]; }
  /// Whether any joint has frames.
  bool any_frames() const noexcept;
  const soft_step::KeptJoint& kept(std::uint32_t joint) const { return last_[joint]; }
  const soft_step::JointInput& input(std::uint32_t joint) const { return inputs_[joint]; }

  /// @param joint must have passed validation
  /// @throws std::bad_alloc; the store is then unchanged
  JointId add(const Joint& joint);
  void remove(std::uint32_t joint) noexcept;
  /// Replaces a joint by one of the same type and bodies; keeps the impulses.
  void set(std::uint32_t joint, const Joint& value) noexcept;
  /// Calls f(joint) for all joints of a body, in ascending order. f may remove the joint.
  template <class F>
  void for_each_of(std::uint32_t body, const F& f) const {
    // An iterator to the next entry would not do: it may be that of the joint at its other body.
    for (std::uint64_t next = 0;;) {
      const auto at = of_body_.lower_bound({body, static_cast<std::uint32_t>(next)});
      if (at == of_body_.end() || at->first != body) return;
      const std::uint32_t joint = at->second;
      next = std::uint64_t{joint} + 1;
      f(joint);
    }
  }
  /// Whether a joint excludes contacts of two bodies.
  bool excludes_contacts(std::uint32_t a, std::uint32_t b) const noexcept;

  /// The joints of the next step. Valid until a joint is added or removed.
  soft_step::JointView view();
  /// Completes the step: the impulses of this step become those of the last step.
  void commit() noexcept { last_.swap(now_); }
  /// Impulses and colors of the last step, by slot.
  std::vector<soft_step::KeptJoint>& last() noexcept { return last_; }

  /// Replaces all joints and ids, like IdPool::assign(); restore() adds the joints.
  void assign(const std::vector<std::uint32_t>& generations,
              const std::vector<std::uint32_t>& unused);
  void restore(std::uint32_t slot, const Joint& joint, const soft_step::KeptJoint& kept);
  const std::vector<std::uint32_t>& generations() const noexcept { return pool_.generations(); }
  const std::vector<std::uint32_t>& unused() const noexcept { return pool_.unused(); }

 private:
  using BodyJoints = std::set<std::pair<std::uint32_t, std::uint32_t>>;
  void put(std::uint32_t slot, const Joint& joint) noexcept;

  IdPool<JointId> pool_;
  // By slot.
  std::vector<Joint> joints_;
  std::vector<soft_step::JointInput> inputs_;
  std::vector<soft_step::KeptJoint> last_, now_;
  BodyJoints of_body_;  ///< (body, slot)
};

}  // namespace JFPX_ABI
}  // namespace jfpx
