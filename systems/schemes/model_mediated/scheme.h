// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>

#include <Eigen/Core>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/link/sample_sender.h"
#include "dual_proxy/proxy/virtual_spring.h"
#include "dual_proxy/proxy/workspace_map.h"
#include "dual_proxy/schemes/half.h"
#include "dual_proxy/schemes/model_mediated/surface_estimator.h"

namespace dual_proxy {

/** Parameters of scheme `model_mediated`; in the robot's scale unless said. */
struct ModelMediatedParams {
  double contact_force{1};
  /** Until the hand has the model, and knows of the contact: enough for the
  surface to be measured. */
  double holding_force{2};
  double min_stiffness{200};
  double max_stiffness{2000};
  double default_stiffness{500};
  double min_excursion{0.001};
  double surface_time{0.2};
  double surface_speed{0.04};
  double device_damping{27};
  double force_scale{1};
  double force_rate{20};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const { ValidateFields("ModelMediatedParams", *this); }

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("contact_force", &contact_force, Above(0), "N",
                   "above it a surface is felt, and its place measured"));
    a->Visit(Field("holding_force", &holding_force,
                   AtLeast({contact_force, "contact_force"}), "N",
                   "with which the robot stays on a surface of which the hand "
                   "does not know yet"));
    a->Visit(Field("min_stiffness", &min_stiffness, Above(0), "N/m",
                   "of a surface, at least"));
    a->Visit(Field("max_stiffness", &max_stiffness,
                   AtLeast({min_stiffness, "min_stiffness"}), "N/m",
                   "of a surface, at most"));
    a->Visit(Field("default_stiffness", &default_stiffness,
                   Between({min_stiffness, "min_stiffness"},
                           {max_stiffness, "max_stiffness"}),
                   "N/m", "of a surface where it can not be observed"));
    a->Visit(Field("min_excursion", &min_excursion, Above(0), "m",
                   "motion along the normal, rms, with which the stiffness is "
                   "observed"));
    a->Visit(Field("surface_time", &surface_time, Above(0), "s",
                   "of the low-pass on the surface's place"));
    a->Visit(Field("surface_speed", &surface_speed, Above(0), "m/s",
                   "of the surface that the hand feels, towards the one that "
                   "the robot has found"));
    a->Visit(Field("device_damping", &device_damping, AtLeast(0), "N s/m",
                   "in a surface, of the device itself: Bm = this / "
                   "(force_scale map.scale)"));
    a->Visit(Field("force_scale", &force_scale, Above(0), "",
                   "kappa: share of f_d that the hand feels"));
    a->Visit(Field("force_rate", &force_rate, Above(0), "N/s",
                   "how fast a model that changes, or is forgotten, may change "
                   "the force on the hand"));
  }
};

/** What `model_mediated` sends to the robot. */
struct ModelMediatedMotionMessage {
  static constexpr MessageTag kTag = MakeMessageTag("model_mediated");
  static constexpr int kSize = 15;

  std::int64_t sequence{-1};
  double send_time{0};  ///< Sender's clock, s.
  Pose pose{};          ///< x_p, R_d, in B and in the robot's scale.
  /** f_cmd n, N, in B: of the model, without damping. */
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};

  /** Writes or reads the kSize numbers of the body. */
  void WriteBody(double* body) const noexcept;
  void ReadBody(const double* body) noexcept;
};

/** What `model_mediated` sends to the device: a plane, in B. */
struct ModelMediatedSurfaceMessage {
  static constexpr MessageTag kTag = MakeMessageTag("model_mediated");
  static constexpr int kSize = 8;

  std::int64_t sequence{-1};
  double send_time{0};  ///< Sender's clock, s.
  bool contact{false};  ///< The tool is on it.
  /** n, into it; zero before the first contact. */
  Eigen::Vector3d normal{Eigen::Vector3d::Zero()};
  /** m: the point of it that is nearest to the tool, n . point = d. A plane's
  distance from the robot's base would jump by millimetres as n turns by one
  degree. */
  Eigen::Vector3d point{Eigen::Vector3d::Zero()};
  double stiffness{0};  ///< k, N/m.

  /** Writes or reads the kSize numbers of the body. */
  void WriteBody(double* body) const noexcept;
  void ReadBody(const double* body) noexcept;
};

/** True if the message may be acted on: finite, its pose is a pose. */
bool IsValid(const ModelMediatedMotionMessage& message) noexcept;
/** True if the message may be acted on: finite, with a unit normal and a
positive stiffness, or without contact and normal. */
bool IsValid(const ModelMediatedSurfaceMessage& message) noexcept;

/** What ModelMediatedRobotHalf remembers. */
struct ModelMediatedRobotHalfState {
  RobotSideProxyState proxy;
  SurfaceEstimatorState surface;
  /** f_cmd n of the message in use, N, in B. */
  Eigen::Vector3d commanded{Eigen::Vector3d::Zero()};
  VirtualSpringState force;
  SampleSenderState<ModelMediatedSurfaceMessage> sender;
  RobotHalfOutput output{};  ///< Of the last period.
};

/** The robot half of scheme `model_mediated`: across the force space motion
control, by RobotSideProxy, in it the force loop with

    F_r = f n + [(Omega_f - n n^T) k_vir (x_pr - x_r)]

n, d and k by SurfaceEstimator. f is f_cmd, what the hand feels. While the hand
has not got the model, x_p lies beyond the surface with little f_cmd or none:
the robot stays there with holding_force. When x_p has left the surface, a
spring of k pulls the robot after it:

    g = min(holding_force, k (n . x_p - d))       f = f_cmd > 0 ? max(f_cmd, g)
                                                                : g

The robot's proxy x_pr follows the hand, x_p + f_cmd n / k. Across n that is
x_p; along n, where it counts without a contact only, the robot comes so upon a
surface that is not quite where the model has it, and goes through one that is
no more. The model has one direction: in a second one of the force space (a
corner) the hand feels nothing, and the robot has the dual proxy's spring, [.]
bounded to holding_force. F_r is bounded, rate-limited and handed over as that
of the dual proxy.

Orientations follow R_d as the dual proxy's; the hand feels no moment. Without a
link the robot holds its place and forgets the model. */
class ModelMediatedRobotHalf {
 public:
  using State = ModelMediatedRobotHalfState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  ModelMediatedRobotHalf(const RobotHalfParams& shared,
                         const ModelMediatedParams& own);

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const RobotHalfInput& input,
              State* state) const noexcept;

 private:
  /** N, in B: F_r before its limits.
  @param way m: x_pr - x_r. */
  Eigen::Vector3d CalcForce(const Eigen::Vector3d& way,
                            const Eigen::Matrix3d& force_selection,
                            const State& state) const noexcept;

  ModelMediatedParams params_;
  RobotSideProxy proxy_;
  SurfaceEstimator estimator_;
  VirtualSpring limiter_;
  double other_stiffness_;  // N/m: k_vir.
  SampleSender<ModelMediatedSurfaceMessage> sender_;
};

/** The plane that the hand feels, in B. */
struct ModelMediatedSurface {
  Eigen::Vector3d normal{Eigen::Vector3d::UnitZ()};  ///< n, into it.
  /** d_r, m: of the points n . x = d_r. */
  double offset{std::numeric_limits<double>::infinity()};
  double stiffness{0};  ///< k_r, N/m.
};

/** What ModelMediatedHapticHalf remembers. */
struct ModelMediatedHapticHalfState {
  LinkMonitorState link;
  bool known{false};                   ///< There is a model.
  ModelMediatedSurfaceMessage goal{};  ///< What the robot has found.
  ModelMediatedSurface surface{};      ///< What the hand feels.
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};  ///< f_d, N, in B.
  /** N, in B: of a forgotten model. */
  Eigen::Vector3d fading{Eigen::Vector3d::Zero()};
  SampleSenderState<ModelMediatedMotionMessage> sender;
  HapticHalfOutput output{};  ///< Of the last period.
};

/** The haptic half of scheme `model_mediated`:

    pen = max(0, n . x_d - d_r)      f_d = k_r pen n + Bm (n . v_d) n
    x_p = x_d - pen n                f_cmd = k_r pen

f_d only ever pushes the hand out of the surface, and its damping is whole from
1 N of the spring on. The plane that the hand feels goes to the one that the
robot has found,

- at once, as far as that gives no force: a surface that turns up where the hand
  is already begins at the hand;
- then, with the hand in it, d_r by surface_speed at most, turning about the
  hand with a change of n, and all changes together no faster than force_rate at
  a hand that rests.

It stays when the robot leaves the surface. When the link is lost, or a period
is refused and counted because its time, pose or velocity is not valid, the
model is forgotten and the force goes to zero at force_rate. */
class ModelMediatedHapticHalf {
 public:
  using State = ModelMediatedHapticHalfState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  ModelMediatedHapticHalf(const HapticHalfParams& shared,
                          const ModelMediatedParams& own);

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const HapticHalfInput& input,
              State* state) const noexcept;

 private:
  void MoveSurface(const Eigen::Vector3d& x_d, State* state) const noexcept;

  ModelMediatedParams params_;
  WorkspaceMap map_;
  LinkMonitor monitor_;
  SampleSender<ModelMediatedMotionMessage> sender_;
  double max_step_;        // m: of the surface in a period.
  double max_force_step_;  // N: likewise, of f_d.
  double damping_;         // N s/m: Bm.
};

/** A local model of the surface instead of a delayed force: the robot sends
what it has found, the hand feels that at once and commands the force that it
feels (Mitra and Niemeyer, "Model-mediated telemanipulation", International
Journal of Robotics Research 27, 2008). */
struct ModelMediatedScheme {
  static constexpr const char* kName = "model_mediated";
  static constexpr bool kUsesSelections = true;
  static constexpr bool kReclutches = true;
  static constexpr MessageTag kToRobot = ModelMediatedMotionMessage::kTag;
  static constexpr MessageTag kToDevice = ModelMediatedSurfaceMessage::kTag;
  using Params = ModelMediatedParams;
  using RobotHalf = ModelMediatedRobotHalf;
  using HapticHalf = ModelMediatedHapticHalf;

  template <typename ControllerParams>
  static void ApplyPresets(RobotSideProxyParams*, ControllerParams*) {}
};

}  // namespace dual_proxy
