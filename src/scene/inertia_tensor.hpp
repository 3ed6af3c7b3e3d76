/// Inertia tensors that users give: are they of some body, and what is their inverse?
#pragma once

#include <jfpx/math.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// What keeps a tensor from being the inertia of a body; null if nothing does. A body's tensor is
/// symmetric, positive definite, and none of its principal moments exceeds the sum of the others.
const char* inertia_must_be(const Mat3& tensor);

/// @param tensor one about which inertia_must_be() has nothing to say
Mat3 inverse_inertia(const Mat3& tensor);

JFPX_API bool is_diagonal(const Mat3& tensor);
/// The mean of a tensor and its transpose: what is meant where the last digits differ.
JFPX_API Mat3 symmetric_part(const Mat3& tensor);

}  // namespace JFPX_ABI
}  // namespace jfpx
