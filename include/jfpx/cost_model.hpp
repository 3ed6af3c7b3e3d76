/// Cost model of sphere collision and of the steps of a world on a machine, for Backend::automatic
/// (thesis 5.4).
#pragma once

#include <jfpx/config.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

/// Amount of work of one SphereCollider call, or of one step of a world with Solver::soft_step. For
/// a step, only `spheres` is used: the number of bodies. The counts are doubles to avoid overflow.
struct ColliderWork {
  double spheres = 0;   ///< [-]
  double pairs = 0;     ///< [-], N*(N-1)/2 for find_contacts(), the list for find_touching()
  double contacts = 0;  ///< [-], found; not counted for find_touching()
  double bytes = 0;     ///< [B], input and output; for find_touching() as if every pair touched
};

/// Cost of one backend and algorithm: coefficients of a linear model, each finite and >= 0.
struct CostTerms {
  double call_us = 0;     ///< [us] per call: launches, synchronization, waking threads
  double byte_ns = 0;     ///< [ns] per byte copied to and from the device
  double sphere_ns = 0;   ///< [ns] per sphere, or per body of a world
  double pair_ns = 0;     ///< [ns] per tested pair
  double contact_ns = 0;  ///< [ns] per contact
  friend bool operator==(const CostTerms&, const CostTerms&) = default;
};

/// Predicted time of the work [us]: the linear combination of the terms and the counts.
constexpr double microseconds(const CostTerms& t, const ColliderWork& work) {
  return t.call_us + 1e-3 * (t.byte_ns * work.bytes + t.sphere_ns * work.spheres +
                             t.pair_ns * work.pairs + t.contact_ns * work.contacts);
}

/// Costs of all backends and algorithms, for this precision. The defaults were measured on an AMD
/// EPYC of 2022 with AVX-512, with one thread, and on an NVIDIA H200. Backend::automatic corrects
/// the costs by the times of recent calls.
struct CostModel {
  CostTerms cpu_all_pairs, cpu_grid, cpu_given_pairs;
  CostTerms cuda_all_pairs, cuda_grid, cuda_given_pairs;
  CostTerms cpu_world, cuda_world;  ///< steps of a world of touching bodies
  /// [ms], >= 0, first use of the device. When the predicted gain exceeds it, another thread
  /// initializes the device while the CPU continues. 0: the device is initialized, and used at
  /// once.
  double cuda_start_ms = 200;

  JFPX_API CostModel();
  friend bool operator==(const CostModel&, const CostModel&) = default;
};

/// Machine on which a cost model was measured. The model is valid on this machine only.
struct CostModelOrigin {
  std::string machine;                 ///< processor and number of cores
  std::string driver;                  ///< GPUs and their driver; empty if there is none
  std::string version = JFPX_VERSION;  ///< of jfpx
  friend bool operator==(const CostModelOrigin&, const CostModelOrigin&) = default;
};

/// A cost model and its origin.
struct MeasuredCostModel {
  CostModel costs;
  CostModelOrigin origin;
};

/// Writes a cost model as JSON, atomically. Thread-safe for different paths.
/// @throws FileError; InvalidArgument if a term is not finite or < 0.
JFPX_API void save_cost_model(const MeasuredCostModel& model, const std::string& path);
/// Reads a cost model from JSON. Thread-safe.
/// @throws FileError if the file cannot be read, is not a cost model, has another precision or
///   format, or contains a term that is not finite or < 0.
JFPX_API MeasuredCostModel load_cost_model(const std::string& path);

/// Result of calibrated_costs().
struct CalibratedCosts {
  CostModel costs;      ///< the defaults unless `problem` is empty
  std::string problem;  ///< one line that explains why the defaults are used
};
/// Reads the costs that `jfpx calibrate` measured on this machine, for
/// SphereColliderOptions::costs. The file is in the user's cache folder ($XDG_CACHE_HOME,
/// $HOME/.cache). A file that is missing, damaged, or from another machine, driver or version is
/// ignored. Does not start a GPU. Thread-safe.
/// @throws std::bad_alloc
JFPX_API CalibratedCosts calibrated_costs();

}  // namespace JFPX_ABI
}  // namespace jfpx
