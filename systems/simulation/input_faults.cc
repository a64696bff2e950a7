// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/input_faults.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "dual_proxy/common/validate.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

bool IsOfSelections(FaultKind kind) {
  return kind == FaultKind::kFlipping || kind == FaultKind::kTilted;
}

// What a fault makes of a number; NaN of a frozen one, which has its own.
double ValueOf(FaultKind kind) {
  using Limits = std::numeric_limits<double>;
  switch (kind) {
    case FaultKind::kInfinite:
      return Limits::infinity();
    case FaultKind::kHuge:
      return 1e300;
    case FaultKind::kDenormal:
      return Limits::denorm_min();
    default:
      return Limits::quiet_NaN();
  }
}

}  // namespace

void InputFault::Validate() const {
  ValidateFields("InputFault", *this);
  if (IsOfSelections(kind) != (input == FaultyInput::kSelections)) {
    throw InvalidField("InputFault", "kind",
                       input == FaultyInput::kSelections
                           ? "expected flipping or tilted, got another"
                           : "flipping and tilted are for input selections");
  }
  if (!(end > start)) {
    ThrowInvalidField("InputFault", "end", "more than start", end);
  }
}

InputFaults::InputFaults(std::vector<InputFault> faults)
    : faults_(std::move(faults)) {
  for (const InputFault& fault : faults_) fault.Validate();
}

const InputFault* InputFaults::Find(double time,
                                    FaultyInput input) const noexcept {
  for (const InputFault& fault : faults_) {
    if (fault.input == input && time >= fault.start && time < fault.end) {
      return &fault;
    }
  }
  return nullptr;
}

void InputFaults::Apply(double time, FaultyInput input,
                        Eigen::Ref<Eigen::VectorXd> values,
                        InputFaultsState* state) const noexcept {
  const auto index = static_cast<std::size_t>(input);
  const InputFault* const fault = Find(time, input);
  if (fault == nullptr) {
    state->is_held[index] = false;
    return;
  }
  if (fault->kind != FaultKind::kFrozen) {
    values.setConstant(ValueOf(fault->kind));
    return;
  }
  auto held =
      state->held.col(static_cast<Eigen::Index>(index)).head(values.size());
  if (!state->is_held[index]) {
    held = values;
    state->is_held[index] = true;
  }
  values = held;
}

void InputFaults::Apply(double time, FaultyInput input, Pose* pose,
                        InputFaultsState* state) const noexcept {
  Eigen::Matrix<double, 12, 1> values;
  values << pose->p, pose->R.reshaped();
  Apply(time, input, values, state);
  pose->p = values.head<3>();
  pose->R = values.tail<9>().reshaped<>(3, 3);
}

void InputFaults::Apply(double time, FaultyInput input, Message* message,
                        InputFaultsState* state) const noexcept {
  if (message->size < 0 || message->size > Message::kMaxSize) return;
  Apply(time, input,
        Eigen::Map<Eigen::VectorXd>(message->body.data(), message->size),
        state);
}

std::optional<ContactSelections> InputFaults::Select(
    double time, double period) const noexcept {
  const InputFault* const fault = Find(time, FaultyInput::kSelections);
  if (fault == nullptr) return std::nullopt;
  ContactSelections result;
  if (fault->kind == FaultKind::kFlipping) {
    const auto period_number = std::llround((time - fault->start) / period);
    if (period_number % 2 != 0) return result;
  }
  const double slope =
      fault->kind == FaultKind::kTilted ? std::numbers::sqrt2 / 2 : 0;
  const Vector3d normal(slope, 0, -std::sqrt(1 - slope * slope));
  result.force = normal * normal.transpose();
  result.normals.col(0) = normal;
  return result;
}

}  // namespace dual_proxy
