/// The triangle meshes and heightfields of the bodies in the memory of a device.
#pragma once

#include "src/collide/mesh_bounds.hpp"
#include "src/world/bodies/body_store.hpp"
#include "src/world/device/block_tree_buffers.hpp"

#include <algorithm>
#include <list>
#include <memory>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

template <class Device>
class MeshBuffers {
 public:
  /// Copies the meshes that are not on the device yet, and removes the others that no body has.
  /// @param bodies bodies of mass 0, sorted by index
  /// @returns the meshes on the device, in the order of their sub-shapes
  const detail::MeshView* upload(const Transfer<Device>& transfer, const BodyStore& bodies,
                                 const std::vector<BodyId>& ids) {
    for (Copy& copy : copies_) copy.in_use = false;
    views_.clear();
    for (const BodyId id : ids) {
      std::visit(
          [&](const auto& shape) {
            if constexpr (detail::kIsMesh<std::decay_t<decltype(shape)>>) {
              views_.push_back(view_of(transfer, shape.data()));
            }
          },
          bodies.shape(id.index));
    }
    transfer.wait();
    copies_.remove_if([](const Copy& copy) { return !copy.in_use; });
    return transfer.put(&device_views_, views_);
  }

 private:
  template <class T>
  using Buffer = typename Device::template Buffer<T>;
  /// A mesh, which copies of its shape share.
  struct Copy {
    std::shared_ptr<const void> data;
    bool in_use = true;
    Buffer<Vec3> vertices;
    Buffer<detail::MeshTriangle> triangles;
    Buffer<std::uint32_t> first_neighbor, neighbors;
    BlockTreeBuffers<Device> tree;
    Buffer<Real> heights;
    Buffer<std::uint8_t> cells;
    Buffer<detail::HeightRange> tiles;
    detail::MeshView view;
  };

  /// @param data MeshData or HeightfieldData
  template <class Data>
  const detail::MeshView& view_of(const Transfer<Device>& transfer,
                                  const std::shared_ptr<const Data>& data) {
    const auto found =
        std::ranges::find_if(copies_, [&](const Copy& copy) { return copy.data == data; });
    if (found != copies_.end()) {
      found->in_use = true;
      return found->view;
    }
    std::list<Copy> made(1);  // kept only once it is complete
    Copy& copy = made.back();
    copy.data = data;
    copy.view = data->view();
    if (copy.view.is_grid()) {
      upload_grid(transfer, &copy);
    } else {
      upload_mesh(transfer, &copy);
    }
    copies_.splice(copies_.end(), made);
    return copy.view;
  }
  void upload_mesh(const Transfer<Device>& transfer, Copy* copy) {
    const detail::MeshView from = copy->view;
    copy->view.vertices = transfer.put(&copy->vertices, from.vertices, from.vertex_count);
    copy->view.triangles = transfer.put(&copy->triangles, from.triangles, from.triangle_count);
    copy->view.first_neighbor =
        transfer.put(&copy->first_neighbor, from.first_neighbor, from.vertex_count + 1);
    copy->view.neighbors = transfer.put(&copy->neighbors, from.neighbors, from.neighbor_count);
    copy->view.tree = copy->tree.upload(transfer, from.tree);
  }
  /// The tree of the tiles is for rays on the host.
  void upload_grid(const Transfer<Device>& transfer, Copy* copy) {
    const detail::GridView from = copy->view.grid;
    copy->view.grid.heights = transfer.put(&copy->heights, from.heights, from.vertex_count());
    copy->view.grid.cells = transfer.put(&copy->cells, from.cells, from.cell_count());
    copy->view.grid.tiles = transfer.put(&copy->tiles, from.tiles, from.tile_count());
    copy->view.tree = {};
  }

  std::list<Copy> copies_;
  std::vector<detail::MeshView> views_;
  Buffer<detail::MeshView> device_views_;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
