/// The hulls of a world in the memory of a device.
#pragma once

#include "src/collide/shapes.hpp"
#include "src/world/device/transfer.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Copies hulls to the device when a list of solids with pointers to them is copied.
template <class Device>
class HullBuffers {
 public:
  /// Removes all hulls. Every list of solids must be copied again.
  void clear() { copies_.clear(); }

  /// The items, with pointers to hulls on the device in their members `solid`. Waits for new hulls.
  /// @param room receives a copy of the items if one of them is a hull
  template <class Item>
  const Item* on_device(const Transfer<Device>& transfer, const Item* items, std::size_t count,
                        std::vector<Item>* room) {
    const auto is_hull = [](const Item& item) { return item.solid.hull != nullptr; };
    if (std::none_of(items, items + count, is_hull)) return items;
    room->assign(items, items + count);
    for (Item& item : *room) move_to_device(transfer, &item.solid);
    return room->data();
  }

 private:
  using Words = typename Device::template Buffer<std::uint64_t>;

  void move_to_device(const Transfer<Device>& transfer, detail::Solid* solid) {
    if (solid->hull == nullptr) return;
    const detail::HullView& hull = *solid->hull;
    auto found = copies_.find(hull.serial);
    if (found == copies_.end()) {
      std::map<std::uint64_t, Words> made;  // kept only once it is complete
      put(transfer, hull, &made[hull.serial]);
      found = copies_.insert(made.extract(made.begin())).position;
    }
    solid->hull = reinterpret_cast<const detail::HullView*>(found->second.data());
  }

  /// All arrays of a hull are in one buffer, behind its view.
  static void put(const Transfer<Device>& transfer, const detail::HullView& hull, Words* copy) {
    std::size_t size = words_of<detail::HullView>(1);
    const auto reserve = [&size]<class T>(const T*, std::size_t count) {
      const std::size_t place = size;
      size += words_of<T>(count);
      return place;
    };
    const std::size_t vertices = reserve(hull.vertices, hull.vertex_count);
    const std::size_t faces = reserve(hull.faces, hull.face_count);
    const std::size_t corners = reserve(hull.corners, hull.corner_count);
    const std::size_t edges = reserve(hull.edges, hull.edge_count);
    std::vector<std::uint64_t> words(size);
    const std::uint64_t* const base = transfer.room(copy, size);
    detail::HullView view = hull;
    const auto fill = [&]<class T>(std::size_t place, const T* from, std::size_t count) {
      std::memcpy(&words[place], from, count * sizeof(T));
      return reinterpret_cast<const T*>(base + place);
    };
    view.vertices = fill(vertices, hull.vertices, hull.vertex_count);
    view.faces = fill(faces, hull.faces, hull.face_count);
    view.corners = fill(corners, hull.corners, hull.corner_count);
    view.edges = fill(edges, hull.edges, hull.edge_count);
    view.columns = nullptr;
    view.packed_edges = nullptr;
    std::memcpy(words.data(), &view, sizeof view);
    transfer.put(copy, words.data(), size);
    transfer.wait();
  }
  template <class T>
  static std::size_t words_of(std::size_t count) {
    return (count * sizeof(T) + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t);
  }

  std::map<std::uint64_t, Words> copies_;  ///< by HullView::serial
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
