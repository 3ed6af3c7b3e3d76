/// Contacts in a periodic cell, by a search among the spheres and the images near the cell.
#include <jfpx/periodic.hpp>

#include "src/base/interrupt.hpp"
#include "src/sphere_collider/both_orders.hpp"
#include "src/sphere_collider/periodic_input.hpp"
#include "src/sphere_collider/sphere_input.hpp"

#include <algorithm>
#include <bit>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// The spheres in the cell, and the cells that they came from.
struct Reduced {
  std::vector<SphereInstance> spheres;
  std::vector<ImageShift> cells;
};

Reduced reduce_all(std::span<const SphereInstance> spheres, const PeriodicCell& cell) {
  Reduced reduced{std::vector<SphereInstance>(spheres.size()),
                  std::vector<ImageShift>(spheres.size())};
  const detail::CellErrors errors = detail::errors_in(cell);
  for_each_interruptible(spheres.size(), [&](std::size_t i) {
    reduced.spheres[i] = detail::reduced(spheres[i], cell, errors, &reduced.cells[i]);
  });
  return reduced;
}

bool is_before(const detail::PeriodicImage& p, const detail::PeriodicImage& q) {
  return std::pair(p.sphere, p.code) < std::pair(q.sphere, q.code);
}

/// Appends the images that may touch a sphere in the cell, in the order of the spheres and then of
/// their shifts.
std::vector<detail::PeriodicImage> append_images(std::vector<SphereInstance>* spheres,
                                                 const PeriodicCell& cell, Real reach) {
  std::vector<detail::PeriodicImage> images;
  const std::size_t n = spheres->size();
  for_each_interruptible(n, [&](std::size_t i) {
    const SphereInstance sphere = (*spheres)[i];
    std::uint32_t codes = detail::near_images(sphere.centre, cell, reach);
    for (; codes != 0; codes &= codes - 1) {
      const auto code = static_cast<std::uint32_t>(std::countr_zero(codes));
      images.push_back({static_cast<SphereIndex>(i), code});
      spheres->push_back(detail::image_of(sphere, detail::shift_of(code), cell));
    }
  });
  return images;
}

/// The contacts of valid spheres in a valid cell. A row of pairs of the collider has the spheres b
/// and then the images, which are sorted by their sphere and shift: merging both parts sorts the
/// row.
std::vector<PeriodicContact> find_in_cell(SphereCollider& collider,
                                          std::span<const SphereInstance> spheres,
                                          const PeriodicCell& cell) {
  Reduced reduced = reduce_all(spheres, cell);
  const std::vector<detail::PeriodicImage> images =
      append_images(&reduced.spheres, cell, 2 * detail::largest_radius(reduced.spheres));
  const std::size_t n = spheres.size();
  const std::span<const SpherePair> pairs = collider.find_pairs(reduced.spheres);
  const auto image_at = [&](const SpherePair& pair) {
    return pair.b < n ? detail::PeriodicImage{pair.b, detail::kNoShift} : images[pair.b - n];
  };
  const auto rows_end = std::ranges::lower_bound(pairs, n, {}, &SpherePair::a);
  std::vector<PeriodicContact> result;
  result.reserve(static_cast<std::size_t>(rows_end - pairs.begin()));
  const auto add = [&](SphereIndex a, const detail::PeriodicImage& image) {
    const SphereIndex b = image.sphere;
    if (b <= a) return;  // listed with the sphere of the higher index
    // A pair that touches through two images is listed with the lower shift.
    const bool is_listed =
        !result.empty() && result.back().contact.a == a && result.back().contact.b == b;
    if (is_listed) return;
    ImageShift shift = detail::shift_of(image.code);
    for (std::size_t k = 0; k < 3; ++k) shift[k] += reduced.cells[a][k] - reduced.cells[b][k];
    const PairResult found = detail::touch_at(spheres[a], spheres[b], shift, cell);
    if (found.touching != 0) result.push_back({{a, b, found.normal, found.distance}, shift});
  };
  SphereIndex polled = 0;
  for (const SpherePair* row = pairs.data(); row != pairs.data() + pairs.size() && row->a < n;) {
    const SphereIndex a = row->a;
    constexpr SphereIndex kRowsPerPoll = 256;
    if (a - polled >= kRowsPerPoll) {
      poll_interrupt();
      polled = a;
    }
    const SpherePair *sphere = row, *image = row;
    const auto is_in_row = [&](const SpherePair* at) {
      return at != pairs.data() + pairs.size() && at->a == a;
    };
    while (is_in_row(image) && image->b < n) ++image;
    const SpherePair* const first_image = image;
    while (sphere != first_image || is_in_row(image)) {
      const bool takes_sphere =
          sphere != first_image &&
          (!is_in_row(image) || is_before(image_at(*sphere), image_at(*image)));
      add(a, image_at(*(takes_sphere ? sphere++ : image++)));
    }
    row = image;
  }
  return result;
}

}  // namespace

std::vector<PeriodicContact> find_periodic_contacts(SphereCollider& collider,
                                                    std::span<const SphereInstance> spheres,
                                                    const PeriodicCell& cell) {
  detail::check_spheres(spheres);
  detail::check_in_cell(cell, spheres);
  return find_in_cell(collider, spheres, cell);
}

std::vector<PeriodicContact> find_periodic_contacts_between(SphereCollider& collider,
                                                            std::span<const SphereInstance> first,
                                                            std::span<const SphereInstance> second,
                                                            const PeriodicCell& cell) {
  std::vector<SphereInstance> spheres(first.begin(), first.end());
  spheres.insert(spheres.end(), second.begin(), second.end());
  std::vector<PeriodicContact> result;
  // Because a < b, a contact of both sets has its `a` in the first.
  for (PeriodicContact& c : find_periodic_contacts(collider, spheres, cell)) {
    if (c.contact.a >= first.size()) break;
    if (c.contact.b < first.size()) continue;
    c.contact.b -= static_cast<SphereIndex>(first.size());
    result.push_back(c);
  }
  return result;
}

std::vector<PeriodicContact> find_periodic_contacts_in_systems(
    SphereCollider& collider, std::span<const SphereInstance> spheres,
    std::span<const std::uint64_t> offsets, std::span<const PeriodicCell> cells) {
  detail::check_offsets(offsets, spheres.size());
  detail::check_number_of_cells(cells.size(), offsets);
  detail::check_spheres(spheres);
  detail::check_in_cells(cells, spheres, offsets);
  std::vector<PeriodicContact> result;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    poll_interrupt();
    const auto first = static_cast<SphereIndex>(offsets[i]);
    const auto system = spheres.subspan(first, offsets[i + 1] - first);
    for (PeriodicContact& c : find_in_cell(collider, system, cells[i])) {
      c.contact.a += first;
      c.contact.b += first;
      result.push_back(c);
    }
  }
  return result;
}

std::vector<PeriodicContact> in_both_orders(std::span<const PeriodicContact> contacts,
                                            std::size_t spheres) {
  return detail::both_orders(
      contacts, spheres, [](const PeriodicContact& c) -> const SphereContact& { return c.contact; },
      [](const PeriodicContact& c) {
        return PeriodicContact{{.a = c.contact.b,
                                .b = c.contact.a,
                                .normal = -c.contact.normal,
                                .distance = c.contact.distance},
                               {-c.shift[0], -c.shift[1], -c.shift[2]}};
      });
}

}  // namespace JFPX_ABI
}  // namespace jfpx
