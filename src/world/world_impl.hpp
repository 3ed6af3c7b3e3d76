/// Members of a World and helpers of its functions.
#pragma once

#include <jfpx/world.hpp>

#include "src/world/bodies/body_store.hpp"
#include "src/world/contacts/contact_finder.hpp"
#include "src/world/contacts/step_contacts.hpp"
#include "src/world/device/automatic_device.hpp"
#include "src/world/device/device_world.hpp"
#include "src/world/device/host_mirror.hpp"
#include "src/world/device/step_queue.hpp"
#include "src/world/forces/callback_registry.hpp"
#include "src/world/joints/joint_store.hpp"
#include "src/world/queries/query_tree.hpp"
#include "src/world/ranks/world_ranks.hpp"
#include "src/world/snapshots/force_snapshot.hpp"
#include "src/world/snapshots/snapshot_file.hpp"
#include "src/world/step/soft_step.hpp"
#include "src/world/thesis_table.hpp"

#include <limits>
#include <mutex>

namespace jfpx {
inline namespace JFPX_ABI {

struct World::Impl {
  /// Validates the scene. @throws InvalidScene, InvalidArgument, OutOfMemory
  static std::unique_ptr<Impl> make(const Scene& scene, std::unique_ptr<ThreadPool> pool,
                                    std::unique_ptr<SphereCollider> collider,
                                    BroadPhase broad_phase, SimdLevel simd,
                                    std::shared_ptr<Communicator> communicator = nullptr);
  Impl(const Scene& given, std::unique_ptr<ThreadPool> threads,
       std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase, SimdLevel simd,
       std::shared_ptr<Communicator> communicator)
      : pool(std::move(threads)),
        scene(settings_of(given)),
        store(empty_store(given)),
        ranks(make_ranks(std::move(communicator), pool.get())),
        contact_finder(make_broad_phase(std::move(collider), broad_phase), simd),
        soft_step(given.soft_step, given.materials, given.dt, pool.get(), simd, ranks.get()),
        worst_first(make_worst_first_step(given)) {
    store.reserve(given.bodies.size());
    for (const BodyDef& def : given.bodies) store.add(def);
    // A body of the scene has the index of its slot.
    store.set_ignored_pairs(given.ignored_pairs);
    for (Joint joint : given.joints) {
      std::visit(
          [this](auto& j) {
            j.a = store.id(j.a.index);
            if (j.b) j.b = store.id(j.b->index);
          },
          joint);
      joints.add(joint);
      const JoinedBodies joined = joined_bodies(joint);
      if (joined.excludes_contacts) store.set_pair_joined({joined.a, joined.b}, true);
    }
  }

  /// Drops the queue: steps of graphs may be in progress and use the memory of the device.
  ~Impl() { drop_queue(); }

  /// The bodies for reading their motion. Fetches the motion if it is newer on the device. For ids
  /// and properties, `store` is sufficient. Const functions of a World may call it concurrently.
  const BodyStore& bodies() {
    finish();
    if (resident()) fetch_motion();
    if (ranks != nullptr) ranks->collect(&store);
    return store;
  }
  /// The bodies for reading the columns of BodyState; copies less than half as much as bodies().
  const BodyStore& bodies_with_states() {
    finish();
    if (resident()) fetch_states();
    if (ranks != nullptr) ranks->collect(&store);
    return store;
  }
  /// The bodies for a change. The next step uploads the world again.
  BodyStore& changed_bodies() {
    finish();
    steps_at_rest = 0;
    if (resident()) leave_device();
    collect();
    return store;
  }
  /// Adds a body, also on the device if the device has the state.
  BodyId add(const BodyDef& def);
  /// Removes a body, also on the device. Wakes the bodies in contact with it.
  void remove(BodyId id);
  /// Gives a body another definition, on the host. Wakes the bodies in contact with it.
  void replace(BodyId id, const BodyDef& def);
  /// @throws InvalidArgument if a joint of a body has no other movable body
  void require_other_movable(std::uint32_t body) const;
  /// The bodies for an edit of one of them. While the device has the state, the motion of other
  /// bodies may be outdated, and the next step applies the edit on the device, too.
  BodyStore& edited_body(std::uint32_t body, const BodyEdit& edit);
  /// edited_body() for a change that contact lists report, or of a body whose neighbors must wake.
  /// On the host it builds the lists first, so that waking the neighbors cannot fail after the
  /// change.
  BodyStore& edited_body_in_lists(std::uint32_t body, const BodyEdit& edit);
  void remember_listed(std::uint32_t body);
  JointId add_joint(const Joint& joint);
  void remove_joint(std::uint32_t joint);
  void set_joint(std::uint32_t joint, const Joint& value);
  void remove_joints_of(std::uint32_t body);
  void begin_joint_edit(const JoinedBodies& joined);
  void complete_joint_edit(const JoinedBodies& joined);
  /// Fetches impulses and colors of the joints. Const functions may call it concurrently.
  void fetch_joints();
  /// Copies changed joints to the device.
  void flush_joints();
  /// With several ranks: fetches the state of bodies and joints of the other ranks.
  void collect() {
    if (ranks == nullptr) return;
    ranks->collect(&store);
    ranks->gather_joints(&joints);
  }
  /// Fetches the contacts of the last step, or of the step before, of the other ranks.
  void collect_contacts(bool of_step_before);
  /// Common start of all edits.
  void begin_edit() {
    finish();
    hold_graphs();
    steps_at_rest = 0;
    collect();
  }
  /// [m], of the centre of mass
  Vec3 position(std::uint32_t body);
  /// Performs a step on a device, which loads its kernels. upload() must follow.
  /// @param device of a Scene{} @throws DeviceError, OutOfMemory
  static std::unique_ptr<DeviceWorld> warmed(std::unique_ptr<DeviceWorld> device);
  /// Uploads the world, unless the device has its state.
  void enter_device();
  /// Applies the pending edits on the device.
  void flush_edits();
  /// Records that all bodies may have pending forces on the host.
  void note_forces();
  void fetch_motion();
  void fetch_states();
  /// The contacts of the last step, and of the step before, built on demand. If the device has the
  /// state, fetches the data first. Const functions may call it concurrently.
  /// @throws std::bad_alloc, DeviceError
  JFPX_API const ContactList& contact_list();
  const ContactList& contact_list_before();
  const std::vector<ContactForce>& contact_forces();
  /// The hits of the last step. Const functions may call it concurrently.
  /// @throws std::bad_alloc, DeviceError
  const std::vector<HitEvent>& hit_events();
  bool has_hit_events() const { return hit_speed <= kMaxReal && scene.solver == Solver::soft_step; }
  /// Builds the contact lists of the last two steps. Called before a change of bodies, or a move of
  /// the state to or from the device, that would change their data.
  void make_contact_lists();
  void make_list(bool of_step_before, ContactList* list);
  /// Whether the device has the state of the world.
  bool resident() const noexcept { return mirror.is_resident(); }
  /// Moves the state of the world to the host.
  void leave_device();
  /// leave_device(), except that the device keeps the state. Const functions may call it
  /// concurrently.
  void fetch_all();
  void fetch_contact_set();

  // Steps that do not wait for the host (world_queue.cpp).

  /// cuda::enqueue_steps() outside and inside stream capture.
  void enqueue(std::uint32_t count, cuda::Stream stream);
  void capture(std::uint32_t count, cuda::Stream stream);
  /// Waits for the enqueued and replayed steps, and performs the steps that the device could not
  /// complete. Every function that reads or changes the state calls it first. Const functions may
  /// call it concurrently.
  void finish() {
    if (queue.state.load(std::memory_order_acquire) != StepQueue::State::empty) finish_queue();
  }
  void open_queue() noexcept {
    StepQueue::State expected = StepQueue::State::empty;
    queue.state.compare_exchange_strong(expected, StepQueue::State::open);
  }
  bool is_launched() const { return queue.state == StepQueue::State::launched; }
  void finish_queue();
  void finish_launched();
  void make_deferred_steps();
  void launch(cuda::Stream stream);
  void keep_report(StepReport report);
  /// Disables captured graphs before the host records a change. Steps of graphs are deferred until
  /// the change is copied to the device.
  void hold_graphs();
  /// Whether a graph may be launched at any time.
  bool has_graph() const { return resident() && device->has_graph(); }
  /// Whether changes of the host for the next step are pending.
  bool has_changes() const {
    return !resident() || !mirror.edits.empty() ||
           mirror.joints == HostMirror::Joints::newer_on_host || device->is_held();
  }
  /// Copies pending changes, so that graphs can be captured and replayed.
  void send_changes();
  /// Discards the queue before the state is replaced.
  void drop_queue() noexcept;

  /// A copy of a scene without bodies, ignored pairs and joints.
  static Scene settings_of(const Scene& scene) {
    const auto& [name, dt, bodies, solver, soft_step, resolver, sleep, materials, ignored_pairs,
                 joints] = scene;
    return {name, dt, {}, solver, soft_step, resolver, sleep, materials, {}, {}};
  }
  /// @returns null for a single rank
  static std::unique_ptr<WorldRanks> make_ranks(std::shared_ptr<Communicator> communicator,
                                                ThreadPool* pool) {
    if (communicator == nullptr || communicator->size() == 1) return nullptr;
    return std::make_unique<WorldRanks>(std::move(communicator), pool);
  }
  /// A store without bodies for a scene.
  static BodyStore empty_store(const Scene& scene) {
    return {scene.dt, scene.sleep,
            scene.solver == Solver::soft_step ? scene.soft_step.substeps : 1};
  }

  /// Wakes the bodies in contact with a body that is removed or changed.
  void wake_neighbors(BodyId body) {
    finish();
    // After an upload, the device does not have the contacts that only the lists contain.
    if (resident() && !mirror.has_contact_set) {
      edited_body(body.index, {.wakes_neighbors = true});
      return;
    }
    contacts.by_body.for_each(contact_list().contacts, body, [&](const Contact& c) {
      const BodyId other = c.a == body ? c.b : c.a;
      if (!c.sensor && store.contains(other)) wake(other.index);
    });
  }

  /// Changes the velocities of a movable body. @param linear [N s] @param angular [N m s]
  /// @throws InvalidArgument if a velocity would not be finite
  void apply_impulse(std::uint32_t body, const Vec3& linear, const Vec3& angular);

  void wake(std::uint32_t body) { edited_body(body, {.wakes = true}).wake(body); }

  /// Wakes a body and the bodies in contact with it.
  void wake_with_neighbors(BodyId body) {
    wake(body.index);
    wake_neighbors(body);
  }

  /// Wakes all bodies, because a new or removed callback may affect any of them.
  void wake_all() {
    BodyStore& bodies = changed_bodies();
    for (const BodyId id : bodies.ids()) bodies.wake(id.index);
  }

  /// Must be called after a body was added or removed, or got another state by set_state().
  void note_change() noexcept {
    bodies_changed = true;
    if (ranks != nullptr) ranks->note_change();
    query_tree.invalidate();
  }

  /// The tree of the bodies for queries. @throws as QueryTree::build()
  const QueryTree& tree_of(const BodyStore& bodies) const {
    return query_tree.get([&bodies](QueryTree* tree) { tree->build(bodies); });
  }

  double time() const { return static_cast<double>(steps) * static_cast<double>(scene.dt); }

  /// Whether the next step would change nothing: all bodies have slept during the whole last step,
  /// whose contacts are therefore still valid, and nothing has changed since.
  bool is_at_rest() const {
    return steps_at_rest >= 2 && forces.ids().empty() && generators.ids().empty();
  }
  void note_rest(const StepReport& report);
  StepReport make_step();
  void report_backend(StepReport* report) const;
  bool advance(StepReport* report);
  bool advance_soft_step(StepReport* report);
  void start_step_of_ranks();
  void add_ranks(StepReport* report);
  void choose_device(StepReport* report);
  bool advance_on_device(StepReport* report);
  bool step_on_device(StepReport* report);
  void complete_on_device(std::uint64_t count);
  void lose_device(const std::string& failure);
  static void fill_report(const DeviceWorld::Result& result, StepReport* report);
  void apply_forces_on_host();
  JFPX_API static bool all_finite(const std::optional<BodyId>& runaway, StepReport* report);
  JFPX_API void start_detection();
  void find_contacts(StepReport* report);
  void keep_motion(DetectedContacts* found);
  template <class Item>
  void copy_of_rank(const std::vector<Item>& array, std::vector<Item>* copy);
  JFPX_API void finish_detection(StepReport* report);
  JFPX_API void call_generators(std::vector<Contact>* list, StepReport* report);
  std::uint32_t count_awake() const;
  void save_for_undo();
  void undo_motion() noexcept;
  void undo() noexcept;
  void write(BinaryWriter* writer);
  SnapshotParts snapshot_parts() const;
  void read(BinaryReader* reader);

  std::unique_ptr<ThreadPool> pool;   ///< may be shared with the collider
  Scene scene;                        ///< the settings, without bodies, pairs and joints
  BodyStore store;                    ///< the motion may be outdated: see `mirror`
  std::unique_ptr<WorldRanks> ranks;  ///< null: a single rank
  JointStore joints;                  ///< impulses and colors may be outdated: see `mirror`
  ContactFinder contact_finder;
  SoftStep soft_step;                           ///< of Solver::soft_step
  std::unique_ptr<WorstFirstStep> worst_first;  ///< of Solver::worst_first; otherwise null
  ForceRegistry forces{"force"};
  GeneratorRegistry generators{"contact generator"};
  bool bodies_changed = true;  ///< whether contact_finder.set_bodies() must be called
  Lazy<QueryTree> query_tree;  ///< of the bodies, built by the first query after a change
  StepContacts contacts{pool.get()};
  MotionArrays before;    ///< state that an undone step restores
  bool is_saved = false;  ///< whether `before` belongs to the current step
  Real hit_speed = std::numeric_limits<Real>::infinity();  ///< WorldSettings::hit_speed
  std::uint64_t steps = 0;
  /// Number of consecutive last steps without changes after which no body was awake.
  std::uint32_t steps_at_rest = 0;
  StepReport last_report;  ///< of the last of these steps

  std::unique_ptr<DeviceWorld> device;  ///< null: steps run on the CPU
  std::string device_failure;           ///< why `device` was dropped; empty: no failure
  ForceTable force_table;               ///< of `forces`, for the device
  HostMirror mirror;
  bool steps_on_device = false;                ///< whether the step in progress runs on the device
  std::unique_ptr<AutomaticDevice> automatic;  ///< of Backend::automatic; null: a fixed backend
  /// [us] Duration of the last step and of the copies between host and device since, for
  /// `automatic`; 0: unknown.
  double spent_us = 0;
  std::mutex fetching;  ///< held while fetching, because const functions may fetch concurrently
  StepQueue queue;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
