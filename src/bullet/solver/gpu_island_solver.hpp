/// Solves groups of contacts on a device: packing, results, and the choice between device and CPU.
#pragma once

#include <jfpx/backend.hpp>

#include "src/base/device_starter.hpp"
#include "src/base/time_chooser.hpp"
#include "src/bullet/solver/contact_scan.hpp"
#include "src/contact_solver/sequential_impulse/cpu/row_solver.hpp"
#include "src/contact_solver/sequential_impulse/group_solver.hpp"
#include "src/contact_solver/sequential_impulse/row_order.hpp"

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// A group with packed bodies and scanned contacts.
struct DeviceGroup {
  cpu::RowSolver& host;  ///< contains the bodies, and receives their velocities
  const ContactScan& scan;
  const btContactSolverInfo& info;
  const rows::RowSettings& settings;
  std::size_t bodies;
  std::uint32_t directions;  ///< number of friction directions
  bool factors;
};

/// Solves groups on a device: none (`cpu`), all supported groups (`cuda`), or groups for which the
/// device is expected to be faster (`automatic`).
class GpuIslandSolver {
 public:
  static constexpr double kStartMs = 200;  ///< duration of the first use of the device

  /// @param make creates the solver on the device. With `cuda`, it is called in the constructor.
  /// With
  ///   `automatic`, it is called on another thread as soon as the expected gain justifies the
  ///   start;
  ///   until it has returned, the CPU solves all groups. The destructor waits for it.
  /// @param threads number of threads of the CPU
  /// @param start_ms expected duration of that call of `make`
  /// @throws BackendUnavailable if the backend is cuda and `make` is null; with `cuda`, the
  /// exceptions
  ///   of `make`
  GpuIslandSolver(Backend backend, GroupSolverMaker make, unsigned threads,
                  double start_ms = kStartMs);

  /// Selects the CPU or the device for a group, and starts the clock that finished() stops.
  /// @return whether the device should solve the group
  bool choose(const ContactScan& scan, const btContactSolverInfo& info);
  /// Solves a group for which choose() returned true. Only reads Bullet's bodies and points.
  /// @return nothing if the device fails, or is predicted to be much slower
  /// @throws OutOfMemory, std::bad_alloc if host memory is insufficient for the group
  std::optional<rows::RowSweepReport> solve(const DeviceGroup& group);
  /// Writes impulses and friction directions of the last group to the contact points.
  void write_back(const DeviceGroup& group) const;
  /// Records the time since choose() as the time of the group.
  /// @param colors number of colors of the contacts, if the CPU has colored them; else 0
  void finished(std::uint32_t colors);
  /// Stops the clock without recording the time, because the group was not solved.
  void abandon() noexcept { timed_ = false; }

  /// Why the device is no longer used; empty if it has not failed.
  const std::string& failure() const noexcept { return failure_; }

 private:
  using Clock = std::chrono::steady_clock;

  /// Predicted times on the CPU and on the device [us].
  std::array<double, 2> predicted_us(std::size_t contacts, int iterations) const;
  void pack(const DeviceGroup& group);
  bool pack_contacts(const DeviceGroup& group, const GroupInputs& in, std::size_t first,
                     std::size_t last);
  /// @param to the kRollingRows rows of the contact
  static void set_up_rolling_friction(const DeviceGroup& group, std::uint32_t contact, Real* to);
  std::size_t number_rolling_frictions(const ContactScan& scan);
  rows::RowSweepReport solve_packed(const DeviceGroup& group);
  static void write_back(const DeviceGroup& group, const rows::ContactOutcome& from,
                         btManifoldPoint& point);
  void start(std::size_t contacts);
  void take_started();
  void disable(const std::string& why);

  Backend backend_;
  GroupSolverMaker make_;
  unsigned threads_;
  std::optional<TimeChooser> chooser_;
  DeviceStarter<std::unique_ptr<GroupSolver>> starter_;
  std::unique_ptr<GroupSolver> solver_;
  RowOrder order_;
  std::vector<std::uint8_t> split_impulse_candidates_;  ///< by contact: 1 if it may have one
  std::vector<std::uint32_t> rolling_frictions_;        ///< contacts with rolling friction
  std::uint32_t split_impulse_count_ = 0;
  bool warm_ = false;               ///< whether any contact has an initial impulse
  double colors_per_contact_ = 0;   ///< of the last group
  std::size_t timed_contacts_ = 0;  ///< of the timed group
  double timed_prediction_us_ = 0;
  Clock::time_point since_;
  bool timed_ = false;
  std::string failure_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
