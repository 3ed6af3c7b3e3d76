/// Default costs; JSON files of cost models.
#include "src/sphere_collider/cost_model.hpp"

#include <jfpx/error.hpp>

#include "src/base/file.hpp"

#include <nlohmann/json.hpp>

#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using CostJson = nlohmann::ordered_json;

constexpr int kFormat = 2;
constexpr const char* kFormatName = "jfpx_cost_model";
constexpr const char* kPrecision = sizeof(Real) == 4 ? "float" : "double";

struct Way {
  const char* name;
  CostTerms CostModel::*terms;
  const char* old_name = nullptr;  ///< still read: the name in 0.2
};
constexpr Way kWays[] = {
    {"cpu_all_pairs", &CostModel::cpu_all_pairs},
    {"cpu_grid", &CostModel::cpu_grid, "cpu_sorted_tiles"},
    {"cpu_given_pairs", &CostModel::cpu_given_pairs},
    {"cuda_all_pairs", &CostModel::cuda_all_pairs},
    {"cuda_grid", &CostModel::cuda_grid, "cuda_sorted_tiles"},
    {"cuda_given_pairs", &CostModel::cuda_given_pairs},
    {"cpu_world", &CostModel::cpu_world},
    {"cuda_world", &CostModel::cuda_world},
};

struct Term {
  const char* name;
  double CostTerms::*value;
};
constexpr Term kTerms[] = {
    {"call_us", &CostTerms::call_us},       {"byte_ns", &CostTerms::byte_ns},
    {"sphere_ns", &CostTerms::sphere_ns},   {"pair_ns", &CostTerms::pair_ns},
    {"contact_ns", &CostTerms::contact_ns},
};

double read_cost(const CostJson& json, const char* name) {
  const CostJson& value = json.at(name);
  if (!value.is_number()) throw FileError(std::string(name) + " is not a number");
  return value.get<double>();
}

MeasuredCostModel from_json_value(const CostJson& json) {
  if (!json.is_object() || !json.contains(kFormatName)) throw FileError("is not a cost model");
  if (json[kFormatName] != kFormat) throw FileError("is a cost model in another format");
  if (json.at("precision") != kPrecision) throw FileError("has another precision");
  MeasuredCostModel model;
  json.at("machine").get_to(model.origin.machine);
  json.at("driver").get_to(model.origin.driver);
  json.at("version").get_to(model.origin.version);
  for (const Way& way : kWays) {
    const bool old = way.old_name != nullptr && json.contains(way.old_name);
    const CostJson& terms = json.at(old ? way.old_name : way.name);
    for (const Term& term : kTerms) {
      model.costs.*way.terms.*term.value = read_cost(terms, term.name);
    }
  }
  model.costs.cuda_start_ms = read_cost(json, "cuda_start_ms");
  const std::string fault = find_fault(model.costs);
  if (!fault.empty()) throw FileError(fault);
  return model;
}

bool is_cost(double value) { return std::isfinite(value) && value >= 0; }

std::string fault_of(const std::string& name, double value) {
  return name + " is " + std::to_string(value) + "; it must be finite and >= 0";
}

}  // namespace

// Measured by jfpx calibrate on the machines named in the header. Costs of double are those of
// data of twice the width.
CostModel::CostModel() {
  constexpr double kWide = sizeof(Real) / 4.0;
  cpu_all_pairs = {.call_us = 0.05, .sphere_ns = 6, .pair_ns = 0.175 * kWide, .contact_ns = 5};
  cpu_grid = {.call_us = 0.2, .sphere_ns = 52 * kWide, .contact_ns = 11};
  cpu_given_pairs = {.call_us = 0.05, .pair_ns = 5};
  cuda_all_pairs = {.call_us = 13, .byte_ns = 0.05, .sphere_ns = 2.5, .pair_ns = 0.0006 * kWide};
  cuda_grid = {.call_us = 41, .byte_ns = 0.05};
  cuda_given_pairs = {.call_us = 15, .byte_ns = 0.05};
  cpu_world = {.call_us = 5, .sphere_ns = 1250};
  cuda_world = {.call_us = 270, .sphere_ns = 5 * kWide};
}

std::string find_fault(const CostModel& model) {
  for (const Way& way : kWays) {
    for (const Term& term : kTerms) {
      const double value = model.*way.terms.*term.value;
      if (!is_cost(value)) return fault_of(std::string(way.name) + "." + term.name, value);
    }
  }
  if (!is_cost(model.cuda_start_ms)) return fault_of("cuda_start_ms", model.cuda_start_ms);
  return {};
}

std::string to_json(const MeasuredCostModel& model) {
  CostJson json = {{kFormatName, kFormat},
                   {"precision", kPrecision},
                   {"version", model.origin.version},
                   {"machine", model.origin.machine},
                   {"driver", model.origin.driver}};
  for (const Way& way : kWays) {
    for (const Term& term : kTerms) {
      json[way.name][term.name] = model.costs.*way.terms.*term.value;
    }
  }
  json["cuda_start_ms"] = model.costs.cuda_start_ms;
  return json.dump(2) + "\n";
}

void save_cost_model(const MeasuredCostModel& model, const std::string& path) {
  const std::string fault = find_fault(model.costs);
  if (!fault.empty()) throw InvalidArgument("cost model: " + fault);
  write_file(path, to_json(model));
}

MeasuredCostModel load_cost_model(const std::string& path) {
  const std::string text = read_file(path);
  try {
    return from_json_value(CostJson::parse(text));
  } catch (const FileError& error) {
    throw FileError(path + ": " + error.what());
  } catch (const CostJson::exception&) {
    throw FileError(path + ": is damaged JSON or an incomplete cost model");
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
