// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/operator.h"

#include <algorithm>

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

void OperatorPathParams::Validate() const {
  constexpr const char* kWho = "OperatorPathParams";
  if (times.size() < 1) {
    ThrowInvalidField(kWho, "times", "at least one time",
                      static_cast<double>(times.size()));
  }
  ThrowUnlessFinite(kWho, "times", times);
  for (int i = 1; i < times.size(); ++i) {
    if (times(i) <= times(i - 1)) {
      ThrowInvalidField(kWho, "times", "strictly increasing times", times(i));
    }
  }
  if (points.cols() != times.size()) {
    ThrowInvalidField(kWho, "points", "one column per time",
                      static_cast<double>(points.cols()));
  }
  ThrowUnlessFinite(kWho, "points", points.reshaped());
  if (interpolation != PathInterpolation::kMinimumJerk &&
      interpolation != PathInterpolation::kLinear &&
      interpolation != PathInterpolation::kCubic) {
    ThrowInvalidField(kWho, "interpolation", "a PathInterpolation",
                      static_cast<int>(interpolation));
  }
}

OperatorPath::OperatorPath(const OperatorPathParams& params) : params_(params) {
  params_.Validate();
  const Eigen::VectorXd& t = params_.times;
  const Eigen::Matrix3Xd& p = params_.points;
  tangents_.setZero(3, t.size());
  for (int i = 1; i + 1 < t.size(); ++i) {
    const double before = t(i) - t(i - 1);
    const double after = t(i + 1) - t(i);
    const Eigen::Vector3d v_before = (p.col(i) - p.col(i - 1)) / before;
    const Eigen::Vector3d v_after = (p.col(i + 1) - p.col(i)) / after;
    tangents_.col(i) = (after * v_before + before * v_after) / (before + after);
  }
}

OperatorPathSample OperatorPath::Calc(double time) const noexcept {
  const Eigen::VectorXd& times = params_.times;
  const Eigen::Matrix3Xd& points = params_.points;
  const int last = static_cast<int>(times.size()) - 1;
  if (!(time > times(0))) return {points.col(0), Eigen::Vector3d::Zero()};
  if (time >= times(last)) return {points.col(last), Eigen::Vector3d::Zero()};

  const double* begin = times.data();
  const int i = static_cast<int>(
      std::upper_bound(begin, begin + last + 1, time) - begin - 1);
  const double duration = times(i + 1) - times(i);
  const double s = (time - times(i)) / duration;  // In [0, 1).
  const Eigen::Vector3d step = points.col(i + 1) - points.col(i);
  OperatorPathSample sample;
  switch (params_.interpolation) {
    case PathInterpolation::kLinear:
      sample.position = points.col(i) + s * step;
      sample.velocity = step / duration;
      break;
    case PathInterpolation::kMinimumJerk:
      sample.position =
          points.col(i) + s * s * s * (10 + s * (-15 + s * 6)) * step;
      sample.velocity = 30 * s * s * (1 - s) * (1 - s) / duration * step;
      break;
    case PathInterpolation::kCubic: {
      const Eigen::Vector3d m0 = duration * tangents_.col(i);
      const Eigen::Vector3d m1 = duration * tangents_.col(i + 1);
      const Eigen::Vector3d c2 = 3 * step - 2 * m0 - m1;
      const Eigen::Vector3d c3 = m0 + m1 - 2 * step;
      sample.position = points.col(i) + s * (m0 + s * (c2 + s * c3));
      sample.velocity = (m0 + s * (2 * c2 + 3 * s * c3)) / duration;
      break;
    }
  }
  return sample;
}

}  // namespace dual_proxy
