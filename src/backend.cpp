/// The backend table, explicit and without registration. The only file that asks whether CUDA was
/// compiled in.
#include <jfpx/error.hpp>

#include "src/backend_table.hpp"
#include "src/x86/sphere_collider_x86.hpp"
#if JFPX_HAS_CUDA
#include "src/cuda/group_solver_cuda.hpp"
#include "src/cuda/probe_cuda.hpp"
#include "src/cuda/sphere_collider_cuda.hpp"
#endif

namespace jfpx::inline JFPX_ABI {
namespace {

#if JFPX_HAS_CUDA
BackendStatus probe_cuda() { return cuda::probe(); }
std::unique_ptr<SphereCollider> make_cuda_sphere_collider(const SphereColliderOptions& options) {
  return cuda::make_sphere_collider(options);
}
std::unique_ptr<GroupSolver> make_cuda_group_solver(int device) {
  return cuda::make_group_solver(device);
}
#else
BackendStatus probe_cuda() {
  return {.backend = Backend::cuda, .device = {}, .reason = "built without CUDA"};
}
std::unique_ptr<SphereCollider> make_cuda_sphere_collider(const SphereColliderOptions&) {
  throw BackendUnavailable("cuda: built without CUDA");
}
std::unique_ptr<GroupSolver> make_cuda_group_solver(int) {
  throw BackendUnavailable("cuda: built without CUDA");
}
#endif

constexpr BackendRow kRows[] = {
    {Backend::x86, true, x86::probe, x86::make_sphere_collider, nullptr},
    {Backend::cuda, JFPX_HAS_CUDA != 0, probe_cuda, make_cuda_sphere_collider,
     make_cuda_group_solver},
};

}  // namespace

const BackendRow& backend_row(Backend backend) {
  for (const BackendRow& row : kRows) {
    if (row.backend == backend) return row;
  }
  throw InvalidArgument("backend is " + std::to_string(static_cast<int>(backend)) +
                        "; it must be automatic, x86 or cuda");
}

std::vector<BackendStatus> available_backends() {
  std::vector<BackendStatus> statuses;
  for (const BackendRow& row : kRows) statuses.push_back(row.probe());
  return statuses;
}

std::string_view to_string(Backend backend) noexcept {
  switch (backend) {
    case Backend::automatic:
      return "auto";
    case Backend::x86:
      return "x86";
    case Backend::cuda:
      return "cuda";
  }
  return "unknown";
}

std::optional<Backend> parse_backend(std::string_view text) noexcept {
  for (const Backend backend : {Backend::automatic, Backend::x86, Backend::cuda}) {
    if (text == to_string(backend)) return backend;
  }
  return std::nullopt;
}

}  // namespace jfpx::inline JFPX_ABI
