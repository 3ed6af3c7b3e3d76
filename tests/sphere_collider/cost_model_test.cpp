/// Cost models: what they predict, and that their files survive or are refused by name.
#include <jfpx/cost_model.hpp>
#include <jfpx/error.hpp>

#include "tests/support/temporary_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <limits>

namespace jfpx {
namespace {

using ::testing::HasSubstr;

MeasuredCostModel example() {
  MeasuredCostModel model;
  model.costs.cpu_all_pairs = {.call_us = 1.0 / 3, .sphere_ns = 1e-30, .pair_ns = 0.125};
  model.costs.cuda_given_pairs = {.call_us = 12, .byte_ns = 0.02, .contact_ns = 7};
  model.costs.cuda_start_ms = 1e6;
  model.origin = {.machine = "a \"processor\", 2 cores", .driver = "", .version = "9.9.9"};
  return model;
}

void expect_refused(const std::string& path, const std::string& message) {
  try {
    load_cost_model(path);
    FAIL() << message;
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), HasSubstr(path));
    EXPECT_THAT(error.what(), HasSubstr(message));
  }
}

TEST(CostModel, IsASumOfTerms) {
  const CostTerms terms{.call_us = 2, .byte_ns = 3, .sphere_ns = 5, .pair_ns = 7, .contact_ns = 11};
  // 2 us + (3*100 + 5*1000 + 7*10000 + 11*1) ns = 2 + 75.311 us
  const ColliderWork work{.spheres = 1000, .pairs = 10000, .contacts = 1, .bytes = 100};
  EXPECT_DOUBLE_EQ(microseconds(terms, work), 77.311);
}

TEST(CostModel, DefaultsPreferAllPairsForFewAndSortingForMany) {
  const CostModel costs;
  for (const double n : {2.0, 100.0, 20000.0, 1e6}) {
    const ColliderWork work{.spheres = n, .pairs = n * (n - 1) / 2, .contacts = 3 * n};
    const bool few = n < 1000;
    EXPECT_EQ(microseconds(costs.cpu_all_pairs, work) < microseconds(costs.cpu_grid, work), few);
    EXPECT_EQ(microseconds(costs.cpu_all_pairs, work) < microseconds(costs.cuda_all_pairs, work),
              few);
  }
}

TEST(CostModel, SurvivesItsFileToTheLastBit) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("costs.json");
  const MeasuredCostModel model = example();
  save_cost_model(model, path);
  const MeasuredCostModel loaded = load_cost_model(path);
  EXPECT_EQ(loaded.costs, model.costs);
  EXPECT_EQ(loaded.origin, model.origin);
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(CostModel, TheOldNamesOfTheGridAreRead) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("costs.json");
  save_cost_model(example(), path);
  nlohmann::ordered_json json, old;
  std::ifstream(path) >> json;
  for (const auto& item : json.items()) {
    const std::string& key = item.key();
    const std::size_t at = key.find("_grid");
    old[at != std::string::npos ? key.substr(0, at) + "_sorted_tiles" : key] = item.value();
  }
  std::ofstream(path) << old.dump();
  EXPECT_NE(old.dump().find("cpu_sorted_tiles"), std::string::npos);
  EXPECT_EQ(load_cost_model(path).costs, example().costs);
}

TEST(CostModel, AnInvalidFileIsRejectedWithItsName) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("costs.json");
  expect_refused(path, "can't be opened");
  for (const char* text : {"", "{", "[]", "3", "{}", "null", "{\"jfpx_scene\": 1}"}) {
    std::ofstream(path) << text;
    EXPECT_THROW(load_cost_model(path), FileError) << text;
  }
  EXPECT_THROW(load_cost_model(folder.file("")), FileError);
}

TEST(CostModel, EveryDamagedPartIsFound) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("costs.json");
  save_cost_model(example(), path);
  nlohmann::ordered_json good;
  std::ifstream(path) >> good;
  const auto refused = [&](const nlohmann::ordered_json& json) {
    std::ofstream(path) << json.dump();
    EXPECT_THROW(load_cost_model(path), FileError) << json.dump();
  };
  for (const auto& item : good.items()) {
    auto lacking = good;
    lacking.erase(item.key());
    refused(lacking);
    auto other = good;
    other[item.key()] = nullptr;
    refused(other);
    if (!item.value().is_object()) continue;
    for (const auto& term : item.value().items()) {
      for (const nlohmann::json& bad :
           {nlohmann::json(-1), nlohmann::json("1"), nlohmann::json()}) {
        auto json = good;
        json[item.key()][term.key()] = bad;
        refused(json);
      }
    }
  }
  good["precision"] = sizeof(Real) == 4 ? "double" : "float";
  std::ofstream(path) << good.dump();
  expect_refused(path, "other precision");
}

TEST(CostModel, EveryTruncationIsFound) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("costs.json");
  save_cost_model(example(), path);
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  const std::string whole = text.str();
  // The last character is a line feed, which JSON does not require.
  for (std::size_t size = 0; size + 1 < whole.size(); ++size) {
    std::ofstream(path, std::ios::trunc) << whole.substr(0, size);
    ASSERT_THROW(load_cost_model(path), FileError) << size;
  }
}

TEST(CostModel, IsNotSavedWithAnInvalidTerm) {
  const test::TemporaryFolder folder;
  MeasuredCostModel model = example();
  model.costs.cuda_start_ms = std::numeric_limits<double>::infinity();
  EXPECT_THROW(save_cost_model(model, folder.file("costs.json")), InvalidArgument);
  EXPECT_EQ(folder.entries(), 0u);
  EXPECT_THROW(save_cost_model(example(), folder.file("no/such/folder")), FileError);
}

}  // namespace
}  // namespace jfpx
