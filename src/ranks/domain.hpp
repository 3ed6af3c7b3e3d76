/// The domain of a rank: the bodies that it owns, and ghosts of bodies of other ranks.
#pragma once

#include <jfpx/communicator.hpp>

#include "src/base/buffer.hpp"
#include "src/base/parallel_for.hpp"
#include "src/base/thread_pool.hpp"
#include "src/ranks/message.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Bodies that this rank exchanges with each rank, in an order that both ranks know.
class BodyLists {
 public:
  void clear(std::size_t ranks) {
    lists_.resize(ranks);
    for (auto& list : lists_) list.clear();
  }
  void add(std::size_t rank, std::uint32_t body) { lists_[rank].push_back(body); }
  std::vector<std::uint32_t>& of(std::size_t rank) { return lists_[rank]; }
  std::span<const std::uint32_t> of(std::size_t rank) const { return lists_[rank]; }
  /// Sorts the lists, and keeps one of equal bodies.
  void sort() {
    for (auto& list : lists_) {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
  }

 private:
  std::vector<std::vector<std::uint32_t>> lists_;
};

/// Owners of the bodies of a world with several ranks, and the exchange of their data. Each movable
/// body has one owner, which computes its motion. Bodies of mass 0 are the same on all ranks. A
/// ghost is a copy of a body of another rank, which may come into contact with a body of this rank.
///
/// Bodies are numbers of slots, which are the same on all ranks. Functions that communicate are
/// collective; see Communicator.
class Domain {
 public:
  using Message = Communicator::Message;
  using Rank = std::uint16_t;
  /// Owner of a body of mass 0, or of an unused slot.
  static constexpr Rank kEveryRank = 0xffff;

  /// @param pool outlives the object; null: messages are written and read in the calling thread
  Domain(std::shared_ptr<Communicator> communicator, ThreadPool* pool)
      : communicator_(std::move(communicator)),
        pool_(pool),
        rank_(static_cast<Rank>(communicator_->rank())),
        ranks_(communicator_->size()),
        sent_(ranks_),
        received_(ranks_),
        sent_items_(ranks_),
        received_items_(ranks_),
        sent_spans_(ranks_),
        received_spans_(ranks_) {
    for (BodyLists* lists : {&owned_, &ghosts_, &lent_}) lists->clear(ranks_);
  }

  Rank rank() const { return rank_; }
  std::size_t ranks() const { return ranks_; }
  Rank owner(std::uint32_t body) const { return owner_[body]; }
  /// Whether this rank owns a movable body.
  bool is_mine(std::uint32_t body) const { return owner_[body] == rank_; }
  /// Whether a body belongs to another rank.
  bool is_foreign(std::uint32_t body) const {
    return owner_[body] != rank_ && owner_[body] != kEveryRank;
  }
  /// The rank that detects the contact of two bodies.
  Rank detector(std::uint32_t a, std::uint32_t b) const {
    return owner_[a] != kEveryRank ? owner_[a] : owner_[b];
  }
  bool detects(std::uint32_t a, std::uint32_t b) const { return detector(a, b) == rank_; }
  /// Whether this rank has a row of a contact or joint.
  bool takes_part(std::uint32_t a, std::uint32_t b) const { return is_mine(a) || is_mine(b); }
  /// Whether a contact or joint connects a body of this rank and one of another rank.
  bool crosses(std::uint32_t a, std::uint32_t b) const {
    return (is_mine(a) && is_foreign(b)) || (is_mine(b) && is_foreign(a));
  }
  /// The other rank of a contact or joint that crosses().
  Rank other_rank(std::uint32_t a, std::uint32_t b) const {
    return is_mine(a) ? owner_[b] : owner_[a];
  }
  /// By body.
  std::span<const Rank> owners() const { return owner_; }

  /// Replaces the owners. There are no ghosts until set_ghosts().
  /// @param mobile bodies that are not immovable, ascending
  void set_owners(std::vector<Rank> owners, std::span<const std::uint32_t> mobile);
  /// Replaces the ghosts by the bodies that other ranks lend. @param lent by rank: bodies of mine,
  ///   ascending
  void set_ghosts(BodyLists lent);

  /// The bodies of mine and all kinematic bodies, ascending.
  std::span<const std::uint32_t> mine() const { return mine_; }
  /// The same with the ghosts, ascending.
  std::span<const std::uint32_t> present() const { return present_; }
  /// Number of bodies in mine() with a lower index.
  std::uint32_t count_before(std::uint32_t body) const { return before_[body]; }
  /// Changes whenever present() changes. Never 0.
  std::uint64_t version() const { return version_; }
  /// Whether a body is in present(), or immovable.
  bool is_present(std::uint32_t body) const { return is_present_[body] != 0; }
  /// Bodies of mine that are ghosts on each rank, and ghosts of the bodies of each rank.
  const BodyLists& lent() const { return lent_; }
  const BodyLists& ghosts() const { return ghosts_; }
  /// The movable bodies by owner, ascending.
  const BodyLists& owned() const { return owned_; }

  /// Sends read(body) of the bodies of `sent` to their ranks, and calls write(body, item) for those
  /// of `received` with the items of the other ranks.
  /// Several threads call the functions concurrently, each for other bodies.
  template <class Read, class Write>
  void exchange(const BodyLists& sent, const BodyLists& received, const Read& read,
                const Write& write) {
    exchange(sent, received, read, write, pool_);
  }
  /// The same in the calling thread.
  template <class Read, class Write>
  void exchange_in_order(const BodyLists& sent, const BodyLists& received, const Read& read,
                         const Write& write) {
    exchange(sent, received, read, write, nullptr);
  }

  /// Sends read(body) of all movable bodies of this rank to all ranks, and calls write(body, item)
  /// for those of the other ranks. Several threads call the functions concurrently.
  template <class Read, class Write>
  void share(const Read& read, const Write& write) {
    using Item = std::decay_t<decltype(read(0u))>;
    const std::span<const std::byte> own = pack<Item>(owned_, rank_, read, pool_);
    for (std::size_t r = 0; r < ranks_; ++r) {
      sent_spans_[r] = r == rank_ ? std::span<const std::byte>() : own;
      const std::size_t bodies = r == rank_ ? 0 : owned_.of(r).size();
      received_spans_[r] = received_items_[r].of(bodies * sizeof(Item));
    }
    communicator_->exchange_sized(sent_spans_, received_spans_);
    for (std::size_t r = 0; r < ranks_; ++r) {
      if (r != rank_) unpack<Item>(owned_, r, write, pool_);
    }
  }

  /// Messages of any size to all ranks. messages() are empty at first; after send(), they are those
  /// of the other ranks; that of this rank is empty.
  std::span<Message> start_messages();
  std::span<const Message> send();
  /// Sends one message to all ranks. @returns those of the other ranks; that of this rank is empty
  std::span<const Message> send_to_all(const Message& message);

  /// The values of all ranks, by rank.
  template <class T>
  std::vector<T> gather(const T& own) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<T> all(ranks_);
    communicator_->gather(std::as_bytes(std::span(&own, 1)),
                          std::as_writable_bytes(std::span(all)));
    return all;
  }
  ThreadPool* pool() const { return pool_; }
  /// Whether a condition is true on any rank.
  bool any(bool own);

 private:
  static constexpr std::size_t kItemsPerChunk = 256;

  /// Memory of a message whose size is known; not initialized.
  class Items {
   public:
    std::span<std::byte> of(std::size_t size) {
      bytes_.reserve_geometric(size, "messages between ranks");
      return {bytes_.data(), size};
    }

   private:
    Buffer<std::byte> bytes_;
  };

  template <class Read, class Write>
  void exchange(const BodyLists& sent, const BodyLists& received, const Read& read,
                const Write& write, ThreadPool* pool) {
    using Item = std::decay_t<decltype(read(0u))>;
    for (std::size_t r = 0; r < ranks_; ++r) {
      sent_spans_[r] = pack<Item>(sent, r, read, pool);
      received_spans_[r] = received_items_[r].of(received.of(r).size() * sizeof(Item));
    }
    communicator_->exchange_sized(sent_spans_, received_spans_);
    for (std::size_t r = 0; r < ranks_; ++r) unpack<Item>(received, r, write, pool);
  }

  /// Writes the message to a rank.
  template <class Item, class Read>
  std::span<const std::byte> pack(const BodyLists& sent, std::size_t rank, const Read& read,
                                  ThreadPool* pool) {
    static_assert(std::is_trivially_copyable_v<Item>);
    const std::span<const std::uint32_t> bodies = sent.of(rank);
    const std::span<std::byte> message = sent_items_[rank].of(bodies.size() * sizeof(Item));
    parallel_for(pool, bodies.size(), kItemsPerChunk, [&](std::size_t first, std::size_t last) {
      for (; first < last; ++first) {
        const Item item = read(bodies[first]);
        std::memcpy(message.data() + first * sizeof(Item), &item, sizeof(Item));
      }
    });
    return message;
  }
  /// Reads the message of a rank.
  template <class Item, class Write>
  void unpack(const BodyLists& received, std::size_t rank, const Write& write, ThreadPool* pool) {
    const std::span<const std::uint32_t> bodies = received.of(rank);
    const std::byte* const message = received_spans_[rank].data();
    parallel_for(pool, bodies.size(), kItemsPerChunk, [&](std::size_t first, std::size_t last) {
      for (; first < last; ++first) {
        Item item;
        std::memcpy(&item, message + first * sizeof(Item), sizeof(Item));
        write(bodies[first], item);
      }
    });
  }

  std::shared_ptr<Communicator> communicator_;
  ThreadPool* pool_;
  Rank rank_;
  std::size_t ranks_;
  std::vector<Rank> owner_;               ///< by body
  std::vector<std::uint8_t> is_present_;  ///< by body
  std::vector<std::uint32_t> before_;     ///< by body: count_before()
  std::vector<std::uint32_t> mine_, present_;
  std::uint64_t version_ = 1;
  BodyLists owned_, ghosts_, lent_;
  // By rank; memory that is kept.
  std::vector<Message> sent_, received_;
  std::vector<Items> sent_items_, received_items_;
  std::vector<std::span<const std::byte>> sent_spans_;
  std::vector<std::span<std::byte>> received_spans_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
