/// Broad phase and pair tests of a world's contact detection.
#include "src/world/contact_finder.hpp"

#include <jfpx/intersect.hpp>

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Whether two bounding spheres overlap, with a margin for rounding errors.
bool near(const SphereInstance& a, const SphereInstance& b) {
  const Real most = a.radius + b.radius;
  return length_squared(a.centre - b.centre) <= most * most * (1 + 64 * kEpsilon);
}

template <class T>
void sort_if_needed(std::vector<T>* items) {
  if (!std::ranges::is_sorted(*items)) std::ranges::sort(*items);
}

/// Appends the contacts of two sub-shapes, at least one of which is not a sphere.
class PairTest {
 public:
  using SubShape = SubShapeTable::SubShape;

  PairTest(const BodyStore& bodies, const SubShapeView& sub_shapes, std::vector<Contact>* contacts)
      : bodies_(bodies), sub_shapes_(sub_shapes), contacts_(contacts) {}

  /// Sub-shape p belongs to body a, q to body b; only q may be a wall.
  void operator()(std::uint32_t a, std::uint32_t b, SubShape p, SubShape q) const {
    if (sub_shapes_.is_wall(q)) {
      const HalfSpace solid = sub_shapes_.wall(q).solid_for(bodies_.moving.position[a]);
      if (sub_shapes_.is_sphere(p)) {
        add(a, b, collide(sub_shapes_.bounds(p), solid), 1);
      } else {
        add(a, b, collide(sub_shapes_.box(p).box, sub_shapes_.box(p).pose, solid));
      }
    } else if (sub_shapes_.is_sphere(p)) {
      add(a, b, collide(sub_shapes_.bounds(p), sub_shapes_.box(q).box, sub_shapes_.box(q).pose), 1);
    } else if (sub_shapes_.is_sphere(q)) {
      add(a, b, collide(sub_shapes_.bounds(q), sub_shapes_.box(p).box, sub_shapes_.box(p).pose),
          -1);
    } else {
      const PosedBox &first = sub_shapes_.box(p), &second = sub_shapes_.box(q);
      if (!may_touch(first.box, first.pose, second.box, second.pose)) return;
      add(a, b, collide(first.box, first.pose, second.box, second.pose));
    }
  }

 private:
  /// @param side 1 if the sphere belongs to a, -1 if it belongs to b
  void add(std::uint32_t a, std::uint32_t b, const Touch& touch, Real side) const {
    if (!touch.touching) return;
    const Vec3 normal = side < 0 ? -touch.normal : touch.normal;
    contacts_->push_back({bodies_.id(a), bodies_.id(b), normal, touch.point, touch.distance});
  }
  void add(std::uint32_t a, std::uint32_t b, const Manifold& manifold) const {
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& p = manifold.points[i];
      contacts_->push_back({bodies_.id(a), bodies_.id(b), manifold.normal, p.point, p.distance});
    }
  }

  const BodyStore& bodies_;
  const SubShapeView& sub_shapes_;
  std::vector<Contact>* contacts_;
};

}  // namespace

ContactFinder::ContactFinder(std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase)
    : broad_phase_(std::move(collider), broad_phase) {}

void ContactFinder::set_bodies(const BodyStore& bodies) {
  sub_shapes_.set_bodies(bodies);
  sub_shapes_.update_poses(bodies);
  broad_phase_.set_spheres(sub_shapes_.bounds());
}

std::uint64_t ContactFinder::find_contacts(const BodyStore& bodies,
                                           std::vector<Contact>* contacts) {
  sub_shapes_.update_poses(bodies);
  candidates_.clear();
  find_sphere_pairs(bodies, contacts);
  const std::uint64_t sphere_contacts = contacts->size();
  find_fixed_candidates(bodies);
  sort_if_needed(&candidates_);
  const SubShapeView sub_shapes = sub_shapes_.view();
  const PairTest test(bodies, sub_shapes, contacts);
  for (const Candidate& c : candidates_) test(c.a, c.b, c.sub_shape_a, c.sub_shape_b);
  return sphere_contacts;
}

/// Appends the contacts of two spheres to `contacts`, and the pairs with a box to candidates_. In a
/// pair of the collider, a < b, and spheres are numbered before boxes; so b is a box if either is.
void ContactFinder::find_sphere_pairs(const BodyStore& bodies, std::vector<Contact>* contacts) {
  const ContactSpan found = broad_phase_.find(sub_shapes_.bounds());
  const BodyView view = bodies.view();
  const SubShapeView sub_shapes = sub_shapes_.view();
  hits_.clear();
  for (std::size_t i = 0; i < found.size(); ++i) {
    const std::uint32_t a = sub_shapes.body(found[i].a), b = sub_shapes.body(found[i].b);
    if (a == b || (!bodies.movable(a) && !bodies.movable(b)) || !bodies.may_collide(a, b)) continue;
    const Candidate pair = ordered(view, sub_shapes, found[i].a, found[i].b);
    if (sub_shapes.is_sphere(found[i].b)) {
      hits_.push_back({pair, i});
    } else {
      candidates_.push_back(pair);
    }
  }
  sort_if_needed(&hits_);
  for (const SphereHit& hit : hits_) {
    const SphereContact& c = found[hit.index];
    const Vec3 point = middle_point(c.normal, c.distance, sub_shapes.bounds(c.b));
    const Vec3 normal = hit.pair.sub_shape_a == c.a ? c.normal : -c.normal;
    contacts->push_back({bodies.id(hit.pair.a), bodies.id(hit.pair.b), normal, point, c.distance});
  }
}

/// Appends the pairs of a movable and a fixed sub-shape that may touch. Tests all of them: takes
/// O(movable * fixed) time.
void ContactFinder::find_fixed_candidates(const BodyStore& bodies) {
  const BodyView view = bodies.view();
  const SubShapeView sub_shapes = sub_shapes_.view();
  for (SubShape sub_shape = 0; sub_shape < sub_shapes.fixed_begin; ++sub_shape) {
    const std::uint32_t body = sub_shapes.body(sub_shape);
    if (!bodies.movable(body)) continue;
    for (SubShape fixed = sub_shapes.fixed_begin; fixed < sub_shapes.count; ++fixed) {
      if (may_touch(sub_shapes, sub_shape, fixed, bodies.moving.position[body]) &&
          bodies.may_collide(body, sub_shapes.body(fixed))) {
        candidates_.push_back(ordered(view, sub_shapes, sub_shape, fixed));
      }
    }
  }
}

/// Conservative test: false only if the sub-shapes do not touch.
/// @param centre centre of mass of the body of `sub_shape`, which selects the side of a plane
bool ContactFinder::may_touch(const SubShapeView& sub_shapes, SubShape sub_shape, SubShape fixed,
                              const Vec3& centre) {
  if (!sub_shapes.is_wall(fixed))
    return near(sub_shapes.bounds(sub_shape), sub_shapes.bounds(fixed));
  const HalfSpace solid = sub_shapes.wall(fixed).solid_for(centre);
  if (sub_shapes.is_sphere(sub_shape)) return jfpx::may_touch(sub_shapes.bounds(sub_shape), solid);
  return jfpx::may_touch(sub_shapes.box(sub_shape).box, sub_shapes.box(sub_shape).pose, solid);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
