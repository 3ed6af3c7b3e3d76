/// The contacts of a step in the memory of a device.
#pragma once

#include <jfpx/world.hpp>

#include "src/world/bodies/bodies_of_step.hpp"
#include "src/world/contacts/detected_contacts.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/device/transfer.hpp"

#include <algorithm>
#include <cstdint>
#include <tuple>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// The contact set of a step, and data for World::contacts().
template <class Device>
class ContactBuffers {
 public:
  /// Replaces the contacts by another set. Waits for the copies.
  /// @param room number of slots of bodies to reserve memory for
  void upload(const Transfer<Device>& transfer, const soft_step::ContactView& from,
              std::size_t room) {
    sizes_ = {from.sphere_count, from.manifold_count, from.point_count, 0};
    constexpr ArrayIndex kContact = ArrayIndex::contact;
    transfer.put(&spheres_, from.spheres, from.sphere_count, 0, kContact);
    transfer.put(&manifolds_, from.manifolds, from.manifold_count, 0, ArrayIndex::manifold);
    transfer.put(&points_, from.points, from.point_count, 0, ArrayIndex::equal);
    transfer.put(&impulses_, from.impulses, std::size_t{from.sphere_count} + from.point_count, 0,
                 kContact);
    // A device always stores the rolling impulses.
    const std::vector<Vec3> none(from.rolling_impulses != nullptr ? 0 : from.size());
    transfer.put(&rolling_impulses_, none.empty() ? from.rolling_impulses : none.data(),
                 from.size(), 0, kContact);
    transfer.put(&colors_, from.colors, from.size(), 0, kContact);
    put_ranges(transfer, &spheres_of_, from.spheres, from.sphere_count, room);
    put_ranges(transfer, &manifolds_of_, from.manifolds, from.manifold_count, room);
  }

  /// Whether the velocities before a step are stored, for the steps after reserve().
  void keep_velocities(bool keeps) { keeps_velocities_ = keeps; }
  /// Reserves memory for the contacts of the next step, and keeps those of the last step.
  /// @param room number of slots of bodies, as in the last upload
  void reserve(const Transfer<Device>& transfer, const Capacity& capacity, std::size_t room) {
    const std::size_t contacts = std::size_t{capacity.spheres} + capacity.candidates;
    const std::size_t kept = std::size_t{sizes_.spheres} + sizes_.manifolds;
    constexpr ArrayIndex kContact = ArrayIndex::contact;
    grow(transfer, &spheres_, capacity.spheres, sizes_.spheres, kContact);
    grow(transfer, &manifolds_, capacity.candidates, sizes_.manifolds, ArrayIndex::manifold);
    grow(transfer, &points_, capacity.points, sizes_.points);
    grow(transfer, &impulses_, std::size_t{capacity.spheres} + capacity.points,
         std::size_t{sizes_.spheres} + sizes_.points, kContact);
    grow(transfer, &rolling_impulses_, contacts, kept, kContact);
    grow(transfer, &colors_, contacts, kept, kContact);
    grow(transfer, &touches_, capacity.touches, sizes_.touches);
    transfer.room(&spheres_of_, room);
    transfer.room(&manifolds_of_, room);
    transfer.room(&position_before_, room);
    if (!keeps_velocities_) return;
    transfer.room(&velocity_before_, room);
    transfer.room(&angular_velocity_before_, room);
  }
  /// Records the contact counts of a completed step. @param slots of bodies in the step
  void complete(const ContactSizes& sizes, std::size_t slots) {
    sizes_ = sizes;
    slots_ = slots;
  }

  DeviceContacts view() const {
    return {{spheres_.data(), manifolds_.data(), points_.data(), impulses_.data(),
             rolling_impulses_.data(), colors_.data(), 0, 0, 0},
            spheres_of_.data(),
            manifolds_of_.data(),
            touches_.data(),
            position_before_.data(),
            keeps_velocities_ ? velocity_before_.data() : nullptr,
            keeps_velocities_ ? angular_velocity_before_.data() : nullptr};
  }
  const ContactSizes& sizes() const { return sizes_; }
  Touch* touches() const { return touches_.data(); }

  void fetch(const Transfer<Device>& transfer, soft_step::ContactSet* to) const {
    const auto [spheres, manifolds, points, touches] = sizes_;
    to->spheres.resize(spheres);
    to->manifolds.resize(manifolds);
    to->points.resize(points);
    to->impulses.resize(std::size_t{spheres} + points);
    to->rolling_impulses.resize(std::size_t{spheres} + manifolds);
    to->colors.resize(std::size_t{spheres} + manifolds);
    transfer.get(&to->spheres, spheres_);
    transfer.get(&to->manifolds, manifolds_);
    transfer.get(&to->points, points_);
    transfer.get(&to->impulses, impulses_);
    transfer.get(&to->rolling_impulses, rolling_impulses_);
    transfer.get(&to->colors, colors_);
    transfer.wait();
  }

  /// Copies the detected contacts that ContactListMaker reads.
  void fetch_detected(const Transfer<Device>& transfer, const BodiesOfStep& bodies,
                      DetectedContacts* detected) const {
    std::vector<Touch> touches(sizes_.touches);
    detected->position.resize(slots_);
    transfer.get(&touches, touches_);
    transfer.get(&detected->position, position_before_);
    if (keeps_velocities_) {
      detected->velocity.resize(slots_);
      detected->angular_velocity.resize(slots_);
      transfer.get(&detected->velocity, velocity_before_);
      transfer.get(&detected->angular_velocity, angular_velocity_before_);
    }
    transfer.wait();
    std::ranges::sort(
        touches, {}, [](const Touch& t) { return std::tuple(1 - t.of_spheres, t.pair, t.number); });
    detected->contacts.clear();
    detected->generated.clear();
    detected->sphere_count = 0;
    for (const Touch& t : touches) {
      detected->contacts.push_back(without_material(bodies[t.pair.a].id, bodies[t.pair.b].id,
                                                    t.normal, t.point, t.distance));
      detected->sphere_count += t.of_spheres;
    }
  }

 private:
  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  /// Makes the capacity of an array at least `count`, and keeps its first items.
  template <class T>
  static void grow(const Transfer<Device>& transfer, Buffer<T>* array, std::size_t count,
                   std::size_t kept, ArrayIndex index = ArrayIndex::equal) {
    count = std::max(count, kept);
    if (count <= array->capacity() && array->capacity() > 0) return;
    Buffer<T> larger;
    T* const to = transfer.room(&larger, count, {.index = index});
    transfer.copy(to, array->data(), kept);
    array->swap(larger);
  }

  /// By body a: its range of a list that is sorted by body a.
  template <class C>
  static void put_ranges(const Transfer<Device>& transfer, Buffer<Range>* to, const C* contacts,
                         std::uint32_t count, std::size_t room) {
    std::vector<Range> ranges(room);
    for (std::uint32_t i = 0; i < count; ++i) {
      Range& range = ranges[contacts[i].key.a];
      if (range.end == 0) range.begin = i;
      range.end = i + 1;
    }
    transfer.put(to, ranges);
    transfer.wait();
  }

  Buffer<soft_step::SphereContactInput> spheres_;
  Buffer<soft_step::ManifoldInput> manifolds_;
  Buffer<soft_step::PointInput> points_;
  Buffer<soft_step::KeptImpulse> impulses_;
  Buffer<Vec3> rolling_impulses_;
  Buffer<std::uint8_t> colors_;
  Buffer<Range> spheres_of_, manifolds_of_;
  Buffer<Touch> touches_;
  Buffer<Vec3> position_before_, velocity_before_, angular_velocity_before_;
  bool keeps_velocities_ = false;
  ContactSizes sizes_;
  std::size_t slots_ = 0;  ///< of bodies in the step
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
