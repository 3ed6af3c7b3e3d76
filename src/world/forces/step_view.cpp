/// Read access to the body store.
#include <jfpx/step_view.hpp>

#include "src/world/bodies/body_store.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

Real StepView::dt() const { return bodies_->dt(); }
std::span<const BodyId> StepView::bodies() const { return bodies_->ids(); }
bool StepView::contains(BodyId id) const noexcept { return bodies_->contains(id); }

std::uint32_t StepView::require(BodyId id) const { return bodies_->require(id); }

BodyState StepView::state(BodyId id) const { return bodies_->state(require(id)); }
const Shape& StepView::shape(BodyId id) const { return bodies_->shape(require(id)); }
Real StepView::mass(BodyId id) const { return bodies_->mass(require(id)); }
bool StepView::awake(BodyId id) const { return bodies_->moving.awake[require(id)] != 0; }

}  // namespace JFPX_ABI
}  // namespace jfpx
