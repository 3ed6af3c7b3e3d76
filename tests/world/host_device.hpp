/// A device on the host, for machines without a GPU: runs the programs of a device step in one
/// thread.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/world/device/device_step.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Runs the items of a loop in an order that differs between loops, as on a device.
class HostTeam {
 public:
  void sync() const {}
  const std::uint32_t* cached_bins(const std::uint32_t* numbers) const { return numbers; }

  struct alignas(64) SharedPiece {
    SharedPiece() { std::ranges::fill(numbers, std::nan("")); }  // like uninitialized memory
    double numbers[8];
  };
  /// Calls f(block, threads) for all blocks < n.
  template <class F>
  void for_blocks(std::uint32_t n, const F& f) const {
    for_each_nowait(n, [&](std::uint32_t block) {
      memory_.clear();
      f(block, Threads{*this, &memory_});
    });
  }
  /// The threads of a block.
  struct Threads {
    const HostTeam& team;
    std::vector<SharedPiece>* memory;

    void sync() const {}
    void* shared(std::size_t bytes) const {
      memory->resize((bytes + sizeof(SharedPiece) - 1) / sizeof(SharedPiece), SharedPiece());
      return memory->data();
    }
    template <class F>
    void for_each(std::uint32_t n, const F& f) const {
      team.for_each_nowait(n, f);
    }
    template <class F>
    void once(const F& f) const {
      f();
    }
    /// With one thread.
    template <class F>
    void for_each_thread(const F& f) const {
      f(0u, 1u, [] {});
    }
  };
  void sort(std::uint32_t n, const device::SortedCodes& codes) const {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> sorted(n);
    for (std::uint32_t i = 0; i < n; ++i) sorted[i] = {codes.keys[i], codes.items[i]};
    std::ranges::stable_sort(sorted, {}, [](const auto& item) { return item.first; });
    for (std::uint32_t i = 0; i < n; ++i) {
      std::tie(codes.keys[i], codes.items[i]) = sorted[i];
      codes.other_keys[i] = 0, codes.other_items[i] = device::kNone;
    }
  }

  template <class F>
  void for_each_nowait(std::uint32_t n, const F& f) const {
    if (n == 0) return;
    const std::uint32_t start = static_cast<std::uint32_t>(++loops_ * 2654435761u % n);
    for (std::uint32_t i = start; i < n; ++i) f(i);
    for (std::uint32_t i = start; i-- > 0;) f(i);
  }
  template <class F>
  void for_each(std::uint32_t n, const F& f) const {
    for_each_nowait(n, f);
  }
  /// With one thread.
  template <class F>
  void for_each_thread(const F& f) const {
    f(0u, 1u, [] {});
  }
  template <class F>
  void once(const F& f) const {
    f();
  }
  template <class F>
  void in_one_block(const F& f) const {
    f(*this);
  }
  /// Completes the items in a different order than that of their dependencies.
  template <class Dataflow>
  void run_dataflow(std::uint32_t n, const Dataflow& dataflow) const {
    std::vector<typename Dataflow::Item> items(n);
    for (std::uint32_t i = 0; i < n; ++i) dataflow.begin(i, &items[i]);
    while (!items.empty()) {
      const std::size_t before = items.size();
      std::ranges::reverse(items);
      std::erase_if(items, [&](auto& item) {
        if (!dataflow.is_ready(&item)) return false;
        dataflow.complete(&item);
        return true;
      });
      if (items.size() == before)
        throw std::logic_error("the items of a dataflow wait for each other");
    }
  }
  template <class Condition>
  void count(std::uint32_t n, const Condition& condition, std::uint32_t* sum) const {
    for (std::uint32_t i = 0; i < n; ++i) *sum += condition(i) ? 1 : 0;
  }
  template <class Measure, class Size, class Place>
  auto scan(std::uint32_t n, const Measure& measure, const Size& size, const Place& place) const {
    std::vector<decltype(size(0))> before(n);
    decltype(size(0)) sum = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      before[i] = sum;
      sum += measure(i);
    }
    for (std::uint32_t i = n; i-- > 0;) {
      if (size(i) != (i + 1 < n ? before[i + 1] : sum) - before[i]) {
        throw std::logic_error("a scan with two different sizes of an item");
      }
      place(i, before[i]);
    }
    return sum;
  }
  template <class BinOf, class Place>
  void partition(std::uint32_t n, std::uint16_t* bins, std::uint32_t* begin, const BinOf& bin_of,
                 const Place& place) const {
    std::vector<std::uint32_t> next(device::kBins + 1);
    for (std::uint32_t i = 0; i < n; ++i) {
      bins[i] = bin_of(i);
      if (bins[i] < device::kBins) ++next[bins[i] + 1u];
    }
    for (std::uint32_t b = 0; b < device::kBins; ++b) next[b + 1] += next[b];
    std::ranges::copy(next, begin);
    for (std::uint32_t i = n; i-- > 0;) {
      if (bins[i] < device::kBins) place(i, next[bins[i]]++, bins[i]);
    }
  }

 private:
  mutable std::uint64_t loops_ = 0;
  mutable std::vector<SharedPiece> memory_;  ///< shared by the threads of a block
};

class HostDevice {
 public:
  template <class T>
  class Buffer {
   public:
    T* data() const { return const_cast<T*>(items_.data()); }
    std::size_t capacity() const { return items_.size(); }
    void reserve(std::size_t count) {
      // Poisoned, because device memory is not initialized.
      if (count <= items_.size()) return;
      items_.assign(count, T{});
      std::fill_n(reinterpret_cast<unsigned char*>(items_.data()), count * sizeof(T),
                  static_cast<unsigned char>(0xcd));
    }
    void swap(Buffer& other) noexcept { items_.swap(other.items_); }

   private:
    std::vector<T> items_;
  };

  int number() const { return 0; }
  cuda::Stream stream() const { return nullptr; }

  template <class T>
  void reserve(Buffer<T>* buffer, std::size_t count, const char*) {
    buffer->reserve(count);
  }
  template <class T>
  void reserve_exactly(Buffer<T>* buffer, std::size_t count, const char*) {
    buffer->reserve(count);
  }
  template <class Program>
  void load() {}
  void release_unused() {}
  template <class T>
  void upload(T* to, const T* from, std::size_t count) {
    std::copy_n(from, count, to);
  }
  template <class T>
  void download(T* to, const T* from, std::size_t count) {
    std::copy_n(from, count, to);
  }
  void fetch(const device::HostCopies& copies, ThreadPool*) {
    for (const device::HostCopy& copy : copies) std::memcpy(copy.to, copy.from, copy.bytes);
  }
  template <class T>
  void copy(T* to, const T* from, std::size_t count) {
    std::copy_n(from, count, to);
  }
  void reserve_pairs(std::size_t, std::size_t) {}
  void find_pairs(const SphereInstance* spheres, std::size_t n, SpherePair* pairs,
                  std::size_t capacity, cuda::ContactCount* count) {
    if (graph_ != nullptr) {
      return graph_->work.push_back([=, this] { find_pairs(spheres, n, pairs, capacity, count); });
    }
    *count = {};
    const ContactSpan found = collider_->find_contacts({spheres, n});
    count->contacts = found.size();
    if (found.size() > capacity) return;
    count->complete = 1;
    for (const SphereContact& c : found) *pairs++ = {c.a, c.b};
  }
  template <class Program>
  void run(const Program& program, std::size_t) {
    if (runs_left_ >= 0 && runs_left_-- == 0) throw DeviceError("a program could not be started");
    if (graph_ == nullptr) {
      program(team_);
    } else {
      graph_->work.push_back([=, this] { program(team_); });
    }
  }
  void wait() {}
  void wait_for_graphs() {}
  void fork(cuda::Stream) {}
  void join(cuda::Stream) {}
  void mark(int) {}
  double elapsed_ms(int from, int to) const { return to - from; }

  /// Runs this number of programs, fails once, and then runs programs again.
  void fail_after(int runs) { runs_left_ = runs; }

  /// Equivalent of a CUDA graph.
  struct Graph {
    std::vector<std::function<void()>> work;
    void launch() const {
      for (const auto& f : work) f();
    }
  };
  /// While it is not null, work on any stream is captured.
  void set_graph(Graph* graph) { captured_ = graph; }
  bool is_capturing(cuda::Stream) const { return captured_ != nullptr; }
  template <class Work>
  void capture(cuda::Stream, const Work& work) {
    graph_ = captured_;
    work();
    graph_ = nullptr;
  }

 private:
  int runs_left_ = -1;
  Graph* captured_ = nullptr;
  Graph* graph_ = nullptr;  ///< of the work in progress
  std::unique_ptr<SphereCollider> collider_ = make_sphere_collider({.backend = Backend::cpu});
  HostTeam team_;
};

inline std::unique_ptr<DeviceWorld> make_host_device_world(const Scene& scene) {
  return std::make_unique<device::DeviceStep<HostDevice>>(scene, std::make_unique<HostDevice>());
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
