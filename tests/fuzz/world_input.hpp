/// Bodies, forces and settings for a World from the bytes of a fuzzer: mostly valid, sometimes not.
#pragma once

#include <jfpx/world.hpp>

#include "tests/support/bytes.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace fuzz {

Scene draw_scene(test::Bytes& bytes);
BodyDef draw_body(test::Bytes& bytes);
MotionLocks draw_locks(test::Bytes& bytes);
CollisionFilter draw_filter(test::Bytes& bytes);
BodyState draw_state(test::Bytes& bytes);
WorldSettings draw_settings(test::Bytes& bytes);
GeneratedContact draw_contact(test::Bytes& bytes, std::span<const BodyId> bodies);

Joint draw_joint(test::Bytes& bytes, std::span<const BodyId> bodies);

/// The id of a living body, or of a removed one, or an unknown one.
BodyId draw_id(test::Bytes& bytes, std::span<const BodyId> bodies);

/// Adds a force drawn from the bytes.
ForceId add_drawn_force(test::Bytes bytes, World& world);

}  // namespace fuzz
}  // namespace JFPX_ABI
}  // namespace jfpx
