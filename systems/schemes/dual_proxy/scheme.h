// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/schemes/half.h"

namespace dual_proxy {

/** What DualProxyRobotHalf remembers. */
struct DualProxyRobotHalfState {
  RobotSideProxyState proxy;
  PoseSenderState sender;
  RobotHalfOutput output{};  ///< Of the last period.
};

/** The robot half of the dual proxy: RobotSideProxy, and a PoseSender with the
robot's pose and its selections. */
class DualProxyRobotHalf {
 public:
  using State = DualProxyRobotHalfState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  explicit DualProxyRobotHalf(const RobotHalfParams& shared,
                              const NoParams& own = {});

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const RobotHalfInput& input,
              State* state) const noexcept;

 private:
  RobotSideProxy proxy_;
  PoseSender sender_;
};

/** What DualProxyHapticHalf remembers. */
struct DualProxyHapticHalfState {
  HapticSideProxyState proxy;
  PoseSenderState sender;
  HapticHalfOutput output{};  ///< Of the last period.
};

/** The haptic half of the dual proxy: HapticSideProxy, and a PoseSender with
the handle's pose.

The device is damped in the force space of the message in use as long as the
link is alive; without a link the force fades out and the damping, which only
ever takes energy, stays. */
class DualProxyHapticHalf {
 public:
  using State = DualProxyHapticHalfState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  explicit DualProxyHapticHalf(const HapticHalfParams& shared,
                               const NoParams& own = {});

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const HapticHalfInput& input,
              State* state) const noexcept;

 private:
  HapticSideProxy proxy_;
  PoseSender sender_;
};

/** The paper's: both sides exchange poses and selections, and each follows its
own proxy by its own controller. Its parameters are those of the two proxies. */
struct DualProxyScheme {
  static constexpr const char* kName = "dual_proxy";
  static constexpr bool kUsesSelections = true;
  static constexpr bool kReclutches = true;
  static constexpr MessageTag kToRobot = PoseMessage::kTag;
  static constexpr MessageTag kToDevice = PoseMessage::kTag;
  using Params = NoParams;
  using RobotHalf = DualProxyRobotHalf;
  using HapticHalf = DualProxyHapticHalf;

  template <typename ControllerParams>
  static void ApplyPresets(RobotSideProxyParams*, ControllerParams*) {}
};

}  // namespace dual_proxy
