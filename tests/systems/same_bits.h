// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

namespace dual_proxy {

/** Whether all numbers are equal, where a NaN equals a NaN. */
inline ::testing::AssertionResult SameBits(const Eigen::VectorXd& a,
                                           const Eigen::VectorXd& b) {
  if (a.size() != b.size()) {
    return ::testing::AssertionFailure()
           << "sizes " << a.size() << " and " << b.size();
  }
  for (int i = 0; i < a.size(); ++i) {
    if (a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i]))) continue;
    return ::testing::AssertionFailure()
           << "element " << i << ": " << a[i] << " and " << b[i];
  }
  return ::testing::AssertionSuccess();
}

/** The same, row by row. */
inline ::testing::AssertionResult SameBits(
    const std::vector<Eigen::VectorXd>& a,
    const std::vector<Eigen::VectorXd>& b) {
  if (a.size() != b.size())
    return ::testing::AssertionFailure()
           << a.size() << " and " << b.size() << " rows";
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto same = SameBits(a[i], b[i]);
    if (!same)
      return ::testing::AssertionFailure()
             << "row " << i << ", " << same.message();
  }
  return ::testing::AssertionSuccess();
}

}  // namespace dual_proxy
