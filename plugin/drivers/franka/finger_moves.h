// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <utility>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of FingerMoves, and of the gripper that it is for. */
struct FrankaGripperParams {
  double speed{0.1};
  double force{20};
  double least_move{0.002};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("speed", &speed, Between(0.005, 0.1), "m/s",
                   "at which the fingers' distance changes"));
    a->Visit(Field("force", &force, Between(1, 70), "N",
                   "with which they hold what they have met"));
    a->Visit(Field("least_move", &least_move, Between(5e-4, 0.02), "m",
                   "a command that differs by less is the same, and fingers "
                   "that stand open wider than told by more have met "
                   "something"));
  }
};

enum class FingerAction {
  kNone,   ///< Nothing: they are where they are to be.
  kMove,   ///< They are to be moved to target().
  kGrasp,  ///< They have met something: they are to hold it.
};

template <>
struct EnumStrings<FingerAction> {
  static constexpr std::pair<FingerAction, const char*> kValues[] = {
      {FingerAction::kNone, "none"},
      {FingerAction::kMove, "move"},
      {FingerAction::kGrasp, "grasp"}};
};

/** Makes single moves, of which each takes its time, of a width that changes
all the while (GripperFollower's): a Franka Hand takes nothing else. Whoever has
one asks for the next move when the last has ended.

Fingers that are stopped on their way hold what stopped them, until they are
told to open wider than that.

Next() neither allocates nor throws. */
class FingerMoves {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit FingerMoves(const FrankaGripperParams& params);

  const FrankaGripperParams& params() const { return params_; }

  /** @param command  m, between the fingers; not finite: there is none.
  @param width, max_width  m, as the gripper says; 0 if it knows no maximum. */
  FingerAction Next(double command, double width, double max_width) noexcept;

  /** The gripper refused the last move: the fingers have met nothing. */
  void Refuse() noexcept { closing_ = false; }

  /** m, of the last move. */
  double target() const noexcept { return target_; }

 private:
  FrankaGripperParams params_;
  double target_{std::numeric_limits<double>::quiet_NaN()};
  bool closing_{false};
  bool holding_{false};
};

/** Whether a command counts yet: once it has been where the fingers are. What
they hold at first they go on holding; nothing jumps. It sees every command. */
class FingerTakeover {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit FingerTakeover(const FrankaGripperParams& params);

  /** @param command, width  m, as of FingerMoves. Neither allocates nor throws.
   */
  bool Update(double command, double width) noexcept;

 private:
  FrankaGripperParams params_;
  bool done_{false};
  double difference_{0};  // m: of the command from the fingers; 0 at first.
};

}  // namespace dual_proxy
