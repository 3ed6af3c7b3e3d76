/// Factory functions of the named scenes, and the parts that they share.
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
Scene make_pile(const Counts& counts);
Scene make_gas(const Counts& counts);
Scene make_columns(const Counts& counts);
Scene make_overlap(const Counts& counts);
Scene make_lattice(const Counts& counts);
Scene make_polydisperse(const Counts& counts);

/// The smallest integer whose cube is at least n.
std::uint32_t cube_side(std::uint32_t n);
/// Site i of a cubic lattice of spacing 1, with `side` sites along x and z and as many layers along
/// y as required.
Vec3 lattice_site(std::uint32_t i, std::uint32_t side);

/// A movable sphere.
BodyDef sphere_at(const Vec3& position, Real radius, Real mass);
/// Adds static boxes, 2 m thick, as walls around the inner box [lower, upper]: a floor, four sides,
/// and a lid if `closed`.
/// @param material the walls' friction, restitution and other fields besides mass, shape and
///   position
void add_container(Scene& scene, const Vec3& lower, const Vec3& upper, bool closed,
                   const BodyDef& material);

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
