/// Sphere contacts on x86: vector filter, then the exact test, in canonical order.
#include "src/x86/sphere_collider_x86.hpp"

#include <jfpx/error.hpp>

#include "src/shared/sphere_input.hpp"
#include "src/shared/sphere_pair.hpp"
#include "src/x86/cell_sweep.hpp"
#include "src/x86/contact_writer.hpp"
#include "src/x86/cpu.hpp"

#include <algorithm>

namespace jfpx::inline JFPX_ABI::x86 {
namespace {

/// Below so many spheres all pairs are faster than sorting, with vectors (bench/results).
constexpr std::size_t kAllPairsBelow = 512;

class SphereColliderX86 final : public SphereCollider {
 public:
  explicit SphereColliderX86(const SphereColliderOptions& options)
      : wanted_(options.algorithm),
        kernels_(kernels_for(usable_simd_level(options.simd))),
        pool_(options.threads) {}

  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override {
    shared::check_spheres(spheres);
    used_ = wanted_;
    if (used_ == SphereAlgorithm::automatic) {
      used_ = spheres.size() < kAllPairsBelow ? SphereAlgorithm::all_pairs
                                              : SphereAlgorithm::sorted_tiles;
    }
    pairs_.clear();
    if (used_ == SphereAlgorithm::all_pairs) {
      find_all_pairs(spheres);
      return writer_.write_sorted(spheres, pairs_, pool_);
    }
    sweep_.find_pairs(spheres, kernels_, pool_, &pairs_);
    return writer_.write_unsorted(spheres, pairs_, pool_);
  }

  std::span<const PairResult> test_pairs(std::span<const SphereInstance> spheres,
                                         std::span<const SpherePair> pairs) override {
    results_.reserve(pairs.size(), "pair results");
    constexpr std::size_t kChunk = 4096;
    pool_.run((pairs.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
      const auto part =
          pairs.subspan(chunk * kChunk, std::min(kChunk, pairs.size() - chunk * kChunk));
      SphereIndex largest = 0;
      for (const SpherePair& p : part) largest = std::max({largest, p.a, p.b});
      if (largest >= spheres.size()) shared::reject_pair(pairs, spheres.size());
      constexpr std::size_t kAhead = 12;  // spheres come from anywhere: ask for them in time
      PairResult* out = results_.data() + chunk * kChunk;
      for (std::size_t i = 0; i < part.size(); ++i) {
        const SpherePair& later = part[std::min(i + kAhead, part.size() - 1)];
        __builtin_prefetch(&spheres[later.a]);
        __builtin_prefetch(&spheres[later.b]);
        out[i] = shared::test_sphere_pair(spheres[part[i].a], spheres[part[i].b]);
      }
    });
    return {results_.data(), pairs.size()};
  }

  Backend backend() const noexcept override { return Backend::x86; }
  SphereAlgorithm algorithm() const noexcept override { return used_; }

 private:
  void find_all_pairs(std::span<const SphereInstance> spheres) {
    table_.fill(
        pool_, spheres, spheres.size(), [](std::size_t i) { return static_cast<SphereIndex>(i); },
        [](std::size_t) { return std::int64_t{0}; });
    constexpr std::size_t kRows = 64;  // short rows, long rows: many chunks even the work out
    const std::size_t chunks = (spheres.size() + kRows - 1) / kRows;
    pairs_.add(chunks);
    pool_.run(chunks, [&](std::size_t chunk) {
      pairs_.fill(chunk, [&](PairSink* sink) {
        const std::size_t end = std::min(spheres.size(), (chunk + 1) * kRows);
        kernels_.search_all({table_.columns(), table_.columns(), true,
                             static_cast<SphereIndex>(chunk * kRows), static_cast<SphereIndex>(end),
                             sink});
      });
    });
  }

  SphereAlgorithm wanted_;
  SphereAlgorithm used_ = SphereAlgorithm::automatic;
  const Kernels& kernels_;
  ThreadPool pool_;
  SphereTable table_;
  CellSweep sweep_;
  PairChunks pairs_;
  ContactWriter writer_;
  Buffer<PairResult> results_;
};

}  // namespace

BackendStatus probe() {
  return {.backend = Backend::x86,
          .compiled = true,
          .usable = true,
          .device = describe_processor(),
          .reason = {}};
}

std::unique_ptr<SphereCollider> make_sphere_collider(const SphereColliderOptions& options) {
  return std::make_unique<SphereColliderX86>(options);
}

}  // namespace jfpx::inline JFPX_ABI::x86
