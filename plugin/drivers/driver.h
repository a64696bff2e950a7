// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <stdexcept>
#include <string>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/control/model_terms.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/sides/operator_aids.h"

namespace dual_proxy {

/** @file
What a side needs of hardware: Open() it, Read() the newest, Write() a command,
Close() it. The loop is the same with what is simulated, replayed and real.

Read() and Write() are for one thread, the side's; they return at once, never
throw, allocate or lock. A driver whose device wants to be served at a rate of
its own has a thread for that (LatestValue). */

/** What went wrong with hardware, in one line: what, and what to do about it.
 */
class DriverError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/** What was read, and when. */
template <typename Value>
struct Reading {
  /** s, MonotonicTime(), at which the device had this value. */
  double time{-std::numeric_limits<double>::infinity()};
  /** Whether the device said so itself: it is there, and reported no fault. A
  valid reading is finite. One that is not valid is the last that was, or what
  it was before there was any. */
  bool valid{false};
  Value value = MakeNothing();

  /** s: how old it is at `now`, infinite if nothing was read yet. */
  double Age(double now) const { return now - time; }

 private:
  static Value MakeNothing() {
    if constexpr (requires { Value::Zero(); }) {
      return Value::Zero();
    } else {
      return Value{};
    }
  }
};

/** A haptic device's handle, in its base frame D. */
struct HandleState {
  Pose X_DH;  ///< From the device's own home, the centre of its workspace.
  Vector6 velocity{Vector6::Zero()};   ///< [linear; angular], m/s, rad/s.
  double gripper_opening{kNoGripper};  ///< m.
  OperatorButtons buttons{};
};

/** A haptic device that is held in the hand. */
class HapticDeviceDriver {
 public:
  virtual ~HapticDeviceDriver() = default;

  /** Finds the device and makes it ready, with no force on the hand.
  @throws DriverError */
  virtual void Open() = 0;

  virtual Reading<HandleState> Read() noexcept = 0;

  /** What is to act until the next call, or until the watchdog finds that there
  is none. What is not finite is none.
  @param wrench  [force; moment] on the hand, N, N m, in D.
  @param gripper_force  N, > 0 opens; ignored where there is no gripper. */
  virtual void Write(const Vector6& wrench, double gripper_force) noexcept = 0;

  /** Takes the force off the hand and lets go of the device. May be called at
  any time, also again. */
  virtual void Close() noexcept = 0;

  /** What is wrong with it, in one line; empty: nothing. */
  virtual std::string fault() const = 0;
};

/** A force/torque sensor at the wrist. */
class ForceTorqueSensorDriver {
 public:
  virtual ~ForceTorqueSensorDriver() = default;

  /** @throws DriverError */
  virtual void Open() = 0;

  /** [force; moment about the sensor's origin], N, N m, in the sensor's frame
  S, as ForceTorqueAdapter takes it: of the arm on the tool. */
  virtual Reading<Vector6> Read() noexcept = 0;

  virtual void Close() noexcept = 0;

  /** What is wrong with it, in one line; empty: nothing. */
  virtual std::string fault() const = 0;
};

}  // namespace dual_proxy
