/// The makers behind the table of demos, and what their drawings share.
#pragma once

#include "src/demos/demo.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {

std::unique_ptr<Demo> make_ballistic(const Options& options);
std::unique_ptr<Demo> make_big_ballistic(const Options& options);
std::unique_ptr<Demo> make_boxes_and_balls(const Options& options);
std::unique_ptr<Demo> make_flight(const Options& options);

inline constexpr Colour kBlack{0, 0, 0}, kGrey{0.6F, 0.6F, 0.6F}, kShadow{0.2F, 0.2F, 0.2F};

/// The item flattened onto the ground below it, `thickness` [-] of its height.
Item shadow_of(const Item& item, Real thickness);
/// Lines along x, from -half_width to half_width, at z = 0, spacing, ... (count of them), y = 0.
void add_ground_lines(View* view, Real half_width, Real spacing, int count);

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
