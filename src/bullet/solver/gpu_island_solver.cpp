/// Packs groups for a device and brings the results back; see the header.
#include "src/bullet/solver/gpu_island_solver.hpp"

#include <jfpx/error.hpp>

#include "src/bullet/prefetch.hpp"
#include "src/bullet/solver/row_inputs.hpp"

#include <LinearMath/btQuickprof.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kContactsAChunk = 128, kBodiesAChunk = 256;
/// Where a group is decided at all: smaller ones are done before a device has answered.
constexpr std::size_t kLeastContacts = 400;
/// Where a device would take longer by so much, a trial is not worth what it costs.
constexpr double kFarTooLong = 4;
constexpr double kStartMs = 200;  ///< the first use of the device

/// Turns that the last row waits for, for each level of the contacts and iteration: measured 1.4 to
/// 1.6 in piles.
constexpr double kTurnsALevel = 1.5;

/// `spheres` stands for turns one after the other, `pairs` for contacts, `contacts` for contacts
/// times iterations. Packing a contact, or making its rows, is shared by the threads; sweeps gain
/// little from them. Of an AMD EPYC of 2022 with AVX2, and of an NVIDIA H200.
CostTerms x86_costs(unsigned threads) {
  return {.call_us = 5, .pair_ns = 150.0 / threads, .contact_ns = 23};
}
CostTerms cuda_costs(unsigned threads) {
  return {.call_us = 120, .sphere_ns = 900, .pair_ns = 20 + 170.0 / threads};
}

template <class Work>
void in_chunks(ThreadPool& pool, std::size_t count, std::size_t chunk, const Work& work) {
  pool.run((count + chunk - 1) / chunk,
           [&](std::size_t i) { work(i * chunk, std::min(count, (i + 1) * chunk)); });
}

/// As in the rows: deep enough that positions are corrected apart from velocities.
bool may_be_pushed(const btManifoldPoint& point, const rows::RowSettings& settings) {
  return settings.split && !(settings.split_threshold < point.m_distance1 + settings.slop);
}

}  // namespace

GpuIslandSolver::GpuIslandSolver(Backend backend, GroupSolverMaker make, unsigned threads)
    : backend_(backend),
      make_(std::move(make)),
      x86_(x86_costs(threads)),
      cuda_(cuda_costs(threads)) {
  if (backend_ == Backend::cuda) {
    if (make_ == nullptr) throw BackendUnavailable("cuda: built without CUDA");
    solver_ = make_();
  }
  if (backend_ == Backend::automatic && make_ != nullptr) {
    asleep_ = true;
    chooser_.emplace(
        std::vector<CostChooser::Way>{{Backend::cpu, SphereAlgorithm::automatic, x86_},
                                      {Backend::cuda, SphereAlgorithm::automatic, cuda_, true}},
        true);
  }
}

ColliderWork GpuIslandSolver::work_of(std::size_t contacts, int iterations) const {
  const auto n = static_cast<double>(contacts);
  const double levels = levels_a_contact_ * n;
  return {.spheres = kTurnsALevel * levels * iterations, .pairs = n, .contacts = n * iterations};
}

bool GpuIslandSolver::choose(const ContactScan& scan, const btContactSolverInfo& info) {
  timed_ = false;
  const std::size_t contacts = scan.contacts().size();
  if (contacts == 0 || scan.any_anisotropic() || info.m_numIterations > kMaxGroupIterations) {
    return false;
  }
  if (!chooser_) return solver_ != nullptr;
  if (contacts < kLeastContacts) return false;
  if (asleep_ && chooser_->missed_us() >= 1e3 * kStartMs) start();
  if (!chooser_) return false;
  work_ = work_of(contacts, info.m_numIterations);
  timed_ = true;
  const bool device = chooser_->way(chooser_->choose(work_).way).backend == Backend::cuda;
  since_ = Clock::now();
  return device;
}

void GpuIslandSolver::start() {
  asleep_ = false;
  try {
    solver_ = make_();
    chooser_->wake();
  } catch (const std::exception&) {
    chooser_.reset();  // there is none: nobody needs to know
  }
}

void GpuIslandSolver::give_up(const std::string& why) {
  failure_ = why.empty() ? "unknown" : why;
  solver_.reset();
  chooser_.reset();
  timed_ = false;
}

void GpuIslandSolver::finished(std::uint32_t levels) {
  if (!timed_ || !chooser_) return;  // levels of another group than that of work_
  if (levels > 0) levels_a_contact_ = levels / work_.pairs;
  const std::chrono::duration<double, std::micro> us = Clock::now() - since_;
  chooser_->record(work_, us.count());
  timed_ = false;
}

std::optional<rows::RowSweepReport> GpuIslandSolver::solve(const DeviceGroup& group) {
  try {
    pack(group);
    const auto contacts = static_cast<double>(group.scan.contacts().size());
    levels_a_contact_ = order_.levels() / contacts;
    if (chooser_) {
      const ColliderWork work = work_of(group.scan.contacts().size(), group.info.m_numIterations);
      if (microseconds(cuda_, work) > kFarTooLong * microseconds(x86_, work)) {
        timed_ = false;
        return std::nullopt;
      }
    }
    return solve_packed(group);
  } catch (const std::bad_alloc&) {  // of the host, not of the device
    throw;
  } catch (const std::exception& error) {
    give_up(error.what());
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
  pushed_.resize(size.contacts);
  in_chunks(pool, size.bodies, kBodiesAChunk, [&](std::size_t first, std::size_t last) {
    const std::size_t count = last - first;
    std::copy_n(group.host.body(first), count * rows::kBodyFields,
                in.bodies + first * rows::kBodyFields);
    if (!size.factors) return;
    std::copy_n(group.host.factors(first), count * rows::kFactorFields,
                in.factors + first * rows::kFactorFields);
  });
  std::atomic<bool> warm{false};
  // The order takes one thread about as long as all others need for the rest.
  pool.run(1 + (size.contacts + kContactsAChunk - 1) / kContactsAChunk, [&](std::size_t i) {
    if (i == 0) {
      order_.build(scan.pairs(), size.bodies, in.places, in.place_contacts, in.moves);
      return;
    }
    const std::size_t first = (i - 1) * kContactsAChunk;
    const std::size_t last = std::min(size.contacts, first + kContactsAChunk);
    if (pack_contacts(group, in, first, last)) warm.store(true, std::memory_order_relaxed);
  });
  warm_ = warm && group.settings.warm_start;
  if (size.rolling_frictions > 0) {
    constexpr std::size_t kRows = rows::kRollingFrictionRows * rows::kFrictionFields;
    std::fill_n(in.rolling_frictions, size.contacts, rows::kNoRollingFriction);
    pool.run(size.rolling_frictions, [&](std::size_t k) {
      in.rolling_frictions[rolling_frictions_[k]] = static_cast<std::uint32_t>(k);
      std::fill_n(in.rolling_friction_rows + k * kRows, kRows, Real(0));
      group.make_rolling_frictions(scan.contacts()[rolling_frictions_[k]],
                                   in.rolling_friction_rows + k * kRows);
    });
  }
  push_count_ = group.settings.split
                    ? RowOrder::choose({in.places, size.contacts}, in.place_contacts, pushed_,
                                       size.bodies, in.push_places, in.push_moves)
                    : 0;
}

/// @return whether a contact has an impulse to start with
bool GpuIslandSolver::pack_contacts(const DeviceGroup& group, const GroupInputs& in,
                                    std::size_t first, std::size_t last) {
  constexpr std::size_t kAhead = 4;
  const std::span<const ContactRef> contacts = group.scan.contacts();
  bool warm = false;
  for (std::size_t i = first; i < last; ++i) {
    if (i + kAhead < last) prefetch_bytes(&contacts[i + kAhead].get(), sizeof(btManifoldPoint));
    const btManifoldPoint& point = contacts[i].get();
    pack_contact(point, group.info, 1, in.contacts + i * rows::kInputFields);
    pushed_[i] = may_be_pushed(point, group.settings) ? 1 : 0;
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
       .push_count = push_count_,
       .iterations = group.info.m_numIterations,
       .threshold = group.info.m_leastSquaresResidualThreshold,
       .directions = group.directions,
       .interleave = (mode & SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS) != 0,
       .warm_start = warm_});
  if (report.broken) return report;
  const Real* velocities = solver_->velocities();
  in_chunks(group.host.pool(), group.bodies, kBodiesAChunk,
            [&](std::size_t first, std::size_t last) {
              for (std::size_t i = first; i < last; ++i) {
                const Real* v = velocities + i * rows::kOutcomeVelocities;
                for (Real* to : {group.host.velocity(i), group.host.push(i)}) {
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
  in_chunks(group.host.pool(), contacts.size(), kContactsAChunk,
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

/// As Bullet leaves a point: see ConstraintSolver's set_friction_directions().
void GpuIslandSolver::write_back(const DeviceGroup& group, const rows::ContactOutcome& from,
                                 btManifoldPoint& point) {
  point.m_lateralFrictionDir1.setValue(from.direction[0], from.direction[1], from.direction[2]);
  if (from.has_second != 0) {
    // Not setValue(): Bullet leaves the fourth component as it was.
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
