/// How the rows of the impulse solver, and what they are made from, lie in memory.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace rows {

/// Rows lie in blocks of so many as a vector has lanes. A block is a list of fields; each field is
/// one number a lane. No two rows of a block share a body that moves.
enum RowField : int {
  kRowAxis = 0,       ///< three: the normal, or the direction of friction
  kRowTurnA = 3,      ///< three: arm x axis of body a; 0 for a fixed body
  kRowTurnB = 6,      ///< three: arm x -axis of body b
  kRowAngularA = 9,   ///< three: angular velocity gained by a from an impulse of 1
  kRowAngularB = 12,  ///< three
  kRowInverse = 15,   ///< impulse needed for a velocity of 1 along the axis
  kRowRhs = 16,       ///< impulse asked for at the start
  kRowImpulse = 17,   ///< impulse given so far
  kRowFriction = 18,  ///< of a friction row: the coefficient
  kFrictionFields = 19,
  // A row against rolling or spinning is laid out like a friction row, but for its axis:
  kRowPresent = 0,  ///< 1 where the contact has such a row, else 0
  kRowCfm = 18,     ///< of a contact row: softness
  kRowPushRhs = 19,
  kRowPush = 20,  ///< impulse of the push against penetration so far
  kContactFields = 21,
};

/// A contact as a manifold tells it, laid out as rows are.
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
  kInAnchor = 15,  ///< 1 where the contact is anchored, else 0
  kInputFields = 16,
};

/// A body is addressed by its id; those that no row moves have the complement ~id in its place.
/// Id 0 is Bullet's one fixed body, at rest and all 0.
inline constexpr std::int32_t kFixedBody = ~0;
inline constexpr int kBodyFields = 32;     ///< see gather_body()
inline constexpr int kVelocityFields = 8;  ///< linear gained, inverse mass; angular gained, unused
inline constexpr int kFactorFields = 12;   ///< inverse masses; linear; angular factors; each padded

/// The bodies of a contact.
struct RowPair {
  std::int32_t a, b;
};

/// What a step says about all of its rows.
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

/// Rows against rolling and spinning of a contact: around the normal, and around two axes across
/// it.
inline constexpr std::uint32_t kRollingFrictionRows = 3;
/// Lanes of a block, whatever the instruction set.
inline constexpr std::uint32_t kMaxLanes = 8;

/// What became of a group of rows.
struct RowSweepReport {
  int iterations = 0;        ///< sweeps done
  Real residual = 0;         ///< the largest squared one of the last sweep
  std::uint64_t pushed = 0;  ///< rows solved against penetration, over all sweeps
  bool broken = false;       ///< something left the finite numbers: the result is worth nothing
};

}  // namespace rows
}  // namespace JFPX_ABI
}  // namespace jfpx
