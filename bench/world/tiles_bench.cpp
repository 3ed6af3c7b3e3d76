/// Times of steps of movable bodies on many bodies of mass 0: tiles_bench [--backend cpu|cuda]
/// [--no-bullet]. Each row is the median of the last 60 of 90 steps, native with one thread or on a
/// GPU, and in stock Bullet.
#include <jfpx/bullet/scene_world.hpp>
#include <jfpx/error.hpp>
#include <jfpx/random.hpp>
#include <jfpx/world.hpp>

#include "bench/world/samples.hpp"
#include "src/base/stopwatch.hpp"

#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

constexpr int kSteps = 90, kMeasured = 60;

enum class Floor { tiles, parts, kinematic };

struct Case {
  const char* name;
  std::uint32_t movable;
  std::uint32_t side;  ///< tiles along an edge of the floor
  Floor floor = Floor::tiles;
  bool are_stones = false;  ///< compounds of five balls; otherwise balls
};

constexpr Case kCases[] = {
    {"500 balls", 500, 32},
    {"500 balls", 500, 64},
    {"500 balls", 500, 128},
    {"3,000 balls", 3000, 60},
    {"3,000 balls", 3000, 120},
    {"3,000 balls", 3000, 200},
    {"1,000 stones of 5 balls", 1000, 128, Floor::tiles, true},
    {"500 balls, one compound", 500, 64, Floor::parts},
    {"500 balls, kinematic tiles", 500, 64, Floor::kinematic},
};

BodyDef tile(const Case& c, std::uint32_t i, std::uint32_t k) {
  const auto x = static_cast<Real>(i), z = static_cast<Real>(k);
  const Real half = static_cast<Real>(c.side) * Real(0.5) - Real(0.5);
  BodyDef def;
  def.shape = Box{
      {Real(0.5), Real(0.5) + Real(0.2) * std::sin(x / 2) * std::cos(z * Real(0.4)), Real(0.5)}};
  def.position = {x - half, Real(-0.5), z - half};
  def.mass = 0;
  def.kinematic = c.floor == Floor::kinematic;
  return def;
}

Compound stone(Random* random) {
  Compound compound;
  for (int i = 0; i < 5; ++i) {
    compound.parts.push_back(
        {.shape = Sphere{random->uniform(Real(0.1), Real(0.2))},
         .position = random->uniform_in_box({Real(-0.2), Real(-0.2), Real(-0.2)},
                                            {Real(0.2), Real(0.2), Real(0.2)})});
  }
  return centred(compound);
}

Scene make_scene(const Case& c) {
  Scene scene;
  Random random(2);
  BodyDef floor;
  Compound parts;
  for (std::uint32_t i = 0; i < c.side; ++i) {
    for (std::uint32_t k = 0; k < c.side; ++k) {
      const BodyDef def = tile(c, i, k);
      if (c.floor == Floor::parts) {
        parts.parts.push_back({.shape = std::get<Box>(def.shape), .position = def.position});
      } else {
        scene.bodies.push_back(def);
      }
    }
  }
  if (c.floor == Floor::parts) {
    floor.shape = parts;
    floor.mass = 0;
    scene.bodies.push_back(floor);
  }
  const Real room = static_cast<Real>(c.side) * Real(0.4);
  for (std::uint32_t n = 0; n < c.movable; ++n) {
    BodyDef def;
    if (c.are_stones) {
      def.shape = stone(&random);
    } else {
      def.shape = Sphere{Real(0.3)};
    }
    def.position = random.uniform_in_box({-room, 0, -room}, {room, 0, room});
    def.position.y = Real(1.5) + 2 * static_cast<Real>(n % 3);
    def.can_sleep = false;
    scene.bodies.push_back(def);
  }
  return scene;
}

template <class Step>
double median_ms(const Step& step) {
  std::vector<double> times;
  for (int n = 0; n < kSteps; ++n) {
    Stopwatch watch;
    step();
    const double ms = watch.lap_ms();
    if (n >= kSteps - kMeasured) times.push_back(ms);
  }
  return bench::median(times);
}

void measure(const Case& c, Backend backend, bool with_bullet) {
  const Scene scene = make_scene(c);
  World world(scene, {.collider = {.backend = backend}});
  std::uint64_t contacts = 0;
  const double native = median_ms([&] {
    const StepReport report = world.step();
    if (!report.device_failure.empty()) throw DeviceError(report.device_failure);
    contacts = report.contacts;
  });
  std::printf("%-28s %6u %9" PRIu64 " %9.3f", c.name, c.side * c.side, contacts, native);
  if (with_bullet && c.floor != Floor::kinematic) {
    bullet::SceneWorld stock(scene, {.dispatcher = bullet::DispatcherKind::stock,
                                     .solver = bullet::SolverKind::stock,
                                     .world = bullet::WorldKind::stock});
    const double bullet = median_ms([&] { stock.step(); });
    std::printf(" %9.3f %6.2f", bullet, native / bullet);
  } else {
    std::printf(" %9s %6s", "-", "-");
  }
  std::printf("   %016" PRIx64 "\n", world.state_hash());
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  Backend backend = Backend::cpu;
  bool with_bullet = true;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--no-bullet") {
      with_bullet = false;
    } else if (argument == "--backend" && i + 1 < argc) {
      backend = std::string_view(argv[++i]) == "cuda" ? Backend::cuda : Backend::cpu;
    } else {
      std::fprintf(stderr, "usage: tiles_bench [--backend cpu|cuda] [--no-bullet]\n");
      return 2;
    }
  }
  std::printf("movable bodies               fixed  contacts native ms  stock ms  ratio   hash\n");
  for (const Case& c : kCases) measure(c, backend, with_bullet);
  return 0;
}

}  // namespace
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  try {
    return jfpx::run(argc, argv);
  } catch (const jfpx::Error& error) {
    std::fprintf(stderr, "tiles_bench: %s\n", error.what());
    return 1;
  }
}
