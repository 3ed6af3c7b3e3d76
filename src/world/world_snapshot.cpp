/// Snapshots of a World.
#include <jfpx/error.hpp>

#include "src/world/snapshots/contact_snapshot.hpp"
#include "src/world/snapshots/joint_snapshot.hpp"
#include "src/world/snapshots/snapshot_fields.hpp"
#include "src/world/snapshots/snapshot_file.hpp"
#include "src/world/world_impl.hpp"

#include <new>
#include <string>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

void World::Impl::write(BinaryWriter* writer) {
  (*writer)(scene, steps);
  store.write(writer);
  write_contacts(writer, soft_step.last_contacts());
  const ContactList& list = contact_list();
  (*writer)(list.contacts, std::uint64_t{list.detected}, contacts.shows_list);
  write_forces(writer, forces);
  write_generators(writer, generators);
  const SnapshotParts parts = snapshot_parts();
  if (parts >= SnapshotParts::joints) write_joints(writer, joints);
  if (parts >= SnapshotParts::joints_and_places) store.write_places(writer);
  if (parts >= SnapshotParts::recyclable) write_tests(writer, soft_step.last_contacts());
  if (parts >= SnapshotParts::locks) store.write_locks(writer);
}

SnapshotParts World::Impl::snapshot_parts() const {
  if (store.any_locks()) return SnapshotParts::locks;
  if (joints.any_frames()) return SnapshotParts::frames;
  if (any_recyclable(soft_step.last_contacts())) return SnapshotParts::recyclable;
  if (store.has_blocks() || store.has_places()) return SnapshotParts::joints_and_places;
  return joints.capacity() > 0 ? SnapshotParts::joints : SnapshotParts::none;
}

/// Reads and validates all data before changing the world.
void World::Impl::read(BinaryReader* reader) {
  auto settings = reader->get<Scene>();
  validate(settings);
  const auto steps_before = reader->get<std::uint64_t>();
  BodyStore bodies = empty_store(settings);
  bodies.read(reader);
  SnapshotColors colors(bodies.capacity());
  soft_step::ContactSet last = read_contacts(reader, bodies, &colors);
  ContactList list;
  list.contacts = reader->get<std::vector<Contact>>();
  list.detected = reader->get<std::uint64_t>();
  const bool shown = reader->get<bool>();
  BinaryReader::require(list.detected <= list.contacts.size(),
                        "it has fewer contacts than were detected");
  ForceRestorer new_forces(reader, forces);
  GeneratorRestorer new_generators(reader, generators);
  JointStore new_joints;
  if (reader->left() > 0) new_joints = read_joints(reader, &colors, &bodies);
  if (reader->left() > 0) bodies.read_places(reader);
  if (reader->left() > 0) read_tests(reader, &last);
  if (reader->left() > 0) bodies.read_locks(reader);
  BinaryReader::require(reader->left() == 0, "it is too long");
  BinaryReader::require(new_joints.empty() || settings.solver == Solver::soft_step,
                        "it has joints, and the solver worst_first");
  BinaryReader::require(!bodies.any_locks() || settings.solver == Solver::soft_step,
                        "it has motion locks, and the solver worst_first");

  auto new_worst_first = make_worst_first_step(settings);
  soft_step.reserve(bodies.capacity());

  // From here on, nothing throws.
  scene = std::move(settings);
  worst_first = std::move(new_worst_first);
  drop_queue();
  mirror.leave();
  steps_at_rest = 0;
  if (device != nullptr) device->configure(scene);
  steps = steps_before;
  store = std::move(bodies);
  joints = std::move(new_joints);
  soft_step.restore(scene.soft_step, scene.materials, scene.dt, std::move(last));
  contacts.last.invalidate();
  contacts.last.get([&list](ContactList* restored) { *restored = std::move(list); });
  contacts.by_body.invalidate();
  contacts.has_forces = false;
  contacts.shows_list = shown;
  contacts.shows_events = false;
  new_forces.commit(&forces);
  new_generators.commit(&generators);
  note_change();
  if (ranks != nullptr) ranks->note_restored();
}

Snapshot World::snapshot() const {
  try {
    BinaryWriter writer;
    start_snapshot(&writer);
    impl_->fetch_all();
    impl_->write(&writer);
    return finish_snapshot(&writer, impl_->snapshot_parts());
  } catch (const std::bad_alloc&) {
    throw OutOfMemory("no memory for a snapshot of " + std::to_string(bodies().size()) + " bodies");
  }
}

void World::restore(const Snapshot& snapshot) {
  BinaryReader reader = open_snapshot(snapshot);
  try {
    impl_->read(&reader);
  } catch (const InvalidScene& error) {
    throw InvalidSnapshot(std::string("the snapshot is corrupt: ") + error.what());
  } catch (const std::bad_alloc&) {
    throw OutOfMemory("no memory to restore a world from a snapshot of " +
                      std::to_string(snapshot.bytes.size()) + " bytes");
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
