/// The triangle meshes of the bodies in the memory of a device.
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
      const auto* mesh = std::get_if<TriangleMesh>(&bodies.shape(id.index));
      if (mesh != nullptr) views_.push_back(view_of(transfer, *mesh));
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
    std::shared_ptr<const detail::MeshData> data;
    bool in_use = true;
    Buffer<Vec3> vertices;
    Buffer<detail::MeshTriangle> triangles;
    Buffer<std::uint32_t> first_neighbor, neighbors;
    BlockTreeBuffers<Device> tree;
    detail::MeshView view;
  };

  const detail::MeshView& view_of(const Transfer<Device>& transfer, const TriangleMesh& mesh) {
    const auto found =
        std::ranges::find_if(copies_, [&](const Copy& copy) { return copy.data == mesh.data(); });
    if (found != copies_.end()) {
      found->in_use = true;
      return found->view;
    }
    std::list<Copy> made(1);  // kept only once it is complete
    Copy& copy = made.back();
    copy.data = mesh.data();
    const detail::MeshView from = copy.data->view();
    copy.view = from;
    copy.view.vertices = transfer.put(&copy.vertices, from.vertices, from.vertex_count);
    copy.view.triangles = transfer.put(&copy.triangles, from.triangles, from.triangle_count);
    copy.view.first_neighbor =
        transfer.put(&copy.first_neighbor, from.first_neighbor, from.vertex_count + 1);
    copy.view.neighbors = transfer.put(&copy.neighbors, from.neighbors, from.neighbor_count);
    copy.view.tree = copy.tree.upload(transfer, from.tree);
    copies_.splice(copies_.end(), made);
    return copy.view;
  }

  std::list<Copy> copies_;
  std::vector<detail::MeshView> views_;
  Buffer<detail::MeshView> device_views_;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
