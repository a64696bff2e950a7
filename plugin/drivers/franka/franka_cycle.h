// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <string>

#include "dual_proxy/drivers/cycle_statistics.h"
#include "dual_proxy/drivers/driver.h"
#include "dual_proxy/drivers/franka/external_wrench.h"
#include "dual_proxy/drivers/franka/franka_robot_side_params.h"
#include "dual_proxy/drivers/franka/push_test.h"
#include "dual_proxy/drivers/latest_value.h"
#include "dual_proxy/drivers/robot_cycle.h"

namespace dual_proxy {

/** What the arm is at. */
enum class FrankaPhase {
  kWaiting = 0,   ///< Nothing moves: a person has not confirmed yet.
  kTaring = 1,    ///< It holds its place; the sensor's bias is being learned.
  kPushTest = 2,  ///< It holds its place and waits for a push of the tool.
  kRunning = 3,   ///< It follows.
  kHolding = 4,   ///< It holds its place; the HoldReason says why.
  kReflex = 5,    ///< It has stopped by itself, and is being recovered.
  kStopping = 6,  ///< It brakes, and then ends.
  kStopped = 7,   ///< It is not, or no longer, controlled from here.
};

template <>
struct EnumStrings<FrankaPhase> {
  static constexpr std::pair<FrankaPhase, const char*> kValues[] = {
      {FrankaPhase::kWaiting, "waiting"},
      {FrankaPhase::kTaring, "taring"},
      {FrankaPhase::kPushTest, "push_test"},
      {FrankaPhase::kRunning, "running"},
      {FrankaPhase::kHolding, "holding"},
      {FrankaPhase::kReflex, "reflex"},
      {FrankaPhase::kStopping, "stopping"},
      {FrankaPhase::kStopped, "stopped"}};
};

/** What other threads may know. */
struct FrankaStatus {
  FrankaPhase phase{FrankaPhase::kStopped};
  HoldReason hold{HoldReason::kNoLink};
  /** s: of the last cycle. */
  double time{-std::numeric_limits<double>::infinity()};
  Vector7 q{Vector7::Zero()};       ///< rad.
  Vector7 v{Vector7::Zero()};       ///< rad/s.
  Vector7 torque{Vector7::Zero()};  ///< N m: commanded, without gravity.
  Pose X_BE;                        ///< Of the tool point.
  /** [force; moment about E], N, N m, in B: of the robot on its environment. */
  Vector6 sensed_wrench{Vector6::Zero()};
  double gripper_width{0};  ///< m: for the gripper's driver.
  double success_rate{0};   ///< Share of the last commands that the arm got.
  std::int64_t cycles{0};
  std::int64_t lost_cycles{0};  ///< Periods of the arm's without a cycle.
  /** Times that it began to hold, by the number of the HoldReason. */
  std::array<std::int64_t, std::size(EnumStrings<HoldReason>::kValues)> holds{};
  std::int64_t reflexes{0};
  std::int64_t recoveries{0};
  std::int64_t tares{0};
  std::int64_t tares_refused{0};
  /** Cycles, since the start or the last recovery, that the robot side refused,
  that limited a torque's rate, that limited a torque. */
  std::int64_t bad_inputs{0};
  std::int64_t rate_limited{0};
  std::int64_t torque_limited{0};
};

/** What the arm says in a period. */
struct FrankaReading {
  Vector7 q{Vector7::Zero()};                ///< rad.
  Vector7 v{Vector7::Zero()};                ///< rad/s.
  Vector7 received_torque{Vector7::Zero()};  ///< N m, without gravity.
  ExternalWrench external_wrench;
  double success_rate{0};
  int periods{1};  ///< Since the reading before; more than 1: some were lost.
};

/** What it is to do. */
struct FrankaCommand {
  Vector7 torque{Vector7::Zero()};  ///< N m, without gravity.
  bool finished{false};  ///< It is at rest, and no longer to be controlled.
};

/** What a robot side with a Panda or FR3 does in a period, whoever talks to the
arm: RobotCycle between two mailboxes, a sensor, and the course of a run - tare,
push test, follow, stop.

SetMessage(), GetMessage() and GetStatus() are for one other thread, the link's;
Hold() and Stop() for any. */
class FrankaCycle {
 public:
  /** @param sensor  at the wrist; none: the arm's own estimate. It has to
      outlive this.
  @param clock  s, as MonotonicTime().
  @throws std::invalid_argument if params are not valid, or do not go with
  Franka's arms: period 1 ms, no gravity compensation, a load no heavier than
  the model's last link. The sensor's bias is learned, whatever
  cycle.sensor.tare says; with the arm's estimate cycle.sensor's tool has no
  mass, as ExternalWrenchSensor explains. */
  FrankaCycle(const FrankaRobotSideParams& params, RobotCycleParams cycle,
              ForceTorqueSensorDriver* sensor, std::function<double()> clock);

  FrankaCycle(const FrankaCycle&) = delete;
  FrankaCycle& operator=(const FrankaCycle&) = delete;

  const FrankaRobotSideParams& params() const { return params_; }
  const RobotCycle& cycle() const { return cycle_; }

  /** The newest from the haptic side, its send_time by this machine's clock. */
  void SetMessage(const Message& message) noexcept { messages_.Set(message); }
  /** The newest for the haptic side; sequence -1: there is none yet. */
  const Message& GetMessage() noexcept { return replies_.Get(); }
  const FrankaStatus& GetStatus() noexcept { return statuses_.Get(); }

  /** Asks the robot to hold its place, or no longer. */
  void Hold(bool hold) noexcept { hold_ = hold; }
  /** Asks the robot to brake and to end the run, for good. */
  void Stop() noexcept { stop_ = true; }

  /** How long Update() takes. For any thread. */
  const CycleStatistics& statistics() const noexcept { return statistics_; }

  /** What ended the run, in one line; empty: nothing, or Stop(). */
  std::string fault() const;
  /** What the arm said when it stopped by itself last; empty: it has not. */
  std::string reflex() const;

 protected:
  ~FrankaCycle() = default;

  double now() const { return clock_(); }
  bool stop() const noexcept { return stop_; }
  ForceTorqueSensorDriver& sensor() noexcept { return *sensor_; }

  // For the thread that talks to the arm.

  /** As before the first cycle, but that the sensor's bias stays known: where
  the arm is now, it holds, until it follows anew. Allocates. */
  void Restart();

  /** A period. Neither allocates nor throws. */
  FrankaCommand Update(const FrankaReading& reading) noexcept;

  /** Why Update() has ended a run that nobody asked it to, in one line; empty:
  it has not. */
  std::string refusal() const;

  void SetPhase(FrankaPhase phase) noexcept;
  void NoteReflex(const std::string& reflex);
  void NoteRecovery() noexcept;
  void SetFault(const std::string& fault);

 private:
  enum class Refusal { kNone, kTare, kPushFailed, kPushTimeout };

  void TakePush(double time) noexcept;
  bool IsAtRest(const Vector7& v) noexcept;
  void Publish(double time, const FrankaReading& reading) noexcept;

  FrankaRobotSideParams params_;
  RobotCycle cycle_;
  ExternalWrenchSensor estimate_;
  ForceTorqueSensorDriver* sensor_;
  std::function<double()> clock_;

  LatestValue<Message> messages_;
  LatestValue<Message> replies_;
  LatestValue<FrankaStatus> statuses_;
  CycleStatistics statistics_;
  std::atomic<bool> hold_{false};
  std::atomic<bool> stop_{false};
  mutable std::mutex text_mutex_;  // Of these, which no cycle touches.
  std::string fault_;
  std::string reflex_;

  RobotCycleState state_;
  RobotCycleInput input_;
  FrankaStatus status_;
  PushTest push_test_;
  bool push_passed_;
  std::optional<double> push_start_;  // s: when it was asked for.
  Refusal refusal_{Refusal::kNone};
  int rest_cycles_{0};
};

}  // namespace dual_proxy
