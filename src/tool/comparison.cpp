/// Comparison of native jfpx, stock Bullet and Bullet with jfpx, step by step.
#include "src/tool/comparison.hpp"

#include <jfpx/bullet/verify.hpp>
#include <jfpx/error.hpp>

#include "src/tool/bullet_world.hpp"
#include "src/tool/native_engine.hpp"
#include "src/tool/output.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

Comparison compare(const Scene& scene, const RunOptions& given) {
  RunOptions options = given;
  // With the default, small scenes would compare Bullet's own code with itself.
  if (!options.minimum_batch) options.minimum_batch = 0;
  const auto native = make_native_engine(scene, options);
  bullet::SceneWorld stock = make_bullet_world(EngineKind::bullet_stock, scene, options);
  bullet::SceneWorld jfpx = make_bullet_world(EngineKind::bullet, scene, options);
  bullet::ContactCheck contacts(make_sphere_collider(collider_options(options)));
  Comparison result;
  Progress progress(scene.name, options.steps, options.quiet);
  for (std::uint64_t step = 1; step <= options.steps; ++step) {
    native->step();
    result.ms_native += native->times();
    result.contacts_native += native->contacts();

    contacts.capture(stock.world());
    stock.step();
    result.ms_stock += stage_times_of_bullet(stock.last_step());
    result.contacts_stock += count_contacts(stock);
    contacts.compare(stock.world(), step);

    jfpx.step();
    result.ms_jfpx += stage_times_of_bullet(jfpx.last_step());
    result.contacts_jfpx += count_contacts(jfpx);
    // All later differences follow from the first one.
    if (result.first_difference.empty()) {
      const auto difference = bullet::first_difference(stock.world(), jfpx.world(), step);
      if (difference) result.first_difference = to_text(*difference);
    }
    progress.advance_to(step);
  }
  result.contacts_compared = contacts.compared();
  result.contact_mismatches = contacts.mismatches();
  if (contacts.first()) result.first_contact_mismatch = to_text(*contacts.first());
  result.hash_native = state_hash(native->states());
  result.hash_stock = stock.state_hash();
  result.hash_jfpx = jfpx.state_hash();
  result.backend = sphere_backend(jfpx);
  result.batches = jfpx.jfpx_dispatcher()->stats().batches;
  if (const bullet::ConstraintSolver* solver = jfpx.jfpx_solver()) {
    result.groups = solver->stats().groups;
    result.groups_on_device = solver->stats().on_device;
  }
  result.device_failure =
      native->device_failure().empty() ? device_failure(jfpx) : native->device_failure();
  result.trouble = native->trouble();
  return result;
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
