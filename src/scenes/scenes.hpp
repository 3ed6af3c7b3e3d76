/// The named scenes, generated from numbers of bodies and a seed, with the same bits on every
/// machine.
#pragma once

#include <jfpx/scene.hpp>

#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {

/// Parameters of a named scene.
struct Options {
  std::optional<std::uint32_t> spheres = {};  ///< the scene's default if absent
  std::optional<std::uint32_t> boxes = {};    ///< as for spheres; only for scenes with boxes
  std::uint64_t seed = 1;
};

/// Options with all defaults resolved.
struct Counts {
  std::uint32_t spheres = 0, boxes = 0;  ///< movable bodies
  std::uint64_t seed = 1;
};

/// Default number of movable boxes of a scene.
enum class Boxes : std::uint8_t {
  none,                ///< the number is fixed, and can't be set
  on_request,          ///< none by default; the number can be set
  as_many_as_spheres,  ///< one per sphere by default; the number can be set
  as_listed,           ///< Entry::default_boxes by default; the number can be set
};

/// One row of the table of named scenes.
struct Entry {
  std::string_view name;
  std::string_view summary;  ///< one line for a user
  std::uint32_t default_spheres;
  Boxes boxes;
  Scene (*make)(const Counts& counts);
  std::uint32_t default_boxes = 0;  ///< of Boxes::as_listed
};

/// All named scenes, in a fixed order.
std::span<const Entry> all();

/// Generates the scene called `name`. `lattice` rounds the number of spheres down to a cube.
/// @throws InvalidArgument for an unknown name (the message lists the names), or if `boxes` is set
///   for a scene without a variable number of boxes; OutOfMemory with the required size, before any
///   allocation, if the bodies would exceed the machine's memory
Scene make(std::string_view name, const Options& options = {});

/// The spheres of a scene, in the order of the bodies, as input for a SphereCollider.
std::vector<SphereInstance> spheres_of(const Scene& scene);

/// Spheres of diameter 1 at uniformly random positions, with the number density that gives
/// `contacts_per_sphere` touching pairs per sphere on average (4 times the volume fraction).
/// Spheres may overlap.
std::vector<SphereInstance> random_spheres(std::uint32_t count, Real contacts_per_sphere,
                                           std::uint64_t seed);

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
