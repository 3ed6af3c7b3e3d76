/// Choice of the divisions of a step.
#pragma once

#include "src/world/device/step_data.hpp"
#include "src/world/device/transfer.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Divides steps among several devices, so that each has about as much work. No result of a step
/// depends on the division.
template <class Device>
class StepDivider {
 public:
  /// What a division was made for.
  struct Numbers {
    std::uint64_t completed = 0;  ///< Progress::completed
    ContactSizes contacts;        ///< of the last step
    std::uint32_t pairs = 0;      ///< of swept bounds, in the last step
    BlockCounts blocks;           ///< in the last step
  };

  explicit StepDivider(const Transfer<Device>& transfer) : transfer_(transfer) {}

  /// Divides slots and blocks equally, before the first step of several parts.
  /// @param contacts of the step before, if there was one
  void start(StepData* data, std::uint32_t slots, const ContactSizes& contacts) {
    const std::uint32_t parts = data->parts;
    const auto equal = [parts](std::uint32_t n) {
      return n > 0 ? Division::equal(n, parts) : Division::unknown();
    };
    Divisions& to = data->divisions;
    to.slots = Division::equal(slots, parts);
    to.blocks = Division::equal(slots / kBodiesPerBlock, parts);
    to.pairs = Division::unknown();
    to.spheres = equal(contacts.spheres);
    to.manifolds = equal(contacts.manifolds);
    to.contacts = equal(contacts.spheres + contacts.manifolds);
    is_by_contacts_ = false;
  }

  /// Whether the division is good enough: pages are moved when it changes.
  bool is_current(const Numbers& now) const {
    constexpr std::uint64_t kMostSteps = 256;
    const auto is_close = [](std::uint64_t a, std::uint64_t b) {
      const std::uint64_t difference = a > b ? a - b : b - a;
      return difference <= std::max(b / 8, std::uint64_t{1024});
    };
    const auto all = [](const ContactSizes& sizes) {
      return std::uint64_t{sizes.spheres} + sizes.manifolds;
    };
    return is_by_contacts_ && now.completed < made_for_.completed + kMostSteps &&
           is_close(all(now.contacts), all(made_for_.contacts)) &&
           is_close(now.pairs, made_for_.pairs) &&
           is_close(now.blocks.places, made_for_.blocks.places);
  }

  /// Divides the slots by the contacts of the last step, which had several parts, and what belongs
  /// to the bodies by slots. Waits.
  /// @param contacts its contacts
  void renew(StepData* data, const soft_step::ContactView& contacts, const Numbers& numbers) {
    const std::uint32_t slots = data->step.bodies.capacity;
    const SubShapeView& sub_shapes = data->swept_bounds.sub_shapes;
    const auto spheres = read(contacts.spheres, numbers.contacts.spheres);
    const auto manifolds = read(contacts.manifolds, numbers.contacts.manifolds);
    const auto pairs = read(data->pairs, numbers.pairs);
    const auto sub_shape_bodies = read(sub_shapes.bodies, sub_shapes.ranges.bounded());
    const auto slot_of_sphere = [&](std::uint32_t i) { return spheres[i].key.a; };
    const auto slot_of_manifold = [&](std::uint32_t i) { return manifolds[i].key.a; };
    // The longer list decides. Both are sorted by slot.
    const bool by_spheres = spheres.size() >= manifolds.size();
    const std::uint32_t count = by_spheres ? spheres.size() : manifolds.size();
    const auto slot_of = [&](std::uint32_t i) {
      return by_spheres ? slot_of_sphere(i) : slot_of_manifold(i);
    };
    std::vector<std::uint32_t> first_bodies(numbers.blocks.placed());
    transfer_.read(data->first_of_block, first_bodies.size(), first_bodies.data());
    Divisions to = data->divisions;
    for (std::uint32_t part = 1; part < data->parts; ++part) {
      const std::uint64_t target = load_of(count, slots) * part / data->parts;
      const std::uint32_t contact =
          first_of(count, [&](std::uint32_t i) { return load_of(i, slot_of(i)) >= target; });
      const std::uint64_t of_contacts = std::min(target, kContactLoad * contact);
      auto slot = static_cast<std::uint32_t>((target - of_contacts) / kBodyLoad);
      if (contact > 0) slot = std::max(slot, slot_of(contact - 1) + 1);
      slot = std::min(slot, contact < count ? slot_of(contact) : slots);
      slot = std::max(slot, to.slots.begin[part - 1]);
      to.slots.begin[part] = slot;
      to.spheres.begin[part] =
          first_of(spheres.size(), [&](std::uint32_t i) { return slot_of_sphere(i) >= slot; });
      to.manifolds.begin[part] =
          first_of(manifolds.size(), [&](std::uint32_t i) { return slot_of_manifold(i) >= slot; });
      to.contacts.begin[part] =
          by_spheres ? to.spheres.begin[part] : spheres.size() + to.manifolds.begin[part];
      to.pairs.begin[part] = first_of(pairs.size(), [&](std::uint32_t i) {
        const std::uint32_t a = pairs[i].a;
        return a >= sub_shape_bodies.size() || sub_shape_bodies[a] >= slot;
      });
      // Bodies without a place are in blocks in any order.
      const auto is_lower = [&](std::uint32_t body) { return body < slot; };
      to.blocks.begin[part] =
          numbers.blocks.places > 0
              ? static_cast<std::uint32_t>(std::ranges::count_if(first_bodies, is_lower))
              : static_cast<std::uint32_t>(std::uint64_t{numbers.blocks.all()} * slot / slots);
    }
    data->divisions = to;
    made_for_ = numbers;
    is_by_contacts_ = true;
  }

  /// Sets the divisions that follow from those of slots and of blocks.
  void scale(StepData* data, std::uint32_t slots, std::uint32_t bodies,
             std::uint32_t sub_shapes) const {
    Divisions& to = data->divisions;
    to.bodies = to.slots.scaled(slots, bodies);
    to.sub_shapes = to.slots.scaled(slots, sub_shapes);
    to.places = to.blocks.scaled(1, kBodiesPerBlock);
  }

 private:
  /// Work on a contact and on a body, measured (bench/results/several_gpus.md).
  static constexpr std::uint64_t kContactLoad = 2, kBodyLoad = 5;
  static std::uint64_t load_of(std::uint64_t contacts, std::uint64_t bodies) {
    return kContactLoad * contacts + kBodyLoad * bodies;
  }

  /// Reads items of a list on the device. A short list is copied at once.
  template <class T>
  class ListReader {
   public:
    ListReader(const Transfer<Device>& transfer, const T* list, std::uint32_t size)
        : transfer_(transfer), list_(list), size_(size) {
      constexpr std::uint32_t kMostCopied = 4096;
      if (size > kMostCopied) return;
      items_.resize(size);
      transfer.read(list, size, items_.data());
    }
    std::uint32_t size() const { return size_; }
    T operator[](std::uint32_t i) const {
      if (i < items_.size()) return items_[i];
      T item;
      transfer_.read(list_ + i, 1, &item);
      return item;
    }

   private:
    const Transfer<Device>& transfer_;
    const T* list_;
    std::uint32_t size_;
    std::vector<T> items_;
  };
  template <class T>
  ListReader<T> read(const T* list, std::uint32_t size) const {
    return ListReader<T>(transfer_, list, size);
  }

  /// Lowest i < n for which a condition holds that does not hold for lower ones and holds for all
  /// higher ones; n if there is none.
  template <class Condition>
  static std::uint32_t first_of(std::uint32_t n, const Condition& condition) {
    std::uint32_t begin = 0;
    for (std::uint32_t end = n; begin < end;) {
      const std::uint32_t middle = begin + (end - begin) / 2;
      if (condition(middle)) {
        end = middle;
      } else {
        begin = middle + 1;
      }
    }
    return begin;
  }

  const Transfer<Device>& transfer_;
  Numbers made_for_;
  bool is_by_contacts_ = false;  ///< whether renew() has made the division
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
