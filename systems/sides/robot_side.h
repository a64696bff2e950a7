// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/common/window_mean.h"
#include "dual_proxy/control/operational_space_controller.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/link/pose_sender.h"
#include "dual_proxy/proxy/robot_side_proxy.h"
#include "dual_proxy/sides/signal_layout.h"

namespace dual_proxy {

/** Parameters of RobotSide. All `period` fields must be the same. */
struct RobotSideParams {
  RobotSideProxyParams proxy;
  OperationalSpaceControllerParams controller;
  PoseSenderParams sender;
  double filter_period{1 / 15.0};
  double angular_filter_period{0};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("proxy", &proxy, "its half of the scheme"));
    a->Visit(Field("controller", &controller, "of the robot"));
    a->Visit(Field("sender", &sender, "of its poses"));
    a->Visit(Field("filter_period", &filter_period,
                   AtLeast({proxy.period, "proxy.period"}), "s",
                   "between updates of the force-space particle filter, over "
                   "which its inputs are averaged"));
    a->Visit(Field("angular_filter_period", &angular_filter_period, AtLeast(0),
                   "s",
                   "the same of the angular filter; 0 is without one: its "
                   "means are not computed"));
  }
};

/** Inputs of one cycle; vectors in B; every force is what the robot exerts on
its environment. */
struct RobotSideInput {
  PoseMessage message;  ///< The newest from the haptic side: X_DH, in D.
  Pose X_BE;            ///< Pose of the tool point.
  ModelTerms model;
  Vector7 q{Vector7::Zero()};  ///< rad.
  Vector7 v{Vector7::Zero()};  ///< rad/s.
  /// Omega_f and Omega_tau, projections.
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d moment_selection{Eigen::Matrix3d::Zero()};
  /** [force; moment about E], N, N m. */
  Vector6 sensed_wrench{Vector6::Zero()};
  /** Whether the force sensor can be relied on; without it the robot holds its
  place. */
  bool sensor_ready{true};
};

/** The force-space particle filter's inputs; 3-vectors in B. */
struct FilterMeans {
  Eigen::Vector3d sensed_force{Eigen::Vector3d::Zero()};   ///< F_s, N.
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};       ///< v_BE, m/s.
  Eigen::Vector3d motion_force{Eigen::Vector3d::Zero()};   ///< F_m, N.
  Eigen::Vector3d contact_force{Eigen::Vector3d::Zero()};  ///< F_f, N.
};

/** The angular filter's inputs; 3-vectors in B, moments about E. */
struct AngularFilterMeans {
  Eigen::Vector3d sensed_moment{Eigen::Vector3d::Zero()};     ///< M_s, N m.
  Eigen::Vector3d angular_velocity{Eigen::Vector3d::Zero()};  ///< w_BE, rad/s.
  Eigen::Vector3d motion_moment{Eigen::Vector3d::Zero()};     ///< M_m, N m.
  Eigen::Vector3d contact_moment{Eigen::Vector3d::Zero()};    ///< M_f, N m.
};

/** What the parts of the robot side have counted so far, beside the cycles that
were refused. */
struct RobotSideCounters {
  LinkMonitorState link;
  std::int64_t limiter_bad_inputs{0};  ///< Of the proxy's limiter.
  std::int64_t singular{0};            ///< These four of the controller.
  std::int64_t torque_limited{0};
  std::int64_t torque_rate_limited{0};
  std::int64_t joint_limited{0};
  std::int64_t sender_bad_inputs{0};        ///< Of the pose sender.
  std::int64_t force_sender_bad_inputs{0};  ///< Of the baseline's sender.
  std::int64_t means_bad_inputs{0};         ///< Of the filter's means.
  std::int64_t angular_means_bad_inputs{0};
};

/** Results of one cycle, and what of the inputs belongs in a log. */
struct RobotSideOutput {
  RobotSideProxyOutput proxy;
  OperationalSpaceControllerOutput controller;
  /** Means since the filter's last update. */
  FilterMeans filter_means;
  /** The same of the angular filter; zero without one. */
  AngularFilterMeans angular_filter_means;
  PoseMessage message;         ///< Newest message to the haptic side.
  ForceMessage force_message;  ///< The same for the two-channel baseline.

  Pose X_BE;
  Vector6 v_BE{Vector6::Zero()};  ///< [linear; angular], m/s, rad/s.
  Vector7 q{Vector7::Zero()};     ///< rad.
  Vector7 v{Vector7::Zero()};     ///< rad/s.
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  Vector6 sensed_wrench{Vector6::Zero()};
  bool sensor_ready{false};
  std::int64_t link_dropped{0};  ///< Messages refused so far.
  /** Cycles that the proxy or the controller refused so far; a cycle that both
  refuse counts once. */
  std::int64_t bad_inputs{0};
  RobotSideCounters counters;
};

/** Memory of RobotSide. */
struct RobotSideState {
  RobotSideProxyState proxy;
  OperationalSpaceControllerState controller;
  PoseSenderState pose_sender;
  ForceSenderState force_sender;
  /** Of sensed force, velocity, motion force, contact force. */
  WindowMeanState<12> filter_means;
  /** Of sensed moment, angular velocity, motion moment, contact moment. */
  WindowMeanState<12> angular_filter_means;
  RobotSideOutput output;  ///< Of the last cycle.
};

/** All of the robot side's work in one control cycle: proxy, controller, means
for the filters, senders, in this order. It owns no logic but the order; each
part is documented where it is.

The means are a WindowMean over filter_period: a filter that updates at a
multiple of filter_period and looks at the output of the cycle before it sees
exactly one full window. A cycle that the controller refused adds nothing. Those
of the angular filter are alike, over angular_filter_period.

Update() neither allocates nor throws. */
class RobotSide {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit RobotSide(RobotSideParams params = {});

  const RobotSideParams& params() const { return params_; }

  RobotSideState MakeState() const;

  /** Twist of E in B, [linear; angular], m/s, rad/s: J_BE v. One function, so
  that whoever needs it gets the same bits. */
  static Vector6 CalcTwist(const Matrix67& J_BE, const Vector7& v) noexcept;

  /** Advances by one period; results are in state->output.
  @param time s, not decreasing: the clock by which messages are stamped. */
  void Update(double time, const RobotSideInput& input,
              RobotSideState* state) const noexcept;

  /** Names and places of the signals that WriteVector() writes. */
  static const std::vector<SignalSlice>& OutputLayout();

  /** Number of values that WriteVector() writes. */
  static int OutputSize();

  /** Writes the output as one flat vector, by OutputLayout(). No heap.
  @pre vector.size() == OutputSize(). */
  static void WriteVector(const RobotSideOutput& output,
                          Eigen::Ref<Eigen::VectorXd> vector);

 private:
  RobotSideParams params_;
  RobotSideProxy proxy_;
  OperationalSpaceController controller_;
  WindowMean<12> filter_means_;
  std::optional<WindowMean<12>> angular_filter_means_;
  PoseSender pose_sender_;
  ForceSender force_sender_;
};

}  // namespace dual_proxy
