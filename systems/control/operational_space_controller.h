// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <utility>

#include "dual_proxy/common/arm_limits.h"
#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/control/force_loop.h"
#include "dual_proxy/control/friction_feedback.h"
#include "dual_proxy/control/joint_limits.h"
#include "dual_proxy/control/model_terms.h"
#include "dual_proxy/control/passivity_controller.h"
#include "dual_proxy/control/selection_blend.h"

namespace dual_proxy {

/** How an error of motion becomes a force. */
enum class MotionLaw {
  /** By Lambda: the tool accelerates alike in every posture, eq. (12). */
  kOperationalSpace,
  /** By a spring and a damper: the tool is as stiff in every posture. */
  kCartesianImpedance,
};

template <>
struct EnumStrings<MotionLaw> {
  static constexpr std::pair<MotionLaw, const char*> kValues[] = {
      {MotionLaw::kOperationalSpace, "operational_space"},
      {MotionLaw::kCartesianImpedance, "cartesian_impedance"}};
};

/** Parameters of MotionLaw::kCartesianImpedance. The defaults are the paper's
gains for its two-channel scheme, 100 1/s^2 and 20 1/s, of the 4.4 kg that a
Panda's tool weighs over a table; of rotations, what lets 10 N at a lever of 3
cm turn the tool by 0.6 degrees. */
struct CartesianImpedanceParams {
  double stiffness{440};
  double damping{88};
  double rotational_stiffness{30};
  double rotational_damping{1.5};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const { ValidateFields("CartesianImpedanceParams", *this); }

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("stiffness", &stiffness, AtLeast(0), "N/m", "K"));
    a->Visit(Field("damping", &damping, AtLeast(0), "N s/m", "D"));
    a->Visit(Field("rotational_stiffness", &rotational_stiffness, AtLeast(0),
                   "N m/rad", "K of orientation"));
    a->Visit(Field("rotational_damping", &rotational_damping, AtLeast(0),
                   "N m s/rad", "D of orientation"));
  }
};

/** Parameters of OperationalSpaceController. The gains' defaults are the
paper's for its arm (section VI). */
template <int kJoints>
struct OperationalSpaceControllerParams {
  MotionLaw motion{MotionLaw::kOperationalSpace};
  CartesianImpedanceParams impedance;
  double position_stiffness{500};
  double position_damping{40};
  double rotation_stiffness{600};
  double rotation_damping{38};
  double motion_speed_limit{0};
  double rotation_speed_limit{0};

  double force_gain{2.5};
  double force_integral_gain{5.5};
  double force_damping{20};
  double max_proportional_force{0};
  double max_integral_force{10};
  double force_integral_delay{0};
  double moment_gain{2.5};
  double moment_integral_gain{5.5};
  double moment_damping{0.8};
  double max_proportional_moment{0};
  double max_integral_moment{1};
  double force_speed_limit{0.1};
  double moment_speed_limit{1};
  /** Its phase is what makes force_gain 2.5 need the passivity controller. */
  double force_filter_cutoff{100};

  bool feed_forward{true};
  bool acceleration_feed_forward{true};
  double selection_blend_time{0.03};
  FrictionFeedbackParams friction_feedback;
  bool passivity{true};
  /** It has nothing to spend at first touch: a light tool would bounce on it.
   */
  TimeDomainPassivityParams force_passivity{.initial_energy = 0};
  TimeDomainPassivityParams moment_passivity{.initial_energy = 2e-4,
                                             .max_energy = 2e-4,
                                             .max_damping = 5,
                                             .damping_margin = 1.5};

  /** Lambda turns F_m by up to 17 degrees. */
  bool unit_mass_motion_force{true};
  /** M_m is better here: the inertia about a tool's own axis is a few percent
  of that about the others, so a little friction there makes most of the angular
  acceleration, but little of the moment. */
  bool unit_inertia_motion_moment{false};

  JointVector<kJoints> q_rest{MakeRestPosture()};
  double posture_stiffness{25};
  double posture_damping{10};
  /** From afar, which a passage near a singularity sets free, the spring alone
  would come close to the joints' speed limits. */
  double posture_speed_limit{0};

  double max_mass{50};
  double characteristic_length{0.2};

  JointLimitsParams<kJoints> joint_limits{};
  JointVector<kJoints> torque_limit{ArmLimits<kJoints>{}.torque};
  double torque_rate_limit{ArmLimits<kJoints>{}.torque_rate};
  double torque_margin{0.05};
  bool gravity_compensation{true};
  double period{0.001};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "OperationalSpaceControllerParams", "motion", &motion,
              "the law of motion: a tool that accelerates alike in every "
              "posture, or one that is as stiff");
    a->Visit(Field("impedance", &impedance,
                   "of motion \"cartesian_impedance\", in place of "
                   "position_stiffness to rotation_damping"));
    a->Visit(Field("position_stiffness", &position_stiffness, AtLeast(0),
                   "1/s^2", "Kpm"));
    a->Visit(
        Field("position_damping", &position_damping, AtLeast(0), "1/s", "Kvm"));
    a->Visit(Field("rotation_stiffness", &rotation_stiffness, AtLeast(0),
                   "1/s^2", "Kpm of orientation"));
    a->Visit(Field("rotation_damping", &rotation_damping, AtLeast(0), "1/s",
                   "Kvm of orientation"));
    a->Visit(Field("motion_speed_limit", &motion_speed_limit, AtLeast(0), "m/s",
                   "how fast an error of position may be closed, as by a tool "
                   "that a contact kept from its proxy; 0 is none"));
    a->Visit(Field("rotation_speed_limit", &rotation_speed_limit, AtLeast(0),
                   "rad/s", "likewise of orientation; 0 is none"));
    a->Visit(Field("force_gain", &force_gain, AtLeast(0), "", "Kpf"));
    a->Visit(Field("force_integral_gain", &force_integral_gain, AtLeast(0),
                   "1/s", "Kif"));
    a->Visit(
        Field("force_damping", &force_damping, AtLeast(0), "N s/m", "Kvf"));
    a->Visit(Field("max_proportional_force", &max_proportional_force,
                   AtLeast(0), "N",
                   "bound on |Kpf e|, so that a force far from the reference, "
                   "as of a bias, is answered no faster than the arm's torques "
                   "can turn round; 0 is none"));
    a->Visit(Field("max_integral_force", &max_integral_force, AtLeast(0), "N",
                   "bound on |Kif int e|"));
    a->Visit(
        Field("force_integral_delay", &force_integral_delay, AtLeast(0), "s",
              "before forces and moments of a new contact are integrated"));
    a->Visit(
        Field("moment_gain", &moment_gain, AtLeast(0), "", "Kpf of moments"));
    a->Visit(Field("moment_integral_gain", &moment_integral_gain, AtLeast(0),
                   "1/s", "Kif of moments"));
    a->Visit(Field("moment_damping", &moment_damping, AtLeast(0), "N m s/rad",
                   "Kvf of moments"));
    a->Visit(Field("max_proportional_moment", &max_proportional_moment,
                   AtLeast(0), "N m",
                   "bound on |Kpf e| of moments; 0 is none"));
    a->Visit(Field("max_integral_moment", &max_integral_moment, AtLeast(0),
                   "N m", "bound on |Kif int e| of moments"));
    a->Visit(Field(
        "force_speed_limit", &force_speed_limit, Above(0), "m/s",
        "how fast the tool may move in force space by the loop's own doing"));
    a->Visit(Field("moment_speed_limit", &moment_speed_limit, Above(0), "rad/s",
                   "likewise in moment space"));
    a->Visit(Field("force_filter_cutoff", &force_filter_cutoff, CutoffOrNone(),
                   "Hz", "low-pass on the sensed wrench; 0 is off"));
    a->Visit(Field("feed_forward", &feed_forward,
                   "true: the limited proxy's velocity and acceleration are "
                   "fed forward, so that the robot does not trail it by "
                   "Kvm/Kpm; false: eq. (12) as printed"));
    a->Visit(Field("acceleration_feed_forward", &acceleration_feed_forward,
                   "false: of the two only the velocity, which spares the rate "
                   "of the torques, as on hardware"));
    a->Visit(Field(
        "selection_blend_time", &selection_blend_time, AtLeast(0), "s",
        "in which a new selection takes over; 0 switches at once, as printed"));
    a->Visit(Field("friction_feedback", &friction_feedback,
                   "of what a tool that slides feels"));
    a->Visit(Field("passivity", &passivity,
                   "whether the passivity controllers of both loops act; they "
                   "always observe"));
    a->Visit(Field("force_passivity", &force_passivity,
                   "of the force loop; its enabled and period are ignored"));
    a->Visit(Field("moment_passivity", &moment_passivity,
                   "of the moment loop, N m s/rad and J; its enabled and "
                   "period are ignored"));
    a->Visit(Field("unit_mass_motion_force", &unit_mass_motion_force,
                   "true: output motion_force is the command of a unit mass, "
                   "Lambda^-1 F_m; false: F_m as printed, as it always is of "
                   "motion \"cartesian_impedance\""));
    a->Visit(Field("unit_inertia_motion_moment", &unit_inertia_motion_moment,
                   "true: output motion_moment is the command of a unit "
                   "inertia; false: M_m, N m, as printed; likewise"));
    a->Visit(Field("q_rest", &q_rest, Finite(), "rad",
                   "posture kept in the null space"));
    a->Visit(Field("posture_stiffness", &posture_stiffness, AtLeast(0), "1/s^2",
                   "of the posture"));
    a->Visit(Field("posture_damping", &posture_damping, AtLeast(0), "1/s",
                   "of the posture"));
    a->Visit(Field("posture_speed_limit", &posture_speed_limit, AtLeast(0),
                   "rad/s",
                   "how fast a joint may take up its posture; 0 is none"));
    a->Visit(Field("max_mass", &max_mass, Above(0), "kg",
                   "apparent masses up to here are exact; beyond, towards a "
                   "singularity, the apparent mass falls to zero"));
    a->Visit(
        Field("characteristic_length", &characteristic_length, Above(0), "m",
              "lever that turns rotational inertia into mass for max_mass"));
    a->Visit(
        Field("joint_limits", &joint_limits, "ends and speeds of the joints"));
    a->Visit(
        Field("torque_limit", &torque_limit, Above(0), "N m", "of each joint"));
    a->Visit(Field("torque_rate_limit", &torque_rate_limit, Above(0), "N m/s",
                   "of each joint"));
    a->Visit(Field("torque_margin", &torque_margin, Between(0, Open(1)), "",
                   "share of both torque limits that is kept free"));
    a->Visit(Field("gravity_compensation", &gravity_compensation,
                   "whether the torque holds the arm's weight; false for an "
                   "arm that does so itself, as Franka's"));
    a->Visit(Field("period", &period, Above(0), "s", "of control"));
  }

 private:
  /** Zero; with seven joints the ready posture of Franka's arms. */
  static JointVector<kJoints> MakeRestPosture() {
    if constexpr (kJoints == 7) {
      return JointVector<7>{
          {0, -0.785398, 0, -2.356194, 0, 1.570796, 0.785398}};
    } else {
      return JointVector<kJoints>::Zero();
    }
  }
};

/** The force loop of a controller with these parameters. */
template <int kJoints>
ForceLoopParams MakeForceLoopParams(
    const OperationalSpaceControllerParams<kJoints>& params);

/** Operational-space quantities of one configuration. */
struct OperationalSpaceInertia {
  Matrix6 Lambda{Matrix6::Zero()};  ///< Eq. (11), bounded; kg, kg m, kg m^2.
  bool valid{false};                ///< False: A is not positive definite.
  bool singular{false};             ///< The bound acted.
};

/** Lambda = (J A^-1 J^T)^-1, eq. (11), bounded.

With angular rows scaled by `length` (m) the eigenvalues mu of J A^-1 J^T are
1/kg. Where mu >= 1/max_mass, the apparent mass is 1/mu: exact. Below, with
r = mu max_mass, it is max_mass (3 r - 2 r^2): the same value and slope at the
border, at most 1.125 max_mass, and zero at the singularity, where the direction
is dropped. No heap. */
template <int kJoints>
OperationalSpaceInertia CalcOperationalSpaceInertia(
    const Jacobian<kJoints>& J_BE, const JointMatrix<kJoints>& mass,
    double max_mass, double length) noexcept;

/** Inputs of one cycle. Vectors in B, 3-vectors unless said; every force is
what the robot exerts on its environment. */
template <int kJoints>
struct OperationalSpaceControllerInput {
  ModelTerms<kJoints> model;
  JointVector<kJoints> q{JointVector<kJoints>::Zero()};  ///< rad.
  JointVector<kJoints> v{JointVector<kJoints>::Zero()};  ///< rad/s.
  /** dx_m = Omega_m (x_r - x_pr), m. */
  Eigen::Vector3d motion_error{Eigen::Vector3d::Zero()};
  /** Rotation vector of R_r R_p^T, projected, rad. */
  Eigen::Vector3d rotation_error{Eigen::Vector3d::Zero()};
  /** [linear; angular], m/s, rad/s. */
  Vector6 proxy_velocity{Vector6::Zero()};
  /** [linear; angular], m/s^2, rad/s^2. */
  Vector6 proxy_acceleration{Vector6::Zero()};
  Eigen::Vector3d reference_force{Eigen::Vector3d::Zero()};   ///< F_r, N.
  Eigen::Vector3d reference_moment{Eigen::Vector3d::Zero()};  ///< M_r, N m.
  /** Omega_f, a projection. */
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  /** Omega_tau, a projection. */
  Eigen::Matrix3d moment_selection{Eigen::Matrix3d::Zero()};
  /** Whether force and moment are controlled by the loops of eq. (13). False:
  F_f is reference_force as it is, and M_f reference_moment, in force space. */
  bool force_feedback{true};
  /** [force; moment about E], N, N m. */
  Vector6 sensed_wrench{Vector6::Zero()};
  /** Whether the force sensor can be relied on; without it nothing is
  force-controlled. */
  bool sensor_ready{true};
  /** N m: what the arm got last, if it says so, without gravity compensation
  where the arm adds that itself. */
  std::optional<JointVector<kJoints>> received_torque{};
};

/** Results of one cycle; 3-vectors in B. */
template <int kJoints>
struct OperationalSpaceControllerOutput {
  /** N m; gravity compensation included, if there is one. */
  JointVector<kJoints> torque{JointVector<kJoints>::Zero()};
  /** Command in motion space: m/s^2 = N for 1 kg, or F_m in N
  (unit_mass_motion_force, MotionLaw). */
  Eigen::Vector3d motion_force{Eigen::Vector3d::Zero()};
  /** The same for rotation: rad/s^2, or N m (unit_inertia_motion_moment). */
  Eigen::Vector3d motion_moment{Eigen::Vector3d::Zero()};
  /** F_f, command in force space, N. */
  Eigen::Vector3d contact_force{Eigen::Vector3d::Zero()};
  /** M_f, N m. */
  Eigen::Vector3d contact_moment{Eigen::Vector3d::Zero()};
  double observed_energy{0};          ///< J, force loop.
  double injected_damping{0};         ///< N s/m, force loop.
  double observed_moment_energy{0};   ///< J, moment loop.
  double injected_moment_damping{0};  ///< N m s/rad, moment loop.
};

/** Memory of OperationalSpaceController. */
template <int kJoints>
struct OperationalSpaceControllerState {
  SelectionBlendState force_selection;
  SelectionBlendState moment_selection;
  ForceLoopState force;
  ForceLoopState moment;
  FrictionFeedbackState friction;
  /** Sent last, N m. */
  JointVector<kJoints> torque{JointVector<kJoints>::Zero()};
  /** Of the last model that was one: kg m^2, N m. */
  JointMatrix<kJoints> mass{JointMatrix<kJoints>::Zero()};
  JointVector<kJoints> gravity{JointVector<kJoints>::Zero()};
  bool initialized{false};         ///< A torque was sent.
  std::int64_t bad_inputs{0};      ///< Cycles refused.
  std::int64_t singular{0};        ///< Cycles in which Lambda was bounded.
  std::int64_t joint_limited{0};   ///< Cycles in which joint_limits acted.
  std::int64_t torque_limited{0};  ///< Cycles in which torque_limit acted.
  std::int64_t rate_limited{0};    ///< Cycles in which the rate limit acted.
};

/** Unified force/motion control of an arm in operational space, eq. (10)
to (17), in six degrees of freedom:

    a   = Omega_m   (-[Kpm dx_m] - Kvm (v - v_p) + a_p)          linear
        ; Omega_rot (-[Kp dphi_m] - Kv (w - w_p) + alpha_p)      angular
    F_f, M_f by ForceLoop, or as given (force_feedback)          eq. (13)
    F_t by FrictionFeedback, in motion space
    tau = J^T (Lambda (a - Jdot v) + [F_f + F_t; M_f]) + C v - g + N^T tau_0
    N^T tau_0 = A u - J^T Lambda J u,   u = Kq (q_rest - q) - Dq v

with Omega_m = I - Omega_b, Omega_rot = I - Omega_b,tau (the blended
selections), [.] bounded to Kvm motion_speed_limit (Kv rotation_speed_limit) if
these are given, v_p and a_p the limited proxy's velocity and acceleration
(feed_forward). Kq (q_rest - q) is bounded to Dq posture_speed_limit alike.
Joint-space C v - g and the term in Jdot v account for mu and p of eq. (14)
exactly: without contact and F_f the tool point accelerates by a, whatever the
posture does.

With MotionLaw::kCartesianImpedance the gains are physical ones, K and D in N/m
and N s/m (N m/rad and N m s/rad), and Lambda multiplies what is fed forward
only, in place of Lambda a:

    F_m = Lambda Omega_m a_p + Omega_m (-[K dx_m] - D (v - v_p))

so that the tool in contact is the same spring in every posture, and swings with
its own inertia.

Towards a joint's end or its largest speed the acceleration that the command
asks of it is limited (JointLimits), and the other joints make up for it as far
as they can, for the tool's place before its orientation; what a contact does to
the arm is left out there. The torque is limited per joint to
torque_limit, and last of all in its rate, relative to the torque sent last, or
to the one that the arm got last (received_torque), both with torque_margin; the
first cycle starts at the gravity compensation. Without gravity_compensation g
is left out of all that is sent, and size and rate are those of the rest.

Refused cycles: if an input is not finite, a selection is not a projection or
the mass matrix is not positive definite, the torque goes, at the rate limit, to
the gravity compensation -g and what brakes the joints within 50 ms, as far as
their speeds are known: by the last model that was usable (zero before the first
one). Motion and contact forces are zero, the controller's memory rests, and
state.bad_inputs counts it.

Update() neither allocates nor throws. */
template <int kJoints>
class OperationalSpaceController {
 public:
  using Params = OperationalSpaceControllerParams<kJoints>;
  using Input = OperationalSpaceControllerInput<kJoints>;
  using Output = OperationalSpaceControllerOutput<kJoints>;
  using State = OperationalSpaceControllerState<kJoints>;

  /** @throws std::invalid_argument if params are not valid. */
  explicit OperationalSpaceController(Params params = {});

  const Params& params() const { return params_; }

  State MakeState() const noexcept;

  /** Advances by one period.
  @param[in,out] state  made by MakeState(). */
  Output Update(const Input& input, State* state) const noexcept;

 private:
  using Joints = JointVector<kJoints>;

  /** The torque that is to be added so that no joint passes its limits.
  @param net  N m: what accelerates the arm. */
  Joints CalcLimiting(const Input& input, const Joints& net,
                      State* state) const noexcept;
  /** The torque that holds the arm's weight, if that is the controller's. */
  Joints CalcHolding(const Joints& gravity) const noexcept;
  /** Limits `torque` in size and rate, and remembers it as sent. */
  Joints Send(const Joints& torque, const Input& input,
              State* state) const noexcept;
  /** Brakes the joints, as far as it knows of them, and holds their weight. */
  Output Refuse(const Input& input, State* state) const noexcept;

  Params params_;
  CartesianImpedanceParams gains_;  // Of the motion law in use.
  ForceLoop force_loop_;
  ForceLoop moment_loop_;
  FrictionFeedback friction_;
  SelectionBlend blend_;
  JointLimits<kJoints> joint_limits_;
};

}  // namespace dual_proxy
