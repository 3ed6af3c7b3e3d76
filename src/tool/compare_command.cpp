/// jfpx compare: runs a comparison and prints its results.
#include "src/tool/commands.hpp"
#include "src/tool/comparison.hpp"
#include "src/tool/options.hpp"
#include "src/tool/output.hpp"
#include "src/tool/precision.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

std::size_t count_spheres(const Scene& scene) {
  std::size_t spheres = 0;
  for (const BodyDef& body : scene.bodies) spheres += std::holds_alternative<Sphere>(body.shape);
  return spheres;
}

std::string yes_or_first(const std::string& difference) {
  return difference.empty() ? "identical" : "DIFFERS: " + difference;
}

std::string report(const Scene& scene, const RunOptions& options, const Comparison& result) {
  Table engines({"engine", "hash", "contacts", "integrate ms", "broad ms", "detect ms", "solve ms",
                 "total ms"});
  const auto add = [&](const char* name, std::uint64_t hash, std::uint64_t contacts,
                       const StageTimes& t) {
    engines.add({name, hex(hash), std::to_string(contacts), ms(t.integrate), ms(t.broad),
                 ms(t.detect), ms(t.solve), ms(t.total)});
  };
  add("native", result.hash_native, result.contacts_native, result.ms_native);
  add("stock Bullet", result.hash_stock, result.contacts_stock, result.ms_stock);
  add("Bullet with jfpx", result.hash_jfpx, result.contacts_jfpx, result.ms_jfpx);
  return fmt::format(
      "{}: {} spheres, {} steps of {} s, {} precision, backend {}, native resolver {}\n\n{}\n"
      "contacts and times are summed over all steps\n\n"
      "dispatches by jfpx     {} of {}\n"
      "groups solved by jfpx  {}{}\n"
      "contacts compared      {}\n"
      "contact mismatches     {}{}\n"
      "Bullet's trajectories  {}\n",
      scene.name, count_spheres(scene), options.steps, text(scene.dt), kPrecision, result.backend,
      resolver_name(scene.solver), engines.text(), result.batches, options.steps, result.groups,
      result.groups_on_device == 0 ? "" : fmt::format(", {} on the GPU", result.groups_on_device),
      result.contacts_compared, result.contact_mismatches,
      result.contact_mismatches == 0 ? "" : "; first: " + result.first_contact_mismatch,
      yes_or_first(result.first_difference));
}

nlohmann::ordered_json to_json_value(const Scene& scene, const RunOptions& options,
                                     const Comparison& result) {
  nlohmann::ordered_json first;
  if (!result.first_difference.empty()) first = result.first_difference;
  return {{"scene", scene.name},
          {"spheres", count_spheres(scene)},
          {"steps", options.steps},
          {"backend", result.backend},
          {"resolver", resolver_name(scene.solver)},
          {"precision", kPrecision},
          {"threads", options.threads},
          {"batches", result.batches},
          {"groups", result.groups},
          {"groups_on_device", result.groups_on_device},
          {"device_failure", result.device_failure},
          {"trouble", result.trouble},
          {"contacts_compared", result.contacts_compared},
          {"contact_mismatches", result.contact_mismatches},
          {"trajectory_identical", result.trajectory_identical()},
          {"first_difference", first},
          {"hash_native", hex(result.hash_native)},
          {"hash_stock", hex(result.hash_stock)},
          {"hash_jfpx", hex(result.hash_jfpx)},
          {"ms",
           {{"native", to_json_value(result.ms_native)},
            {"stock", to_json_value(result.ms_stock)},
            {"jfpx", to_json_value(result.ms_jfpx)}}}};
}

int run(const RunOptions& options) {
  check_stdout(options);
  const Scene scene = load(options);
  OutputFile json(options.json);
  const Comparison result = compare(scene, options);
  json.write(to_json_value(scene, options, result).dump(2) + "\n");
  json.finish();
  if (wants_table(options)) fmt::print("{}", report(scene, options, result));
  if (options.hash) fmt::print("{}\n", hex(result.hash_jfpx));
  const int status = report_trouble(result.device_failure, result.trouble);
  return result.passed() ? status : kCheckFailed;
}

}  // namespace

void add_compare_command(CLI::App& app, int& status) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand(
      "compare",
      "Run a scene natively, in stock Bullet and in Bullet with jfpx; compare the two runs of "
      "Bullet bit for bit, and their sphere contacts with SphereCollider. The native solver is "
      "another one, so that the native run differs");
  add_scene_options(*command, *options);
  add_run_options(*command, *options);
  command->callback([options, &status] { status = run(*options); });
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
