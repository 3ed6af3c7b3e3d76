/// Estimation of cost model terms: nonnegative least squares of relative errors.
#include "src/tool/cost_fit.hpp"

#include <jfpx/contact.hpp>

#include <algorithm>
#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

CostTerms fit_costs(std::span<const CostSample> samples, std::span<double CostTerms::*const> which,
                    const CostTerms& known) {
  const std::size_t n = which.size();
  // Each column is the contribution of one unit of a term relative to the measured time, normalized
  // to length 1.
  std::vector<std::vector<double>> columns(n);
  std::vector<double> scale(n), rest(samples.size()), value(n, 0.0);
  for (std::size_t j = 0; j < n; ++j) {
    CostTerms unit;
    unit.*which[j] = 1;
    double length = 0;
    for (const CostSample& s : samples) {
      columns[j].push_back(microseconds(unit, s.work) / s.us);
      length += columns[j].back() * columns[j].back();
    }
    scale[j] = length > 0 ? 1 / std::sqrt(length) : 0;
    for (double& x : columns[j]) x *= scale[j];
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    rest[i] = 1 - microseconds(known, samples[i].work) / samples[i].us;
  }
  // Coordinate descent sets one term at a time to its optimum, or to 0, and converges to the
  // minimum.
  constexpr int kSweeps = 20000;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double largest_change = 0;
    for (std::size_t j = 0; j < n; ++j) {
      double slope = 0;
      for (std::size_t i = 0; i < rest.size(); ++i) slope += columns[j][i] * rest[i];
      const double change = std::max(value[j] + slope, 0.0) - value[j];
      value[j] += change;
      for (std::size_t i = 0; i < rest.size(); ++i) rest[i] -= change * columns[j][i];
      largest_change = std::max(largest_change, std::abs(change));
    }
    if (largest_change < 1e-12) break;
  }
  CostTerms terms = known;
  for (std::size_t j = 0; j < n; ++j) terms.*which[j] = value[j] * scale[j];
  return terms;
}

double crossover(const CostTerms& a, const CostTerms& b) {
  const auto b_wins = [&](double n) {
    return microseconds(b, search_work(n, 3 * n)) < microseconds(a, search_work(n, 3 * n));
  };
  constexpr double kMax = 1e8;
  if (!b_wins(kMax)) return 0;
  double low = 0, high = kMax;
  while (high - low > 1) {
    const double middle = std::floor((low + high) / 2);
    (b_wins(middle) ? high : low) = middle;
  }
  return high;
}

ColliderWork search_work(double spheres, double contacts) {
  return {.spheres = spheres,
          .pairs = spheres * (spheres - 1) / 2,
          .contacts = contacts,
          .bytes = spheres * sizeof(SphereInstance) + contacts * sizeof(SphereContact)};
}

ColliderWork test_work(double spheres, double pairs) {
  return {.spheres = spheres,
          .pairs = pairs,
          .contacts = 0,
          .bytes = spheres * sizeof(SphereInstance) +
                   pairs * (sizeof(SpherePair) + sizeof(PairContact))};
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
