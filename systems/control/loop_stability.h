// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/control/force_loop.h"
#include "dual_proxy/control/haptic_controller.h"

namespace dual_proxy {

/** A contact in one direction of an arm. */
struct ContactModel {
  double mass{4.4};       ///< kg: of an arm's tool point over a table.
  double stiffness{3e4};  ///< N/m.
  double damping{50};     ///< N s/m.
};

/** kg, and kg m^2 about the tool's own axis: what an arm's tool weighs where it
is lightest, a Panda's, rounded down. Gains in N/m and N s/m act on this. */
inline constexpr double kLightestMass = 0.6;
inline constexpr double kLightestInertia = 0.005;

/** Tells whether a force loop comes to rest on a contact at its period.

The very ForceLoop, passivity controller and all, holds 5 N on a mass that lies
on a spring and a damper, and starts 10 % too deep. The loop samples every
loop.period, the plant steps every `time_step` (implicit Euler); the two need
have nothing in common. All that is due at an instant acts on what was there
before it, as in a diagram: a command acts from the plant's next step on, and
the sensed force, which passes a sensor, is one period old.

It is at rest if the force stays within 5 % from 1 s on.
@param time_step s, > 0.
@throws std::invalid_argument if `loop` is not valid. */
bool ForceLoopSettles(const ForceLoopParams& loop, const ContactModel& contact,
                      double time_step);

/** Tells whether a force loop keeps its speed limit at its period: it wants 20
N of a free mass, and the mass never gets faster than 1.1 times the limit.
Sampled as in ForceLoopSettles().
@param mass kg, > 0. @param time_step s, > 0.
@throws std::invalid_argument if `loop` is not valid. */
bool ForceLoopKeepsItsSpeedLimit(const ForceLoopParams& loop, double mass,
                                 double time_step);

/** The same as ForceLoopSettles() for motion control of a free unit mass, a =
-stiffness x - damping v, which starts beside its place: true if it does not
swing farther with time.
@param stiffness 1/s^2. @param damping 1/s. @param period s, > 0.
@param time_step s, > 0. */
bool MotionLoopSettles(double stiffness, double damping, double period,
                       double time_step);

/** A haptic device in a hand that holds it: one mass. */
struct HeldDeviceModel {
  double hand_mass;        ///< kg.
  double hand_stiffness;   ///< N/m, of hand to where it means to be.
  double hand_damping;     ///< N s/m, likewise.
  double device_mass;      ///< kg.
  double device_damping;   ///< N s/m, of device to its base.
  double velocity_cutoff;  ///< Hz: of the velocity's reading, 0 is none.
};

/** Tells whether HapticControlMethod::kForceFeedback does not swing farther
with time, by itself: without a scheme's force on the hand, in motion space and
in force space, where the damping is fed back, too.

The very HapticController, at its period; the device moves as
SimulatedHapticDevice does, friction and steps of the encoders left out, and
under the wrench of the period before. What counts for fast motion is the share
of the device's force that the handle passes on, hand_mass / (hand_mass +
device_mass), times the gain: the light device needs the smaller one.
@throws std::invalid_argument if `params` is not valid. */
bool HapticForceLoopSettles(HapticControllerParams params,
                            const HeldDeviceModel& device);

}  // namespace dual_proxy
