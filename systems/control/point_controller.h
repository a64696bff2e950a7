// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/control/force_loop.h"
#include "dual_proxy/control/model_terms.h"
#include "dual_proxy/control/selection_blend.h"

namespace dual_proxy {

/** Parameters of PointModel. */
struct PointModelParams {
  double mass{1};  ///< kg, > 0.

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;
};

/** What PointController needs to know of a point robot. */
struct PointTerms {
  double mass{1};  ///< kg.
};

/** Linear velocity of the point and no rotation, as a twist, m/s, rad/s. */
Vector6 CalcTwist(const PointTerms& terms, const Eigen::Vector3d& v) noexcept;

/** The controller's model of a point robot, to be used as ArmModel is. */
class PointModel {
 public:
  using Params = PointModelParams;
  using Terms = PointTerms;

  /** @throws std::invalid_argument if params are not valid. */
  explicit PointModel(Params params);

  const Params& params() const { return params_; }

  /** The pose has no rotation. Neither allocates nor throws.
  @param q  m, in B: position.
  @param v  m/s. */
  void Calc(const Eigen::Vector3d& q, const Eigen::Vector3d& v, Pose* X_BE,
            Terms* terms) const noexcept;

 private:
  Params params_;
};

/** Parameters of PointController. The gains' defaults are the paper's for its
point robot (section V.C). */
struct PointControllerParams {
  double position_stiffness{100};
  double position_damping{20};
  double motion_speed_limit{0};
  /** As in OperationalSpaceControllerParams it has nothing to spend at first
  touch. */
  ForceLoopParams force{.gain = 1.3,
                        .integral_gain = 1.7,
                        .damping = 20,
                        .passivity = {.initial_energy = 0}};
  bool feed_forward{true};
  double selection_blend_time{0.03};
  bool unit_mass_motion_force{true};
  double force_limit{100};
  double force_rate_limit{2e4};
  double period{0.001};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("position_stiffness", &position_stiffness, AtLeast(0),
                   "1/s^2", "Kpm"));
    a->Visit(
        Field("position_damping", &position_damping, AtLeast(0), "1/s", "Kvm"));
    a->Visit(Field("motion_speed_limit", &motion_speed_limit, AtLeast(0), "m/s",
                   "how fast an error of position may be closed, as by a tool "
                   "that a contact kept from its proxy; 0 is none"));
    a->Visit(Field("force", &force,
                   "in force space; its period is ignored: the controller's "
                   "own holds"));
    a->Visit(Field("feed_forward", &feed_forward,
                   "true: the limited proxy's velocity and acceleration are "
                   "fed forward, so that the robot does not trail it by "
                   "Kvm/Kpm; false: eq. (12) as printed"));
    a->Visit(Field(
        "selection_blend_time", &selection_blend_time, AtLeast(0), "s",
        "in which a new selection takes over; 0 switches at once, as printed"));
    a->Visit(Field("unit_mass_motion_force", &unit_mass_motion_force,
                   "true: output motion_force is the command of a unit mass; "
                   "false: F_m as printed"));
    a->Visit(Field("force_limit", &force_limit, Above(0), "N",
                   "bound on the whole command"));
    a->Visit(Field("force_rate_limit", &force_rate_limit, Above(0), "N/s",
                   "bound on its change"));
    a->Visit(Field("period", &period, Above(0), "s", "of control"));
  }
};

/** The force loop of a controller with these parameters. */
ForceLoopParams MakeForceLoopParams(const PointControllerParams& params);

/** Inputs of one cycle: those of OperationalSpaceControllerInput that a point
has, with the same meaning. 3-vectors in B. */
struct PointControllerInput {
  PointTerms model{};
  Eigen::Vector3d v{Eigen::Vector3d::Zero()};  ///< m/s.
  /** dx_m = Omega_m (x_r - x_pr), m. */
  Eigen::Vector3d motion_error{Eigen::Vector3d::Zero()};
  Eigen::Vector3d proxy_velocity{Eigen::Vector3d::Zero()};      ///< m/s.
  Eigen::Vector3d proxy_acceleration{Eigen::Vector3d::Zero()};  ///< m/s^2.
  Eigen::Vector3d reference_force{Eigen::Vector3d::Zero()};     ///< F_r, N.
  /** Omega_f, a projection. */
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  /** Whether force is controlled by the loop of eq. (13). False: F_f is
  reference_force as it is, in force space. */
  bool force_feedback{true};
  Eigen::Vector3d sensed_force{Eigen::Vector3d::Zero()};  ///< F_s, N.
  /** Whether the force sensor can be relied on; without it nothing is
  force-controlled. */
  bool sensor_ready{true};
};

/** Results of one cycle; 3-vectors in B. */
struct PointControllerOutput {
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};  ///< N: what pushes the mass.
  /** Command in motion space: m/s^2 = N for 1 kg, or F_m in N
  (unit_mass_motion_force). */
  Eigen::Vector3d motion_force{Eigen::Vector3d::Zero()};
  /** F_f, command in force space, N. */
  Eigen::Vector3d contact_force{Eigen::Vector3d::Zero()};
  double observed_energy{0};   ///< J.
  double injected_damping{0};  ///< N s/m.
};

/** Memory of PointController. */
struct PointControllerState {
  SelectionBlendState force_selection;
  ForceLoopState loop;
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};  ///< Sent last, N.
  std::int64_t bad_inputs{0};                      ///< Cycles refused.
  std::int64_t force_limited{0};  ///< Cycles in which force_limit acted.
  std::int64_t rate_limited{0};   ///< Cycles in which the rate limit acted.
};

/** Unified force/motion control of a point of mass m, eq. (12), (13) and (14)
in three degrees of freedom:

    a   = Omega_m (-[Kpm dx_m] - Kvm (v - v_p) + a_p)
    F_f by ForceLoop, or as given (force_feedback)
    F   = m a + F_f

with Omega_m = I - Omega_b (the blended selection), [.] bounded to Kvm
motion_speed_limit if that is given, v_p and a_p the limited proxy's velocity
and acceleration (feed_forward). There is no gravity. The force is limited in
size, and last of all in its change from the force sent last, which is zero
before the first cycle.

Refused cycles: if an input is not finite or the selection is not a projection,
the force goes to zero at the rate limit, motion and contact forces are zero,
the controller's memory rests, and state.bad_inputs counts it.

Update() neither allocates nor throws. */
class PointController {
 public:
  using Params = PointControllerParams;
  using Input = PointControllerInput;
  using Output = PointControllerOutput;
  using State = PointControllerState;

  /** @throws std::invalid_argument if params are not valid. */
  explicit PointController(Params params = {});

  const Params& params() const { return params_; }

  State MakeState() const noexcept;

  /** Advances by one period.
  @param[in,out] state  made by MakeState(). */
  Output Update(const Input& input, State* state) const noexcept;

 private:
  /** Limits `force` in size and rate, and remembers it as sent. */
  Eigen::Vector3d Send(const Eigen::Vector3d& force,
                       State* state) const noexcept;

  Params params_;
  ForceLoop loop_;
  SelectionBlend blend_;
};

}  // namespace dual_proxy
