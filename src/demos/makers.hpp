/// Factory functions of the demos, and shared parts of their pictures.
#pragma once

#include "src/demos/demo.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {

std::unique_ptr<Demo> make_ballistic(const Options& options);
std::unique_ptr<Demo> make_big_ballistic(const Options& options);
std::unique_ptr<Demo> make_boxes_and_balls(const Options& options);
std::unique_ptr<Demo> make_flight(const Options& options);
std::unique_ptr<Demo> make_fountain(const Options& options);

inline constexpr Colour kBlack{0, 0, 0}, kGrey{0.6F, 0.6F, 0.6F}, kShadow{0.2F, 0.2F, 0.2F};

/// The shadow of an item: the item flattened onto the ground.
/// @param thickness [-], fraction of the item's height
Item shadow_of(const Item& item, Real thickness);
/// Adds `count` lines on the ground, along x from -half_width to half_width, at z = 0, spacing, 2
/// spacing and so on.
void add_ground_lines(View* view, Real half_width, Real spacing, int count);

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
