// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/drivers/haptic_device_thread.h"

namespace dual_proxy {

/** Parameters of Chai3dDevice. */
struct Chai3dDeviceParams {
  HapticDeviceThreadParams thread;
  int index{0};
  bool homing{false};
  bool clutch{true};
  int button{0};
  double gripper_length{0.05};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("thread", &thread, "that serves the device"));
    a->Visit(Field("index", &index, Between(0, 15), "",
                   "which of the devices that CHAI3D finds"));
    a->Visit(Field("homing", &homing,
                   "whether CHAI3D may calibrate the device, which moves one "
                   "that was not homed; without it that is not found out"));
    a->Visit(Field("clutch", &clutch, "whether a button is the clutch"));
    a->Visit(Field("button", &button, Between(0, 31), "", "which one"));
    a->Visit(Field("gripper_length", &gripper_length, Above(0), "m",
                   "opening per rad of the gripper's angle; an Omega.7 opens "
                   "by 27 mm over 30 deg"));
  }
};

/** Any haptic device that CHAI3D knows. Only where CMake finds CHAI3D: target
dual_proxy_chai3d.

D is CHAI3D's frame: x to the operator, y to their right, z up. A device without
a wrist does not rotate. Limits beyond what CHAI3D says of the device are
refused when it is opened. */
class Chai3dDevice final : public HapticDeviceThread {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit Chai3dDevice(const Chai3dDeviceParams& params);
};

}  // namespace dual_proxy
