/// Bodies, forces and settings for a World from a fuzzer's bytes: mostly sound, now and then not.
#pragma once

#include <jfpx/world.hpp>

#include "tests/support/bytes.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace fuzz {

Scene draw_scene(test::Bytes& bytes);
BodyDef draw_body(test::Bytes& bytes);
BodyState draw_state(test::Bytes& bytes);
WorldSettings draw_settings(test::Bytes& bytes);
GeneratedContact draw_contact(test::Bytes& bytes, std::span<const BodyId> bodies);

/// A living body, or one that has gone, or never was.
BodyId draw_id(test::Bytes& bytes, std::span<const BodyId> bodies);

/// Adds the force that the bytes ask for.
ForceId add_drawn_force(test::Bytes bytes, World& world);

}  // namespace fuzz
}  // namespace JFPX_ABI
}  // namespace jfpx
