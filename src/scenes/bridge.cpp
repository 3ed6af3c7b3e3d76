/// Scene bridge: balls fall on a bridge of planks that ropes hold, with crates on ropes below it.
#include "src/scenes/makers.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace scenes {
namespace {

constexpr int kPlanks = 16, kPlanksPerCrate = 3;
constexpr Real kHalfPlank = Real(0.2), kHalfWidth = Real(0.45), kPlankGap = Real(0.05);
constexpr Real kRopeLength = Real(0.06);  ///< length of a rope between two planks
constexpr Real kDeckHeight = Real(2.5);

BodyId add(Scene& scene, const BodyDef& body) {
  scene.bodies.push_back(body);
  return {static_cast<std::uint32_t>(scene.bodies.size() - 1), 0};
}

/// A movable box that comes to rest although it hangs.
BodyDef hanging_box(const Vec3& position, const Vec3& half_extents, Real mass) {
  BodyDef body = box_at(position, half_extents, mass);
  body.linear_damping = body.angular_damping = Real(0.6);
  return body;
}

/// Two ropes between the ends of two bodies. @param end_a,end_b in body axes; z is ignored
void tie(Scene& scene, BodyId a, BodyId b, const Vec3& end_a, const Vec3& end_b) {
  constexpr Real kSide = kHalfWidth * Real(0.9);
  for (const Real side : {-kSide, kSide}) {
    DistanceJoint rope{.a = a, .b = b};
    rope.anchor_a = {end_a.x, end_a.y, side};
    rope.anchor_b = {end_b.x, end_b.y, side};
    rope.max_length = kRopeLength;
    scene.joints.push_back(rope);
  }
}

}  // namespace

Scene make_bridge(const Counts& counts) {
  constexpr Real kSpacing = 2 * kHalfPlank + kPlankGap;
  constexpr Real kHalfSpan = kSpacing * kPlanks * Real(0.5), kHalfPost = Real(0.3);
  Scene scene;
  scene.name = "bridge";
  Random random(counts.seed);
  add_ground(scene);
  BodyId posts[2];
  for (const int side : {0, 1}) {
    const Real x = (kHalfSpan + kHalfPost) * static_cast<Real>(2 * side - 1);
    posts[side] = add(scene, box_at({x, kDeckHeight * Real(0.5), 0},
                                    {kHalfPost, kDeckHeight * Real(0.5), kHalfWidth}, 0));
  }
  const Vec3 plank{kHalfPlank, Real(0.04), kHalfWidth}, crate{Real(0.15), Real(0.15), Real(0.15)};
  const Vec3 front{-kHalfPlank, 0, 0}, back{kHalfPlank, 0, 0};
  BodyId last = posts[0];
  Vec3 end_of_last{kHalfPost, kDeckHeight * Real(0.5), 0};
  for (int i = 0; i < kPlanks; ++i) {
    const Real x = (static_cast<Real>(i) + Real(0.5)) * kSpacing - kHalfSpan;
    const BodyId next = add(scene, hanging_box({x, kDeckHeight, 0}, plank, 5));
    tie(scene, next, last, front, end_of_last);
    last = next;
    end_of_last = back;
    if (i % kPlanksPerCrate != 0) continue;
    DistanceJoint rope{.a = add(scene, hanging_box({x, kDeckHeight - 1, 0}, crate, 2)), .b = next};
    rope.anchor_a = {0, crate.y, 0};
    rope.max_length = Real(0.9);
    scene.joints.push_back(rope);
  }
  tie(scene, posts[1], last, {-kHalfPost, kDeckHeight * Real(0.5), 0}, back);
  constexpr std::uint32_t kRow = 12;
  for (std::uint32_t i = 0; i < counts.spheres; ++i) {
    const Real along = (static_cast<Real>(i % kRow) + Real(0.5)) / kRow * 2 - 1;
    const Vec3 position{along * (kHalfSpan - Real(0.5)),
                        kDeckHeight + 1 + Real(0.5) * static_cast<Real>(i / kRow),
                        random.uniform(Real(-0.2), Real(0.2))};
    BodyDef ball = sphere_at(position, random.uniform(Real(0.1), Real(0.2)), 1);
    ball.rolling_friction = Real(0.01);
    add(scene, ball);
  }
  return scene;
}

}  // namespace scenes
}  // namespace JFPX_ABI
}  // namespace jfpx
