/// The part of contact detection that finds pairs which may touch during a step.
#include <jfpx/intersect.hpp>

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"
#include "src/world/contact_finder.hpp"

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::ContactSet;

/// The margin of a sub-shape is at most this part of its size, so that small bodies do not collect
/// contacts with everything around them.
constexpr Real kMarginPerSize = Real(0.04);
constexpr std::size_t kSubShapesPerChunk = 1024, kPairsPerChunk = 1024;

Real smallest_half_extent(const Box& box) {
  const Vec3& h = box.half_extents;
  return std::min({h.x, h.y, h.z});
}

/// A list that is filled again in every step. Its vector keeps the items of the last step until
/// they are overwritten, because constructing them again would take as long as filling them.
template <class Item>
struct Refilled {
  std::vector<Item>* items;
  std::size_t size = 0;

  void grow_to(std::size_t new_size) {
    size = new_size;
    if (items->size() < size) resize_geometric(items, size);
  }
  void finish() { items->resize(size); }
};

/// Appends the lists of all parts to a list.
/// @param list returns the list of a part
template <class Part, class List, class Item>
void append(ThreadPool* pool, std::span<Part> parts, const List& list, Refilled<Item>* all) {
  const std::size_t before = all->size;
  std::size_t size = before;
  for (Part& part : parts) size += list(part).size();
  all->grow_to(size);
  parallel_for(pool, parts.size(), 8, [&](std::size_t first, std::size_t last) {
    std::size_t place = before;
    for (std::size_t i = 0; i < first; ++i) place += list(parts[i]).size();
    for (std::size_t i = first; i < last; ++i) {
      std::ranges::copy(list(parts[i]), all->items->begin() + static_cast<std::ptrdiff_t>(place));
      place += list(parts[i]).size();
    }
  });
}

}  // namespace

/// Fills swept_ with spheres that enclose the motion of each sub-shape during the step.
void ContactFinder::sweep_bounds(const BodyStore& bodies, Real margin, ThreadPool* pool) {
  motion_.resize(bodies.capacity());
  parallel_for(pool, bodies.ids().size(), kSubShapesPerChunk,
               [&](std::size_t first, std::size_t last) {
                 for (const BodyId id : bodies.ids().subspan(first, last - first)) {
                   motion_[id.index] = bodies.predicted_motion(id.index);
                 }
               });
  swept_.resize(sub_shapes_.bounded_size());
  margins_.assign(sub_shapes_.size(), margin * Real(0.5));
  parallel_for(pool, swept_.size(), kSubShapesPerChunk, [&](std::size_t first, std::size_t last) {
    for (auto i = static_cast<SubShape>(first); i < last; ++i) {
      const Real size = sub_shapes_.is_sphere(i) ? sub_shapes_.bounds(i).radius
                                                 : smallest_half_extent(sub_shapes_.box(i).box);
      margins_[i] = std::min(margins_[i], size * kMarginPerSize);
      const std::uint32_t body = sub_shapes_.body(i);
      const SphereInstance& bounds = sub_shapes_.bounds(i);
      SphereInstance& swept = swept_[i];
      swept = {bounds.centre, bounds.radius + margins_[i]};
      if (bodies.moving.awake[body] != 0) {
        const Vec3 half_motion = motion_[body] * Real(0.5);
        const Real arm = length(bounds.centre - bodies.moving.position[body]);
        const Real reach = sub_shapes_.is_sphere(i) ? arm : arm + bounds.radius;
        const Real turned = length(bodies.moving.angular_velocity[body]) * bodies.dt();
        swept.centre += half_motion;
        swept.radius += length(half_motion) + std::min(turned, Real(2)) * reach;
      }
      // For the rounding errors of the centre and of the radius.
      const Vec3& c = swept.centre;
      const Real largest = std::max({absolute(c.x), absolute(c.y), absolute(c.z)});
      swept.radius += 8 * kEpsilon * (largest + swept.radius);
    }
  });
}

/// Tests pairs of swept bounds: contacts of two spheres go to *part, pairs with a box or a part of
/// a compound to its candidates. Spheres of compounds become manifolds, because their arms are not
/// multiples of the normal.
void ContactFinder::test_sphere_pairs(const BodyStore& bodies, ContactSpan pairs, Part* part) {
  for (const SphereContact& pair : pairs) {
    const std::uint32_t a = sub_shapes_.body(pair.a), b = sub_shapes_.body(pair.b);
    if (a == b || (!bodies.movable(a) && !bodies.movable(b)) || !bodies.may_collide(a, b)) continue;
    if (!sub_shapes_.is_sphere(pair.b)) {
      part->candidates.push_back(ordered(bodies, pair.a, pair.b));
      continue;
    }
    if (!(bodies.radius(a) > 0 && bodies.radius(b) > 0)) {
      part->compounds.push_back(ordered(bodies, pair.a, pair.b));
      continue;
    }
    const SphereInstance &x = sub_shapes_.bounds(pair.a), &y = sub_shapes_.bounds(pair.b);
    const Real margin = 2 * std::min(margins_[pair.a], margins_[pair.b]);
    const detail::SpeculativeContact c =
        detail::find_speculative(x, y, motion_[a] - motion_[b], margin);
    if (!c.found) continue;
    if (!bodies.sensor(a) && !bodies.sensor(b)) {
      part->near.spheres.push_back({{a, b}, c.normal, c.distance});
    }
    if (!(c.distance <= 0)) continue;
    const Vec3 point = middle_point(c.normal, c.distance, y);
    part->near.touching.push_back({bodies.id(a), bodies.id(b), c.normal, point, c.distance});
  }
}

/// Whether the swept bounds of a movable sub-shape touch a fixed one. Conservative.
bool ContactFinder::may_meet(const BodyStore& bodies, SubShape sub_shape, SubShape fixed) const {
  const SphereInstance& swept = swept_[sub_shape];
  if (sub_shapes_.is_wall(fixed)) {
    const Vec3& centre = bodies.moving.position[sub_shapes_.body(sub_shape)];
    const HalfSpace solid = sub_shapes_.wall(fixed).solid_for(centre);
    const Real height = dot(solid.normal, swept.centre) - solid.offset;
    return height <= swept.radius + 8 * kEpsilon * absolute(solid.offset);
  }
  const Real most = swept.radius + swept_[fixed].radius;
  if (!(length_squared(swept.centre - swept_[fixed].centre) <= most * most * (1 + 64 * kEpsilon)))
    return false;
  // The bounding sphere of a wide floor contains everything above it.
  const Real moved = swept_[fixed].radius - sub_shapes_.bounds(fixed).radius;
  const SubShapeTable::PosedBox& box = sub_shapes_.box(fixed);
  const Real far = length(box.pose.origin) + swept_[fixed].radius + length(swept.centre);
  return jfpx::may_touch(
      SphereInstance{swept.centre, swept.radius + 2 * moved + 16 * kEpsilon * far}, box.box,
      box.pose);
}

/// Appends the pairs of a movable and a fixed sub-shape whose swept bounds touch.
/// @param first,last range of movable sub-shapes
void ContactFinder::find_fixed_pairs(const BodyStore& bodies, SubShape first, SubShape last,
                                     Part* part) {
  for (SubShape sub_shape = first; sub_shape < last; ++sub_shape) {
    const std::uint32_t body = sub_shapes_.body(sub_shape);
    if (!bodies.movable(body)) continue;
    for (SubShape fixed = sub_shapes_.fixed_begin(); fixed < sub_shapes_.size(); ++fixed) {
      if (bodies.may_collide(body, sub_shapes_.body(fixed)) && may_meet(bodies, sub_shape, fixed)) {
        part->candidates.push_back(ordered(bodies, sub_shape, fixed));
      }
    }
  }
}

/// The lists that find_near_contacts() fills.
struct ContactFinder::Results {
  Refilled<soft_step::SphereContactInput> spheres;
  Refilled<soft_step::ManifoldInput> manifolds;
  Refilled<soft_step::PointInput> points;
  Refilled<Contact> touching;
};

/// Runs the pair tests of a sorted list of candidates and appends the results.
void ContactFinder::test_candidates(const BodyStore& bodies, std::span<const Candidate> candidates,
                                    Results* results, ThreadPool* pool) {
  const std::span<Part> parts = start_parts(candidates.size());
  parallel_for(pool, candidates.size(), kPairsPerChunk, [&](std::size_t first, std::size_t last) {
    NearPairTest test(bodies, sub_shapes_, margins_, &parts[first / kPairsPerChunk].near);
    for (const Candidate& c : candidates.subspan(first, last - first)) {
      test(c.a, c.b, c.sub_shape_a, c.sub_shape_b);
    }
  });
  auto first_point = static_cast<std::uint32_t>(results->points.size);
  for (Part& part : parts) {
    for (soft_step::ManifoldInput& manifold : part.near.manifolds) manifold.first += first_point;
    first_point += static_cast<std::uint32_t>(part.near.points.size());
  }
  append(
      pool, parts, [](Part & p) -> auto& { return p.near.manifolds; }, &results->manifolds);
  append(
      pool, parts, [](Part & p) -> auto& { return p.near.points; }, &results->points);
  append(
      pool, parts, [](Part & p) -> auto& { return p.near.touching; }, &results->touching);
}

/// Merges the sorted ranges [0, middle) and [middle, size) of a list. Unlike std::inplace_merge(),
/// it allocates nothing but the buffer that it keeps.
void ContactFinder::merge_by_bodies(std::size_t middle, std::span<Contact> contacts) {
  const auto pair_of = [](const Contact& c) { return std::pair(c.a.index, c.b.index); };
  reserve_geometric(&merged_, contacts.size() - middle);
  merged_.assign(contacts.begin() + static_cast<std::ptrdiff_t>(middle), contacts.end());
  std::size_t first = middle, second = merged_.size();
  while (second > 0) {
    const bool is_first = first > 0 && pair_of(merged_[second - 1]) < pair_of(contacts[first - 1]);
    Contact& last = contacts[first + second - 1];
    last = is_first ? contacts[--first] : merged_[--second];
  }
}

/// Empty parts for a loop over `count` items in chunks of kPairsPerChunk.
std::span<ContactFinder::Part> ContactFinder::start_parts(std::size_t count) {
  const std::size_t chunks = (count + kPairsPerChunk - 1) / kPairsPerChunk;
  if (parts_.size() < chunks) parts_.resize(chunks);
  for (std::size_t i = 0; i < chunks; ++i) parts_[i].clear();
  return std::span(parts_).first(chunks);
}

std::uint64_t ContactFinder::find_near_contacts(const BodyStore& bodies, Real margin,
                                                ThreadPool* pool, ContactSet* near,
                                                std::vector<Contact>* touching) {
  sub_shapes_.update_poses(bodies, pool);
  sweep_bounds(bodies, margin, pool);
  Results results{{&near->spheres}, {&near->manifolds}, {&near->points}, {touching}};
  Refilled<Candidate> candidates{&candidates_}, compounds{&compounds_};

  const ContactSpan found = broad_phase_.find(std::span(swept_).first(sub_shapes_.fixed_begin()));
  std::span<Part> parts = start_parts(found.size());
  parallel_for(pool, found.size(), kPairsPerChunk, [&](std::size_t first, std::size_t last) {
    test_sphere_pairs(bodies, found.subspan(first, last - first), &parts[first / kPairsPerChunk]);
  });
  append(
      pool, parts, [](Part & p) -> auto& { return p.near.spheres; }, &results.spheres);
  append(
      pool, parts, [](Part & p) -> auto& { return p.near.touching; }, &results.touching);
  append(
      pool, parts, [](Part & p) -> auto& { return p.candidates; }, &candidates);
  append(
      pool, parts, [](Part & p) -> auto& { return p.compounds; }, &compounds);

  compounds.finish();
  if (!compounds_.empty()) {
    const std::size_t middle = results.touching.size;
    std::ranges::sort(compounds_);
    test_candidates(bodies, compounds_, &results, pool);
    merge_by_bodies(middle, std::span(*touching).first(results.touching.size));
  }
  const std::uint64_t sphere_contacts = results.touching.size;

  parts = start_parts(sub_shapes_.fixed_begin());
  parallel_for(pool, sub_shapes_.fixed_begin(), kPairsPerChunk,
               [&](std::size_t first, std::size_t last) {
                 find_fixed_pairs(bodies, static_cast<SubShape>(first), static_cast<SubShape>(last),
                                  &parts[first / kPairsPerChunk]);
               });
  append(
      pool, parts, [](Part & p) -> auto& { return p.candidates; }, &candidates);
  candidates.finish();
  if (!std::ranges::is_sorted(candidates_)) std::ranges::sort(candidates_);
  test_candidates(bodies, candidates_, &results, pool);
  results.spheres.finish();
  results.manifolds.finish();
  results.points.finish();
  results.touching.finish();
  const auto by_key = [](const auto& x, const auto& y) { return x.key < y.key; };
  if (!std::ranges::is_sorted(near->manifolds, by_key)) std::ranges::sort(near->manifolds, by_key);
  return sphere_contacts;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
