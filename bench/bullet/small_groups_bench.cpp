/// Compares whole steps of a stock Bullet world with a world that has jfpx's parts, where jfpx can
/// gain little or nothing: groups in which little can be solved in parallel (few boxes, and bodies
/// that all touch one movable platform), and worlds that sleep.
///
/// Each benchmark owns two worlds with identical motion and steps both in alternating order, on one
/// thread, in CPU time. `ratio` is the median time of stock divided by that of jfpx, and
/// `mean_ratio` the same of the sums, which include trials: 0.97 means that jfpx is 3 % slower.
#include <jfpx/random.hpp>

#include "bench/bullet/step_parts.hpp"
#include "src/scenes/scenes.hpp"

#include <numeric>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

BodyDef body_at(const Shape& shape, const Vec3& position, Real mass) {
  BodyDef body;
  body.shape = shape;
  body.position = position;
  body.mass = mass;
  return body;
}

Scene on_the_ground(const char* name) {
  Scene scene;
  scene.name = name;
  scene.sleep.enabled = false;
  scene.bodies.push_back(body_at(HalfSpace{{0, 1, 0}, 0}, {}, 0));
  return scene;
}

/// A heap of boxes that has come to rest.
Scene heap_of_boxes(std::uint32_t count) {
  Scene scene = on_the_ground("heap of boxes");
  Random random(1);
  const Box box{{Real(0.5), Real(0.4), Real(0.3)}};
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3 offset =
        random.uniform_in_box({Real(-0.3), 0, Real(-0.3)}, {Real(0.3), 0, Real(0.3)});
    scene.bodies.push_back(body_at(box, offset + Vec3{Real(i % 3), Real(1.2) * Real(i) + 1, 0}, 1));
  }
  return scene;
}

/// Bodies side by side on one heavy platform, which is movable: every contact shares it.
Scene on_a_platform(std::uint32_t count, const Shape& shape) {
  Scene scene = on_the_ground("platform");
  std::uint32_t side = 1;
  while (side * side < count) ++side;
  const Real half = Real(0.6) * static_cast<Real>(side);
  scene.bodies.push_back(body_at(Box{{half, Real(0.5), half}}, {0, Real(0.5), 0}, 1000));
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3 place{Real(1.2) * static_cast<Real>(i % side) - half + Real(0.6), Real(1.5),
                     Real(1.2) * static_cast<Real>(i / side) - half + Real(0.6)};
    scene.bodies.push_back(body_at(shape, place, 1));
  }
  return scene;
}

/// Bodies that touch the ground only, and may sleep.
Scene apart_on_the_ground(std::uint32_t count, const Shape& shape) {
  Scene scene = on_the_ground("apart");
  scene.sleep.enabled = true;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3 place{Real(2.5) * static_cast<Real>(i % 50), Real(0.5),
                     Real(2.5) * static_cast<Real>(i / 50)};
    scene.bodies.push_back(body_at(shape, place, 1));
  }
  return scene;
}

void compare_steps(benchmark::State& state, const Scene& scene, SimdLevel simd) {
  SceneWorldOptions options;
  options.solve.simd = simd;
  SceneWorld ours(scene, options);
  SceneWorld stock(scene, {.dispatcher = DispatcherKind::stock,
                           .solver = SolverKind::stock,
                           .world = WorldKind::stock});
  for (int i = 0; i < 200; ++i) {
    stock.step();
    ours.step();
  }
  if (scene.sleep.enabled) {
    for (SceneWorld* world : {&stock, &ours}) {
      for (btRigidBody* body : world->bodies()) {
        if (body->getActivationState() != DISABLE_DEACTIVATION) {
          body->setActivationState(ISLAND_SLEEPING);
        }
      }
    }
  }
  std::vector<double> stock_us, our_us;
  const auto time = [](SceneWorld& world, std::vector<double>* us) {
    const double start = now_ms();
    world.step();
    us->push_back(1e3 * (now_ms() - start));
  };
  g_clock = CLOCK_THREAD_CPUTIME_ID;
  bool swap = false;
  for (auto _ : state) {
    alternate(
        swap, [&] { time(stock, &stock_us); }, [&] { time(ours, &our_us); });
    swap = !swap;
    state.SetIterationTime(our_us.back() * 1e-6);
  }
  if (stock.state_hash() != ours.state_hash()) state.SkipWithError("the worlds differ");
  state.counters["stock_us"] = median(stock_us);
  state.counters["jfpx_us"] = median(our_us);
  state.counters["ratio"] = median(stock_us) / median(our_us);
  state.counters["mean_ratio"] = std::accumulate(stock_us.begin(), stock_us.end(), 0.0) /
                                 std::accumulate(our_us.begin(), our_us.end(), 0.0);
  state.counters["pairs"] = ours.world().getPairCache()->getNumOverlappingPairs();
  const ConstraintSolverStats& stats = ours.jfpx_solver()->stats();
  state.counters["groups"] = static_cast<double>(stats.groups);
  for (std::size_t i = 0; i < kSolverFallbacks; ++i) {
    if (stats.fallbacks[i] == 0) continue;
    state.counters[std::string(to_string(static_cast<SolverFallback>(i)))] =
        static_cast<double>(stats.fallbacks[i]);
  }
}

void add(const std::string& name, const Scene& scene, SimdLevel simd = SimdLevel::automatic) {
  benchmark::RegisterBenchmark(name.c_str(),
                               [=](benchmark::State& state) { compare_steps(state, scene, simd); })
      ->UseManualTime()
      ->Iterations(2000)
      ->Unit(benchmark::kMillisecond);
}

/// A scene that sleeps, and the same beside a ball that may not sleep.
void add_asleep(const std::string& name, std::uint32_t count, Scene scene) {
  add(name + "/" + std::to_string(count), scene);
  BodyDef awake = body_at(Sphere{Real(0.5)}, {1000, 0, 0}, 1);
  awake.can_sleep = false;
  scene.bodies.push_back(awake);
  add(name + "_but_one/" + std::to_string(count), scene);
}

void register_all() {
  const Box box{{Real(0.5), Real(0.5), Real(0.5)}};
  for (const std::uint32_t n : {8u, 10u, 12u, 16u, 24u, 48u}) {
    add("boxes/" + std::to_string(n), heap_of_boxes(n));
  }
  for (const std::uint32_t n : {25u, 100u, 400u}) {
    add("boxes_on_platform/" + std::to_string(n), on_a_platform(n, box));
    add("balls_on_platform/" + std::to_string(n), on_a_platform(n, Sphere{Real(0.5)}));
  }
  for (const std::uint32_t n : {64u, 512u}) {
    Scene pile = scenes::make("pile", {.spheres = n});
    pile.sleep.enabled = false;
    add("pile_scalar/" + std::to_string(n), pile, SimdLevel::scalar);
    add("pile/" + std::to_string(n), pile);
  }
  for (const std::uint32_t n : {64u, 512u, 4096u}) {
    add_asleep("asleep", n, scenes::make("pile", {.spheres = n}));
  }
  for (const std::uint32_t n : {300u, 1000u, 3000u}) {
    add_asleep("balls_asleep_apart", n, apart_on_the_ground(n, Sphere{Real(0.5)}));
    add_asleep("boxes_asleep_apart", n, apart_on_the_ground(n, box));
  }
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  return jfpx::bullet::run_benchmarks(argc, argv, jfpx::bullet::register_all);
}
