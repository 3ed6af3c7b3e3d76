/// A world on a device: its memory, and the sequence of the programs of a step.
#pragma once

#include <jfpx/error.hpp>

#include "src/world/device/body_buffers.hpp"
#include "src/world/device/commit_program.hpp"
#include "src/world/device/contact_buffers.hpp"
#include "src/world/device/contact_programs.hpp"
#include "src/world/device/edit_program.hpp"
#include "src/world/device/force_buffers.hpp"
#include "src/world/device/match_program.hpp"
#include "src/world/device/merge_program.hpp"
#include "src/world/device/prepare_program.hpp"
#include "src/world/device/scratch_buffers.hpp"
#include "src/world/device/solve_program.hpp"
#include "src/world/device/sub_shape_buffers.hpp"
#include "src/world/device_world.hpp"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

inline constexpr int kMarks = 4;

/// @tparam Device owns a stream of work, or imitates one on the host:
///   - `number()`, `stream()`: as cuda::DeviceStates;
///   - `Buffer<T>`: array in the memory of the device; data(), capacity();
///   - `reserve(&buffer, count, what)`: makes the capacity at least `count`, discards the contents;
///   - `upload(to, from, count)`, `download(to, from, count)`, `copy(to, from, count)`;
///   - `find_pairs(spheres, n, pairs, capacity, count)`: as cuda::DeviceSphereCollider;
///   - `run(program, items)`: runs program(team) with about one thread per item;
///   - `wait()`: until all work is complete;
///   - `mark(i)`: marks a point of the work, i < kMarks; `elapsed_ms(i, j)`: the time between two
///     points, once all work is complete.
template <class Device>
class DeviceStep final : public DeviceWorld {
 public:
  DeviceStep(const Scene& scene, std::unique_ptr<Device> device)
      : device_(std::move(device)), transfer_(device_.get()) {
    configure(scene);
  }

  void configure(const Scene& scene) noexcept override {
    data_.materials = scene.materials;
    data_.constants = soft_step::make_step_constants(scene.soft_step, scene.dt);
    data_.substeps = scene.soft_step.substeps;
    data_.step.h = data_.constants.h;
    data_.near.largest_margin = scene.soft_step.speculative_margin * Real(0.5);
  }

  void upload(const BodyStore& bodies, SubShapeTable* sub_shapes,
              soft_step::ContactSet* last) override {
    if (bodies.capacity() > room_) {
      room_ = room_ == 0 ? bodies.capacity() : bodies.capacity() + bodies.capacity() / 2;
    }
    bodies_.upload(transfer_, bodies, room_, &data_);
    scratch_.reserve_bodies(transfer_, room_, &data_);
    current_sub_shapes().upload(transfer_, sub_shapes->view(), sub_shapes->part_count());
    use_sub_shapes();
    most_parts_ = 2 * sub_shapes->part_count() + 4096;
    last_contacts().upload(transfer_, last->view(), room_);
    forces_.clear();
    device_->wait();
  }

  void upload_forces(const BodyStore& bodies) override {
    bodies_.upload_forces(transfer_, bodies.moving);
    device_->wait();
  }

  bool has_room(std::size_t slots) const noexcept override {
    return slots <= room_ && sub_shapes_[sub_shapes_now_].part_count() <= most_parts_;
  }

  void edit(const BodyStore& bodies, const BodyEdits& edits) override {
    const BodyView from = bodies.view_without_ids();
    std::vector<EditedBody> edited;
    std::vector<EditedMass> masses;
    std::vector<SlotValues> replaced;
    std::vector<std::uint32_t> changed;  // slots whose body has come or gone
    std::vector<BodyId> added;
    edited.reserve(edits.size());
    bool visits_contacts = false, sets_pairs = false;
    for (const auto& [i, edit] : edits) {
      visits_contacts |= edit.wakes_neighbors || edit.is_removed;
      sets_pairs |= edit.sets_pairs || edit.is_removed;
      edited.push_back({i, edit.sets_state, edit.wakes, edit.wakes_neighbors, edit.is_removed,
                        bodies.state(i), from.inverse_inertia[i], from.force[i], from.torque[i],
                        from.acceleration[i], from.velocity_kept[i], from.angular_velocity_kept[i],
                        from.friction[i], from.restitution[i], from.filter[i]});
      if (edit.is_added || edit.is_removed) {
        changed.push_back(i);
        if (edit.is_added) added.push_back(bodies.id(i));
        replaced.push_back(edit.is_added ? slot_values(bodies, from, i) : unused_slot(i));
        replaced.back().has_no_contacts = true;
      } else if (edit.sets_state && !bodies.movable(i)) {  // awake depends on the velocities
        replaced.push_back(slot_values(bodies, from, i));
      } else if (edit.sets_mass) {
        masses.push_back({i, from.inverse_mass[i], from.body_inverse_inertia[i], from.tensor[i]});
      }
    }
    data_.step.bodies.capacity = from.capacity;
    data_.step.bodies.filters_in_use = from.filters_in_use;
    if (sets_pairs) bodies_.update_pairs(transfer_, from, &data_.step.bodies);
    const Contacts& last = last_contacts();
    data_.last = last.view();
    device_->run(
        EditProgram{data_, bodies_.properties(), transfer_.put(&edits_, edited),
                    static_cast<std::uint32_t>(edited.size()), transfer_.put(&masses_, masses),
                    static_cast<std::uint32_t>(masses.size()), transfer_.put(&replaced_, replaced),
                    static_cast<std::uint32_t>(replaced.size()), visits_contacts, last.touches(),
                    last.touch_count()},
        visits_contacts ? std::max(last.sphere_count(), edited.size()) : edited.size());
    if (!changed.empty()) merge(bodies, changed, &added);
  }

  Result step(const ForceTable* forces, double time) override {
    select_forces(forces, time);
    ++data_.number;
    const Counters counters = run_until_complete();
    Result result;
    result.must_wake = counters.must_wake != 0;
    if (result.must_wake) return result;
    result.invalid_bounds = counters.invalid_bounds != 0;
    if (counters.runaway != kNone) result.runaway = counters.runaway;
    if (result.invalid_bounds || result.runaway) {
      bodies_.restore(transfer_, data_);
      device_->wait();
      return result;
    }
    contacts_[now_].complete(counters);
    now_ = 1 - now_;
    if (forces != nullptr) result.forces_ms = device_->elapsed_ms(0, 1);
    result.detect_ms = device_->elapsed_ms(1, 2);
    result.resolve_ms = device_->elapsed_ms(2, 3);
    result.awake = counters.awake;
    result.contacts =
        std::uint64_t{counters.touching_spheres} + counters.touches + counters.met_points;
    result.sphere_contacts = std::uint64_t{counters.touching_spheres} + counters.sphere_touches;
    return result;
  }

  cuda::DeviceStates states() const noexcept override {
    const BodyView& bodies = data_.step.bodies;
    return {device_->number(),  device_->stream(), bodies.capacity,
            bodies.count,       bodies.ids,        bodies.position,
            bodies.orientation, bodies.velocity,   bodies.angular_velocity};
  }

  Vec3 fetch_position(std::uint32_t body) override {
    Vec3 position;
    device_->download(&position, data_.step.motion.position + body, 1);
    device_->wait();
    return position;
  }

  void fetch_motion(MotionArrays* moving) override {
    bodies_.fetch_motion(transfer_, moving);
    device_->wait();
  }

  void fetch_contact_set(soft_step::ContactSet* last) override {
    last_contacts().fetch(transfer_, last);
  }

  void fetch_contacts(const BodiesOfStep& bodies, bool of_step_before, soft_step::ContactSet* set,
                      DetectedContacts* detected) override {
    const Contacts& from = of_step_before ? contacts_[now_] : last_contacts();
    from.fetch(transfer_, set);
    from.fetch_detected(transfer_, bodies, detected);
  }

  Device& device() { return *device_; }

 private:
  using Contacts = ContactBuffers<Device>;
  using SubShapes = SubShapeBuffers<Device>;
  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  SubShapes& current_sub_shapes() { return sub_shapes_[sub_shapes_now_]; }
  void use_sub_shapes() {
    data_.near.sub_shapes = current_sub_shapes().view();
    scratch_.reserve_sub_shapes(transfer_, current_sub_shapes().counts().bounded(), &data_);
  }

  /// Updates the ids and the sub-shapes. Waits.
  /// @param changed slots whose body has come or gone
  /// @param added   the bodies that have come, in any order
  void merge(const BodyStore& bodies, const std::vector<std::uint32_t>& changed,
             std::vector<BodyId>* added) {
    std::ranges::sort(*added, {}, &BodyId::index);
    SubShapeTable table;
    table.set_bodies(bodies, *added);
    added_shapes_.upload(transfer_, table.view(), table.part_count());
    SubShapes &before = current_sub_shapes(), &after = sub_shapes_[1 - sub_shapes_now_];
    SubShapeCounts* kept = transfer_.room(&kept_shapes_, 1);
    device_->run(MergeProgram{.data = data_,
                              .changed = transfer_.put(&changed_, changed),
                              .changed_count = static_cast<std::uint32_t>(changed.size()),
                              .added_ids = transfer_.put(&added_ids_, *added),
                              .added_id_count = static_cast<std::uint32_t>(added->size()),
                              .to_ids = bodies_.other_ids(transfer_, bodies.size()),
                              .added = added_shapes_.view(),
                              .part_count = before.part_count(),
                              .added_part_count = added_shapes_.part_count(),
                              .to = after.reserve(transfer_, before, added_shapes_),
                              .kept = kept},
                 std::max(data_.step.bodies.count, before.counts().all()));
    SubShapeCounts counts;
    device_->download(&counts, kept, 1);
    device_->wait();
    after.complete(counts + added_shapes_.counts());
    sub_shapes_now_ = 1 - sub_shapes_now_;
    use_sub_shapes();
    bodies_.swap_ids(bodies.size(), &data_.step.bodies);
  }

  /// Between two steps, contacts_[now_] are those of the step before the last.
  Contacts& last_contacts() { return contacts_[1 - now_]; }

  /// Selects what acts in a step, apart from accumulated forces. @param table null: nothing
  void select_forces(const ForceTable* table, double time) {
    BodyView& bodies = data_.step.bodies;
    bodies.force = bodies_.force();
    bodies.torque = bodies_.torque();
    force_sum_ = torque_sum_ = nullptr;
    if (table == nullptr) return;
    forces_.upload(transfer_, *table);
    time_ = time;
    force_sum_ = forces_.force_sums(transfer_, bodies.capacity);
    torque_sum_ = forces_.torque_sums(transfer_, bodies.capacity);
    bodies.force = force_sum_;
    bodies.torque = torque_sum_;
  }

  /// Grows the lists that were too short, and some more.
  void make_room(const Capacity& needed) {
    const auto grow = [](auto* capacity, auto count) {
      if (count > *capacity) *capacity = count + count / 4 + 64;
    };
    grow(&capacity_.pairs, needed.pairs);
    grow(&capacity_.spheres, needed.spheres);
    grow(&capacity_.candidates, needed.candidates);
    grow(&capacity_.points, needed.points);
    grow(&capacity_.touches, needed.touches);
  }

  void run_programs() {
    data_.capacity = capacity_;
    scratch_.reserve_lists(transfer_, capacity_, &data_);
    contacts_[now_].reserve(transfer_, capacity_, room_, &data_);
    const Contacts& last = last_contacts();
    data_.last = last.view();
    data_.near.bodies = data_.step.bodies;
    const StepData& d = data_;
    const std::size_t bodies = d.step.bodies.count;
    const std::size_t sub_shapes = d.near.sub_shapes.bounded_count;
    const std::size_t contacts = std::max({bodies, last.sphere_count(), last.manifold_count()});
    const bool forces_act = force_sum_ != nullptr;
    if (forces_act) {
      device_->mark(0);
      device_->run(ForceProgram{d, forces_.view(), time_, force_sum_, torque_sum_}, bodies);
    }
    device_->mark(1);
    device_->run(BoundsProgram{d, forces_act}, std::max(bodies, sub_shapes));
    device_->find_pairs(d.near.swept, d.near.sub_shapes.fixed_begin, d.pairs, capacity_.pairs,
                        d.pair_count);
    device_->run(SphereProgram{d}, contacts);
    device_->run(ShapeProgram{d}, contacts);
    device_->run(MatchProgram{d}, contacts);
    device_->mark(2);
    device_->run(PrepareProgram{d}, contacts);
    device_->run(SolveProgram{d}, contacts);
    device_->run(CommitProgram{d}, contacts);
    device_->mark(3);
  }

  Counters counters() {
    Counters result;
    device_->download(&result, data_.counters, 1);
    device_->wait();
    return result;
  }

  /// Runs the programs, again with more room if a list was too short. If the device fails, restores
  /// the state, unless the step was already complete.
  Counters run_until_complete() {
    for (;;) {
      try {
        run_programs();
        const Counters result = counters();
        if (result.failed == 0) return result;
        bodies_.restore(transfer_, data_);
        if (result.must_wake != 0) return result;
        make_room(result.needed);
      } catch (...) {
        device_->wait();
        const Counters result = counters();
        if (result.completed == data_.number) return result;
        if (result.started == data_.number) bodies_.restore(transfer_, data_);
        device_->wait();
        throw;
      }
    }
  }

  std::unique_ptr<Device> device_;
  Transfer<Device> transfer_;
  StepData data_;
  Capacity capacity_;
  BodyBuffers<Device> bodies_;
  SubShapes sub_shapes_[2], added_shapes_;
  int sub_shapes_now_ = 0;  ///< which of the two are those of the bodies
  ForceBuffers<Device> forces_;
  Contacts contacts_[2];
  int now_ = 0;  ///< the contacts of the step in progress; the others are those of the last step
  ScratchBuffers<Device> scratch_;
  std::size_t room_ = 0;        ///< number of slots that the buffers of bodies have memory for
  std::size_t most_parts_ = 0;  ///< of compounds, with those that were removed
  // Of edit().
  Buffer<EditedBody> edits_;
  Buffer<EditedMass> masses_;
  Buffer<SlotValues> replaced_;
  Buffer<std::uint32_t> changed_;
  Buffer<BodyId> added_ids_;
  Buffer<SubShapeCounts> kept_shapes_;
  // Of the step in progress.
  double time_ = 0;
  Vec3 *force_sum_ = nullptr, *torque_sum_ = nullptr;  ///< null if no force of the table acts
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
