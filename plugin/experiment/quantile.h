// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** The value below which a share of some values lies, linear between two of
them (numpy's default).
@param values n >= 1, finite, in any order.
@param share in [0, 1]. */
double CalcQuantile(Eigen::VectorXd values, double share);

}  // namespace dual_proxy
