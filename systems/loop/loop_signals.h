// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

#include <Eigen/Core>

#include "dual_proxy/common/signal_layout.h"
#include "dual_proxy/link/communication_channel.h"
#include "dual_proxy/simulation/force_torque_sensor.h"
#include "dual_proxy/simulation/haptic_device.h"

namespace dual_proxy {

/** @file
The signals of what is simulated around the two sides, which have those of their
own: described here for every host and every wiring. */

/** Where the operator means the handle to be, m, in D. */
void VisitHand(const Eigen::Vector3d& position, SignalSink* sink);

void VisitDevice(const SimulatedHapticDeviceState& device, SignalSink* sink);

void VisitSensor(const ForceTorqueSensorState& sensor, SignalSink* sink);

/** Which way a channel carries. */
enum class Direction { kToRobot, kToDevice };

void VisitChannel(Direction direction, const CommunicationChannelState& channel,
                  SignalSink* sink);

/** What a simulator knows of the tool's contacts.
@param truth  ContactTruth::ToVector().
@param rotations  whether which rotations they block is of interest: 11 numbers,
else 7. */
void VisitContactTruth(const Eigen::Matrix<double, 14, 1>& truth,
                       bool rotations, SignalSink* sink);

}  // namespace dual_proxy
