// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/loop_stability.h"

#include <algorithm>
#include <cmath>

#include "dual_proxy/common/low_pass.h"

namespace dual_proxy {

namespace {

constexpr double kForce = 5;      // N
constexpr double kDuration = 2;   // s
constexpr double kSettled = 1;    // s
constexpr double kNearby = 0.05;  // Share of kForce.
constexpr double kTooDeep = 0.1;  // Likewise, at the start.
constexpr double kWanted = 20;    // N, in the air.
constexpr double kOverSpeed = 1.1;
constexpr double kRunaway = 1e3;  // N: no handle that settles gets there.

struct Plant {
  double position{0};
  double velocity{0};
  double force{0};
};

// Runs `control(plant)`, which returns a command, every `period` and
// `step(command, &plant)`, followed by `watch(time, plant)`, every `time_step`.
template <typename Control, typename Step, typename Watch>
void RunLoop(double period, double time_step, double command, Plant plant,
             const Control& control, const Step& step, const Watch& watch) {
  constexpr double kSameInstant = 1e-9;
  for (int controlled = 0, stepped = 0;;) {
    const double next_control = controlled * period;
    const double next_step = stepped * time_step;
    const double time = std::min(next_control, next_step);
    if (time > kDuration) return;
    const Plant before = plant;
    const bool steps = next_step <= time + kSameInstant;
    if (steps) {
      step(command, &plant);
      ++stepped;
    }
    if (next_control <= time + kSameInstant) {
      command = control(before);
      ++controlled;
    }
    if (steps) watch(time, plant);
  }
}

}  // namespace

bool ForceLoopSettles(const ForceLoopParams& params,
                      const ContactModel& contact, double time_step) {
  using Eigen::Vector3d;
  const ForceLoop loop(params);
  ForceLoopState state = loop.MakeState();
  const Vector3d normal = Vector3d::UnitZ();
  const Eigen::Matrix3d selection = normal * normal.transpose();
  double sensed = kForce;
  const auto control = [&](const Plant& plant) {
    const Vector3d command =
        loop.Update(kForce * normal, sensed * normal, plant.velocity * normal,
                    selection, selection, &state);
    sensed = plant.force;
    return command.z();
  };
  const auto step = [&](double command, Plant* plant) {
    const double k = contact.stiffness;
    const double c = contact.damping;
    const double h = time_step;
    const double m = contact.mass;
    const double x = plant->position;
    double v =
        (m * plant->velocity + h * (command - k * x)) / (m + h * c + h * h * k);
    double force = k * (x + h * v) + c * v;
    if (force < 0) {  // It has left the surface.
      v = plant->velocity + h * command / m;
      force = 0;
    }
    *plant = {.position = x + h * v, .velocity = v, .force = force};
  };
  bool settled = true;
  const auto watch = [&](double time, const Plant& plant) {
    if (time >= kSettled &&
        !(std::abs(plant.force - kForce) <= kNearby * kForce)) {
      settled = false;
    }
  };
  const double depth = (1 + kTooDeep) * kForce / contact.stiffness;
  RunLoop(params.period, time_step, kForce, {.position = depth}, control, step,
          watch);
  return settled;
}

bool ForceLoopKeepsItsSpeedLimit(const ForceLoopParams& params, double mass,
                                 double time_step) {
  using Eigen::Vector3d;
  const ForceLoop loop(params);
  ForceLoopState state = loop.MakeState();
  const Vector3d normal = Vector3d::UnitZ();
  const Eigen::Matrix3d selection = normal * normal.transpose();
  const auto control = [&](const Plant& plant) {
    return loop
        .Update(kWanted * normal, Vector3d::Zero(), plant.velocity * normal,
                selection, selection, &state)
        .z();
  };
  const auto step = [&](double command, Plant* plant) {
    plant->velocity += time_step * command / mass;
  };
  bool kept = true;
  const auto watch = [&](double, const Plant& plant) {
    if (!(std::abs(plant.velocity) <= kOverSpeed * params.speed_limit)) {
      kept = false;
    }
  };
  RunLoop(params.period, time_step, 0, {}, control, step, watch);
  return kept;
}

bool MotionLoopSettles(double stiffness, double damping, double period,
                       double time_step) {
  const auto control = [&](const Plant& plant) {
    return -stiffness * plant.position - damping * plant.velocity;
  };
  const auto step = [&](double command, Plant* plant) {
    plant->velocity += time_step * command;
    plant->position += time_step * plant->velocity;
  };
  double first = 0;
  double last = 0;
  const auto watch = [&](double time, const Plant& plant) {
    const double distance = std::abs(plant.position);
    if (time <= kDuration / 4) first = std::max(first, distance);
    // std::max() would drop what is not a number.
    if (time >= kDuration * 3 / 4 && !(distance <= last)) last = distance;
  };
  RunLoop(period, time_step, 0, {.position = 1, .velocity = -0.1}, control,
          step, watch);
  return last <= first;
}

bool HapticForceLoopSettles(HapticControllerParams params,
                            const HeldDeviceModel& device) {
  using Eigen::Vector3d;
  params.method = HapticControlMethod::kForceFeedback;
  // So that what grows is seen to.
  params.max_force = params.max_integral_force = 1e3 * kRunaway;
  const HapticController controller(params);
  const double h = params.period;
  const double mass = device.hand_mass + device.device_mass;
  const double damping = device.hand_damping + device.device_damping;
  const double velocity_gain = LowPassGain(device.velocity_cutoff, h);
  for (const bool in_contact : {false, true}) {
    HapticControllerState state = controller.MakeState();
    const Eigen::Matrix3d selection =
        in_contact ? Eigen::Matrix3d(Vector3d::UnitZ().asDiagonal())
                   : Eigen::Matrix3d::Zero();
    Plant handle{.position = 1e-3};  // Its force is that on the hand.
    double read_velocity = 0;
    double command = 0;
    double first = 0;
    double last = 0;
    const int count = static_cast<int>(kDuration / h);
    for (int i = 0; i < count; ++i) {
      HapticControllerInput input;
      input.device_velocity(2) = read_velocity;
      input.force_selection = selection;
      input.handle_force.z() = handle.force;
      const double next_command = controller.Update(input, &state)(2);

      const double k = device.hand_stiffness;
      const double v =
          (mass * handle.velocity + h * (command - k * handle.position)) /
          (mass + h * damping + h * h * k);
      handle.force = command - device.device_damping * v -
                     device.device_mass / h * (v - handle.velocity);
      handle.velocity = v;
      handle.position += h * v;
      read_velocity += velocity_gain * (v - read_velocity);
      command = next_command;

      const double size = std::abs(handle.force);
      if (!(size < kRunaway)) return false;
      if (i < count / 4) first = std::max(first, size);
      if (i >= count * 3 / 4) last = std::max(last, size);
    }
    if (!(last <= first)) return false;
  }
  return true;
}

}  // namespace dual_proxy
