/// Time of the first calls of an automatic collider that starts CUDA, and of one in a program that
/// has started CUDA before. A separate program, because a process can start CUDA only once.
#include <jfpx/random.hpp>
#include <jfpx/sphere_collider.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <string>
#include <unistd.h>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  const std::chrono::duration<double, std::milli> passed = Clock::now() - start;
  return passed.count();
}

std::vector<jfpx::SphereInstance> cloud() {
  jfpx::Random random(1);
  std::vector<jfpx::SphereInstance> spheres(100'000);
  for (jfpx::SphereInstance& sphere : spheres) {
    sphere = {random.uniform_in_box({0, 0, 0}, {100, 100, 100}), 1};
  }
  return spheres;
}

void first_calls(bool ahead) {
  if (ahead) {
    const Clock::time_point start = Clock::now();
    const bool usable = jfpx::available_backends()[1].usable;
    std::printf("available_backends()  %8.2f ms, CUDA %s\n", milliseconds_since(start),
                usable ? "usable" : "not usable");
  }
  const std::vector<jfpx::SphereInstance> spheres = cloud();
  jfpx::CostModel costs;
  costs.cuda_start_ms = 0;
  const auto collider = jfpx::make_sphere_collider({.costs = costs});
  for (int call = 1; call <= 5; ++call) {
    const Clock::time_point start = Clock::now();
    const std::size_t contacts = collider->find_contacts(spheres).size();
    std::printf("call %-4d             %8.2f ms, %zu contacts by %s\n", call,
                milliseconds_since(start), contacts,
                std::string(to_string(collider->backend())).c_str());
  }
}

/// Prints the time of every call on the CPU until CUDA takes over, or of `calls` calls without
/// CUDA if that is not 0. The first ten calls, which allocate memory, are left out.
void print_cpu_calls(int calls) {
  const std::vector<jfpx::SphereInstance> spheres = cloud();
  jfpx::CostModel costs;
  if (calls > 0) costs.cuda_start_ms = std::numeric_limits<float>::max();
  const auto collider = jfpx::make_sphere_collider({.costs = costs});
  const Clock::time_point begin = Clock::now();
  for (int call = -10; calls > 0 ? call < calls : milliseconds_since(begin) < 5000; ++call) {
    const Clock::time_point start = Clock::now();
    collider->find_contacts(spheres);
    const double ms = milliseconds_since(start);
    if (collider->backend() == jfpx::Backend::cuda) return;
    if (call >= 0) std::printf("%.3f\n", ms);
  }
}

/// The times that this program prints with the arguments, in a process of its own.
std::vector<double> times_of(const std::string& arguments) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(
      popen(("exec /proc/" + std::to_string(getpid()) + "/exe " + arguments).c_str(), "r"), pclose);
  std::vector<double> times;
  double ms = 0;
  while (pipe != nullptr && std::fscanf(pipe.get(), "%lf", &ms) == 1) times.push_back(ms);
  return times;
}

/// Alternates runs in which CUDA starts in the background with runs of as many calls without CUDA,
/// and compares their calls on the CPU.
int compare(int rounds) {
  constexpr double kAllowedMs = 5;
  std::vector<double> with, without;
  for (int round = 0; round < rounds; ++round) {
    const std::vector<double> started = times_of("--times");
    const std::vector<double> plain = times_of("--times " + std::to_string(started.size() + 1));
    with.insert(with.end(), started.begin(), started.end());
    without.insert(without.end(), plain.begin(), plain.end());
  }
  if (with.empty() || without.empty()) {
    std::printf("no calls on the CPU were measured\n");
    return 1;
  }
  for (std::vector<double>* times : {&with, &without}) {
    std::sort(times->begin(), times->end());
    const std::size_t n = times->size();
    std::printf("%-20s %5zu calls: median %.2f, 99th percentile %.2f, longest %.2f ms\n",
                times == &with ? "CUDA starts" : "without CUDA", n, (*times)[n / 2],
                (*times)[n * 99 / 100], times->back());
  }
  const double longer = with.back() - without.back();
  std::printf("the longest call is %.2f ms longer: %s %.0f ms\n", longer,
              longer <= kAllowedMs ? "within" : "MORE THAN", kAllowedMs);
  return longer <= kAllowedMs ? 0 : 1;
}

}  // namespace

int main(int count, char** arguments) {
  const std::string option = count > 1 ? arguments[1] : "";
  const int number = count > 2 ? std::atoi(arguments[2]) : 0;
  if (option.empty() || option == "--ahead") {
    first_calls(option == "--ahead");
  } else if (option == "--times") {
    print_cpu_calls(number);
  } else if (option == "--background") {
    return compare(number > 0 ? number : 5);
  } else {
    std::fprintf(
        stderr,
        "usage: first_call [--ahead | --background [ROUNDS] | --times [CALLS]]\n"
        "--ahead calls available_backends() first. --background compares the calls on the\n"
        "CPU while CUDA starts on another thread with calls without CUDA, in 5 rounds of\n"
        "two processes; exit status 1 if the longest is more than 5 ms longer. --times\n"
        "prints the times of one such process, with CALLS of one without CUDA.\n");
    return 2;
  }
  return 0;
}
