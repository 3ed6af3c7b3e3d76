/// Scenes: bodies and settings as a plain value for all engines, and their JSON form.
#pragma once

#include <jfpx/body.hpp>
#include <jfpx/build.hpp>
#include <jfpx/joint.hpp>
#include <jfpx/material.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Algorithm that resolves the contacts of a native world.
enum class Solver : std::uint8_t {
  soft_step,    ///< substeps over soft contacts with warm starting: stacks and heaps come to rest
  worst_first,  ///< of the thesis (4.4.6), after thesis::enable(): corrects the worst contact first
};
/// Name in the JSON of a scene; null for a value outside the enumeration.
constexpr const char* to_string(Solver solver) {
  switch (solver) {
    case Solver::soft_step:
      return "soft_step";
    case Solver::worst_first:
      return "worst_first";
  }
  return nullptr;
}

inline constexpr std::uint32_t kMaxSubsteps = 64;

/// Settings of Solver::soft_step.
struct SoftStepSettings {
  /// Number of substeps per step, in [1, kMaxSubsteps]. More substeps make contacts stiffer.
  std::uint32_t substeps = 4;
  /// [Hz], >= 0, frequency of the contact springs between movable bodies; doubled against immovable
  /// and kinematic bodies. Limited to a quarter of the substep rate, which 0 selects, and in
  /// contacts of bodies with joints to an eighth, except between two movable spheres without
  /// rolling friction.
  Real contact_hertz = 0;
  /// [-], in [0.01, 1000], of the contact springs. Between two movable spheres without rolling
  /// friction, multiplied by 6, or by 2 if they penetrate by more than 3 % of the smaller radius.
  Real damping_ratio = 1;
  /// [m/s], > 0: maximum speed that removes a penetration. In contacts of bodies with joints, a
  /// sixth of it, except between two movable spheres without rolling friction.
  Real push_out_speed = 3;
  Real restitution_threshold = Real(0.25);  ///< [m/s], >= 0: slower contacts do not bounce
  /// [m], >= 0. Closer pairs have speculative contacts in the solver before they touch. For small
  /// bodies, the margin is 8 % of the smaller radius or half extent.
  Real speculative_margin = Real(0.02);
  friend bool operator==(const SoftStepSettings&, const SoftStepSettings&) = default;
};

/// Settings of Solver::worst_first (thesis 4.4.6).
struct ResolverSettings {
  /// Maximum number of contacts corrected per step, in each of the two loops; 0: 8 per movable
  /// body, as in the thesis.
  std::uint32_t max_iterations = 0;
  Real velocity_epsilon = Real(0.01);      ///< [m/s], > 0: smaller velocity errors are ignored
  Real position_epsilon = Real(0.01);      ///< [m], > 0: deeper penetrations are reduced below it
  Real restitution_velocity = Real(0.25);  ///< [m/s], >= 0: slower contacts do not bounce
  Real angular_limit = Real(0.2);          ///< [rad], in (0, 1]: maximum rotation by one projection
  friend bool operator==(const ResolverSettings&, const ResolverSettings&) = default;
};

/// Settings of the native sleep tests. Solver::soft_step puts an island of touching bodies to sleep
/// when all its bodies have been slower than `speed` for `time`. Solver::worst_first tests the mean
/// motion of each body (thesis 4.4.2).
struct SleepSettings {
  bool enabled = true;
  /// [m/s], >= 0; soft_step. Limit of the displacement in a step divided by its length, and of the
  /// rotation times the bounding radius. For spheres, 4 % of the latter count, because nothing
  /// brakes a sphere that spins in place. The limit is divided by 25 for a body on which a force or
  /// torque acts.
  Real speed = Real(0.05);
  Real time = Real(0.5);     ///< [s], >= 0; soft_step
  Real epsilon = Real(0.3);  ///< [m^2/s^2], > 0: threshold of the mean motion; worst_first
  Real bias = Real(0.05);    ///< [-], in (0, 1]: weight of the mean after one second; worst_first
  friend bool operator==(const SleepSettings&, const SleepSettings&) = default;
};

/// Two different bodies of a scene, by their indices in Scene::bodies.
struct BodyPair {
  std::uint32_t a = 0, b = 0;
  friend bool operator==(const BodyPair&, const BodyPair&) = default;
};

/// Bodies and the settings of their simulation.
struct Scene {
  std::string name = "unnamed";
  Real dt = Real(1) / Real(60);  ///< [s], > 0: length of a step
  std::vector<BodyDef> bodies;
  Solver solver = Solver::soft_step;
  SoftStepSettings soft_step;
  ResolverSettings resolver;
  SleepSettings sleep;
  MaterialSettings materials;
  /// Pairs of bodies that do not collide, whatever their filters. The order of the pairs, and of
  /// the bodies of a pair, has no effect. Duplicates are allowed.
  std::vector<BodyPair> ignored_pairs;
  /// Joints; BodyId::index is an index into `bodies`. Solver::soft_step only.
  std::vector<Joint> joints;
  friend bool operator==(const Scene&, const Scene&) = default;
};

/// Version of the JSON schema that to_json() writes. from_json() also reads version 1, in which a
/// scene without a "solver" has Solver::worst_first.
inline constexpr int kSceneSchemaVersion = 2;
/// [m], largest absolute value of a coordinate of a position.
inline constexpr Real kMaxCoordinate = Real(1e9);
/// Largest deviation from 1 of the squared length of a unit vector or quaternion: sufficient for
/// numbers typed with four digits. Engines normalise these values.
inline constexpr Real kUnitTolerance = Real(1e-3);

/// Checks every field that can affect a step. In addition to the documented ranges of the fields:
/// sizes, positions and offsets must not exceed kMaxCoordinate, masses and moments of inertia must
/// have finite inverses, dt must not be denormal, there may be at most 2^32 - 1 bodies, and an
/// ignored pair or a joint must refer to two different bodies of the scene. One of the bodies of a
/// joint must be movable.
/// @throws InvalidScene naming the first invalid body, the field, its value and the allowed range.
JFPX_API void validate(const Scene& scene);

/// The scene as JSON text. Numbers are written so that from_json() restores the same bits. Invalid
/// UTF-8 in the name becomes U+FFFD.
/// @throws InvalidScene as validate().
JFPX_API std::string to_json(const Scene& scene);
/// Parses and validates a scene. Also accepts "assembly", the name of a compound in version 0.1.
/// @throws InvalidScene: malformed JSON (with line and column), unknown or missing field, wrong
///   type, unknown schema version or shape, value out of range.
JFPX_API Scene from_json(std::string_view text);

/// Reads a scene file.
/// @throws FileError if the file can't be read; InvalidScene as from_json(), prefixed with the
///   path.
JFPX_API Scene load_scene(const std::string& path);
/// Writes to_json() to a file atomically: the path holds the complete file or is unchanged.
/// @throws FileError; InvalidScene as to_json()
JFPX_API void save_scene(const Scene& scene, const std::string& path);

}  // namespace JFPX_ABI
}  // namespace jfpx
