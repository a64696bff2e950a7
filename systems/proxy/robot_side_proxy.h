// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "dual_proxy/common/arm_limits.h"
#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/link/link_monitor.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/proxy/pose_interpolator.h"
#include "dual_proxy/proxy/trajectory_limiter.h"
#include "dual_proxy/proxy/virtual_spring.h"
#include "dual_proxy/proxy/workspace_limits.h"
#include "dual_proxy/proxy/workspace_map.h"

namespace dual_proxy {

/** Parameters of the robot side of the dual proxy. */
struct RobotSideProxyParams {
  WorkspaceMapParams map;
  WorkspaceLimitsParams workspace;  ///< Where the robot proxy may go.
  TrajectoryLimiterParams limiter;  ///< How fast; its period is `period`.
  LinkMonitorParams link;
  /// True: the device's poses are joined to a motion with continuous velocity
  /// (PoseInterpolator), one message interval behind. False: the target is the
  /// newest pose, a staircase.
  bool interpolate{true};
  PoseInterpolatorParams interpolator;
  double stiffness{500.0};            ///< k_vir_r, N/m, >= 0.
  double rotational_stiffness{10.0};  ///< N m/rad, >= 0.
  double max_force{20.0};             ///< Bound on |F_r|, N, >= 0.
  double max_moment{2.0};             ///< Bound on |M_r|, N m, >= 0.
  double force_rate{50.0};            ///< Bound on the change of F_r, N/s, > 0.
  double moment_rate{10.0};  ///< Bound on the change of M_r, N m/s, > 0.
  /// Bound on |dx_m|, m, >= 0; 0 is none. It bounds the force with which the
  /// robot meets a surface that the filter has not found yet.
  double max_motion_error{0.02};
  /// How far proxy and robot may part, m, (0, 0.25]: where the robot can not
  /// follow, the proxy waits; a robot that leaves its proxy in force space is
  /// held by F_r, which max_force then bounds no more.
  double max_distance{0.15};
  /// (0, 1]: share of the limiter's accelerations that the proxy uses until it
  /// has met the device's poses, when these come for the first time or again.
  double catch_up_share{1.0};
  /// Bound on the proxy's speed from when a lost link is back until the proxy
  /// has met the device's poses, m/s, > 0: meanwhile the hand may have gone
  /// deep into a surface that the robot has let go.
  double recovery_speed{0.06};
  /// Whether the robot never travels to where the hand is: when it begins to
  /// follow, for the first time or again, the hand's pose of that moment counts
  /// as the robot's own, and the map is displaced by what lies between them.
  bool reclutch{false};
  /// How F_r and M_r start in a new direction.
  Handover handover{Handover::kBumpless};
  double period{0.001};  ///< Time between two calls of Update(), s, > 0.

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("map", &map, "between device and robot"));
    a->Visit(Field("workspace", &workspace, "where the robot proxy may go"));
    a->Visit(Field("limiter", &limiter, "how fast; its period is `period`"));
    a->Visit(Field("link", &link, "what counts as a good message"));
    a->Visit(Field("interpolate", &interpolate,
                   "true: the device's poses are joined to a motion with "
                   "continuous velocity, one message interval behind; false: "
                   "the target is the newest pose"));
    a->Visit(Field("interpolator", &interpolator, "how poses are joined"));
    a->Visit(Field("stiffness", &stiffness, AtLeast(0), "N/m", "k_vir_r"));
    a->Visit(Field("rotational_stiffness", &rotational_stiffness, AtLeast(0),
                   "N m/rad", "likewise of rotations"));
    a->Visit(Field("max_force", &max_force, AtLeast(0), "N", "bound on |F_r|"));
    a->Visit(
        Field("max_moment", &max_moment, AtLeast(0), "N m", "bound on |M_r|"));
    a->Visit(Field("force_rate", &force_rate, Above(0), "N/s",
                   "bound on the change of F_r"));
    a->Visit(Field("moment_rate", &moment_rate, Above(0), "N m/s",
                   "bound on the change of M_r"));
    a->Visit(Field("max_motion_error", &max_motion_error, AtLeast(0), "m",
                   "bound on |dx_m|, 0 is none"));
    a->Visit(Field("max_distance", &max_distance,
                   Between(Open(0), kMaxProxyDistance), "m",
                   "how far proxy and robot may part"));
    a->Visit(Field("catch_up_share", &catch_up_share, Between(Open(0), 1), "",
                   "share of the limiter's accelerations until the proxy has "
                   "met the device's poses"));
    a->Visit(Field("recovery_speed", &recovery_speed, Above(0), "m/s",
                   "of the proxy, from when a lost link is back until it has "
                   "met the device's poses; no more than the limiter's"));
    a->Visit(Field("reclutch", &reclutch,
                   "true: when the robot begins to follow, for the first time "
                   "or again, the hand's pose of that moment counts as the "
                   "robot's own, so that it never travels by itself, and the "
                   "map is displaced by what lies between them, as on "
                   "hardware; false: the robot goes to where the hand is"));
    VisitEnum(a, "RobotSideProxyParams", "handover", &handover,
              "how the forces start in a new direction: from the sensed force, "
              "or from where they are");
    a->Visit(Field("period", &period, Above(0), "s", "between updates"));
  }
};

/** One tick's inputs, in B unless said. */
struct RobotSideProxyInput {
  PoseMessage message;  ///< The newest from the haptic side: X_DH, in D.
  Pose X_BE;            ///< Pose of the robot's tool point.
  /// Omega_f and Omega_tau: orthogonal projections.
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d moment_selection{Eigen::Matrix3d::Zero()};
  /// Whether the sensed force and moment are given; they are only used for the
  /// bumpless hand-over.
  bool has_sensed{false};
  Eigen::Vector3d sensed_force{Eigen::Vector3d::Zero()};   ///< F_s, N.
  Eigen::Vector3d sensed_moment{Eigen::Vector3d::Zero()};  ///< M_s, N m.
  /// Whether the force sensor can be relied on; without it the robot holds its
  /// place.
  bool sensor_ready{true};
  /// Whether the robot is to hold its place, as without a link.
  bool hold{false};
};

/** One tick's outputs, in B. */
struct RobotSideProxyOutput {
  /// dx_m, m.
  Eigen::Vector3d motion_error{Eigen::Vector3d::Zero()};
  /// dphi_m, rad: Omega_rot times the rotation vector of R_r R_prᵀ.
  Eigen::Vector3d rotation_error{Eigen::Vector3d::Zero()};
  Eigen::Vector3d reference_force{Eigen::Vector3d::Zero()};   ///< F_r, N.
  Eigen::Vector3d reference_moment{Eigen::Vector3d::Zero()};  ///< M_r, N m.
  /// What of the inputs' selections dx_m and F_r go by: for the controller.
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d moment_selection{Eigen::Matrix3d::Zero()};
  Pose proxy_pose;  ///< The limited robot proxy x_pr, R_pr.
  /// Of the limited proxy, [linear m/s; angular rad/s].
  Eigen::Matrix<double, 6, 1> proxy_velocity{
      Eigen::Matrix<double, 6, 1>::Zero()};
  /// Of the limited proxy, [linear m/s^2; angular rad/s^2].
  Eigen::Matrix<double, 6, 1> proxy_acceleration{
      Eigen::Matrix<double, 6, 1>::Zero()};
  LinkStatus link_status{LinkStatus::kWaiting};
  double link_age{0};  ///< Now minus the send time of the message in use, s.
};

/** Memory of the robot side; `output` holds the last tick's outputs. */
struct RobotSideProxyState {
  bool initialized{false};  ///< True once a robot pose has been seen.
  /// How long the proxy has been catching up with the device's poses, s, up to
  /// 2; that, once it has met them.
  double catch_up_time{0};
  /// Whether that is after a loss, no faster than recovery_speed.
  bool recovering{false};
  PoseInterpolatorState interpolator;  ///< Of the mapped device poses, in B.
  /// In B, with `reclutch`: p is added to a mapped position, and R is by what a
  /// mapped rotation is multiplied, from the right.
  Pose clutch_offset;
  bool following{false};  ///< Whether the device's poses were, last tick.
  LinkMonitorState link;
  TrajectoryLimiterState limiter;
  VirtualSpringState force;
  VirtualSpringState moment;
  RobotSideProxyOutput output;
  std::int64_t bad_inputs{0};  ///< Ticks whose inputs were refused.
};

/** The robot side of the dual proxy: turns the device's delayed poses into what
the robot's controller is to do, eq. (4), spec section 3.

    dx_m = Ω_m (x_r - x_pr)        F_r = -k_vir_r Ω_f (x_r - x_pr)

and alike for rotation. x_pr is the mapped device pose, interpolated between
messages, clamped to the workspace and taken there by the TrajectoryLimiter; F_r
comes from a VirtualSpring, so it never steps but for the documented hand-over.
dx_m is shortened to max_motion_error.

The link:
- Before the first message the proxy is the robot's pose at the first tick: the
  robot holds its place. F_r is zero. Status kWaiting.
- When the link is lost the proxy brakes to rest within the acceleration limit
  and stays; dx_m keeps pulling the robot there; F_r fades to zero at the rate
  limit, and no hand-over takes place. Where the force space then loses a
  direction, the proxy, which lies F_r / k_vir_r inside the surface, is taken
  out to the robot along it: dx_m does not press again. Status kLost. With
  `reclutch` it loses all of them once F_r is zero, so that the robot does not
  creep along a direction that nothing presses in.
- When messages come, for the first time or again, the proxy goes to them
  through the limiter, until it has met them (or for 2 s) with catch_up_share of
  its accelerations, and F_r follows at its rate limit: no jump. Again after a
  loss it is also no faster than recovery_speed until it has met them (or for
  10 s).

While the sensor is not ready the robot holds its place, as without a link.

A tick whose time, pose, selection or sensed force is not valid is refused and
counted: the proxy brakes and F_r fades as if the link were lost; dx_m and
dphi_m are those of the last valid selections, or zero if the pose itself is not
valid.

With `reclutch` the map between hand and robot is displaced whenever the robot
begins to follow, at the first message as after a loss of the link or of the
sensor, so that the hand is where the robot's proxy is; FromRobot() takes it out
of what the hand is to know. Directions of motion stay as they are.

A robot that starts outside the workspace is led into it within the limits; once
inside, the proxy never leaves. */
class RobotSideProxy {
 public:
  /** @throws std::invalid_argument for parameters out of range. */
  explicit RobotSideProxy(RobotSideProxyParams params);

  const RobotSideProxyParams& params() const { return params_; }

  RobotSideProxyState MakeState() const { return {}; }

  /** Advances by one period; the outputs are in state->output.
  @param time s, not decreasing, the clock that message ages are taken by.
  No heap, no throw. */
  void Update(double time, const RobotSideProxyInput& input,
              RobotSideProxyState* state) const noexcept;

  /** The robot's pose as the haptic side may know it: without the clutch's
  offset. No heap, no throw.
  @param X_BE  in B. */
  Pose FromRobot(const Pose& X_BE,
                 const RobotSideProxyState& state) const noexcept;

 private:
  void Reclutch(double time, RobotSideProxyState* state) const noexcept;
  void MoveProxy(double time, const Eigen::Vector3d& p_BE, bool follow,
                 RobotSideProxyState* state) const noexcept;
  void Release(const Pose& X_BE, const Eigen::Matrix3d& Omega_f,
               const Eigen::Matrix3d& Omega_tau,
               RobotSideProxyState* state) const noexcept;

  RobotSideProxyParams params_;
  WorkspaceMap map_;
  WorkspaceLimits workspace_;
  PoseInterpolator interpolator_;
  TrajectoryLimiter limiter_;
  TrajectoryLimiter catch_up_limiter_;
  TrajectoryLimiter recovery_limiter_;
  LinkMonitor monitor_;
  VirtualSpring force_spring_;
  VirtualSpring moment_spring_;
};

}  // namespace dual_proxy
