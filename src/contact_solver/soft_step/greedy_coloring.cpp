/// Greedy coloring in the order of hashes; see the header.
#include "src/contact_solver/soft_step/greedy_coloring.hpp"

#include "src/base/parallel_for.hpp"
#include "src/base/reserve.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

namespace {

/// Orders are divided by their highest bits. Hashes are uniform, so the buckets have similar sizes.
constexpr unsigned kBucketBits = 6, kBuckets = 1u << kBucketBits;
constexpr std::size_t kBodiesPerChunk = 16384;
/// Below this number of contacts, sorting takes less time than a parallel loop.
constexpr std::size_t kFewContacts = 256;

std::size_t bucket_of(std::uint64_t order) { return order >> (64 - kBucketBits); }

}  // namespace

void GreedyColoring::start(std::size_t bodies, ThreadPool* pool) {
  resize_geometric(&used_, bodies);
  parallel_for(pool, bodies, kBodiesPerChunk, [this](std::size_t first, std::size_t last) {
    std::ranges::fill(std::span(used_).subspan(first, last - first), UsedColors{});
  });
  uncolored_.clear();
}

void GreedyColoring::append(std::span<const Uncolored> contacts) {
  if (contacts.empty()) return;
  const std::lock_guard lock(mutex_);
  uncolored_.insert(uncolored_.end(), contacts.begin(), contacts.end());
}

/// Fills sorted_: a counting sort into buckets, which are sorted in parallel.
void GreedyColoring::sort(ThreadPool* pool) {
  resize_geometric(&sorted_, uncolored_.size());
  std::array<std::size_t, kBuckets + 1> begin{};
  for (const Uncolored& contact : uncolored_) ++begin[bucket_of(contact.order) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  auto next = begin;
  for (const Uncolored& contact : uncolored_) sorted_[next[bucket_of(contact.order)]++] = contact;
  const auto order = [](const Uncolored& x, const Uncolored& y) {
    return std::tie(x.order, x.contact) < std::tie(y.order, y.contact);
  };
  ThreadPool* const sorters = uncolored_.size() > kFewContacts ? pool : nullptr;
  parallel_for(sorters, kBuckets, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t bucket = first; bucket < last; ++bucket) {
      std::ranges::sort(
          std::span(sorted_).subspan(begin[bucket], begin[bucket + 1] - begin[bucket]), order);
    }
  });
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
