/// Time of the first calls of an automatic collider that starts CUDA, and of one in a program that
/// has started CUDA before. A separate program, because a process can start CUDA only once.
#include <jfpx/random.hpp>
#include <jfpx/sphere_collider.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace {

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - start;
  return passed.count();
}

}  // namespace

int main(int count, char** arguments) {
  const std::string option = count == 2 ? arguments[1] : "";
  const bool background = option == "--background";
  if (count > 2 || (count == 2 && option != "--ahead" && !background)) {
    std::fprintf(stderr,
                 "usage: first_call [--ahead | --background]\n"
                 "--ahead calls available_backends() first; --background starts CUDA with the\n"
                 "default CostModel::cuda_start_ms, on another thread\n");
    return 2;
  }
  using Clock = std::chrono::steady_clock;
  if (option == "--ahead") {
    const Clock::time_point start = Clock::now();
    const bool usable = jfpx::available_backends()[1].usable;
    std::printf("available_backends()  %8.2f ms, CUDA %s\n", milliseconds_since(start),
                usable ? "usable" : "not usable");
  }
  jfpx::Random random(1);
  std::vector<jfpx::SphereInstance> spheres(100'000);
  for (jfpx::SphereInstance& sphere : spheres) {
    sphere = {random.uniform_in_box({0, 0, 0}, {100, 100, 100}), 1};
  }
  jfpx::CostModel costs;
  if (!background) costs.cuda_start_ms = 0;
  const auto collider = jfpx::make_sphere_collider({.costs = costs});
  std::vector<double> cpu_ms, cuda_ms;
  const Clock::time_point begin = Clock::now();
  for (int call = 1; background ? milliseconds_since(begin) < 3000 : call <= 5; ++call) {
    const Clock::time_point start = Clock::now();
    const std::size_t contacts = collider->find_contacts(spheres).size();
    const double ms = milliseconds_since(start);
    (collider->backend() == jfpx::Backend::cuda ? cuda_ms : cpu_ms).push_back(ms);
    if (background && cuda_ms.size() == 20) break;
    if (background && (collider->backend() != jfpx::Backend::cuda || cuda_ms.size() > 5)) continue;
    std::printf("call %-4d             %8.2f ms, %zu contacts by %s\n", call, ms, contacts,
                std::string(to_string(collider->backend())).c_str());
  }
  if (!background) return 0;
  for (const auto& [name, ms] : {std::pair("cpu ", &cpu_ms), {"cuda", &cuda_ms}}) {
    if (ms->empty()) continue;
    std::ranges::sort(*ms);
    std::printf("%zu calls by %s     median %.2f, longest %.2f ms\n", ms->size(), name,
                (*ms)[ms->size() / 2], ms->back());
  }
}
