/// Costs from measured times.
#pragma once

#include <jfpx/cost_model.hpp>

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

struct CostSample {
  ColliderWork work;
  double us = 0;  ///< > 0
};

/// The terms of `which`, none negative, that come closest to the samples in the sum of squared
/// relative errors; all other terms are those of `known`.
CostTerms fit_costs(std::span<const CostSample> samples, std::span<double CostTerms::*const> which,
                    const CostTerms& known = {});

/// Smallest whole number of spheres, with three contacts each, from which on `b` takes less time
/// than `a`; 0 if it is none up to 10^8.
double crossover(const CostTerms& a, const CostTerms& b);

/// What find_contacts() does for so many spheres and contacts.
ColliderWork search_work(double spheres, double contacts);
/// What test_pairs() does.
ColliderWork test_work(double spheres, double pairs);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
