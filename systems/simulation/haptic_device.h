// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of SimulatedHapticDevice; the defaults are an Omega.7 in a firm
hand. */
struct SimulatedHapticDeviceParams {
  // Ranges leave two decades around any device and any hand.
  double hand_mass{0.5};
  double hand_stiffness{600};
  double hand_damping{30};
  double device_mass{0.25};
  double device_damping{1};
  double device_friction{0};
  double max_force{12};
  double workspace_radius{0.08};
  double workspace_half_length{0.055};
  double resolution{1e-5};
  /** At 20 Hz it lags by 8 ms, about as a difference over 20 ms, which vendors'
  drivers use. */
  double velocity_cutoff{20};
  double period{0.001};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("hand_mass", &hand_mass, Between(1e-3, 500), "kg",
                   "moving mass of the hand"));
    a->Visit(Field("hand_stiffness", &hand_stiffness, Between(0, 1e6), "N/m",
                   "K of the pull to the intended position; a soft hand has "
                   "300, a firm one 600"));
    a->Visit(Field("hand_damping", &hand_damping, Between(0, 1e5), "N s/m",
                   "B of the pull to the intended velocity, 10 to 30"));
    a->Visit(Field("device_mass", &device_mass, Between(1e-4, 500), "kg",
                   "moving mass of the device at the handle"));
    a->Visit(Field("device_damping", &device_damping, Between(0, 1e4), "N s/m",
                   "friction of the device, as viscous damping to its base"));
    a->Visit(Field("device_friction", &device_friction, Between(0, 1e3), "N",
                   "dry friction of the device, which also holds it still"));
    a->Visit(Field("max_force", &max_force, Between(0, kMaxForce), "N",
                   "no larger force leaves the device, whatever is commanded"));
    a->Visit(Field("workspace_radius", &workspace_radius,
                   Between(1e-3, kMaxDevicePosition), "m",
                   "about the x axis of D"));
    a->Visit(Field("workspace_half_length", &workspace_half_length,
                   Between(1e-3, kMaxDevicePosition), "m",
                   "along the x axis of D"));
    a->Visit(Field("resolution", &resolution, Between(0, 0.1), "m",
                   "step of the position reading; 0 is none"));
    a->Visit(Field("velocity_cutoff", &velocity_cutoff, CutoffOrNone(), "Hz",
                   "low-pass of the velocity reading; 0 is none"));
    a->Visit(Field("period", &period, Above(0), "s", "of control"));
  }
};

/** What the simulated hand and device remember, and what the driver reads. */
struct SimulatedHapticDeviceState {
  /** True pose X_DH of the handle and true velocity of its origin, m/s, in D.
   */
  Pose pose;
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};

  /** What the driver reads: pose X_DH in steps of the resolution, and twist
  [linear; angular], m/s and rad/s, in D, from differences of that. */
  Pose read_pose;
  Eigen::Matrix<double, 6, 1> read_velocity{
      Eigen::Matrix<double, 6, 1>::Zero()};

  /** K (x_intended - x) + B (v_intended - v), N, in D: with what force the hand
  wants to move the handle. */
  Eigen::Vector3d hand_force{Eigen::Vector3d::Zero()};

  /** N, in D: of the handle on the hand, mean over the period. What a force
  sensor in the handle reads, whatever the device was told. */
  Eigen::Vector3d handle_force{Eigen::Vector3d::Zero()};

  /** The last intended pose X_DH that was valid. */
  Pose intended;

  /** m, in D: from there to where the hand goes, since it gave way. */
  Eigen::Vector3d yielded{Eigen::Vector3d::Zero()};

  /** Updates with an intention or a wrench that was not usable. */
  std::int64_t bad_inputs{0};
};

/** A simulated haptic device (gravity compensated, three actuated directions)
in a simulated hand. Hand and handle move as one mass:

    (m_hand + m_device) a = K (x_intended - x) + B (v_intended - v)
                            - b_device v + F_device + F_friction

It is discretised exactly for a force that is held and an intention that moves
steadily over a period, hence stable for every stiffness, damping and mass. Dry
friction is the force, up to its limit, with which the period ends at rest. At
the end of the workspace the handle stops without bouncing. The wrist is
passive: the handle's orientation is the intended one, and a commanded moment
has no effect.

Input that is not usable is counted: instead of such an intention the hand keeps
to the last good one at rest; such a wrench acts as zero. */
class SimulatedHapticDevice {
 public:
  using Params = SimulatedHapticDeviceParams;
  using State = SimulatedHapticDeviceState;

  /** @throws std::invalid_argument if `params` is invalid. */
  explicit SimulatedHapticDevice(const Params& params = {});

  const Params& params() const { return params_; }

  /** At rest at `pose` (X_DH; moved into the workspace), intending to stay. */
  State MakeState(const Pose& pose = {}) const;

  /** Advances by one period.
  @param intended  pose X_DH that the operator intends at the period's end.
  @param intended_velocity  3-vector, m/s, in D.
  @param device_wrench  [force; moment], N and N m, in D: of the device on the
    hand. The force is limited to max_force.
  @param[in,out] state  made by MakeState().
  @param yields  whether the hand gives way: it goes where the handle goes,
    without force. After that it goes on as intended, but from there.
  No heap, no throw. */
  void Update(const Pose& intended, const Eigen::Vector3d& intended_velocity,
              const Eigen::Matrix<double, 6, 1>& device_wrench, State* state,
              bool yields = false) const noexcept;

 private:
  Eigen::Vector3d ClampToWorkspace(const Eigen::Vector3d& p) const noexcept;

  Params params_;
  // [x - x_intended; v] after a period, from the same and the held
  // acceleration.
  Eigen::Matrix<double, 2, 3> transition_;
  double mobility_{0};  // m/s after a period, per N that is held over it.
  double velocity_gain_{1};
};

}  // namespace dual_proxy
