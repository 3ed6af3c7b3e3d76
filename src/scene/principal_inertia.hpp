/// Principal axes and moments of inertia.
#pragma once

#include <jfpx/math.hpp>

namespace jfpx {
inline namespace JFPX_ABI {

/// Eigenvalues and eigenvectors of an inertia tensor.
struct PrincipalInertia {
  Vec3 moments;  ///< [kg m^2]
  Mat3 axes;     ///< columns, right-handed; the identity if the tensor is diagonal up to rounding
};

/// The moments are not sorted. @param tensor finite and symmetric; only its upper triangle is read
JFPX_API PrincipalInertia principal_inertia(const Mat3& tensor);

}  // namespace JFPX_ABI
}  // namespace jfpx
