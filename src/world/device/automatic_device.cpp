/// Selection of the CPU or the device for each step of a world.
#include "src/world/device/automatic_device.hpp"

#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

constexpr TimeChooser::Alternative kAlternatives[] = {{}, {.dormant = true}};

}  // namespace

AutomaticDevice::AutomaticDevice(const CostModel& costs, Maker make)
    : terms_{costs.cpu_world, costs.cuda_world},
      make_(std::move(make)),
      chooser_(kAlternatives),
      starter_(1e3 * costs.cuda_start_ms) {}

std::unique_ptr<DeviceWorld> AutomaticDevice::take_started(std::string* failure) {
  if (starter_.is_due(chooser_.missed_us())) starter_.start(make_);
  auto outcome = starter_.take();
  if (!outcome) return nullptr;
  if (outcome->has_failed) {
    give_up();
    if (!outcome->failure.empty()) *failure = std::move(outcome->failure);
    return nullptr;
  }
  chooser_.wake();
  return std::move(outcome->device);
}

bool AutomaticDevice::choose(std::size_t bodies) {
  const ColliderWork work{.spheres = static_cast<double>(bodies)};
  for (std::size_t way = 0; way < kWays; ++way) {
    predicted_us_[way] = microseconds(terms_[way], work);
  }
  chosen_ = chooser_.choose(work.spheres, predicted_us_).alternative;
  return chosen_ == kDevice;
}

void AutomaticDevice::record(double us) { chooser_.record(us, predicted_us_[chosen_]); }

void AutomaticDevice::give_up() { chooser_.remove(kDevice); }

}  // namespace JFPX_ABI
}  // namespace jfpx
