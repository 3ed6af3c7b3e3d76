/// Contact points of two faces of polyhedra.
#pragma once

#include "src/collide/contact_basis.hpp"
#include "src/collide/pair_manifold.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Selects some of any number of points of a contact: those that are farthest in four or eight
/// directions of its plane, and the deepest one; at most five or eight. Of points that are equally
/// far, the first is kept, so that the selection depends on the order of the points alone.
template <int kDirections>
class DirectedSelection {
 public:
  /// @param normal unit, of the contact
  JFPX_HD explicit DirectedSelection(const Vec3& normal) {
    const ContactBasis basis = contact_basis(normal);
    tangent_ = basis.tangent;
    bitangent_ = basis.bitangent;
  }

  JFPX_HD void add(const Vec3& point, Real distance, std::uint32_t feature) {
    constexpr Real kDiagonal = Real(0.70710678118654752440);
    const Real u = dot(tangent_, point), v = dot(bitangent_, point);
    const Real p = (u + v) * kDiagonal, q = (u - v) * kDiagonal;
    const Real reach[8] = {u, p, v, -q, -u, -p, -v, q};
    const Item item{point, distance, feature};
    for (int i = 0; i < kDirections; ++i) {
      const Real along = reach[i * (8 / kDirections)];
      if (count_ == 0 || along > reach_[i]) {
        reach_[i] = along;
        items_[i] = item;
      }
    }
    if (count_ == 0 || distance < deepest_.distance) deepest_ = item;
    ++count_;
  }
  JFPX_HD bool is_empty() const { return count_ == 0; }

  /// Calls visit(point, distance, feature) for the selected points, each once.
  template <class Visit>
  JFPX_HD void visit(const Visit& visit) const {
    if (count_ == 0) return;
    Item chosen[kMost];
    int size = 0;
    bool has_deepest = false;
    for (int i = 0; i < kDirections; ++i) {
      bool is_new = true;
      for (int k = 0; k < size; ++k) is_new &= chosen[k].feature != items_[i].feature;
      if (!is_new) continue;
      chosen[size++] = items_[i];
      has_deepest |= items_[i].feature == deepest_.feature;
    }
    if (!has_deepest) chosen[size < kMost ? size++ : kMost - 1] = deepest_;
    for (int k = 0; k < size; ++k) visit(chosen[k].point, chosen[k].distance, chosen[k].feature);
  }

 private:
  static constexpr int kMost = kDirections == 4 ? 5 : 8;
  static_assert((kDirections == 4 || kDirections == 8) && kMost <= PairManifold::kMaxPoints);
  struct Item {
    Vec3 point;
    Real distance = 0;
    std::uint32_t feature = 0;
  };
  Vec3 tangent_, bitangent_;
  Real reach_[kDirections] = {};
  Item items_[kDirections], deepest_;
  int count_ = 0;
};
using PointSelection = DirectedSelection<8>;

/// Numbers of the points of two faces, unique for the pair of faces: a corner of the incident face,
/// its crossing with side j of the reference face, or a corner of the reference face.
struct PointFeature {
  static constexpr std::uint32_t kCorners = 128;
  JFPX_HD static std::uint32_t corner(int k) { return static_cast<std::uint32_t>(k) * kCorners; }
  JFPX_HD static std::uint32_t crossing(int k, int j, bool enters) {
    const auto side = static_cast<std::uint32_t>(j);
    return (static_cast<std::uint32_t>(k) + (enters ? 0 : kCorners)) * kCorners + side + 1;
  }
  JFPX_HD static std::uint32_t reference_corner(int j) {
    return 2 * kCorners * kCorners + static_cast<std::uint32_t>(j);
  }
  static constexpr std::uint32_t kCount = 2 * kCorners * kCorners + kCorners;
};

/// A polygon: the corners in order, and a unit normal. Only the reference face must be
/// counterclockwise seen from its normal.
template <class CornerOf>
struct FacePolygon {
  int count;
  CornerOf corner;  ///< function from a number to a point
  Vec3 normal;

  JFPX_HD int next(int k) const { return k + 1 == count ? 0 : k + 1; }
};
template <class CornerOf>
JFPX_HD FacePolygon<CornerOf> make_face(int count, const CornerOf& corner, const Vec3& normal) {
  return {count, corner, normal};
}

/// Finds the corners of the part of the incident face that is above or below the reference face:
/// edges of the incident face, clipped against the sides of the reference face (Cyrus and Beck
/// 1978), and corners of the reference face that are inside the incident face. Needs no memory for
/// polygons, which may have more than a hundred corners.
/// @param is_kept  function of a side of the reference face: whether points on it are kept
/// @param slack    [m], by which the reference face is enlarged at sides that are not kept
/// @param add      receives point on the incident face, distance from the reference face along its
///   normal, PointFeature
template <class Reference, class Incident, class IsKept, class Add>
JFPX_HD void visit_face_points(const Reference& reference, const Incident& incident,
                               const IsKept& is_kept, Real slack, const Add& add) {
  const Vec3& n = reference.normal;
  const Vec3 origin = reference.corner(0);
  const auto height = [&](const Vec3& p) { return dot(n, p - origin); };
  for (int k = 0; k < incident.count; ++k) {
    const Vec3 from = incident.corner(k), to = incident.corner(incident.next(k));
    Real enter = 0, leave = 1;
    int enters_at = -1, leaves_at = -1;
    bool is_inside = true;
    for (int j = 0; j < reference.count && is_inside; ++j) {
      const Vec3 start = reference.corner(j);
      const Vec3 outward = cross(reference.corner(reference.next(j)) - start, n);
      const Real limit = is_kept(j) ? Real(0) : slack * length(outward);
      const Real d_from = dot(outward, from - start) - limit;
      const Real d_to = dot(outward, to - start) - limit;
      if (d_from > 0 && d_to > 0) is_inside = false;
      if (d_from > 0 && !(d_to > 0)) {
        const Real t = d_from / (d_from - d_to);
        if (t > enter) enter = t, enters_at = j;
      }
      if (!(d_from > 0) && d_to > 0) {
        const Real t = d_from / (d_from - d_to);
        if (t < leave) leave = t, leaves_at = j;
      }
    }
    if (!is_inside || enter > leave) continue;
    const auto add_at = [&](Real t, std::uint32_t feature) {
      const Vec3 p = add_scaled(from, to - from, t);
      add(p, height(p), feature);
    };
    if (enters_at < 0) {
      add(from, height(from), PointFeature::corner(k));
    } else if (is_kept(enters_at)) {
      add_at(enter, PointFeature::crossing(k, enters_at, true));
    }
    if (leaves_at >= 0 && is_kept(leaves_at)) {
      add_at(leave, PointFeature::crossing(k, leaves_at, false));
    }
  }
  // The plane of the incident face above the corners of the reference face.
  constexpr Real kLeastCosine = Real(0.02);
  const Real cosine = dot(incident.normal, n);
  if (!(absolute(cosine) > kLeastCosine)) return;
  for (int j = 0; j < reference.count; ++j) {
    if (!is_kept(j) || !is_kept(j == 0 ? reference.count - 1 : j - 1)) continue;
    const Vec3 corner = reference.corner(j);
    bool any_left = false, any_right = false;
    for (int k = 0; k < incident.count; ++k) {
      const Vec3 from = incident.corner(k);
      const Real side = dot(cross(incident.corner(incident.next(k)) - from, n), corner - from);
      any_left |= side > 0;
      any_right |= side < 0;
    }
    if (any_left && any_right) continue;
    const Real above = dot(incident.normal, incident.corner(0) - corner) / cosine;
    add(add_scaled(corner, n, above), above, PointFeature::reference_corner(j));
  }
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
