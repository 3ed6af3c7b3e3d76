/// The leaves of the tree of a triangle mesh, and the vertices of its triangles.
#pragma once

#include <jfpx/config.hpp>

#include "src/bullet/dispatch/concave_fields.hpp"

#include <LinearMath/btAabbUtil2.h>

#include <cstddef>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// An axis-aligned box in the space of a concave shape.
struct LocalBox {
  btVector3 min, max;
};

/// The box in the space of the child of a scaled mesh. A negative scaling exchanges the sides.
inline LocalBox divided(const LocalBox& box, const btVector3& scaling) {
  LocalBox result;
  for (int k = 0; k < 3; ++k) {
    const btScalar inverse = btScalar(1) / scaling[k];
    result.min[k] = (scaling[k] >= 0 ? box.min[k] : box.max[k]) * inverse;
    result.max[k] = (scaling[k] <= 0 ? box.min[k] : box.max[k]) * inverse;
  }
  result.min[3] = 0;
  result.max[3] = 0;
  return result;
}

/// A box for comparisons with the nodes of a quantized tree.
class QuantizedBox {
 public:
  QuantizedBox(const btQuantizedBvh& tree, const LocalBox& box) {
    tree.quantizeWithClamp(min_, box.min, 0);
    tree.quantizeWithClamp(max_, box.max, 1);
#if defined(__SSE2__)
    const auto inverse = [](unsigned short x) { return static_cast<short>(~x); };
    limit_ = _mm_set_epi16(-1, -1, inverse(min_[2]), inverse(min_[1]), inverse(min_[0]),
                           static_cast<short>(max_[2]), static_cast<short>(max_[1]),
                           static_cast<short>(max_[0]));
#endif
  }
  bool overlaps(const btQuantizedBvhNode& node) const {
#if defined(__SSE2__)
    // node.min <= max, and ~node.max <= ~min, in lanes of 16 bits.
    const __m128i inverted = _mm_set_epi16(0, 0, -1, -1, -1, 0, 0, 0);
    const __m128i lanes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(&node));
    const __m128i excess = _mm_subs_epu16(_mm_xor_si128(lanes, inverted), limit_);
    return _mm_movemask_epi8(_mm_cmpeq_epi16(excess, _mm_setzero_si128())) == 0xffff;
#else
    return testQuantizedAabbAgainstQuantizedAabb(min_, max_, node.m_quantizedAabbMin,
                                                 node.m_quantizedAabbMax);
#endif
  }

 private:
  unsigned short min_[3], max_[3];
#if defined(__SSE2__)
  static_assert(sizeof(btQuantizedBvhNode) == 16);
  __m128i limit_;
#endif
};

/// Passes the leaves of Bullet's own traversal to a function.
template <class Leaf>
class LeafCallback final : public btNodeOverlapCallback {
 public:
  explicit LeafCallback(const Leaf& leaf) : leaf_(leaf) {}
  void processNode(int part, int triangle) override { leaf_(part, triangle); }

 private:
  const Leaf& leaf_;
};

/// Calls leaf(part, triangle) for the leaves of the tree of a mesh that overlap the box. As in
/// Bullet, leaves below a node that does not overlap are skipped.
template <class Leaf>
void for_each_leaf(const btBvhTriangleMeshShape& mesh, const LocalBox& box, const Leaf& leaf) {
  const btQuantizedBvh& tree = *tree_of(mesh);
  if (!(tree.*BvhFields::is_quantized) ||
      tree.*BvhFields::traversal_mode != btQuantizedBvh::TRAVERSAL_STACKLESS) {
    LeafCallback<Leaf> callback(leaf);
    tree.reportAabbOverlappingNodex(&callback, box.min, box.max);
    return;
  }
  const int count = tree.*BvhFields::node_count;
  if (count <= 0) return;
  const QuantizedBox quantized(tree, box);
  const btQuantizedBvhNode* node = &(tree.*BvhFields::nodes)[0];
  const btQuantizedBvhNode* const end = node + count;
  while (node < end) {
    const bool is_leaf = node->isLeafNode();
    const bool overlaps = quantized.overlaps(*node);
    if (is_leaf && overlaps) leaf(node->getPartId(), node->getTriangleIndex());
    node += overlaps || is_leaf ? 1 : node->getEscapeIndex();
  }
}

/// The vertices of the triangles of a mesh.
class MeshVertices {
 public:
  explicit MeshVertices(const btTriangleIndexVertexArray& mesh)
      : mesh_(mesh), scaling_(mesh.getScaling()) {}

  void read(int part, int index, btVector3* vertices) {
    if (part != part_) {
      part_ = part;
      arrays_ = &mesh_.getIndexedMeshArray()[part];
    }
    const unsigned char* indices =
        arrays_->m_triangleIndexBase +
        static_cast<std::ptrdiff_t>(index) * arrays_->m_triangleIndexStride;
    switch (arrays_->m_indexType) {
      case PHY_SHORT:
        return read_vertices(reinterpret_cast<const unsigned short*>(indices), vertices);
      case PHY_INTEGER:
        return read_vertices(reinterpret_cast<const unsigned int*>(indices), vertices);
      default:
        return read_vertices(indices, vertices);
    }
  }

 private:
  template <class Index>
  void read_vertices(const Index* indices, btVector3* vertices) const {
    for (int k = 0; k < 3; ++k) {
      const void* vertex =
          arrays_->m_vertexBase + static_cast<std::ptrdiff_t>(indices[k]) * arrays_->m_vertexStride;
      vertices[k] = arrays_->m_vertexType == PHY_FLOAT ? scaled(static_cast<const float*>(vertex))
                                                       : scaled(static_cast<const double*>(vertex));
    }
  }
  template <class Number>
  btVector3 scaled(const Number* p) const {
    return {static_cast<btScalar>(p[0]) * scaling_.x(), static_cast<btScalar>(p[1]) * scaling_.y(),
            static_cast<btScalar>(p[2]) * scaling_.z()};
  }

  const btTriangleIndexVertexArray& mesh_;
  btVector3 scaling_;
  int part_ = -1;
  const btIndexedMesh* arrays_ = nullptr;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
