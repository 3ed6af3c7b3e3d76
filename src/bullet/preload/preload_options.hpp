/// Options of the preloaded parts, read from the environment.
#pragma once

#include <jfpx/backend.hpp>

#include <cstddef>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

struct PreloadOptions {
  Backend backend = Backend::automatic;      ///< JFPX_PRELOAD_BACKEND
  unsigned threads = 1;                      ///< JFPX_PRELOAD_THREADS: 0 is one per core
  std::optional<std::size_t> minimum_batch;  ///< JFPX_PRELOAD_MINIMUM_BATCH
  bool verify = false;                       ///< JFPX_PRELOAD_VERIFY
};

/// Read once. An invalid value is reported on stderr and ignored. Thread-safe.
const PreloadOptions& preload_options();

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
