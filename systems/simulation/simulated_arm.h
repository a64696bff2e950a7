// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/control/model_terms.h"
#include "dual_proxy/control/robot.h"
#include "dual_proxy/simulation/contact_scene.h"
#include "dual_proxy/simulation/contact_solver.h"
#include "dual_proxy/simulation/contact_truth.h"

namespace dual_proxy {

/** Parameters of SimulatedArm. S is the wrist sensor's frame, whose axes are
E's. */
struct SimulatedArmParams {
  static constexpr int kMaxBalls = 4;
  static constexpr int kMaxTorqueDelay = 4;

  /** s, > 0: control period, over which the torque is held. */
  double period{0.001};
  /** s, > 0, at least period / 1000: longest integration step. A period takes
  as few steps of one length as that allows. */
  double time_step{0.001};
  /** (3, n), m, in E, n from 1 to 4: centres of the balls that the tool touches
  with, one around E or the corners of a flat tool. They share the surfaces'
  stiffness. */
  Eigen::Matrix3Xd p_EBall{Eigen::Matrix3Xd::Zero(3, 1)};
  /** m, in S: tool point. */
  Eigen::Vector3d p_SE{Eigen::Vector3d::Zero()};
  /** kg, >= 0: mass beyond the sensor, a part of the arm's last link. */
  double tool_mass{0};
  /** m, in S: centre of that mass. */
  Eigen::Vector3d tool_com{Eigen::Vector3d::Zero()};
  /** kg m^2, of that mass about its centre, along the axes of S: as an inertia
  of ArmModelParams. */
  Eigen::Matrix3d tool_inertia{Eigen::Matrix3d::Zero()};
  /** N m, >= 0: Coulomb's, in each joint. */
  double joint_friction{0};
  /** N m, >= 0: between the torques that a joint can give; 0: any. */
  double torque_step{0};
  /** Periods before a torque acts, 0 to kMaxTorqueDelay; the first one acts
  until it does. */
  int torque_delay{0};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;
};

/** Where the arm is and what it touches there. */
template <int kJoints>
struct SimulatedArmState {
  JointVector<kJoints> q{JointVector<kJoints>::Zero()};  ///< rad.
  JointVector<kJoints> v{JointVector<kJoints>::Zero()};  ///< rad/s.
  // At q and v.
  Pose X_BE;                      ///< Of the tool point.
  Vector6 v_BE{Vector6::Zero()};  ///< Twist of it in B.
  ModelTerms<kJoints> terms;      ///< Of the arm that is simulated.
  /** Of the last step; nothing before the first. */
  ContactTruth truth;
  /** [force; moment] about the origin of S, N and N m, in S: of the arm on the
  tool, in the last step; zero before the first. As a real sensor's reading it
  holds the tool's weight and inertia. */
  Vector6 reaction{Vector6::Zero()};
  std::int64_t bad_inputs{0};  ///< Updates with a torque that was not finite.
  /** N s, in B: in the last step, of each ball on each surface (a column). */
  Eigen::Matrix<double, 3, kMaxPointContacts> impulses{
      Eigen::Matrix<double, 3, kMaxPointContacts>::Zero()};
  /** N m: those that do not act yet, a ring. */
  Eigen::Matrix<double, kJoints, SimulatedArmParams::kMaxTorqueDelay> late{
      decltype(late)::Zero()};
  std::int64_t periods{0};
};

/** An arm that torques and gravity move and that touches surfaces with its
tool: the plant of an experiment, without Drake.

    A dv/dt + b = tau + tau_g - J^T F,

F being what the tool exerts on its environment, by steps as Drake's discrete
plant takes them: velocities with the terms at the beginning of the step and the
contacts at its end (see SolveContacts()), then positions with the new
velocities. Contacts are implicit, with Hunt and Crossley's normal force and
Coulomb's friction: they are stable at any stiffness and step, and stick without
creeping (ContactSurfaceParams::stiction_speed does not count here). Balls touch
each surface in one point; where a ball touches two surfaces, it does so in two.

Joint friction is regularised: below kCreep, 1 mrad/s, it is viscous. Joint
limits are not simulated. A torque that is not finite
is counted and acts as zero. */
template <int kJoints>
class SimulatedArm {
 public:
  using Robot = SerialArm<kJoints>;
  using Params = SimulatedArmParams;
  using State = SimulatedArmState<kJoints>;
  using Joints = JointVector<kJoints>;

  /** @param arm  with the tool as a part of its last link.
  @param scene  its tool_radius is that of every ball.
  @throws std::invalid_argument if a parameter is invalid, or the tool heavier
  than the arm's last link. */
  SimulatedArm(const Params& params, const ArmModelParams<kJoints>& arm,
               const ContactSceneParams& scene = {});

  const Params& params() const { return params_; }
  const ArmModelParams<kJoints>& arm() const { return model_.params(); }
  const ContactSceneParams& scene() const { return scene_; }

  /** At joint positions `q` (rad) with velocities `v` (rad/s).
  @throws std::invalid_argument unless they are finite. */
  State MakeState(const Joints& q, const Joints& v = Joints::Zero()) const;

  /** Advances by one period under a torque (N m). No heap, no throw. */
  void Update(const Joints& torque, State* state) const noexcept;

 private:
  static constexpr double kCreep = 1e-3;  // rad/s

  struct Contacts {
    std::array<PointContact, kMaxPointContacts> points;
    /** Of each its column of SimulatedArmState::impulses. */
    std::array<int, kMaxPointContacts> pairs;
  };

  /** What acts in this period of the torques so far. */
  Joints TakeTorque(const Joints& torque, State* state) const noexcept;
  void Step(const Joints& torque, State* state) const noexcept;
  /** Pose, twist and terms at q and v. */
  void CalcKinematics(State* state) const noexcept;
  /** What touches by the end of a step.
  @param twist  of the tool point without contact. @returns their number. */
  int FindContacts(const State& state, const Vector6& twist,
                   Contacts* contacts) const noexcept;
  /** SimulatedArmState::reaction.
  @param acceleration  [linear; angular] of the tool point, in B.
  @param wrench  [force; moment] of the tool on its environment, about E, in B.
  */
  Vector6 CalcReaction(const State& state, const Vector6& acceleration,
                       const Vector6& wrench) const noexcept;

  Params params_;
  ArmModel<kJoints> model_;
  ContactSceneParams scene_;
  std::vector<ContactSurface> surfaces_;
  int num_steps_{1};
  double step_{0.001};
};

}  // namespace dual_proxy
