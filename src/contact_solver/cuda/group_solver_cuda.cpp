/// Groups of contacts on a GPU: one copy there, three kernels, one copy back.
#include "src/contact_solver/cuda/group_solver_cuda.hpp"

#include <jfpx/error.hpp>

#include "src/base/cuda/device_buffer.hpp"
#include "src/base/cuda/probe.hpp"
#include "src/contact_solver/cuda/row_kernels.hpp"

#include <algorithm>
#include <bit>
#include <nvtx3/nvtx3.hpp>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

/// More than `bytes`, so that groups that grow slowly do not grow the memory each time.
std::size_t with_slack(std::size_t bytes) { return bytes + bytes / 4 + 4096; }

/// Cuts memory into arrays. Without memory it counts the bytes.
class Carver {
 public:
  explicit Carver(std::byte* memory) : memory_(memory) {}
  template <class T>
  T* take(std::size_t count) {
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

/// The last array is the one that is seldom full: it is copied as far as it is.
GroupInputs carve_inputs(const GroupSize& size, Carver* carver, std::size_t* least_bytes) {
  GroupInputs in{};
  in.bodies = carver->take<Real>(size.bodies * rows::kBodyFields);
  if (size.factors) in.factors = carver->take<Real>(size.bodies * rows::kFactorFields);
  in.contacts = carver->take<Real>(size.contacts * rows::kInputFields);
  if (size.rolling_frictions > 0) {
    in.rolling_frictions = carver->take<std::uint32_t>(size.contacts);
    in.rolling_friction_rows = carver->take<Real>(
        size.rolling_frictions * rows::kRollingFrictionRows * rows::kFrictionFields);
  }
  in.place_contacts = carver->take<std::uint32_t>(size.contacts);
  in.places = carver->take<rows::Place>(size.contacts);
  in.moves = carver->take<std::uint32_t>(size.bodies);
  in.push_moves = carver->take<std::uint32_t>(size.bodies);
  *least_bytes = carver->used();
  in.push_places = carver->take<rows::Place>(size.contacts);
  return in;
}

struct Outputs {
  RowFindings* findings;
  rows::ContactOutcome* outcomes;
  Real* velocities;
};
Outputs carve_outputs(const GroupSize& size, int iterations, Carver* carver) {
  Outputs out{};
  out.findings =
      reinterpret_cast<RowFindings*>(carver->take<std::byte>(RowFindings::bytes(iterations)));
  out.outcomes = carver->take<rows::ContactOutcome>(size.contacts);
  out.velocities = carver->take<Real>(size.bodies * rows::kOutcomeVelocities);
  return out;
}

class GroupSolverCuda final : public GroupSolver {
 public:
  explicit GroupSolverCuda(int device) : device_(device), stream_(device), pool_(device) {
    const DeviceGuard guard(device_);
    most_blocks_ = most_row_blocks(device_);
  }
  ~GroupSolverCuda() override { static_cast<void>(cudaStreamSynchronize(stream_.get())); }

  GroupInputs inputs(const GroupSize& size) override;
  rows::RowSweepReport solve(const GroupSweeps& sweeps) override;
  const rows::ContactOutcome* outcomes() const override { return results_.outcomes; }
  const Real* velocities() const override { return results_.velocities; }

 private:
  void upload(const GroupSweeps& sweeps);
  RowSweepArgs make_args(const GroupSweeps& sweeps);
  GroupFindings run(RowSweepArgs args, const GroupSweeps& sweeps, int main, int push);

  int device_;
  OwnedStream stream_;
  MemoryPool pool_;
  unsigned most_blocks_ = 0;
  GroupSize size_;
  PinnedBuffer<std::byte> staged_, returned_;
  DeviceBuffer<std::byte> input_, rows_, output_;
  Outputs results_{};
  std::vector<double> residuals_;
};

GroupInputs GroupSolverCuda::inputs(const GroupSize& size) {
  const DeviceGuard guard(device_);
  size_ = size;
  std::size_t least = 0;
  Carver counter(nullptr);
  carve_inputs(size, &counter, &least);
  if (counter.used() > staged_.size()) {
    staged_.grow(with_slack(counter.used()), "contacts for the device");
  }
  Carver carver(staged_.data());
  return carve_inputs(size, &carver, &least);
}

void GroupSolverCuda::upload(const GroupSweeps& sweeps) {
  std::size_t bytes = 0;
  Carver counter(nullptr);
  carve_inputs(size_, &counter, &bytes);
  if (counter.used() > input_.size()) {
    input_.grow(pool_, stream_.get(), with_slack(counter.used()), "contacts");
  }
  bytes += sweeps.push_count * sizeof(rows::Place);
  JFPX_CUDA_TRY(
      cudaMemcpyAsync(input_.data(), staged_.data(), bytes, cudaMemcpyHostToDevice, stream_.get()));
}

RowSweepArgs GroupSolverCuda::make_args(const GroupSweeps& sweeps) {
  std::size_t least = 0;
  Carver inputs(input_.data());
  const GroupInputs in = carve_inputs(size_, &inputs, &least);
  rows::RowGroupArrays group{};
  const auto carve_rows = [&](std::byte* memory) {
    Carver carver(memory);
    group.contact_rows = carver.take<Real>(size_.contacts * rows::kContactFields);
    group.friction_rows =
        carver.take<Real>(size_.contacts * sweeps.directions * rows::kFrictionFields);
    group.main.cells = carver.take<rows::Cell>(size_.bodies * rows::kBodyCells);
    group.push.cells = carver.take<rows::Cell>(size_.bodies * rows::kBodyCells);
    return carver.used();
  };
  const std::size_t row_bytes = carve_rows(nullptr);
  if (row_bytes > rows_.size()) rows_.grow(pool_, stream_.get(), with_slack(row_bytes), "rows");
  carve_rows(rows_.data());

  Carver counter(nullptr);
  carve_outputs(size_, sweeps.iterations, &counter);
  if (counter.used() > output_.size()) {
    output_.grow(pool_, stream_.get(), with_slack(counter.used()), "solved contacts");
  }
  if (counter.used() > returned_.size()) {
    returned_.grow(with_slack(counter.used()), "solved contacts on the host");
  }
  Carver outputs(output_.data());
  const Outputs out = carve_outputs(size_, sweeps.iterations, &outputs);
  group.settings = sweeps.settings;
  group.main.places = in.places;
  group.main.moves = in.moves;
  group.main.count = static_cast<std::uint32_t>(size_.contacts);
  group.push.places = in.push_places;
  group.push.moves = in.push_moves;
  group.push.count = sweeps.push_count;
  group.bodies = in.bodies;
  group.factors = in.factors;
  group.inputs = in.contacts;
  group.contacts = in.place_contacts;
  group.rolling_frictions = in.rolling_frictions;
  group.rolling_friction_rows = in.rolling_friction_rows;
  group.outcomes = out.outcomes;
  group.velocities = out.velocities;
  group.bodies_count = static_cast<std::uint32_t>(size_.bodies);
  group.directions = sweeps.directions;
  RowSweepArgs args{};
  args.group = group;
  args.findings = out.findings;
  args.iterations = static_cast<std::uint32_t>(sweeps.iterations);
  return args;
}

GroupFindings GroupSolverCuda::run(RowSweepArgs args, const GroupSweeps& sweeps, int main,
                                   int push) {
  args.main = main_program(sweeps, main, size_.rolling_frictions > 0);
  args.push = push_program(push);
  launch_row_setup(args, stream_.get());
  launch_row_sweeps(args, most_blocks_, stream_.get());
  launch_row_finish(args, stream_.get());
  Carver carver(returned_.data());
  results_ = carve_outputs(size_, sweeps.iterations, &carver);
  JFPX_CUDA_TRY(cudaMemcpyAsync(returned_.data(), output_.data(), carver.used(),
                                cudaMemcpyDeviceToHost, stream_.get()));
  JFPX_CUDA_TRY(cudaStreamSynchronize(stream_.get()));
  if (results_.findings->stuck != 0) {
    throw DeviceError("cuda: the rows of a group waited for each other for ever");
  }
  const auto count = 2 * static_cast<std::size_t>(sweeps.iterations);
  residuals_.resize(count);
  std::transform(results_.findings->largest(), results_.findings->largest() + count,
                 residuals_.begin(), [](auto bits) { return std::bit_cast<double>(bits); });
  return {.residuals = residuals_.data(),
          .push_residuals = residuals_.data() + sweeps.iterations,
          .pushing = results_.findings->pushing,
          .broken = results_.findings->broken != 0};
}

rows::RowSweepReport GroupSolverCuda::solve(const GroupSweeps& sweeps) {
  const nvtx3::scoped_range range("jfpx solve a group");
  const DeviceGuard guard(device_);
  upload(sweeps);
  const RowSweepArgs args = make_args(sweeps);
  return sweep_until_small(sweeps,
                           [&](int main, int push) { return run(args, sweeps, main, push); });
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
