/// Joints of a world; see the header.
#include "src/world/joints/joint_store.hpp"

#include <jfpx/error.hpp>

#include "src/base/reserve.hpp"

#include <algorithm>
#include <string>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::DistanceInput;
using soft_step::JointInput;

void set_input(const DistanceJoint& joint, JointInput* input) {
  const Real rate = 2 * kPi * joint.hertz;
  input->distance = {.anchor_a = joint.anchor_a,
                     .anchor_b = joint.anchor_b,
                     .min_length = joint.min_length,
                     .max_length = joint.max_length,
                     .rest_length = joint.rest_length,
                     .spring_rate = rate,
                     .damp_rate = 2 * joint.damping_ratio * rate};
}

}  // namespace

JoinedBodies joined_bodies(const Joint& joint) noexcept {
  return std::visit(
      [](const auto& j) {
        return JoinedBodies{j.a.index, j.b ? j.b->index : soft_step::kWorld,
                            j.b.has_value() && !j.collide_connected};
      },
      joint);
}

Real pull_of(const DistanceJoint&, const soft_step::KeptJoint& kept) noexcept {
  const auto& [spring, lower, upper] = kept.impulses;
  return upper - lower - spring;
}

std::uint32_t JointStore::require(JointId id) const {
  if (contains(id)) return id.index;
  throw InvalidArgument("joint id (index " + std::to_string(id.index) + ", generation " +
                        std::to_string(id.generation) +
                        ") is unknown; it must be of a joint of this world");
}

JointId JointStore::add(const Joint& joint) {
  const std::size_t slots = std::max(pool_.capacity(), std::size_t{pool_.next_index()} + 1);
  reserve_geometric(&joints_, slots);
  reserve_geometric(&inputs_, slots);
  reserve_geometric(&last_, slots);
  reserve_geometric(&now_, slots);
  BodyJoints added;
  const JoinedBodies bodies = joined_bodies(joint);
  bodies.for_each([&](std::uint32_t body) { added.emplace(body, pool_.next_index()); });
  if (pool_.is_full()) pool_.add_slot();
  // From here on, nothing throws.
  joints_.resize(slots);
  inputs_.resize(slots);
  last_.resize(slots);
  now_.resize(slots);
  of_body_.merge(added);
  const JointId id = pool_.add();
  last_[id.index] = {};
  put(id.index, joint);
  return id;
}

void JointStore::put(std::uint32_t slot, const Joint& joint) noexcept {
  joints_[slot] = joint;
  const JoinedBodies bodies = joined_bodies(joint);
  inputs_[slot] = {.is_used = 1,
                   .type = static_cast<std::uint32_t>(joint.index()),
                   .a = bodies.a,
                   .b = bodies.b};
  std::visit([&](const auto& j) { set_input(j, &inputs_[slot]); }, joint);
}

void JointStore::remove(std::uint32_t joint) noexcept {
  const JoinedBodies bodies = joined_bodies(joints_[joint]);
  bodies.for_each([&](std::uint32_t body) { of_body_.erase({body, joint}); });
  inputs_[joint] = {};
  last_[joint] = {};
  pool_.remove(id(joint));
}

void JointStore::set(std::uint32_t joint, const Joint& value) noexcept { put(joint, value); }

bool JointStore::excludes_contacts(std::uint32_t a, std::uint32_t b) const noexcept {
  // Traverses the joints of both bodies together, so that the shorter list determines the time.
  auto of_a = of_body_.lower_bound({a, 0}), of_b = of_body_.lower_bound({b, 0});
  const auto is_at = [this](auto at, std::uint32_t body) {
    return at != of_body_.end() && at->first == body;
  };
  const auto excludes = [&](std::uint32_t joint) {
    const JoinedBodies bodies = joined_bodies(joints_[joint]);
    return bodies.excludes_contacts &&
           ((bodies.a == a && bodies.b == b) || (bodies.a == b && bodies.b == a));
  };
  for (; is_at(of_a, a) && is_at(of_b, b); ++of_a, ++of_b) {
    if (excludes(of_a->second) || excludes(of_b->second)) return true;
  }
  return false;
}

soft_step::JointView JointStore::view() {
  return {inputs_.data(), last_.data(), now_.data(), static_cast<std::uint32_t>(inputs_.size())};
}

void JointStore::assign(const std::vector<std::uint32_t>& generations,
                        const std::vector<std::uint32_t>& unused) {
  const std::size_t slots = generations.size();
  pool_.assign(generations, unused);
  joints_.assign(slots, Joint{});
  inputs_.assign(slots, JointInput{});
  last_.assign(slots, soft_step::KeptJoint{});
  now_.assign(slots, soft_step::KeptJoint{});
  of_body_.clear();
}

void JointStore::restore(std::uint32_t slot, const Joint& joint, const soft_step::KeptJoint& kept) {
  const JoinedBodies bodies = joined_bodies(joint);
  of_body_.emplace(bodies.a, slot);
  if (bodies.b != soft_step::kWorld) of_body_.emplace(bodies.b, slot);
  pool_.use(slot);
  put(slot, joint);
  last_[slot] = kept;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
