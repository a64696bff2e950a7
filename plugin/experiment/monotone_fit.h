// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** How far values go to and fro: the sum of the squares of what is left of them
about the nearest sequence (least squares) that only rises or only falls,
whichever is nearer. Zero of what settles from one side, however slowly.
@param values n >= 0. If one is not finite, the result is not. */
double CalcMonotoneResidual(const Eigen::Ref<const Eigen::VectorXd>& values);

}  // namespace dual_proxy
