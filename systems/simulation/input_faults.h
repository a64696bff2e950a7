// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/perception/contact_perception.h"

namespace dual_proxy {

/** Inputs of a loop that can be wrong. */
enum class FaultyInput {
  kRobotPosition,
  kRobotVelocity,
  kSensor,
  kDevicePose,
  kDeviceVelocity,
  kMessageToRobot,
  kMessageToDevice,
  kSelections,
};

template <>
struct EnumStrings<FaultyInput> {
  static constexpr std::pair<FaultyInput, const char*> kValues[] = {
      {FaultyInput::kRobotPosition, "robot_position"},
      {FaultyInput::kRobotVelocity, "robot_velocity"},
      {FaultyInput::kSensor, "sensor"},
      {FaultyInput::kDevicePose, "device_pose"},
      {FaultyInput::kDeviceVelocity, "device_velocity"},
      {FaultyInput::kMessageToRobot, "message_to_robot"},
      {FaultyInput::kMessageToDevice, "message_to_device"},
      {FaultyInput::kSelections, "selections"}};
};

/** What an input is instead of what it should be. */
enum class FaultKind {
  kNan,
  kInfinite,
  kHuge,      ///< 1e300
  kDenormal,  ///< The least number above zero.
  kFrozen,    ///< What it was when the fault began.
  /** Of selections: the direction of a table below is force-controlled in every
  other period. */
  kFlipping,
  kTilted,  ///< Of selections: that direction, 45 deg off.
};

template <>
struct EnumStrings<FaultKind> {
  static constexpr std::pair<FaultKind, const char*> kValues[] = {
      {FaultKind::kNan, "nan"},       {FaultKind::kInfinite, "infinite"},
      {FaultKind::kHuge, "huge"},     {FaultKind::kDenormal, "denormal"},
      {FaultKind::kFrozen, "frozen"}, {FaultKind::kFlipping, "flipping"},
      {FaultKind::kTilted, "tilted"}};
};

/** An input that is wrong for a while. */
struct InputFault {
  FaultyInput input{FaultyInput::kSensor};
  FaultKind kind{FaultKind::kNan};
  double start{0};
  double end{0};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    constexpr bool kRequired = true;
    VisitEnum(a, "InputFault", "input", &input, "of the loop", kRequired);
    VisitEnum(a, "InputFault", "kind", &kind,
              "of all its numbers: what they are instead; flipping and tilted "
              "are for selections, a table's direction in every other period "
              "and 45 deg off",
              kRequired);
    a->Visit(
        Field("start", &start, AtLeast(0), "s", "of the fault").Required());
    a->Visit(Field("end", &end, AtLeast(0), "s", "later than that").Required());
  }
};

/** What InputFaults remembers: of each input, what is frozen. */
struct InputFaultsState {
  static constexpr int kInputs = std::size(EnumStrings<FaultyInput>::kValues);

  Eigen::Matrix<double, Message::kMaxSize, kInputs> held{
      decltype(held)::Zero()};
  std::array<bool, kInputs> is_held{};
};

/** Puts faults on a loop's inputs, to see what it makes of them. No method but
the constructor allocates or throws. */
class InputFaults {
 public:
  /** @throws std::invalid_argument if one is not valid. */
  explicit InputFaults(std::vector<InputFault> faults);

  /** Whether there are any. */
  bool on() const { return !faults_.empty(); }

  /** Changes the numbers of an input if it is wrong at `time`, s. */
  void Apply(double time, FaultyInput input, Eigen::Ref<Eigen::VectorXd> values,
             InputFaultsState* state) const noexcept;
  void Apply(double time, FaultyInput input, Pose* pose,
             InputFaultsState* state) const noexcept;
  void Apply(double time, FaultyInput input, Message* message,
             InputFaultsState* state) const noexcept;

  /** Selections from outside, if there is a fault of theirs at `time`, s.
  @param period  s, of the loop. */
  std::optional<ContactSelections> Select(double time,
                                          double period) const noexcept;

 private:
  const InputFault* Find(double time, FaultyInput input) const noexcept;

  std::vector<InputFault> faults_;
};

}  // namespace dual_proxy
