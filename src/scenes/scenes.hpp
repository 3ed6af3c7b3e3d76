/// The named scenes, made from a number of spheres and a seed; the same on every machine.
#pragma once

#include <jfpx/scene.hpp>

#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {

struct Options {
  std::optional<std::uint32_t> spheres = {};  ///< the scene's default if absent
  std::optional<std::uint32_t> boxes = {};    ///< likewise; only for scenes with boxes
  std::uint64_t seed = 1;
};

/// How much of what a scene has.
struct Counts {
  std::uint32_t spheres = 0, boxes = 0;  ///< movable ones
  std::uint64_t seed = 1;
};

/// How many movable boxes a scene has.
enum class Boxes : std::uint8_t {
  none,                ///< none, or always the same
  on_request,          ///< none by default, else as many as asked for
  as_many_as_spheres,  ///< by default
};

struct Entry {
  std::string_view name;
  std::string_view summary;  ///< one line for a user
  std::uint32_t default_spheres;
  Boxes boxes;
  Scene (*make)(const Counts& counts);
};

/// All named scenes, in a fixed order.
std::span<const Entry> all();

/// The scene called `name`. `lattice` rounds the number of spheres down to a cube.
/// @throws InvalidArgument for an unknown name (lists the names), or boxes asked of a scene that
/// has
///   none; OutOfMemory that says how much is needed, before anything is touched, when the bodies
///   would not fit into the machine's memory.
Scene make(std::string_view name, const Options& options = {});

/// The spheres of a scene, in body order: input for a SphereCollider.
std::vector<SphereInstance> spheres_of(const Scene& scene);

/// Uniformly random unit-diameter spheres, as many per volume as give `contacts_per_sphere`
/// touching pairs per sphere on average (4 times the volume fraction). Spheres overlap freely.
std::vector<SphereInstance> random_spheres(std::uint32_t count, Real contacts_per_sphere,
                                           std::uint64_t seed);

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
