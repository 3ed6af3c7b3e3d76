/// Lists of touching pairs, with or without contacts, in canonical order.
#pragma once

#include <jfpx/contact.hpp>

#include "src/base/thread_pool.hpp"
#include "src/sphere_collider/cpu/pair_chunks.hpp"

#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Writes pairs or contacts sorted by (a, b). Owns its buffers, which only grow. A result is valid
/// until the next call.
class ContactWriter {
 public:
  /// @param chunks touching pairs, each once
  ContactSpan write_contacts(std::span<const SphereInstance> spheres, const PairChunks& chunks,
                             PairOrder order, ThreadPool& pool);
  std::span<const SpherePair> write_pairs(std::size_t spheres, const PairChunks& chunks,
                                          PairOrder order, ThreadPool& pool);

 private:
  /// The pairs of one lower sphere, in any order.
  struct Row {
    const std::uint64_t* pairs = nullptr;
    std::uint64_t count = 0;
  };

  template <class Item, class Make>
  std::span<const Item> write_chunks(const PairChunks& chunks, ThreadPool& pool,
                                     Buffer<Item>* items, const Make& make);
  template <class Reserve, class Done>
  std::span<const SpherePair> write_rows(std::size_t spheres, const PairChunks& chunks,
                                         PairOrder order, ThreadPool& pool, const Reserve& reserve,
                                         const Done& done);
  static void prefetch(const Row& row);
  unsigned index_rows(const PairChunks& chunks, std::size_t spheres, ThreadPool& pool);
  unsigned divide(const PairChunks& chunks, std::size_t spheres, ThreadPool& pool);
  void make_rows(std::size_t bucket, std::size_t first, std::size_t last);

  Buffer<SphereContact> contacts_;
  Buffer<SpherePair> pairs_;
  std::vector<Buffer<SpherePair>> spares_;  ///< by part of the result, for sorting long rows
  Buffer<std::uint64_t> sections_;          ///< begins of parts of the result, and its end
  Buffer<Row> rows_;                        ///< by lower sphere
  Buffer<std::uint64_t> offsets_;           ///< per chunk and bucket
  Buffer<std::uint64_t> divided_;           ///< pairs by bucket of neighbouring lower spheres
  Buffer<std::uint64_t> grouped_;           ///< pairs by lower sphere
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
