/// A device on the host: the programs of a device step in one thread, for machines without a GPU.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/world/device/device_step.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Runs the items of a loop in an order that differs from loop to loop, as on a device.
class HostTeam {
 public:
  template <class F>
  void for_each(std::uint32_t n, const F& f) const {
    if (n == 0) return;
    const std::uint32_t start = static_cast<std::uint32_t>(++loops_ * 2654435761u % n);
    for (std::uint32_t i = start; i < n; ++i) f(i);
    for (std::uint32_t i = start; i-- > 0;) f(i);
  }
  std::uint32_t first() const { return 0; }
  std::uint32_t stride() const { return 1; }
  void sync() const {}
  const std::uint32_t* cached_bins(const std::uint32_t* numbers) const { return numbers; }
  template <class F>
  void once(const F& f) const {
    f();
  }
  template <class Condition>
  std::uint32_t count(std::uint32_t n, const Condition& condition) const {
    std::uint32_t result = 0;
    for (std::uint32_t i = 0; i < n; ++i) result += condition(i) ? 1 : 0;
    return result;
  }
  template <class Size, class Place>
  std::uint32_t scan(std::uint32_t n, const Size& size, const Place& place) const {
    std::vector<std::uint32_t> before(n);
    std::uint32_t sum = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      before[i] = sum;
      sum += size(i);
    }
    for (std::uint32_t i = n; i-- > 0;) place(i, before[i]);
    return sum;
  }
  template <class BinOf, class Place>
  void partition(std::uint32_t n, std::uint32_t bins, std::uint32_t* begin, const BinOf& bin_of,
                 const Place& place) const {
    std::vector<std::uint32_t> next(bins + 1);
    for (std::uint32_t i = 0; i < n; ++i) {
      if (bin_of(i) != device::kNone) ++next[bin_of(i) + 1];
    }
    for (std::uint32_t b = 0; b < bins; ++b) next[b + 1] += next[b];
    std::ranges::copy(next, begin);
    for (std::uint32_t i = n; i-- > 0;) {
      if (bin_of(i) != device::kNone) place(i, next[bin_of(i)]++);
    }
  }

 private:
  mutable std::uint64_t loops_ = 0;
};

class HostDevice {
 public:
  template <class T>
  class Buffer {
   public:
    T* data() const { return const_cast<T*>(items_.data()); }
    std::size_t capacity() const { return items_.size(); }
    void reserve(std::size_t count) {
      // Poisoned, because memory of a device is not initialized.
      if (count <= items_.size()) return;
      items_.assign(count, T{});
      std::fill_n(reinterpret_cast<unsigned char*>(items_.data()), count * sizeof(T),
                  static_cast<unsigned char>(0xcd));
    }

   private:
    std::vector<T> items_;
  };

  template <class T>
  void reserve(Buffer<T>* buffer, std::size_t count, const char*) {
    buffer->reserve(count);
  }
  template <class T>
  void upload(T* to, const T* from, std::size_t count) {
    std::copy_n(from, count, to);
  }
  template <class T>
  void download(T* to, const T* from, std::size_t count) {
    std::copy_n(from, count, to);
  }
  template <class T>
  void copy(T* to, const T* from, std::size_t count) {
    std::copy_n(from, count, to);
  }
  void find_pairs(const SphereInstance* spheres, std::size_t n, SpherePair* pairs,
                  std::size_t capacity, cuda::ContactCount* count) {
    *count = {};
    const ContactSpan found = collider_->find_contacts({spheres, n});
    count->contacts = found.size();
    if (found.size() > capacity) return;
    count->complete = 1;
    for (const SphereContact& c : found) *pairs++ = {c.a, c.b};
  }
  template <class Program>
  void run(const Program& program, std::size_t) {
    program(team_);
  }
  void wait() {}

 private:
  std::unique_ptr<SphereCollider> collider_ = make_sphere_collider({.backend = Backend::cpu});
  HostTeam team_;
};

inline std::unique_ptr<DeviceWorld> make_host_device_world(const Scene& scene) {
  return std::make_unique<device::DeviceStep<HostDevice>>(scene, std::make_unique<HostDevice>());
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
