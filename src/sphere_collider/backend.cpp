/// The backend table, explicit and without registration. Only this file depends on whether the
/// build includes CUDA.
#include <jfpx/error.hpp>

#include "src/sphere_collider/backend_table.hpp"
#include "src/sphere_collider/cpu/sphere_collider_cpu.hpp"
#if JFPX_HAS_CUDA
#include "src/base/cuda/probe.hpp"
#include "src/sphere_collider/cuda/sphere_collider_cuda.hpp"
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

#if JFPX_HAS_CUDA
BackendStatus probe_cuda() { return cuda::probe(); }
std::unique_ptr<SphereCollider> make_cuda_sphere_collider(const SphereColliderOptions& options,
                                                          ThreadPool*) {
  return cuda::make_sphere_collider(options);
}
#else
BackendStatus probe_cuda() {
  return {.backend = Backend::cuda, .device = {}, .reason = "built without CUDA"};
}
std::unique_ptr<SphereCollider> make_cuda_sphere_collider(const SphereColliderOptions&,
                                                          ThreadPool*) {
  throw BackendUnavailable("cuda: built without CUDA");
}
#endif

constexpr BackendRow kRows[] = {
    {Backend::cpu, true, cpu::probe, cpu::make_sphere_collider},
    {Backend::cuda, JFPX_HAS_CUDA != 0, probe_cuda, make_cuda_sphere_collider},
};

}  // namespace

const BackendRow& backend_row(Backend backend) {
  for (const BackendRow& row : kRows) {
    if (row.backend == backend) return row;
  }
  throw InvalidArgument("backend is " + std::to_string(static_cast<int>(backend)) +
                        "; it must be automatic, cpu or cuda");
}

std::vector<BackendStatus> available_backends() {
  std::vector<BackendStatus> statuses;
  for (const BackendRow& row : kRows) statuses.push_back(row.probe());
  return statuses;
}

std::vector<Gpu> available_gpus() {
#if JFPX_HAS_CUDA
  return cuda::probe_all();
#else
  return {};
#endif
}

std::string_view to_string(Backend backend) noexcept {
  switch (backend) {
    case Backend::automatic:
      return "auto";
    case Backend::cpu:
      return "cpu";
    case Backend::cuda:
      return "cuda";
  }
  return "unknown";
}

std::optional<Backend> parse_backend(std::string_view text) noexcept {
  if (text == "x86") return Backend::cpu;  // name of Backend::cpu in version 0.1
  for (const Backend backend : {Backend::automatic, Backend::cpu, Backend::cuda}) {
    if (text == to_string(backend)) return backend;
  }
  return std::nullopt;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
