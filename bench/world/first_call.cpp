/// Time of the first calls of an automatic collider that starts CUDA, and of one in a program that
/// has started CUDA before. A separate program, because a process can start CUDA only once.
#include <jfpx/random.hpp>
#include <jfpx/sphere_collider.hpp>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

namespace {

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - start;
  return passed.count();
}

}  // namespace

int main(int count, char** arguments) {
  if (count > 2 || (count == 2 && std::strcmp(arguments[1], "--ahead") != 0)) {
    std::fprintf(stderr,
                 "usage: first_call [--ahead]   --ahead calls available_backends() first\n");
    return 2;
  }
  using Clock = std::chrono::steady_clock;
  if (count == 2) {
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
  costs.cuda_start_ms = 0;
  const auto collider = jfpx::make_sphere_collider({.costs = costs});
  for (int call = 1; call <= 5; ++call) {
    const Clock::time_point start = Clock::now();
    const std::size_t contacts = collider->find_contacts(spheres).size();
    const double ms = milliseconds_since(start);
    std::printf("call %d                %8.2f ms, %zu contacts by %s\n", call, ms, contacts,
                std::string(to_string(collider->backend())).c_str());
  }
}
