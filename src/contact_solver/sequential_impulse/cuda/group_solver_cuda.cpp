/// Groups of contacts on a GPU: one upload, three kernels, one download.
#include "src/contact_solver/sequential_impulse/cuda/group_solver_cuda.hpp"

#include <jfpx/error.hpp>

#include "src/base/cuda/device_buffer.hpp"
#include "src/base/cuda/probe.hpp"
#include "src/contact_solver/sequential_impulse/cuda/row_kernels.hpp"

#include <algorithm>
#include <bit>
#include <nvtx3/nvtx3.hpp>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

/// Suballocates arrays from one block of memory. Without memory, counts the bytes only.
class Arena {
 public:
  explicit Arena(std::byte* memory) : memory_(memory) {}
  template <class T>
  T* allocate(std::size_t count) {
    const std::size_t at = used_;
    used_ += (count * sizeof(T) + kAlignment - 1) / kAlignment * kAlignment;
    return memory_ == nullptr ? nullptr : reinterpret_cast<T*>(memory_ + at);
  }
  std::size_t used() const { return used_; }

 private:
  static constexpr std::size_t kAlignment = 256;
  std::byte* memory_;
  std::size_t used_ = 0;
};

/// The last array is rarely full; only its used part is copied.
/// @param least_bytes receives the size without the last array
GroupInputs allocate_inputs(const GroupSize& size, Arena* arena, std::size_t* least_bytes) {
  GroupInputs in{};
  in.bodies = arena->allocate<Real>(size.bodies * rows::kBodyFields);
  if (size.factors) in.factors = arena->allocate<Real>(size.bodies * rows::kFactorFields);
  in.contacts = arena->allocate<Real>(size.contacts * rows::kInputFields);
  if (size.rolling_frictions > 0) {
    in.rolling_frictions = arena->allocate<std::uint32_t>(size.contacts);
    in.rolling_friction_rows =
        arena->allocate<Real>(size.rolling_frictions * rows::kRollingRows * rows::kRollingFields);
  }
  in.slot_contacts = arena->allocate<std::uint32_t>(size.contacts);
  in.schedule = arena->allocate<rows::ScheduledContact>(size.contacts);
  in.contact_counts = arena->allocate<std::uint32_t>(size.bodies);
  in.split_impulse_counts = arena->allocate<std::uint32_t>(size.bodies);
  *least_bytes = arena->used();
  in.split_impulse_schedule = arena->allocate<rows::ScheduledContact>(size.contacts);
  return in;
}

struct Outputs {
  SweepResults* results;
  rows::ContactOutcome* outcomes;
  Real* velocities;
};
Outputs allocate_outputs(const GroupSize& size, int iterations, Arena* arena) {
  Outputs out{};
  out.results =
      reinterpret_cast<SweepResults*>(arena->allocate<std::byte>(SweepResults::bytes(iterations)));
  out.outcomes = arena->allocate<rows::ContactOutcome>(size.contacts);
  out.velocities = arena->allocate<Real>(size.bodies * rows::kOutcomeVelocities);
  return out;
}

class GroupSolverCuda final : public GroupSolver {
 public:
  explicit GroupSolverCuda(int device) : device_(device), stream_(device), pool_(device) {
    const DeviceGuard guard(device_);
    max_blocks_ = max_row_blocks(device_);
  }
  ~GroupSolverCuda() override { static_cast<void>(cudaStreamSynchronize(stream_.get())); }

  GroupInputs inputs(const GroupSize& size) override;
  rows::RowSweepReport solve(const GroupSweeps& sweeps) override;
  const rows::ContactOutcome* outcomes() const override { return outputs_.outcomes; }
  const Real* velocities() const override { return outputs_.velocities; }

 private:
  void upload(const GroupSweeps& sweeps);
  RowSweepArgs make_args(const GroupSweeps& sweeps);
  GroupResults run(RowSweepArgs args, const GroupSweeps& sweeps, int main, int split_impulse);

  int device_;
  OwnedStream stream_;
  MemoryPool pool_;
  unsigned max_blocks_ = 0;
  GroupSize size_;
  PinnedBuffer<std::byte> staging_, returned_;
  DeviceBuffer<std::byte> input_, rows_, output_;
  Outputs outputs_{};
  std::vector<double> residuals_;
};

GroupInputs GroupSolverCuda::inputs(const GroupSize& size) {
  const DeviceGuard guard(device_);
  size_ = size;
  std::size_t used_bytes = 0;
  Arena counter(nullptr);
  allocate_inputs(size, &counter, &used_bytes);
  staging_.reserve_geometric(counter.used(), "contacts for the device");
  Arena arena(staging_.data());
  return allocate_inputs(size, &arena, &used_bytes);
}

void GroupSolverCuda::upload(const GroupSweeps& sweeps) {
  std::size_t bytes = 0;
  Arena counter(nullptr);
  allocate_inputs(size_, &counter, &bytes);
  input_.reserve_geometric(pool_, stream_.get(), counter.used(), "contacts");
  bytes += sweeps.split_impulse_count * sizeof(rows::ScheduledContact);
  JFPX_CUDA_TRY(cudaMemcpyAsync(input_.data(), staging_.data(), bytes, cudaMemcpyHostToDevice,
                                stream_.get()));
}

RowSweepArgs GroupSolverCuda::make_args(const GroupSweeps& sweeps) {
  std::size_t used_bytes = 0;
  Arena inputs(input_.data());
  const GroupInputs in = allocate_inputs(size_, &inputs, &used_bytes);
  rows::RowGroupArrays group{};
  const auto allocate_rows = [&](std::byte* memory) {
    Arena arena(memory);
    group.contact_rows = arena.allocate<Real>(size_.contacts * rows::kContactFields);
    group.friction_rows =
        arena.allocate<Real>(size_.contacts * sweeps.directions * rows::kFrictionFields);
    group.main.cells = arena.allocate<Cell>(size_.bodies * rows::kBodyCells);
    group.split_impulse.cells = arena.allocate<Cell>(size_.bodies * rows::kBodyCells);
    return arena.used();
  };
  const std::size_t row_bytes = allocate_rows(nullptr);
  rows_.reserve_geometric(pool_, stream_.get(), row_bytes, "rows");
  allocate_rows(rows_.data());

  Arena counter(nullptr);
  allocate_outputs(size_, sweeps.iterations, &counter);
  output_.reserve_geometric(pool_, stream_.get(), counter.used(), "solved contacts");
  returned_.reserve_geometric(counter.used(), "solved contacts on the host");
  Arena outputs(output_.data());
  const Outputs out = allocate_outputs(size_, sweeps.iterations, &outputs);
  group.settings = sweeps.settings;
  group.main.schedule = in.schedule;
  group.main.contact_counts = in.contact_counts;
  group.main.count = static_cast<std::uint32_t>(size_.contacts);
  group.split_impulse.schedule = in.split_impulse_schedule;
  group.split_impulse.contact_counts = in.split_impulse_counts;
  group.split_impulse.count = sweeps.split_impulse_count;
  group.bodies = in.bodies;
  group.factors = in.factors;
  group.inputs = in.contacts;
  group.contacts = in.slot_contacts;
  group.rolling_frictions = in.rolling_frictions;
  group.rolling_friction_rows = in.rolling_friction_rows;
  group.outcomes = out.outcomes;
  group.velocities = out.velocities;
  group.body_count = static_cast<std::uint32_t>(size_.bodies);
  group.directions = sweeps.directions;
  RowSweepArgs args{};
  args.group = group;
  args.results = out.results;
  args.iterations = static_cast<std::uint32_t>(sweeps.iterations);
  return args;
}

GroupResults GroupSolverCuda::run(RowSweepArgs args, const GroupSweeps& sweeps, int main,
                                  int split_impulse) {
  args.main = main_program(sweeps, main, size_.rolling_frictions > 0);
  args.split_impulse = split_impulse_program(split_impulse);
  launch_row_setup(args, stream_.get());
  launch_row_sweeps(args, max_blocks_, stream_.get());
  launch_row_finish(args, stream_.get());
  Arena arena(returned_.data());
  outputs_ = allocate_outputs(size_, sweeps.iterations, &arena);
  JFPX_CUDA_TRY(cudaMemcpyAsync(returned_.data(), output_.data(), arena.used(),
                                cudaMemcpyDeviceToHost, stream_.get()));
  JFPX_CUDA_TRY(cudaStreamSynchronize(stream_.get()));
  if (outputs_.results->stuck != 0) {
    throw DeviceError("cuda: the dependencies between the rows of a group did not resolve");
  }
  const auto count = 2 * static_cast<std::size_t>(sweeps.iterations);
  residuals_.resize(count);
  std::transform(outputs_.results->largest(), outputs_.results->largest() + count,
                 residuals_.begin(), [](auto bits) { return std::bit_cast<double>(bits); });
  return {.residuals = residuals_.data(),
          .split_impulse_residuals = residuals_.data() + sweeps.iterations,
          .split_impulses = outputs_.results->split_impulses,
          .broken = outputs_.results->broken != 0};
}

rows::RowSweepReport GroupSolverCuda::solve(const GroupSweeps& sweeps) {
  const nvtx3::scoped_range range("jfpx solve a group");
  const DeviceGuard guard(device_);
  upload(sweeps);
  const RowSweepArgs args = make_args(sweeps);
  return sweep_until_small(
      sweeps, [&](int main, int split_impulse) { return run(args, sweeps, main, split_impulse); });
}

}  // namespace

std::unique_ptr<GroupSolver> make_group_solver(int device) {
  const BackendStatus status = probe(device);
  if (!status.usable) throw BackendUnavailable("cuda: " + status.reason);
  return std::make_unique<GroupSolverCuda>(device);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
