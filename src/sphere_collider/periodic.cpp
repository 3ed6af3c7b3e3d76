/// Contacts in a periodic cell, by a search among the spheres and the images near the cell.
#include <jfpx/periodic.hpp>

#include "src/sphere_collider/both_orders.hpp"
#include "src/sphere_collider/periodic_input.hpp"
#include "src/sphere_collider/sphere_input.hpp"

#include <algorithm>
#include <bit>
#include <tuple>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// The spheres in the cell, and the cells that they came from.
struct Reduced {
  std::vector<SphereInstance> spheres;
  std::vector<ImageShift> cells;
};

Reduced reduce_all(std::span<const SphereInstance> spheres, const PeriodicCell& cell) {
  Reduced reduced{{spheres.begin(), spheres.end()}, std::vector<ImageShift>(spheres.size())};
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    Vec3& centre = reduced.spheres[i].centre;
    reduced.cells[i] = detail::reduce(&centre, cell);
  }
  return reduced;
}

/// Appends the images that may touch a sphere in the cell, in the order of the spheres and then of
/// their shifts.
std::vector<detail::PeriodicImage> append_images(std::vector<SphereInstance>* spheres,
                                                 const PeriodicCell& cell, Real reach) {
  std::vector<detail::PeriodicImage> images;
  const std::size_t n = spheres->size();
  for (std::size_t i = 0; i < n; ++i) {
    const SphereInstance sphere = (*spheres)[i];
    std::uint32_t codes = detail::near_images(sphere.centre, cell, reach);
    for (; codes != 0; codes &= codes - 1) {
      const auto code = static_cast<std::uint32_t>(std::countr_zero(codes));
      images.push_back({static_cast<SphereIndex>(i), code});
      spheres->push_back(detail::image_of(sphere, detail::shift_of(code), cell));
    }
  }
  return images;
}

/// The contacts of valid spheres in a valid cell.
std::vector<PeriodicContact> find_in_cell(SphereCollider& collider,
                                          std::span<const SphereInstance> spheres,
                                          const PeriodicCell& cell) {
  Reduced reduced = reduce_all(spheres, cell);
  // Touching spheres are at most two radii apart.
  const std::vector<detail::PeriodicImage> images =
      append_images(&reduced.spheres, cell, 2 * detail::largest_radius(spheres));
  const std::size_t n = spheres.size();
  std::vector<PeriodicContact> result;
  for (SphereContact c : collider.find_contacts(reduced.spheres)) {
    if (c.a >= n) break;
    ImageShift shift{};
    if (c.b >= n) {
      const detail::PeriodicImage& image = images[c.b - n];
      if (image.sphere <= c.a) continue;  // listed as an image of the sphere with the higher index
      c.b = image.sphere;
      shift = detail::shift_of(image.code);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      shift[k] += reduced.cells[c.a][k] - reduced.cells[c.b][k];
    }
    result.push_back({c, shift});
  }
  const auto key = [](const PeriodicContact& c) {
    return std::tuple(c.contact.a, c.contact.b, c.shift);
  };
  std::sort(result.begin(), result.end(),
            [&](const auto& p, const auto& q) { return key(p) < key(q); });
  const auto same_pair = [](const PeriodicContact& p, const PeriodicContact& q) {
    return p.contact.a == q.contact.a && p.contact.b == q.contact.b;
  };
  result.erase(std::unique(result.begin(), result.end(), same_pair), result.end());
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
  detail::check_number_of_cells(cells, offsets);
  detail::check_spheres(spheres);
  detail::check_in_cells(cells, spheres, offsets);
  std::vector<PeriodicContact> result;
  for (std::size_t i = 0; i < cells.size(); ++i) {
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
