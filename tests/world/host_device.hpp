/// A device on the host, for machines without a GPU: runs the programs of a device step in one
/// thread, or in one thread for each part.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/base/atomic.hpp"
#include "src/world/device/device_step.hpp"
#include "src/world/device/warp_items.hpp"

#include <algorithm>
#include <barrier>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Runs the items of a loop in an order that differs between loops, as on a device. Each part of a
/// team is a thread.
class HostTeam {
 public:
  /// What the parts of a team share.
  struct Shared {
    explicit Shared(std::uint32_t parts)
        : barrier(static_cast<std::ptrdiff_t>(parts)), sums(parts) {}
    std::barrier<> barrier;
    std::vector<std::uint64_t> sums;  ///< by part, of a scan
  };

  /// @param seed differs between teams, and selects the order of items
  HostTeam(Shared* shared, std::uint32_t part, std::uint32_t parts, std::uint64_t seed)
      : shared_(shared), part_(part), parts_(parts), loops_(seed) {}

  void sync() const {
    if (shared_ != nullptr) shared_->barrier.arrive_and_wait();
  }
  /// Differs between runs of programs, so that rows and bodies are distributed differently.
  std::uint32_t warps() const { return 1u << random_bits() % 8; }
  const device::RowBins& cached_bins(const device::RowBins* bins) const { return bins[part_]; }
  std::uint32_t part() const { return part_; }
  HostTeam team_of_part() const {
    HostTeam team(shared_, 0, 1, ++loops_);
    team.has_barriers_of_others_ = parts_ > 1;
    return team;
  }

  struct alignas(64) SharedPiece {
    SharedPiece() { std::ranges::fill(numbers, std::nan("")); }  // like uninitialized memory
    double numbers[8];
  };
  /// Calls f(block, threads) for all blocks < n.
  template <class F>
  void for_blocks(std::uint32_t n, const F& f, const device::Division* division) const {
    const auto run = [&](std::uint32_t block) {
      memory_.clear();
      f(block, Threads{*this, &memory_});
    };
    for_each_nowait(n, run, division);
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
      team.visit({0, n}, f);
    }
    template <class F>
    void once(const F& f) const {
      f();
    }
    std::uint32_t scan(std::uint32_t n, std::uint32_t* numbers) const {
      const std::uint32_t sum = std::accumulate(numbers, numbers + n, 0u);
      std::exclusive_scan(numbers, numbers + n, numbers, 0u);
      return sum;
    }
    /// With one thread.
    template <class F>
    void for_each_thread(const F& f) const {
      f(0u, 1u, [] {});
    }
  };
  Threads threads() const {
    memory_.clear();
    return {*this, &memory_};
  }
  void sort(std::uint32_t n, const device::SortedCodes& codes) const {
    once([&] {
      std::vector<std::pair<std::uint64_t, std::uint32_t>> sorted(n);
      for (std::uint32_t i = 0; i < n; ++i) sorted[i] = {codes.keys[i], codes.items[i]};
      std::ranges::stable_sort(sorted, {}, [](const auto& item) { return item.first; });
      for (std::uint32_t i = 0; i < n; ++i) {
        std::tie(codes.keys[i], codes.items[i]) = sorted[i];
        codes.other_keys[i] = 0, codes.other_items[i] = device::kNone;
      }
    });
    sync();
  }

  template <class F>
  void for_each_nowait(std::uint32_t n, const F& f,
                       const device::Division* division = nullptr) const {
    visit(device::range_of_part(n, part_, parts_, division), f);
  }
  template <class F>
  void for_each(std::uint32_t n, const F& f, const device::Division* division = nullptr) const {
    for_each_nowait(n, f, division);
    sync();
  }
  template <class F>
  void for_each_divergent(std::uint32_t n, const F& f,
                          const device::Division* division = nullptr) const {
    for_each_nowait(n, f, division);
  }
  /// With one thread.
  template <class F>
  void for_each_thread(const F& f) const {
    f(0u, 1u, [&] { sync(); });
  }
  template <class F>
  void once(const F& f) const {
    if (part_ == 0) f();
  }
  template <class F>
  void in_one_block(const F& f) const {
    once([&] { f(HostTeam(nullptr, 0, 1, ++loops_)); });
  }
  /// Completes the items in a different order than that of their dependencies, or, in some runs,
  /// warp by warp, as a device with a single warp.
  template <class Dataflow>
  void run_dataflow(std::uint32_t n, const Dataflow& dataflow) const {
    if (random_bits() >= 1u << 15) return run_warps(n, dataflow);
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
  void count(std::uint32_t n, const Condition& condition, std::uint32_t* sum,
             const device::Division* division = nullptr) const {
    std::uint32_t mine = 0;
    const auto add = [&](std::uint32_t i) { mine += condition(i) ? 1 : 0; };
    for_each_nowait(n, add, division);
    if (mine > 0) atomic_add(sum, mine);
  }
  template <class Measure, class Size, class Place>
  auto scan(std::uint32_t n, const Measure& measure, const Size& size, const Place& place,
            const device::Division* division = nullptr) const {
    using Number = decltype(size(0));
    const device::Range mine = device::range_of_part(n, part_, parts_, division);
    std::vector<Number> before(mine.end - mine.begin + 1);
    for (std::uint32_t i = mine.begin; i < mine.end; ++i) {
      before[i - mine.begin + 1] = before[i - mine.begin] + measure(i);
    }
    Number first = 0, total = before.back();
    if (!has_barriers_of_others_) shared_->sums[part_] = total;
    sync();
    if (!has_barriers_of_others_) {
      total = 0;
      for (std::uint32_t part = 0; part < parts_; ++part) {
        if (part == part_) first = total;
        total += static_cast<Number>(shared_->sums[part]);
      }
    }
    for (std::uint32_t i = mine.end; i-- > mine.begin;) {
      const std::uint32_t k = i - mine.begin;
      if (size(i) != before[k + 1] - before[k]) {
        throw std::logic_error("a scan with two different sizes of an item");
      }
      place(i, first + before[k]);
    }
    sync();
    return total;
  }
  template <class BinOf, class PartOf, class Place>
  void partition(const device::TwoLists& lists, std::uint16_t* bins,
                 device::PartState* const* states, device::RowBins* begin, std::uint32_t capacity,
                 const BinOf& bin_of, const PartOf& part_of, const Place& place) const {
    constexpr std::uint32_t kStride = device::kBins + 1;
    std::vector<std::uint32_t> items;
    const auto add = [&](std::uint32_t n, const device::Division* division, std::uint32_t offset) {
      const device::Range mine = device::range_of_part(n, part_, parts_, division);
      for (std::uint32_t i = mine.begin; i < mine.end; ++i) items.push_back(offset + i);
    };
    add(lists.first, lists.division_of_first, 0);
    add(lists.second, lists.division_of_second, lists.first);
    std::vector<std::uint32_t> next(parts_ * kStride);
    for (const std::uint32_t i : items) {
      std::uint32_t bin = bin_of(i);
      if (bin < device::kBins) {
        if (parts_ > 1) bin += part_of(i, static_cast<std::uint16_t>(bin)) * kStride;
        ++next[bin];
      }
      bins[i] = static_cast<std::uint16_t>(bin);
    }
    for (std::uint32_t b = 0; b < parts_ * kStride; ++b) {
      if (next[b] > 0) next[b] = atomic_add(&states[part_]->bin_sizes[b], next[b]);
    }
    sync();
    for (std::uint32_t part = 0; part < parts_; ++part) {
      std::uint32_t first = part * capacity;
      for (std::uint32_t b = 0; b < kStride; ++b) {
        if (part_ == 0) begin[part].begin[b] = first;
        for (std::uint32_t from = 0; from < parts_; ++from) {
          if (from == part_) next[part * kStride + b] += first;
          first += states[from]->bin_sizes[part * kStride + b];
        }
      }
    }
    std::ranges::reverse(items);
    for (const std::uint32_t i : items) {
      const std::uint32_t bin = bins[i];
      if (bin < device::kMostParts * kStride) {
        place(i, next[bin]++, static_cast<std::uint16_t>(bin % kStride));
      }
    }
    sync();
  }

 private:
  /// 16 bits that are constant in a run of a program.
  std::uint32_t random_bits() const {
    return static_cast<std::uint32_t>(loops_ >> 32) * 2654435761u >> 16;
  }
  template <class Dataflow>
  static void run_warps(std::uint32_t n, const Dataflow& dataflow) {
    constexpr std::uint32_t kLanes = device::WarpItems::kLanes;
    for (std::uint32_t first = 0; first < n; first += kLanes) {
      std::vector<typename Dataflow::Item> items(std::min(kLanes, n - first));
      for (std::uint32_t i = 0; i < items.size(); ++i) dataflow.begin(first + i, &items[i]);
      for (auto& item : items) {
        if (!dataflow.is_ready(&item)) throw std::logic_error("a warp waits for a later one");
      }
      for (std::size_t i = items.size(); i-- > 0;) dataflow.complete(&items[i]);
    }
  }

  template <class F>
  void visit(const device::Range& range, const F& f) const {
    const std::uint32_t n = range.end - range.begin;
    if (n == 0) return;
    const std::uint32_t start =
        range.begin + static_cast<std::uint32_t>(++loops_ * 2654435761u % n);
    for (std::uint32_t i = start; i < range.end; ++i) f(i);
    for (std::uint32_t i = start; i-- > range.begin;) f(i);
  }

  Shared* shared_;  ///< null: without other parts and without a barrier
  std::uint32_t part_, parts_;
  bool has_barriers_of_others_ = false;  ///< whether it is a team of one of several parts
  mutable std::uint64_t loops_;
  mutable std::vector<SharedPiece> memory_;  ///< shared by the threads of a block
};

class HostDevice {
 public:
  explicit HostDevice(std::uint32_t parts = 1)
      : parts_(parts), states_(parts), shared_(1), shared_by_all_(parts) {}

  template <class T>
  class Buffer {
   public:
    T* data() const { return const_cast<T*>(items_.data()); }
    std::size_t capacity() const { return items_.size(); }
    /// Poisoned, because device memory is not initialized.
    void replace(std::size_t count) {
      items_.assign(count, T{});
      std::fill_n(reinterpret_cast<unsigned char*>(items_.data()), count * sizeof(T),
                  static_cast<unsigned char>(0xcd));
    }
    void swap(Buffer& other) noexcept { items_.swap(other.items_); }

   private:
    std::vector<T> items_;
  };

  int number() const { return 0; }
  std::uint32_t parts() const { return parts_; }
  device::PartState* part_state(std::uint32_t part) { return &states_[part]; }
  void divide(std::uint32_t, const device::Divisions& divisions) { divisions_ = divisions; }
  const device::Divisions& divisions() const { return divisions_; }  ///< of the last step
  cuda::Stream stream() const { return nullptr; }

  template <class T>
  void reserve(Buffer<T>* buffer, std::size_t count, const char*, const PageLayout&) {
    if (count > buffer->capacity()) buffer->replace(count);
  }
  template <class T>
  void reserve_exactly(Buffer<T>* buffer, std::size_t count, const char* what,
                       const PageLayout& layout) {
    reserve(buffer, count, what, layout);
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
  void run(const Program& program, std::size_t, std::uint32_t parts = 1) {
    if (runs_left_ >= 0 && runs_left_-- == 0) throw DeviceError("a program could not be started");
    if (graph_ == nullptr) {
      run_on_parts(program, parts);
    } else {
      graph_->work.push_back([=, this] { run_on_parts(program, parts); });
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
  template <class Program>
  void run_on_parts(const Program& program, std::uint32_t parts) {
    const std::uint64_t seed = ++runs_ << 32;
    if (parts == 1) return program(HostTeam(&shared_, 0, 1, seed));
    std::vector<std::thread> others;
    const auto run_part = [&](std::uint32_t part) {
      if (part == runs_ % parts) std::this_thread::sleep_for(std::chrono::microseconds(20));
      Program mine = program;
      mine.data.part = part;
      mine(HostTeam(&shared_by_all_, part, parts, seed + part));
    };
    for (std::uint32_t part = 1; part < parts; ++part) others.emplace_back(run_part, part);
    run_part(0);
    for (std::thread& thread : others) thread.join();
  }

  std::uint32_t parts_;
  device::Divisions divisions_;
  std::vector<device::PartState> states_;
  HostTeam::Shared shared_, shared_by_all_;
  std::uint64_t runs_ = 0;
  int runs_left_ = -1;
  Graph* captured_ = nullptr;
  Graph* graph_ = nullptr;  ///< of the work in progress
  std::unique_ptr<SphereCollider> collider_ = make_sphere_collider({.backend = Backend::cpu});
};

inline std::unique_ptr<DeviceWorld> make_host_device_world(const Scene& scene) {
  return std::make_unique<device::DeviceStep<HostDevice>>(scene, std::make_unique<HostDevice>());
}
/// A device with two parts, which share worlds with blocks.
inline std::unique_ptr<DeviceWorld> make_two_part_world(const Scene& scene) {
  return std::make_unique<device::DeviceStep<HostDevice>>(scene, std::make_unique<HostDevice>(2));
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
