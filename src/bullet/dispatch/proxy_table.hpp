/// Assignment of stable indices to the broadphase proxies of a list of pairs.
#pragma once

#include "src/base/prefetch.hpp"

#include <bit>
#include <cstdint>
#include <vector>

struct btBroadphaseProxy;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// An open-addressing hash table over proxy addresses. Only the address can be used without
/// dereferencing the proxy. Moreover, unique ids of btDbvtBroadphase grow without bound, and array
/// indices belong to one world.
class ProxyTable {
 public:
  void clear() {
    proxies_.clear();
    users_.clear();
    in_use_ = 0;
    if (capacity_ == 0) {
      grow();
    } else {
      clear_entries();
    }
  }

  /// Upper bound of the indices. The proxy of an index without references may have been destroyed.
  std::size_t size() const { return proxies_.size(); }
  bool in_use(std::size_t number) const { return users_[number] != 0; }
  btBroadphaseProxy* proxy(std::size_t number) const { return proxies_[number]; }
  /// True if most indices have no reference, so that the table should be rebuilt.
  bool wasteful() const { return proxies_.size() > 2 * in_use_ + 1024; }

  /// Prefetches the proxy's entry. Lookups are as random as the pairs, and a table of a few
  /// thousand proxies exceeds the L1 cache.
  void prefetch(const btBroadphaseProxy* proxy) const { jfpx::prefetch(&entries_[home(proxy)]); }

  /// Adds a reference to the proxy and returns its index; a new proxy gets the next index.
  std::uint32_t acquire(btBroadphaseProxy* proxy) {
    Entry* entry = find(proxy);
    if (entry->proxy == nullptr) entry = add(proxy, entry);
    in_use_ += users_[entry->number]++ == 0 ? 1 : 0;
    return entry->number;
  }
  void release(std::uint32_t number) { in_use_ -= --users_[number] == 0 ? 1 : 0; }

 private:
  struct Entry {
    btBroadphaseProxy* proxy;
    std::uint32_t number;
  };

  /// Two rounds of multiplication and folding. One round (Fibonacci hashing) is insufficient:
  /// proxies have nearly equal distances, which one round maps to runs of 17 to 25 occupied
  /// entries.
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

  Entry* add(btBroadphaseProxy* proxy, Entry* entry) {
    if (2 * (proxies_.size() + 1) > capacity_) {
      grow();
      entry = find(proxy);
    }
    *entry = {proxy, static_cast<std::uint32_t>(proxies_.size())};
    proxies_.push_back(proxy);
    users_.push_back(0);
    return entry;
  }

  void clear_entries() {
    for (std::size_t i = 0; i < capacity_; ++i) entries_[i] = {};
  }

  void grow() {
    const std::size_t more = capacity_ == 0 ? 64 : 4 * capacity_;
    entries_.resize(more);  // may throw
    capacity_ = more;
    shift_ = 64 - std::countr_zero(capacity_);
    clear_entries();
    for (std::size_t i = 0; i < proxies_.size(); ++i) {
      *find(proxies_[i]) = {proxies_[i], static_cast<std::uint32_t>(i)};
    }
  }

  std::vector<Entry> entries_;
  std::vector<btBroadphaseProxy*> proxies_;
  std::vector<std::uint32_t> users_;
  std::size_t in_use_ = 0;
  std::size_t capacity_ = 0;
  int shift_ = 0;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
