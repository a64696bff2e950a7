// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/control/haptic_controller.h"
#include "dual_proxy/control/operational_space_controller.h"
#include "dual_proxy/control/point_controller.h"
#include "dual_proxy/experiment/arm_mismatch.h"
#include "dual_proxy/experiment/claim.h"
#include "dual_proxy/experiment/derived_keys.h"
#include "dual_proxy/experiment/recording.h"
#include "dual_proxy/experiment/scenario_error.h"
#include "dual_proxy/experiment/scene_params.h"
#include "dual_proxy/link/communication_channel.h"
#include "dual_proxy/link/link_monitor.h"
#include "dual_proxy/link/pose_sender.h"
#include "dual_proxy/loop/teleop_loop.h"
#include "dual_proxy/perception/contact_perception.h"
#include "dual_proxy/proxy/gripper_follower.h"
#include "dual_proxy/proxy/haptic_side_proxy.h"
#include "dual_proxy/proxy/robot_side_proxy.h"
#include "dual_proxy/proxy/workspace_map.h"
#include "dual_proxy/schemes/schemes.h"
#include "dual_proxy/sides/local_planner.h"
#include "dual_proxy/sides/operator_aids.h"
#include "dual_proxy/simulation/force_torque_sensor.h"
#include "dual_proxy/simulation/haptic_device.h"
#include "dual_proxy/simulation/input_faults.h"
#include "dual_proxy/simulation/operator.h"
#include "dual_proxy/simulation/point_robot.h"

namespace dual_proxy {

/** What the tool is on. */
enum class RobotKind {
  kPanda,
  kPointMass,  ///< The paper's, of section V.C.
};

template <>
struct EnumStrings<RobotKind> {
  static constexpr std::pair<RobotKind, const char*> kValues[] = {
      {RobotKind::kPanda, "panda"}, {RobotKind::kPointMass, "point_mass"}};
};

/** Which version of the dual proxy's law. */
enum class Law {
  kDefault,  ///< This project's.
  kPrinted,  ///< The paper's to the letter.
};

template <>
struct EnumStrings<Law> {
  static constexpr std::pair<Law, const char*> kValues[] = {
      {Law::kDefault, "default"}, {Law::kPrinted, "printed"}};
};

/** What draws random numbers in a run, each a stream of its own. */
enum class Stream { kFilter, kSensor, kToRobot, kToDevice, kAngularFilter };

template <>
struct EnumStrings<Stream> {
  static constexpr std::pair<Stream, const char*> kValues[] = {
      {Stream::kFilter, "filter"},
      {Stream::kSensor, "sensor"},
      {Stream::kToRobot, "to_robot"},
      {Stream::kToDevice, "to_device"},
      {Stream::kAngularFilter, "angular_filter"}};
};

/** Both directions of the link alike; the keys of all stand directly in
`link`. */
struct LinkParams {
  PoseSenderParams sender;
  CommunicationChannelParams channel;
  LinkMonitorParams monitor;
  ClockParams clock;

  double rate() const { return sender.rate; }     ///< Messages per second, Hz.
  double delay() const { return channel.delay; }  ///< One way, s.

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEmbedded(a, "sender", &sender, "of messages");
    VisitEmbedded(a, "channel", &channel, "that carries them");
    VisitEmbedded(a, "monitor", &monitor, "of those that arrive");
    VisitEmbedded(a, "clock", &clock, "of the device's side");
  }
};

/** s: more than a day. */
inline constexpr double kLongestRun = 1e5;

/** A place to be at rest at a time. */
struct Waypoint {
  double time{0};
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};
  Eigen::Vector3d rotation{Eigen::Vector3d::Zero()};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(
        Field("time", &time, Between(0, kLongestRun), "s", "when to be there")
            .Required());
    a->Visit(
        Field("position", &position, Between(-2, 2), "m", "in B").Required());
    a->Visit(Field("rotation", &rotation,
                   Between(-std::numbers::pi, std::numbers::pi), "rad",
                   "in B: rotation vector of the tool from where it is at "
                   "home, R_BE = exp(rotation) R_cw"));
  }
};

/** What the operator means to do, in the robot's frame B. */
struct OperatorParams {
  std::vector<Waypoint> waypoints;
  std::string recording;
  LengthUnit recording_units{LengthUnit::kMetre};
  double recording_scale{1};
  double press_depth{0.04};
  std::vector<Eigen::Vector2d> clutch;
  std::vector<Eigen::Vector2d> home;
  std::vector<Eigen::Vector2d> force_scale;
  std::vector<Eigen::Vector2d> gripper;

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(
        Field("waypoints", &waypoints,
              "minimum-jerk moves from each to the next; the first at time 0"));
    a->Visit(
        Field("recording", &recording,
              "CSV file of a human motion, in place of the waypoints (see "
              "dual_proxy.recording); in a scenario's file relative to that, "
              "else to the working directory; ~ is the home directory"));
    VisitEnum(a, "OperatorParams", "recording_units", &recording_units,
              "of the positions in it");
    a->Visit(Field("recording_scale", &recording_scale, Between(Open(0), 1000),
                   "", "by which its lengths are multiplied"));
    a->Visit(
        Field("press_depth", &press_depth, Between(0, 0.1), "m",
              "how far below first touch a recording's contact height goes"));
    a->Visit(Field("clutch", &clutch,
                   "[start, end] each, s: the clutch is pressed; the hand goes "
                   "on along its path, the robot from then on beside it"));
    a->Visit(Field("home", &home,
                   "[start, end] each, s: the handle is led home and held "
                   "there, the hand gives way and then goes on along its path "
                   "from there; the robot waits"));
    a->Visit(Field("force_scale", &force_scale,
                   "[time, scale] each, s: by which the hand has its force "
                   "multiplied from then on"));
    a->Visit(Field("gripper", &gripper,
                   "[time, opening] each, s, m: of the device's gripper from "
                   "then on"));
  }
};

/** Everything that decides what a run does, from one YAML file.

The file has one top-level key, the scenario's name; below it are the sections
that Serialize() visits. What is not written keeps its default, an unknown key
is an error. The sections that belong to an algorithm *are* its `...Params`, so
their fields, units and ranges are those of the class.

Some values are needed in several places. Each is written once, and
Distribute() copies it (derived_keys.h has the list). `control_period` is the
period of everything that runs at the control rate, the sensor, the device and
the log among it, and has nothing to do with the plant's step, scene.time_step;
scene.start_position is map.p_cw, so the device's home is the robot's start;
`map` and the link's monitor belong to both sides; robot_proxy.stiffness is what
the haptic side matches its own to.

In order of precedence, later wins: defaults, the YAML file, the presets of
`scheme` and `law`, the section `overrides`, which has the scenario's own keys
(but for these two). */
struct Scenario {
  std::string name{"scenario"};
  std::string description;
  RobotKind robot{RobotKind::kPanda};
  Scheme scheme{SchemeOf<DualProxyScheme>};
  Law law{Law::kDefault};
  double duration{20};
  bool extend_for_delay{true};
  std::int64_t seed{0};
  /** control_period and scene.time_step together may be 20 % longer before a
  loop does not come to rest (control/loop_stability.h). */
  double control_period{1e-3};
  SceneParams scene;
  WorkspaceMapParams map;
  LinkParams link;
  RobotSideProxyParams robot_proxy{[] {
    RobotSideProxyParams params;
    params.catch_up_share = 0.1;
    params.limiter.max_jerk = 100;
    params.limiter.max_angular_jerk = 200;
    return params;
  }()};
  OperationalSpaceControllerParams<7> controller{[] {
    OperationalSpaceControllerParams<7> params;
    params.force_gain = 1;
    params.friction_feedback.gain = 0.8;
    params.force_integral_delay = 0.1;
    params.motion_speed_limit = 0.5;
    params.rotation_speed_limit = 1;
    params.posture_speed_limit = 0.5;
    params.max_proportional_force = 20;
    params.max_proportional_moment = 1;
    params.max_mass = 25;
    return params;
  }()};
  PointControllerParams point_controller{[] {
    PointControllerParams params;
    params.motion_speed_limit = 0.5;
    params.force.integral_delay = 0.1;
    params.force.max_proportional_force = 20;
    return params;
  }()};
  PointRobotParams point_mass;
  ForceSpaceParticleFilterParams filter{[] {
    ForceSpaceParticleFilterParams params;
    params.period = 0.01;
    return params;
  }()};
  AngularFilterParams angular_filter;
  LocalPlannerParams planner;
  HapticSideProxyParams haptic_proxy;
  HapticControllerParams haptic_controller;
  OperatorAidsParams operator_aids;
  GripperParams gripper;
  SchemesParams schemes;  ///< Of each scheme that has some of its own.
  SimulatedHapticDeviceParams device;
  ForceTorqueSensorParams sensor{[] {
    ForceTorqueSensorParams params;
    params.tare = true;
    return params;
  }()};
  OperatorParams operator_params;  ///< The section `operator`.
  ArmMismatchParams mismatch;
  std::vector<InputFault> faults;
  std::vector<Claim> claims;

  /** The section `overrides` of a scenario. */
  struct Overrides {
    Scenario* scenario{};

    template <typename Archive>
    void Serialize(Archive* a) {
      WrittenArchive<Archive> written(a);
      scenario->VisitFields(&written, false);
    }
  };

  /** Reads: what is written, then the presets, then the overrides. Call
  Validate() afterwards. A writer wants SerializeSections(). */
  template <typename Archive>
  void Serialize(Archive* a) {
    SerializeSections(a);
    ApplyPresets();
    Overrides overrides{this};
    a->Visit(Field("overrides", &overrides, "keys of the scenario's own"));
  }

  /** Visits all that is written but the overrides, and changes nothing else. */
  template <typename Archive>
  void SerializeSections(Archive* a) {
    WrittenArchive<Archive> written(a);
    VisitFields(&written, true);
  }

  /** Sets what `scheme` and `law` decide. */
  void ApplyPresets();

  /** Makes operator.recording and scene.model_directives absolute: a relative
  one is in `directory`, "" is the working directory. What reads a scenario from
  a file calls it with the file's directory. */
  void ResolvePaths(const std::string& directory = "");

  /** Copies shared values to where they are needed, resolves paths. */
  void Distribute();

  /** Distributes, and checks every field and the fields against each other.
  @throws ScenarioError for the first that is wrong. */
  void Validate();

  /** @param fused  whether the loop is one system.
  @throws ScenarioError if there is something that a Drake diagram has not. */
  void CheckForDrake(bool fused) const;

  /** Tells which of some points (columns, m, in B) the device can ask for. They
  lie, mapped to the device, within 95 % of its workspace. The set is convex. */
  Eigen::VectorX<bool> Reachable(
      const Eigen::Ref<const Eigen::Matrix3Xd>& points) const;

  /** Where the operator means the robot's tool to go: points in B, the
  waypoints or those of the recording, and rotations in B if a waypoint has one.
  @throws ScenarioError if a recording cannot be read; the message names file,
  row and column. */
  OperatorPathParams CalcOperatorPath() const;

  /** The same with what was done to the recording, which there must be. */
  PlacedRecording CalcRecordedMotion() const;

  /** Whether the angular filter runs: it is enabled, and the scheme has it. */
  bool has_angular_filter() const {
    return angular_filter.enabled && UsesSelections(scheme);
  }

  /** The seed of a stream of random numbers, from `seed`. */
  std::uint64_t CalcSeed(Stream stream) const;

  /** How long a run lasts, s; see `extend_for_delay`.
  @throws ScenarioError as CalcOperatorPath(). */
  double CalcRunDuration() const;

  /** Visits all fields but the name; with or without the two that bring
  presets. */
  template <typename Archive>
  void VisitFields(Archive* a, bool scheme_and_law) {
    a->Visit(Field("description", &description, "one line"));
    VisitEnum(a, "Scenario", "robot", &robot,
              "what the tool is on; a point has no Drake plant");
    if (scheme_and_law) {
      VisitEnum(a, "Scenario", "scheme", &scheme,
                "how the two sides work together");
      VisitEnum(a, "Scenario", "law", &law,
                "this project's, or the paper's to the letter");
    }
    a->Visit(Field("duration", &duration, Between(1e-3, kLongestRun), "s",
                   "of a run"));
    a->Visit(Field("extend_for_delay", &extend_for_delay,
                   "lengthens the run to the end of the operator's path + 3 x "
                   "delay + 2 s, so that a late release is part of it; setting "
                   "`duration` by an override turns this off"));
    a->Visit(Field("seed", &seed, AtLeast(0), "", "of everything random"));
    a->Visit(Field("control_period", &control_period, Between(1e-5, 1e-2), "s",
                   "of both sides' control; beyond 1 ms, for which the gains "
                   "are made, only as long as the law is stable with it"));
    a->Visit(Field("scene", &scene, "the arm's surroundings"));
    a->Visit(
        Field("map", &map, "between device and robot; its p_cw is a copy"));
    a->Visit(Field("link", &link, "both directions alike"));
    a->Visit(Field("robot_proxy", &robot_proxy,
                   "the dual proxy on the robot's side"));
    a->Visit(Field("controller", &controller, "of an arm"));
    a->Visit(Field("point_controller", &point_controller, "of a point mass"));
    a->Visit(Field("point_mass", &point_mass, "the robot that is one"));
    a->Visit(Field("filter", &filter, "at 100 Hz; see docs/benchmarks.md"));
    a->Visit(Field("angular_filter", &angular_filter, "of moments"));
    a->Visit(Field("planner", &planner,
                   "that shares the robot with the operator, if the scheme "
                   "uses selections"));
    a->Visit(Field("haptic_proxy", &haptic_proxy,
                   "the dual proxy on the device's side"));
    a->Visit(Field("haptic_controller", &haptic_controller, "of the device"));
    a->Visit(Field("operator_aids", &operator_aids,
                   "of the device's side; a schedule of the operator's turns "
                   "their buttons on"));
    a->Visit(Field("gripper", &gripper,
                   "of the robot; a schedule of the operator's enables it"));
    a->Visit(Field("schemes", &schemes, "of each scheme that has some"));
    a->Visit(
        Field("device", &device, "what stands for the device and its hand"));
    a->Visit(Field("sensor", &sensor, "between arm and tool"));
    a->Visit(Field("operator", &operator_params, "what the hand means to do"));
    a->Visit(Field("mismatch", &mismatch,
                   "what the arm of engine bare is that its controllers do "
                   "not know of"));
    a->Visit(Field("faults", &faults,
                   "inputs of the loop that are wrong for a while"));
    a->Visit(Field("claims", &claims, "what is said of it; no run needs them"));
  }

 private:
  void CheckFields();
  void CheckAcross() const;
  void CheckStart() const;
  void CheckPlanner() const;
  void CheckForceScale() const;
  void CheckPointMass() const;
  void CheckPeriods() const;
  void CheckHapticForceLoop() const;
  void CheckAgainstNoise(const std::string& section,
                         const ForceSpaceParticleFilterParams& params,
                         double noise) const;
  void CheckWaypoints() const;
};

}  // namespace dual_proxy
