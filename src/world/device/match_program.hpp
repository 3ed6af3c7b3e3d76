/// Matching and coloring of the contacts of a soft step on a device.
#pragma once

#include "src/base/atomic.hpp"
#include "src/contact_solver/soft_step/colors.hpp"
#include "src/contact_solver/soft_step/contact_match.hpp"
#include "src/world/device/step_data.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Assigns each contact and joint its impulses and color of the last step, and colors the
/// remaining ones: the device version of soft_step::ContactCache.
struct MatchProgram {
  static constexpr unsigned kBlocksPerMultiprocessor = tuning::kMatch;
  /// Up to this number of contacts, a single block colors them: its barriers are faster.
  static constexpr std::uint32_t kFewContacts = 4096;
  StepData data;

  template <class Team>
  JFPX_HD void operator()(const Team& team) const {
    if (data.has_failed()) return;
    const StepData& d = data;
    const ContactSizes sizes = d.state().now;
    const std::uint32_t spheres = sizes.spheres;
    const auto match = [&](std::uint32_t i) {
      const std::uint8_t before = i < spheres ? match_sphere(i) : match_manifold(i - spheres);
      const soft_step::ContactView now = d.contacts();
      const soft_step::ContactKey& key = now.key(i);
      d.constrained[key.a] = d.constrained[key.b] = soft_step::kHasContact;
      const BodyView& bodies = d.step.bodies;
      if (!bodies.movable(key.a) || !bodies.movable(key.b)) {
        now.colors[i] = soft_step::kFixedColor;
      } else if (soft_step::keeps_color(before, is_inner(key))) {
        now.colors[i] = before;
        keep(key, before);
      } else {
        now.colors[i] = soft_step::kNoColor;
        d.uncolored[append(&d.counters->uncolored[0])] = i;
      }
    };
    team.for_each_nowait(spheres, match, &d.divisions.spheres);
    team.for_each(
        sizes.manifolds, [&](std::uint32_t m) { match(spheres + m); }, &d.divisions.manifolds);
    if (d.world_joints.count > 0) {
      team.for_each(d.world_joints.count, [&](std::uint32_t joint) { match_joint(joint); });
      team.for_each(d.world_joints.count, [&](std::uint32_t joint) {
        const soft_step::JointInput& input = d.joints().inputs[joint];
        if (input.is_used == 0 || input.drives == 0) return;
        d.constrained[input.a] = soft_step::kHasDrive;
        if (input.b != soft_step::kWorld) d.constrained[input.b] = soft_step::kHasDrive;
      });
    }
    if (d.counters->uncolored[0] <= kFewContacts) {
      team.in_one_block([&](const auto& block) { color(block); });
    } else {
      color(team);
    }
  }

 private:
  static constexpr std::uint64_t kNoOrder = ~std::uint64_t{0};

  /// @returns the color of the last step, or kNoColor
  JFPX_HD std::uint8_t match_sphere(std::uint32_t i) const {
    const StepData& d = data;
    const soft_step::ContactView now = d.contacts(), last = d.last_contacts();
    const soft_step::ContactKey& key = now.spheres[i].key;
    if (i == 0 || now.spheres[i - 1].key.a != key.a) d.now().spheres_of[key.a].begin = i;
    if (i + 1 == now.sphere_count || now.spheres[i + 1].key.a != key.a) {
      d.now().spheres_of[key.a].end = i + 1;
    }
    const std::uint32_t before = d.find_last(last.spheres, d.last().spheres_of[key.a], key, 0);
    if (before == kNone) {
      now.impulses[i] = {};
      now.rolling_impulses[i] = {};
      return soft_step::kNoColor;
    }
    now.impulses[i] = soft_step::at_start_of_step(last.impulses[before]);
    now.rolling_impulses[i] = last.rolling_impulses[before];
    return last.colors[before];
  }

  /// @returns the color of the last step, or kNoColor
  JFPX_HD std::uint8_t match_manifold(std::uint32_t m) const {
    const soft_step::ContactView now = data.contacts(), last = data.last_contacts();
    const soft_step::ManifoldInput& contact = now.manifolds[m];
    const std::uint32_t i = now.sphere_count + m;
    for (std::uint32_t p = 0; p < contact.count; ++p) {
      now.impulses[now.sphere_count + contact.first + p] = {};
    }
    const std::uint32_t before = data.find_last_manifold(contact.key);
    if (before == kNone) {
      now.rolling_impulses[i] = {};
      return soft_step::kNoColor;
    }
    soft_step::match_points(now, m, last, before);
    now.rolling_impulses[i] = last.rolling_impulses[last.sphere_count + before];
    return last.colors[last.sphere_count + before];
  }

  /// Whether the row of two movable bodies is an inner row.
  JFPX_HD bool is_inner(const soft_step::ContactKey& key) const {
    const BodyView& bodies = data.step.bodies;
    return !bodies.has_blocks ||
           soft_step::is_inner(true, bodies.place[key.a], bodies.place[key.b]);
  }

  /// Adds a color of inner or crossing rows to the colors of two bodies.
  JFPX_HD void keep(const soft_step::ContactKey& key, std::uint32_t color) const {
    const bool is_inner = soft_step::is_inner_color(color);
    const std::uint64_t bit = std::uint64_t{1} << soft_step::number_in_class(color);
    atomic_or(&data.used_colors[key.a].of_class(is_inner), bit);
    atomic_or(&data.used_colors[key.b].of_class(is_inner), bit);
  }

  /// Device version of ContactCache::match_joints() and SoftStep::mark_constrained().
  JFPX_HD void match_joint(std::uint32_t joint) const {
    const StepData& d = data;
    const soft_step::JointView joints = d.joints();
    soft_step::KeptJoint now = joints.last[joint];
    if (joints.is_used(joint)) {
      const soft_step::ContactKey key = joints.key(joint);
      const BodyView& bodies = d.step.bodies;
      const bool is_of_world = key.b == soft_step::kWorld;
      d.constrained[key.a] = soft_step::kHasJoint;
      if (!is_of_world) d.constrained[key.b] = soft_step::kHasJoint;
      if (is_of_world || !bodies.movable(key.a) || !bodies.movable(key.b)) {
        now.color = soft_step::kFixedColor;
      } else if (soft_step::keeps_color(now.color, is_inner(key))) {
        keep(key, now.color);
      } else {
        d.uncolored[append(&d.counters->uncolored[0])] = d.contacts().size() + joint;
      }
    }
    joints.now[joint] = now;
  }

  /// Colors in rounds. A contact gets its color when it precedes all uncolored contacts of both
  /// bodies, which yields the colors of the sequential algorithm.
  template <class Team>
  JFPX_HD void color(const Team& team) const {
    const StepData& d = data;
    const soft_step::RowSetup setup = d.row_setup();
    std::uint32_t *list = d.uncolored, *next_list = d.still_uncolored;
    for (std::uint32_t round = 0;; ++round) {
      const std::uint32_t left = load_shared(&d.counters->uncolored[round % 3]);
      if (left == 0) return;
      std::uint32_t* const next_count = &d.counters->uncolored[(round + 1) % 3];
      team.for_each(left, [&](std::uint32_t k) {
        const soft_step::ContactKey key = setup.key(list[k]);
        const std::uint64_t order = soft_step::color_order(key);
        atomic_min(&d.first_order[key.a], order);
        atomic_min(&d.first_order[key.b], order);
      });
      // Contacts with the same color_order() are ordered by index.
      team.for_each(left, [&](std::uint32_t k) {
        const soft_step::ContactKey key = setup.key(list[k]);
        const std::uint64_t order = soft_step::color_order(key);
        if (order == d.first_order[key.a]) atomic_min(&d.first_contact[key.a], list[k]);
        if (order == d.first_order[key.b]) atomic_min(&d.first_contact[key.b], list[k]);
      });
      team.once([&] { d.counters->uncolored[(round + 2) % 3] = 0; });
      team.for_each(left, [&](std::uint32_t k) {
        const std::uint32_t i = list[k];
        const soft_step::ContactKey key = setup.key(i);
        if (d.first_contact[key.a] != i || d.first_contact[key.b] != i) {
          next_list[append(next_count)] = i;
          return;
        }
        setup.set_color(i, soft_step::take_lowest_color(is_inner(key), &d.used_colors[key.a],
                                                        &d.used_colors[key.b]));
      });
      team.for_each(left, [&](std::uint32_t k) {
        const soft_step::ContactKey key = setup.key(list[k]);
        d.first_order[key.a] = d.first_order[key.b] = kNoOrder;
        d.first_contact[key.a] = d.first_contact[key.b] = kNone;
      });
      std::uint32_t* const other = list;
      list = next_list;
      next_list = other;
    }
  }
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
