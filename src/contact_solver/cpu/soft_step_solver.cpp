/// Rows and sweeps of the soft step on the CPU; see the header.
#include "src/contact_solver/cpu/soft_step_solver.hpp"

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"
#include "src/contact_solver/contact_basis.hpp"

#include <algorithm>
#include <tuple>
#include <type_traits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {
namespace {

constexpr std::size_t kRowsPerChunk = 128, kContactsPerChunk = 4096;

}  // namespace

/// A sphere whose inertia is the same about every axis.
bool SoftStepSolver::is_round(std::uint32_t body) const { return start_[body].inverse_inertia > 0; }

/// Whether body b of a contact becomes body a of its row, which must be movable.
bool SoftStepSolver::is_flipped(const ContactKey& key) const {
  return !(start_[key.a].inverse_mass > 0);
}

SoftStepSolver::Kind SoftStepSolver::kind_of(std::uint32_t contact) const {
  const ContactKey& key = contacts_->key(contact);
  const auto is_movable = [this](std::uint32_t body) { return start_[body].inverse_mass > 0; };
  const auto is_active = [&](std::uint32_t body) {
    return is_movable(body) && properties_.awake[body] != 0;
  };
  // A body that is still asleep is near, but does not touch: the contact has no effect.
  const bool a_rests = is_movable(key.a) && !is_active(key.a);
  const bool b_rests = is_movable(key.b) && !is_active(key.b);
  if (a_rests || b_rests || (!is_active(key.a) && !is_active(key.b))) return Kind::asleep;
  // The arms of a generated contact are not multiples of the normal.
  if (contacts_->impulse_count(contact) != 1 || key.is_generated()) return Kind::manifold_row;
  const auto rolls = [this](std::uint32_t body) {
    return properties_.rolling_friction[body] > 0 || properties_.spinning_friction[body] > 0;
  };
  if (rolls(key.a) || rolls(key.b)) return Kind::manifold_row;
  // A kinematic body in motion has awake != 0.
  const auto fits = [&](std::uint32_t body) {
    return is_movable(body) ? is_round(body) : properties_.awake[body] == 0;
  };
  return fits(key.a) && fits(key.b) ? Kind::sphere_row : Kind::manifold_row;
}

std::size_t SoftStepSolver::group_of(std::uint32_t contact) const {
  const std::uint8_t color = contacts_->colors[contact];
  if (color == kFixedColor) return kFixedGroup;
  return color == kOverflowColor ? 0 : std::size_t{1} + color;
}

/// Counting sort of the contacts into rows by kind and group. Rows of a group are in the order of
/// contacts, those with fixed bodies in the order of bodies.
void SoftStepSolver::sort_contacts() {
  count_contacts();
  std::array<std::uint32_t, kGroups> spheres{}, manifolds{};
  std::uint32_t fixed = 0;
  for (Counts& chunk : counts_) {
    for (std::size_t g = 0; g < kGroups; ++g) {
      spheres[g] += std::exchange(chunk.spheres[g], spheres[g]);
      manifolds[g] += std::exchange(chunk.manifolds[g], manifolds[g]);
    }
    fixed += std::exchange(chunk.fixed, fixed);
  }
  const auto start = [](auto* kind_rows, const auto& counts) {
    kind_rows->begin[0] = 0;
    for (std::size_t g = 0; g < kGroups; ++g) {
      kind_rows->begin[g + 1] = kind_rows->begin[g] + counts[g];
    }
    resize_geometric(&kind_rows->rows, kind_rows->begin[kGroups]);
    resize_geometric(&kind_rows->contacts, kind_rows->begin[kGroups]);
  };
  start(&spheres_, spheres);
  start(&manifolds_, manifolds);
  resize_geometric(&fixed_, fixed);
  parallel_for(pool_, contacts_->size(), kContactsPerChunk,
               [&](std::size_t first, std::size_t last) {
                 place_contacts(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last),
                                counts_[first / kContactsPerChunk]);
               });
  place_fixed_contacts();
  std::uint32_t points = 0;
  for (std::size_t i = 0; i < manifolds_.rows.size(); ++i) {
    manifolds_.rows[i].first = points;
    points += contacts_->impulse_count(manifolds_.contacts[i]);
  }
  resize_geometric(&points_, points);
}

/// Fills kinds_, and counts_ by chunk of contacts.
void SoftStepSolver::count_contacts() {
  const std::uint32_t count = contacts_->size();
  resize_geometric(&kinds_, count);
  resize_geometric(&counts_, (count + kContactsPerChunk - 1) / kContactsPerChunk);
  parallel_for(pool_, count, kContactsPerChunk, [this](std::size_t first, std::size_t last) {
    Counts& counts = counts_[first / kContactsPerChunk];
    counts = {};
    for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
      kinds_[i] = kind_of(i);
      if (kinds_[i] == Kind::asleep) continue;
      const std::size_t group = group_of(i);
      ++(kinds_[i] == Kind::sphere_row ? counts.spheres : counts.manifolds)[group];
      if (group == kFixedGroup) ++counts.fixed;
    }
  });
}

/// Assigns rows to the contacts of a chunk. @param before number of rows in the chunks before
void SoftStepSolver::place_contacts(std::uint32_t first, std::uint32_t last, Counts before) {
  for (std::uint32_t i = first; i < last; ++i) {
    if (kinds_[i] == Kind::asleep) continue;
    const std::size_t group = group_of(i);
    const bool is_sphere_row = kinds_[i] == Kind::sphere_row;
    if (group == kFixedGroup) {
      const ContactKey& key = contacts_->key(i);
      fixed_[before.fixed++] = {is_flipped(key) ? key.b : key.a, i, 0, is_sphere_row};
    } else if (is_sphere_row) {
      spheres_.contacts[spheres_.begin[group] + before.spheres[group]++] = i;
    } else {
      manifolds_.contacts[manifolds_.begin[group] + before.manifolds[group]++] = i;
    }
  }
}

/// Sorts the contacts with fixed bodies by movable body, and assigns their rows.
void SoftStepSolver::place_fixed_contacts() {
  const auto order = [](const FixedContact& x, const FixedContact& y) {
    return std::tie(x.body, x.contact) < std::tie(y.body, y.contact);
  };
  if (!std::ranges::is_sorted(fixed_, order)) std::ranges::sort(fixed_, order);
  std::uint32_t sphere = spheres_.begin[kFixedGroup], manifold = manifolds_.begin[kFixedGroup];
  for (FixedContact& fixed : fixed_) {
    fixed.row = fixed.is_sphere_row ? sphere++ : manifold++;
    (fixed.is_sphere_row ? spheres_.contacts : manifolds_.contacts)[fixed.row] = fixed.contact;
  }
}

/// Speed of separation after an impact, or 0. The speed of the impact is that at the start of the
/// step and what the bodies gain on the way, because impulses end the motion in the middle of a
/// step.
/// @param velocity of a's point relative to b's, at the start of the step
Real SoftStepSolver::rebound_speed(const Vec3& velocity, const Vec3& normal, Real distance,
                                   std::uint32_t a, std::uint32_t b, Real restitution) const {
  if (!(restitution > 0)) return 0;
  const Real closing = -dot(velocity, normal);
  if (!(closing > 0)) return 0;
  const auto acceleration = [this](std::uint32_t body) {
    return start_[body].inverse_mass > 0 ? properties_.acceleration[body] : Vec3{};
  };
  const Real gap = distance > 0 ? distance : Real(0);
  const Real gained = -2 * gap * dot(acceleration(a) - acceleration(b), normal);
  const Real square = closing * closing + gained;
  const Real speed = square > 0 ? square_root(square) : Real(0);
  return speed > properties_.restitution_threshold ? restitution * speed : Real(0);
}

template <bool kFixed>
void SoftStepSolver::fill(SphereRow* row, std::uint32_t contact) const {
  const ContactKey& key = contacts_->key(contact);
  const bool flipped = is_flipped(key);
  const Real distance = contacts_->distance(contact, 0);
  const Vec3& normal = contacts_->normal(contact);
  const KeptImpulse& kept = contacts_->impulses[contacts_->first_impulse(contact)];
  row->a = flipped ? key.b : key.a;
  row->b = flipped ? key.a : key.b;
  row->normal = flipped ? -normal : normal;
  row->distance = distance;
  // Penetrating spheres share the middle of the overlap, so that angular momentum is conserved.
  const Real half_overlap = distance < 0 ? distance * Real(0.5) : Real(0);
  row->arm_a = properties_.radius[row->a] + half_overlap;
  row->arm_b = kFixed ? Real(0) : properties_.radius[row->b] + half_overlap;
  row->friction = combined(properties_.rules.friction, properties_.friction[row->a],
                           properties_.friction[row->b]);
  row->friction_impulse = flipped ? -kept.friction : kept.friction;
  row->normal_impulse = kept.normal;
  row->peak_impulse = 0;
  const SolverBody &a = start_[row->a], &b = start_[row->b];
  set_masses<kFixed>(row, a, b);
  const Real restitution = combined(properties_.rules.restitution, properties_.restitution[row->a],
                                    properties_.restitution[row->b]);
  row->rebound = rebound_speed(relative_velocity<kFixed>(*row, a, b), row->normal, distance, row->a,
                               row->b, restitution);
}

template <bool kFixed>
void SoftStepSolver::fill(ManifoldRow* row, std::uint32_t contact) {
  const ContactKey& key = contacts_->key(contact);
  const bool flipped = is_flipped(key);
  const Vec3& normal = contacts_->normal(contact);
  row->a = flipped ? key.b : key.a;
  row->b = flipped ? key.a : key.b;
  row->count = contacts_->impulse_count(contact);
  const detail::ContactBasis basis = detail::contact_basis(flipped ? -normal : normal);
  row->normal = basis.normal;
  row->tangent = basis.tangent;
  row->bitangent = basis.bitangent;
  const Vec3& rolling = contacts_->rolling_impulses[contact];
  row->rolling_impulse = flipped ? -rolling : rolling;
  Real restitution = 0;
  if (key.is_generated()) {
    row->friction = contacts_->manifold(contact).friction;
    row->rolling_friction = row->spinning_friction = 0;
    restitution = contacts_->manifold(contact).restitution;
  } else {
    row->friction = combined(properties_.rules.friction, properties_.friction[row->a],
                             properties_.friction[row->b]);
    row->rolling_friction =
        std::max(properties_.rolling_friction[row->a], properties_.rolling_friction[row->b]);
    row->spinning_friction =
        std::max(properties_.spinning_friction[row->a], properties_.spinning_friction[row->b]);
    restitution = combined(properties_.rules.restitution, properties_.restitution[row->a],
                           properties_.restitution[row->b]);
  }
  const SolverBody &start_a = start_[row->a], &start_b = start_[row->b];
  for (std::uint32_t i = 0; i < row->count; ++i) {
    PointRow& p = points_[row->first + i];
    p.distance = contacts_->distance(contact, i);
    if (contacts_->is_sphere(contact)) {
      const Real half_overlap = p.distance < 0 ? p.distance * Real(0.5) : Real(0);
      p.arm_a = -row->normal * (properties_.radius[row->a] + half_overlap);
      p.arm_b = row->normal * (properties_.radius[row->b] + half_overlap);
    } else {
      const PointInput& point = contacts_->points[contacts_->manifold(contact).first + i];
      p.arm_a = flipped ? point.arm_b : point.arm_a;
      p.arm_b = flipped ? point.arm_a : point.arm_b;
    }
    const KeptImpulse& kept = contacts_->impulses[contacts_->first_impulse(contact) + i];
    const Vec3 friction = flipped ? -kept.friction : kept.friction;
    p.normal_impulse = kept.normal;
    p.friction_x = dot(friction, row->tangent);
    p.friction_y = dot(friction, row->bitangent);
    p.peak_impulse = 0;
    SolverBody a = start_a, b = start_b;
    const BodyPair pair{&a, &b, &properties_.inverse_inertia[row->a],
                        &properties_.inverse_inertia[row->b]};
    set_masses<kFixed>(*row, &p, pair);
    p.rebound = rebound_speed(relative_velocity(pair, p.arm_a, p.arm_b), row->normal, p.distance,
                              row->a, row->b, restitution);
  }
}

void SoftStepSolver::build(const ContactSet& contacts, const BodyProperties& properties,
                           const StepConstants& constants, std::span<const SolverBody> bodies) {
  contacts_ = &contacts;
  properties_ = properties;
  constants_ = constants;
  start_ = bodies;
  sort_contacts();
  const auto fill_all = [this](auto* kind_rows) {
    const std::uint32_t first_fixed = kind_rows->begin[kFixedGroup];
    parallel_for(pool_, kind_rows->rows.size(), kRowsPerChunk,
                 [&](std::size_t first, std::size_t last) {
                   for (std::size_t i = first; i < last; ++i) {
                     const std::uint32_t contact = kind_rows->contacts[i];
                     i < first_fixed ? fill<false>(&kind_rows->rows[i], contact)
                                     : fill<true>(&kind_rows->rows[i], contact);
                   }
                 });
  };
  fill_all(&spheres_);
  fill_all(&manifolds_);
}

BodyPair SoftStepSolver::pair_of(const ManifoldRow& row, std::span<SolverBody> bodies) const {
  return {&bodies[row.a], &bodies[row.b], &properties_.inverse_inertia[row.a],
          &properties_.inverse_inertia[row.b]};
}

/// Calls operation(row, is_fixed) for all rows, in the order of the solver.
template <class Operation>
void SoftStepSolver::sweep(const Operation& operation) {
  const auto run = [&](auto* kind_rows, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) operation(&kind_rows->rows[i], std::false_type());
  };
  run(&spheres_, 0, spheres_.begin[1]);
  run(&manifolds_, 0, manifolds_.begin[1]);
  for (std::size_t group = 1; group < kFixedGroup; ++group) {
    // One loop over the rows of both kinds: the end of a loop costs as much as dozens of rows.
    const std::size_t sphere = spheres_.begin[group], manifold = manifolds_.begin[group];
    const std::size_t spheres = spheres_.begin[group + 1] - sphere;
    const std::size_t manifolds = manifolds_.begin[group + 1] - manifold;
    parallel_for(
        pool_, spheres + manifolds, kRowsPerChunk, [&](std::size_t first, std::size_t last) {
          run(&spheres_, sphere + std::min(first, spheres), sphere + std::min(last, spheres));
          run(&manifolds_, manifold + std::max(first, spheres) - spheres,
              manifold + std::max(last, spheres) - spheres);
        });
  }
  parallel_for(pool_, fixed_.size(), kRowsPerChunk, [&](std::size_t first, std::size_t last) {
    // A chunk begins and ends at the first contact of a body.
    const auto is_inside = [this](std::size_t i) {
      return i > 0 && i < fixed_.size() && fixed_[i].body == fixed_[i - 1].body;
    };
    while (is_inside(first)) ++first;
    while (is_inside(last)) ++last;
    for (std::size_t i = first; i < last; ++i) {
      const FixedContact& fixed = fixed_[i];
      if (fixed.is_sphere_row) {
        operation(&spheres_.rows[fixed.row], std::true_type());
      } else {
        operation(&manifolds_.rows[fixed.row], std::true_type());
      }
    }
  });
}

void SoftStepSolver::warm_start(std::span<SolverBody> bodies) {
  sweep([&]<class Row, bool kFixed>(Row* row, std::bool_constant<kFixed>) {
    if constexpr (std::is_same_v<Row, SphereRow>) {
      soft_step::warm_start<kFixed>(*row, &bodies[row->a], &bodies[row->b]);
    } else {
      soft_step::warm_start<kFixed>(*row, &points_[row->first], pair_of(*row, bodies));
    }
  });
}

void SoftStepSolver::solve(std::span<SolverBody> bodies, bool soft) {
  sweep([&]<class Row, bool kFixed>(Row* row, std::bool_constant<kFixed>) {
    if constexpr (std::is_same_v<Row, SphereRow>) {
      soft_step::solve<kFixed>(row, &bodies[row->a], &bodies[row->b], constants_, soft);
    } else {
      soft_step::solve<kFixed>(row, &points_[row->first], pair_of(*row, bodies), constants_, soft);
    }
  });
}

void SoftStepSolver::restitute(std::span<SolverBody> bodies) {
  sweep([&]<class Row, bool kFixed>(Row* row, std::bool_constant<kFixed>) {
    if constexpr (std::is_same_v<Row, SphereRow>) {
      soft_step::restitute<kFixed>(*row, &bodies[row->a], &bodies[row->b]);
    } else {
      soft_step::restitute<kFixed>(*row, &points_[row->first], pair_of(*row, bodies));
    }
  });
}

void SoftStepSolver::store(ContactSet* contacts) {
  const auto sign = [&](std::uint32_t contact, std::uint32_t a) {
    return contacts->key(contact).a == a ? Real(1) : Real(-1);
  };
  parallel_for(pool_, spheres_.rows.size(), 4096, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const SphereRow& row = spheres_.rows[i];
      const std::uint32_t contact = spheres_.contacts[i];
      contacts->impulses[contacts->first_impulse(contact)] = {
          row.friction_impulse * sign(contact, row.a), row.normal_impulse};
    }
  });
  parallel_for(pool_, manifolds_.rows.size(), 1024, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const ManifoldRow& row = manifolds_.rows[i];
      const std::uint32_t contact = manifolds_.contacts[i];
      const Real side = sign(contact, row.a);
      contacts->rolling_impulses[contact] = row.rolling_impulse * side;
      for (std::uint32_t p = 0; p < row.count; ++p) {
        const PointRow& point = points_[row.first + p];
        const Vec3 friction = row.tangent * point.friction_x + row.bitangent * point.friction_y;
        contacts->impulses[contacts->first_impulse(contact) + p] = {friction * side,
                                                                    point.normal_impulse};
      }
    }
  });
  contacts_ = nullptr;
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
