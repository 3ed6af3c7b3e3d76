/// Tests of two sub-shapes that may touch during a step.
#pragma once

#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/world/contacts/swept_bounds.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Result of a candidate test: contact points for the solver if the sub-shapes may touch during the
/// step, and points of World::contacts() if they touch at its start.
struct CandidateManifold : detail::PairManifold {
  soft_step::ContactKey key;
};

/// Finds the contact of two sub-shapes that may touch during the step. Sensors have no points for
/// the solver. @param found receives the contact
JFPX_HD inline void test_candidate(const SweptBounds& bounds, const Candidate& pair,
                                   CandidateManifold* found) {
  const BodyView& bodies = bounds.bodies;
  found->key = {pair.a, pair.b, bounds.sub_shapes.part(pair.sub_shape_a),
                bounds.sub_shapes.part(pair.sub_shape_b)};
  found->clear();
  const Vec3 motion = bodies.predicted_motion(pair.a) - bodies.predicted_motion(pair.b);
  const Vec3& centre = bodies.position[pair.a];
  find_contact(bounds.sub_shapes, pair.sub_shape_a, pair.sub_shape_b, centre,
               {motion, bounds.margin_of(pair), kMaxReal, centre, bodies.position[pair.b]}, found);
  if (bodies.sensor[pair.a] != 0 || bodies.sensor[pair.b] != 0) found->point_count = 0;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
