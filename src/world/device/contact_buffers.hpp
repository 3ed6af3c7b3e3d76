/// The contacts of a step in the memory of a device.
#pragma once

#include <jfpx/world.hpp>

#include "src/world/bodies_of_step.hpp"
#include "src/world/detected_contacts.hpp"
#include "src/world/device/step_data.hpp"
#include "src/world/device/transfer.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// The contact set of a step, and what World::contacts() needs.
template <class Device>
class ContactBuffers {
 public:
  /// The contacts become those of another set. Waits for the copies.
  /// @param room number of slots of bodies to reserve memory for
  void upload(const Transfer<Device>& transfer, const soft_step::ContactView& from,
              std::size_t room) {
    counts_ = {from.sphere_count, from.manifold_count, from.point_count};
    touch_count_ = 0;
    transfer.put(&spheres_, from.spheres, from.sphere_count);
    transfer.put(&manifolds_, from.manifolds, from.manifold_count);
    transfer.put(&points_, from.points, from.point_count);
    transfer.put(&impulses_, from.impulses, std::size_t{from.sphere_count} + from.point_count);
    // A device always has the rolling impulses.
    const std::vector<Vec3> none(from.rolling_impulses != nullptr ? 0 : from.size());
    transfer.put(&rolling_impulses_, none.empty() ? from.rolling_impulses : none.data(),
                 from.size());
    transfer.put(&colors_, from.colors, from.size());
    put_ranges(transfer, &spheres_of_, from.spheres, from.sphere_count, room);
    put_ranges(transfer, &manifolds_of_, from.manifolds, from.manifold_count, room);
  }

  /// Makes room for the contacts that a step finds. @param room number of slots of bodies
  void reserve(const Transfer<Device>& transfer, const Capacity& capacity, std::size_t room,
               StepData* data) {
    const std::size_t contacts = std::size_t{capacity.spheres} + capacity.candidates;
    slots_ = data->step.bodies.capacity;
    transfer.room(&spheres_, capacity.spheres);
    transfer.room(&manifolds_, capacity.candidates);
    transfer.room(&points_, capacity.points);
    transfer.room(&impulses_, std::size_t{capacity.spheres} + capacity.points);
    transfer.room(&rolling_impulses_, contacts);
    transfer.room(&colors_, contacts);
    transfer.room(&spheres_of_, room);
    transfer.room(&manifolds_of_, room);
    data->now = view();
    data->touches = transfer.room(&touches_, capacity.touches);
    data->position_before = transfer.room(&position_before_, room);
  }

  /// A complete step has found these numbers of contacts.
  void complete(const Counters& counters) {
    counts_ = {counters.spheres, counters.manifolds, counters.points};
    touch_count_ = counters.touches;
  }

  DeviceContacts view() const {
    DeviceContacts result{{spheres_.data(), manifolds_.data(), points_.data(), impulses_.data(),
                           rolling_impulses_.data(), colors_.data(), 0, 0, 0},
                          spheres_of_.data(),
                          manifolds_of_.data(),
                          {}};
    std::ranges::copy(counts_, result.counts);
    return result;
  }
  std::size_t sphere_count() const { return counts_[0]; }
  std::size_t manifold_count() const { return counts_[1]; }
  Touch* touches() const { return touches_.data(); }
  std::uint32_t touch_count() const { return touch_count_; }

  void fetch(const Transfer<Device>& transfer, soft_step::ContactSet* to) const {
    const auto [spheres, manifolds, points] = counts_;
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

  /// What detection leaves on the host, for ContactListMaker.
  void fetch_detected(const Transfer<Device>& transfer, const BodiesOfStep& bodies,
                      DetectedContacts* detected) const {
    std::vector<Touch> touches(touch_count_);
    detected->position.resize(slots_);
    transfer.get(&touches, touches_);
    transfer.get(&detected->position, position_before_);
    transfer.wait();
    std::ranges::sort(
        touches, {}, [](const Touch& t) { return std::tuple(1 - t.of_spheres, t.pair, t.number); });
    detected->others.clear();
    detected->generated.clear();
    detected->other_spheres = 0;
    for (const Touch& t : touches) {
      detected->others.push_back(
          {bodies[t.pair.a].id, bodies[t.pair.b].id, t.normal, t.point, t.distance});
      detected->other_spheres += t.of_spheres;
    }
  }

 private:
  template <class T>
  using Buffer = typename Device::template Buffer<T>;

  /// By body a: its range of a list that is sorted by it.
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
  std::array<std::uint32_t, 3> counts_{};  ///< of spheres, manifolds and points
  Buffer<Touch> touches_;
  std::uint32_t touch_count_ = 0;
  Buffer<Vec3> position_before_;
  std::size_t slots_ = 0;  ///< of bodies in the step
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
