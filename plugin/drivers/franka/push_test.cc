// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/franka/push_test.h"

#include <algorithm>
#include <cmath>

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

using Eigen::Vector3d;

namespace {

constexpr double kDuration = 0.1;  // s
constexpr double kLeastCosine = 0.5;

}  // namespace

PushTest::PushTest(double force, double period)
    : force_(force),
      needed_(std::max(1, static_cast<int>(std::lround(kDuration / period)))) {
  ThrowUnlessIn("PushTest", "force", force, Above(0));
  ThrowUnlessIn("PushTest", "period", period, Above(0));
}

PushResult PushTest::Update(const Vector3d& p, const Vector3d& force) noexcept {
  if (!started_) {
    started_ = true;
    start_ = p;
  }
  const Vector3d displacement = p - start_;
  if (!(force.norm() >= force_) ||
      !(displacement.norm() >= kLeastDisplacement)) {
    count_ = 0;
    displacement_sum_.setZero();
    force_sum_.setZero();
    return PushResult::kNone;
  }
  displacement_sum_ += displacement;
  force_sum_ += force;
  if (++count_ < needed_) return PushResult::kNone;
  const double scale = displacement_sum_.norm() * force_sum_.norm();
  cosine_ = scale > 0 ? -displacement_sum_.dot(force_sum_) / scale : 0;
  return cosine_ >= kLeastCosine ? PushResult::kPassed : PushResult::kFailed;
}

}  // namespace dual_proxy
