/// The table of named scenes.
#include "src/scenes/scenes.hpp"

#include <jfpx/error.hpp>

#include "src/base/system.hpp"
#include "src/scenes/makers.hpp"

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {
namespace {

constexpr Entry kScenes[] = {
    {"boxes-and-balls", "the thesis' benchmark: a leaning tower of balls collapses", 448,
     Boxes::on_request, make_boxes_and_balls},
    {"big-ballistic", "two crates on the ground, and a volley of --spheres rounds", 0, Boxes::none,
     make_big_ballistic},
    {"mixed", "balls and boxes of many sizes fall into a pit of half-spaces", 1000,
     Boxes::as_many_as_spheres, make_mixed},
    {"capsules", "balls, boxes, capsules and crosses of two capsules fall onto the ground", 40,
     Boxes::as_many_as_spheres, make_capsules},
    {"terrain", "stones, balls, boxes and capsules fall into a hilly bowl of triangles", 60,
     Boxes::none, make_terrain},
    {"bridge", "balls fall on a bridge of planks that ropes hold, with crates on ropes below", 36,
     Boxes::none, make_bridge},
    {"ragdolls", "figures of eleven bodies with ball joints and hinges; --spheres is their number",
     20, Boxes::none, make_ragdolls},
    {"pile", "a jittered lattice of spheres falls into an open box and comes to rest", 2048,
     Boxes::none, make_pile},
    {"heap", "spheres of radius 0.45 to 0.5 m fall into an open box, come to rest and sleep", 4096,
     Boxes::none, make_heap},
    {"dam-break", "a cube of spheres collapses and flows along a basin", 4096, Boxes::none,
     make_dam_break},
    {"gas", "fast spheres without gravity in a closed box, volume fraction 0.30", 4096, Boxes::none,
     make_gas},
    {"columns", "stacks of 32 spheres that initially overlap by a quarter of a diameter", 1024,
     Boxes::none, make_columns},
    {"overlap", "all spheres within 5 cm of one point, so that every pair touches", 256,
     Boxes::none, make_overlap},
    {"lattice", "a cubic lattice of n^3 spheres with exactly 3n^2(n-1) contacts", 1000, Boxes::none,
     make_lattice},
    {"polydisperse", "radii over four decades, from 0.5 mm to 5 m", 2000, Boxes::none,
     make_polydisperse},
    {"tower", "--boxes crates on top of each other, and --spheres balls that hit them", 0,
     Boxes::as_listed, make_tower, 20},
    {"pyramid", "a pyramid of 20 rows of crates, and --spheres balls that hit it", 0,
     Boxes::as_listed, make_pyramid, 210},
    {"wall", "a wall of 80 bricks, which a ball hits after one second", 1, Boxes::as_listed,
     make_wall, 80},
    {"mass-ratio", "boxes and spheres of 100 kg and 1000 kg, each on a box of 1 kg", 4,
     Boxes::as_listed, make_mass_ratio, 4},
    {"slope", "boxes on slopes one degree below and above the angle of friction", 0,
     Boxes::as_listed, make_slope, 8},
    {"giant", "one sphere of radius 20 m on a bed of spheres of radius 0.1 m", 4000, Boxes::none,
     make_giant},
};

std::uint32_t boxes_of(const Entry& entry, std::uint32_t spheres,
                       const std::optional<std::uint32_t>& requested) {
  if (requested && entry.boxes == Boxes::none) {
    throw InvalidArgument("boxes is " + std::to_string(*requested) +
                          "; it must be absent, because \"" + std::string(entry.name) +
                          "\" has no variable number of boxes");
  }
  return requested.value_or(entry.boxes == Boxes::as_many_as_spheres ? spheres
                                                                     : entry.default_boxes);
}

void require_memory(std::uint64_t bodies) {
  // Twice the size, because a world copies the bodies.
  const double needed = 2.0 * static_cast<double>(bodies) * sizeof(BodyDef);
  const auto present = static_cast<double>(physical_memory());
  if (needed <= present) return;
  constexpr double kMiB = 1024.0 * 1024.0;
  throw OutOfMemory("a scene of " + std::to_string(bodies) + " bodies needs about " +
                    std::to_string(static_cast<std::uint64_t>(needed / kMiB)) +
                    " MiB; this machine has " +
                    std::to_string(static_cast<std::uint64_t>(present / kMiB)) + " MiB");
}

}  // namespace

std::span<const Entry> all() { return kScenes; }

Scene make(std::string_view name, const Options& options) {
  std::string names;
  for (const Entry& entry : kScenes) {
    if (entry.name == name) {
      Counts counts{.spheres = options.spheres.value_or(entry.default_spheres),
                    .boxes = 0,
                    .seed = options.seed};
      counts.boxes = boxes_of(entry, counts.spheres, options.boxes);
      require_memory(std::uint64_t{counts.spheres} + counts.boxes);
      return entry.make(counts);
    }
    names += names.empty() ? "" : ", ";
    names += entry.name;
  }
  throw InvalidArgument("there is no scene called \"" + std::string(name) + "\"; scenes are " +
                        names);
}

std::vector<SphereInstance> spheres_of(const Scene& scene) {
  std::vector<SphereInstance> spheres;
  for (const BodyDef& body : scene.bodies) {
    if (const Sphere* sphere = std::get_if<Sphere>(&body.shape)) {
      spheres.push_back({body.position, sphere->radius});
    }
  }
  return spheres;
}

std::vector<SphereInstance> random_spheres(std::uint32_t count, Real contacts_per_sphere,
                                           std::uint64_t seed) {
  // At number density rho, a sphere of diameter 1 touches rho * 4/3 pi others on average. Each
  // contact belongs to two spheres.
  const double density =
      static_cast<double>(contacts_per_sphere) * 2 / (4.0 / 3.0 * 3.14159265358979);
  const Real width = static_cast<Real>(std::cbrt(static_cast<double>(count) / density));
  Random random(seed);
  std::vector<SphereInstance> spheres(count);
  for (SphereInstance& sphere : spheres) {
    sphere = {random.uniform_in_box({}, {width, width, width}), Real(0.5)};
  }
  return spheres;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
