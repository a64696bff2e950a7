// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/common/signal_layout.h"
#include "dual_proxy/control/haptic_controller.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/link/pose_sender.h"
#include "dual_proxy/proxy/haptic_side_proxy.h"
#include "dual_proxy/schemes/schemes.h"
#include "dual_proxy/sides/operator_aids.h"

namespace dual_proxy {

/** Parameters of HapticSide. All `period` fields must be the same. */
struct HapticSideParams {
  Scheme scheme{SchemeOf<DualProxyScheme>};
  SchemesParams schemes;
  HapticSideProxyParams proxy;
  HapticControllerParams controller;
  PoseSenderParams sender;
  OperatorAidsParams aids;

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "HapticSideParams", "scheme", &scheme,
              "how the two sides work together");
    a->Visit(Field("schemes", &schemes, "of which that of `scheme` counts"));
    a->Visit(Field("proxy", &proxy, "what the hand is to feel"));
    a->Visit(Field("controller", &controller, "of the device"));
    a->Visit(Field("sender", &sender, "of its messages"));
    a->Visit(Field("aids", &aids, "for its operator"));
  }
};

/** Inputs of one cycle, in D unless said. */
struct HapticSideInput {
  Message message;  ///< The newest from the robot side.
  Pose X_DH;        ///< Pose of the handle, from home.
  /** [linear; angular], m/s, rad/s. */
  Vector6 device_velocity{Vector6::Zero()};
  /** N: of the handle on the hand, from a force sensor there; for the
  controller that has the method kForceFeedback. */
  Eigen::Vector3d handle_force{Eigen::Vector3d::Zero()};
  OperatorButtons buttons{};  ///< Without aids.buttons they do nothing.
  double gripper_opening{
      kNoGripper};  ///< m, of the device's gripper, if it has one.
};

/** Results of one cycle in D, and what of the inputs belongs in a log. */
struct HapticSideOutput {
  /** [force; moment] on the hand, N, N m. */
  Vector6 device_wrench{Vector6::Zero()};
  HapticSetpoint setpoint;  ///< The half's, as the controller got it.

  Pose X_DH;    ///< From the home that the clutch has moved.
  Pose handle;  ///< X_DH from the device's own home.
  Vector6 device_velocity{Vector6::Zero()};
  Eigen::Vector3d handle_force{Eigen::Vector3d::Zero()};
  /** Cycles that the half or the controller refused so far, or in which time
  went back; a cycle that both refuse counts once. */
  std::int64_t bad_inputs{0};
};

/** Memory of HapticSide. */
struct HapticSideState {
  OperatorAidsState aids;
  HapticHalf::State half;
  HapticControllerState controller;
  /** m: the last that was finite while no clutch was pressed. */
  double gripper_opening{kNoGripper};
  /** s: of the last cycle whose time was not refused. */
  double time{-std::numeric_limits<double>::infinity()};
  HapticSideOutput output;  ///< Of the last cycle.

  /** To the robot side: the half's, and the gripper's opening with it. */
  Message message() const {
    Message result = half.output().message;
    result.gripper_opening = gripper_opening;
    return result;
  }
};

/** All of the haptic side's work in one control cycle: the operator's aids, the
scheme's half and the device's controller. It owns no logic but the order.

An input that cannot be (common/possible.h) is refused as one that is not finite
is. Time that goes back is counted, and goes on from there.

Update() neither allocates nor throws. */
class HapticSide {
 public:
  /** @param rotations  whether its signals tell of orientations and moments.
  @throws std::invalid_argument if params are not valid. */
  explicit HapticSide(HapticSideParams params = {}, bool rotations = true);

  const HapticSideParams& params() const { return params_; }

  HapticSideState MakeState() const;

  /** Advances by one period; results are in state->output.
  @param time s, not decreasing: the clock by which messages are stamped. */
  void Update(double time, const HapticSideInput& input,
              HapticSideState* state) const noexcept;

  /** Whether Update() can work on a state: it is of a side with this scheme. */
  bool IsCompatible(const HapticSideState& state) const noexcept {
    return half_.IsCompatible(state.half);
  }

  /** Lists the signals of a state, or writes them. No heap if it writes. */
  void VisitSignals(const HapticSideState& state, SignalSink* sink) const;

  /** Of what VisitSignals() writes. */
  const std::vector<SignalSlice>& layout() const { return layout_; }

 private:
  // With inputs of which what cannot be is NaN.
  void Advance(double time, const HapticSideInput& input,
               HapticSideState* state) const noexcept;

  HapticSideParams params_;
  OperatorAids aids_;
  HapticHalf half_;
  HapticController controller_;
  bool rotations_;
  std::vector<SignalSlice> layout_;
};

}  // namespace dual_proxy
