/// Read access to a world for forces and contact generators, during a step.
#pragma once

#include <jfpx/body.hpp>

#include <span>

namespace jfpx {
inline namespace JFPX_ABI {

class BodyStore;

/// Bodies of a world during a step. Valid during the call of the force or generator.
class JFPX_API StepView {
 public:
  StepView(const BodyStore& bodies, double time) : bodies_(&bodies), time_(time) {}

  Real dt() const;                          ///< [s], length of the step
  double time() const { return time_; }     ///< [s], start of the step; 0 in the first
  std::span<const BodyId> bodies() const;   ///< living bodies in the order of their indices
  bool contains(BodyId id) const noexcept;  ///< whether the id is of a living body

  /// @throws InvalidArgument, in all four, for an id of no living body; the step is then undone
  BodyState state(BodyId id) const;
  const Shape& shape(BodyId id) const;
  Real mass(BodyId id) const;   ///< [kg]; 0: immovable or kinematic
  bool awake(BodyId id) const;  ///< a body of mass 0 is awake only if it is kinematic and moves

 protected:
  std::uint32_t require(BodyId id) const;

 private:
  const BodyStore* bodies_;
  double time_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
