// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/monotone_fit.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace dual_proxy {
namespace {

using Eigen::Ref;
using Eigen::VectorXd;

/** Neighbours that the fit gives one value, their mean. */
struct Block {
  double count{0};
  double mean{0};
  double squares{0};  // About the mean.
};

// Pool adjacent violators: a block that lies below the one before it, times
// `sign`, is joined with that.
double CalcResidual(const Ref<const VectorXd>& values, double sign) {
  std::vector<Block> blocks;
  for (const double value : values) {
    Block block{1, sign * value, 0};
    while (!blocks.empty() && blocks.back().mean >= block.mean) {
      const Block& before = blocks.back();
      const double count = before.count + block.count;
      const double rise = block.mean - before.mean;
      const double share = block.count / count;
      block = {
          count, before.mean + share * rise,
          before.squares + block.squares + before.count * share * rise * rise};
      blocks.pop_back();
    }
    blocks.push_back(block);
  }
  double sum = 0;
  for (const Block& block : blocks) sum += block.squares;
  return sum;
}

}  // namespace

double CalcMonotoneResidual(const Ref<const VectorXd>& values) {
  if (!values.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  return std::min(CalcResidual(values, 1), CalcResidual(values, -1));
}

}  // namespace dual_proxy
