/// Selection of the CPU or the device for each step of a world.
#include "src/world/automatic_device.hpp"

#include <jfpx/error.hpp>

#include <chrono>
#include <exception>
#include <new>
#include <system_error>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

constexpr TimeChooser::Alternative kAlternatives[] = {{}, {.dormant = true}};

}  // namespace

AutomaticDevice::AutomaticDevice(const CostModel& costs, Maker make)
    : terms_{costs.cpu_world, costs.cuda_world},
      start_us_(1e3 * costs.cuda_start_ms),
      make_(std::move(make)),
      chooser_(kAlternatives) {}

/// The break-even rule of the ski rental problem, as in AutomaticSphereCollider.
void AutomaticDevice::start() {
  is_asleep_ = false;
  try {
    starting_ = std::async(start_us_ > 0 ? std::launch::async : std::launch::deferred, make_);
  } catch (const std::system_error&) {  // no thread could be created
    give_up();
  } catch (const std::bad_alloc&) {
    give_up();
  }
}

std::unique_ptr<DeviceWorld> AutomaticDevice::take_started(std::string* failure) {
  if (is_asleep_ && chooser_.missed_us() >= start_us_) start();
  if (!starting_.valid()) return nullptr;
  if (starting_.wait_for(std::chrono::seconds(0)) == std::future_status::timeout) return nullptr;
  try {
    std::unique_ptr<DeviceWorld> device = starting_.get();
    chooser_.wake();
    return device;
  } catch (const BackendUnavailable&) {
    give_up();
  } catch (const std::exception& error) {
    give_up();
    *failure = error.what();
  }
  return nullptr;
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
