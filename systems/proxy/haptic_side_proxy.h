// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/link/link_monitor.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/proxy/virtual_spring.h"
#include "dual_proxy/proxy/workspace_map.h"

namespace dual_proxy {

/** Parameters of the haptic side of the dual proxy. */
struct HapticSideProxyParams {
  WorkspaceMapParams map;
  LinkMonitorParams link;
  /// k_vir_h, N/m, >= 0. 0 means force-matched: map.scale x robot_stiffness,
  /// with which hand and robot feel the same force. The paper prints 200.
  double stiffness{0.0};
  /// k_vir_r of the robot side, N/m, >= 0; only for the force-matched value.
  double robot_stiffness{500.0};
  double rotational_stiffness{0.5};  ///< N m/rad, >= 0.
  double max_force{12.0};            ///< Bound on |F_h|, N, >= 0: the device's.
  /// Bound on |M_h|, N m, >= 0. 0 for a device without actuated rotations, as
  /// the Omega.7.
  double max_moment{0.0};
  double force_rate{20.0};  ///< Bound on the change of F_h, N/s, > 0.
  /// Likewise while F_h goes to zero because the link is lost, N/s, > 0: 12 N
  /// are gone in 0.1 s.
  double lost_force_rate{120.0};
  /// Whether F_h never pulls the hand into a surface; eq. (5) as printed does,
  /// for up to two delays after the hand has lifted.
  bool unilateral{true};
  double moment_rate{1.0};  ///< Bound on the change of M_h, N m/s, > 0.
  double period{0.001};     ///< Time between two calls of Update(), s, > 0.

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("map", &map, "between device and robot"));
    a->Visit(Field("link", &link, "what counts as a good message"));
    a->Visit(Field("stiffness", &stiffness, AtLeast(0), "N/m",
                   "k_vir_h; 0: force-matched, map.scale x robot_stiffness"));
    a->Visit(Field("robot_stiffness", &robot_stiffness, AtLeast(0), "N/m",
                   "k_vir_r of the robot side"));
    a->Visit(Field("rotational_stiffness", &rotational_stiffness, AtLeast(0),
                   "N m/rad", "likewise of rotations"));
    a->Visit(Field("max_force", &max_force, AtLeast(0), "N",
                   "bound on |F_h|: the device's"));
    a->Visit(Field("max_moment", &max_moment, AtLeast(0), "N m",
                   "bound on |M_h|; 0: moments off"));
    a->Visit(Field("force_rate", &force_rate, Above(0), "N/s",
                   "bound on the change of F_h"));
    a->Visit(Field("lost_force_rate", &lost_force_rate, Above(0), "N/s",
                   "likewise, while it goes to zero without a link"));
    a->Visit(Field("unilateral", &unilateral,
                   "true: F_h never pulls the hand into a surface; false: "
                   "eq. (5) as printed"));
    a->Visit(Field("moment_rate", &moment_rate, Above(0), "N m/s",
                   "bound on the change of M_h"));
    a->Visit(Field("period", &period, Above(0), "s", "between updates"));
  }
};

struct HapticSideProxyInput {
  PoseMessage message;  ///< The newest from the robot side, in B.
  Pose X_DH;            ///< Pose of the handle, in D, from home.
};

/** One tick's outputs, in D. */
struct HapticSideProxyOutput {
  /// F_h, N: the force on the hand.
  Eigen::Vector3d reference_force{Eigen::Vector3d::Zero()};
  /// M_h, N m: the moment on the hand.
  Eigen::Vector3d reference_moment{Eigen::Vector3d::Zero()};
  Pose proxy_pose;  ///< The haptic proxy x_ph, R_ph.
  /// Omega_fh and Omega_tauh, of the message in use; zero without a link.
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d moment_selection{Eigen::Matrix3d::Zero()};
  /// Unit vectors as columns, or zero: into the surfaces into which nothing is
  /// to pull the hand.
  Eigen::Matrix3d contact_normals{Eigen::Matrix3d::Zero()};
  LinkStatus link_status{LinkStatus::kWaiting};
  double link_age{0};  ///< Now minus the send time of the message in use, s.
};

/** Memory of the haptic side; `output` holds the last tick's outputs. */
struct HapticSideProxyState {
  LinkMonitorState link;
  VirtualSpringState force;
  VirtualSpringState moment;
  HapticSideProxyOutput output;
  std::int64_t bad_inputs{0};  ///< Ticks whose inputs were refused.
};

/** The haptic side of the dual proxy: what the hand is to feel, from the
robot's delayed poses and selections, eq. (5), spec section 4.

    F_h = -k_vir_h Ω_fh (x_h - x_ph)

and alike for moments, by a VirtualSpring: saturated, rate-limited, never
stepping; zero in motion space once it has settled. If it is unilateral, what of
F_h would pull the hand along a contact's normal, into the surface, is left out
(RemovePull()). Before the first message F_h is zero and the haptic proxy is the
handle's pose. When the link is lost F_h goes to zero at a rate of its own, and
the selections, by which the device is damped, are zero; when it is back F_h
grows from there.

A tick whose time or handle pose is not valid is refused and counted: F_h fades
as if the link were lost. */
class HapticSideProxy {
 public:
  /** @throws std::invalid_argument for parameters out of range. */
  explicit HapticSideProxy(HapticSideProxyParams params);

  const HapticSideProxyParams& params() const { return params_; }

  /** The stiffness in use, N/m: `stiffness`, or the force-matched one. */
  double stiffness() const { return force_spring_.params().stiffness; }

  HapticSideProxyState MakeState() const { return {}; }

  /** Advances by one period; the outputs are in state->output.
  @param time s, not decreasing, the clock that message ages are taken by.
  No heap, no throw. */
  void Update(double time, const HapticSideProxyInput& input,
              HapticSideProxyState* state) const noexcept;

 private:
  HapticSideProxyParams params_;
  WorkspaceMap map_;
  LinkMonitor monitor_;
  VirtualSpring force_spring_;
  VirtualSpring lost_force_spring_;
  VirtualSpring moment_spring_;
};

}  // namespace dual_proxy
