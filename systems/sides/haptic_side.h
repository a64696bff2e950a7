// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/control/haptic_controller.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/link/pose_sender.h"
#include "dual_proxy/proxy/haptic_side_proxy.h"
#include "dual_proxy/sides/signal_layout.h"

namespace dual_proxy {

/** Parameters of HapticSide. All `period` fields must be the same. */
struct HapticSideParams {
  HapticSideProxyParams proxy;
  HapticControllerParams controller;
  PoseSenderParams sender;

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("proxy", &proxy, "its half of the scheme"));
    a->Visit(Field("controller", &controller, "of the device"));
    a->Visit(Field("sender", &sender, "of its poses"));
  }
};

/** Inputs of one cycle, in D unless said. */
struct HapticSideInput {
  PoseMessage message;  ///< The newest from the robot side, in B.
  Pose X_DH;            ///< Pose of the handle, from home.
  /** [linear; angular], m/s, rad/s. */
  Eigen::Matrix<double, 6, 1> device_velocity{
      Eigen::Matrix<double, 6, 1>::Zero()};
};

/** Results of one cycle in D, and what of the inputs belongs in a log. */
struct HapticSideOutput {
  HapticSideProxyOutput proxy;
  /** [force; moment] on the hand, N, N m. */
  Eigen::Matrix<double, 6, 1> device_wrench{
      Eigen::Matrix<double, 6, 1>::Zero()};
  PoseMessage message;  ///< Newest message to the robot side.

  Pose X_DH;
  Eigen::Matrix<double, 6, 1> device_velocity{
      Eigen::Matrix<double, 6, 1>::Zero()};
  std::int64_t link_dropped{0};  ///< Messages refused so far.
  /** Cycles that the proxy or the controller refused so far; a cycle that both
  refuse counts once. */
  std::int64_t bad_inputs{0};
  std::int64_t sender_bad_inputs{0};  ///< Samples that the sender refused.
  LinkMonitorState link;              ///< With all that it has counted.
};

/** Memory of HapticSide. */
struct HapticSideState {
  HapticSideProxyState proxy;
  HapticControllerState controller;
  PoseSenderState sender;
  HapticSideOutput output;  ///< Of the last cycle.
};

/** All of the haptic side's work in one control cycle: proxy, device
controller, sender, in this order. It owns no logic but the order.

The device is damped in the force space of the message in use as long as the
link is alive; without a link the force fades out and the damping, which only
ever takes energy, stays.

Update() neither allocates nor throws. */
class HapticSide {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit HapticSide(HapticSideParams params = {});

  const HapticSideParams& params() const { return params_; }

  HapticSideState MakeState() const;

  /** Advances by one period; results are in state->output.
  @param time s, not decreasing: the clock by which messages are stamped. */
  void Update(double time, const HapticSideInput& input,
              HapticSideState* state) const noexcept;

  /** Names and places of the signals that WriteVector() writes. */
  static const std::vector<SignalSlice>& OutputLayout();

  /** Number of values that WriteVector() writes. */
  static int OutputSize();

  /** Writes the output as one flat vector, by OutputLayout(). No heap.
  @pre vector.size() == OutputSize(). */
  static void WriteVector(const HapticSideOutput& output,
                          Eigen::Ref<Eigen::VectorXd> vector);

 private:
  HapticSideParams params_;
  HapticSideProxy proxy_;
  HapticController controller_;
  PoseSender sender_;
};

}  // namespace dual_proxy
