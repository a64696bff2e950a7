// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"

namespace dual_proxy {

enum class PushResult {
  kNone,    ///< Nobody has pushed yet, or not enough to tell.
  kPassed,  ///< The force is that of the robot on the hand.
  kFailed,  ///< It points the wrong way.
};

template <>
struct EnumStrings<PushResult> {
  static constexpr std::pair<PushResult, const char*> kValues[] = {
      {PushResult::kNone, "none"},
      {PushResult::kPassed, "passed"},
      {PushResult::kFailed, "failed"}};
};

/** Finds out by a push whether a sensor's force has the right sign and
direction. The robot holds its place as a spring does, so where a hand pushes it
to, it yields to; it exerts the opposite force on the hand. Over 0.1 s in which
both are large enough, the angle between the displacement and minus the force,
as means, is to be less than 60 degrees: the arm is not as stiff in every
direction, but never so unlike. */
class PushTest {
 public:
  /** m: less says nothing. */
  static constexpr double kLeastDisplacement = 5e-4;

  /** @param force  N, > 0: a push is at least that.
  @param period  s, > 0, between updates.
  @throws std::invalid_argument naming field, range and value. */
  PushTest(double force, double period);

  /** @param p  m, of the tool point. @param force  N, of the robot on its
  environment as the sensor has it. Both in B. Neither allocates nor throws. */
  PushResult Update(const Eigen::Vector3d& p,
                    const Eigen::Vector3d& force) noexcept;

  /** Minus the cosine between displacement and force, of the last push. */
  double cosine() const noexcept { return cosine_; }

 private:
  double force_;
  int needed_;
  bool started_{false};
  Eigen::Vector3d start_{Eigen::Vector3d::Zero()};
  int count_{0};
  Eigen::Vector3d displacement_sum_{Eigen::Vector3d::Zero()};
  Eigen::Vector3d force_sum_{Eigen::Vector3d::Zero()};
  double cosine_{0};
};

}  // namespace dual_proxy
