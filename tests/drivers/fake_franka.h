// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "dual_proxy/drivers/driver.h"
#include "dual_proxy/robots/panda/panda.h"
#include "dual_proxy/simulation/simulated_arm.h"
#include "no_alloc.h"
#include "test_arm.h"

namespace dual_proxy {

/** A Panda with its controller, in simulated time: what is behind FakeFranka's
Robot. As the real one it adds gravity compensation to the torque, which acts
some periods late, refuses torques that jump, and stops when none come. */
class FakeArm {
 public:
  static constexpr double kPeriod = 0.001;
  static constexpr double kToolMass = 0.5;
  static constexpr double kTableHeight = 0.15;  // E starts at 0.18.

  /** Periods without a command that the arm endures. */
  static constexpr int kMaxLost = 20;
  static constexpr int kRecoveryPeriods = 70;

  enum class Mode { kIdle, kMove, kGuiding, kReflex, kUserStopped };

  explicit FakeArm(double stiffness = 3e4)
      : arm_(MakeParams(), MakeTestArm(), MakeScene(stiffness)),
        state_(arm_.MakeState(kTestArmAtRest)) {
    Hold();
  }

  /** s: it goes on a little whenever it is read. */
  double ReadClock() {
    clock_reads_ = std::min(clock_reads_ + 1, 50);
    return time() + 1e-6 * clock_reads_;
  }
  double time() const { return 100 + kPeriod * static_cast<double>(periods_); }

  const SimulatedArmState<7>& state() const { return state_; }
  const Vector7& commanded() const { return commanded_; }

  /** A command for the next `periods` periods: more than one are a stall.
  @returns whether control goes on. */
  bool Command(const Vector7& torque, int periods) {
    constexpr double kMaxRate = 1000;  // N m/s.
    const Vector7 step = (torque - commanded_).cwiseAbs();
    if (step.maxCoeff() > kMaxRate * kPeriod * (1 + 1e-9)) {
      Fail("controller_torque_discontinuity");
      return false;
    }
    commanded_ = torque;
    for (int i = 0; i < periods; ++i) {
      if (i > kMaxLost) Fail("communication_constraints_violation");
      late_.push_back(commanded_);
      if (mode == Mode::kMove) {
        Step(late_.front());
        late_.pop_front();
      } else {
        StepHolding();
      }
    }
    return mode == Mode::kMove;
  }

  void StartControl() {
    mode = Mode::kMove;
    commanded_.setZero();
    late_.assign(static_cast<std::size_t>(delay), Vector7::Zero());
  }

  void EndControl() {
    mode = Mode::kIdle;
    Hold();
  }

  void Fail(const std::string& error) {
    if (mode != Mode::kMove) return;
    mode = Mode::kReflex;
    errors = error;
    Hold();
  }

  /** A period in which the arm's own controller holds it. */
  void StepHolding() {
    constexpr double kRate = 100;  // rad/s
    Step(state_.terms.mass *
         (kRate * kRate * (held_ - state_.q) - 2 * kRate * state_.v));
  }

  // What a test may change.
  Mode mode{Mode::kIdle};
  std::string errors;
  int delay{2};
  /** Called before each callback, with the number of the cycle. */
  std::function<void(std::int64_t)> on_cycle = [](std::int64_t) {};
  int stall{0};                ///< Periods that are lost after this cycle.
  bool is_unreachable{false};  ///< It was switched off.
  bool says_no_number{false};  ///< Of its joints.
  bool recovers{true};
  /** N, in B: of a hand on the tool point. */
  Eigen::Vector3d push{Eigen::Vector3d::Zero()};

  // What it was told.
  bool enforced{false};
  double cutoff_frequency{0};
  bool limit_rate{true};
  double load_mass{-1};
  std::array<double, 7> collision_torque{};
  std::int64_t controls{0};
  std::int64_t callbacks{0};
  std::int64_t allocations{0};  ///< In callbacks.

 private:
  static SimulatedArmParams MakeParams() {
    SimulatedArmParams params;
    params.p_SE = MakeTestArm().p_LE - kPandaFlange;
    params.tool_mass = kToolMass;
    params.tool_com = Eigen::Vector3d(0.002, 0, 0.04);
    params.joint_friction = 0.05;
    return params;
  }

  static ContactSceneParams MakeScene(double stiffness) {
    ContactSurfaceParams table;
    table.position = Eigen::Vector3d(0.45, 0, kTableHeight);
    table.stiffness = stiffness;
    table.dissipation = 2;
    table.friction = 0.2;
    return {.surfaces = {table}, .tool_radius = 0.01};
  }

  void Hold() { held_ = state_.q; }

  void Step(const Vector7& torque) {
    ++periods_;
    clock_reads_ = 0;
    const Vector7 hand = state_.terms.J_BE.topRows<3>().transpose() * push;
    arm_.Update(torque - state_.terms.gravity + hand, &state_);
    // What a hand does to the tool passes through the sensor, too.
    const Eigen::Vector3d push_E = state_.X_BE.R.transpose() * push;
    state_.reaction.head<3>() -= push_E;
    state_.reaction.tail<3>() -= arm_.params().p_SE.cross(push_E);
  }

  SimulatedArm<7> arm_;
  SimulatedArmState<7> state_;
  Vector7 held_;
  Vector7 commanded_{Vector7::Zero()};
  std::deque<Vector7> late_;
  std::int64_t periods_{0};
  int clock_reads_{0};
};

/** What FrankaRobotSide takes of libfranka, over a FakeArm. */
struct FakeFranka {
  static constexpr double kMaxCutoffFrequency = 1000;

  struct Exception : std::runtime_error {
    using std::runtime_error::runtime_error;
  };
  struct ControlException : Exception {
    using Exception::Exception;
  };
  struct NetworkException : Exception {
    using Exception::Exception;
  };
  struct CommandException : Exception {
    using Exception::Exception;
  };
  struct RealtimeException : Exception {
    using Exception::Exception;
  };
  struct InvalidOperationException : Exception {
    using Exception::Exception;
  };

  enum class RealtimeConfig { kEnforce, kIgnore };
  using RobotMode = FakeArm::Mode;

  struct Errors {
    std::string name;
    explicit operator bool() const { return !name.empty(); }
    explicit operator std::string() const { return "[" + name + "]"; }
  };

  struct Duration {
    std::uint64_t milliseconds;
    std::uint64_t toMSec() const { return milliseconds; }
  };

  struct RobotState {
    std::array<double, 7> q{};
    std::array<double, 7> dq{};
    std::array<double, 7> tau_J_d{};
    std::array<double, 6> K_F_ext_hat_K{};
    std::array<double, 16> F_T_EE{};
    std::array<double, 16> EE_T_K{};
    double control_command_success_rate{1};
    RobotMode robot_mode{RobotMode::kIdle};
    Errors current_errors;
  };

  struct Torques {
    Torques(const std::array<double, 7>& torques) : tau_J(torques) {}
    std::array<double, 7> tau_J;
    bool motion_finished{false};
  };

  /** The arm that the next Robot is. */
  static inline FakeArm* arm = nullptr;

  class Robot {
   public:
    Robot(const std::string&, RealtimeConfig realtime) : arm_(*arm) {
      arm_.enforced = realtime == RealtimeConfig::kEnforce;
      if (arm_.is_unreachable) throw NetworkException("no route to host");
    }

    void setCollisionBehavior(const std::array<double, 7>&,
                              const std::array<double, 7>& upper_torque,
                              const std::array<double, 6>&,
                              const std::array<double, 6>&) {
      arm_.collision_torque = upper_torque;
    }

    void setLoad(double mass, const std::array<double, 3>&,
                 const std::array<double, 9>&) {
      arm_.load_mass = mass;
    }

    RobotState readOnce() {
      if (arm_.is_unreachable) throw NetworkException("timeout");
      arm_.StepHolding();
      return MakeState();
    }

    void automaticErrorRecovery() {
      for (int i = 0; i < FakeArm::kRecoveryPeriods; ++i) arm_.StepHolding();
      if (!arm_.recovers) throw CommandException("user stop pressed");
      arm_.mode = FakeArm::Mode::kIdle;
      arm_.errors.clear();
    }

    void control(std::function<Torques(const RobotState&, Duration)> callback,
                 bool limit_rate, double cutoff_frequency) {
      arm_.limit_rate = limit_rate;
      arm_.cutoff_frequency = cutoff_frequency;
      ++arm_.controls;
      arm_.StartControl();
      Duration elapsed{0};
      while (true) {
        arm_.on_cycle(arm_.callbacks);
        if (arm_.is_unreachable) throw NetworkException("timeout");
        const RobotState state = MakeState();
        const ScopedNoAlloc guard;
        const Torques torques = callback(state, elapsed);
        arm_.allocations += guard.count();
        ++arm_.callbacks;
        const Vector7 torque = Vector7::Map(torques.tau_J.data());
        if (!torque.allFinite()) {
          arm_.EndControl();
          throw std::invalid_argument("torque is not finite");
        }
        if (torques.motion_finished) {
          arm_.EndControl();
          return;
        }
        elapsed.milliseconds = static_cast<std::uint64_t>(1 + arm_.stall);
        if (!arm_.Command(torque, 1 + std::exchange(arm_.stall, 0))) {
          throw ControlException("motion aborted by reflex! [" + arm_.errors +
                                 "]");
        }
      }
    }

   private:
    RobotState MakeState() const {
      const SimulatedArmState<7>& truth = arm_.state();
      RobotState state;
      Vector7::Map(state.q.data()) = truth.q;
      Vector7::Map(state.dq.data()) = truth.v;
      Vector7::Map(state.tau_J_d.data()) = arm_.commanded();
      if (arm_.says_no_number) {
        state.q[3] = std::numeric_limits<double>::quiet_NaN();
      }
      state.robot_mode = arm_.mode;
      state.current_errors.name = arm_.errors;
      // K lies 3 cm beyond the flange, turned by EE's own rotation and its own.
      Eigen::Isometry3d F_T_EE = Eigen::Isometry3d::Identity();
      F_T_EE.rotate(Eigen::AngleAxisd(-0.785, Eigen::Vector3d::UnitZ()));
      Eigen::Isometry3d EE_T_K = Eigen::Isometry3d::Identity();
      EE_T_K.translate(Eigen::Vector3d(0.01, 0, 0.03));
      EE_T_K.rotate(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
      Eigen::Matrix4d::Map(state.F_T_EE.data()) = F_T_EE.matrix();
      Eigen::Matrix4d::Map(state.EE_T_K.data()) = EE_T_K.matrix();
      SetWrench(F_T_EE * EE_T_K, &state);
      return state;
    }

    // Of the robot on what it touches, without any weight.
    void SetWrench(const Eigen::Isometry3d& F_T_K, RobotState* state) const {
      const SimulatedArmState<7>& truth = arm_.state();
      Eigen::Isometry3d X_BF = Eigen::Isometry3d::Identity();
      X_BF.linear() = truth.X_BE.R;  // E's axes are F's.
      X_BF.translation() = truth.X_BE.p - truth.X_BE.R * MakeTestArm().p_LE +
                           truth.X_BE.R * kPandaFlange;
      const Eigen::Isometry3d X_BK = X_BF * F_T_K;
      const Eigen::Vector3d contact = truth.truth.force();
      const Eigen::Vector3d hand = -arm_.push;
      const Eigen::Vector3d p_contact =
          truth.X_BE.p - Eigen::Vector3d(0, 0, 0.01);
      const Eigen::Vector3d moment =
          (p_contact - X_BK.translation()).cross(contact) +
          (truth.X_BE.p - X_BK.translation()).cross(hand);
      auto wrench = Vector6::Map(state->K_F_ext_hat_K.data());
      wrench.head<3>() = X_BK.linear().transpose() * (contact + hand);
      wrench.tail<3>() = X_BK.linear().transpose() * moment;
      // It is never exactly zero, but near a singularity.
      wrench(2) += 1e-9;
    }

    FakeArm& arm_;
  };
};

/** The wrist sensor of a FakeArm: arm on tool, with a bias. */
class FakeSensor final : public ForceTorqueSensorDriver {
 public:
  explicit FakeSensor(FakeArm* arm) : arm_(arm) {}

  void Open() override { is_open = true; }
  void Close() noexcept override { is_open = false; }
  std::string fault() const override { return {}; }

  Reading<Vector6> Read() noexcept override {
    if (!is_silent) {
      reading_.time = arm_->time();
      reading_.valid = true;
      reading_.value = sign * arm_->state().reaction;
      reading_.value(0) += 1.5;
    }
    return reading_;
  }

  bool is_open{false};
  bool is_silent{false};
  double sign{1};

 private:
  FakeArm* arm_;
  Reading<Vector6> reading_;
};

}  // namespace dual_proxy
