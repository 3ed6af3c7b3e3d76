/// Broad phase and pair tests of the contacts of the current poses.
#include "src/thesis/contact_search.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace thesis {
namespace {

template <class T>
void sort_if_needed(std::vector<T>* items) {
  if (!std::ranges::is_sorted(*items)) std::ranges::sort(*items);
}

}  // namespace

std::uint64_t ContactSearch::find_contacts(const BodyStore& bodies, ContactFinder* finder,
                                           std::vector<Contact>* contacts) {
  finder->sub_shapes().update_poses(bodies);
  candidates_.clear();
  find_sphere_pairs(bodies, finder, contacts);
  const std::uint64_t sphere_contacts = contacts->size();
  const SubShapeView& sub_shapes = finder->enclose_bounds(bodies).sub_shapes;
  finder->find_fixed_pairs(0, finder->sub_shapes().ranges().fixed_begin(), &candidates_);
  sort_if_needed(&candidates_);
  detail::PairManifold manifold;
  for (const Candidate& c : candidates_) {
    const Vec3 &a = bodies.moving.position[c.a], &b = bodies.moving.position[c.b];
    manifold.clear();
    find_contact(sub_shapes, c.sub_shape_a, c.sub_shape_b, c.element, a, {{}, 0, 0, a, b},
                 &manifold);
    for (std::uint32_t i = 0; i < manifold.touch_count; ++i) {
      const auto& [point, distance] = manifold.touches[i];
      contacts->push_back(
          without_material(bodies.id(c.a), bodies.id(c.b), manifold.normal, point, distance));
    }
  }
  return sphere_contacts;
}

/// Appends the contacts of two spheres to `contacts`, and the pairs with another solid to
/// candidates_. In a pair of the collider, a < b, and spheres have the lowest numbers. Therefore b
/// is the other solid, if any.
void ContactSearch::find_sphere_pairs(const BodyStore& bodies, ContactFinder* finder,
                                      std::vector<Contact>* contacts) {
  const ContactSpan found = finder->broad_phase().find(finder->sub_shapes().bounds());
  const BodyView view = bodies.view();
  const SubShapeView sub_shapes = finder->sub_shapes().view();
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
    contacts->push_back(
        without_material(bodies.id(hit.pair.a), bodies.id(hit.pair.b), normal, point, c.distance));
  }
}

}  // namespace thesis
}  // namespace JFPX_ABI
}  // namespace jfpx
