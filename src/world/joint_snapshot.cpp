/// Writing and checked reading of joints; see the header.
#include "src/world/joint_snapshot.hpp"

#include "src/contact_solver/soft_step/greedy_coloring.hpp"
#include "src/scene/joint_fields.hpp"
#include "src/scene/scene_validate.hpp"
#include "src/world/snapshot_fields.hpp"

#include <string>
#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::KeptJoint;

void serialize_kept(auto& archive, Is<KeptJoint> auto& kept) {
  auto& [impulses, color, unused] = kept;
  archive(impulses[0], impulses[1], impulses[2], color);
}
static_assert(KeptJoint::kMostImpulses == 3);

void check_bodies(const Joint& joint, const BodyStore& bodies) {
  const std::string found = find_fault(joint);
  if (!found.empty()) BinaryReader::fail("joint: " + found);
  std::visit(
      [&](const auto& j) {
        BinaryReader::require(bodies.contains(j.a) && (!j.b || bodies.contains(*j.b)),
                              "a joint is not of bodies of the world");
        BinaryReader::require(bodies.movable(j.a.index) || (j.b && bodies.movable(j.b->index)),
                              "a joint has no movable body");
      },
      joint);
}

/// By body: the set of the colors of its contacts.
std::vector<std::uint64_t> colors_of(const soft_step::ContactSet& contacts, std::size_t bodies) {
  std::vector<std::uint64_t> used(bodies);
  const auto add = [&](const soft_step::ContactKey& key, std::uint8_t color) {
    if (color >= soft_step::kColors) return;
    used[key.a] |= std::uint64_t{1} << color;
    used[key.b] |= std::uint64_t{1} << color;
  };
  const std::size_t spheres = contacts.spheres.size();
  for (std::size_t i = 0; i < spheres; ++i) add(contacts.spheres[i].key, contacts.colors[i]);
  for (std::size_t m = 0; m < contacts.manifolds.size(); ++m) {
    add(contacts.manifolds[m].key, contacts.colors[spheres + m]);
  }
  return used;
}

/// Checks the color of a joint, and adds it to those of its bodies.
void check_color(const JoinedBodies& joined, std::uint32_t color, const BodyStore& bodies,
                 std::vector<std::uint64_t>* used) {
  if (color >= soft_step::kColors) return;
  BinaryReader::require(
      joined.b != soft_step::kWorld && bodies.movable(joined.a) && bodies.movable(joined.b),
      "a joint with an immovable body has a color");
  const std::uint64_t bit = std::uint64_t{1} << color;
  BinaryReader::require((((*used)[joined.a] | (*used)[joined.b]) & bit) == 0,
                        "two joints or contacts of a body have the same color");
  (*used)[joined.a] |= bit;
  (*used)[joined.b] |= bit;
}

}  // namespace

void write_joints(BinaryWriter* writer, const JointStore& joints) {
  BinaryWriter& write = *writer;
  write(joints.generations(), joints.unused(), std::uint64_t{joints.size()});
  for (const JointId id : joints.ids()) {
    write(id.index, joints.joint(id.index));
    serialize_kept(write, joints.kept(id.index));
  }
}

JointStore read_joints(BinaryReader* reader, const soft_step::ContactSet& contacts,
                       BodyStore* bodies) {
  constexpr std::size_t kLeastJointSize = 64;
  JointStore joints;
  const auto generations = reader->get<std::vector<std::uint32_t>>();
  const auto unused = reader->get<std::vector<std::uint32_t>>();
  std::vector<bool> is_free(generations.size());
  for (const std::uint32_t slot : unused) {
    BinaryReader::require(slot < is_free.size() && !is_free[slot],
                          "its list of unused ids of joints is invalid");
    is_free[slot] = true;
  }
  joints.assign(generations, unused);
  std::vector<std::uint64_t> used = colors_of(contacts, bodies->capacity());
  for (std::size_t left = reader->count(kLeastJointSize); left > 0; --left) {
    const auto slot = reader->get<std::uint32_t>();
    BinaryReader::require(slot < is_free.size() && !is_free[slot] &&
                              (joints.empty() || joints.ids().back().index < slot),
                          "its list of joints is invalid");
    const auto joint = reader->get<Joint>();
    KeptJoint kept;
    serialize_kept(*reader, kept);
    check_bodies(joint, *bodies);
    const JoinedBodies joined = joined_bodies(joint);
    check_color(joined, kept.color, *bodies, &used);
    joints.restore(slot, joint, kept);
    if (joined.excludes_contacts) bodies->set_pair_joined({joined.a, joined.b}, true);
  }
  return joints;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
