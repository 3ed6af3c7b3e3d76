/// The cost model of this machine, in the user's cache folder.
#include "src/sphere_collider/cost_cache.hpp"

#include <jfpx/error.hpp>

#include "src/base/system.hpp"
#include "src/sphere_collider/backend_table.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFileName =
    sizeof(Real) == 4 ? "cost-model-float.json" : "cost-model-double.json";

std::string first_line(const fs::path& path, const std::string& beginning = {}) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(beginning)) return line.substr(beginning.size());
  }
  return {};
}

/// Returns the models of all GPUs and the driver, e.g. "NVIDIA H200; NVIDIA UNIX x86_64 Kernel
/// Module ...".
std::string describe_driver() {
  const fs::path proc = "/proc/driver/nvidia";
  const std::string version = first_line(proc / "version", "NVRM version: ");
  if (version.empty()) return {};
  std::vector<std::string> models;
  std::error_code ignored;
  for (const auto& gpu : fs::directory_iterator(proc / "gpus", ignored)) {
    const std::string model = first_line(gpu.path() / "information", "Model:");
    models.push_back(model.substr(std::min(model.size(), model.find_first_not_of(" \t"))));
  }
  std::ranges::sort(models);
  std::string text;
  for (const std::string& model : models) text += (text.empty() ? "" : ", ") + model;
  return text + "; " + version;
}

std::string problem_with(const CostModelOrigin& origin) {
  const CostModelOrigin here = this_machine();
  if (origin.version != here.version) return "was measured by jfpx " + origin.version;
  if (origin.machine != here.machine) return "was measured on another machine: " + origin.machine;
  if (origin.driver != here.driver) return "was measured with another GPU or driver";
  return {};
}

}  // namespace

std::string cost_model_path() {
  const fs::path folder = cache_folder();
  return folder.empty() ? std::string() : to_text(folder / "jfpx" / kFileName);
}

CostModelOrigin this_machine() {
  CostModelOrigin origin;
  origin.machine = backend_row(Backend::cpu).probe().device + ", " +
                   std::to_string(std::thread::hardware_concurrency()) + " cores";
  origin.driver = describe_driver();
  return origin;
}

CalibratedCosts calibrated_costs() {
  const std::string path = cost_model_path();
  if (path.empty())
    return {{}, std::string("there is no cache folder: ") + kCacheFolderVariable + " is not set"};
  std::error_code ignored;
  if (!fs::exists(to_path(path), ignored)) return {{}, "this machine was not measured yet"};
  try {
    const MeasuredCostModel model = load_cost_model(path);
    const std::string problem = problem_with(model.origin);
    if (problem.empty()) return {model.costs, {}};
    return {{}, path + " " + problem};
  } catch (const FileError& error) {
    return {{}, error.what()};
  }
}

void store_costs(const CostModel& costs) {
  const std::string path = cost_model_path();
  if (path.empty())
    throw FileError(std::string("cannot store the costs: ") + kCacheFolderVariable + " is not set");
  std::error_code error;
  fs::create_directories(to_path(path).parent_path(), error);
  if (error) throw FileError(path + ": cannot create its folder: " + error.message());
  save_cost_model({costs, this_machine()}, path);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
