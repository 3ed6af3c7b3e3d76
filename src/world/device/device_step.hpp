/// A world on a device: its memory, and the sequence of the programs of a step.
#pragma once

#include <jfpx/error.hpp>

#include "src/world/device/block_solve_program.hpp"
#include "src/world/device/body_buffers.hpp"
#include "src/world/device/commit_program.hpp"
#include "src/world/device/contact_buffers.hpp"
#include "src/world/device/contact_programs.hpp"
#include "src/world/device/device_world.hpp"
#include "src/world/device/edit_program.hpp"
#include "src/world/device/fixed_tree_buffers.hpp"
#include "src/world/device/force_buffers.hpp"
#include "src/world/device/joint_buffers.hpp"
#include "src/world/device/match_program.hpp"
#include "src/world/device/merge_program.hpp"
#include "src/world/device/prepare_program.hpp"
#include "src/world/device/scratch_buffers.hpp"
#include "src/world/device/solve_program.hpp"
#include "src/world/device/step_divider.hpp"
#include "src/world/device/sub_shape_buffers.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

inline constexpr int kMarks = 4;

/// @tparam Device owns a stream of work, or emulates one on the host:
///   - `number()`, `stream()`: see cuda::DeviceStates; `parts()`: largest StepData::parts;
///     `part_state(part)`: uninitialized, in the memory of the device of a part;
///   - `divide(parts, divisions)`: selects the devices of arrays that are reserved later, and moves
///     the pages of the others, with their addresses and contents; waits if there are several
///     parts;
///   - `Buffer<T>`: array in the memory of the device; data(), capacity(), swap();
///   - `reserve(&buffer, count, what, layout)`, `reserve_exactly(&buffer, count, what, layout)`:
///     make the capacity at least `count`, with and without slack, and discard the contents of a
///     smaller buffer; `release_unused()`: gives memory of smaller buffers back;
///   - `upload(to, from, count)`, `download(to, from, count)`, `copy(to, from, count)`;
///   - `fetch(copies, pool)`: performs HostCopies, and waits;
///   - `find_pairs(spheres, n, pairs, capacity, count)`: see cuda::DeviceSphereCollider, after
///     `reserve_pairs(n, capacity)`;
///   - `run(program, items, parts)`: runs program(team) with about one thread per item, or as many
///     as Program::kThreadsPerItem asks for, on one device or on all, each with its StepData::part;
///   - `wait()`: waits for all work; `wait_for_graphs()`: waits for all launched graphs;
///   - `fork(stream)`: later work of this object waits for earlier work of `stream`;
///     `join(stream)`: later work of `stream` waits for earlier work of this object;
///   - `is_capturing(stream)`: whether the stream is being captured; `capture(stream, work)`: calls
///     work(), whose programs and searches become part of the graph;
///   - `mark(i)`: records an event, i < kMarks; `elapsed_ms(i, j)`: the time between two events,
///     once all work is complete.
template <class Device>
class DeviceStep final : public DeviceWorld {
 public:
  DeviceStep(const Scene& scene, std::unique_ptr<Device> device)
      : device_(std::move(device)), transfer_(device_.get()), edit_transfer_(device_.get()) {
    for (std::uint32_t part = 0; part < device_->parts(); ++part) {
      data_.states[part] = device_->part_state(part);
    }
    configure(scene);
  }

  void configure(const Scene& scene) noexcept override {
    data_.materials = scene.materials;
    data_.constants = soft_step::make_step_constants(scene.soft_step, scene.dt);
    data_.substeps = scene.soft_step.substeps;
    data_.step.h = data_.constants.h;
    data_.swept_bounds.largest_margin = scene.soft_step.speculative_margin * Real(0.5);
  }

  void upload(const BodyStore& bodies, SubShapeTable* sub_shapes, soft_step::ContactSet* last,
              bool keeps_velocities) override {
    if (bodies.capacity() > room_) {
      room_ = room_ == 0 ? bodies.capacity() : bodies.capacity() + bodies.capacity() / 2;
    }
    const soft_step::ContactView kept = last->view();
    data_.parts = bodies.has_blocks() ? device_->parts() : 1;
    const auto slots = static_cast<std::uint32_t>(bodies.capacity());
    divider_.start(&data_, slots, {kept.sphere_count, kept.manifold_count, 0, 0});
    divider_.scale(&data_, slots, static_cast<std::uint32_t>(bodies.size()),
                   sub_shapes->view().ranges.bounded());
    device_->divide(data_.parts, data_.divisions);
    has_numbers_ = false;
    bodies_.upload(transfer_, bodies, room_, &data_);
    scratch_.reserve_bodies(transfer_, room_, &data_);
    hulls_.clear();
    current_sub_shapes().upload(transfer_, sub_shapes->view(), sub_shapes->part_count(), &hulls_);
    use_sub_shapes();
    trees_.clear();
    update_trees(bodies);
    known_ = sent_ = {};
    last_contacts().upload(transfer_, kept, room_);
    for (Contacts& contacts : contacts_) contacts.keep_velocities(keeps_velocities);
    known_.contacts[1 - now()] = last_contacts().sizes();
    Counters counters;
    counters.progress = known_;
    device_->upload(data_.counters, &counters, 1);
    forces_.clear();
    has_stepped_ = is_ready_ = false;
    ++changes_;
    device_->wait();
  }

  void upload_joints(JointStore* joints) override {
    joints_.upload(transfer_, joints->view(), 1 - now(), room_, device_->parts(), &data_);
    load_solver();
    is_ready_ = false;
    ++changes_;
  }

  void upload_forces(const BodyStore& bodies) override {
    bodies_.upload_forces(transfer_, bodies.moving);
    device_->wait();
  }

  bool has_room(std::size_t slots) const noexcept override {
    return slots <= room_ && sub_shapes_[sub_shapes_now_].has_room();
  }

  void edit(const BodyStore& bodies, const BodyEdits& edits) override {
    const BodyView from = bodies.view_without_ids();
    std::vector<EditedBody> edited;
    std::vector<EditedMass> masses;
    std::vector<SlotValues> replaced;
    std::vector<std::uint32_t> changed;  // slots whose body was added or removed
    std::vector<BodyId> added;
    edited.reserve(edits.size());
    bool visits_contacts = false, sets_pairs = false;
    for (const auto& [i, edit] : edits) {
      visits_contacts |= edit.wakes_neighbors || edit.is_removed;
      sets_pairs |= edit.sets_pairs || edit.is_removed;
      edited.push_back({i, edit.sets_state, edit.wakes, edit.wakes_neighbors, edit.is_removed,
                        bodies.state(i), from.inverse_inertia[i], from.force[i], from.torque[i],
                        slot_values(from, i).properties});
      if (edit.is_added || edit.is_removed) {
        changed.push_back(i);
        if (edit.is_added) added.push_back(bodies.id(i));
        replaced.push_back(edit.is_added ? slot_values(from, i) : unused_slot(i));
        replaced.back().has_no_contacts = true;
      } else if (edit.sets_state && !bodies.movable(i)) {  // awake depends on the velocities
        replaced.push_back(slot_values(from, i));
      } else if (edit.sets_mass) {
        masses.push_back({i, slot_values(from, i).inertia});
      }
    }
    BodyView& to = data_.step.bodies;
    if (to.any_locks != from.any_locks || to.filters_in_use != from.filters_in_use ||
        to.ignored_count != from.ignored_count || to.joined_count != from.joined_count) {
      ++changes_;
    }
    to.capacity = from.capacity;
    to.movable_count = from.movable_count;
    to.has_blocks = from.has_blocks;
    load_solver();
    to.filters_in_use = from.filters_in_use;
    to.any_locks = from.any_locks;
    if (sets_pairs) bodies_.update_pairs(transfer_, from, &to);
    const Contacts& last = last_contacts();
    const std::size_t spheres = last.sizes().spheres;
    use_contacts();
    is_ready_ = false;  // until prepare() has waited for the edits
    device_->run(
        EditProgram{data_, bodies_.properties(), edit_transfer_.put(&edits_, edited),
                    static_cast<std::uint32_t>(edited.size()), edit_transfer_.put(&masses_, masses),
                    static_cast<std::uint32_t>(masses.size()),
                    edit_transfer_.put(&replaced_, replaced),
                    static_cast<std::uint32_t>(replaced.size()), visits_contacts, last.touches(),
                    last.sizes().touches},
        visits_contacts ? std::max(spheres, edited.size()) : edited.size());
    if (!changed.empty()) merge(bodies, changed, &added);
    update_trees(bodies);
  }

  Result step(const ForceTable* forces, std::uint64_t steps) override {
    const std::uint64_t before = known_.completed;
    select_forces(forces);
    release(steps);
    const Counters counters = run_until_complete();
    Result result;
    if (known_.completed == before) {
      result.must_wake = counters.must_wake != 0;
      result.invalid_bounds = counters.invalid_bounds != 0;
      if (counters.runaway != kNone) result.runaway = counters.runaway;
      return result;
    }
    result = result_of(counters);
    if (forces != nullptr) result.forces_ms = device_->elapsed_ms(0, 1);
    result.detect_ms = device_->elapsed_ms(1, 2);
    result.resolve_ms = device_->elapsed_ms(2, 3);
    return result;
  }

  void prepare(const ForceTable* forces, std::uint64_t steps) override {
    if (is_prepared(forces, steps)) return;
    select_forces(forces);
    release(steps);
    make_room();
    device_->wait();
  }

  void enqueue(const ForceTable* forces, std::uint64_t steps, cuda::Stream stream,
               std::uint64_t* left) override {
    select_forces(forces);
    release(steps);
    is_queued_ = true;
    for (; *left > 0; --*left) run_programs(false);
    device_->join(stream);
  }

  bool is_capturing(cuda::Stream stream) override { return device_->is_capturing(stream); }

  bool capture(const ForceTable* forces, std::uint64_t steps, std::uint32_t count,
               cuda::Stream stream) override {
    if (device_->parts() > 1) {
      throw InvalidArgument("stream is being captured; the world must then have one device");
    }
    if (!has_stepped_ || !is_prepared(forces, steps)) return false;
    select_forces(forces);
    is_queued_ = true;
    device_->capture(stream, [&] {
      for (std::uint32_t n = 0; n < count; ++n) run_programs(false);
    });
    graph_version_ = version();
    return true;
  }
  bool has_graph() const noexcept override { return graph_version_ == version(); }

  void hold() override {
    sent_.held = 1;
    device_->upload(&data_.counters->progress.held, &sent_.held, 1);
    device_->wait();
  }
  bool is_held() const noexcept override { return sent_.held != 0; }

  void wait_for(cuda::Stream stream) override { device_->fork(stream); }

  Finished finish() override {
    if (has_graph()) device_->wait_for_graphs();
    const Counters found = counters();
    const Progress& progress = found.progress;
    if (progress.deferred > 0) deferred_ = progress.deferred;  // else that of a failed call
    if (progress.deferred > 0 || progress.started != 0) restore(progress);
    Finished result{progress.completed - known_.completed, deferred_, result_of(found)};
    note(progress);
    deferred_ = 0;
    return result;
  }

  cuda::DeviceStates states() const noexcept override {
    const BodyView& bodies = data_.step.bodies;
    return {device_->number(),
            device_->stream(),
            bodies.capacity,
            bodies.count,
            bodies.ids,
            bodies.position,
            bodies.orientation,
            bodies.velocity,
            bodies.angular_velocity,
            &data_.counters->progress.deferred,
            version()};
  }

  Vec3 fetch_position(std::uint32_t body) override {
    Vec3 position;
    transfer_.read(data_.step.motion.position + body, 1, &position);
    return position;
  }

  void fetch_states(MotionArrays* moving, ThreadPool* pool) override {
    device_->fetch(bodies_.state_copies(moving), pool);
  }
  void fetch_other_motion(MotionArrays* moving, ThreadPool* pool) override {
    device_->fetch(bodies_.other_copies(moving), pool);
  }

  void fetch_contact_set(soft_step::ContactSet* last) override {
    last_contacts().fetch(transfer_, last);
  }

  void fetch_joints(JointStore* joints) override { joints_.fetch(transfer_, 1 - now(), joints); }

  void fetch_contacts(const BodiesOfStep& bodies, bool of_step_before, soft_step::ContactSet* set,
                      DetectedContacts* detected) override {
    const Contacts& from = of_step_before ? contacts_[now()] : last_contacts();
    from.fetch(transfer_, set);
    from.fetch_detected(transfer_, bodies, detected);
  }

  Device& device() { return *device_; }

 private:
  using Contacts = ContactBuffers<Device>;
  using SubShapes = SubShapeBuffers<Device>;
  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  /// Number of items of the programs over bodies and contacts.
  std::size_t contact_items() const {
    const ContactSizes& last = last_contacts().sizes();
    return std::max({std::size_t{data_.step.bodies.count}, std::size_t{last.spheres},
                     std::size_t{last.manifolds}});
  }

  /// Calls f(program, items) for the programs between the contacts and the end of a step, which
  /// depend on the blocks and the joints of the world. @param items for Device::run()
  template <class F>
  void visit_solver(const F& f) const {
    const StepData& d = data_;
    const std::size_t contacts = contact_items();
    const bool has_joints = d.world_joints.count > 0;
    if (d.step.bodies.has_blocks) {
      f(PrepareProgram<kPrepareBodies>{d}, contacts);
      f(PrepareProgram<kPlaceRows>{d}, contacts);
      f(PrepareProgram<kBuildInnerRows>{d}, contacts);
      f(PrepareProgram<kBuildRows>{d}, contacts);
      if (has_joints) {
        f(BlockSolveProgram<soft_step::kRowKinds>{d}, contacts);
      } else {  // one of them returns at once
        f(BlockSolveProgram<kSphereRowKinds>{d}, contacts);
        f(BlockSolveProgram<soft_step::kContactRowKinds>{d}, contacts);
      }
      return;
    }
    f(PrepareProgram<kPrepareOneBlock>{d}, contacts);
    const auto solve = [&]<class Program>(const Program& program) {
      const std::size_t others =
          std::size_t{last_contacts().sizes().manifolds} + d.world_joints.count;
      f(program, std::max(contacts, Program::kItemsPerOtherRow * others));
    };
    if (has_joints) {
      solve(SolveProgram<soft_step::kRowKinds>{d});
    } else {
      solve(SolveProgram<soft_step::kContactRowKinds>{d});
    }
  }

  /// Loads these programs for the world as it is now, because steps that are captured must not load
  /// a program.
  void load_solver() {
    if (!has_stepped_) return;  // capture() requires a step
    visit_solver(
        [this]<class Program>(const Program&, std::size_t) { device_->template load<Program>(); });
  }

  SubShapes& current_sub_shapes() { return sub_shapes_[sub_shapes_now_]; }
  void use_sub_shapes() {
    data_.swept_bounds.sub_shapes = current_sub_shapes().view();
    data_.swept_bounds.sub_shapes.meshes = trees_.meshes();
    scratch_.reserve_sub_shapes(transfer_, current_sub_shapes().ranges(), &data_);
    is_ready_ = false;
  }

  void update_trees(const BodyStore& bodies) {
    if (!trees_.upload(transfer_, bodies, data_.swept_bounds.largest_margin)) return;
    data_.trees = trees_.view();
    data_.swept_bounds.sub_shapes.meshes = trees_.meshes();
    ++changes_;
  }

  /// Updates the ids and the sub-shapes. Waits.
  /// @param changed slots whose body was added or removed
  /// @param added   the added bodies, in any order
  void merge(const BodyStore& bodies, const std::vector<std::uint32_t>& changed,
             std::vector<BodyId>* added) {
    std::ranges::sort(*added, {}, &BodyId::index);
    SubShapeTable table;
    table.set_bodies(bodies, *added);
    added_shapes_.upload(edit_transfer_, table.view(), table.part_count(), &hulls_);
    SubShapes &before = current_sub_shapes(), &after = sub_shapes_[1 - sub_shapes_now_];
    SubShapeRanges* kept = edit_transfer_.room(&kept_shapes_, 1);
    device_->run(MergeProgram{.data = data_,
                              .changed = edit_transfer_.put(&changed_, changed),
                              .changed_count = static_cast<std::uint32_t>(changed.size()),
                              .added_ids = edit_transfer_.put(&added_ids_, *added),
                              .added_id_count = static_cast<std::uint32_t>(added->size()),
                              .to_ids = bodies_.other_ids(transfer_, bodies.size()),
                              .added = added_shapes_.view(),
                              .part_count = before.part_count(),
                              .added_part_count = added_shapes_.part_count(),
                              .to = after.reserve(transfer_, before, added_shapes_),
                              .kept = kept},
                 std::max(data_.step.bodies.count, before.ranges().all()));
    SubShapeRanges ranges;
    device_->download(&ranges, kept, 1);
    device_->wait();
    after.complete(ranges + added_shapes_.ranges());
    sub_shapes_now_ = 1 - sub_shapes_now_;
    ++changes_;
    use_sub_shapes();
    bodies_.swap_ids(bodies.size(), &data_.step.bodies);
  }

  /// DeviceStates::version; never 0 after an upload.
  std::uint64_t version() const { return transfer_.moves() + changes_; }

  /// Index of the contacts of the step before the last, between two steps.
  std::uint64_t now() const { return known_.completed & 1; }
  Contacts& last_contacts() { return contacts_[1 - now()]; }
  const Contacts& last_contacts() const { return contacts_[1 - now()]; }
  void use_contacts() {
    for (int i = 0; i < 2; ++i) data_.contacts_of[i] = contacts_[i].view();
  }

  /// Selects the forces of a step, apart from accumulated forces. @param table null: no forces
  void select_forces(const ForceTable* table) {
    BodyView& bodies = data_.step.bodies;
    bodies.force = bodies_.force();
    bodies.torque = bodies_.torque();
    force_sum_ = torque_sum_ = nullptr;
    if (table == nullptr) return;
    if (forces_.upload(transfer_, *table, &hulls_)) ++changes_;
    force_sum_ = forces_.force_sums(transfer_, bodies.capacity);
    torque_sum_ = forces_.torque_sums(transfer_, bodies.capacity);
    bodies.force = force_sum_;
    bodies.torque = torque_sum_;
  }

  /// Whether prepare() has no work. Forces depend on the step number, and so does the renewal of
  /// the partition, but only while a body is awake: no step is skipped then.
  bool is_prepared(const ForceTable* forces, std::uint64_t steps) const {
    return is_ready_ && !is_held() &&
           (forces == nullptr || (offset(steps) == sent_.offset && forces_.has(*forces)));
  }

  /// Progress::offset
  std::uint64_t offset(std::uint64_t steps) const { return steps - known_.completed; }

  /// Copies the progress of the host to the device, which enables steps.
  void release(std::uint64_t steps) {
    const auto send = [this](auto Progress::*field, auto value) {
      if (sent_.*field == value) return;
      source_.*field = value;
      device_->upload(&(data_.counters->progress.*field), &(source_.*field), 1);
      sent_.*field = value;
    };
    send(&Progress::offset, offset(steps));
    send(&Progress::held, 0u);
  }

  /// Gives the lists of a step that has failed room and slack. Steps in a queue get more slack,
  /// because the host must perform all steps after one whose lists are too short.
  void grow_lists(const Capacity& needed) {
    capacity_.grow(needed, is_queued_, data_.step.bodies.count);
    is_ready_ = false;
    ++changes_;
  }

  /// Reserves memory, so that the step allocates nothing.
  void make_room() {
    if (is_ready_) return;
    divide();
    const std::uint64_t moves = transfer_.moves();
    scratch_.reserve_lists(transfer_, capacity_, &data_);
    for (Contacts& contacts : contacts_) contacts.reserve(transfer_, capacity_, room_);
    use_contacts();
    device_->reserve_pairs(data_.swept_bounds.sub_shapes.ranges.fixed_begin(), capacity_.pairs);
    if (transfer_.moves() != moves) device_->release_unused();
    is_ready_ = true;
  }

  /// Divides the step among the devices.
  void divide() {
    const BodyView& bodies = data_.step.bodies;
    const std::uint32_t before = data_.parts;
    data_.parts = bodies.has_blocks ? device_->parts() : 1;
    if (data_.parts > 1) {
      if (before == 1) divider_.start(&data_, bodies.capacity, {});
      if (has_numbers_ && !divider_.is_current(numbers())) {
        divider_.renew(&data_, last_contacts().view().view, numbers());
      }
      divider_.scale(&data_, bodies.capacity, bodies.count,
                     data_.swept_bounds.sub_shapes.ranges.bounded());
    }
    device_->divide(data_.parts, data_.divisions);
  }
  typename StepDivider<Device>::Numbers numbers() const {
    return {known_.completed, last_contacts().sizes(), pairs_, blocks_};
  }

  /// @param is_timed whether to mark the stages
  void run_programs(bool is_timed) {
    make_room();
    data_.swept_bounds.bodies = data_.step.bodies;
    data_.orientation = scratch_.orientation_of_step(data_);
    const StepData& d = data_;
    const std::size_t bodies = d.step.bodies.count;
    const std::size_t sub_shapes = d.swept_bounds.sub_shapes.ranges.bounded();
    const std::size_t contacts = contact_items();
    const auto run = [&](const auto& program, std::size_t items) {
      device_->run(program, items, d.parts);
    };
    const auto mark = [&](int i) {
      if (is_timed) device_->mark(i);
    };
    const bool forces_act = force_sum_ != nullptr;
    if (forces_act) {
      mark(0);
      run(ForceProgram{d, forces_.view(), force_sum_, torque_sum_}, bodies);
    }
    mark(1);
    run(BoundsProgram{d, forces_act}, std::max(bodies, sub_shapes));
    device_->find_pairs(d.parts > 1 ? d.searched : d.swept_bounds.swept,
                        d.swept_bounds.sub_shapes.ranges.fixed_begin(), d.pairs, capacity_.pairs,
                        d.pair_count);
    run(SphereProgram{d}, contacts);
    run(ShapeProgram{d}, contacts);
    run(MatchProgram{d}, contacts);
    mark(2);
    visit_solver(run);
    run(CommitProgram{d}, contacts);
    mark(3);
  }

  Counters counters() {
    Counters result;
    device_->download(&result, data_.counters, 1);
    device_->wait();
    if (result.pairs > 0 && result.needed.pairs == 0) pairs_ = result.pairs;
    if (result.failed == 0) blocks_ = result.blocks;
    return result;
  }

  /// Restores the state after an incomplete step.
  void restore(const Progress& progress) {
    if (progress.started != 0) bodies_.restore(transfer_, data_);
    source_ = progress;
    source_.started = 0;
    source_.deferred = 0;
    device_->upload(&data_.counters->progress, &source_, 1);
    device_->wait();
  }

  /// Records the number of completed steps.
  void note(const Progress& progress) {
    for (; known_.completed < progress.completed; ++known_.completed) {
      if (known_.completed + 2 < progress.completed) continue;
      contacts_[now()].complete(progress.contacts[now()], data_.step.bodies.capacity);
      has_stepped_ = true;
      has_numbers_ = data_.parts > 1;
    }
    if (has_numbers_ && !divider_.is_current(numbers())) is_ready_ = false;
  }

  static Result result_of(const Counters& counters) {
    Result result;
    result.awake = counters.awake;
    result.contacts =
        std::uint64_t{counters.touching_spheres} + counters.touches + counters.begun_points;
    result.sphere_contacts = std::uint64_t{counters.touching_spheres} + counters.sphere_touches;
    return result;
  }

  /// Runs the programs; repeats them with longer lists if a list was too short. Restores the state
  /// if the device fails or the step has no effect for another reason.
  Counters run_until_complete() {
    for (;;) {
      try {
        run_programs(true);
        const Counters result = counters();
        if (result.progress.completed == known_.completed) restore(result.progress);
        note(result.progress);
        if (result.failed == 0 || result.must_wake != 0) return result;
        grow_lists(result.needed);
      } catch (...) {
        device_->wait();
        const Counters result = counters();
        if (result.progress.completed == known_.completed) {
          restore(result.progress);
          throw;
        }
        note(result.progress);
        return result;
      }
    }
  }

  std::unique_ptr<Device> device_;
  Transfer<Device> transfer_, edit_transfer_;
  StepDivider<Device> divider_{transfer_};
  StepData data_;
  Capacity capacity_;
  BodyBuffers<Device> bodies_;
  SubShapes sub_shapes_[2], added_shapes_;
  int sub_shapes_now_ = 0;  ///< index of the current sub-shapes
  FixedTreeBuffers<Device> trees_;
  HullBuffers<Device> hulls_;
  JointBuffers<Device> joints_;
  ForceBuffers<Device> forces_;
  Contacts contacts_[2];  ///< indexed as Progress::contacts
  ScratchBuffers<Device> scratch_;
  std::size_t room_ = 0;             ///< number of slots with memory in the buffers of bodies
  Progress known_;                   ///< of the steps for which the host has waited
  Progress sent_;                    ///< Progress::offset and held, as last copied to the device
  Progress source_;                  ///< of copies to the device
  std::uint64_t deferred_ = 0;       ///< for finish(), if one of its calls fails
  std::uint64_t changes_ = 0;        ///< counts changes of program arguments, except addresses
  std::uint64_t graph_version_ = 0;  ///< version() of the last captured graph; 0: none
  std::uint32_t pairs_ = 0;          ///< of swept bounds, in the last step
  BlockCounts blocks_;               ///< in the last step
  bool has_numbers_ = false;  ///< whether the last step had several parts, which number the blocks
  bool has_stepped_ = false;  ///< whether a step was completed since the upload
  bool is_queued_ = false;    ///< whether the host has enqueued or captured steps
  bool is_ready_ = false;     ///< whether all lists have the room of capacity_
  // Of edit().
  Buffer<EditedBody> edits_;
  Buffer<EditedMass> masses_;
  Buffer<SlotValues> replaced_;
  Buffer<std::uint32_t> changed_;
  Buffer<BodyId> added_ids_;
  Buffer<SubShapeRanges> kept_shapes_;
  // Of the step in progress.
  Vec3 *force_sum_ = nullptr, *torque_sum_ = nullptr;  ///< null if no force of the table acts
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
