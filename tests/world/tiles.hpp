/// Floors of flush tiles, whose seams no body may feel.
#pragma once

#include "tests/world/meshes.hpp"

#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// What the tiles of a floor are.
enum class Tiles { boxes, hulls, parts };
inline std::string name_of(Tiles tiles) {
  return tiles == Tiles::boxes ? "boxes" : tiles == Tiles::hulls ? "hulls" : "parts";
}

inline Hull hull_of(const Box& box) {
  std::vector<Vec3> corners;
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3& h = box.half_extents;
    corners.push_back(
        {(i & 1) != 0 ? h.x : -h.x, (i & 2) != 0 ? h.y : -h.y, (i & 4) != 0 ? h.z : -h.z});
  }
  return Hull(corners);
}

/// A square floor of flush cubes of 1 m, whose upper faces are in the plane y = 0.
/// @param count number of tiles along x and z
inline std::vector<BodyDef> tiled_floor(Tiles tiles, int count, Real friction) {
  const Box box{{Real(0.5), Real(0.5), Real(0.5)}};
  const Hull hull = hull_of(box);
  std::vector<BodyDef> bodies;
  Compound compound;
  for (int x = 0; x < count; ++x) {
    for (int z = 0; z < count; ++z) {
      const Vec3 position{Real(x) - Real(count - 1) / 2, Real(-0.5), Real(z) - Real(count - 1) / 2};
      if (tiles == Tiles::parts) {
        compound.parts.push_back({.shape = box, .position = position});
        continue;
      }
      bodies.push_back(tiles == Tiles::boxes ? fixed_surface(box, friction)
                                             : fixed_surface(hull, friction));
      bodies.back().position = position;
    }
  }
  if (tiles == Tiles::parts) bodies.push_back(fixed_surface(compound, friction));
  return bodies;
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
