/// Fuzzer of the interface of World: makes the same calls on two worlds that find contacts with
/// different algorithms and numbers of threads. Results, errors, bits and snapshots are equal,
/// calls that throw change nothing, and steps after a restoration repeat those before.
#include <jfpx/error.hpp>

#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/world_input.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using fuzz::add_drawn_force;
using fuzz::draw_body;
using fuzz::draw_contact;
using fuzz::draw_filter;
using fuzz::draw_id;
using fuzz::draw_joint;
using fuzz::draw_locks;
using fuzz::draw_state;
using fuzz::require;
using test::Bytes;

constexpr std::size_t kMaxBodies = 20, kMaxForces = 8, kMaxJoints = 12;
constexpr int kMaxCalls = 48;

/// The result of a call, or the message of its exception.
template <class Result>
struct Outcome {
  std::optional<Result> result;
  std::string error;
  friend bool operator==(const Outcome&, const Outcome&) = default;
};

template <class Call>
auto outcome(Call call) {
  using Result =
      std::conditional_t<std::is_void_v<decltype(call())>, std::monostate, decltype(call())>;
  Outcome<Result> outcome;
  try {
    if constexpr (std::is_void_v<decltype(call())>) {
      call();
      outcome.result.emplace();
    } else {
      outcome.result = call();
    }
  } catch (const InvalidArgument& error) {
    outcome.error = error.what();
  } catch (const InvalidScene& error) {
    outcome.error = error.what();
  } catch (const InvalidSnapshot& error) {
    outcome.error = error.what();
  }
  return outcome;
}

class Twins {
 public:
  Twins(const Scene& scene, const WorldSettings& settings)
      : first_(scene, WorldSettings{.collider = {.backend = Backend::cpu}}),
        second_(scene, settings) {}

  const World& world() const { return first_; }

  /// Makes the same call on both worlds. It returns void, or a type with an ==.
  template <class Call>
  auto both(Call call) {
    const std::uint64_t before = first_.state_hash();
    const std::size_t bodies = first_.bodies().size();
    const auto first = outcome([&] { return call(first_); });
    const auto second = outcome([&] { return call(second_); });
    require(first == second, "both worlds have the same result");
    require(first.result || (first_.state_hash() == before && first_.bodies().size() == bodies),
            "a call that throws changes nothing");
    compare();
    return first.result;
  }

  void step() {
    const std::uint64_t before = first_.state_hash();
    const double time = first_.time();
    const auto done = both([](World& w) {
      const StepReport report = w.step();
      return std::tuple(report.step, report.contacts, report.generated_contacts,
                        report.position_iterations, report.velocity_iterations, report.non_finite,
                        report.non_finite_body, report.awake);
    });
    const bool failed = !done || std::get<5>(*done);
    require(!failed || (first_.state_hash() == before && first_.time() == time &&
                        first_.contacts().empty() && first_.contact_events().empty()),
            "a failed step leaves no trace");
    if (!failed) check_contacts(std::get<1>(*done));
  }

  Snapshot snapshot() const {
    Snapshot snapshot = first_.snapshot();
    require(snapshot == second_.snapshot(), "both worlds have the same snapshot");
    return snapshot;
  }

  /// @returns whether the snapshot fits; it does not if a function of the program came or went
  bool restore(const Snapshot& snapshot) {
    const Snapshot before = first_.snapshot();
    const auto restored = both([&](World& w) { w.restore(snapshot); });
    const Snapshot now = this->snapshot();
    require(now == (restored ? snapshot : before), "the state is that of the snapshot");
    require(!restored || first_.contact_events().empty(), "events follow with the next step");
    return restored.has_value();
  }

  void move() {
    World elsewhere = std::move(first_);
    first_ = std::move(second_);
    second_ = std::move(elsewhere);
  }

 private:
  /// Checks the first `detected` contacts; the others are those of contact generators.
  void check_contacts(std::uint64_t detected) const {
    for (const Contact& c : first_.contacts()) {
      if (detected == 0) return require(!c.sensor, "contacts of generators are resolved");
      --detected;
      require(may_collide(first_.filter(c.a), first_.filter(c.b)), "contacts match the filters");
      require(!first_.pair_ignored(c.a, c.b), "ignored pairs have no contacts");
      require(c.sensor == (first_.sensor(c.a) || first_.sensor(c.b)), "sensors are marked");
    }
  }

  static auto properties(const World& w, BodyId id) {
    return std::tuple(w.mass(id), w.inertia(id), w.friction(id), w.restitution(id),
                      w.acceleration(id), w.linear_damping(id), w.angular_damping(id),
                      w.user_data(id), w.filter(id));
  }

  void compare() const {
    require(std::ranges::equal(first_.bodies(), second_.bodies()), "equal bodies");
    require(first_.state_hash() == second_.state_hash(), "equal bits");
    require(std::ranges::equal(first_.contacts(), second_.contacts()), "equal contacts");
    require(std::ranges::equal(first_.contact_events(), second_.contact_events()), "equal events");
    require(std::ranges::equal(first_.contact_forces(), second_.contact_forces()), "equal forces");
    for (const BodyId id : first_.bodies()) {
      require(properties(first_, id) == properties(second_, id), "equal properties");
      const BodyState state = first_.state(id);
      require(is_finite(state.position) && is_finite(state.orientation) &&
                  is_finite(state.velocity) && is_finite(state.angular_velocity),
              "states are finite");
      require(first_.awake(id) == second_.awake(id), "the same bodies are awake");
    }
  }

  World first_, second_;
};

void query(Bytes& bytes, Twins& twins) {
  if (bytes.chance(Real(0.5))) {
    Ray ray{.origin = bytes.vector(-5, 5), .direction = bytes.vector(-1, 1)};
    if (bytes.chance(Real(0.5))) ray.max_distance = bytes.number(0, 10);
    const auto nearest = twins.both([&](World& w) { return w.cast_ray(ray); });
    const auto all = twins.both([&](World& w) { return w.cast_ray_through(ray); });
    require(nearest.has_value() == all.has_value(), "both reject the ray");
    if (!all) return;
    require(nearest->has_value() == !all->empty(), "a ray that hits has a first hit");
    if (!all->empty()) require(**nearest == all->front(), "the first hit is the first of all hits");
    return;
  }
  const Vec3 centre = bytes.vector(-5, 5);
  const Real size = bytes.number(Real(0.1), 3);
  twins.both([&](World& w) { return w.overlapping(Sphere{size}, centre); });
  ShapeCast cast{.shape = Sphere{size}, .position = centre, .translation = bytes.vector(-9, 9)};
  if (bytes.chance(Real(0.5))) cast.shape = Cone{size, size};
  const auto first = twins.both([&](World& w) { return w.cast_shape(cast); });
  const auto casts = twins.both([&](World& w) { return w.cast_shape_through(cast); });
  require(first.has_value() == casts.has_value(), "both reject the cast");
  if (casts) {
    require(first->has_value() == !casts->empty(), "a cast that hits has a first hit");
    require(casts->empty() || **first == casts->front(), "the first hit is the first of all hits");
  }
  const DistanceQuery query{centre, cast.shape, {}, bytes.number(0, 9)};
  const auto closest = twins.both([&](World& w) { return w.closest_body(query); });
  const auto nearby = twins.both([&](World& w) { return w.bodies_within(query); });
  require(closest.has_value() == nearby.has_value(), "both reject the distance query");
  if (nearby) {
    require(closest->has_value() == !nearby->empty(),
            "a query that finds bodies has a closest one");
    require(nearby->empty() || **closest == nearby->front(), "the closest body is the first one");
  }
  const Vec3 half = bytes.vector(Real(0.1), 3);
  twins.both([&](World& w) { return w.overlapping(Box{half}, centre, {0, 1, 0, 0}); });
}

void push(Bytes& bytes, Twins& twins) {
  const BodyId id = draw_id(bytes, twins.world().bodies());
  const Vec3 force = bytes.vector(-100, 100), point = bytes.vector(-3, 3);
  const bool finite = is_finite(force);
  const auto pushed = twins.both([&](World& w) { w.apply_force(id, force); });
  require(finite || !pushed, "a force that is not finite is refused");
  twins.both([&](World& w) { w.apply_force_at_point(id, force, point); });
  twins.both([&](World& w) { w.apply_torque(id, force); });
  twins.both([&](World& w) { w.apply_impulse_at_point(id, force, point); });
  twins.both([&](World& w) { w.apply_angular_impulse(id, force); });
}

void change_forces(Bytes& bytes, Twins& twins) {
  const auto forces = twins.world().forces();
  if (forces.size() < kMaxForces && bytes.chance(Real(0.7))) {
    twins.both([&](World& w) { return add_drawn_force(bytes, w); });
  } else {
    const ForceId id =
        forces.empty() ? ForceId{bytes.below(9)} : forces[bytes.below(forces.size())];
    twins.both([&](World& w) { w.remove_force(id); });
  }
}

void change_generators(Bytes& bytes, Twins& twins) {
  const auto generators = twins.world().contact_generators();
  if (generators.size() < kMaxForces && bytes.chance(Real(0.6))) {
    const GeneratedContact contact = draw_contact(bytes, twins.world().bodies());
    twins.both([&](World& w) {
      return w.add_contact_generator([contact](ContactContext& context) { context.add(contact); });
    });
  } else {
    const ContactGeneratorId id =
        generators.empty() ? ContactGeneratorId{7} : generators[bytes.below(generators.size())];
    twins.both([&](World& w) { w.remove_contact_generator(id); });
  }
}

void change_joints(Bytes& bytes, Twins& twins) {
  const auto joints = twins.world().joints();
  const JointId id = joints.empty() ? JointId{7} : joints[bytes.below(joints.size())];
  const Joint joint = draw_joint(bytes, twins.world().bodies());
  switch (bytes.below(4)) {
    case 0:
      twins.both([&](World& w) { w.remove_joint(id); });
      break;
    case 1: {
      const auto set = twins.both([&](World& w) { w.set_joint(id, joint); });
      require(!set || twins.world().joint(id) == joint, "a joint is what was set");
      break;
    }
    default:
      if (joints.size() >= kMaxJoints) break;
      twins.both([&](World& w) { return w.add_joint(joint); });
  }
  for (const JointId each : twins.world().joints()) {
    twins.both([&](World& w) { return w.joint_state(each); });
  }
}

void change_properties(Bytes& bytes, Twins& twins) {
  const BodyId id = draw_id(bytes, twins.world().bodies());
  switch (bytes.below(10)) {
    case 0: {
      if (twins.world().bodies().size() >= kMaxBodies) break;
      BodyDef def = draw_body(bytes);
      def.filter = draw_filter(bytes);
      def.sensor = bytes.chance(Real(0.7));
      if (bytes.chance(Real(0.3))) def.motion_locks = draw_locks(bytes);
      def.user_data = bytes.next();
      twins.both([&](World& w) { return w.add(def); });
      break;
    }
    case 1: {
      const CollisionFilter filter = draw_filter(bytes);
      const auto set = twins.both([&](World& w) { w.set_filter(id, filter); });
      require(!set || twins.world().filter(id) == filter, "a filter is what was set");
      break;
    }
    case 2: {
      const BodyId other = draw_id(bytes, twins.world().bodies());
      const bool ignored = bytes.chance(Real(0.7));
      const auto set = twins.both([&](World& w) { w.set_pair_ignored(id, other, ignored); });
      require(!set || twins.world().pair_ignored(other, id) == ignored, "a pair is what was set");
      break;
    }
    case 3: {
      const Real mass = bytes.number(Real(0.1), 5);
      const auto set = twins.both([&](World& w) { w.set_mass(id, mass); });
      require(!set || twins.world().mass(id) == mass, "a mass is what was set");
      break;
    }
    case 4: {
      std::optional<Mat3> inertia;
      if (bytes.chance(Real(0.7))) inertia = diagonal(bytes.vector(1, 2));
      twins.both([&](World& w) { w.set_inertia(id, inertia); });
      break;
    }
    case 5: {
      const Real friction = bytes.number(0, 2), restitution = bytes.number(0, 1);
      twins.both([&](World& w) { w.set_friction(id, friction); });
      twins.both([&](World& w) { w.set_restitution(id, restitution); });
      break;
    }
    case 6:
      twins.both([id, a = bytes.vector(-10, 10)](World& w) { w.set_acceleration(id, a); });
      break;
    case 7: {
      const Real linear = bytes.number(Real(0.5), 1), angular = bytes.number(Real(0.5), 1);
      twins.both([&](World& w) { w.set_damping(id, linear, angular); });
      break;
    }
    case 8: {
      const MotionLocks locks = draw_locks(bytes);
      const auto set = twins.both([&](World& w) { w.set_motion_locks(id, locks); });
      require(!set || !(twins.world().mass(id) > 0) || twins.world().motion_locks(id) == locks,
              "locks are what was set");
      break;
    }
    default:
      twins.both([id, data = bytes.next()](World& w) { w.set_user_data(id, data); });
  }
}

/// Gives a body another definition, which a joint may prevent.
void replace_body(Bytes& bytes, Twins& twins) {
  const BodyId id = draw_id(bytes, twins.world().bodies());
  BodyDef def = draw_body(bytes);
  def.filter = draw_filter(bytes);
  def.sensor = bytes.chance(Real(0.7));
  const auto replaced = twins.both([&](World& w) { w.replace(id, def); });
  require(!replaced || twins.world().mass(id) == def.mass, "a mass is that of the definition");
}

/// The observable result of a step.
struct Moment {
  Snapshot snapshot;
  std::vector<ContactEvent> events;
  friend bool operator==(const Moment&, const Moment&) = default;
};

std::vector<Moment> follow(Twins& twins, std::uint64_t steps) {
  std::vector<Moment> moments;
  for (; steps > 0; --steps) {
    twins.step();
    const auto events = twins.world().contact_events();
    moments.push_back({twins.snapshot(), {events.begin(), events.end()}});
  }
  return moments;
}

/// Takes a snapshot for later, restores one, or repeats steps.
void travel(Bytes& bytes, Twins& twins, std::optional<Snapshot>* kept) {
  switch (bytes.below(4)) {
    case 0:
      *kept = twins.snapshot();
      break;
    case 1:
      if (*kept) twins.restore(**kept);
      break;
    case 2: {  // the snapshot of another program, in which one byte may be damaged
      Snapshot snapshot = twins.snapshot();
      const std::size_t at = bytes.below(65536) % snapshot.bytes.size();
      const auto change = static_cast<std::byte>(bytes.below(256));
      snapshot.bytes[at] ^= change;
      require(twins.restore(snapshot) == (change == std::byte{0}), "a damaged snapshot is refused");
      break;
    }
    default: {
      const Snapshot now = twins.snapshot();
      const std::uint64_t steps = 1 + bytes.below(4);
      const std::vector<Moment> expected = follow(twins, steps);
      require(twins.restore(now), "the callbacks are the same");
      require(follow(twins, steps) == expected, "steps after a restoration repeat those before");
    }
  }
}

void call_anything(Bytes& bytes, Twins& twins, std::optional<Snapshot>* kept) {
  const std::uint64_t byte = bytes.below(256);
  // Inputs of the corpus keep their meaning: these bytes were steps.
  if (byte % 20 == 18) return change_properties(bytes, twins);
  if (byte % 20 == 9) return travel(bytes, twins, kept);
  if (byte % 40 == 8) return change_joints(bytes, twins);
  if (byte % 40 == 28) return replace_body(bytes, twins);
  switch (byte % 10) {
    case 0:
      if (twins.world().bodies().size() >= kMaxBodies) break;
      twins.both([def = draw_body(bytes)](World& w) { return w.add(def); });
      break;
    case 1:
      twins.both([id = draw_id(bytes, twins.world().bodies())](World& w) { w.remove(id); });
      break;
    case 2: {
      const BodyId id = draw_id(bytes, twins.world().bodies());
      twins.both([id, state = draw_state(bytes)](World& w) { w.set_state(id, state); });
      break;
    }
    case 3:
      push(bytes, twins);
      break;
    case 4:
      change_forces(bytes, twins);
      break;
    case 5:
      change_generators(bytes, twins);
      break;
    case 6:
      query(bytes, twins);
      break;
    case 7:
      twins.move();
      break;
    default:
      for (std::uint64_t n = 1 + bytes.below(6); n > 0; --n) twins.step();
  }
}

}  // namespace
}  // namespace JFPX_ABI
}  // namespace jfpx

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace jfpx;
  test::Bytes bytes({data, size});
  WorldSettings settings = fuzz::draw_settings(bytes);
  Scene scene = fuzz::draw_scene(bytes);
  // Drawn from the last byte, so that inputs of the corpus keep their meaning.
  const unsigned last = size > 0 ? data[size - 1] : 0;
  if (size > 0) scene.solver = last % 2 == 0 ? Solver::soft_step : Solver::worst_first;
  if (last / 2 % 4 != 0) settings.threads = 1 + last / 2 % 4;
  std::optional<Twins> twins;
  try {
    twins.emplace(scene, settings);
  } catch (const InvalidScene&) {
    return 0;
  }
  std::optional<Snapshot> kept;
  for (int calls = 0; calls < kMaxCalls && !bytes.used_up(); ++calls) {
    call_anything(bytes, *twins, &kept);
  }
  return 0;
}
