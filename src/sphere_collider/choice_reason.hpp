/// Conversion of the reasons of a TimeChooser to those of the API.
#pragma once

#include <jfpx/sphere_collider.hpp>

#include "src/base/time_chooser.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

constexpr ChoiceReason to_choice_reason(TimeChooser::Reason reason) noexcept {
  switch (reason) {
    case TimeChooser::Reason::fixed:
      return ChoiceReason::fixed;
    case TimeChooser::Reason::predicted:
      return ChoiceReason::predicted;
    case TimeChooser::Reason::measured:
      return ChoiceReason::measured;
    case TimeChooser::Reason::kept:
      return ChoiceReason::kept;
    case TimeChooser::Reason::trial:
      return ChoiceReason::trial;
  }
  return ChoiceReason::fixed;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
