/// Broad phase and pair tests of a world's contact detection.
#include "src/world/contact_finder.hpp"

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

template <class T>
void sort_if_needed(std::vector<T>* items) {
  if (!std::ranges::is_sorted(*items)) std::ranges::sort(*items);
}

}  // namespace

ContactFinder::ContactFinder(std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase)
    : broad_phase_(std::move(collider), broad_phase) {}

void ContactFinder::set_bodies(const BodyStore& bodies) {
  sub_shapes_.set_bodies(bodies);
  sub_shapes_.update_poses(bodies);
  broad_phase_.set_spheres(sub_shapes_.bounds());
  fixed_changed_ = true;
}

std::uint64_t ContactFinder::find_contacts(const BodyStore& bodies,
                                           std::vector<Contact>* contacts) {
  sub_shapes_.update_poses(bodies);
  candidates_.clear();
  find_sphere_pairs(bodies, contacts);
  const std::uint64_t sphere_contacts = contacts->size();
  enclose_bounds(bodies);
  find_fixed_pairs(0, sub_shapes_.ranges().fixed_begin(), &candidates_);
  sort_if_needed(&candidates_);
  detail::PairManifold manifold;
  for (const Candidate& c : candidates_) {
    const Vec3 &a = bodies.moving.position[c.a], &b = bodies.moving.position[c.b];
    manifold.clear();
    find_contact(near_.sub_shapes, c.sub_shape_a, c.sub_shape_b, a, {{}, 0, 0, a, b}, &manifold);
    for (std::uint32_t i = 0; i < manifold.touch_count; ++i) {
      const auto& [point, distance] = manifold.touches[i];
      contacts->push_back({bodies.id(c.a), bodies.id(c.b), manifold.normal, point, distance});
    }
  }
  return sphere_contacts;
}

/// Appends the contacts of two spheres to `contacts`, and the pairs with another solid to
/// candidates_. In a pair of the collider, a < b, and spheres have the lowest numbers; so b is no
/// sphere if either is none.
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

}  // namespace JFPX_ABI
}  // namespace jfpx
