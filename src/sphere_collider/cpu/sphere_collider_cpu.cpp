/// Sphere contacts on the CPU: a search with vectors, then the list in canonical order.
#include "src/sphere_collider/cpu/sphere_collider_cpu.hpp"

#include <jfpx/error.hpp>

#include "src/base/cpu.hpp"
#include "src/base/interrupt.hpp"
#include "src/collide/sphere_pair.hpp"
#include "src/sphere_collider/cpu/cell_sweep.hpp"
#include "src/sphere_collider/cpu/contact_writer.hpp"
#include "src/sphere_collider/cpu/pair_filter.hpp"
#include "src/sphere_collider/sphere_input.hpp"

#include <algorithm>
#include <array>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

const Kernels& kernels_for(SimdLevel usable) noexcept {
  switch (usable) {
#if defined(__x86_64__)
    case SimdLevel::avx512:
      return kAvx512Kernels;
    case SimdLevel::avx2:
      return kAvx2Kernels;
#endif
    case SimdLevel::sse2:  // or neon
      return kBaselineKernels;
    default:
      return kScalarKernels;
  }
}

/// Below this number of spheres, testing all pairs with vectors is faster than sorting
/// (bench/results).
constexpr std::size_t kAllPairsBelow = 512;

class SphereColliderCpu final : public SphereCollider {
 public:
  SphereColliderCpu(const SphereColliderOptions& options, ThreadPool* pool)
      : requested_(options.algorithm),
        kernels_(kernels_for(usable_simd_level(options.simd))),
        own_pool_(pool == nullptr ? std::make_unique<ThreadPool>(options.threads) : nullptr),
        pool_(pool == nullptr ? *own_pool_ : *pool) {}

  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override {
    const PairOrder order = search(spheres);
    return writer_.write_contacts(spheres, pairs_, order, pool_);
  }

  std::span<const SpherePair> find_pairs(std::span<const SphereInstance> spheres) override {
    const PairOrder order = search(spheres);
    return writer_.write_pairs(spheres.size(), pairs_, order, pool_);
  }

  std::span<const PairContact> find_touching(std::span<const SphereInstance> spheres,
                                             std::span<const SpherePair> pairs) override {
    detail::check_count(pairs);
    touching_.reserve(pairs.size(), "touching pairs");
    // One thread writes without gaps. Several threads write at the offsets of their chunks.
    const bool gaps = pool_.threads() > 1;
    std::size_t total = 0;
    touching_counts_.resize(chunks_of(pairs));
    pool_.run(touching_counts_.size(), [&](std::size_t chunk) {
      PairContact* const begin = touching_.data() + (gaps ? chunk * kPairChunk : total);
      PairContact* out = begin;
      const std::span<const SpherePair> part = chunk_of(spheres, pairs, chunk);
      for (std::size_t first = 0; first < part.size(); first += kPairBlock) {
        const auto block = part.subspan(first, std::min(part.size() - first, kPairBlock));
        std::array<std::uint32_t, kPairBlock> candidates;
        const std::size_t count =
            find_candidates(spheres.data(), block.data(), block.size(), candidates.data());
        for (std::size_t k = 0; k < count; ++k) {
          const SpherePair pair = block[candidates[k]];
          const bool touch = detail::find_sphere_contact(spheres[pair.a], spheres[pair.b], out);
          out->pair = static_cast<std::uint32_t>(chunk * kPairChunk + first + candidates[k]);
          out += touch ? 1 : 0;
        }
      }
      touching_counts_[chunk] = static_cast<std::size_t>(out - begin);
      if (!gaps) total += touching_counts_[chunk];
    });
    for (std::size_t chunk = 0; gaps && chunk < touching_counts_.size(); ++chunk) {
      const PairContact* from = touching_.data() + chunk * kPairChunk;
      total = static_cast<std::size_t>(
          std::copy(from, from + touching_counts_[chunk], touching_.data() + total) -
          touching_.data());
    }
    return {touching_.data(), total};
  }

  Backend backend() const noexcept override { return Backend::cpu; }
  SphereAlgorithm algorithm() const noexcept override { return used_; }

 private:
  static constexpr std::size_t kPairChunk = 2048;
  /// Programs with small stacks call find_touching() through Bullet.
  static constexpr std::size_t kPairBlock = 256;
  static std::size_t chunks_of(std::span<const SpherePair> pairs) {
    return (pairs.size() + kPairChunk - 1) / kPairChunk;
  }
  /// Returns the pairs of a chunk after checking their indices.
  static std::span<const SpherePair> chunk_of(std::span<const SphereInstance> spheres,
                                              std::span<const SpherePair> pairs,
                                              std::size_t chunk) {
    const std::size_t begin = chunk * kPairChunk, end = std::min(pairs.size(), begin + kPairChunk);
    SphereIndex largest = 0;
    for (std::size_t i = begin; i < end; ++i) largest = std::max({largest, pairs[i].a, pairs[i].b});
    if (largest >= spheres.size()) detail::reject_pair(pairs, spheres.size());
    return pairs.subspan(begin, end - begin);
  }

  /// Fills pairs_, and returns its order.
  PairOrder search(std::span<const SphereInstance> spheres) {
    detail::check_spheres(spheres, &pool_);
    used_ = requested_;
    if (used_ == SphereAlgorithm::automatic) {
      used_ = spheres.size() < kAllPairsBelow ? SphereAlgorithm::all_pairs : SphereAlgorithm::grid;
    }
    pairs_.clear();
    if (used_ == SphereAlgorithm::grid) {
      return sweep_.find_pairs(spheres, kernels_, pool_, &pairs_);
    }
    find_all_pairs(spheres);
    return PairOrder::sorted;
  }

  void find_all_pairs(std::span<const SphereInstance> spheres) {
    table_.fill(
        pool_, spheres, spheres.size(), [](std::size_t i) { return static_cast<SphereIndex>(i); },
        [](std::size_t) { return std::int64_t{0}; });
    constexpr std::size_t kRows = 64;  // rows differ in length: many chunks balance the load
    const std::size_t chunks = (spheres.size() + kRows - 1) / kRows;
    pairs_.add(chunks);
    run_interruptible(pool_, chunks, [&](std::size_t chunk) {
      pairs_.fill(chunk, [&](PairSink* sink) {
        const std::size_t end = std::min(spheres.size(), (chunk + 1) * kRows);
        kernels_.search_all({table_.columns(), table_.columns(), true,
                             static_cast<SphereIndex>(chunk * kRows), static_cast<SphereIndex>(end),
                             sink});
      });
    });
  }

  SphereAlgorithm requested_;
  SphereAlgorithm used_ = SphereAlgorithm::automatic;
  const Kernels& kernels_;
  std::unique_ptr<ThreadPool> own_pool_;  ///< null if the pool is shared
  ThreadPool& pool_;
  SphereTable table_;
  CellSweep sweep_;
  PairChunks pairs_;
  ContactWriter writer_;
  Buffer<PairContact> touching_;
  std::vector<std::size_t> touching_counts_;  ///< by chunk
};

}  // namespace

BackendStatus probe() {
  return {.backend = Backend::cpu,
          .compiled = true,
          .usable = true,
          .device = describe_processor(),
          .reason = {}};
}

std::unique_ptr<SphereCollider> make_sphere_collider(const SphereColliderOptions& options,
                                                     ThreadPool* pool) {
  return std::make_unique<SphereColliderCpu>(options, pool);
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
