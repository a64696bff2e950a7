// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/quantile.h"

#include <algorithm>
#include <cmath>

namespace dual_proxy {

double CalcQuantile(Eigen::VectorXd values, double share) {
  std::sort(values.begin(), values.end());
  const double place = share * static_cast<double>(values.size() - 1);
  const auto index = static_cast<Eigen::Index>(std::floor(place));
  const double low = values(index);
  const double high = values(std::min(index + 1, values.size() - 1));
  const double t = place - static_cast<double>(index);
  // From the nearer end, so that t = 1 gives exactly `high`.
  return t < 0.5 ? low + (high - low) * t : high - (high - low) * (1.0 - t);
}

}  // namespace dual_proxy
