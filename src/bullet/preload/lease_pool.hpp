/// Parts that do the work of those of a program that knows nothing of jfpx, for one call at a time.
#pragma once

#include "src/bullet/failure.hpp"

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// One part for each call that runs at the same time: a program's own may live in several threads,
/// and nothing says when one of them is gone. Thread-safe.
template <class Part>
class LeasePool {
 public:
  using Maker = std::unique_ptr<Part> (*)();

  explicit LeasePool(Maker make) : make_(make) {}

  /// A part for the time of a call, also when something in it throws.
  class Lease {
   public:
    explicit Lease(LeasePool& pool) : pool_(pool), part_(pool.take()) {}
    ~Lease() {
      if (part_ != nullptr) pool_.give_back(std::move(part_));
    }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    /// Null if none could be made: why() tells, or memory was wanting.
    Part* get() const { return part_.get(); }

   private:
    LeasePool& pool_;
    std::unique_ptr<Part> part_;
  };

  /// Calls visit(part) for those that are not at work.
  template <class Visit>
  void for_each_idle(Visit visit) {
    const std::lock_guard lock(mutex_);
    for (const auto& part : idle_) visit(*part);
  }
  /// Why there are no parts, and will be none; else empty.
  std::string why() {
    const std::lock_guard lock(mutex_);
    return why_;
  }

 private:
  std::unique_ptr<Part> take() noexcept {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<Part> part = std::move(idle_.back());
      idle_.pop_back();
      return part;
    }
    if (!why_.empty()) return nullptr;
    try {
      idle_.reserve(made_ + 1);
      std::unique_ptr<Part> part = make_();
      ++made_;
      return part;
    } catch (const std::exception& error) {
      if (!is_shortage(error)) why_ = text_of(error);
      return nullptr;
    }
  }
  void give_back(std::unique_ptr<Part> part) noexcept {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(part));  // has room, see take()
  }

  Maker make_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Part>> idle_;
  std::size_t made_ = 0;
  std::string why_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
