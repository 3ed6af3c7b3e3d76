/// Validation and inversion of inertia tensors that are given by users.
#pragma once

#include <jfpx/math.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// The first requirement that a tensor violates, as the end of the sentence "it must be ..."; null
/// if it is valid. A valid tensor is symmetric and positive definite, has a finite inverse, and
/// none of its principal moments exceeds the sum of the others.
const char* inertia_must_be(const Mat3& tensor);

/// @param tensor valid according to inertia_must_be()
Mat3 inverse_inertia(const Mat3& tensor);

/// True if all off-diagonal entries are 0.
JFPX_API bool is_diagonal(const Mat3& tensor);
/// The mean of a tensor and its transpose, which removes asymmetry in the last digits.
JFPX_API Mat3 symmetric_part(const Mat3& tensor);

}  // namespace JFPX_ABI
}  // namespace jfpx
