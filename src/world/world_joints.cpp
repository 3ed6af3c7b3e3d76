/// Joints of a World.
#include <jfpx/error.hpp>

#include "src/scene/scene_validate.hpp"
#include "src/world/joints/joint_state.hpp"
#include "src/world/world_impl.hpp"

#include <string>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

void require_valid(const BodyStore& bodies, const Joint& joint) {
  std::string found = find_fault(joint);
  if (!found.empty()) throw InvalidArgument("joint: " + found);
  std::visit(
      [&](const auto& j) {
        bodies.require(j.a);
        if (j.b) bodies.require(*j.b);
      },
      joint);
  if (joined_bodies(joint).any_movable(bodies)) return;
  throw InvalidArgument("joint: both bodies have mass 0; one of them must be movable");
}

}  // namespace

/// Prepares a change of joints of two bodies, so that the change cannot fail.
void World::Impl::begin_joint_edit(const JoinedBodies& joined) {
  begin_edit();
  fetch_joints();
  if (joined.excludes_contacts) {
    edited_body_in_lists(joined.a, {.sets_pairs = true});
    edited_body_in_lists(joined.b, {});
  }
  joined.for_each([this](std::uint32_t body) { edited_body(body, {}); });
}

void World::Impl::complete_joint_edit(const JoinedBodies& joined) {
  if (ranks != nullptr) ranks->note_change();
  mirror.joints = HostMirror::Joints::newer_on_host;
  joined.for_each([this](std::uint32_t body) { wake(body); });
}

JointId World::Impl::add_joint(const Joint& joint) {
  const JoinedBodies joined = joined_bodies(joint);
  begin_joint_edit(joined);
  const bool is_new_pair =
      joined.excludes_contacts && !joints.excludes_contacts(joined.a, joined.b);
  if (is_new_pair) store.set_pair_joined({joined.a, joined.b}, true);
  JointId id;
  try {
    id = joints.add(joint);
  } catch (...) {
    if (is_new_pair) store.set_pair_joined({joined.a, joined.b}, false);
    throw;
  }
  complete_joint_edit(joined);
  return id;
}

void World::Impl::remove_joint(std::uint32_t joint) {
  const JoinedBodies joined = joined_bodies(joints.joint(joint));
  begin_joint_edit(joined);
  joints.remove(joint);
  if (joined.excludes_contacts && !joints.excludes_contacts(joined.a, joined.b)) {
    store.set_pair_joined({joined.a, joined.b}, false);
  }
  complete_joint_edit(joined);
}

void World::Impl::set_joint(std::uint32_t joint, const Joint& value) {
  const bool excluded = joined_bodies(joints.joint(joint)).excludes_contacts;
  const auto [a, b, excludes] = joined_bodies(value);
  begin_joint_edit({a, b, excluded || excludes});
  if (excludes) store.set_pair_joined({a, b}, true);
  joints.set(joint, value);
  if (excluded && !joints.excludes_contacts(a, b)) store.set_pair_joined({a, b}, false);
  complete_joint_edit({a, b, excludes});
}

void World::Impl::require_other_movable(std::uint32_t body) const {
  joints.for_each_of(body, [&](std::uint32_t joint) {
    bool any_other = false;
    joined_bodies(joints.joint(joint)).for_each([&](std::uint32_t i) {
      any_other |= i != body && store.movable(i);
    });
    if (any_other) return;
    throw InvalidArgument("mass is 0; it must be > 0, because joint " + std::to_string(joint) +
                          " has no other movable body");
  });
}

/// Removes the joints of a body before its removal, and wakes the bodies joined with it.
void World::Impl::remove_joints_of(std::uint32_t body) {
  bool any = false;
  joints.for_each_of(body, [&](std::uint32_t joint) {
    if (!any) fetch_joints();
    any = true;
    joined_bodies(joints.joint(joint)).for_each([&](std::uint32_t i) {
      if (i != body) edited_body(i, {});
    });
  });
  if (!any) return;
  // From here on, nothing throws.
  mirror.joints = HostMirror::Joints::newer_on_host;
  joints.for_each_of(body, [&](std::uint32_t joint) {
    const JoinedBodies joined = joined_bodies(joints.joint(joint));
    joints.remove(joint);
    joined.for_each([&](std::uint32_t i) {
      if (i != body) wake(i);
    });
  });
}

void World::Impl::fetch_joints() {
  collect();
  const std::lock_guard lock(fetching);
  if (mirror.joints != HostMirror::Joints::newer_on_device) return;
  device->fetch_joints(&joints);
  mirror.joints = HostMirror::Joints::equal;
}

void World::Impl::flush_joints() {
  if (mirror.joints != HostMirror::Joints::newer_on_host) return;
  device->upload_joints(&joints);
  mirror.joints = HostMirror::Joints::equal;
}

JointId World::add_joint(const Joint& joint) {
  if (impl_->scene.solver != Solver::soft_step) {
    throw InvalidArgument(
        "the solver is worst_first; it must be soft_step for a world with joints");
  }
  require_valid(impl_->store, joint);
  return impl_->add_joint(joint);
}

void World::remove_joint(JointId id) { impl_->remove_joint(impl_->joints.require(id)); }

std::span<const JointId> World::joints() const { return impl_->joints.ids(); }

bool World::contains_joint(JointId id) const noexcept { return impl_->joints.contains(id); }

const Joint& World::joint(JointId id) const {
  return impl_->joints.joint(impl_->joints.require(id));
}

void World::set_joint(JointId id, const Joint& joint) {
  const std::uint32_t slot = impl_->joints.require(id);
  require_valid(impl_->store, joint);
  const Joint& replaced = impl_->joints.joint(slot);
  const JoinedBodies old = joined_bodies(replaced), now = joined_bodies(joint);
  if (replaced.index() != joint.index() || old.a != now.a || old.b != now.b) {
    throw InvalidArgument("joint: its type and its bodies must be those of the joint it replaces");
  }
  impl_->set_joint(slot, joint);
}

JointState World::joint_state(JointId id) const {
  const std::uint32_t slot = impl_->joints.require(id);
  const BodyStore& bodies = impl_->bodies_with_states();
  impl_->fetch_joints();
  const auto state_of = [&](std::uint32_t body) {
    return body == soft_step::kWorld ? BodyState{} : bodies.state(body);
  };
  const JointStore& joints = impl_->joints;
  const JoinedBodies joined = joined_bodies(joints.joint(slot));
  return jfpx::joint_state(joints.joint(slot), joints.input(slot), joints.kept(slot),
                           state_of(joined.a), state_of(joined.b),
                           impl_->scene.dt / static_cast<Real>(impl_->scene.soft_step.substeps));
}

}  // namespace JFPX_ABI
}  // namespace jfpx
