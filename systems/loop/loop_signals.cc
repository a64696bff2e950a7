// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/loop/loop_signals.h"

namespace dual_proxy {

void VisitHand(const Eigen::Vector3d& position, SignalSink* sink) {
  sink->Vector({"hand_position", "m", "D", "where the hand means to be"},
               position);
}

void VisitDevice(const SimulatedHapticDeviceState& device, SignalSink* sink) {
  sink->Count("device_bad_inputs",
              "steps with an input that the device refused", device.bad_inputs);
}

void VisitSensor(const ForceTorqueSensorState& sensor, SignalSink* sink) {
  sink->Count("sensor_bad_inputs", "samples that the sensor refused",
              sensor.adapter.bad_inputs);
  sink->Count("sensor_tares_refused",
              "times at rest that gave the sensor no bias",
              sensor.adapter.tares_refused);
}

void VisitChannel(Direction direction, const CommunicationChannelState& channel,
                  SignalSink* sink) {
  const bool to_robot = direction == Direction::kToRobot;
  sink->Count(to_robot ? "to_robot_lost" : "to_device_lost",
              "messages lost on the way", channel.lost);
  sink->Count(to_robot ? "to_robot_overflow" : "to_device_overflow",
              "messages pushed out of the full channel", channel.overflow);
  sink->Count(to_robot ? "to_robot_refused" : "to_device_refused",
              "messages refused because not finite", channel.refused);
}

void VisitContactTruth(const Eigen::Matrix<double, 14, 1>& truth,
                       bool rotations, SignalSink* sink) {
  sink->Vector({"contact_force", "N", "B",
                "true, robot on environment, from the simulator"},
               truth.head<3>());
  sink->Vector({"contact_normal", "", "B",
                "true, unit, into the surface; zero without contact"},
               truth.segment<3>(3));
  sink->Integer(
      {"contact_dimension", "", "", "true number of independent normals"},
      truth(6));
  sink->Vector({"contact_motion_axis", "", "B",
                "true, unit, of free motion; zero if there is not just one"},
               truth.segment<3>(7));
  if (!rotations) return;
  sink->Integer({"contact_moment_dimension", "", "",
                 "true number of rotations that are blocked"},
                truth(10));
  sink->Vector({"contact_rotation_axis", "", "B",
                "true, unit, of free rotation; zero if there is not just one"},
               truth.tail<3>());
}

}  // namespace dual_proxy
