/// Writing and checked reading of joints; see the header.
#include "src/world/snapshots/joint_snapshot.hpp"

#include "src/scene/joint_fields.hpp"
#include "src/scene/scene_validate.hpp"
#include "src/world/snapshots/snapshot_fields.hpp"

#include <string>
#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::KeptJoint;

void serialize_kept(auto& archive, Is<KeptJoint> auto& kept) {
  auto& [impulses, color, unused] = kept;
  // Those of a DistanceJoint; a joint with frames has more.
  archive(impulses[0], impulses[1], impulses[2], color);
}
/// The other impulses of a joint with frames.
void serialize_frames(auto& archive, Is<KeptJoint> auto& kept) {
  for (std::uint32_t i = 3; i < KeptJoint::kMostImpulses; ++i) archive(kept.impulses[i]);
}

void check_bodies(const Joint& joint, const BodyStore& bodies) {
  const std::string found = find_fault(joint);
  if (!found.empty()) BinaryReader::fail("joint: " + found);
  std::visit(
      [&](const auto& j) {
        BinaryReader::require(bodies.contains(j.a) && (!j.b || bodies.contains(*j.b)),
                              "a joint is not of bodies of the world");
      },
      joint);
  BinaryReader::require(joined_bodies(joint).any_movable(bodies), "a joint has no movable body");
}

}  // namespace

void write_joints(BinaryWriter* writer, const JointStore& joints) {
  BinaryWriter& write = *writer;
  write(joints.generations(), joints.unused(), std::uint64_t{joints.size()});
  for (const JointId id : joints.ids()) {
    write(id.index, joints.joint(id.index));
    serialize_kept(write, joints.kept(id.index));
    if (has_frames(joints.joint(id.index))) serialize_frames(write, joints.kept(id.index));
  }
}

JointStore read_joints(BinaryReader* reader, SnapshotColors* colors, BodyStore* bodies) {
  constexpr std::size_t kLeastJointSize = 64;
  JointStore joints;
  SnapshotSlots slots;
  slots.generations = reader->get<std::vector<std::uint32_t>>();
  slots.read_unused(reader, "its list of unused ids of joints is invalid");
  joints.assign(slots.generations, slots.unused);
  for (std::size_t left = reader->count(kLeastJointSize); left > 0; --left) {
    const auto slot = reader->get<std::uint32_t>();
    BinaryReader::require(slot < slots.is_free.size() && !slots.is_free[slot] &&
                              (joints.empty() || joints.ids().back().index < slot),
                          "its list of joints is invalid");
    const auto joint = reader->get<Joint>();
    KeptJoint kept;
    serialize_kept(*reader, kept);
    if (has_frames(joint)) serialize_frames(*reader, kept);
    check_bodies(joint, *bodies);
    const JoinedBodies joined = joined_bodies(joint);
    colors->add(*bodies, joined.a, joined.b, kept.color,
                {.immovable = "a joint with an immovable body has a color",
                 .same = "two joints or contacts of a body have the same color"});
    joints.restore(slot, joint, kept);
    if (joined.excludes_contacts) bodies->set_pair_joined({joined.a, joined.b}, true);
  }
  return joints;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
