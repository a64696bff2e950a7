// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <exception>
#include <functional>
#include <string>
#include <utility>

#include <Eigen/Core>

#include "dual_proxy/common/validate.h"
#include "dual_proxy/drivers/clock.h"
#include "dual_proxy/drivers/franka/franka_cycle.h"

namespace dual_proxy {

/** What of libfranka is used, under libfranka's names: FrankaRobotSide compiles
with libfranka (libfranka.h) and with stand-ins for it. */
template <typename Api>
concept FrankaApi =
    std::derived_from<typename Api::ControlException,
                      typename Api::Exception> &&
    std::derived_from<typename Api::NetworkException,
                      typename Api::Exception> &&
    std::derived_from<typename Api::CommandException,
                      typename Api::Exception> &&
    std::derived_from<typename Api::RealtimeException,
                      typename Api::Exception> &&
    std::derived_from<typename Api::InvalidOperationException,
                      typename Api::Exception> &&
    std::constructible_from<typename Api::Robot, const std::string&,
                            typename Api::RealtimeConfig> &&
    std::constructible_from<typename Api::Torques,
                            const std::array<double, 7>&> &&
    requires(
        typename Api::Robot& robot, const typename Api::RobotState& state,
        typename Api::Duration duration, typename Api::Torques torques,
        const std::array<double, 3>& three, const std::array<double, 6>& six,
        const std::array<double, 7>& seven, const std::array<double, 9>& nine) {
      robot.control(
          std::function<typename Api::Torques(const typename Api::RobotState&,
                                              typename Api::Duration)>(),
          false, double{Api::kMaxCutoffFrequency});
      { robot.readOnce() } -> std::same_as<typename Api::RobotState>;
      robot.setCollisionBehavior(seven, seven, six, six);
      robot.setLoad(double(), three, nine);
      robot.automaticErrorRecovery();
      { state.q } -> std::convertible_to<std::array<double, 7>>;
      { state.dq } -> std::convertible_to<std::array<double, 7>>;
      { state.tau_J_d } -> std::convertible_to<std::array<double, 7>>;
      { state.K_F_ext_hat_K } -> std::convertible_to<std::array<double, 6>>;
      { state.F_T_EE } -> std::convertible_to<std::array<double, 16>>;
      { state.EE_T_K } -> std::convertible_to<std::array<double, 16>>;
      { state.control_command_success_rate } -> std::convertible_to<double>;
      { state.robot_mode == Api::RobotMode::kIdle } -> std::same_as<bool>;
      { static_cast<bool>(state.current_errors) };
      { static_cast<std::string>(state.current_errors) };
      { duration.toMSec() } -> std::convertible_to<std::uint64_t>;
      { torques.motion_finished } -> std::convertible_to<bool>;
    };

/** Asks a person, and waits for the answer. */
using FrankaConfirm = std::function<bool(const std::string& question)>;

/** The robot side with a Panda or FR3: libfranka's control loop with all of the
side's work in its callback (FrankaCycle).

Run() does, in this order:

1. It connects, tells the arm its load and its collision thresholds, and
   refuses an arm that is not idle, that has errors, or of which a joint is not
   within side.controller.joint_limits with its margin.
2. It asks a person. Until then nothing is commanded.
3. The arm holds its place while the sensor's bias is learned, then until a
   person has pushed the tool (push_test); a force of the wrong sign ends the
   run.
4. It follows, or holds for what a HoldReason tells.

A reflex (ControlException) ends control by the arm's own means. It is taken
back (automaticErrorRecovery()), and the robot holds, then follows from where it
is: hand and robot are clutched anew, so that it does not travel. With a scheme
that cannot (side.proxy.reclutch), after max_recoveries in a row, and with every
other exception the run ends.

Stop() makes the arm hold; once it is at rest its own controller takes over, and
the run ends. Nothing is thrown within the callback. */
template <FrankaApi Api>
class FrankaRobotSide final : public FrankaCycle {
 public:
  /** See FrankaCycle. */
  FrankaRobotSide(const FrankaRobotSideParams& params, RobotCycleParams cycle,
                  ForceTorqueSensorDriver* sensor = nullptr,
                  std::function<double()> clock = MonotonicTime)
      : FrankaCycle(params, std::move(cycle), sensor, std::move(clock)) {}

  /** Runs the arm until Stop(), once. The calling thread gets real-time
  priority by libfranka.
  @throws DriverError if anything else ends it; fault() is the same then. */
  void Run(const FrankaConfirm& confirm) {
    try {
      const SensorCloser closer{&sensor()};
      Serve(confirm);
    } catch (const std::exception& e) {
      SetFault(Explain(e));
    }
    SetPhase(FrankaPhase::kStopped);
    if (!fault().empty()) throw DriverError(fault());
  }

 private:
  using Robot = typename Api::Robot;
  using State = typename Api::RobotState;
  using Torques = typename Api::Torques;

  struct SensorCloser {
    ForceTorqueSensorDriver* sensor;
    ~SensorCloser() { sensor->Close(); }
  };

  /** s: within which an arm that was recovered is to say so. */
  static constexpr double kReadyTime = 1;

  void Serve(const FrankaConfirm& confirm) {
    SetPhase(FrankaPhase::kWaiting);
    Robot robot(params().host, params().real_time
                                   ? Api::RealtimeConfig::kEnforce
                                   : Api::RealtimeConfig::kIgnore);
    Configure(&robot);
    ThrowUnlessReady(robot.readOnce());
    sensor().Open();
    if (!confirm(Question())) {
      throw DriverError("nobody confirmed, and nothing has moved");
    }
    // A person may have taken their time, and the arm somewhere else.
    ThrowUnlessReady(robot.readOnce());

    int in_row = 0;
    double last_reflex = now();
    while (true) {
      try {
        robot.control(
            [this](const State& state,
                   typename Api::Duration elapsed) noexcept {
              return OnState(state, elapsed);
            },
            false, Api::kMaxCutoffFrequency);
        break;
      } catch (const typename Api::ControlException& e) {
        NoteReflex(e.what());
        if (now() - last_reflex > params().recovery_time) in_row = 0;
        last_reflex = now();
        const bool reclutches = cycle().params().side.proxy.reclutch;
        if (stop() || !reclutches || in_row >= params().max_recoveries) throw;
        ++in_row;
      }
      Recover(&robot);
    }
    if (!refusal().empty()) throw DriverError(refusal());
  }

  void Configure(Robot* robot) const {
    const FrankaCollisionParams& collision = params().collision;
    robot->setCollisionBehavior(
        ToArray(collision.contact_torque), ToArray(collision.collision_torque),
        ToArray(collision.contact_force), ToArray(collision.collision_force));
    const FrankaLoadParams& load = params().load;
    robot->setLoad(load.mass, ToArray(load.com), ToArray(load.inertia));
  }

  void Recover(Robot* robot) {
    robot->automaticErrorRecovery();
    const double start = now();
    State state = robot->readOnce();
    while (!IsIdle(state) && now() - start < kReadyTime) {
      state = robot->readOnce();
    }
    ThrowUnlessReady(state);
    Restart();
    NoteRecovery();
  }

  Torques OnState(const State& state, typename Api::Duration elapsed) noexcept {
    const FrankaCommand command =
        Update({.q = Vector7::Map(state.q.data()),
                .v = Vector7::Map(state.dq.data()),
                .received_torque = Vector7::Map(state.tau_J_d.data()),
                .external_wrench = {.K_F_ext_hat_K = state.K_F_ext_hat_K,
                                    .F_T_EE = state.F_T_EE,
                                    .EE_T_K = state.EE_T_K},
                .success_rate = state.control_command_success_rate,
                .periods = static_cast<int>(elapsed.toMSec())});
    Torques torques(ToArray(command.torque));
    torques.motion_finished = command.finished;
    return torques;
  }

  static bool IsIdle(const State& state) {
    return state.robot_mode == Api::RobotMode::kIdle &&
           !static_cast<bool>(state.current_errors);
  }

  void ThrowUnlessReady(const State& state) const {
    using Mode = typename Api::RobotMode;
    if (static_cast<bool>(state.current_errors)) {
      throw DriverError("the arm has errors: " +
                        static_cast<std::string>(state.current_errors) +
                        "; clear them in Desk");
    }
    if (state.robot_mode != Mode::kIdle) {
      throw DriverError(
          state.robot_mode == Mode::kUserStopped
              ? "the arm's user stop is pressed, or its brakes are closed"
          : state.robot_mode == Mode::kGuiding
              ? "the arm is being guided by hand: let go of its buttons"
              : "the arm is not idle: is another program in control of it, or "
                "FCI not active in Desk?");
    }
    const JointLimitsParams<7>& limits =
        cycle().params().side.controller.joint_limits;
    for (int i = 0; i < 7; ++i) {
      const double lower = limits.lower(i) + limits.position_margin;
      const double upper = limits.upper(i) - limits.position_margin;
      if (state.q[i] >= lower && state.q[i] <= upper) continue;
      throw DriverError("joint " + std::to_string(i + 1) + " is at " +
                        NumberText(state.q[i]) + " rad, not in [" +
                        NumberText(lower) + ", " + NumberText(upper) +
                        "]: guide the arm by hand");
    }
  }

  std::string Question() const {
    std::string result =
        "The arm at " + params().host +
        " will be controlled from here. Nothing may touch its tool for a "
        "moment; it holds its place";
    if (params().push_test) {
      result += ". Then push the tool by hand once, with more than " +
                NumberText(params().push_force) + " N";
    }
    return result +
           ". After that it follows the haptic device. Keep a hand on the "
           "user stop. Go on?";
  }

  std::string Explain(const std::exception& e) const {
    const std::string what = e.what();
    if (dynamic_cast<const typename Api::NetworkException*>(&e)) {
      return "no connection to the arm at " + params().host + ": " + what +
             " (cable, address, FCI active in Desk, no other program "
             "connected?)";
    }
    if (dynamic_cast<const typename Api::RealtimeException*>(&e)) {
      return "no real-time priority: " + what +
             " (PREEMPT_RT kernel, rtprio in limits.conf?)";
    }
    if (dynamic_cast<const typename Api::ControlException*>(&e)) {
      return "the arm has stopped: " + what;
    }
    if (dynamic_cast<const typename Api::Exception*>(&e)) {
      return "the arm refused: " + what;
    }
    return what;
  }

  template <typename Derived>
  static auto ToArray(const Eigen::PlainObjectBase<Derived>& values) noexcept {
    std::array<double, Derived::SizeAtCompileTime> result;
    Derived::Map(result.data()) = values;
    return result;
  }
};

}  // namespace dual_proxy
