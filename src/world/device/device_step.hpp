/// A world on a device: its memory, and the sequence of the programs of a step.
#pragma once

#include <jfpx/error.hpp>

#include "src/world/device/commit_program.hpp"
#include "src/world/device/contact_programs.hpp"
#include "src/world/device/edit_program.hpp"
#include "src/world/device/force_program.hpp"
#include "src/world/device/match_program.hpp"
#include "src/world/device/prepare_program.hpp"
#include "src/world/device/solve_program.hpp"
#include "src/world/device_world.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <tuple>
#include <utility>
#include <variant>
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
  DeviceStep(const Scene& scene, std::unique_ptr<Device> device) : device_(std::move(device)) {
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
    upload_bodies(bodies.view());
    upload_motion(bodies);
    upload_sub_shapes(sub_shapes->view(), sub_shapes->part_count());
    upload_contacts(last->view());
    forces_.parameters_version = forces_.lists_version = 0;
    device_->wait();
  }

  void upload_forces(const BodyStore& bodies) override {
    const MotionArrays& moving = bodies.moving;
    put(&motion_.force, moving.force);
    put(&motion_.torque, moving.torque);
    put(&motion_.awake, moving.awake);
    put(&motion_.mean_motion, moving.mean_motion);
    put(&motion_.rest_time, moving.rest_time);
    device_->wait();
  }

  void edit(const BodyStore& bodies, const BodyEdits& edits) override {
    const BodyView& from = bodies.view();
    std::vector<EditedBody> edited;
    bool any_wakes_neighbors = false;
    for (const auto& [i, edit] : edits) {
      any_wakes_neighbors |= edit.wakes_neighbors;
      edited.push_back({i, edit.sets_state, edit.wakes, edit.wakes_neighbors, bodies.state(i),
                        from.inverse_inertia[i], from.force[i], from.torque[i],
                        from.acceleration[i], from.velocity_kept[i],
                        from.angular_velocity_kept[i]});
    }
    const Contacts& last = sets_[1 - now_];
    set_last(last);
    device_->run(
        EditProgram{data_, put(&scratch_.edits, edited), static_cast<std::uint32_t>(edited.size()),
                    any_wakes_neighbors, last.touches.data(), last.touch_count,
                    properties_.acceleration.data(), properties_.velocity_kept.data(),
                    properties_.angular_velocity_kept.data()},
        any_wakes_neighbors ? std::max<std::size_t>(last.counts[0], edited.size()) : edited.size());
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
      restore();
      device_->wait();
      return result;
    }
    Contacts& done = sets_[now_];
    done.counts = {counters.spheres, counters.manifolds, counters.points};
    done.touch_count = counters.touches;
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
    get(&moving->position, motion_.position);
    get(&moving->orientation, motion_.orientation);
    get(&moving->velocity, motion_.velocity);
    get(&moving->angular_velocity, motion_.angular_velocity);
    get(&moving->force, motion_.force);
    get(&moving->torque, motion_.torque);
    get(&moving->last_acceleration, motion_.last_acceleration);
    get(&moving->inverse_inertia, motion_.inverse_inertia);
    get(&moving->mean_motion, motion_.mean_motion);
    get(&moving->rest_time, motion_.rest_time);
    get(&moving->awake, motion_.awake);
    device_->wait();
  }

  void fetch_contact_set(soft_step::ContactSet* last) override { fetch(sets_[1 - now_], last); }

  std::uint64_t fetch_contacts(const BodyStore& bodies, bool of_step_before,
                               std::vector<Contact>* contacts) override {
    const Contacts& from = sets_[of_step_before ? now_ : 1 - now_];
    std::vector<Touch> touches(from.touch_count);
    std::vector<Vec3> position(bodies.capacity());
    soft_step::ContactSet set;
    get(&touches, from.touches);
    get(&position, from.position_before);
    fetch(from, &set);
    for (const soft_step::SphereContactInput& c : set.spheres) {
      if (!(c.distance <= 0)) continue;
      // The sphere of a body that is a sphere is where the body was at the start of the step.
      const SphereInstance sphere_b{position[c.key.b], bodies.radius(c.key.b)};
      touches.push_back({{c.key.a, c.key.b, 0, 0},
                         0,
                         1,
                         c.normal,
                         middle_point(c.normal, c.distance, sphere_b),
                         c.distance});
    }
    // After the other contacts of the same bodies.
    constexpr std::uint32_t kLast = 0xffffffffu;
    std::uint32_t number = 0;
    soft_step::for_each_met(
        set.view(), 0, set.size(), [&](std::uint32_t body) { return position[body]; },
        [&](std::uint32_t body) { return bodies.radius(body); },
        [&](const soft_step::ContactKey& key, bool of_spheres, const Vec3& normal,
            const Vec3& point) {
          touches.push_back(
              {{key.a, key.b, kLast, kLast}, number++, of_spheres ? 1u : 0u, normal, point, 0});
        });
    const auto order = [](const Touch& t) {
      return std::tuple(1 - t.of_spheres, t.pair, t.number);
    };
    std::ranges::sort(touches, {}, order);
    contacts->clear();
    std::uint64_t of_spheres = 0;
    for (const Touch& t : touches) {
      contacts->push_back(
          {bodies.id(t.pair.a), bodies.id(t.pair.b), t.normal, t.point, t.distance});
      of_spheres += t.of_spheres;
    }
    return of_spheres;
  }

  Device& device() { return *device_; }

 private:
  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  struct Properties {
    Buffer<Real> radius, extent, inverse_mass, friction, restitution, rolling_friction,
        spinning_friction, velocity_kept, angular_velocity_kept;
    Buffer<Mat3> body_inverse_inertia, tensor;
    Buffer<Vec3> acceleration;
    Buffer<std::uint8_t> can_sleep, kinematic, sensor;
    Buffer<CollisionFilter> filter;
    Buffer<std::uint64_t> ignored;
    Buffer<BodyId> ids;
  };
  struct Motion {
    Buffer<Vec3> position, velocity, angular_velocity, force, torque, last_acceleration;
    Buffer<Quat> orientation;
    Buffer<Mat3> inverse_inertia;
    Buffer<Real> mean_motion, rest_time;
    Buffer<std::uint8_t> awake;
  };
  /// What a step changes before it can fail.
  struct Saved {
    Buffer<Vec3> last_acceleration;
    Buffer<Real> mean_motion, rest_time;
    Buffer<std::uint8_t> awake;
  };
  struct SubShapes {
    Buffer<std::uint32_t> bodies, numbers, parts;
    Buffer<SphereInstance> bounds;
    Buffer<PosedBox> boxes;
    Buffer<Wall> walls;
    Buffer<Transform> local;
  };
  template <class... F>
  static std::tuple<Buffer<F>...> buffers_of(const std::variant<F...>&);
  struct Forces {
    decltype(buffers_of(std::declval<RecordableForce>())) parameters;
    Buffer<ForceItem> on_all, on_body;
    Buffer<std::uint32_t> first_item, first_part;
    Buffer<Real> mass;
    Buffer<SolidPart> parts;
    Buffer<Vec3> force_sum, torque_sum;
    ForceView view;
    double time = 0;
    bool act = false;                                         ///< in the step in progress
    std::uint64_t parameters_version = 0, lists_version = 0;  ///< of the table; 0: none
  };
  /// Contacts of a step, and what World::contacts() needs.
  struct Contacts {
    Buffer<soft_step::SphereContactInput> spheres;
    Buffer<soft_step::ManifoldInput> manifolds;
    Buffer<soft_step::PointInput> points;
    Buffer<soft_step::KeptImpulse> impulses;
    Buffer<Vec3> rolling_impulses;
    Buffer<std::uint8_t> colors;
    Buffer<Range> spheres_of, manifolds_of;
    std::array<std::uint32_t, 3> counts{};  ///< of spheres, manifolds and points
    Buffer<Touch> touches;
    std::uint32_t touch_count = 0;
    Buffer<Vec3> position_before;
  };
  struct Scratch {
    Buffer<EditedBody> edits;
    Buffer<Vec3> motion;
    Buffer<Real> margins;
    Buffer<SphereInstance> swept;
    Buffer<SpherePair> pairs;
    Buffer<cuda::ContactCount> pair_count;
    Buffer<NormalDistance> pair_results;
    Buffer<Candidate> candidates;
    Buffer<NearPair> tested;
    Buffer<std::uint32_t> first_candidate, next_candidate, first_contact, uncolored,
        still_uncolored, parent, row_contact, first_fixed, next_fixed, overflow;
    Buffer<std::uint64_t> manifold_sizes;
    Buffer<std::uint8_t> pair_found, row_bins;
    Buffer<std::uint64_t> used_colors, first_order;
    Buffer<std::uint8_t> marked, near_flag;
    Buffer<soft_step::SolverBody> solver;
    Buffer<Quat> orientation;
    Buffer<soft_step::SphereRow> sphere_rows;
    Buffer<soft_step::ManifoldRow> manifold_rows;
    Buffer<soft_step::PointRow> point_rows;
    Buffer<MotionCells> motion_cells;
    Buffer<FreeCells> free_cells;
    Buffer<RowBody> row_bodies;
  };

  /// Copies an array to the device. @returns its address there
  template <class T>
  const T* put(Buffer<T>* to, const T* from, std::size_t count) {
    device_->reserve(to, std::max<std::size_t>(count, 1), "the bodies of a world");
    device_->upload(to->data(), from, count);
    return to->data();
  }
  template <class T>
  T* put(Buffer<T>* to, const std::vector<T>& from) {
    put(to, from.data(), from.size());
    return to->data();
  }
  void fetch(const Contacts& from, soft_step::ContactSet* to) {
    const auto [spheres, manifolds, points] = from.counts;
    to->spheres.resize(spheres);
    to->manifolds.resize(manifolds);
    to->points.resize(points);
    to->impulses.resize(std::size_t{spheres} + points);
    to->rolling_impulses.resize(std::size_t{spheres} + manifolds);
    to->colors.resize(std::size_t{spheres} + manifolds);
    get(&to->spheres, from.spheres);
    get(&to->manifolds, from.manifolds);
    get(&to->points, from.points);
    get(&to->impulses, from.impulses);
    get(&to->rolling_impulses, from.rolling_impulses);
    get(&to->colors, from.colors);
    device_->wait();
  }

  template <class T>
  void get(std::vector<T>* to, const Buffer<T>& from) {
    device_->download(to->data(), from.data(), to->size());
  }
  /// Room for `count` items. @returns the address
  template <class T>
  T* room(Buffer<T>* buffer, std::size_t count) {
    device_->reserve(buffer, std::max<std::size_t>(count, 1), "a step of a world");
    return buffer->data();
  }

  void upload_bodies(const BodyView& from) {
    Properties& p = properties_;
    BodyView& to = data_.step.bodies;
    const std::size_t n = from.capacity;
    to = from;  // the numbers; the pointers follow
    to.radius = put(&p.radius, from.radius, n);
    to.extent = put(&p.extent, from.extent, n);
    to.inverse_mass = put(&p.inverse_mass, from.inverse_mass, n);
    to.friction = put(&p.friction, from.friction, n);
    to.restitution = put(&p.restitution, from.restitution, n);
    to.rolling_friction = put(&p.rolling_friction, from.rolling_friction, n);
    to.spinning_friction = put(&p.spinning_friction, from.spinning_friction, n);
    to.velocity_kept = put(&p.velocity_kept, from.velocity_kept, n);
    to.angular_velocity_kept = put(&p.angular_velocity_kept, from.angular_velocity_kept, n);
    to.body_inverse_inertia = put(&p.body_inverse_inertia, from.body_inverse_inertia, n);
    to.tensor = put(&p.tensor, from.tensor, n);
    to.acceleration = put(&p.acceleration, from.acceleration, n);
    to.can_sleep = put(&p.can_sleep, from.can_sleep, n);
    to.kinematic = put(&p.kinematic, from.kinematic, n);
    to.sensor = put(&p.sensor, from.sensor, n);
    to.filter = put(&p.filter, from.filter, n);
    to.ignored = put(&p.ignored, from.ignored, from.ignored_count);
    to.ids = put(&p.ids, from.ids, from.count);
    size_by_body(n);
  }

  void upload_motion(const BodyStore& store) {
    const MotionArrays& from = store.moving;
    MotionPointers& to = data_.step.motion;
    to.position = put(&motion_.position, from.position);
    to.orientation = put(&motion_.orientation, from.orientation);
    to.velocity = put(&motion_.velocity, from.velocity);
    to.angular_velocity = put(&motion_.angular_velocity, from.angular_velocity);
    to.force = put(&motion_.force, from.force);
    to.torque = put(&motion_.torque, from.torque);
    to.last_acceleration = put(&motion_.last_acceleration, from.last_acceleration);
    to.inverse_inertia = put(&motion_.inverse_inertia, from.inverse_inertia);
    to.mean_motion = put(&motion_.mean_motion, from.mean_motion);
    to.rest_time = put(&motion_.rest_time, from.rest_time);
    to.awake = put(&motion_.awake, from.awake);
    BodyView& bodies = data_.step.bodies;
    bodies.position = to.position;
    bodies.orientation = to.orientation;
    bodies.velocity = to.velocity;
    bodies.angular_velocity = to.angular_velocity;
    bodies.force = to.force;
    bodies.torque = to.torque;
    bodies.last_acceleration = to.last_acceleration;
    bodies.inverse_inertia = to.inverse_inertia;
    bodies.rest_time = to.rest_time;
    bodies.awake = to.awake;
  }

  /// Selects what acts in a step, apart from accumulated forces, and uploads it if it has changed.
  /// @param table null: nothing
  void select_forces(const ForceTable* table, double time) {
    BodyView& bodies = data_.step.bodies;
    bodies.force = motion_.force.data();
    bodies.torque = motion_.torque.data();
    forces_.act = table != nullptr;
    if (table == nullptr) return;
    const ForceView from = table->view();
    if (forces_.parameters_version != table->parameters_version()) put_parameters(from);
    if (forces_.lists_version != table->lists_version()) put_lists(from);
    forces_.parameters_version = table->parameters_version();
    forces_.lists_version = table->lists_version();
    forces_.time = time;
    bodies.force = room(&forces_.force_sum, bodies.capacity);
    bodies.torque = room(&forces_.torque_sum, bodies.capacity);
  }
  template <class... F>
  void put_parameters(const ForceArrays<std::variant<F...>>& from) {
    ((static_cast<ForceArray<F>&>(forces_.view) = {put(&std::get<Buffer<F>>(forces_.parameters),
                                                       from.template array<F>().forces,
                                                       from.template array<F>().count),
                                                   from.template array<F>().count}),
     ...);
  }
  void put_lists(const ForceView& from) {
    Forces& f = forces_;
    ForceView& to = f.view;
    to.on_all_count = from.on_all_count;
    to.on_all = put(&f.on_all, from.on_all, from.on_all_count);
    to.on_body = put(&f.on_body, from.on_body, from.on_body_count);
    to.first_item = put(&f.first_item, from.first_item, from.first_item_count);
    to.mass = put(&f.mass, from.mass, from.mass_count);
    to.parts = put(&f.parts, from.parts, from.part_count);
    to.first_part = put(&f.first_part, from.first_part, from.first_part_count);
  }

  void upload_sub_shapes(const SubShapeView& from, std::size_t part_count) {
    SubShapes& s = sub_shapes_;
    SubShapeView& to = data_.near.sub_shapes;
    to = from;
    const std::uint32_t boxes = from.bounded_count - from.sphere_count;
    to.bodies = put(&s.bodies, from.bodies, from.count);
    to.numbers = put(&s.numbers, from.numbers, from.count);
    put(&s.bounds, from.all_bounds, from.bounded_count);
    put(&s.boxes, from.boxes, boxes);
    to.all_bounds = s.bounds.data();
    to.boxes = s.boxes.data();
    to.walls = put(&s.walls, from.walls, from.count - from.bounded_count);
    to.parts = put(&s.parts, from.parts, from.bounded_count);
    to.local = put(&s.local, from.local, part_count);
    data_.near.margins = room(&scratch_.margins, from.bounded_count);
    data_.near.swept = room(&scratch_.swept, from.bounded_count);
  }

  /// The contacts become those of the last step.
  void upload_contacts(const soft_step::ContactView& from) {
    Contacts& to = sets_[1 - now_];
    to.counts = {from.sphere_count, from.manifold_count, from.point_count};
    to.touch_count = 0;
    put(&to.spheres, from.spheres, from.sphere_count);
    put(&to.manifolds, from.manifolds, from.manifold_count);
    put(&to.points, from.points, from.point_count);
    put(&to.impulses, from.impulses, std::size_t{from.sphere_count} + from.point_count);
    put(&to.rolling_impulses, from.rolling_impulses, from.size());
    put(&to.colors, from.colors, from.size());
    std::vector<Range> ranges(data_.step.bodies.capacity);
    const auto find_ranges = [&](const auto* contacts, std::uint32_t count) {
      std::ranges::fill(ranges, Range{});
      for (std::uint32_t i = 0; i < count; ++i) {
        Range& range = ranges[contacts[i].key.a];
        if (range.end == 0) range.begin = i;
        range.end = i + 1;
      }
    };
    find_ranges(from.spheres, from.sphere_count);
    put(&to.spheres_of, ranges);
    device_->wait();  // the array is used again
    find_ranges(from.manifolds, from.manifold_count);
    put(&to.manifolds_of, ranges);
    device_->wait();
  }

  /// Buffers whose size is the number of bodies.
  void size_by_body(std::size_t n) {
    Scratch& s = scratch_;
    StepData& d = data_;
    d.motion = room(&s.motion, n);
    d.near.motion = d.motion;
    d.first_candidate = room(&s.first_candidate, n);
    d.manifold_sizes = room(&s.manifold_sizes, n);
    d.first_fixed = room(&s.first_fixed, n);
    d.used_colors = room(&s.used_colors, n);
    d.first_order = room(&s.first_order, n);
    d.first_contact = room(&s.first_contact, n);
    d.parent = room(&s.parent, n);
    d.marked = room(&s.marked, n);
    d.near_flag = room(&s.near_flag, n);
    d.step.near = d.near_flag;
    d.step.solver = room(&s.solver, n);
    d.step.orientation = room(&s.orientation, n);
    d.motion_cells = room(&s.motion_cells, n);
    d.free_cells = room(&s.free_cells, n);
    d.row_bodies = room(&s.row_bodies, n);
    d.pair_count = room(&s.pair_count, 1);
    d.counters = room(&counters_, 1);
    d.saved = {room(&saved_.last_acceleration, n), room(&saved_.mean_motion, n),
               room(&saved_.rest_time, n), room(&saved_.awake, n)};
  }

  /// Reserves the lists of a step for `capacity_`.
  void size_lists() {
    Scratch& s = scratch_;
    StepData& d = data_;
    const Capacity& c = capacity_;
    const std::size_t contacts = std::size_t{c.spheres} + c.candidates;
    const std::size_t impulses = std::size_t{c.spheres} + c.points;
    d.capacity = c;
    d.pairs = room(&s.pairs, c.pairs);
    d.pair_found = room(&s.pair_found, c.pairs);
    d.pair_results = room(&s.pair_results, c.pairs);
    d.candidates = room(&s.candidates, c.candidates);
    d.tested = room(&s.tested, c.candidates);
    d.next_candidate = room(&s.next_candidate, c.candidates);
    d.uncolored = room(&s.uncolored, contacts);
    d.still_uncolored = room(&s.still_uncolored, contacts);
    d.row_bins = room(&s.row_bins, contacts);
    d.row_contact = room(&s.row_contact, contacts);
    d.next_fixed = room(&s.next_fixed, contacts);
    d.overflow = room(&s.overflow, contacts);
    d.sphere_rows = {room(&s.sphere_rows, contacts), contacts};
    d.manifold_rows = room(&s.manifold_rows, contacts);
    d.point_rows = room(&s.point_rows, impulses);
    Contacts& now = sets_[now_];
    const std::size_t bodies = d.step.bodies.capacity;
    d.now.view = {room(&now.spheres, c.spheres),
                  room(&now.manifolds, c.candidates),
                  room(&now.points, c.points),
                  room(&now.impulses, impulses),
                  room(&now.rolling_impulses, contacts),
                  room(&now.colors, contacts),
                  0,
                  0,
                  0};
    d.now.spheres_of = room(&now.spheres_of, bodies);
    d.now.manifolds_of = room(&now.manifolds_of, bodies);
    d.touches = room(&now.touches, c.touches);
    d.position_before = room(&now.position_before, bodies);
    set_last(sets_[1 - now_]);
  }

  void set_last(const Contacts& last) {
    data_.last.view = {last.spheres.data(),
                       last.manifolds.data(),
                       last.points.data(),
                       last.impulses.data(),
                       last.rolling_impulses.data(),
                       last.colors.data(),
                       0,
                       0,
                       0};
    data_.last.spheres_of = last.spheres_of.data();
    data_.last.manifolds_of = last.manifolds_of.data();
    std::ranges::copy(last.counts, data_.last.counts);
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
    size_lists();
    data_.near.bodies = data_.step.bodies;
    const StepData& d = data_;
    const std::size_t bodies = d.step.bodies.count;
    const std::size_t sub_shapes = d.near.sub_shapes.bounded_count;
    const std::size_t contacts = std::max<std::size_t>(
        bodies, std::max<std::size_t>(sets_[1 - now_].counts[0], sets_[1 - now_].counts[1]));
    if (forces_.act) {
      device_->mark(0);
      device_->run(ForceProgram{d, forces_.view, forces_.time, forces_.force_sum.data(),
                                forces_.torque_sum.data()},
                   bodies);
    }
    device_->mark(1);
    device_->run(BoundsProgram{d, forces_.act}, std::max(bodies, sub_shapes));
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
    device_->download(&result, counters_.data(), 1);
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
        restore();
        if (result.must_wake != 0) return result;
        make_room(result.needed);
      } catch (...) {
        device_->wait();
        const Counters result = counters();
        if (result.completed == data_.number) return result;
        if (result.started == data_.number) restore();
        device_->wait();
        throw;
      }
    }
  }

  void restore() {
    const MotionPointers& m = data_.step.motion;
    const SavedArrays& saved = data_.saved;
    const std::size_t n = data_.step.bodies.capacity;
    device_->copy(m.last_acceleration, saved.last_acceleration, n);
    device_->copy(m.mean_motion, saved.mean_motion, n);
    device_->copy(m.rest_time, saved.rest_time, n);
    device_->copy(m.awake, saved.awake, n);
  }

  std::unique_ptr<Device> device_;
  StepData data_;
  Capacity capacity_;
  Properties properties_;
  Motion motion_;
  Saved saved_;
  SubShapes sub_shapes_;
  Forces forces_;
  Contacts sets_[2];
  int now_ = 0;  ///< the set of the step in progress; the other one is that of the last step
  Scratch scratch_;
  Buffer<Counters> counters_;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
