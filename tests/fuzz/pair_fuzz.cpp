/// Fuzzer of the contacts of two solids, of which the first is round: for any sizes and poses they
/// are finite, have unit normals, and do not depend on where the solids are in memory.
#include "src/collide/shapes.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/bytes.hpp"

#include <algorithm>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using fuzz::require;
using test::Bytes;

SolidShape draw_solid(Bytes& bytes, std::uint64_t kind) {
  constexpr Real kSizes[] = {Real(0.25), Real(0.5), 1, Real(0.001), 100};
  const auto size = [&] {
    return bytes.chance(Real(0.3)) ? kSizes[bytes.below(5)] : bytes.uniform(Real(0.01), 1);
  };
  const Real a = size(), b = size();
  if (kind == 0) return Cylinder{a, b};
  if (kind == 1) return Cone{a, b};
  if (kind == 2) return Sphere{a};
  if (kind == 3) return Capsule{a, b};
  return Box{{a, b, size()}};
}

Transform draw_pose(Bytes& bytes) {
  constexpr Quat kTurns[] = {{}, {1, 1, 0, 0}, {1, 0, 0, 1}, {1, 0, 0, Real(0.001)}};
  Quat q = kTurns[bytes.below(4)];
  if (bytes.chance(Real(0.5))) {
    const Vec3 v = bytes.uniform_in_box({-1, -1, -1}, {1, 1, 1});
    q = {1, v.x, v.y, v.z};
  }
  return make_transform(normalized(q), bytes.uniform_in_box({-2, -2, -2}, {2, 2, 2}));
}

void require_sound(const detail::PairManifold& found, const detail::PairMotion& pair) {
  require(found.point_count <= detail::PairManifold::kMaxPoints, "a contact has at most 8 points");
  if (found.point_count == 0) return;
  require(absolute(length(found.normal) - 1) < Real(1e-3), "the normal is a unit vector");
  for (std::uint32_t i = 0; i < found.point_count; ++i) {
    const detail::SolverPoint& p = found.points[i];
    require(is_finite(p.arm_a) && is_finite(p.arm_b), "points are finite");
    require(p.distance <= pair.margin + length(pair.motion) + Real(1e-3), "points are near");
    for (std::uint32_t k = 0; k < i; ++k) {
      require(p.feature != found.points[k].feature, "features are distinct");
    }
  }
}

}  // namespace
}  // namespace JFPX_ABI
}  // namespace jfpx

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace jfpx;
  test::Bytes bytes({data, size});
  const SolidShape a = draw_solid(bytes, bytes.below(2)), b = draw_solid(bytes, bytes.below(5));
  const Transform pose_a = draw_pose(bytes), pose_b = draw_pose(bytes);
  detail::PairMotion pair;
  if (bytes.chance(Real(0.5))) pair.motion = bytes.uniform_in_box({-1, -1, -1}, {1, 1, 1});
  pair.margin = bytes.uniform(0, Real(0.2));
  const auto find = [&](const auto& x, const auto& y) {
    detail::PairManifold first, again;
    const auto of_x = detail::instance(x, pose_a);
    const auto of_y = detail::instance(y, pose_b);
    detail::find_contact_of_any(of_x, of_y, pair, &first);
    detail::find_contact_of_any(of_x, of_y, pair, &again);
    require_sound(first, pair);
    fuzz::require(first.point_count == again.point_count && first.normal == again.normal,
                  "a repeated test has the same contact");
  };
  std::visit(find, a, b);
  return 0;
}
