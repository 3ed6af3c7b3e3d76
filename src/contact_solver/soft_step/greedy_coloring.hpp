/// Greedy coloring of contacts, whose colors persist from step to step.
#pragma once

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/colors.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/ranks/domain.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Assigns to each new contact the lowest color of its class that neither body has, in the order of
/// a hash of the key. The order depends on the keys only, and random orders need few parallel
/// rounds (Blelloch, Fineman and Shun 2012). A persistent contact keeps its color while its class
/// is the same, except in the overflow, whose contacts are colored again.
///
/// Usage in a step: start(), keep() for all colored contacts, Portion::add() for all others,
/// finish(). Joints are colored together with the contacts, in the order of the same hash, and
/// numbered after them. Owns its buffers, which grow and never shrink.
///
/// With several ranks, each rank colors the contacts of its bodies. A contact of bodies of two
/// ranks gets its color when all earlier contacts of both bodies have one: each rank then sends the
/// set of its body to the other one.
class GreedyColoring {
 public:
  /// @param pool null: start() and finish() run in the calling thread
  /// @param domain null, or only bodies that are present have contacts
  void start(std::size_t bodies, ThreadPool* pool, const Domain* domain);
  /// Several threads may call it concurrently.
  void keep(std::uint32_t a, std::uint32_t b, std::uint8_t color) {
    const std::uint64_t bit = std::uint64_t{1} << number_in_class(color);
    for (const std::uint32_t body : {a, b}) {
      std::atomic_ref(used_[body].of_class(is_inner_color(color)))
          .fetch_or(bit, std::memory_order_relaxed);
    }
  }
  /// Contacts that one thread adds, in portions. Several threads may add contacts concurrently,
  /// each with its own object.
  class Portion;
  /// Calls assign(contact, color) for the added contacts.
  /// @param domain null: a single rank
  template <class Assign>
  void finish(const Assign& assign, ThreadPool* pool, Domain* domain) {
    sort(pool);
    if (domain != nullptr) {
      color_with_other_ranks(domain);
      for (std::size_t i = 0; i < sorted_.size(); ++i) assign(sorted_[i].contact, colors_[i]);
      return;
    }
    for (const Uncolored& contact : sorted_) {
      assign(contact.contact,
             take_lowest_color(contact.is_inner, &used_[contact.a], &used_[contact.b]));
    }
  }

 private:
  struct Uncolored {
    std::uint64_t order;
    std::uint32_t contact, a, b;
    bool is_inner;
  };
  /// A contact of a body of this rank and one of another rank.
  struct Crossing {
    std::uint64_t used = 0;   ///< numbers of the class at the other body, once received
    std::uint32_t place = 0;  ///< among those with the same rank, in the order of coloring
    Domain::Rank rank = 0;    ///< the other one
    bool is_sent = false, is_received = false;
  };
  /// Numbers at a body before the contact with a place.
  struct SentColors {
    std::uint64_t place = 0, used = 0;
  };
  void append(std::span<const Uncolored> contacts);
  void sort(ThreadPool* pool);
  void color_with_other_ranks(Domain* domain);
  void color_ready(const Domain& domain, std::span<Communicator::Message> messages);

  std::vector<UsedColors> used_;  ///< by body
  std::mutex mutex_;              ///< guards uncolored_
  std::vector<Uncolored> uncolored_;
  std::vector<Uncolored> sorted_;  ///< by order and number
  // With several ranks:
  std::vector<std::uint8_t> colors_;     ///< by place in sorted_
  std::vector<std::uint32_t> crossing_;  ///< by place in sorted_: place in crossings_, or kNone
  std::vector<Crossing> crossings_;
  std::vector<std::vector<std::uint32_t>> crossings_of_rank_;  ///< places in crossings_
  std::vector<std::uint32_t> waiting_;  ///< places in sorted_ of contacts without a color
  std::vector<std::uint32_t> blocked_;  ///< by body: the last round in which a contact waits
  std::uint32_t round_ = 0;
};

class GreedyColoring::Portion {
 public:
  explicit Portion(GreedyColoring* coloring) : coloring_(coloring) {}
  /// @param contact number of the contact
  void add(const ContactKey& key, std::uint32_t contact, bool is_inner) {
    if (count_ == contacts_.size()) flush();
    contacts_[count_++] = {color_order(key), contact, key.a, key.b, is_inner};
  }
  /// Must be called after the last add().
  void flush() {
    coloring_->append(std::span(contacts_).first(count_));
    count_ = 0;
  }

 private:
  GreedyColoring* coloring_;
  std::array<Uncolored, 64> contacts_;
  std::size_t count_ = 0;
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
