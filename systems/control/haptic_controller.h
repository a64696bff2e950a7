// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/control/selection_blend.h"

namespace dual_proxy {

/** How a haptic device is made to give the hand its force. */
enum class HapticControlMethod {
  /// Eq. (18): for light devices, whose mass the hand hardly feels.
  kOpenLoop,
  /// PI on a force sensor between device and hand.
  kForceFeedback,
  /// A position loop on the haptic proxy: for heavy devices without a sensor.
  kPosition,
};

template <>
struct EnumStrings<HapticControlMethod> {
  static constexpr std::pair<HapticControlMethod, const char*> kValues[] = {
      {HapticControlMethod::kOpenLoop, "open_loop"},
      {HapticControlMethod::kForceFeedback, "force_feedback"},
      {HapticControlMethod::kPosition, "position"}};
};

/** Parameters of HapticController. */
struct HapticControllerParams {
  HapticControlMethod method{HapticControlMethod::kOpenLoop};
  double force_damping{27};
  double force_gain{8};
  double force_integral_gain{30};
  double max_integral_force{10};
  double force_filter_cutoff{30};
  double position_stiffness{4000};
  double position_damping{150};
  double position_force_rate{300};
  double max_force{12};
  double max_moment{0};
  double selection_blend_time{0.03};
  double period{0.001};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "HapticControllerParams", "method", &method,
              "for a light device, one with a force sensor, a heavy one");
    a->Visit(Field("force_damping", &force_damping, AtLeast(0), "N s/m",
                   "Kvf_h: 90 % of the Omega.7's maximum; not with `position`, "
                   "which has its own"));
    a->Visit(Field("force_gain", &force_gain, AtLeast(0), "",
                   "Kpf_h, of force_feedback: the hand feels the device's mass "
                   "divided by 1 + this; for heavy devices: with a light one "
                   "the loop swings (a scenario refuses it)"));
    a->Visit(Field("force_integral_gain", &force_integral_gain, AtLeast(0),
                   "1/s", "Kif_h, of force_feedback"));
    a->Visit(Field("max_integral_force", &max_integral_force, AtLeast(0), "N",
                   "bound on what the integral adds"));
    a->Visit(Field("force_filter_cutoff", &force_filter_cutoff, CutoffOrNone(),
                   "Hz", "low-pass of the sensed force; 0 is none"));
    a->Visit(Field("position_stiffness", &position_stiffness, AtLeast(0), "N/m",
                   "of `position`, towards the haptic proxy: the hand feels "
                   "this / k_vir_h times the robot's force, as much as the "
                   "robot where k_vir_r is this / map.scale"));
    a->Visit(Field("position_damping", &position_damping, AtLeast(0), "N s/m",
                   "of `position`, in force space"));
    a->Visit(Field("position_force_rate", &position_force_rate, Above(0), "N/s",
                   "bound on the change of that spring's force, whose proxy "
                   "moves with each message"));
    a->Visit(Field("max_force", &max_force, AtLeast(0), "N",
                   "the device's maximum"));
    a->Visit(Field("max_moment", &max_moment, AtLeast(0), "N m",
                   "0 for a device without moments"));
    a->Visit(
        Field("selection_blend_time", &selection_blend_time, AtLeast(0), "s",
              "in which the damping of a new selection and new normals take "
              "over; 0 switches at once, as printed"));
    a->Visit(
        Field("period", &period, Above(0), "s", "of the device's control"));
  }
};

/** One cycle's inputs of HapticController, in D. */
struct HapticControllerInput {
  /** F_h, N, and M_h, N m: on the hand. */
  Eigen::Vector3d reference_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d reference_moment{Eigen::Vector3d::Zero()};
  /** [linear; angular], m/s, rad/s. */
  Eigen::Matrix<double, 6, 1> device_velocity{
      Eigen::Matrix<double, 6, 1>::Zero()};
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};  ///< Omega_fh.
  /** Unit vectors into surfaces as columns, or zero. */
  Eigen::Matrix3d contact_normals{Eigen::Matrix3d::Zero()};
  /** x_h - x_ph, m: handle minus haptic proxy; of kPosition alone. */
  Eigen::Vector3d proxy_displacement{Eigen::Vector3d::Zero()};
  /** N: on the hand, beside F_h: of walls and guidance (haptic_fixtures.h). No
  method replaces it. */
  Eigen::Vector3d fixture_force{Eigen::Vector3d::Zero()};
  /** N: of the handle on the hand, as sensed; of kForceFeedback alone. */
  Eigen::Vector3d handle_force{Eigen::Vector3d::Zero()};
};

/** Memory of HapticController. */
struct HapticControllerState {
  SelectionBlendState selection;
  /// Those that were given last, until the damping of the selection that they
  /// belong to has gone.
  Eigen::Matrix3d asked_normals{Eigen::Matrix3d::Zero()};
  /// In force: those before, and by normals_progress, 0 to 1, those that
  /// follow.
  Eigen::Matrix3d last_normals{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d contact_normals{Eigen::Matrix3d::Zero()};
  double normals_progress{1};
  /// Filtered force of the handle on the hand, and the integral's, N, in D.
  Eigen::Vector3d sensed{Eigen::Vector3d::Zero()};
  Eigen::Vector3d integral_force{Eigen::Vector3d::Zero()};
  /// N, in D: of the spring towards the haptic proxy.
  Eigen::Vector3d position_force{Eigen::Vector3d::Zero()};
  std::int64_t bad_inputs{0};  ///< Cycles refused.
};

/** Local control of the haptic device. What the hand is to feel is, in D,

    F = F_h - Kvf_h Omega_fh v_h,   M = M_h

(and the force of fixtures, if there are any) and what is commanded is, by
`method`,

    open_loop:       F, eq. (18)
    force_feedback:  F + Kpf_h (F - F_s) + Kif_h int(F - F_s)
    position:        F_h outside of force space, and in it
                     -K Omega_fh (x_h - x_ph) - D Omega_fh v_h

The paper names the last two in section V.A without equations. Force feedback
hides mass and friction of the device in all directions, those of free motion,
too. It works on the damping as well, which comes late, through the reading of
the velocity. A light device passes most of what it is told on to the hand, so
that the loop swings with a gain that suits a heavy one:
HapticForceLoopSettles() (loop_stability.h) tells. The position loop holds the
hand at the haptic proxy: by position_stiffness in place of k_vir_h, so that for
the same displacement, from which the robot's force follows, the hand feels
position_stiffness / k_vir_h times as much: 3.2 times with the defaults. A hand
that is to feel what the robot does needs k_vir_h = position_stiffness, which is
k_vir_r = position_stiffness / scale where the forces are matched. A scheme
without force space has open-loop control by it.

A new Omega_fh takes over by a SelectionBlend, without which the damping steps
by up to a newton at touch. What would pull the hand into a surface is left out
of F (RemovePull()): what damps a hand that lifts would do so. Where the normals
change, what is left out goes over in selection_blend_time: it would step. What
changes again meanwhile has its turn afterwards. The device
compensates its own gravity p_h. Force and moment are saturated last, on their
norms. If an input that is used is not finite, or a normal no unit vector, the
device wrench is zero and state.bad_inputs counts it.

Update() neither allocates nor throws. */
class HapticController {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit HapticController(HapticControllerParams params = {});

  const HapticControllerParams& params() const { return params_; }

  HapticControllerState MakeState() const noexcept {
    return {.selection = blend_.MakeState()};
  }

  /** Computes one cycle.
  @param[in,out] state     made by MakeState().
  @returns [force; moment], N, N m, in D: on the hand. */
  Eigen::Matrix<double, 6, 1> Update(
      const HapticControllerInput& input,
      HapticControllerState* state) const noexcept;

 private:
  void TakeNormals(const Eigen::Matrix3d& normals, bool first,
                   HapticControllerState* state) const noexcept;
  bool IsUsable(const HapticControllerInput& input) const noexcept;
  Eigen::Vector3d CloseForceLoop(const Eigen::Vector3d& force,
                                 const Eigen::Vector3d& handle_force,
                                 HapticControllerState* state) const noexcept;
  Eigen::Vector3d HoldProxy(const HapticControllerInput& input,
                            const Eigen::Matrix3d& Omega,
                            HapticControllerState* state) const noexcept;

  HapticControllerParams params_;
  SelectionBlend blend_;
  double normals_step_;
  double sensed_gain_;
};

}  // namespace dual_proxy
