/// Packing of groups for a device, and transfer of the results; see the header.
#include "src/bullet/solver/gpu_island_solver.hpp"

#include <jfpx/error.hpp>

#include "src/bullet/chunks.hpp"
#include "src/bullet/prefetch.hpp"
#include "src/bullet/solver/rolling_friction_rows.hpp"
#include "src/bullet/solver/row_inputs.hpp"
#include "src/contact_solver/sequential_impulse/contact_rows.hpp"
#include "src/contact_solver/sequential_impulse/scalar_lane.hpp"

#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kContactsPerChunk = 128, kBodiesPerChunk = 256;
/// Minimum group size for the device: the CPU solves smaller groups before a device responds.
constexpr std::size_t kMinContacts = 400;
/// Ratio of predicted times above which a trial of the device costs more than it can save.
constexpr double kMaxSlowdown = 4;

/// Length of the longest chain of dependent steps, per color and iteration; 1.4 to 1.6 in piles.
constexpr double kSequentialRowsPerColor = 1.5;

/// Indices of the alternatives of the chooser.
constexpr std::size_t kCpu = 0, kGpu = 1;

/// Predicted times [us] to solve a group, measured on an AMD EPYC of 2022 with AVX2 and on an
/// NVIDIA H200. The threads share the packing of contacts and the setup of rows; sweeps gain little
/// from further threads.
double cpu_us(double contacts, int iterations, unsigned threads) {
  return 5 + 1e-3 * contacts * (150.0 / threads + 23 * iterations);
}
double gpu_us(double contacts, double colors, int iterations, unsigned threads) {
  return 120 + 1e-3 * (900 * kSequentialRowsPerColor * colors * iterations +
                       contacts * (20 + 170.0 / threads));
}

/// The condition of set_up_contact() for a split impulse: positions are corrected separately from
/// velocities if the contact is deep enough.
bool may_have_split_impulse(const btManifoldPoint& point, const rows::RowSettings& settings) {
  return settings.split && !(settings.split_threshold < point.m_distance1 + settings.slop);
}

}  // namespace

GpuIslandSolver::GpuIslandSolver(Backend backend, GroupSolverMaker make, unsigned threads,
                                 double start_ms)
    : backend_(backend), make_(std::move(make)), threads_(threads), starter_(1e3 * start_ms) {
  if (backend_ == Backend::cuda) {
    if (make_ == nullptr) throw BackendUnavailable("cuda: built without CUDA");
    solver_ = make_();
  }
  if (backend_ == Backend::automatic && make_ != nullptr) {
    const TimeChooser::Alternative alternatives[] = {{}, {.dormant = true}};
    chooser_.emplace(alternatives);
  }
}

std::array<double, 2> GpuIslandSolver::predicted_us(std::size_t contacts, int iterations) const {
  const auto n = static_cast<double>(contacts);
  return {cpu_us(n, iterations, threads_),
          gpu_us(n, colors_per_contact_ * n, iterations, threads_)};
}

bool GpuIslandSolver::choose(const ContactScan& scan, const btContactSolverInfo& info) {
  timed_ = false;
  const std::size_t contacts = scan.contacts().size();
  if (contacts == 0 || scan.any_anisotropic() || info.m_numIterations > kMaxGroupIterations) {
    return false;
  }
  if (!chooser_) return solver_ != nullptr;
  if (contacts < kMinContacts) return false;
  if (starter_.is_due(chooser_->missed_us())) start(contacts);
  take_started();
  if (!chooser_) return false;
  const std::array<double, 2> predicted = predicted_us(contacts, info.m_numIterations);
  const std::size_t choice = chooser_->choose(static_cast<double>(contacts), predicted).alternative;
  timed_contacts_ = contacts;
  timed_prediction_us_ = predicted[choice];
  timed_ = true;
  since_ = Clock::now();
  return choice == kGpu;
}

void GpuIslandSolver::start(std::size_t contacts) {
  starter_.start([make = make_, contacts] {
    auto solver = make();
    solver->inputs({.bodies = contacts, .contacts = contacts});  // allocates memory
    return solver;
  });
}

void GpuIslandSolver::take_started() {
  auto outcome = starter_.take();
  if (!outcome) return;
  if (outcome->has_failed) return chooser_.reset();  // a missing device is not a failure
  solver_ = std::move(outcome->device);
  chooser_->wake();
}

void GpuIslandSolver::disable(const std::string& why) {
  failure_ = why.empty() ? "unknown" : why;
  solver_.reset();
  chooser_.reset();
  timed_ = false;
}

void GpuIslandSolver::finished(std::uint32_t colors) {
  if (!timed_ || !chooser_) return;  // the time of this group is not measured
  if (colors > 0) colors_per_contact_ = colors / static_cast<double>(timed_contacts_);
  const std::chrono::duration<double, std::micro> us = Clock::now() - since_;
  chooser_->record(us.count(), timed_prediction_us_);
  timed_ = false;
}

std::optional<rows::RowSweepReport> GpuIslandSolver::solve(const DeviceGroup& group) {
  // Outside the try block: a failed allocation on the host must not disable the device.
  order_.reserve(group.scan.contacts().size(), group.bodies);
  try {
    pack(group);
    const auto contacts = static_cast<double>(group.scan.contacts().size());
    colors_per_contact_ = order_.colors() / contacts;
    if (chooser_) {
      const std::array<double, 2> predicted =
          predicted_us(group.scan.contacts().size(), group.info.m_numIterations);
      if (predicted[kGpu] > kMaxSlowdown * predicted[kCpu]) {
        timed_ = false;
        return std::nullopt;
      }
    }
    return solve_packed(group);
  } catch (const std::bad_alloc&) {  // host memory is exhausted
    throw;
  } catch (const std::exception& error) {
    disable(error.what());
    return std::nullopt;
  }
}

void GpuIslandSolver::pack(const DeviceGroup& group) {
  BT_PROFILE("solveGroupCacheFriendlySetup");
  ThreadPool& pool = group.host.pool();
  const ContactScan& scan = group.scan;
  const GroupSize size{.bodies = group.bodies,
                       .contacts = scan.contacts().size(),
                       .rolling_frictions = scan.any_rolling() ? number_rolling_frictions(scan) : 0,
                       .factors = group.factors};
  const GroupInputs in = solver_->inputs(size);
  split_impulse_candidates_.resize(size.contacts);
  in_chunks(pool, size.bodies, kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
    const std::size_t count = last - first;
    std::copy_n(group.host.body(first), count * rows::kBodyFields,
                in.bodies + first * rows::kBodyFields);
    if (!size.factors) return;
    std::copy_n(group.host.factors(first), count * rows::kFactorFields,
                in.factors + first * rows::kFactorFields);
  });
  std::atomic<bool> warm{false};
  // One thread builds the order in about the time of all other threads for the rest.
  pool.run(1 + (size.contacts + kContactsPerChunk - 1) / kContactsPerChunk, [&](std::size_t i) {
    if (i == 0) {
      order_.build(scan.pairs(), size.bodies, in.schedule, in.slot_contacts, in.contact_counts);
      return;
    }
    const std::size_t first = (i - 1) * kContactsPerChunk;
    const std::size_t last = std::min(size.contacts, first + kContactsPerChunk);
    if (pack_contacts(group, in, first, last)) warm.store(true, std::memory_order_relaxed);
  });
  warm_ = warm && group.settings.warm_start;
  if (size.rolling_frictions > 0) {
    constexpr std::size_t kRows = rows::kRollingRows * rows::kRollingFields;
    std::fill_n(in.rolling_frictions, size.contacts, rows::kNoRollingFriction);
    pool.run(size.rolling_frictions, [&](std::size_t k) {
      const std::uint32_t contact = rolling_frictions_[k];
      in.rolling_frictions[contact] = static_cast<std::uint32_t>(k);
      set_up_rolling_friction(group, contact, in.rolling_friction_rows + k * kRows);
    });
  }
  split_impulse_count_ = group.settings.split
                             ? RowOrder::select({in.schedule, size.contacts}, in.slot_contacts,
                                                split_impulse_candidates_, size.bodies,
                                                in.split_impulse_schedule, in.split_impulse_counts)
                             : 0;
}

void GpuIslandSolver::set_up_rolling_friction(const DeviceGroup& group, std::uint32_t contact,
                                              Real* to) {
  const ContactRef& ref = group.scan.contacts()[contact];
  const rows::RowPair pair = group.scan.pairs()[contact];
  const std::int32_t ids[2] = {pair.a, pair.b};
  std::fill_n(to, rows::kRollingRows * rows::kRollingFields, Real(0));
  pack_rolling_friction(ref.get(), 1, to);
  rows::set_up_rolling_axes<rows::OneLane>(ref.get().m_normalWorldOnB.m_floats, to);
  if (ref.anisotropic_rolling) scale_rolling_axes(ref, 1, to);
  rows::set_up_rolling_frictions<rows::OneLane>(group.host.body(0), ids, to);
}

/// @return whether any contact has an initial impulse
bool GpuIslandSolver::pack_contacts(const DeviceGroup& group, const GroupInputs& in,
                                    std::size_t first, std::size_t last) {
  constexpr std::size_t kAhead = 4;
  const std::span<const ContactRef> contacts = group.scan.contacts();
  bool warm = false;
  for (std::size_t i = first; i < last; ++i) {
    if (i + kAhead < last) prefetch_bytes(&contacts[i + kAhead].get(), sizeof(btManifoldPoint));
    const btManifoldPoint& point = contacts[i].get();
    pack_contact(point, group.info, 1, in.contacts + i * rows::kInputFields);
    split_impulse_candidates_[i] = may_have_split_impulse(point, group.settings) ? 1 : 0;
    warm |= point.m_appliedImpulse != 0;
  }
  return warm;
}

std::size_t GpuIslandSolver::number_rolling_frictions(const ContactScan& scan) {
  rolling_frictions_.clear();
  for (std::size_t i = 0; i < scan.contacts().size(); ++i) {
    if (scan.contacts()[i].rolling) rolling_frictions_.push_back(static_cast<std::uint32_t>(i));
  }
  return rolling_frictions_.size();
}

rows::RowSweepReport GpuIslandSolver::solve_packed(const DeviceGroup& group) {
  BT_PROFILE("solveGroupCacheFriendlyIterations");
  const int mode = group.info.m_solverMode;
  const rows::RowSweepReport report = solver_->solve(
      {.settings = group.settings,
       .split_impulse_count = split_impulse_count_,
       .iterations = group.info.m_numIterations,
       .threshold = group.info.m_leastSquaresResidualThreshold,
       .directions = group.directions,
       .interleave = (mode & SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS) != 0,
       .warm_start = warm_});
  if (report.broken) return report;
  const Real* velocities = solver_->velocities();
  in_chunks(group.host.pool(), group.bodies, kBodiesPerChunk,
            [&](std::size_t first, std::size_t last) {
              for (std::size_t i = first; i < last; ++i) {
                const Real* v = velocities + i * rows::kOutcomeVelocities;
                for (Real* to : {group.host.velocity(i), group.host.push_velocity(i)}) {
                  std::copy_n(v, 3, to);
                  std::copy_n(v + 3, 3, to + 4);
                  v += 6;
                }
              }
            });
  return report;
}

void GpuIslandSolver::write_back(const DeviceGroup& group) const {
  const std::span<const ContactRef> contacts = group.scan.contacts();
  const rows::ContactOutcome* outcomes = solver_->outcomes();
  in_chunks(group.host.pool(), contacts.size(), kContactsPerChunk,
            [&](std::size_t first, std::size_t last) {
              constexpr std::size_t kAhead = 4;
              for (std::size_t i = first; i < last; ++i) {
                if (i + kAhead < last) {
                  prefetch_bytes(&contacts[i + kAhead].get(), sizeof(btManifoldPoint));
                }
                write_back(group, outcomes[i], contacts[i].get());
              }
            });
}

/// Writes the fields that Bullet writes; see set_friction_directions().
void GpuIslandSolver::write_back(const DeviceGroup& group, const rows::ContactOutcome& from,
                                 btManifoldPoint& point) {
  point.m_lateralFrictionDir1.setValue(from.direction[0], from.direction[1], from.direction[2]);
  if (from.has_second != 0) {
    // Not setValue(): Bullet does not change the fourth component.
    std::copy_n(from.second, 3, point.m_lateralFrictionDir2.m_floats);
  } else if (group.directions == 2) {
    point.m_lateralFrictionDir2.setValue(from.second[0], from.second[1], from.second[2]);
  }
  if (group.directions == 2 && from.has_second != 0 && !group.settings.friction_follows_velocity) {
    point.m_contactPointFlags |= BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
  }
  if (!group.settings.warm_start) return;
  point.m_appliedImpulse = from.impulse;
  point.m_appliedImpulseLateral1 = from.lateral[0];
  if (group.directions == 2) point.m_appliedImpulseLateral2 = from.lateral[1];
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
