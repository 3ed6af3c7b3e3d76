/// Numbers the distinct broadphase proxies of a pair list, in order of first appearance.
#pragma once

#include <jfpx/config.hpp>

#include <bit>
#include <cstdint>
#include <vector>

struct btBroadphaseProxy;

namespace jfpx::inline JFPX_ABI::bullet {

/// An open-addressing hash table over proxy addresses. Keyed by address because that is the only
/// name of a proxy that needs no look at it: unique ids of btDbvtBroadphase grow without bound, and
/// array indices belong to one world.
class ProxyTable {
 public:
  /// Forgets all proxies. `expected` is a guess of how many will come.
  void reset(std::size_t expected) {
    proxies_.clear();
    capacity_ = std::bit_ceil(2 * expected + 64);
    if (entries_.size() < capacity_) entries_.resize(capacity_);
    clear_entries();
  }

  bool fits_first_level_cache() const { return capacity_ * sizeof(Entry) <= 16384; }
  /// Brings the proxy's place into the cache. Lookups are as random as the pairs, and a table of
  /// some thousand proxies is larger than the first-level cache.
  void prefetch(const btBroadphaseProxy* proxy) const {
    __builtin_prefetch(&entries_[home(proxy)]);
  }

  /// The number of the proxy; a new one gets the next number.
  std::uint32_t number(btBroadphaseProxy* proxy) {
    Entry* entry = find(proxy);
    if (entry->proxy == proxy) return entry->number;
    if (2 * (proxies_.size() + 1) > capacity_) {
      grow();
      entry = find(proxy);
    }
    *entry = {proxy, static_cast<std::uint32_t>(proxies_.size())};
    proxies_.push_back(proxy);
    return entry->number;
  }

  const std::vector<btBroadphaseProxy*>& proxies() const { return proxies_; }

 private:
  struct Entry {
    btBroadphaseProxy* proxy;
    std::uint32_t number;
  };

  /// Two rounds of multiplying and folding. One round (Fibonacci hashing) is not enough: proxies
  /// lie at nearly equal distances, which it maps to runs of 17 to 25 occupied entries.
  std::size_t home(const btBroadphaseProxy* proxy) const {
    constexpr std::uint64_t kMultiplier = 0x9e3779b97f4a7c15u;
    std::uint64_t hash = reinterpret_cast<std::uintptr_t>(proxy) * kMultiplier;
    hash = (hash ^ (hash >> 32)) * kMultiplier;
    return hash >> shift_;
  }
  Entry* find(const btBroadphaseProxy* proxy) {
    std::size_t i = home(proxy);
    while (entries_[i].proxy != nullptr && entries_[i].proxy != proxy) {
      i = (i + 1) & (capacity_ - 1);
    }
    return &entries_[i];
  }

  void clear_entries() {
    shift_ = 64 - std::countr_zero(capacity_);
    for (std::size_t i = 0; i < capacity_; ++i) entries_[i] = {};
  }

  void grow() {
    capacity_ *= 4;
    if (entries_.size() < capacity_) entries_.resize(capacity_);
    clear_entries();
    for (std::size_t i = 0; i < proxies_.size(); ++i) {
      *find(proxies_[i]) = {proxies_[i], static_cast<std::uint32_t>(i)};
    }
  }

  std::vector<Entry> entries_;
  std::vector<btBroadphaseProxy*> proxies_;
  std::size_t capacity_ = 0;
  int shift_ = 0;
};

}  // namespace jfpx::inline JFPX_ABI::bullet
