/// Estimation of cost model terms from measured times.
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

/// Fits the terms in `which`, constrained to be nonnegative, by least squares of the relative
/// errors. All other terms have the values of `known`.
CostTerms fit_costs(std::span<const CostSample> samples, std::span<double CostTerms::*const> which,
                    const CostTerms& known = {});

/// Smallest number of spheres, with three contacts each, for which `b` takes less time than `a`; 0
/// if there is none up to 10^8.
double crossover(const CostTerms& a, const CostTerms& b);

/// The work of a find_contacts() call.
ColliderWork search_work(double spheres, double contacts);
/// The work of a find_touching() call: all bytes are copied, as if every pair touched.
ColliderWork test_work(double spheres, double pairs);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
