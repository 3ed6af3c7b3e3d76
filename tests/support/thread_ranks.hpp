/// Ranks that are threads of the test.
#pragma once

#include <jfpx/communicator.hpp>

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

namespace jfpx::test {

/// A group of communicators, one for each thread.
class ThreadRanks {
 public:
  explicit ThreadRanks(std::uint32_t size)
      : barrier_(size), sent_(size), sized_(size), gathered_(size) {}

  /// Calls body(communicator) in a thread for each rank. An exception in a rank that others wait
  /// for ends the test program.
  static void run(std::uint32_t size,
                  const std::function<void(const std::shared_ptr<Communicator>&)>& body) {
    const auto group = std::make_shared<ThreadRanks>(size);
    std::vector<std::thread> threads;
    for (std::uint32_t rank = 0; rank < size; ++rank) {
      threads.emplace_back([&, rank] { body(std::make_shared<Rank>(group, rank)); });
    }
    for (std::thread& thread : threads) thread.join();
  }

 private:
  /// Blocks at once, unlike std::barrier: there may be more ranks than cores.
  class Barrier {
   public:
    explicit Barrier(std::uint32_t size) : size_(size), missing_(size) {}
    void arrive_and_wait() {
      std::unique_lock lock(mutex_);
      if (--missing_ == 0) {
        missing_ = size_;
        ++round_;
        all_are_there_.notify_all();
        return;
      }
      all_are_there_.wait(lock, [this, round = round_] { return round_ != round; });
    }

   private:
    std::mutex mutex_;
    std::condition_variable all_are_there_;
    std::uint32_t size_, missing_;
    std::uint64_t round_ = 0;
  };

  class Rank final : public Communicator {
   public:
    Rank(std::shared_ptr<ThreadRanks> group, std::uint32_t rank)
        : group_(std::move(group)), rank_(rank) {}
    std::uint32_t rank() const noexcept override { return rank_; }
    std::uint32_t size() const noexcept override {
      return static_cast<std::uint32_t>(group_->sent_.size());
    }
    void exchange(std::span<const Message> sent, std::span<Message> received) override {
      group_->sent_[rank_] = sent;
      group_->barrier_.arrive_and_wait();
      for (std::uint32_t r = 0; r < size(); ++r) {
        if (r != rank_) received[r] = group_->sent_[r][rank_];
      }
      group_->barrier_.arrive_and_wait();
    }
    void exchange_sized(std::span<const std::span<const std::byte>> sent,
                        std::span<const std::span<std::byte>> received) override {
      group_->sized_[rank_] = sent;
      group_->barrier_.arrive_and_wait();
      for (std::uint32_t r = 0; r < size(); ++r) {
        if (r == rank_) continue;
        const std::span<const std::byte> message = group_->sized_[r][rank_];
        if (message.size() != received[r].size()) std::terminate();
        std::ranges::copy(message, received[r].begin());
      }
      group_->barrier_.arrive_and_wait();
    }
    void gather(std::span<const std::byte> own, std::span<std::byte> all) override {
      group_->gathered_[rank_] = own;
      group_->barrier_.arrive_and_wait();
      for (std::uint32_t r = 0; r < size(); ++r) {
        if (group_->gathered_[r].size() != own.size()) std::terminate();
        std::ranges::copy(group_->gathered_[r],
                          all.begin() + static_cast<std::ptrdiff_t>(r * own.size()));
      }
      group_->barrier_.arrive_and_wait();
    }

   private:
    std::shared_ptr<ThreadRanks> group_;
    std::uint32_t rank_;
  };

  Barrier barrier_;
  std::vector<std::span<const Communicator::Message>> sent_;
  std::vector<std::span<const std::span<const std::byte>>> sized_;
  std::vector<std::span<const std::byte>> gathered_;
};

}  // namespace jfpx::test
