/// Groups whose contacts are solved on a device: what goes there, what comes back, and when it is
/// worth it.
#pragma once

#include <jfpx/backend.hpp>

#include "src/bullet/solver/contact_scan.hpp"
#include "src/contact_solver/cpu/row_solver.hpp"
#include "src/contact_solver/group_solver.hpp"
#include "src/contact_solver/row_order.hpp"
#include "src/sphere_collider/cost_chooser.hpp"

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>

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

/// A group whose bodies are packed and whose contacts are found.
struct DeviceGroup {
  cpu::RowSolver& host;  ///< has the bodies, and gets their velocities
  const ContactScan& scan;
  const btContactSolverInfo& info;
  const rows::RowSettings& settings;
  std::size_t bodies;
  std::uint32_t directions;  ///< of friction
  bool factors;
  /// Makes the kRollingFrictionRows rows of a contact with rolling friction; called by several
  /// threads.
  std::function<void(const ContactRef&, Real* rows)> make_rolling_frictions;
};

/// As Backend says: never, always, or where it is expected to be faster.
class GpuIslandSolver {
 public:
  /// @throws what `make` throws, if the backend is cuda; with `automatic` it is called when the
  ///   device has become worth starting.
  /// @param threads that x86 has
  GpuIslandSolver(Backend backend, GroupSolverMaker make, unsigned threads);

  /// Who is to solve the group: the device? From here to finished() is its time.
  bool choose(const ContactScan& scan, const btContactSolverInfo& info);
  /// Solves a chosen group. Bullet's bodies and points are only read.
  /// @return nothing if the device can't, or would take far too long
  std::optional<rows::RowSweepReport> solve(const DeviceGroup& group);
  /// Leaves impulses and directions of friction of the last group in the points.
  void write_back(const DeviceGroup& group) const;
  /// @param levels of the group's order, as x86 has found it; 0: x86 has not
  void finished(std::uint32_t levels);
  /// The group was not solved: its time tells nothing.
  void abandon() noexcept { timed_ = false; }

  /// Why the device was given up; empty if it was not.
  const std::string& failure() const noexcept { return failure_; }

 private:
  using Clock = std::chrono::steady_clock;

  ColliderWork work_of(std::size_t contacts, int iterations) const;
  void pack(const DeviceGroup& group);
  bool pack_contacts(const DeviceGroup& group, const GroupInputs& in, std::size_t first,
                     std::size_t last);
  std::size_t number_rolling_frictions(const ContactScan& scan);
  rows::RowSweepReport solve_packed(const DeviceGroup& group);
  static void write_back(const DeviceGroup& group, const rows::ContactOutcome& from,
                         btManifoldPoint& point);
  void start();
  void give_up(const std::string& why);

  Backend backend_;
  GroupSolverMaker make_;
  CostTerms x86_, cuda_;
  std::optional<CostChooser> chooser_;
  bool asleep_ = false;
  std::unique_ptr<GroupSolver> solver_;
  RowOrder order_;
  std::vector<std::uint8_t> pushed_;              ///< by contact: may have to be pushed apart
  std::vector<std::uint32_t> rolling_frictions_;  ///< contacts with rows against rolling
  std::uint32_t push_count_ = 0;
  bool warm_ = false;            ///< some contact has an impulse to start with
  double levels_a_contact_ = 0;  ///< of the last group
  ColliderWork work_;            ///< of the group that is timed
  Clock::time_point since_;
  bool timed_ = false;
  std::string failure_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
