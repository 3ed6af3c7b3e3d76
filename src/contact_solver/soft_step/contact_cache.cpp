/// Matching of the contacts of consecutive steps; see the header.
#include "src/contact_solver/soft_step/contact_cache.hpp"

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"
#include "src/contact_solver/soft_step/contact_lookup.hpp"
#include "src/contact_solver/soft_step/contact_match.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {
namespace {

constexpr std::size_t kMatchesPerChunk = 256;

}  // namespace

void ContactCache::match(const MatchedBodies& bodies, bool any_rolls, const JointView& joints,
                         ThreadPool* pool, Domain* domain) {
  reserve(bodies.inverse_mass.size());
  drop_forgotten();
  ContactSet& now = current_;
  const auto spheres = static_cast<std::uint32_t>(now.spheres.size());
  resize_geometric(&now.impulses, spheres + now.points.size());
  if (any_rolls) {
    resize_geometric(&now.rolling_impulses, now.size());
  } else {
    now.rolling_impulses = {};
  }
  resize_geometric(&now.colors, now.size());
  coloring_.start(bodies.inverse_mass.size(), pool, domain);
  parallel_for(pool, spheres, chunk_size(spheres, 32, kMatchesPerChunk),
               [&](std::size_t first, std::size_t last) {
                 match_spheres(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last),
                               bodies);
               });
  parallel_for(pool, now.manifolds.size(), chunk_size(now.manifolds.size(), 32, kMatchesPerChunk),
               [&](std::size_t first, std::size_t last) {
                 match_manifolds(static_cast<std::uint32_t>(first),
                                 static_cast<std::uint32_t>(last), bodies);
               });
  match_joints(joints, bodies, domain);
  coloring_.finish(
      [&](std::uint32_t i, std::uint8_t color) {
        if (i < now.size()) {
          now.colors[i] = color;
        } else {
          joints.now[i - now.size()].color = color;
        }
      },
      pool, domain);
}

void ContactCache::match_joints(const JointView& joints, const MatchedBodies& bodies,
                                const Domain* domain) {
  GreedyColoring::Portion uncolored(&coloring_);
  for (std::uint32_t joint = 0; joint < joints.count; ++joint) {
    KeptJoint& now = joints.now[joint];
    now = joints.last[joint];
    if (!joints.is_used(joint)) continue;
    const ContactKey key = joints.key(joint);
    if (key.b == kWorld || !bodies.are_movable(key)) {
      now.color = kFixedColor;
    } else if (domain != nullptr && !domain->takes_part(key.a, key.b)) {
      continue;
    } else if (const bool is_inner = bodies.are_in_one_block(key);
               keeps_color(now.color, is_inner)) {
      coloring_.keep(key.a, key.b, static_cast<std::uint8_t>(now.color));
    } else {
      uncolored.add(key, current_.size() + joint, is_inner);
    }
  }
  uncolored.flush();
}

/// Assigns to contact i the rolling impulse and the color of the same contact of the last step. A
/// contact without a color gets kFixedColor, or a color from GreedyColoring::finish().
/// @param before number in the last step, if `is_kept`
void ContactCache::keep(std::uint32_t i, bool is_kept, std::uint32_t before,
                        const MatchedBodies& bodies, GreedyColoring::Portion* uncolored) {
  if (current_.has_rolling()) {
    current_.rolling_impulses[i] = {};
    if (is_kept) current_.rolling_impulses[i] = last_.rolling_impulse(before);
  }
  const std::uint8_t color = is_kept ? last_.colors[before] : kNoColor;
  const ContactView contacts = current_.view();
  const ContactKey& key = contacts.key(i);
  if (!bodies.are_movable(key)) {
    current_.colors[i] = kFixedColor;
  } else if (const bool is_inner = bodies.are_in_one_block(key); keeps_color(color, is_inner)) {
    current_.colors[i] = color;
    coloring_.keep(key.a, key.b, color);
  } else {
    current_.colors[i] = kNoColor;
    uncolored->add(key, i, is_inner);
  }
}

void ContactCache::match_spheres(std::uint32_t first, std::uint32_t last,
                                 const MatchedBodies& bodies) {
  GreedyColoring::Portion uncolored(&coloring_);
  ContactLookup<SphereContactInput> finder(last_.spheres);
  for (std::uint32_t i = first; i < last; ++i) {
    const SphereContactInput& contact = current_.spheres[i];
    current_.impulses[i] = {};
    std::uint32_t before = 0;
    const bool is_kept = finder.find(contact.key, &before);
    keep(i, is_kept, before, bodies, &uncolored);
    if (is_kept) current_.impulses[i] = at_start_of_step(last_.impulses[before]);
  }
  uncolored.flush();
}

void ContactCache::match_manifolds(std::uint32_t first, std::uint32_t last,
                                   const MatchedBodies& bodies) {
  GreedyColoring::Portion uncolored(&coloring_);
  const auto spheres = static_cast<std::uint32_t>(current_.spheres.size());
  const auto spheres_before = static_cast<std::uint32_t>(last_.spheres.size());
  ContactLookup<ManifoldInput> finder(last_.manifolds);
  for (std::uint32_t m = first; m < last; ++m) {
    const ManifoldInput& contact = current_.manifolds[m];
    for (std::uint32_t p = 0; p < contact.count; ++p) {
      current_.impulses[spheres + contact.first + p] = {};
    }
    std::uint32_t old = 0;
    const bool is_kept = finder.find(contact.key, &old);
    keep(spheres + m, is_kept, spheres_before + old, bodies, &uncolored);
    if (is_kept) match_points(current_.view(), m, last_.view(), old);
  }
  uncolored.flush();
}

void ContactCache::reserve(std::size_t bodies) {
  if (forgotten_.size() < bodies) forgotten_.resize(bodies);
}

void ContactCache::restore(ContactSet last) noexcept {
  forget_none();
  last_ = std::move(last);
}

void ContactCache::forget_none() noexcept {
  if (!any_forgotten_) return;
  std::ranges::fill(forgotten_, std::uint8_t{0});
  any_forgotten_ = false;
}

void ContactCache::forget(std::uint32_t body) noexcept {
  if (body >= forgotten_.size()) return;
  forgotten_[body] = 1;
  any_forgotten_ = true;
}

/// The impulses of removed manifolds remain unused until the next step.
void ContactCache::drop_forgotten() noexcept {
  if (!any_forgotten_) return;
  ContactSet& set = last_;
  const auto involved = [this](const ContactKey& key) {
    return forgotten_[key.a] != 0 || forgotten_[key.b] != 0;
  };
  // Points keep their indices, so the offset of their impulses must not change.
  const auto spheres = static_cast<std::uint32_t>(set.spheres.size());
  std::uint32_t kept = 0, kept_spheres = 0;
  const auto keep_contact = [&, has_rolling = set.has_rolling()](std::uint32_t i) {
    if (has_rolling) set.rolling_impulses[kept] = set.rolling_impulses[i];
    set.colors[kept++] = set.colors[i];
  };
  const bool has_materials = !set.sphere_materials.empty();
  for (std::uint32_t i = 0; i < spheres; ++i) {
    if (involved(set.spheres[i].key)) continue;
    set.spheres[kept] = set.spheres[i];
    set.impulses[kept] = set.impulses[i];
    if (has_materials) set.sphere_materials[kept] = set.sphere_materials[i];
    keep_contact(i);
  }
  kept_spheres = kept;
  std::copy(set.impulses.begin() + spheres, set.impulses.end(), set.impulses.begin() + kept);
  std::uint32_t kept_manifolds = 0;
  for (std::uint32_t m = 0; m < set.manifolds.size(); ++m) {
    if (involved(set.manifolds[m].key)) continue;
    keep_contact(spheres + m);
    set.manifolds[kept_manifolds++] = set.manifolds[m];
  }
  set.spheres.resize(kept_spheres);
  if (has_materials) set.sphere_materials.resize(kept_spheres);
  set.manifolds.resize(kept_manifolds);
  if (set.has_rolling()) set.rolling_impulses.resize(kept);
  set.colors.resize(kept);
  forget_none();
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
