/// Tests of two sub-shapes that may touch during a step.
#pragma once

#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/world/contacts/recycle.hpp"
#include "src/world/contacts/swept_bounds.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

JFPX_HD inline soft_step::ContactKey key_of(const SubShapeView& sub_shapes, const Candidate& pair) {
  return {pair.a, pair.b, sub_shapes.part(pair.sub_shape_a),
          sub_shapes.is_mesh(pair.sub_shape_b) ? pair.element : sub_shapes.part(pair.sub_shape_b)};
}

/// Whether the contact of a pair may be recycled.
JFPX_HD inline bool is_recyclable(const SubShapeView& sub_shapes, const Candidate& pair) {
  return sub_shapes.has_flat_faces(pair.sub_shape_a) && sub_shapes.has_flat_faces(pair.sub_shape_b);
}

/// Recycles the contact of the last step of a pair for which is_recyclable().
/// @param last_points points of the contacts of the last step
/// @param find_last   function that returns the contact of the last step with a key, or null
/// @param found       receives the contact
/// @returns false if there is none, or it needs a full test
template <class FindLast>
JFPX_HD inline bool recycle_last(const SweptBounds& bounds, const Candidate& pair,
                                 const soft_step::PointInput* last_points,
                                 const FindLast& find_last, CandidateManifold* found) {
  found->key = key_of(bounds.sub_shapes, pair);
  found->clear();
  const soft_step::ManifoldInput* last = find_last(found->key);
  return last != nullptr && recycle(bounds, pair, *last, last_points, found);
}

/// Finds the contact of two sub-shapes that may touch during the step. Sensors have no points for
/// the solver. @param found receives the contact
JFPX_HD inline void test_fully(const SweptBounds& bounds, const Candidate& pair,
                               CandidateManifold* found) {
  const BodyView& bodies = bounds.bodies;
  found->key = key_of(bounds.sub_shapes, pair);
  found->clear();
  found->tested = {};
  const Vec3 motion = bounds.motion_of(pair);
  const Vec3& centre = bodies.position[pair.a];
  const Real margin = bounds.margin_of(pair);
  // Farther shapes do not meet. Boxes are then separated by the first axis that shows it. The slack
  // is more than rounding and the preference for an earlier axis change.
  const Real limit = (margin + length(motion)) * Real(1.1);
  find_contact(bounds.sub_shapes, pair.sub_shape_a, pair.sub_shape_b, pair.element, centre,
               {motion, margin, limit, centre, bodies.position[pair.b], bounds.hull_kernels},
               found);
  if (bodies.sensor[pair.a] != 0 || bodies.sensor[pair.b] != 0) found->point_count = 0;
  if (found->is_steady && found->point_count > 0 && is_recyclable(bounds.sub_shapes, pair)) {
    note_test(bodies, found);
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
