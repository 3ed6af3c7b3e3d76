/// The named scenes, made from a number of spheres and a seed; the same on every machine.
#pragma once

#include <jfpx/scene.hpp>
#include <optional>
#include <span>
#include <string_view>

namespace jfpx::inline JFPX_ABI::scenes {

struct Options {
  std::optional<std::uint32_t> spheres;  ///< number of spheres; the scene's default if absent
  std::uint64_t seed = 1;
};

struct Entry {
  std::string_view name;
  std::string_view summary;  ///< one line for a user
  std::uint32_t default_spheres;
  Scene (*make)(std::uint32_t spheres, std::uint64_t seed);
};

/// All named scenes, in a fixed order.
std::span<const Entry> all();

/// The scene called `name`. `lattice` rounds the number of spheres down to a cube.
/// @throws InvalidArgument for an unknown name (lists the names) or a number of spheres that a
///   SphereIndex can't count.
Scene make(std::string_view name, const Options& options = {});

/// The spheres of a scene, in body order: input for a SphereCollider.
std::vector<SphereInstance> spheres_of(const Scene& scene);

}  // namespace jfpx::inline JFPX_ABI::scenes
