/// The two loops of the contact resolver.
#include "src/thesis/contact_resolver.hpp"

#include "src/thesis/contact_response.hpp"
#include "src/thesis/free_motion.hpp"

#include <numeric>

namespace jfpx {
inline namespace JFPX_ABI {

ResolverReport ContactResolver::resolve(BodyStore& bodies, std::span<const Contact> contacts,
                                        const ResolverSettings& settings, std::size_t generated) {
  bodies_ = &bodies;
  settings_ = settings;
  prepare(contacts, generated);
  ResolverReport report;
  if (rows_.empty()) return report;
  index_rows_by_body();
  resolve_positions(&report);
  resolve_velocities(&report);
  return report;
}

/// Fills rows_, and keys_ with the penetrations.
void ContactResolver::prepare(std::span<const Contact> contacts, std::size_t generated) {
  const MotionArrays& moving = bodies_->moving;
  const auto asleep = [&moving](const Contact& c) {
    return moving.awake[c.a.index] == 0 && moving.awake[c.b.index] == 0;
  };
  rows_.clear();
  keys_.clear();
  for (const Contact& c : contacts.first(contacts.size() - generated)) {
    if (!asleep(c)) add_row(c, lever_arm(c.a.index, c, -1), lever_arm(c.b.index, c, 1));
  }
  group_patches();
  for (const Contact& c : contacts.last(generated)) {
    if (asleep(c)) continue;
    add_row(c, c.point - moving.position[c.a.index], c.point - moving.position[c.b.index]);
  }
}

/// Appends a row that initially is a separate patch.
void ContactResolver::add_row(const Contact& c, const Vec3& arm_a, const Vec3& arm_b) {
  const MotionArrays& moving = bodies_->moving;
  Vec3 acceleration;
  const std::uint32_t a = c.a.index, b = c.b.index;
  if (moving.awake[a] != 0) acceleration += moving.last_acceleration[a];
  if (moving.awake[b] != 0) acceleration -= moving.last_acceleration[b];
  const auto row = static_cast<RowIndex>(rows_.size());
  rows_.push_back({a, b, c.normal, arm_a, arm_b, dot(acceleration, c.normal) * bodies_->dt(),
                   c.friction, c.restitution, row, row + 1});
  keys_.push_back(-c.distance);
}

/// Sets the range [first, last) of each row to the consecutive rows with the same bodies and
/// normal.
void ContactResolver::group_patches() {
  for (RowIndex first = 0, last = 0; first < rows_.size(); first = last) {
    const Row& head = rows_[first];
    while (last < rows_.size() && rows_[last].a == head.a && rows_[last].b == head.b &&
           rows_[last].normal == head.normal) {
      ++last;
    }
    for (RowIndex i = first; i < last; ++i) rows_[i].first = first, rows_[i].last = last;
  }
}

/// If boxes touch along a face, all corners with key > slack are corrected together. The weight of
/// a corner is key - slack; the amount is the weighted mean of these values, applied at the
/// weighted centre of the corners. If corners were corrected one after the other, each impulse
/// would rotate the box onto the next corner, and a resting box would drift. Velocities are linear
/// in the arm, so the mean is exact at the centre. A corner with a key above the mean remains the
/// worst and has more weight in the next iteration.
/// @param slack part of the key that is not corrected
ContactResolver::Patch ContactResolver::patch_of(RowIndex worst, Real slack) const {
  const Row& row = rows_[worst];
  Patch patch{row, row.arm_a, row.arm_b, queue_.key(worst) - slack};
  if (row.last - row.first == 1) return patch;
  Real sum = 0;
  Vec3 arm_a, arm_b;
  for (RowIndex i = row.first; i < row.last; ++i) {
    const Real weight = queue_.key(i) - slack;
    if (!(weight > 0)) continue;
    sum += weight;
    arm_a += rows_[i].arm_a * weight;
    arm_b += rows_[i].arm_b * weight;
  }
  patch.arm_a = arm_a * (Real(1) / sum);
  patch.arm_b = arm_b * (Real(1) / sum);
  patch.amount = 0;
  for (RowIndex i = row.first; i < row.last; ++i) {
    const Real weight = queue_.key(i) - slack;
    if (!(weight > 0)) continue;
    patch.amount += weight / sum * weight;
    patch.radius += weight / sum * length(rows_[i].arm_a - patch.arm_a);
  }
  return patch;
}

/// The vector from the centre of mass to the contact. For a sphere it is computed from the normal,
/// because the difference of two points far from the origin loses precision (erratum E2).
/// @param side -1 for body a, 1 for body b
Vec3 ContactResolver::lever_arm(std::uint32_t body, const Contact& contact, Real side) const {
  const Real radius = bodies_->radius(body);
  if (radius > 0) return contact.normal * (side * (radius + contact.distance * Real(0.5)));
  return contact.point - bodies_->moving.position[body];
}

/// Counting sort of the rows by movable body; the rows of a body keep their order.
void ContactResolver::index_rows_by_body() {
  first_row_.assign(bodies_->capacity() + 1, 0);
  for (const Row& row : rows_) {
    for (const std::uint32_t body : {row.a, row.b}) {
      if (bodies_->movable(body)) ++first_row_[body];
    }
  }
  std::partial_sum(first_row_.begin(), first_row_.end(), first_row_.begin());
  body_rows_.resize(first_row_.back());
  // Each entry is now the end of its body's range; filling from the back makes it the start.
  for (auto i = static_cast<RowIndex>(rows_.size()); i-- > 0;) {
    for (const std::uint32_t body : {rows_[i].a, rows_[i].b}) {
      if (bodies_->movable(body)) body_rows_[--first_row_[body]] = i;
    }
  }
}

std::span<const std::uint32_t> ContactResolver::rows_of(std::uint32_t body) const {
  return std::span(body_rows_).subspan(first_row_[body], first_row_[body + 1] - first_row_[body]);
}

/// Maximum number of iterations of each loop.
std::uint64_t ContactResolver::limit() const {
  return settings_.max_iterations != 0 ? settings_.max_iterations
                                       : std::uint64_t{8} * bodies_->movable_count();
}

void ContactResolver::resolve_positions(ResolverReport* report) {
  // Penetrations are reduced to slightly less than position_epsilon. If they were reduced to zero,
  // a body at rest would repeatedly sink and be lifted by position_epsilon. If they were reduced to
  // position_epsilon itself, rounding errors and neighboring contacts would exceed it again
  // immediately.
  const Real slack = settings_.position_epsilon * Real(15.0 / 16.0);
  queue_.assign(keys_);
  for (std::uint64_t left = limit();; --left) {
    const RowIndex worst = queue_.top();
    const Real depth = queue_.key(worst);
    if (!(depth > settings_.position_epsilon)) return;
    if (left == 0) break;
    project(patch_of(worst, slack));
    ++report->position_iterations;
  }
  report->exhausted = true;
}

/// Moves the bodies apart by the amount of the patch, each in proportion to its inverse effective
/// mass (erratum E6a).
void ContactResolver::project(const Patch& patch) {
  const MotionArrays& moving = bodies_->moving;
  const Row& row = patch.row;
  const auto inverse_effective_mass = [&](std::uint32_t body, const Vec3& arm) {
    return bodies_->inverse_mass(body) +
           detail::angular_inverse_effective_mass(row.normal, arm, moving.inverse_inertia[body]);
  };
  const Real total_inverse_effective_mass =
      inverse_effective_mass(row.a, patch.arm_a) + inverse_effective_mass(row.b, patch.arm_b);
  const auto share = [&](std::uint32_t body, const Vec3& arm, Real signed_depth) {
    return detail::projection(row.normal, arm, bodies_->inverse_mass(body),
                              moving.inverse_inertia[body], signed_depth,
                              total_inverse_effective_mass, settings_.angular_limit);
  };
  const detail::Displacement of_a = share(row.a, patch.arm_a, patch.amount);
  const detail::Displacement of_b = share(row.b, patch.arm_b, -patch.amount);
  displace(row.a, of_a);
  displace(row.b, of_b);
}

/// Moves a body and updates the depths of its contacts to first order, without new detection
/// (Millington 2007, 14.4). A displacement along the normal reduces the depth if the body is a, and
/// increases it if the body is b (erratum E10).
void ContactResolver::displace(std::uint32_t body, const detail::Displacement& displacement) {
  if (!bodies_->movable(body)) return;
  thesis::displace(bodies_, body, displacement.translation, displacement.rotation);
  for (const RowIndex i : rows_of(body)) {
    const Row& row = rows_[i];
    const bool is_a = row.a == body;
    const Vec3 moved = detail::point_velocity(displacement.translation, displacement.rotation,
                                              is_a ? row.arm_a : row.arm_b);
    const Real opened = dot(moved, row.normal);
    queue_.update(i, queue_.key(i) + opened * (is_a ? Real(-1) : Real(1)));
  }
}

void ContactResolver::resolve_velocities(ResolverReport* report) {
  for (RowIndex i = 0; i < rows_.size(); ++i) keys_[i] = target_delta_velocity(rows_[i]);
  queue_.assign(keys_);
  for (std::uint64_t left = limit();; --left) {
    const RowIndex worst = queue_.top();
    if (!(queue_.key(worst) > settings_.velocity_epsilon)) return;
    if (left == 0) break;
    const Patch patch = patch_of(worst, 0);
    apply_impulse(patch);
    for (const std::uint32_t body : {patch.row.a, patch.row.b}) {
      if (!bodies_->movable(body)) continue;
      for (const RowIndex i : rows_of(body)) queue_.update(i, target_delta_velocity(rows_[i]));
    }
    ++report->velocity_iterations;
  }
  report->exhausted = true;
}

inline Vec3 ContactResolver::relative_velocity(const Row& row, const Vec3& arm_a,
                                               const Vec3& arm_b) const {
  const MotionArrays& moving = bodies_->moving;
  return detail::point_velocity(moving.velocity[row.a], moving.angular_velocity[row.a], arm_a) -
         detail::point_velocity(moving.velocity[row.b], moving.angular_velocity[row.b], arm_b);
}

Real ContactResolver::target_delta_velocity(const Row& row) const {
  return detail::target_delta_velocity(
      dot(row.normal, relative_velocity(row, row.arm_a, row.arm_b)), row.from_acceleration,
      row.restitution, settings_.restitution_velocity);
}

/// Applies equal and opposite impulses to both bodies at one common point, which conserves momentum
/// and angular momentum (errata E2, E3, E5).
void ContactResolver::apply_impulse(const Patch& patch) {
  const Row& row = patch.row;
  const MotionArrays& moving = bodies_->moving;
  const detail::ContactBasis basis = detail::contact_basis(row.normal);
  Mat3 response = diagonal({0, 0, 0});
  Vec3 velocity = relative_velocity(row, patch.arm_a, patch.arm_b);
  for (const bool is_a : {true, false}) {
    const std::uint32_t body = is_a ? row.a : row.b;
    if (!bodies_->movable(body)) continue;
    detail::add_response(basis, is_a ? patch.arm_a : patch.arm_b, bodies_->inverse_mass(body),
                         moving.inverse_inertia[body], &response);
    // Friction also cancels the tangential velocity that the same acceleration will add in the next
    // step; otherwise a body held by friction would creep downhill (Millington 2007, 15.2).
    const Vec3 coming = moving.last_acceleration[body] * (is_a ? bodies_->dt() : -bodies_->dt());
    velocity += coming;
  }
  const Vec3 local_velocity = detail::to_contact(basis, velocity);
  const FrictionShares shares = share_friction(patch, local_velocity);
  const Vec3 local = detail::contact_impulse(response, local_velocity, patch.amount,
                                             row.friction * shares.sliding);
  const Vec3 impulse = detail::to_world(basis, local);
  add_impulse(row.a, patch.arm_a, impulse);
  add_impulse(row.b, patch.arm_b, -impulse);
  if (patch.radius > 0)
    apply_spin_friction(row, row.friction * shares.spinning * local.x * patch.radius);
}

/// Sliding and spinning share the friction of a patch: friction opposes the velocity of the contact
/// points, whose sliding and spinning components are perpendicular on average.
/// @param velocity of the patch, in contact axes
ContactResolver::FrictionShares ContactResolver::share_friction(const Patch& patch,
                                                                const Vec3& velocity) const {
  if (!(patch.radius > 0)) return {1, 0};
  const Real slide = square_root(velocity.y * velocity.y + velocity.z * velocity.z);
  const Real spin_speed = absolute(spin(patch.row)) * patch.radius;
  const Real both = square_root(slide * slide + spin_speed * spin_speed);
  return both > 0 ? FrictionShares{slide / both, spin_speed / both} : FrictionShares{1, 0};
}

/// [rad/s], relative angular velocity about the normal.
Real ContactResolver::spin(const Row& row) const {
  const MotionArrays& moving = bodies_->moving;
  return dot(row.normal, moving.angular_velocity[row.a] - moving.angular_velocity[row.b]);
}

/// Friction against spinning about the normal, which an impulse at the centre of the patch does not
/// affect.
/// @param limit largest angular impulse of the friction
void ContactResolver::apply_spin_friction(const Row& row, Real limit) {
  MotionArrays& moving = bodies_->moving;
  const Vec3 response_a = moving.inverse_inertia[row.a] * row.normal;
  const Vec3 response_b = moving.inverse_inertia[row.b] * row.normal;
  const Real inverse_effective_mass = dot(row.normal, response_a + response_b);
  if (!(inverse_effective_mass > 0)) return;
  const Real stop = -spin(row) / inverse_effective_mass;
  const Real impulse = stop > limit ? limit : stop < -limit ? -limit : stop;
  moving.angular_velocity[row.a] += response_a * impulse;
  moving.angular_velocity[row.b] -= response_b * impulse;
}

void ContactResolver::add_impulse(std::uint32_t body, const Vec3& arm, const Vec3& impulse) {
  if (!bodies_->movable(body)) return;
  MotionArrays& moving = bodies_->moving;
  moving.velocity[body] += impulse * bodies_->inverse_mass(body);
  moving.angular_velocity[body] += moving.inverse_inertia[body] * cross(arm, impulse);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
