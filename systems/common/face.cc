// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/face.h"

namespace dual_proxy {

using drake::math::RigidTransformd;
using drake::math::RotationMatrixd;

RigidTransformd ToRigidTransform(const Pose& X) {
  if (RotationMatrixd::IsValid(X.R)) {
    return RigidTransformd(RotationMatrixd(X.R), X.p);
  }
  if (X.R.allFinite() && X.R.determinant() > 0) {
    return RigidTransformd(RotationMatrixd::ProjectToRotationMatrix(X.R), X.p);
  }
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  return RigidTransformd(
      RotationMatrixd::MakeUnchecked(Eigen::Matrix3d::Constant(kNan)),
      Eigen::Vector3d::Constant(kNan));
}

Eigen::Matrix3d EvalMatrix(const drake::systems::InputPort<double>& port,
                           const drake::systems::Context<double>& context) {
  if (!port.HasValue(context)) return Eigen::Matrix3d::Zero();
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(port.Eval(context).data());
}

}  // namespace dual_proxy
