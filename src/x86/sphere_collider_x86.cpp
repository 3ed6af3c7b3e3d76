/// Sphere contacts on x86.
#include "src/x86/sphere_collider_x86.hpp"

#include <jfpx/error.hpp>

#include "src/shared/sphere_input.hpp"
#include "src/shared/sphere_pair.hpp"

#include <vector>

namespace jfpx::inline JFPX_ABI::x86 {
namespace {

class SphereColliderX86 final : public SphereCollider {
 public:
  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override {
    shared::check_spheres(spheres);
    contacts_.clear();
    const auto n = static_cast<SphereIndex>(spheres.size());
    for (SphereIndex a = 0; a < n; ++a) {
      for (SphereIndex b = a + 1; b < n; ++b) {
        const PairResult r = shared::test_sphere_pair(spheres[a], spheres[b]);
        if (r.touching != 0) contacts_.push_back({a, b, r.normal, r.distance});
      }
    }
    return contacts_;
  }

  std::span<const PairResult> test_pairs(std::span<const SphereInstance> spheres,
                                         std::span<const SpherePair> pairs) override {
    results_.resize(pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (pairs[i].a >= spheres.size() || pairs[i].b >= spheres.size()) {
        shared::reject_pair(pairs, spheres.size());
      }
      results_[i] = shared::test_sphere_pair(spheres[pairs[i].a], spheres[pairs[i].b]);
    }
    return results_;
  }

  Backend backend() const noexcept override { return Backend::x86; }
  SphereAlgorithm algorithm() const noexcept override { return SphereAlgorithm::all_pairs; }

 private:
  std::vector<SphereContact> contacts_;
  std::vector<PairResult> results_;
};

}  // namespace

BackendStatus probe() {
  return {
      .backend = Backend::x86, .compiled = true, .usable = true, .device = "x86-64", .reason = {}};
}

std::unique_ptr<SphereCollider> make_sphere_collider(const SphereColliderOptions&) {
  return std::make_unique<SphereColliderX86>();
}

}  // namespace jfpx::inline JFPX_ABI::x86
