/// Generation, printing and shrinking of random worlds.
#include "tests/bullet/random_world.hpp"

#include <algorithm>
#include <cmath>
#include <ostream>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

// `random` is a Random, or test::Bytes.
bool chance(auto& random, Real share) { return random.uniform() < share; }

Real power_of_ten(auto& random, int low, int high) {
  Real value = 1;
  const int exponent =
      low + static_cast<int>(random.below(static_cast<std::uint64_t>(high - low) + 1));
  for (int i = 0; i < std::abs(exponent); ++i) value *= exponent > 0 ? Real(10) : Real(0.1);
  return value;
}

ShapeKind random_shape(auto& random, bool only_spheres) {
  if (only_spheres || chance(random, Real(0.7))) return ShapeKind::sphere;
  return static_cast<ShapeKind>(1 + random.below(4));
}

/// A plane through the origin, level or not, or near it.
void make_plane(auto& random, const RandomWorld& world, RandomBody* body) {
  body->shape = ShapeKind::plane;
  body->mass = 0;
  body->position = {0, 0, 0};
  if (chance(random, Real(0.6))) return;
  body->normal = normalized(random.uniform_in_box({-1, Real(0.2), -1}, {1, 1, 1}));
  body->offset = world.scale * random.uniform(-1, 1);
  body->position = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
}

RandomBody random_body(auto& random, const RandomWorld& world, Real edge, bool only_spheres,
                       bool mixed_sizes) {
  RandomBody body;
  body.shape = random_shape(random, only_spheres);
  body.size = world.scale * random.uniform(Real(0.5), Real(1.5));
  if (mixed_sizes) body.size *= power_of_ten(random, -2, 1);
  if (chance(random, Real(0.2))) body.size = world.scale;
  body.position = random.uniform_in_box({0, 0, 0}, {edge, edge, edge});
  // Coincident centres only for spheres: Bullet's GJK leaves the unused fourth component of the
  // normal uninitialized there, so that two stock worlds differ.
  if (chance(random, Real(0.05)) && body.shape == ShapeKind::sphere) {
    body.position = {edge / 2, edge / 2, edge / 2};
  }
  const Real speed = world.scale * (chance(random, Real(0.1)) ? Real(60) : Real(3));
  body.velocity = random.uniform_in_box({-speed, -speed, -speed}, {speed, speed, speed});
  body.spin = random.uniform_in_box({-5, -5, -5}, {5, 5, 5});
  body.mass = chance(random, Real(0.12)) ? Real(0) : random.uniform(Real(0.1), Real(5));
  if (body.shape == ShapeKind::plane) make_plane(random, world, &body);
  if (chance(random, Real(0.6))) {
    body.traits = static_cast<unsigned>(random.next() & random.next()) & ((1u << kTraitCount) - 1);
  }
  if (chance(random, Real(0.15))) {
    body.group = 1 << random.below(4);
    body.mask = static_cast<int>(random.below(16));
  }
  if (chance(random, Real(0.5))) {
    body.friction = random.uniform(0, 4);
    body.restitution = random.uniform(0, 1);
    body.rolling = random.uniform(Real(-0.5), 1);
  }
  return body;
}

RandomEvent random_event(auto& random, const RandomWorld& world, Real edge) {
  RandomEvent event;
  event.step = static_cast<int>(random.below(static_cast<std::uint64_t>(world.steps)));
  event.kind = static_cast<EventKind>(random.below(kEventKinds - 1));  // terrains have own events
  // Bullet's btCompoundCollisionAlgorithm::calculateTimeOfImpact reads a null shape.
  const bool compounds =
      std::any_of(world.bodies.begin(), world.bodies.end(),
                  [](const RandomBody& b) { return b.shape == ShapeKind::compound; });
  if (event.kind == EventKind::continuous && compounds) event.kind = EventKind::dispatch;
  event.a = random.below(world.bodies.size());
  event.b = random.below(world.bodies.size());
  event.v = random.uniform_in_box({0, 0, 0}, {edge, edge, edge});
  event.x = random.uniform(Real(0.5), Real(1.5));
  event.bits = static_cast<unsigned>(random.next() & random.next());
  return event;
}

/// A mesh or height field below the bodies, at rest or moving, and events that change it. The last
/// draws, so that the inputs of the fuzzer keep their meaning.
void add_terrain(auto& random, Real edge, RandomWorld* world) {
  RandomBody terrain;
  terrain.shape = chance(random, Real(0.5)) ? ShapeKind::mesh : ShapeKind::heights;
  terrain.size = edge / 5;
  terrain.position = {edge / 2, random.uniform(Real(-0.2), Real(0.3)) * edge, edge / 2};
  terrain.mass = 0;
  if (chance(random, Real(0.3))) {
    terrain.traits |= kKinematic;
    terrain.velocity = random.uniform_in_box({-1, -1, -1}, {1, 1, 1}) * world->scale;
  }
  if (chance(random, Real(0.2))) terrain.traits |= kCustomMaterial;
  if (chance(random, Real(0.3))) terrain.traits |= kMargin;
  terrain.friction = random.uniform(0, 2);
  world->bodies.push_back(terrain);
  for (std::uint64_t n = random.below(6); n > 0; --n) {
    RandomEvent event = random_event(random, *world, edge);
    event.a = world->bodies.size() - 1;
    if (chance(random, Real(0.5))) event.kind = EventKind::deform;
    world->events.push_back(event);
  }
}

RandomWorld draw_world(auto& random) {
  RandomWorld world;
  world.steps = 10 + static_cast<int>(random.below(70));
  world.scale = power_of_ten(random, -2, 2);
  if (chance(random, Real(0.2))) world.dt = Real(1) / 30;
  world.sub_steps = chance(random, Real(0.1)) ? 3 : 0;
  if (chance(random, Real(0.75))) world.gravity = {0, -10 * world.scale, 0};
  world.broadphase = chance(random, Real(0.6)) ? BroadphaseKind::tree
                                               : static_cast<BroadphaseKind>(random.below(4));
  world.deterministic = chance(random, Real(0.25));
  world.split_islands = !chance(random, Real(0.1));
  world.verify = chance(random, Real(0.1));
  world.minimum_batch = chance(random, Real(0.1)) ? 12 : 0;
  world.pool = chance(random, Real(0.2)) ? 4 : 64;
  if (chance(random, Real(0.2)))
    world.breaking_threshold = Real(0.02) * power_of_ten(random, -2, 1);
  if (chance(random, Real(0.3)))
    world.callbacks = static_cast<unsigned>(random.next()) & kAllCallbacks;
  // Rare, because replaced near callbacks disable batches.
  if (chance(random, Real(0.8))) world.callbacks &= ~unsigned{kNear};

  const std::size_t count = 2 + random.below(chance(random, Real(0.1)) ? 40 : 12);
  const Real edge =
      world.scale * random.uniform(Real(0.5), 2) * std::sqrt(static_cast<Real>(count));
  const bool only_spheres = chance(random, Real(0.4)), mixed = chance(random, Real(0.2));
  if (chance(random, Real(0.5))) {
    RandomBody ground;
    ground.shape = ShapeKind::box;
    ground.size = 20 * world.scale;
    ground.position = {0, -ground.size, 0};
    ground.mass = 0;
    if (chance(random, Real(0.5))) make_plane(random, world, &ground);
    world.bodies.push_back(ground);
  }
  for (std::size_t i = 0; i < count; ++i) {
    world.bodies.push_back(random_body(random, world, edge, only_spheres, mixed));
  }
  for (std::uint64_t n = chance(random, Real(0.3)) ? random.below(5) : 0; n > 0; --n) {
    RandomJoint joint{random.below(world.bodies.size()), random.below(world.bodies.size()),
                      chance(random, Real(0.5)), Real(1e30)};
    if (chance(random, Real(0.3))) joint.breaking = random.uniform(0, 10);
    if (joint.a != joint.b) world.joints.push_back(joint);
  }
  for (std::uint64_t n = chance(random, Real(0.8)) ? random.below(25) : 0; n > 0; --n) {
    world.events.push_back(random_event(random, world, edge));
  }
  if (chance(random, Real(0.2))) world.threads = 2;
  if (chance(random, Real(0.25))) add_terrain(random, edge, &world);
  std::stable_sort(world.events.begin(), world.events.end(),
                   [](const RandomEvent& p, const RandomEvent& q) { return p.step < q.step; });
  return world;
}

const char* name_of(ShapeKind kind) {
  constexpr const char* kNames[] = {"sphere",  "box",  "plane",  "compound",
                                    "capsule", "mesh", "heights"};
  return kNames[static_cast<std::size_t>(kind)];
}
const char* name_of(EventKind kind) {
  constexpr const char* kNames[kEventKinds] = {
      "teleport",   "toggle",     "radius", "scale",        "reshape",           "push",
      "activation", "ignore",     "traits", "filter",       "gravity",           "callbacks",
      "dispatch",   "continuous", "order",  "contact_test", "contact_pair_test", "deform"};
  return kNames[static_cast<std::size_t>(kind)];
}
std::ostream& operator<<(std::ostream& out, const Vec3& v) {
  return out << '(' << v.x << ", " << v.y << ", " << v.z << ')';
}

/// Keeps a change only if the world still fails.
class Shrinker {
 public:
  Shrinker(RandomWorld world, MakeDispatcher ours) : world_(std::move(world)), ours_(ours) {}

  RandomWorld shrink() {
    do {
      changed_ = false;
      cut_steps();
      drop_bodies();
      drop_from(&RandomWorld::events);
      drop_from(&RandomWorld::joints);
      simplify();
    } while (changed_);
    return std::move(world_);
  }

 private:
  bool try_out(const RandomWorld& candidate) {
    if (!run(candidate, nullptr, ours_)) return false;
    world_ = candidate;
    changed_ = true;
    return true;
  }
  void cut_steps() {
    const auto failure = run(world_, nullptr, ours_);
    if (failure && failure->step < world_.steps) {
      world_.steps = failure->step;
      std::erase_if(world_.events, [&](const RandomEvent& e) { return e.step >= world_.steps; });
      changed_ = true;
    }
  }
  void drop_bodies() {
    for (std::size_t i = world_.bodies.size(); i-- > 0;) {
      if (!world_.bodies[i].used) continue;
      RandomWorld candidate = world_;
      candidate.bodies[i].used = false;
      try_out(candidate);
    }
  }
  template <class Item>
  void drop_from(std::vector<Item> RandomWorld::*list) {
    for (std::size_t i = (world_.*list).size(); i-- > 0;) {
      RandomWorld candidate = world_;
      (candidate.*list).erase((candidate.*list).begin() + static_cast<std::ptrdiff_t>(i));
      try_out(candidate);
    }
  }
  template <class Field, class Value>
  void set(Field RandomWorld::*field, Value value) {
    if (world_.*field == static_cast<Field>(value)) return;
    RandomWorld candidate = world_;
    candidate.*field = static_cast<Field>(value);
    try_out(candidate);
  }
  void simplify() {
    const RandomWorld plain;
    set(&RandomWorld::broadphase, BroadphaseKind::tree);
    set(&RandomWorld::deterministic, false);
    set(&RandomWorld::split_islands, true);
    set(&RandomWorld::verify, false);
    set(&RandomWorld::sub_steps, 0);
    set(&RandomWorld::threads, plain.threads);
    set(&RandomWorld::pool, plain.pool);
    for (unsigned bit = 1; bit < kAllCallbacks; bit <<= 1) {
      set(&RandomWorld::callbacks, world_.callbacks & ~bit);
    }
    for (std::size_t i = 0; i < world_.bodies.size(); ++i) {
      if (!world_.bodies[i].used) continue;
      for (unsigned bit = 0; bit < kTraitCount; ++bit) {
        if ((world_.bodies[i].traits >> bit & 1) == 0) continue;
        RandomWorld candidate = world_;
        candidate.bodies[i].traits &= ~(1u << bit);
        try_out(candidate);
      }
    }
  }

  RandomWorld world_;
  MakeDispatcher ours_;
  bool changed_ = false;
};

}  // namespace

std::size_t RandomWorld::used_bodies() const {
  return static_cast<std::size_t>(
      std::count_if(bodies.begin(), bodies.end(), [](const RandomBody& b) { return b.used; }));
}

RandomWorld make_random_world(std::uint64_t seed) {
  Random random(seed);
  RandomWorld world = draw_world(random);
  world.seed = seed;
  return world;
}

RandomWorld make_random_world(test::Bytes& bytes) { return draw_world(bytes); }

RandomWorld shrink(RandomWorld world, MakeDispatcher ours) {
  return Shrinker(std::move(world), ours).shrink();
}

std::ostream& operator<<(std::ostream& out, const RandomWorld& world) {
  out.precision(sizeof(Real) == 4 ? 9 : 17);
  out << "world of JFPX_TEST_SEED=" << world.seed << ": steps " << world.steps << ", dt "
      << world.dt << ", sub steps " << world.sub_steps << ", gravity " << world.gravity
      << ", broadphase " << static_cast<int>(world.broadphase) << ", deterministic "
      << world.deterministic << ", split islands " << world.split_islands << ", verify "
      << world.verify << ", minimum batch " << world.minimum_batch << ", threads " << world.threads
      << ", pool " << world.pool << ", breaking threshold " << world.breaking_threshold
      << ", callbacks " << world.callbacks << '\n';
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    const RandomBody& body = world.bodies[i];
    if (!body.used) continue;
    out << "  body " << i << ": " << name_of(body.shape) << ' ' << body.size << " at "
        << body.position << ", velocity " << body.velocity << ", spin " << body.spin << ", mass "
        << body.mass << ", traits " << body.traits << ", group " << body.group << ", mask "
        << body.mask << ", friction " << body.friction << ", restitution " << body.restitution
        << ", rolling " << body.rolling << '\n';
  }
  for (const RandomJoint& joint : world.joints) {
    out << "  joint of " << joint.a << " and " << joint.b << ", collide " << joint.collide
        << ", breaking " << joint.breaking << '\n';
  }
  for (const RandomEvent& event : world.events) {
    out << "  before step " << event.step << ": " << name_of(event.kind) << ' ' << event.a << ' '
        << event.b << ' ' << event.v << ' ' << event.x << ' ' << event.bits << '\n';
  }
  return out;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
