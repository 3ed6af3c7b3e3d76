/// The trees of the solids of mass 0, and their meshes, in the memory of a device.
#pragma once

#include "src/world/contacts/fixed_trees.hpp"
#include "src/world/device/block_tree_buffers.hpp"
#include "src/world/device/mesh_buffers.hpp"

#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

template <class Device>
class FixedTreeBuffers {
 public:
  /// Builds the trees on the host and copies them, unless the bodies of mass 0 are those of the
  /// last call. The bounds of kinematic solids are not valid: the device computes them in every
  /// step.
  /// @param margin SweptBounds::largest_margin
  /// @returns whether the trees are new
  bool upload(const Transfer<Device>& transfer, const BodyStore& bodies, Real margin) {
    if (bodies.fixed_version() == version_) return false;
    ids_.clear();
    for (const BodyId id : bodies.ids()) {
      if (!bodies.movable(id.index)) ids_.push_back(id);
    }
    table_.set_bodies(bodies, ids_);
    margins_.resize(table_.ranges().bounded());
    swept_.resize(table_.ranges().bounded());
    const SweptBounds bounds{.bodies = bodies.view_without_ids(),
                             .sub_shapes = table_.view(),
                             .margins = margins_.data(),
                             .swept = swept_.data(),
                             .largest_margin = margin};
    for (std::uint32_t i = table_.ranges().fixed_begin(); i < table_.ranges().bounded(); ++i) {
      bodies.kinematic(bounds.sub_shapes.body(i)) ? bounds.enclose(i) : bounds.sweep(i);
    }
    trees_.set_bodies(table_, bounds);
    view_ = {immovable_.upload(transfer, trees_.view().immovable),
             kinematic_.upload(transfer, trees_.view().kinematic)};
    meshes_ = mesh_buffers_.upload(transfer, bodies, ids_);
    transfer.wait();
    version_ = bodies.fixed_version();
    return true;
  }
  /// The next upload() copies the trees.
  void clear() { version_ = 0; }
  const FixedTreesView& view() const { return view_; }
  /// By mesh, in the order of their sub-shapes.
  const detail::MeshView* meshes() const { return meshes_; }

 private:
  BlockTreeBuffers<Device> immovable_, kinematic_;
  MeshBuffers<Device> mesh_buffers_;
  const detail::MeshView* meshes_ = nullptr;
  FixedTreesView view_;
  std::uint64_t version_ = 0;  ///< BodyStore::fixed_version() of the trees; 0: none
  // On the host, during upload().
  std::vector<BodyId> ids_;
  SubShapeTable table_;
  std::vector<Real> margins_;
  std::vector<SphereInstance> swept_;
  FixedTrees trees_;
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx
