/// Factory functions of the named scenes, and shared parts.
#pragma once

#include <jfpx/random.hpp>
#include <jfpx/scene.hpp>

#include "src/scenes/scenes.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {

Scene make_boxes_and_balls(const Counts& counts);
Scene make_big_ballistic(const Counts& counts);
Scene make_mixed(const Counts& counts);
Scene make_capsules(const Counts& counts);
Scene make_terrain(const Counts& counts);
Scene make_bridge(const Counts& counts);
Scene make_ragdolls(const Counts& counts);
Scene make_pile(const Counts& counts);
Scene make_heap(const Counts& counts);
Scene make_dam_break(const Counts& counts);
Scene make_gas(const Counts& counts);
Scene make_columns(const Counts& counts);
Scene make_overlap(const Counts& counts);
Scene make_lattice(const Counts& counts);
Scene make_polydisperse(const Counts& counts);
Scene make_tower(const Counts& counts);
Scene make_pyramid(const Counts& counts);
Scene make_wall(const Counts& counts);
Scene make_mass_ratio(const Counts& counts);
Scene make_slope(const Counts& counts);
Scene make_giant(const Counts& counts);

/// The smallest integer whose cube is at least n.
std::uint32_t cube_side(std::uint32_t n);
/// Site i of a cubic lattice of spacing 1, with `side` sites along x and z and as many layers along
/// y as required.
Vec3 lattice_site(std::uint32_t i, std::uint32_t side);

/// A uniformly distributed rotation.
Quat random_orientation(Random& random);

/// A movable sphere.
BodyDef sphere_at(const Vec3& position, Real radius, Real mass);
/// A movable box.
BodyDef box_at(const Vec3& position, const Vec3& half_extents, Real mass);
/// Adds the ground, the half-space y <= 0.
void add_ground(Scene& scene);
/// Adds balls of radius 0.3 m and 50 kg that fly along z at 20 m/s. Ball i hits the target after
/// i + 1 seconds.
void add_balls(Scene& scene, std::uint32_t count, const Vec3& target);
/// Adds static boxes, 2 m thick, as walls around the inner box [lower, upper]: a floor, four sides,
/// and a lid if `closed`.
/// @param material friction, restitution and all other fields of the walls except mass, shape and
///   position
void add_container(Scene& scene, const Vec3& lower, const Vec3& upper, bool closed,
                   const BodyDef& material);

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
