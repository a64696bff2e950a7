// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/common/signal_layout.h"
#include "dual_proxy/control/robot.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/link/pose_sender.h"
#include "dual_proxy/perception/contact_perception.h"
#include "dual_proxy/proxy/gripper_follower.h"
#include "dual_proxy/proxy/robot_side_proxy.h"
#include "dual_proxy/schemes/schemes.h"
#include "dual_proxy/sides/local_planner.h"
#include "dual_proxy/sides/reference_blend.h"

namespace dual_proxy {

/** Parameters of RobotSide. All `period` fields of the control must be the
same. */
template <typename Robot>
struct RobotSideParams {
  Scheme scheme{SchemeOf<DualProxyScheme>};
  SchemesParams schemes;
  RobotSideProxyParams proxy;
  typename Robot::Controller::Params controller;
  PoseSenderParams sender;
  ContactPerceptionParams perception;
  LocalPlannerParams planner;
  GripperParams gripper;
  double max_sensor_age{0.01};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "RobotSideParams", "scheme", &scheme,
              "how the two sides work together");
    a->Visit(Field("schemes", &schemes, "of which that of `scheme` counts"));
    a->Visit(Field("proxy", &proxy, "what the robot is to follow, and how"));
    a->Visit(Field("controller", &controller, "of the robot"));
    a->Visit(Field("sender", &sender, "of its messages"));
    a->Visit(Field("perception", &perception, "its filters"));
    a->Visit(Field("planner", &planner,
                   "that shares the robot with the operator, if the scheme "
                   "uses selections"));
    a->Visit(Field("gripper", &gripper, "that follows the device's"));
    a->Visit(Field("max_sensor_age", &max_sensor_age, Above(0), "s",
                   "of a sensed wrench; with none that is good and younger "
                   "the robot holds its place"));
  }
};

/** Why a robot holds its place. */
enum class HoldReason {
  kNone = 0,       ///< It follows.
  kNoLink = 1,     ///< No message has come yet, or none for too long.
  kNoSensor = 2,   ///< The force sensor cannot be relied on.
  kAsked = 3,      ///< Somebody has asked for it.
  kBadInputs = 4,  ///< The cycle was refused.
};

template <>
struct EnumStrings<HoldReason> {
  static constexpr std::pair<HoldReason, const char*> kValues[] = {
      {HoldReason::kNone, "none"},
      {HoldReason::kNoLink, "no_link"},
      {HoldReason::kNoSensor, "no_sensor"},
      {HoldReason::kAsked, "asked"},
      {HoldReason::kBadInputs, "bad_inputs"}};
};

/** Inputs of one cycle; vectors in B; every force is what the robot exerts on
its environment. */
template <typename Robot>
struct RobotSideInput {
  using Coordinates = Eigen::Matrix<double, Robot::kCoordinates, 1>;

  Message message;  ///< The newest from the haptic side.
  Pose X_BE;        ///< Pose of the tool point.
  typename Robot::Model::Terms model;
  Coordinates q{Coordinates::Zero()};  ///< rad; of a point m, in B.
  Coordinates v{Coordinates::Zero()};  ///< Their rates.
  /** The directions of contact, if somebody else knows them: the filters then
  rest. */
  std::optional<ContactSelections> selections;
  /** [force; moment about E], N, N m. */
  Vector6 sensed_wrench{Vector6::Zero()};
  /** Whether the force sensor can be relied on; without it the robot holds its
  place. */
  bool sensor_ready{true};
  /** s: how old the sensed wrench is. */
  double sensor_age{0};
  /** Whether the robot is to hold its place, as without a link. */
  bool hold{false};
  /** N m: the command that the robot got last, if it says so; what is sent is
  limited in its rate against that. */
  std::optional<Coordinates> received_command{};
  /** What a planner asks for, in place of the side's own. It counts with a
  scheme that uses selections; see ReferenceBlend. */
  std::optional<PlannerReference> planner;
};

/** Results of one cycle, and what of the inputs belongs in a log. */
template <typename Robot>
struct RobotSideOutput {
  using Coordinates = Eigen::Matrix<double, Robot::kCoordinates, 1>;

  typename Robot::Controller::Output controller;
  ContactSelections selections;  ///< In force in this cycle.
  RobotSetpoint setpoint;        ///< The controller's, of half and planner.
  Pose reference_pose;           ///< In B: where the tool point is wanted.

  Pose X_BE;
  Vector6 v_BE{Vector6::Zero()};  ///< [linear; angular], m/s, rad/s.
  Coordinates q{Coordinates::Zero()};
  Coordinates v{Coordinates::Zero()};
  Vector6 sensed_wrench{Vector6::Zero()};
  bool sensor_ready{false};
  HoldReason hold{HoldReason::kNoLink};
  /** Cycles of which half, controller or blend refused something so far, or in
  which time went back; one that several refuse counts once. */
  std::int64_t bad_inputs{0};
};

/** Memory of RobotSide. */
template <typename Robot>
struct RobotSideState {
  RobotHalf::State half;
  typename Robot::Controller::State controller;
  ContactPerceptionState perception;
  LocalPlannerState planner;
  ReferenceBlendState blend;
  GripperState gripper;  ///< Its width is for the gripper's driver.
  /** The last good wrench, and how old it is, s. */
  Vector6 sensed_wrench{Vector6::Zero()};
  double sensed_age{std::numeric_limits<double>::infinity()};
  /** s: of the last cycle whose time was not refused. */
  double time{-std::numeric_limits<double>::infinity()};
  RobotSideOutput<Robot> output;  ///< Of the last cycle.
};

/** All of the robot side's work in one control cycle: the planner, the scheme's
half, the blend of both, the controller, perception, in this order. It owns no
logic but the order; each part is documented where it is.

The gripper takes what came with a message that the half has accepted, and holds
while there is no link.

Perception and planner run where the scheme has use for selections. A cycle that
the controller refused adds nothing to what the filters take.

A wrench that is not finite is none: the last good one counts, until it is older
than max_sensor_age. Then, as when the sensor is not ready, the robot holds its
place: nothing is force-controlled, and the proxy stays where it has come to
rest. When somebody asks for it (hold) or there is no link it holds its place,
too, and what it touches it touches without a force to speak of.

Another input that cannot be (common/possible.h) is refused as one that is not
finite is. Time that goes back is counted, and goes on from there.

Update() neither allocates nor throws. */
template <typename Robot>
class RobotSide {
 public:
  using Params = RobotSideParams<Robot>;
  using Input = RobotSideInput<Robot>;
  using State = RobotSideState<Robot>;

  /** @throws std::invalid_argument if params are not valid. */
  explicit RobotSide(Params params = {});

  const Params& params() const { return params_; }
  bool has_perception() const { return perception_.has_value(); }
  /** Whether a planner of its own runs. */
  bool has_planner() const { return blend_ && planner_.enabled(); }

  /** @param seed, angular_seed  of the filters of forces and of moments. */
  State MakeState(std::uint64_t seed = 0, std::uint64_t angular_seed = 1) const;

  /** Advances by one period; results are in state->output.
  @param time s, not decreasing: the clock by which messages are stamped. */
  void Update(double time, const Input& input, State* state) const noexcept;

  /** Whether Update() can work on a state: it is of a side with this scheme. */
  bool IsCompatible(const State& state) const noexcept {
    return half_.IsCompatible(state.half);
  }

  /** Lists the signals of a state, or writes them. No heap if it writes. */
  void VisitSignals(const State& state, SignalSink* sink) const;

  /** Of what VisitSignals() writes. */
  const std::vector<SignalSlice>& layout() const { return layout_; }

 private:
  void TakePlanner(double time, const Input& input,
                   State* state) const noexcept;
  // Puts the wrench that counts into `input`, or makes the sensor not ready.
  // False: there was none that is good in this cycle.
  bool TakeWrench(Input* input, State* state) const noexcept;
  // With inputs of which what cannot be is NaN.
  void Advance(double time, bool sensed, const Input& input,
               State* state) const noexcept;

  Params params_;
  RobotHalf half_;
  LocalPlanner planner_;
  std::optional<ReferenceBlend> blend_;
  typename Robot::Controller controller_;
  std::optional<ContactPerception> perception_;
  GripperFollower gripper_;
  std::vector<SignalSlice> layout_;
};

}  // namespace dual_proxy
