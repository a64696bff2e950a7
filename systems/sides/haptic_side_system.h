// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dual_proxy/common/face.h"
#include "dual_proxy/sides/haptic_side.h"
#include "dual_proxy/simulation/haptic_device.h"
#include "dual_proxy/simulation/operator.h"

namespace dual_proxy {

/** A simulated device, in a simulated hand, inside a HapticSideSystem. */
struct HapticSideDevice {
  SimulatedHapticDeviceParams params;
  /** Points in D: where the operator wants the handle. */
  OperatorPathParams path;
};

/** What a HapticSideSystem remembers. */
struct HapticSideMemory {
  HapticSideState side;
  SimulatedHapticDeviceState device;
  bool stepped{false};  ///< Whether there was a step.
};

/** The device's side as one system: the scheme's half and the device's
controller (HapticSide).

@system
name: HapticSideSystem
input_ports:
- robot_message
- device_pose (not with a simulated device)
- device_velocity (not with a simulated device)
output_ports:
- signals
- device_wrench
- message
- device_pose (only with a simulated device)
- device_bad_inputs (likewise)
@endsystem

Input ports, in the device's frame D:
- `robot_message`, abstract Message (optional: without it there is no force,
  but messages are sent).
- `device_pose`, abstract RigidTransformd: X_DH, from the device's home.
- `device_velocity`, 6: [linear; angular], m/s, rad/s.

Output ports:
- `signals`: all results, by side().layout().
- `device_wrench`, 6: [force; moment], N, N m, of the device on the hand.
- `message`, abstract Message, to the robot side.
- `device_pose`, abstract RigidTransformd: as the input of that name (only with
  a simulated device).
- `device_bad_inputs`, 1: steps with an intention or a wrench that the simulated
  device refused so far (likewise).

Steps every `params.controller.period`; the outputs are those of the last step,
zero before the first.

With a simulated device the system does the work of a
SimulatedHapticDeviceSystem, too, and gives the same bits as with that system in
front of it. */
class HapticSideSystem final : public Face<HapticSideMemory> {
 public:
  /** @param device the simulated device, if there is one.
  @throws std::invalid_argument if parameters are invalid, or the device's
  period is not the side's. */
  explicit HapticSideSystem(
      const HapticSideParams& params = {},
      const std::optional<HapticSideDevice>& device = std::nullopt);

  const HapticSide& side() const { return side_; }

  const InputPort& get_robot_message_input_port() const {
    return get_input_port(0);
  }
  /** @throws std::exception with a simulated device. */
  const InputPort& get_device_pose_input_port() const {
    return GetInputPort("device_pose");
  }
  /** @throws std::exception with a simulated device. */
  const InputPort& get_device_velocity_input_port() const {
    return GetInputPort("device_velocity");
  }
  const OutputPort& get_signals_output_port() const {
    return get_output_port(0);
  }
  const OutputPort& get_device_wrench_output_port() const {
    return get_output_port(1);
  }
  const OutputPort& get_message_output_port() const {
    return get_output_port(2);
  }
  /** @throws std::exception without a simulated device. */
  const OutputPort& get_device_pose_output_port() const {
    return GetOutputPort("device_pose");
  }
  /** @throws std::exception without a simulated device. */
  const OutputPort& get_device_bad_inputs_output_port() const {
    return GetOutputPort("device_bad_inputs");
  }

 private:
  void Step(const Context& context, HapticSideMemory* memory) const override;

  HapticSide side_;
  std::optional<SimulatedHapticDevice> device_;
  std::optional<OperatorPath> path_;
};

}  // namespace dual_proxy
