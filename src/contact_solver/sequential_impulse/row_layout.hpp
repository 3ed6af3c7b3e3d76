/// Memory layout of the rows of the impulse solver and of their inputs.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace rows {

/// Rows are stored in blocks of as many rows as a vector has lanes. A block is a list of fields,
/// and a field has one number per lane. No two rows of a block share a moving body.
enum RowField : int {
  kRowAxis = 0,              ///< 3 fields: the normal, or the friction direction
  kRowAngularJacobianA = 3,  ///< 3 fields: arm x axis of body a; 0 for a fixed body
  kRowAngularJacobianB = 6,  ///< 3 fields: arm x -axis of body b
  kRowAngularA = 9,          ///< 3 fields: angular velocity that a unit impulse adds to body a
  kRowAngularB = 12,         ///< 3 fields
  kRowInverse = 15,          ///< impulse that changes the velocity along the axis by 1
  kRowRhs = 16,              ///< target impulse at the start
  kRowImpulse = 17,          ///< accumulated impulse
  kRowFriction = 18,         ///< friction row: the coefficient
  kFrictionFields = 19,
  kRowCfm = 18,  ///< contact row: constraint force mixing (softness)
  kRowSplitRhs = 19,
  kRowSplitImpulse = 20,  ///< accumulated split impulse, which corrects penetration
  kContactFields = 21,
};

/// A rolling or spinning friction row, which has no linear part.
enum RollingField : int {
  kRollingPresent = 0,   ///< 1 if the contact has this row, else 0
  kRollingAxis = 1,      ///< 3 fields: the axis for body b; that for body a is opposite
  kRollingAngularA = 4,  ///< 3 fields: angular velocity that a unit impulse adds to body a
  kRollingAngularB = 7,  ///< 3 fields
  kRollingInverse = 10,
  kRollingRhs = 11,
  kRollingImpulse = 12,
  kRollingStrength = 13,  ///< coefficient, and limit of the impulse
  kRollingFields = 14,
};

/// A contact point of a manifold, in the layout of rows.
enum InputField : int {
  kInNormal = 0,
  kInPointA = 3,
  kInPointB = 6,
  kInDistance = 9,
  kInFriction = 10,
  kInRestitution = 11,
  kInImpulse = 12,
  kInCfm = 13,
  kInErp = 14,
  kInAnchor = 15,  ///< 1 if the contact has a friction anchor, else 0
  kInputFields = 16,
};

/// Body id. The complement ~id addresses a body that no row moves. Id 0 is Bullet's single fixed
/// body, which is at rest; all its fields are 0.
inline constexpr std::int32_t kFixedBody = ~0;
inline constexpr int kBodyFields = 32;  ///< see gather_body()
/// Delta linear velocity, inverse mass; delta angular velocity, unused.
inline constexpr int kVelocityFields = 8;
/// Inverse masses, linear factors, angular factors; each padded to 4.
inline constexpr int kFactorFields = 12;

/// The bodies of a contact.
struct RowPair {
  std::int32_t a, b;
};

/// Settings of a step that apply to all of its rows.
struct RowSettings {
  Real dt, inverse_dt;
  Real relaxation;
  Real restitution_threshold;
  Real slop;
  Real split_threshold;
  Real friction_erp;
  Real warm_factor;
  Real epsilon;
  bool split;
  bool warm_start;
  bool friction_follows_velocity;
};

/// Rolling and spinning friction rows per contact: one around the normal (spinning), and two around
/// tangential axes (rolling).
inline constexpr std::uint32_t kRollingRows = 3;
/// Upper limit of the lanes of a block, for all instruction sets.
inline constexpr std::uint32_t kMaxLanes = 8;

/// Result of the sweeps over a group of rows.
struct RowSweepReport {
  int iterations = 0;                ///< completed sweeps
  Real residual = 0;                 ///< largest squared residual of the last sweep
  std::uint64_t split_impulses = 0;  ///< solved rows of the split impulse, over all sweeps
  bool broken = false;               ///< a value is infinite or NaN: the result is invalid
};

}  // namespace rows
}  // namespace JFPX_ABI
}  // namespace jfpx
