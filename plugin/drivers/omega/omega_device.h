// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/drivers/haptic_device_thread.h"

namespace dual_proxy {

/** What of a device is OperatorButtons::clutch. */
enum class HandleClutch { kNone, kButton, kGripper };

template <>
struct EnumStrings<HandleClutch> {
  static constexpr std::pair<HandleClutch, const char*> kValues[] = {
      {HandleClutch::kNone, "none"},
      {HandleClutch::kButton, "button"},
      {HandleClutch::kGripper, "gripper"}};
};

/** Parameters of OmegaDevice. */
struct OmegaDeviceParams {
  HapticDeviceThreadParams thread;
  std::string library;
  int index{0};
  int serial{0};
  bool homing{false};
  HandleClutch clutch{HandleClutch::kButton};
  int button{0};
  double gripper_angle{0.1};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("thread", &thread, "that serves the device"));
    a->Visit(Field("library", &library,
                   "the SDK's folder or its file libdrd.so.*; empty: the "
                   "environment variable FDSDK, else the usual folders"));
    a->Visit(Field("index", &index, Between(0, 127), "",
                   "which of the devices, where there is no serial"));
    a->Visit(Field("serial", &serial, Between(0, 65535), "",
                   "serial number of the device; 0 is any"));
    a->Visit(Field("homing", &homing,
                   "whether a device that was not homed since it was switched "
                   "on may move by itself to find its home"));
    VisitEnum(a, "OmegaDeviceParams", "clutch", &clutch,
              "what is the clutch: a button, which on a device with a gripper "
              "is the gripper closed, or the gripper below an angle");
    a->Visit(Field("button", &button, Between(0, 31), "",
                   "which button, where that is the clutch"));
    a->Visit(Field("gripper_angle", &gripper_angle, Between(0.01, 0.5), "rad",
                   "below which the gripper is the clutch, if it is"));
  }
};

/** An Omega.7, or another device of Force Dimension's: 3 directions are
actuated and, on larger ones, rotations; there may be a wrist and a gripper. It
takes the SDK, which is loaded at run time (LoadForceDimensionSdk()).

Open() enables forces, with the device's gravity compensation on, and asks the
device to end them by itself when no command reaches it for 1.5 times the
watchdog; within 0.1 s of commands they are on again. A device that was not
homed is refused unless homing is allowed: the handle then moves by itself, for
some seconds.

D is the SDK's frame: x to the operator, y to their right, z up; its origin is
the device's own. A device without a wrist does not rotate. On a left-handed one
the SDK's gripper angle and force have the other sign, which is undone here. */
class OmegaDevice final : public HapticDeviceThread {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit OmegaDevice(const OmegaDeviceParams& params);
};

}  // namespace dual_proxy
