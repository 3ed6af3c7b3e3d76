/// What sphere collision costs on a machine: the numbers behind Backend::automatic (thesis 5.4).
#pragma once

#include <jfpx/config.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

/// What one call of a SphereCollider has to do. Counts, as doubles so that none overflows.
struct ColliderWork {
  double spheres = 0;   ///< [-]
  double pairs = 0;     ///< [-], N*(N-1)/2 for find_contacts(), those given for test_pairs()
  double contacts = 0;  ///< [-], found; not counted for test_pairs()
  double bytes = 0;     ///< [-], input and output
};

/// Cost of one way to do it: a sum of terms, each >= 0.
struct CostTerms {
  double call_us = 0;     ///< [us] a call: launches, waiting, waking threads
  double byte_ns = 0;     ///< [ns] a byte moved to and from the device
  double sphere_ns = 0;   ///< [ns] a sphere
  double pair_ns = 0;     ///< [ns] a pair that is looked at
  double contact_ns = 0;  ///< [ns] a contact
  friend bool operator==(const CostTerms&, const CostTerms&) = default;
};

/// [us] that the work takes. One with `pair_ns` of 0 does not depend on the pairs, and so on.
constexpr double microseconds(const CostTerms& t, const ColliderWork& work) {
  return t.call_us + 1e-3 * (t.byte_ns * work.bytes + t.sphere_ns * work.spheres +
                             t.pair_ns * work.pairs + t.contact_ns * work.contacts);
}

/// Costs of all ways, for this precision. The defaults are of an AMD EPYC of 2022 with AVX-512, one
/// thread, and of an NVIDIA H200. Elsewhere, and where they are wrong, the times of
/// the last calls correct them.
struct CostModel {
  CostTerms x86_all_pairs, x86_sorted_tiles, x86_given_pairs;
  CostTerms cuda_all_pairs, cuda_sorted_tiles, cuda_given_pairs;
  double cuda_start_ms = 200;  ///< [ms] the first use of the device, >= 0

  JFPX_API CostModel();
  friend bool operator==(const CostModel&, const CostModel&) = default;
};

/// Where a cost model was measured: it holds there and nowhere else.
struct CostModelOrigin {
  std::string machine;                 ///< processor and number of cores
  std::string driver;                  ///< GPUs and their driver; empty where there is none
  std::string version = JFPX_VERSION;  ///< of jfpx
  friend bool operator==(const CostModelOrigin&, const CostModelOrigin&) = default;
};

struct MeasuredCostModel {
  CostModel costs;
  CostModelOrigin origin;
};

/// Writes JSON. @throws FileError; InvalidArgument for a term that is not finite or < 0.
JFPX_API void save_cost_model(const MeasuredCostModel& model, const std::string& path);
/// @throws FileError if the file can't be read, is no cost model, is one of the other precision or
///   of another format, or holds a term that is not finite or < 0.
JFPX_API MeasuredCostModel load_cost_model(const std::string& path);

struct CalibratedCosts {
  CostModel costs;      ///< the defaults unless `problem` is empty
  std::string problem;  ///< why they are not those of this machine: one line
};
/// What `jfpx calibrate` has measured on this machine, for SphereColliderOptions::costs. Looks in
/// the user's cache folder ($XDG_CACHE_HOME, $HOME/.cache); a file that is missing, broken, or of
/// another machine, driver or version is not used. Does not start a GPU. Thread-safe.
/// @throws std::bad_alloc
JFPX_API CalibratedCosts calibrated_costs();

}  // namespace JFPX_ABI
}  // namespace jfpx
