/// Validation and inversion of user-defined inertia tensors.
#pragma once

#include <jfpx/math.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// Returns null for a valid tensor, otherwise the first violated requirement as the end of the
/// sentence "it must be ...". A valid tensor is finite, symmetric and positive definite, has a
/// finite inverse, and none of its principal moments exceeds the sum of the others.
const char* inertia_must_be(const Mat3& tensor);

/// Inverse of an inertia tensor. @param tensor must be valid according to inertia_must_be()
Mat3 inverse_inertia(const Mat3& tensor);

/// True if all off-diagonal entries are 0.
JFPX_API bool is_diagonal(const Mat3& tensor);
/// The mean of a tensor and its transpose; removes the asymmetry that validation tolerates.
JFPX_API Mat3 symmetric_part(const Mat3& tensor);

}  // namespace JFPX_ABI
}  // namespace jfpx
