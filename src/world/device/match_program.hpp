/// Matching and coloring of the contacts of a soft step on a device.
#pragma once

#include "src/contact_solver/contact_match.hpp"
#include "src/contact_solver/greedy_coloring.hpp"
#include "src/world/device/atomic.hpp"
#include "src/world/device/step_data.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Gives each contact the impulses and the color of the same contact of the last step, and colors
/// the others: as soft_step::ContactCache.
struct MatchProgram {
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed()) return;
    const StepData& d = data;
    const std::uint32_t bodies = d.step.bodies.capacity;
    const std::uint32_t spheres = d.counters->spheres;
    team.for_each(bodies, [&](std::uint32_t i) {
      d.used_colors[i] = 0;
      d.first_order[i] = kNoOrder;
      d.first_contact[i] = kNone;
      d.now.spheres_of[i] = {};
    });
    team.for_each(spheres, [&](std::uint32_t i) {
      const soft_step::SphereContactInput* list = d.now.view.spheres;
      const std::uint32_t a = list[i].key.a;
      if (i == 0 || list[i - 1].key.a != a) d.now.spheres_of[a].begin = i;
      if (i + 1 == spheres || list[i + 1].key.a != a) d.now.spheres_of[a].end = i + 1;
      match_sphere(i);
    });
    team.for_each(d.counters->manifolds, [&](std::uint32_t m) { match_manifold(m); });
    color(team);
  }

 private:
  static constexpr std::uint64_t kNoOrder = ~std::uint64_t{0};

  /// The contact with this key in a range that is sorted by key; kNone if there is none.
  template <class Contact>
  JFPX_HD static std::uint32_t find(const Contact* contacts, Range range,
                                    const soft_step::ContactKey& key) {
    while (range.begin < range.end) {
      const std::uint32_t middle = range.begin + (range.end - range.begin) / 2;
      const soft_step::ContactKey& other = contacts[middle].key;
      if (other.b == key.b && other.part_a == key.part_a && other.part_b == key.part_b)
        return middle;
      const bool is_before = other.b != key.b             ? other.b < key.b
                             : other.part_a != key.part_a ? other.part_a < key.part_a
                                                          : other.part_b < key.part_b;
      if (is_before) {
        range.begin = middle + 1;
      } else {
        range.end = middle;
      }
    }
    return kNone;
  }

  JFPX_HD void match_sphere(std::uint32_t i) const {
    const soft_step::ContactView now = data.contacts(), last = data.last_contacts();
    now.impulses[i] = {};
    now.rolling_impulses[i] = {};
    now.colors[i] = soft_step::kNoColor;
    const soft_step::ContactKey& key = now.spheres[i].key;
    const std::uint32_t before = find(last.spheres, data.last.spheres_of[key.a], key);
    if (before == kNone) return;
    keep(now, i, last, before);
    now.impulses[i] = soft_step::turned(last.impulses[before], now.spheres[i].normal);
  }

  JFPX_HD void match_manifold(std::uint32_t m) const {
    const soft_step::ContactView now = data.contacts(), last = data.last_contacts();
    const soft_step::ManifoldInput& contact = now.manifolds[m];
    const std::uint32_t i = now.sphere_count + m;
    now.rolling_impulses[i] = {};
    now.colors[i] = soft_step::kNoColor;
    for (std::uint32_t p = 0; p < contact.count; ++p) {
      now.impulses[now.sphere_count + contact.first + p] = {};
    }
    const std::uint32_t before =
        find(last.manifolds, data.last.manifolds_of[contact.key.a], contact.key);
    if (before == kNone) return;
    keep(now, i, last, last.sphere_count + before);
    soft_step::match_points(now, m, last, before);
  }

  /// Keeps the color and the rolling impulse.
  JFPX_HD void keep(const soft_step::ContactView& now, std::uint32_t i,
                    const soft_step::ContactView& last, std::uint32_t before) const {
    now.rolling_impulses[i] = last.rolling_impulses[before];
    const std::uint8_t color = last.colors[before];
    if (color >= soft_step::kColors) return;
    now.colors[i] = color;
    const std::uint64_t bit = std::uint64_t{1} << color;
    atomic_or(&data.used_colors[now.key(i).a], bit);
    atomic_or(&data.used_colors[now.key(i).b], bit);
  }

  /// Colors in rounds: a contact gets its color when it is the first of the uncolored ones at both
  /// bodies, which gives the colors of the sequential order.
  template <class Team>
  JFPX_HD void color(const Team& team) const {
    const StepData& d = data;
    const soft_step::ContactView now = d.contacts();
    const BodyView& bodies = d.step.bodies;
    const auto is_uncolored = [&](std::uint32_t i) {
      return now.colors[i] == soft_step::kNoColor ? 1u : 0u;
    };
    team.for_each(now.size(), [&](std::uint32_t i) {
      const soft_step::ContactKey& key = now.key(i);
      if (is_uncolored(i) != 0 && !(bodies.movable(key.a) && bodies.movable(key.b))) {
        now.colors[i] = soft_step::kFixedColor;
      }
    });
    std::uint32_t left =
        team.scan(now.size(), is_uncolored, [&](std::uint32_t i, std::uint32_t place) {
          if (is_uncolored(i) != 0) d.uncolored[place] = i;
        });
    std::uint32_t *list = d.uncolored, *next = d.still_uncolored;
    while (left > 0) {
      team.for_each(left, [&](std::uint32_t k) {
        const soft_step::ContactKey& key = now.key(list[k]);
        const std::uint64_t order = soft_step::color_order(key);
        atomic_min(&d.first_order[key.a], order);
        atomic_min(&d.first_order[key.b], order);
      });
      // Contacts with the same value of color_order() are served by their index.
      team.for_each(left, [&](std::uint32_t k) {
        const soft_step::ContactKey& key = now.key(list[k]);
        const std::uint64_t order = soft_step::color_order(key);
        if (order == d.first_order[key.a]) atomic_min(&d.first_contact[key.a], list[k]);
        if (order == d.first_order[key.b]) atomic_min(&d.first_contact[key.b], list[k]);
      });
      team.for_each(left, [&](std::uint32_t k) {
        const std::uint32_t i = list[k];
        const soft_step::ContactKey& key = now.key(i);
        if (d.first_contact[key.a] != i || d.first_contact[key.b] != i) return;
        std::uint64_t &a = d.used_colors[key.a], &b = d.used_colors[key.b];
        const std::uint8_t color = soft_step::lowest_free_color(a | b);
        now.colors[i] = color;
        if (color == soft_step::kOverflowColor) return;
        a |= std::uint64_t{1} << color;
        b |= std::uint64_t{1} << color;
      });
      team.for_each(left, [&](std::uint32_t k) {
        const soft_step::ContactKey& key = now.key(list[k]);
        d.first_order[key.a] = d.first_order[key.b] = kNoOrder;
        d.first_contact[key.a] = d.first_contact[key.b] = kNone;
      });
      left = team.scan(
          left, [&](std::uint32_t k) { return is_uncolored(list[k]); },
          [&](std::uint32_t k, std::uint32_t place) {
            if (is_uncolored(list[k]) != 0) next[place] = list[k];
          });
      std::uint32_t* other = list;
      list = next;
      next = other;
    }
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
