// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/face.h"

namespace dual_proxy {

Eigen::Matrix3d EvalMatrix(const drake::systems::InputPort<double>& port,
                           const drake::systems::Context<double>& context) {
  if (!port.HasValue(context)) return Eigen::Matrix3d::Zero();
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(port.Eval(context).data());
}

}  // namespace dual_proxy
