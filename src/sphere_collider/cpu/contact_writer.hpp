/// Conversion of candidate pairs into contacts in canonical order.
#pragma once

#include <jfpx/contact.hpp>

#include "src/base/thread_pool.hpp"
#include "src/sphere_collider/cpu/pair_chunks.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Applies the exact test to candidate pairs and writes the contacts sorted by (a, b). Owns its
/// buffers, which only grow.
class ContactWriter {
 public:
  /// Requires pairs that are sorted across all chunks.
  ContactSpan write_sorted(std::span<const SphereInstance> spheres, const PairChunks& pairs,
                           ThreadPool& pool);
  /// Accepts pairs in any order.
  ContactSpan write_unsorted(std::span<const SphereInstance> spheres, const PairChunks& pairs,
                             ThreadPool& pool);

 private:
  /// A run of candidates, and the number of them that touch.
  struct Section {
    std::uint64_t begin;
    std::uint64_t touching;
  };

  void divide(const PairChunks& pairs, ThreadPool& pool);
  void make_rows(std::size_t bucket, std::size_t spheres);
  std::uint64_t write_rows(std::span<const SphereInstance> spheres, std::size_t bucket);
  ContactSpan close_gaps(std::size_t sections);

  Buffer<SphereContact> contacts_;
  Buffer<Section> sections_;
  unsigned bucket_bits_ = 0;  ///< a bucket holds the pairs of 2^bucket_bits_ lower spheres
  std::size_t buckets_ = 0;
  Buffer<std::uint64_t> offsets_;  ///< per chunk and bucket
  Buffer<std::uint64_t> divided_;  ///< pairs by bucket
  Buffer<std::uint64_t> rows_;     ///< pairs by lower sphere; the pairs of one are its row
  Buffer<std::uint64_t> row_end_;  ///< per sphere: end of its row
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
