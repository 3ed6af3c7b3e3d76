/// Gathers bounds, asks the collider, and tests what is no pair of spheres.
#include "src/narrow_phase.hpp"

#include <algorithm>
#include <utility>

namespace jfpx::inline JFPX_ABI {
namespace {

/// Larger than what the pair tests may find wrongly by rounding, so that a bound never hides a
/// touch.
constexpr Real kMargin = 1 + 64 * kEpsilon;

bool near(const SphereInstance& a, const SphereInstance& b) {
  const Real most = a.radius + b.radius;
  return length_squared(a.centre - b.centre) <= most * most * kMargin;
}

Real bounding_radius(const Box& box) { return length(box.half_extents) * kMargin; }

/// Appends the contacts of two bodies of which one is no sphere.
class PairTest {
 public:
  PairTest(const BodyStore& bodies, std::span<const Transform> poses,
           std::vector<Contact>* contacts)
      : bodies_(bodies), poses_(poses), contacts_(contacts) {}

  void operator()(std::uint32_t a, std::uint32_t b) const {
    const Shape& solid = bodies_.shape(b);
    if (const auto* sphere = std::get_if<Sphere>(&bodies_.shape(a))) {
      const SphereInstance instance{bodies_.moving.position[a], sphere->radius};
      if (const auto* half_space = std::get_if<HalfSpace>(&solid)) {
        add(a, b, collide(instance, *half_space));
      } else {
        add(a, b, collide(instance, std::get<Box>(solid), poses_[b]));
      }
      return;
    }
    const Box& box = std::get<Box>(bodies_.shape(a));
    if (const auto* half_space = std::get_if<HalfSpace>(&solid)) {
      add(a, b, collide(box, poses_[a], *half_space));
    } else {
      add(a, b, collide(box, poses_[a], std::get<Box>(solid), poses_[b]));
    }
  }

 private:
  void add(std::uint32_t a, std::uint32_t b, const Touch& touch) const {
    if (touch.touching) contacts_->push_back({a, b, touch.normal, touch.point, touch.distance});
  }
  void add(std::uint32_t a, std::uint32_t b, const Manifold& manifold) const {
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& p = manifold.points[i];
      contacts_->push_back({a, b, manifold.normal, p.point, p.distance});
    }
  }

  const BodyStore& bodies_;
  std::span<const Transform> poses_;
  std::vector<Contact>* contacts_;
};

}  // namespace

NarrowPhase::NarrowPhase(std::unique_ptr<SphereCollider> collider)
    : collider_(std::move(collider)) {}

void NarrowPhase::set_bodies(const BodyStore& bodies) {
  body_.clear();
  bounds_.clear();
  obstacles_.clear();
  pose_.resize(bodies.capacity());
  for (const BodyId id : bodies.ids()) {
    const auto* sphere = std::get_if<Sphere>(&bodies.shape(id.index));
    if (sphere == nullptr) continue;
    body_.push_back(id.index);
    bounds_.push_back({bodies.moving.position[id.index], sphere->radius});
  }
  sphere_count_ = body_.size();
  for (const BodyId id : bodies.ids()) {
    const Shape& shape = bodies.shape(id.index);
    if (std::holds_alternative<Sphere>(shape)) continue;
    const auto* box = std::get_if<Box>(&shape);
    const SphereInstance bounds{bodies.moving.position[id.index],
                                box != nullptr ? bounding_radius(*box) : Real(0)};
    pose_[id.index] = make_transform(bodies.moving.orientation[id.index], bounds.centre);
    if (bodies.movable(id.index)) {
      body_.push_back(id.index);
      bounds_.push_back(bounds);
    } else {
      obstacles_.push_back({id.index, bounds});
    }
  }
}

std::uint64_t NarrowPhase::find_contacts(const BodyStore& bodies, std::vector<Contact>* contacts) {
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    const std::uint32_t body = body_[i];
    bounds_[i].centre = bodies.moving.position[body];
    if (i < sphere_count_) continue;
    pose_[body] = make_transform(bodies.moving.orientation[body], bounds_[i].centre);
  }
  candidates_.clear();
  find_sphere_pairs(bodies, contacts);
  const std::uint64_t sphere_contacts = contacts->size();
  find_obstacles(bodies);
  // Without movable boxes they come in order.
  if (!std::ranges::is_sorted(candidates_)) std::ranges::sort(candidates_);
  const PairTest test(bodies, pose_, contacts);
  for (const Candidate& c : candidates_) test(c.a, c.b);
  return sphere_contacts;
}

/// Pairs in which a box takes part become candidates; a sphere is their a.
void NarrowPhase::find_sphere_pairs(const BodyStore& bodies, std::vector<Contact>* contacts) {
  for (const SphereContact& c : collider_->find_contacts(bounds_)) {
    const std::uint32_t a = body_[c.a], b = body_[c.b];
    if (!bodies.movable(a) && !bodies.movable(b)) continue;
    if (c.b >= sphere_count_) {
      candidates_.push_back({a, b});
      continue;
    }
    const Vec3 point = middle_point(c.normal, c.distance, bounds_[c.b]);
    contacts->push_back({a, b, c.normal, point, c.distance});
  }
}

void NarrowPhase::find_obstacles(const BodyStore& bodies) {
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    if (!bodies.movable(body_[i])) continue;
    for (const Obstacle& obstacle : obstacles_) {
      const bool unbounded = !(obstacle.bounds.radius > 0);
      if (unbounded || near(bounds_[i], obstacle.bounds)) {
        candidates_.push_back({body_[i], obstacle.body});
      }
    }
  }
}

}  // namespace jfpx::inline JFPX_ABI
