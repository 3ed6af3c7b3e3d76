/// Lists of touching pairs, with or without contacts, in canonical order.
#pragma once

#include <jfpx/contact.hpp>

#include "src/base/thread_pool.hpp"
#include "src/sphere_collider/cpu/pair_chunks.hpp"

#include <memory>
#include <mutex>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Writes pairs or contacts sorted by (a, b). Owns its buffers, which grow and never shrink. A
/// result is valid until the next call.
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
  /// Buffers of a thread for sorting a part of the result.
  struct Workspace {
    Buffer<std::uint64_t> pairs;  ///< of the part, by lower sphere
    Buffer<Row> rows;             ///< of the part
    Buffer<SpherePair> spare;     ///< for sorting a long row
  };
  struct GiveBack {
    ContactWriter* writer;
    void operator()(Workspace* workspace) const;
  };
  using TakenWorkspace = std::unique_ptr<Workspace, GiveBack>;

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
  void reserve_workspaces(std::size_t count, std::size_t rows, std::size_t parts);
  TakenWorkspace take_workspace();
  const Row* make_rows(std::size_t bucket, std::size_t first, std::size_t last,
                       Workspace* workspace) const;

  Buffer<SphereContact> contacts_;
  Buffer<SpherePair> pairs_;           ///< the result; before, the bits of packed pairs by bucket
  Buffer<std::uint64_t> sections_;     ///< begins of parts of the result, and its end
  Buffer<Row> rows_;                   ///< by lower sphere; for PairOrder::by_lower_sphere
  Buffer<std::uint64_t> offsets_;      ///< per chunk and bucket
  std::vector<Workspace> workspaces_;  ///< by thread
  std::vector<Workspace*> idle_;       ///< unused workspaces
  std::mutex mutex_;                   ///< guards idle_
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
