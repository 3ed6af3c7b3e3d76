/// Benchmark of rays, casts and overlaps among 20,000 bodies, compared with a linear scan.
#include <jfpx/random.hpp>

#include "src/scenes/scenes.hpp"
#include "tests/world/linear_queries.hpp"

#include <benchmark/benchmark.h>

namespace jfpx {
namespace {

constexpr std::uint32_t kBodies = 20000;

/// Bounds of the positions of the bodies.
Aabb room_of(const World& world) {
  Aabb room;
  for (const BodyId id : world.bodies()) {
    if (!(world.mass(id) > 0)) continue;
    const Vec3 position = world.state(id).position;
    room = merged(room, {position, position});
  }
  return room;
}

/// The scene after a step.
World make_world(const char* scene) {
  World world(scenes::make(scene, {.spheres = kBodies, .seed = 1}));
  world.step();
  return world;
}

/// Rays from outside through a random point among the bodies.
class Rays {
 public:
  explicit Rays(const Aabb& room) : room_(room) {
    const Vec3 size = room.upper - room.lower;
    outside_ = Real(2) * std::max({size.x, size.y, size.z});
  }
  Ray next() {
    const Vec3 target = point();
    const Vec3 direction = normalized(random_.uniform_in_box({-1, Real(-0.99), -1}, {1, 0, 1}));
    return {add_scaled(target, direction, -outside_), direction};
  }
  Real outside() const { return outside_; }  ///< [m], of the origins from the targets
  Vec3 point() { return random_.uniform_in_box(room_.lower, room_.upper); }

 private:
  Random random_{1};
  Aabb room_;
  Real outside_ = 0;
};

void scan(benchmark::State& state, const char* scene) {
  const World world = make_world(scene);
  const test::LinearQueries queries(world);
  Rays rays(room_of(world));
  for (auto _ : state) benchmark::DoNotOptimize(queries.cast_ray(rays.next()));
}

void ray(benchmark::State& state, const char* scene) {
  const World world = make_world(scene);
  Rays rays(room_of(world));
  for (auto _ : state) benchmark::DoNotOptimize(world.cast_ray(rays.next()));
}

void ray_through(benchmark::State& state, const char* scene) {
  const World world = make_world(scene);
  Rays rays(room_of(world));
  for (auto _ : state) benchmark::DoNotOptimize(world.cast_ray_through(rays.next()));
}

void overlap(benchmark::State& state, const char* scene) {
  const World world = make_world(scene);
  Rays rays(room_of(world));
  for (auto _ : state) benchmark::DoNotOptimize(world.overlapping(Sphere{1}, rays.point()));
}

/// The first hit of a solid that moves along a ray, to the other side of the bodies.
void cast(benchmark::State& state, const char* scene, const SolidShape& shape) {
  const World world = make_world(scene);
  Rays rays(room_of(world));
  for (auto _ : state) {
    const Ray ray = rays.next();
    benchmark::DoNotOptimize(
        world.cast_shape({shape, ray.origin, {}, ray.direction * (2 * rays.outside())}));
  }
}
void cast_sphere(benchmark::State& state, const char* scene) {
  cast(state, scene, Sphere{Real(0.5)});
}
void cast_capsule(benchmark::State& state, const char* scene) {
  cast(state, scene, Capsule{Real(0.4), Real(0.5)});
}
void cast_box(benchmark::State& state, const char* scene) { cast(state, scene, Box{}); }
/// As the ground check of a character.
void cast_short(benchmark::State& state, const char* scene) {
  const World world = make_world(scene);
  Rays rays(room_of(world));
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        world.cast_shape({Sphere{Real(0.35)}, rays.point(), {}, {0, Real(-0.1), 0}}));
  }
}

/// The body that is closest to a point or a box among the bodies.
void closest(benchmark::State& state, const char* scene, const SolidShape& shape) {
  const World world = make_world(scene);
  Rays rays(room_of(world));
  for (auto _ : state) benchmark::DoNotOptimize(world.closest_body({rays.point(), shape}));
}
void closest_to_point(benchmark::State& state, const char* scene) {
  closest(state, scene, Sphere{0});
}
void closest_to_box(benchmark::State& state, const char* scene) { closest(state, scene, Box{}); }
void within(benchmark::State& state, const char* scene) {
  const World world = make_world(scene);
  Rays rays(room_of(world));
  for (auto _ : state) {
    benchmark::DoNotOptimize(world.bodies_within({rays.point(), Sphere{Real(0.5)}, {}, 1}));
  }
}

/// A ray after a change of the world, which builds the tree again.
void ray_after_change(benchmark::State& state, const char* scene) {
  World world = make_world(scene);
  Rays rays(room_of(world));
  const BodyId body = world.bodies()[0];
  const BodyState same = world.state(body);
  for (auto _ : state) {
    world.set_state(body, same);
    benchmark::DoNotOptimize(world.cast_ray(rays.next()));
  }
}

void register_all() {
  for (const char* scene : {"gas", "pile", "polydisperse", "mixed"}) {
    const auto add = [scene](const char* name, void (*run)(benchmark::State&, const char*)) {
      benchmark::RegisterBenchmark((std::string(scene) + "/" + name).c_str(), run, scene)
          ->Unit(benchmark::kMicrosecond);
    };
    add("scan", scan);
    add("ray", ray);
    add("ray_through", ray_through);
    add("cast_sphere", cast_sphere);
    add("cast_capsule", cast_capsule);
    add("cast_box", cast_box);
    add("cast_short", cast_short);
    add("closest_to_point", closest_to_point);
    add("closest_to_box", closest_to_box);
    add("within", within);
    add("overlap", overlap);
    add("ray_after_change", ray_after_change);
  }
}

}  // namespace
}  // namespace jfpx

int main(int argc, char** argv) {
  jfpx::register_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
