// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/franka/franka_cycle.h"

#include <utility>

#include "dual_proxy/common/validate.h"

namespace dual_proxy {
namespace {

constexpr double kPeriod = 0.001;    // s: of Franka's control interface.
constexpr double kRestSpeed = 0.01;  // rad/s
constexpr int kRestCycles = 50;
constexpr int kMaxTaresRefused = 5;

RobotCycleParams Adapt(RobotCycleParams cycle, bool has_sensor) {
  cycle.sensor.tare = true;
  if (!has_sensor) cycle.sensor.tool_mass = 0;
  return cycle;
}

}  // namespace

FrankaCycle::FrankaCycle(const FrankaRobotSideParams& params,
                         RobotCycleParams cycle,
                         ForceTorqueSensorDriver* sensor,
                         std::function<double()> clock)
    : params_((params.Validate(), params)),
      cycle_(Adapt(std::move(cycle), sensor != nullptr)),
      estimate_(cycle_.params().model, cycle_.params().p_SE),
      sensor_(sensor ? sensor : &estimate_),
      clock_(std::move(clock)),
      state_(cycle_.MakeState()),
      push_test_(params_.push_force, kPeriod),
      push_passed_(!params_.push_test) {
  constexpr const char* kWho = "FrankaRobotSide";
  const OperationalSpaceControllerParams<7>& controller =
      cycle_.params().side.controller;
  if (controller.period != kPeriod) {
    ThrowInvalidField(kWho, "side.controller.period", "0.001 s",
                      controller.period);
  }
  if (controller.gravity_compensation) {
    ThrowInvalidField(kWho, "side.controller.gravity_compensation",
                      "false: the arm holds its weight itself", true);
  }
  ThrowUnlessIn(kWho, "load.mass", params_.load.mass,
                Between(0, {cycle_.params().model.mass(6),
                            "the mass of the model's last link"}));
}

std::string FrankaCycle::fault() const {
  const std::lock_guard lock(text_mutex_);
  return fault_;
}

std::string FrankaCycle::reflex() const {
  const std::lock_guard lock(text_mutex_);
  return reflex_;
}

void FrankaCycle::SetFault(const std::string& fault) {
  const std::lock_guard lock(text_mutex_);
  fault_ = fault;
}

void FrankaCycle::Restart() {
  cycle_.Restart(&state_);
  push_test_ = PushTest(params_.push_force, kPeriod);
  push_start_.reset();
  rest_cycles_ = 0;
}

std::string FrankaCycle::refusal() const {
  switch (refusal_) {
    case Refusal::kNone:
      return {};
    case Refusal::kTare:
      return "no bias of the force sensor could be learned: the tool touches "
             "something, its mass is not what is given, or there is more noise "
             "than sensor.tare_max_noise";
    case Refusal::kPushFailed:
      return "push test: the sensed force does not oppose the push (cosine " +
             NumberText(push_test_.cosine()) +
             ", expected at least 0.5): check the sensor's sign and how it is "
             "mounted (reports, R_SN)";
    default:
      return "push test: no push of " + NumberText(params_.push_force) +
             " N was sensed within " + NumberText(params_.push_time) + " s";
  }
}

void FrankaCycle::SetPhase(FrankaPhase phase) noexcept {
  status_.phase = phase;
  statuses_.Set(status_);
}

void FrankaCycle::NoteReflex(const std::string& reflex) {
  {
    const std::lock_guard lock(text_mutex_);
    reflex_ = reflex;
  }
  ++status_.reflexes;
  SetPhase(FrankaPhase::kReflex);
}

void FrankaCycle::NoteRecovery() noexcept {
  ++status_.recoveries;
  SetPhase(FrankaPhase::kHolding);
}

FrankaCommand FrankaCycle::Update(const FrankaReading& reading) noexcept {
  const double start = clock_();
  const bool stopping = stop_ || refusal_ != Refusal::kNone;
  const bool tared = state_.sensor.tares > 0;
  if (sensor_ == &estimate_) estimate_.Take(start, reading.external_wrench);

  input_.q = reading.q;
  input_.v = reading.v;
  input_.received_torque = reading.received_torque;
  input_.message = messages_.Get();
  input_.sensor = sensor_->Read();
  input_.hold = hold_ || stopping || !push_passed_;
  input_.distrust_sensor = !push_passed_;
  cycle_.Update(start, input_, &state_);

  FrankaCommand command{.torque = state_.torque()};
  if (stopping) {
    status_.phase = FrankaPhase::kStopping;
    command.finished = IsAtRest(reading.v);
  } else if (!tared) {
    status_.phase = FrankaPhase::kTaring;
    if (state_.sensor.tares_refused >= kMaxTaresRefused) {
      refusal_ = Refusal::kTare;
    }
  } else if (!push_passed_) {
    status_.phase = FrankaPhase::kPushTest;
    TakePush(start);
  } else {
    status_.phase = state_.side.output.hold == HoldReason::kNone
                        ? FrankaPhase::kRunning
                        : FrankaPhase::kHolding;
  }
  Publish(start, reading);
  statistics_.Add(clock_() - start);
  return command;
}

void FrankaCycle::TakePush(double time) noexcept {
  if (!push_start_) push_start_ = time;
  const Vector6& wrench = state_.sensor.wrench;
  if (time - state_.sensor_time > cycle_.params().side.max_sensor_age) return;
  switch (push_test_.Update(state_.X_BE.p, wrench.head<3>())) {
    case PushResult::kPassed:
      push_passed_ = true;
      break;
    case PushResult::kFailed:
      refusal_ = Refusal::kPushFailed;
      break;
    case PushResult::kNone:
      if (time - *push_start_ > params_.push_time) {
        refusal_ = Refusal::kPushTimeout;
      }
  }
}

bool FrankaCycle::IsAtRest(const Vector7& v) noexcept {
  const bool slow = v.cwiseAbs().maxCoeff() < kRestSpeed;
  rest_cycles_ = slow ? rest_cycles_ + 1 : 0;
  return rest_cycles_ >= kRestCycles;
}

void FrankaCycle::Publish(double time, const FrankaReading& reading) noexcept {
  const RobotSideOutput<SerialArm<7>>& output = state_.side.output;
  if (output.hold != status_.hold) {
    ++status_.holds[static_cast<std::size_t>(output.hold)];
  }
  status_.hold = output.hold;
  status_.time = time;
  status_.q = reading.q;
  status_.v = reading.v;
  status_.torque = state_.torque();
  status_.X_BE = state_.X_BE;
  status_.sensed_wrench = output.sensed_wrench;
  status_.gripper_width = state_.side.gripper.width;
  status_.success_rate = reading.success_rate;
  ++status_.cycles;
  if (reading.periods > 1) status_.lost_cycles += reading.periods - 1;
  status_.tares = state_.sensor.tares;
  status_.tares_refused = state_.sensor.tares_refused;
  status_.bad_inputs = output.bad_inputs;
  status_.rate_limited = state_.side.controller.rate_limited;
  status_.torque_limited = state_.side.controller.torque_limited;
  statuses_.Set(status_);
  replies_.Set(state_.message());
}

}  // namespace dual_proxy
