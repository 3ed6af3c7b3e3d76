/// Broad phase and pair tests of a world's contact detection.
#include "src/world/contacts/contact_finder.hpp"

#include "src/base/cpu.hpp"
#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"
#include "src/contact_solver/soft_step/contact_lookup.hpp"
#include "src/world/contacts/merge_contacts.hpp"

#include <algorithm>
#include <functional>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using soft_step::ContactSet;

// A chunk takes about five microseconds.
constexpr std::size_t kSubShapesPerChunk = 256, kPairsPerChunk = 256, kCandidatesPerChunk = 64;
constexpr std::size_t kFewestItems = 32, kFewestCandidates = 8;
/// Chunks of a batch for each thread: enough to balance their loads.
constexpr std::size_t kChunksPerThread = 16;

/// A list that is refilled in every step. Its vector keeps the items of the last step until they
/// are overwritten, because constructing items takes as long as filling them.
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

/// Sorts a list that consists of a few ascending runs.
/// @param scratch memory that is kept from step to step
void sort_runs(std::vector<Candidate>* list, std::vector<Candidate>* scratch) {
  constexpr int kMostRuns = 8;
  auto middle = std::ranges::is_sorted_until(*list);
  for (int runs = 1; middle != list->end(); ++runs) {
    if (runs == kMostRuns) {
      std::ranges::sort(*list);
      return;
    }
    const auto sorted = static_cast<std::size_t>(middle - list->begin());
    const auto end = std::is_sorted_until(middle, list->end());
    resize_geometric(scratch, list->size());
    auto rest = std::merge(list->begin(), middle, middle, end, scratch->begin());
    std::copy(end, list->end(), rest);
    std::swap(*list, *scratch);
    middle = std::is_sorted_until(list->begin() + static_cast<std::ptrdiff_t>(sorted), list->end());
  }
}

/// Sorts manifolds that are sorted unless bodies have contacts of both compounds and solids.
void sort_by_key(ThreadPool* pool, std::vector<soft_step::ManifoldInput>* manifolds) {
  const std::span<const soft_step::ManifoldInput> list(*manifolds);
  const bool is_sorted = parallel_reduce(
      pool, list.size(), chunk_size(list.size(), kFewestItems, kSubShapesPerChunk), true,
      [&](std::size_t first, std::size_t last) {
        for (std::size_t i = std::max<std::size_t>(first, 1); i < last; ++i) {
          if (list[i].key < list[i - 1].key) return false;
        }
        return true;
      },
      std::logical_and<>());
  if (is_sorted) return;
  std::ranges::sort(*manifolds, {}, &soft_step::ManifoldInput::key);
}

/// A list of each part, and the list to which all of them are appended.
template <class Part, class Item>
struct Appended {
  std::vector<Item> Part::*of_part;
  Refilled<Item>* all;
};
template <class Part, class Item>
Appended(std::vector<Item> Part::*, Refilled<Item>*) -> Appended<Part, Item>;

/// Appends the lists of all parts, in the order of the parts.
/// @param prepare is called for each part first, from any thread: Part::places are set
template <class Part, class Prepare, class... Item>
void append(ThreadPool* pool, std::span<Part> parts, const Prepare& prepare,
            const Appended<Part, Item>&... lists) {
  const auto place = [&](std::size_t k, const auto& list) {
    std::size_t size = list.all->size;
    for (Part& part : parts) {
      part.places[k] = size;
      size += (part.*list.of_part).size();
    }
    list.all->grow_to(size);
  };
  const auto copy = [](const Part& part, std::size_t k, const auto& list) {
    std::ranges::copy(part.*list.of_part,
                      list.all->items->begin() + static_cast<std::ptrdiff_t>(part.places[k]));
  };
  std::size_t k = 0;
  (place(k++, lists), ...);
  // The thread that has filled a part has it in its cache.
  parallel_for(pool, parts.size(), 1, [&](std::size_t i, std::size_t) {
    prepare(&parts[i]);
    std::size_t list = 0;
    (copy(parts[i], list++, lists), ...);
  });
}

/// The kernels of hulls for the processor; null if there are none.
const cpu::HullKernels* hull_kernels(SimdLevel simd) {
#if defined(__x86_64__)
  if (usable_simd_level(simd) >= SimdLevel::avx2) return &cpu::kAvx2HullKernels;
#else
  static_cast<void>(simd);
#endif
  return nullptr;
}

}  // namespace

ContactFinder::ContactFinder(std::unique_ptr<BroadPhaseSearch> broad_phase, SimdLevel simd)
    : broad_phase_(std::move(broad_phase)), hull_kernels_(hull_kernels(simd)) {}

void ContactFinder::set_bodies(const BodyStore& bodies) {
  sub_shapes_.set_bodies(bodies);
  sub_shapes_.update_poses(bodies);
  broad_phase_->set_spheres(sub_shapes_.bounds());
  fixed_changed_ = true;
  domain_version_ = 0;
}

void ContactFinder::set_domain(const Domain* domain) {
  domain_ = domain;
  if (domain == nullptr || domain->version() == domain_version_) return;
  domain_version_ = domain->version();
  present_.clear();
  const SubShapeView sub_shapes = sub_shapes_.view();
  for (SubShape i = 0; i < sub_shapes.ranges.fixed_begin(); ++i) {
    if (domain->is_present(sub_shapes.body(i))) present_.push_back(i);
  }
}

/// The bounds among which the broad phase finds pairs.
std::span<const SphereInstance> ContactFinder::present_bounds(ThreadPool* pool) {
  if (domain_ == nullptr) return std::span(swept_).first(sub_shapes_.ranges().fixed_begin());
  present_bounds_.resize(present_.size());
  parallel_for(pool, present_.size(), chunk_size(present_.size(), 128, 1024),
               [&](std::size_t first, std::size_t last) {
                 for (std::size_t k = first; k < last; ++k) {
                   present_bounds_[k] = swept_[present_[k]];
                 }
               });
  return present_bounds_;
}

/// Sets the pointers of swept_bounds_ to the arrays of a search.
void ContactFinder::start_bounds(const BodyStore& bodies, Real margin) {
  motion_.resize(bodies.capacity());
  swept_.resize(sub_shapes_.ranges().bounded());
  margins_.resize(sub_shapes_.ranges().bounded());
  boxes_.resize(sub_shapes_.ranges().fixed_begin() - sub_shapes_.ranges().spheres());
  swept_bounds_ = {.bodies = bodies.view(),
                   .sub_shapes = sub_shapes_.view(),
                   .motion = motion_.data(),
                   .margins = margins_.data(),
                   .swept = swept_.data(),
                   .boxes = boxes_.data(),
                   .largest_margin = margin * Real(0.5),
                   .hull_kernels = hull_kernels_};
}

/// Computes the swept bounds of solids of mass 0 other than spheres, and their trees.
/// @param sweep function that computes the bounds of a sub-shape
template <class Sweep>
void ContactFinder::sweep_fixed(const Sweep& sweep) {
  if (!fixed_changed_) {
    for (const SubShape i : sub_shapes_.kinematic()) sweep(i);
    fixed_trees_.move_kinematic(swept_bounds_);
    return;
  }
  const SubShapeRanges& ranges = sub_shapes_.ranges();
  for (SubShape i = ranges.fixed_begin(); i < ranges.bounded(); ++i) sweep(i);
  fixed_trees_.set_bodies(sub_shapes_, swept_bounds_);
  fixed_changed_ = false;
}

/// Fills swept_bounds_: the bounds of the motion of all sub-shapes during the step.
void ContactFinder::sweep_bounds(const BodyStore& bodies, Real margin, ThreadPool* pool) {
  start_bounds(bodies, margin);
  if (fixed_changed_) std::ranges::fill(motion_, Vec3{});  // that of immovable bodies
  const std::span<const std::uint32_t> mobile =
      domain_ == nullptr ? bodies.mobile() : domain_->present();
  parallel_for(pool, mobile.size(), chunk_size(mobile.size(), kFewestItems, kSubShapesPerChunk),
               [&](std::size_t first, std::size_t last) {
                 for (const std::uint32_t i : mobile.subspan(first, last - first)) {
                   motion_[i] = swept_bounds_.bodies.predicted_motion(i);
                 }
               });
  const std::size_t bounded =
      domain_ == nullptr ? sub_shapes_.ranges().fixed_begin() : present_.size();
  parallel_for(pool, bounded, chunk_size(bounded, kFewestItems, kSubShapesPerChunk),
               [&](std::size_t first, std::size_t last) {
                 for (auto i = static_cast<SubShape>(first); i < last; ++i) {
                   swept_bounds_.sweep(domain_ == nullptr ? i : present_[i]);
                 }
               });
  sweep_fixed([this](SubShape i) { swept_bounds_.sweep(i); });
}

const SweptBounds& ContactFinder::enclose_bounds(const BodyStore& bodies) {
  start_bounds(bodies, 0);
  for (SubShape i = 0; i < sub_shapes_.ranges().fixed_begin(); ++i) swept_bounds_.enclose(i);
  sweep_fixed([this](SubShape i) { swept_bounds_.enclose(i); });
  return swept_bounds_;
}

/// Tests pairs of swept bounds. Contacts of two spheres are appended to *part, pairs with a box or
/// a part of a compound to its candidates. Spheres of compounds become manifolds, because their
/// lever arms are not multiples of the normal.
void ContactFinder::test_sphere_pairs(const BodyStore& bodies, std::span<const SpherePair> pairs,
                                      Part* part) const {
  const BodyView& view = swept_bounds_.bodies;
  const SubShapeView& sub_shapes = swept_bounds_.sub_shapes;
  for (SpherePair pair : pairs) {
    if (domain_ != nullptr) pair = {present_[pair.a], present_[pair.b]};
    const PairKind kind = swept_bounds_.kind_of(pair.a, pair.b);
    if (kind == PairKind::none) continue;
    if (kind != PairKind::spheres) {
      auto& list = kind == PairKind::general ? part->candidates : part->compounds;
      const Candidate candidate = ordered(view, sub_shapes, pair.a, pair.b);
      if (detects(candidate.a, candidate.b)) list.push_back(candidate);
      continue;
    }
    const std::uint32_t a = sub_shapes.body(pair.a), b = sub_shapes.body(pair.b);
    if (!detects(a, b)) continue;
    const detail::SpeculativeContact c = swept_bounds_.test_spheres(pair.a, pair.b);
    if (!c.found) continue;
    const bool touch = c.distance <= 0;
    if (view.sensor[a] == 0 && view.sensor[b] == 0) {
      if (domain_ != nullptr && domain_->is_foreign(b)) {
        part->crossing.push_back(static_cast<std::uint32_t>(part->spheres.size()));
      }
      part->spheres.push_back({{a, b}, c.normal, c.distance});
      if (touch) ++part->touching_spheres;
    } else if (touch) {
      const Vec3 point = middle_point(c.normal, c.distance, sub_shapes.bounds(pair.b));
      part->touches.push_back(
          without_material(bodies.id(a), bodies.id(b), c.normal, point, c.distance));
      if (keeps_keys_) part->keys.push_back({a, b});
    }
  }
}

void ContactFinder::find_fixed_pairs(SubShape first, SubShape last,
                                     std::vector<Candidate>* candidates) const {
  const FixedTreesView trees = fixed_trees_.view();
  for (SubShape i = first; i < last; ++i) {
    const std::uint32_t body = swept_bounds_.sub_shapes.body(i);
    if (!swept_bounds_.bodies.movable(body) || !detects(body, body)) continue;
    const auto before = static_cast<std::ptrdiff_t>(candidates->size());
    swept_bounds_.visit_fixed(i, trees, [&](SubShape fixed, std::uint32_t element) {
      candidates->push_back(
          ordered(swept_bounds_.bodies, swept_bounds_.sub_shapes, i, fixed, element));
    });
    std::sort(candidates->begin() + before, candidates->end());
  }
}

/// The lists that find_speculative_contacts() fills.
struct ContactFinder::Results {
  Refilled<soft_step::SphereContactInput> spheres;
  Refilled<soft_step::ManifoldInput> manifolds;
  Refilled<soft_step::PointInput> points;
  Refilled<Contact> touches;
  Refilled<soft_step::ContactKey> keys;  ///< of the touches, if they are kept
};

/// Appends the contact of two sub-shapes.
void ContactFinder::Part::add(const BodyStore& bodies, const CandidateManifold& found,
                              bool keeps_keys) {
  for (const CandidateManifold::Touch& touch : std::span(found.touches, found.touch_count)) {
    touches.push_back(without_material(bodies.id(found.key.a), bodies.id(found.key.b), found.normal,
                                       touch.point, touch.distance));
  }
  if (keeps_keys) keys.insert(keys.end(), found.touch_count, found.key);
  if (found.point_count == 0) return;
  const auto first = static_cast<std::uint32_t>(points.size());
  points.insert(points.end(), found.points, found.points + found.point_count);
  manifolds.push_back({found.key, found.normal, first, found.point_count, {}, found.tested});
}

/// Calls find(first, last, part) for the chunks of [0, count) from any thread, then
/// append_all(parts) in this thread. Works in batches, so that the parts are small and still in the
/// cache when they are appended.
template <class Find, class AppendAll>
void ContactFinder::for_each_batch(ThreadPool* pool, std::size_t count, std::size_t chunk,
                                   const Find& find, const AppendAll& append_all) {
  const std::size_t chunks = (count + chunk - 1) / chunk;
  const std::size_t threads = pool == nullptr ? 1 : pool->threads();
  const std::size_t most = std::min(chunks, kChunksPerThread * threads);
  if (parts_.size() < most) parts_.resize(most);
  for (std::size_t batch = 0; batch < chunks; batch += most) {
    const std::span<Part> parts = std::span(parts_).first(std::min(most, chunks - batch));
    const std::size_t begin = batch * chunk;
    const std::size_t size = std::min(count - begin, parts.size() * chunk);
    parallel_for(pool, size, chunk, [&](std::size_t first, std::size_t last) {
      Part& part = parts[first / chunk];
      part.clear();
      find(begin + first, begin + last, &part);
    });
    append_all(parts);
  }
}

/// Runs the pair tests of a sorted list of candidates and appends the results.
void ContactFinder::test_candidates(const BodyStore& bodies, std::span<const Candidate> candidates,
                                    const ContactSet& recyclable, Results* results,
                                    ThreadPool* pool) {
  const auto test_chunk = [&](std::size_t first, std::size_t last, Part* part) {
    CandidateManifold found;
    soft_step::ContactLookup<soft_step::ManifoldInput> lookup(recyclable.manifolds);
    const auto find_last = [&](const soft_step::ContactKey& key) {
      std::uint32_t index = 0;
      return lookup.find(key, &index) ? &recyclable.manifolds[index] : nullptr;
    };
    for (const Candidate& pair : candidates.subspan(first, last - first)) {
      if (!is_recyclable(swept_bounds_.sub_shapes, pair) ||
          !recycle_last(swept_bounds_, pair, recyclable.points.data(), find_last, &found)) {
        test_fully(swept_bounds_, pair, &found);
      }
      part->add(bodies, found, keeps_keys_);
    }
  };
  for_each_batch(pool, candidates.size(),
                 chunk_size(candidates.size(), kFewestCandidates, kCandidatesPerChunk), test_chunk,
                 [&](std::span<Part> parts) {
                   const auto number_points = [](Part* part) {
                     const auto first_point = static_cast<std::uint32_t>(part->places[0]);
                     for (soft_step::ManifoldInput& manifold : part->manifolds)
                       manifold.first += first_point;
                   };
                   append(pool, parts, number_points, Appended{&Part::points, &results->points},
                          Appended{&Part::manifolds, &results->manifolds},
                          Appended{&Part::touches, &results->touches},
                          Appended{&Part::keys, &results->keys});
                 });
}

/// Removes the points that another contact of the same body a hides.
/// @param run contacts of a body a
/// @returns whether a point was hidden
bool ContactFinder::hide_points_of_body(std::span<soft_step::ManifoldInput> run,
                                        soft_step::PointInput* points, Part* part) const {
  part->surfaces.clear();
  auto pair = std::ranges::lower_bound(candidates_, run.front().key.a, {}, &Candidate::a);
  for (soft_step::ManifoldInput& manifold : run) {
    while (key_of(swept_bounds_.sub_shapes, *pair) != manifold.key) ++pair;
    if (manifold.count == 0 || !may_hide(swept_bounds_, *pair)) continue;
    const SurfaceContact contact{&*pair, manifold.normal, points + manifold.first, manifold.count};
    part->surfaces.push_back({contact, &manifold, 0});
  }
  bool any = false;
  for (Part::Surface& surface : part->surfaces) {
    for (const Part::Surface& other : part->surfaces) {
      if (&other == &surface) continue;
      surface.hidden |= hidden_points(swept_bounds_, surface.contact, other.contact);
    }
    any |= surface.hidden != 0;
  }
  for (const Part::Surface& surface : part->surfaces) {
    if (surface.hidden == 0) continue;
    soft_step::ManifoldInput& manifold = *surface.manifold;
    manifold.count = remove_points(surface.hidden, manifold.count, points + manifold.first);
    manifold.tested = {};  // a hidden point may be visible in the next step
  }
  return any;
}

/// Removes hidden points from the contacts of candidates_.
void ContactFinder::hide_points(ContactSet* set, ThreadPool* pool) {
  const BodyView& bodies = swept_bounds_.bodies;
  const auto manifolds = std::span(set->manifolds).subspan(first_of_candidates_);
  soft_step::PointInput* const points = set->points.data();
  const auto find = [&](std::size_t begin, std::size_t end, Part* part) {
    // A run of contacts with the same a belongs to the chunk where it begins.
    while (begin > 0 && begin < end && manifolds[begin].key.a == manifolds[begin - 1].key.a) {
      ++begin;
    }
    while (begin < end) {
      const std::uint32_t a = manifolds[begin].key.a;
      std::size_t last = begin, immovable = 0;
      bool may_hide = false;
      for (; last < manifolds.size() && manifolds[last].key.a == a; ++last) {
        const std::uint32_t b = manifolds[last].key.b;
        may_hide |= last > begin && b == manifolds[last - 1].key.b;
        if (is_immovable(bodies, b)) ++immovable;
      }
      if (may_hide || immovable > 1) {
        part->any_hidden |=
            hide_points_of_body(manifolds.subspan(begin, last - begin), points, part);
      }
      begin = last;
    }
  };
  for_each_batch(pool, manifolds.size(),
                 chunk_size(manifolds.size(), kFewestCandidates, kCandidatesPerChunk), find,
                 [&](std::span<Part> parts) {
                   for (const Part& part : parts) any_empty_ |= part.any_hidden;
                 });
}

/// Removes contacts and points between points after hide_points(), or after a contact was emptied.
void ContactFinder::remove_empty(ContactSet* set) {
  if (!std::exchange(any_empty_, false)) return;
  std::size_t kept = 0;
  std::uint32_t kept_points = 0;
  for (const soft_step::ManifoldInput& manifold : set->manifolds) {
    if (manifold.count == 0) continue;
    if (manifold.first != kept_points) {
      std::copy_n(set->points.begin() + manifold.first, manifold.count,
                  set->points.begin() + kept_points);
    }
    soft_step::ManifoldInput& moved = set->manifolds[kept++] = manifold;
    moved.first = std::exchange(kept_points, kept_points + manifold.count);
  }
  set->manifolds.resize(kept);
  set->points.resize(kept_points);
}

std::size_t ContactFinder::find_speculative_contacts(const BodyStore& bodies, Real margin,
                                                     ThreadPool* pool, const ContactSet& recyclable,
                                                     ContactSet* set, DetectedContacts* detected) {
  if (domain_ == nullptr) {
    sub_shapes_.update_poses(bodies, pool);
  } else {
    sub_shapes_.update_poses(bodies, present_, pool);
  }
  sweep_bounds(bodies, margin, pool);
  Results results{
      {&set->spheres}, {&set->manifolds}, {&set->points}, {&detected->contacts}, {&detected->keys}};
  std::size_t touching_spheres = 0;
  Refilled<Candidate> candidates{&candidates_}, compounds{&compounds_};
  Refilled<std::uint32_t> crossing{&crossing_spheres_};

  const std::span<const SphereInstance> bounds = present_bounds(pool);
  const NeighborPairs found = broad_phase_->find_pairs(bounds, pool);
  const auto test_pairs = [&](std::size_t first, std::size_t last, Part* part) {
    found.for_each_touching(bounds, first, last, [&](std::span<const SpherePair> pairs) {
      test_sphere_pairs(bodies, pairs, part);
    });
  };
  const auto nothing = [](Part*) {};
  for_each_batch(
      pool, found.pairs.size(), chunk_size(found.pairs.size(), kFewestItems, kPairsPerChunk),
      test_pairs, [&](std::span<Part> parts) {
        for (const Part& part : parts) touching_spheres += part.touching_spheres;
        const auto number_crossing = [](Part* part) {
          for (std::uint32_t& number : part->crossing) {
            number += static_cast<std::uint32_t>(part->places[0]);
          }
        };
        append(pool, parts, number_crossing, Appended{&Part::spheres, &results.spheres},
               Appended{&Part::touches, &results.touches}, Appended{&Part::keys, &results.keys},
               Appended{&Part::candidates, &candidates}, Appended{&Part::compounds, &compounds},
               Appended{&Part::crossing, &crossing});
      });

  compounds.finish();
  if (!compounds_.empty()) {
    const std::size_t middle = results.touches.size;
    std::ranges::sort(compounds_);
    test_candidates(bodies, compounds_, recyclable, &results, pool);
    merge_by_bodies(middle, std::span(detected->contacts).first(results.touches.size), &merged_);
    if (keeps_keys_) {
      merge_by_bodies(middle, std::span(detected->keys).first(results.keys.size), &merged_keys_);
    }
  }
  detected->sphere_count = results.touches.size;

  const auto find_fixed = [&](std::size_t first, std::size_t last, Part* part) {
    if (domain_ == nullptr) {
      find_fixed_pairs(static_cast<SubShape>(first), static_cast<SubShape>(last),
                       &part->candidates);
      return;
    }
    for (const SubShape i : std::span(present_).subspan(first, last - first)) {
      find_fixed_pairs(i, i + 1, &part->candidates);
    }
  };
  const std::size_t count =
      domain_ == nullptr ? sub_shapes_.ranges().fixed_begin() : present_.size();
  for_each_batch(pool, count, chunk_size(count, kFewestItems, kSubShapesPerChunk), find_fixed,
                 [&](std::span<Part> parts) {
                   append(pool, parts, nothing, Appended{&Part::candidates, &candidates});
                 });
  candidates.finish();
  sort_runs(&candidates_, &merged_candidates_);
  first_of_candidates_ = results.manifolds.size;
  any_empty_ = false;
  test_candidates(bodies, candidates_, recyclable, &results, pool);
  results.spheres.finish();
  crossing.finish();
  results.manifolds.finish();
  results.points.finish();
  results.touches.finish();
  results.keys.finish();
  return touching_spheres;
}

void ContactFinder::complete(ContactSet* set, ThreadPool* pool) {
  hide_points(set, pool);
  remove_empty(set);
  sort_by_key(pool, &set->manifolds);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
