/// Contacts in a periodic cell, by a search among the spheres and the images near the cell.
#include <jfpx/periodic.hpp>

#include "src/sphere_collider/both_orders.hpp"
#include "src/sphere_collider/sphere_input.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Up to this number, the reduction to the cell is off by less than a length in either precision.
constexpr Real kMaxCells = Real(1 << 20);

Real largest_radius(std::span<const SphereInstance> spheres) {
  Real radius = 0;
  for (const SphereInstance& s : spheres) radius = std::max(radius, s.radius);
  return radius;
}

void check_cell(const PeriodicCell& cell, Real radius) {
  for (int k = 0; k < 3; ++k) {
    const Real length = cell.lengths[k];
    const std::string name = std::string("periodic length ") + "xyz"[k] + " is ";
    if (!cell.repeats[static_cast<std::size_t>(k)]) continue;
    if (!is_finite(length) || !(length > 0)) {
      throw InvalidArgument(name + detail::to_text(length) + "; it must be finite and > 0");
    }
    if (!(radius <= length / 4)) {
      throw InvalidArgument(name + detail::to_text(length) +
                            "; it must be at least twice the cutoff, which is " +
                            detail::to_text(2 * radius));
    }
  }
}

/// Reduces one coordinate to [0, length), and returns the number of cells that it was displaced by.
std::int32_t reduce(Real* x, Real length) {
  const Real cells = std::floor(*x / length);
  *x -= cells * length;
  auto count = static_cast<std::int32_t>(cells);
  // The quotient and the difference are rounded.
  if (*x < 0) {
    *x += length;
    --count;
  }
  if (*x >= length) {
    *x -= length;
    ++count;
  }
  return count;
}

/// The spheres in the cell, and the cells that they came from.
struct Reduced {
  std::vector<SphereInstance> spheres;
  std::vector<ImageShift> cells;
};

Reduced reduce(std::span<const SphereInstance> spheres, const PeriodicCell& cell) {
  Reduced reduced{{spheres.begin(), spheres.end()}, std::vector<ImageShift>(spheres.size())};
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!cell.repeats[k]) continue;
      const int axis = static_cast<int>(k);
      const Real length = cell.lengths[axis];
      Real& x = reduced.spheres[i].centre[axis];
      if (!(absolute(x / length) < kMaxCells)) {
        throw InvalidArgument("sphere " + std::to_string(i) + ": centre." + "xyz"[k] + " is " +
                              detail::to_text(x) + "; it must be within 2^20 periodic lengths");
      }
      reduced.cells[i][k] = reduce(&x, length);
    }
  }
  return reduced;
}

/// An image that may touch a sphere in the cell.
struct Image {
  SphereIndex sphere;
  ImageShift shift;
};

/// Appends the images whose centres are at most `reach` outside the cell, which is at most half a
/// length. The margin is wider by 8 epsilon lengths. Touching centres are at most reach * (1 + 5
/// epsilon) apart, because the sum of two radii and the distance are rounded; that is 2.5 epsilon
/// lengths more than `reach`, and the margin and its sum with a length lose less than 2 by
/// rounding.
std::vector<Image> append_images(std::vector<SphereInstance>* spheres, const PeriodicCell& cell,
                                 Real reach) {
  std::vector<Image> images;
  const std::size_t n = spheres->size();
  const auto limit = [&](std::size_t k) { return cell.repeats[k] ? 1 : 0; };
  for (std::size_t i = 0; i < n; ++i) {
    ImageShift s{};
    for (s[0] = -limit(0); s[0] <= limit(0); ++s[0]) {
      for (s[1] = -limit(1); s[1] <= limit(1); ++s[1]) {
        for (s[2] = -limit(2); s[2] <= limit(2); ++s[2]) {
          if (s == ImageShift{}) continue;
          SphereInstance image = (*spheres)[i];
          bool near = true;
          for (std::size_t k = 0; k < 3; ++k) {
            if (s[k] == 0) continue;
            const int axis = static_cast<int>(k);
            const Real length = cell.lengths[axis];
            const Real margin = reach + length * (8 * kEpsilon);
            Real& x = image.centre[axis];
            x += static_cast<Real>(s[k]) * length;
            near = near && x >= -margin && x <= length + margin;
          }
          if (!near) continue;
          images.push_back({static_cast<SphereIndex>(i), s});
          spheres->push_back(image);
        }
      }
    }
  }
  return images;
}

}  // namespace

std::vector<PeriodicContact> find_periodic_contacts(SphereCollider& collider,
                                                    std::span<const SphereInstance> spheres,
                                                    const PeriodicCell& cell) {
  detail::check_spheres(spheres);
  const Real radius = largest_radius(spheres);
  check_cell(cell, radius);
  Reduced reduced = reduce(spheres, cell);
  // Touching spheres are at most two radii apart.
  const std::vector<Image> images = append_images(&reduced.spheres, cell, 2 * radius);
  const std::size_t n = spheres.size();
  std::vector<PeriodicContact> result;
  for (SphereContact c : collider.find_contacts(reduced.spheres)) {
    if (c.a >= n) break;
    ImageShift shift{};
    if (c.b >= n) {
      const Image& image = images[c.b - n];
      if (image.sphere <= c.a) continue;  // listed as an image of the sphere with the higher index
      c.b = image.sphere;
      shift = image.shift;
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
