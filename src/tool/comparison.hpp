/// The main job: a scene in native jfpx, stock Bullet and Bullet with jfpx, everything compared.
#pragma once

#include "src/tool/engine.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// What a comparison found. `stock` and `jfpx` are two Bullet worlds that differ in their parts.
struct Comparison {
  /// Contacts of find_contacts() held against the sphere-sphere manifolds of stock Bullet.
  std::uint64_t contacts_compared = 0;
  std::uint64_t contact_mismatches = 0;
  std::string first_contact_mismatch;  ///< a sentence; empty if there is none
  /// The first difference between the two Bullet worlds in anything that was compared after each
  /// step: manifolds in order, every field of every point, transforms, velocities.
  std::string first_difference;
  std::uint64_t hash_native = 0, hash_stock = 0, hash_jfpx = 0;
  std::uint64_t contacts_native = 0, contacts_stock = 0, contacts_jfpx = 0;  ///< summed over steps
  StageTimes ms_native, ms_stock, ms_jfpx;                                   ///< summed over steps
  std::uint64_t batches = 0;           ///< dispatches of `jfpx` that its collider computed
  std::uint64_t groups = 0;            ///< groups of bodies that the solver of `jfpx` solved
  std::uint64_t groups_on_device = 0;  ///< of these: on the GPU
  std::string device_failure;          ///< why x86 took over from the GPU; empty: it did not
  std::string trouble;                 ///< why native could not go on meaningfully; empty: it could
  std::string backend;                 ///< who computed the last batch of sphere pairs in `jfpx`

  bool trajectory_identical() const { return first_difference.empty() && hash_stock == hash_jfpx; }
  bool passed() const { return contact_mismatches == 0 && trajectory_identical(); }
};

/// Steps the three side by side. @throws BackendUnavailable in a build without Bullet.
Comparison compare(const Scene& scene, const RunOptions& options);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
