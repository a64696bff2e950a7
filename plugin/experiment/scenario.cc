// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/scenario.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <type_traits>
#include <vector>

#include "dual_proxy/common/norm.h"
#include "dual_proxy/common/random.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/control/loop_stability.h"

namespace dual_proxy {
namespace {

// Share of the device's workspace that an intended path may use.
constexpr double kReach = 0.95;
// Steps for which the gains are made, of control and of the plant, s.
constexpr double kUsualStep = 1e-3;
// How much longer both steps could be.
constexpr double kStepMargin = 1.2;
// Of the gains of the haptic device's force loop: with less it rings.
constexpr double kGainMargin = 2;
// Standard deviations of the sensor's noise that a filter's threshold is above.
constexpr double kNoiseMargin = 3.0;

// Checks all that it visits, of structs the innermost first, and turns
// "FooParams: field `x` expected ..." into "plane.foo.x: expected ...".
class Checker {
 public:
  explicit Checker(std::string path) : path_(std::move(path)) {}

  template <typename T>
  void Visit(const FieldValue<T>& field) {
    Check(path_ + "." + field.name(), field.value());
    Named(path_, [&field] { FieldChecker("").Visit(field); });
  }

  // Calls `check`, whose errors are about `path`.
  template <typename Callable>
  static void Named(const std::string& path, const Callable& check) {
    try {
      check();
    } catch (const InvalidField& error) {
      throw ScenarioError(path + "." + error.field() + ": " + error.problem());
    }
  }

 private:
  template <typename T>
  static void Check(const std::string& path, T* value) {
    if constexpr (Serializable<T>) {
      Checker inner(path);
      value->Serialize(&inner);
      Named(path, [value] { value->Validate(); });
    }
  }

  template <typename T>
  static void Check(const std::string& path, std::vector<T>* items) {
    for (std::size_t i = 0; i < items->size(); ++i) {
      Check(path + "[" + std::to_string(i) + "]", &(*items)[i]);
    }
  }

  std::string path_;
};

template <typename Part>
auto Show(const Part& part) {
  if constexpr (std::is_floating_point_v<Part>) {
    return NumberText(part);
  } else {
    return part;
  }
}

// Joins its arguments to one line.
template <typename... Parts>
std::string Join(const Parts&... parts) {
  std::ostringstream line;
  (line << ... << Show(parts));
  return line.str();
}

// Of the contact with a surface that a loop is tried on.
ContactModel MakeContactModel(const SceneParams& scene,
                              const ContactSurfaceParams& surface) {
  constexpr double kForce = 5;  // N
  ContactModel contact{.stiffness = surface.stiffness};
  contact.damping = scene.contact_approximation == ContactApproximation::kSap
                        ? surface.stiffness * scene.relaxation_time
                        : kForce * surface.dissipation;
  return contact;
}

// A spring and a damper on a mass, or on an inertia.
struct MotionLoop {
  double stiffness;
  double damping;
  const char* damping_key;
  double mass{1};
};

std::vector<MotionLoop> ListMotionLoops(const PointControllerParams& point) {
  return {{point.position_stiffness, point.position_damping,
           "point_controller.position_damping"}};
}

std::vector<MotionLoop> ListMotionLoops(
    const OperationalSpaceControllerParams<7>& arm) {
  const CartesianImpedanceParams& impedance = arm.impedance;
  if (arm.motion == MotionLaw::kCartesianImpedance) {
    return {{impedance.stiffness, impedance.damping,
             "controller.impedance.damping", kLightestMass},
            {impedance.rotational_stiffness, impedance.rotational_damping,
             "controller.impedance.rotational_damping", kLightestInertia}};
  }
  return {{arm.position_stiffness, arm.position_damping,
           "controller.position_damping"},
          {arm.rotation_stiffness, arm.rotation_damping,
           "controller.rotation_damping"}};
}

// What is not stable with these steps, or nothing.
std::string FindUnstableLoop(const Scenario& scenario, double control_period,
                             double time_step) {
  if (control_period <= kUsualStep && time_step <= kUsualStep) return {};
  const double period = kStepMargin * control_period;
  const double step = kStepMargin * time_step;
  const bool is_point = scenario.robot == RobotKind::kPointMass;
  const OperationalSpaceControllerParams<7>& arm = scenario.controller;
  const PointControllerParams& point = scenario.point_controller;
  for (const MotionLoop& loop :
       is_point ? ListMotionLoops(point) : ListMotionLoops(arm)) {
    if (!MotionLoopSettles(loop.stiffness / loop.mass, loop.damping / loop.mass,
                           period, step)) {
      return Join("motion control (", loop.damping_key, " ", loop.damping,
                  ") swings");
    }
  }
  if (!UsesSelections(scenario.scheme)) return {};
  ForceLoopParams loop =
      is_point ? MakeForceLoopParams(point) : MakeForceLoopParams(arm);
  loop.period = period;
  const char* keys = is_point ? "point_controller.force." : "controller.force_";
  for (const ContactSurfaceParams& surface : scenario.scene.ContactSurfaces()) {
    ContactModel contact = MakeContactModel(scenario.scene, surface);
    if (is_point) contact.mass = scenario.point_mass.mass;
    if (!ForceLoopSettles(loop, contact, step)) {
      return Join("force control (", keys, "gain ", loop.gain,
                  ") swings on a contact of ", contact.stiffness, " N/m");
    }
  }
  if (!ForceLoopKeepsItsSpeedLimit(loop, ContactModel().mass,
                                   std::min(step, kUsualStep))) {
    return Join("force control (", keys, "speed_limit ", loop.speed_limit,
                ") is too fast in the air");
  }
  return {};
}

// Makes a path absolute, if there is one.
void ResolvePath(const std::string& directory, std::string* file) {
  if (file->empty()) return;
  std::filesystem::path path = *file;
  const char* home = std::getenv("HOME");
  if (home != nullptr && (*file == "~" || file->starts_with("~/"))) {
    path = home + file->substr(1);
  }
  std::error_code error;
  path = std::filesystem::absolute(directory / path, error);
  const auto canonical = std::filesystem::weakly_canonical(path, error);
  *file = error ? path.string() : canonical.string();
}

}  // namespace

void LinkParams::Validate() const { ValidateFields("LinkParams", *this); }

void Waypoint::Validate() const { ValidateFields("Waypoint", *this); }

void OperatorParams::Validate() const {
  ValidateFields("OperatorParams", *this);
  ValidateButtons("OperatorParams", clutch, home, force_scale, gripper);
}

void Scenario::ApplyPresets() {
  Schemes::ForEach([this]<typename S>() {
    if (scheme != SchemeOf<S>) return;
    S::ApplyPresets(&robot_proxy, &controller);
    S::ApplyPresets(&robot_proxy, &point_controller);
  });
  if (law == Law::kPrinted) {
    robot_proxy.handover = Handover::kPrinted;
    filter.likelihood = Likelihood::kPaper;
    filter.period = 1.0 / 15.0;
    angular_filter.method = AngularMethod::kParticles;
    angular_filter.filter.period = 1.0 / 15.0;
    robot_proxy.interpolate = false;
    robot_proxy.max_motion_error = 0;
    robot_proxy.limiter.max_jerk = 0;
    robot_proxy.limiter.max_angular_jerk = 0;
    robot_proxy.recovery_speed = robot_proxy.limiter.max_velocity;
    haptic_proxy.unilateral = false;
    haptic_controller.selection_blend_time = 0;
    controller.unit_mass_motion_force = false;
    controller.feed_forward = false;
    controller.selection_blend_time = 0;
    controller.force_gain = 2.5;
    controller.friction_feedback.gain = 0;
    controller.force_filter_cutoff = 0;
    controller.force_integral_delay = 0;
    controller.passivity = false;
    point_controller.unit_mass_motion_force = false;
    point_controller.feed_forward = false;
    point_controller.selection_blend_time = 0;
    point_controller.force.filter_cutoff = 0;
    point_controller.force.integral_delay = 0;
    point_controller.force.release_time = 0;
    point_controller.force.passivity.enabled = false;
  }
}

void Scenario::ResolvePaths(const std::string& directory) {
  ResolvePath(directory, &operator_params.recording);
  ResolvePath(directory, &scene.model_directives);
}

void Scenario::Distribute() {
  ResolvePaths();
  map.p_cw = scene.start_position;
  robot_proxy.map = haptic_proxy.map = map;
  robot_proxy.link = haptic_proxy.link = link.monitor;
  haptic_proxy.robot_stiffness = robot_proxy.stiffness;
  // The controller ignores its loops' own switches and periods; the copies are
  // kept right for whoever reads them.
  for (TimeDomainPassivityParams* loop :
       {&controller.force_passivity, &controller.moment_passivity}) {
    loop->enabled = controller.passivity;
    loop->period = control_period;
  }
  // A point is all tool: nothing of it hangs on the sensor.
  const bool is_point = robot == RobotKind::kPointMass;
  sensor.tool_mass = is_point ? 0 : scene.tool_mass;
  sensor.tool_com = kToolCom;
  sensor.gravity = scene.gravity;
  for (double* period :
       {&link.sender.period, &robot_proxy.period, &robot_proxy.limiter.period,
        &controller.period, &point_controller.period,
        &point_controller.force.period,
        &point_controller.force.passivity.period, &point_mass.period,
        &haptic_proxy.period, &haptic_controller.period, &operator_aids.period,
        &gripper.period, &device.period, &sensor.period}) {
    *period = control_period;
  }
  // As few steps of one length as scene.time_step allows; values that will be
  // refused may ask for any number.
  const double steps =
      std::ceil(control_period / scene.time_step * (1 - 1e-12));
  point_mass.substeps =
      steps >= 1 && steps <= 1e6 ? static_cast<int>(steps) : 1;
}

void Scenario::Validate() {
  Distribute();
  CheckFields();
  CheckAcross();
}

void Scenario::CheckForDrake(bool fused) const {
  const auto refuse = [this](const char* key, const char* expected,
                             const char* why) {
    throw ScenarioError(
        Join(name, ".", key, ": expected ", expected, " ", why));
  };
  if (robot != RobotKind::kPanda) {
    refuse("robot", "\"panda\"", "in a Drake diagram, got \"point_mass\"");
  }
  if (!mismatch.is_none()) {
    refuse("mismatch", "none", "in a Drake diagram (engine bare has it)");
  }
  if (fused) return;
  if (!faults.empty()) {
    refuse("faults", "none", "where the loop is not one system");
  }
  if (link.clock.offset != 0 || link.clock.drift != 0) {
    refuse("link.clock_offset, clock_drift", "0",
           "where the loop is not one system");
  }
}

void Scenario::CheckFields() {
  Checker checker(name);
  VisitFields(&checker, true);
}

void Scenario::CheckStart() const {
  const std::vector<SurfaceParams> surfaces = scene.AllSurfaces();
  const std::vector<ContactSurfaceParams> solids = scene.ContactSurfaces();
  for (std::size_t i = 0; i < solids.size(); ++i) {
    const double distance =
        ContactSurface(solids[i]).CalcDistance(scene.start_position).value;
    if (distance < 0) {
      throw ScenarioError(Join(name, ".scene.start_position: expected a place ",
                               "outside of the scene's surfaces, got one ",
                               -distance, " m inside of \"", surfaces[i].name,
                               "\""));
    }
  }
}

void Scenario::CheckAcross() const {
  const double delay = link.delay();
  const double rate = link.rate();
  const double interval = 1.0 / rate;
  if (link.monitor.timeout * rate < 2.0) {
    throw ScenarioError(Join(
        name, ".link.timeout: expected at least two messages long (",
        2.0 * interval, " s at ", rate, " Hz), got ", link.monitor.timeout));
  }
  if (link.monitor.max_age <= delay + interval) {
    throw ScenarioError(Join(
        name, ".link.max_age: expected more than the delay and a message ",
        "interval (", delay + interval, " s), got ", link.monitor.max_age));
  }
  if (filter.period < control_period) {
    throw ScenarioError(
        Join(name, ".filter.period: expected at least control_period (",
             control_period, " s), got ", filter.period));
  }
  if (angular_filter.filter.period < control_period) {
    throw ScenarioError(
        Join(name, ".angular_filter.period: expected at least control_period (",
             control_period, " s), got ", angular_filter.filter.period));
  }
  CheckStart();
  CheckPlanner();
  CheckForceScale();
  if (robot == RobotKind::kPointMass) CheckPointMass();
  CheckPeriods();
  CheckHapticForceLoop();
  if (sensor.tare && sensor.force_noise_std >= sensor.tare_max_noise) {
    throw ScenarioError(
        Join(name, ".sensor.force_noise_std: expected less than ",
             "sensor.tare_max_noise (", sensor.tare_max_noise,
             " N), or no bias can be learned, got ", sensor.force_noise_std));
  }
  if (UsesSelections(scheme)) {
    CheckAgainstNoise("filter", filter, sensor.force_noise_std);
  }
  if (has_angular_filter() &&
      angular_filter.method == AngularMethod::kParticles) {
    CheckAgainstNoise("angular_filter", angular_filter.filter,
                      sensor.moment_noise_std);
  }
  if (operator_params.recording.empty()) CheckWaypoints();
}

void Scenario::CheckPlanner() const {
  if (planner.active.empty()) return;
  if (!UsesSelections(scheme)) {
    throw ScenarioError(
        Join(name, ".planner.active: expected none with scheme ",
             EnumToString(scheme), ", which has no directions of force"));
  }
  const double force = StableNorm(planner.force);
  if (force > robot_proxy.max_force) {
    throw ScenarioError(Join(name, ".planner.force: expected at most ",
                             "robot_proxy.max_force (", robot_proxy.max_force,
                             " N), got ", force));
  }
  const double amplitude = planner.scan_amplitude.cwiseAbs().maxCoeff();
  const double fastest = robot_proxy.limiter.max_velocity;
  const double rate = 2 * std::numbers::pi * planner.scan_frequency;
  if (rate * amplitude > fastest) {
    const double most = fastest / (2 * std::numbers::pi * amplitude);
    throw ScenarioError(
        Join(name, ".planner.scan_frequency: expected a scan of ", amplitude,
             " m no faster than robot_proxy.limiter.max_velocity (", fastest,
             " m/s), which is ", std::floor(100 * most) / 100, " Hz, got ",
             planner.scan_frequency));
  }
}

void Scenario::CheckForceScale() const {
  const std::vector<Eigen::Vector2d>& scales = operator_params.force_scale;
  const double most = operator_aids.max_force_scale;
  for (std::size_t i = 0; i < scales.size(); ++i) {
    if (scales[i](1) <= most) continue;
    throw ScenarioError(
        Join(name, ".operator.force_scale[", i, "][1]: expected at most ",
             "operator_aids.max_force_scale (", most, "), got ", scales[i](1)));
  }
}

void Scenario::CheckPointMass() const {
  const auto refuse = [this](const char* key, const auto&... problem) {
    throw ScenarioError(Join(name, ".", key, ": expected ", problem...,
                             " with robot point_mass"));
  };
  if (angular_filter.enabled) refuse("angular_filter.enabled", "false");
  if (!mismatch.is_none()) refuse("mismatch", "none");
  if (scene.tool != Tool::kSphere) refuse("scene.tool", "\"sphere\"");
  if (map.R_cw != Eigen::Matrix3d::Identity()) {
    refuse("map.R_cw", "no rotation");
  }
  for (std::size_t i = 0; i < operator_params.waypoints.size(); ++i) {
    if (operator_params.waypoints[i].rotation.isZero(0)) continue;
    refuse(Join("operator.waypoints[", i, "].rotation").c_str(), "none");
  }
  // Its contacts are explicit: well below where they explode.
  const double step = control_period / point_mass.substeps;
  const double longest = std::sqrt(point_mass.mass / scene.contact_stiffness);
  if (step > longest) {
    throw ScenarioError(
        Join(name, ".scene.time_step: expected at most ", longest,
             " s, as a contact of ", scene.contact_stiffness, " N/m throws ",
             point_mass.mass, " kg about, got ", scene.time_step));
  }
}

void Scenario::CheckPeriods() const {
  const std::string unstable =
      FindUnstableLoop(*this, control_period, scene.time_step);
  if (unstable.empty()) return;
  constexpr double kSteps[] = {8e-3,   6e-3, 5e-3,   4e-3, 3e-3,
                               2.5e-3, 2e-3, 1.5e-3, 1e-3};
  for (const double step : kSteps) {
    if (step < control_period &&
        FindUnstableLoop(*this, step, scene.time_step).empty()) {
      throw ScenarioError(Join(name, ".control_period: expected at most ", step,
                               " s with scene.time_step ", scene.time_step,
                               " s, as ", unstable, ", got ", control_period));
    }
  }
  for (const double step : kSteps) {
    if (step < scene.time_step &&
        FindUnstableLoop(*this, std::min(control_period, kUsualStep), step)
            .empty()) {
      throw ScenarioError(Join(name, ".scene.time_step: expected at most ",
                               step, " s, as ", unstable, ", got ",
                               scene.time_step));
    }
  }
}

void Scenario::CheckHapticForceLoop() const {
  if (haptic_controller.method != HapticControlMethod::kForceFeedback) return;
  const auto settles = [this](double gain, double integral_gain) {
    HapticControllerParams params = haptic_controller;
    params.force_gain = gain;
    params.force_integral_gain = integral_gain;
    return HapticForceLoopSettles(params,
                                  {.hand_mass = device.hand_mass,
                                   .hand_stiffness = device.hand_stiffness,
                                   .hand_damping = device.hand_damping,
                                   .device_mass = device.device_mass,
                                   .device_damping = device.device_damping,
                                   .velocity_cutoff = device.velocity_cutoff});
  };
  const double gain = haptic_controller.force_gain;
  const double integral_gain = haptic_controller.force_integral_gain;
  const auto refuse = [this](const char* key, double value, auto stays_stable) {
    double most = 0;
    for (double step = value / 2; step > value / 1000; step /= 2) {
      if (stays_stable(most + step)) most += step;
    }
    throw ScenarioError(
        Join(name, ".haptic_controller.", key, ": expected at most ",
             std::floor(100 * most) / 100, ", as with ", kGainMargin,
             " times more the force loop of a device of ", device.device_mass,
             " kg (device.device_mass) in a hand of ", device.hand_mass,
             " kg swings, got ", value));
  };
  if (!settles(kGainMargin * gain, 0)) {
    refuse("force_gain", gain,
           [&](double value) { return settles(kGainMargin * value, 0); });
  }
  if (!settles(gain, kGainMargin * integral_gain)) {
    refuse("force_integral_gain", integral_gain,
           [&](double value) { return settles(gain, kGainMargin * value); });
  }
}

// A filter whose thresholds lie within the sensor's noise sees contacts in it.
void Scenario::CheckAgainstNoise(const std::string& section,
                                 const ForceSpaceParticleFilterParams& params,
                                 double noise) const {
  const double samples = std::max(1.0, params.period / sensor.period);
  const double mean_noise = noise / std::sqrt(samples);
  // Rounded: 3 x 0.2 is a bit more than 0.6.
  const double least = std::round(kNoiseMargin * mean_noise * 1e9) / 1e9;
  const auto check = [&](const char* key, double threshold) {
    if (threshold >= least) return;
    throw ScenarioError(
        Join(name, ".", section, ".", key, ": expected at least ", kNoiseMargin,
             " times the sensor's noise, averaged over the filter's period (",
             least, "), got ", threshold));
  };
  if (params.likelihood == Likelihood::kPaper) {
    check("update_thresholds.force_high", params.update_thresholds.force_high);
    check("resampling_thresholds.force_high",
          params.resampling_thresholds.force_high);
  } else {
    check("friction_cone.contact_force", params.friction_cone.contact_force);
  }
}

void Scenario::CheckWaypoints() const {
  const std::string path = name + ".operator.waypoints";
  const std::vector<Waypoint>& points = operator_params.waypoints;
  if (points.size() < 2) {
    throw ScenarioError(Join(path,
                             ": expected at least two (or operator.recording)",
                             ", got ", points.size()));
  }
  if (points[0].time != 0.0) {
    throw ScenarioError(
        Join(path, "[0].time: expected 0, got ", points[0].time));
  }
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (points[i].time <= points[i - 1].time) {
      throw ScenarioError(
          Join(path, "[", i, "].time: expected more than the one before (",
               points[i - 1].time, " s), got ", points[i].time));
    }
  }
  const OperatorPathParams motion = CalcOperatorPath();
  const Eigen::VectorX<bool> reachable = Reachable(motion.points);
  for (int i = 0; i < reachable.size(); ++i) {
    if (reachable(i)) continue;
    const auto p = motion.points.col(i);
    throw ScenarioError(Join(
        path, "[", i,
        "].position: expected a place that the device reaches "
        "(scene.start_position is the middle of its workspace, map.scale its "
        "size), got [",
        p.x(), ", ", p.y(), ", ", p.z(), "]"));
  }
}

Eigen::VectorX<bool> Scenario::Reachable(
    const Eigen::Ref<const Eigen::Matrix3Xd>& points) const {
  const double radius = kReach * device.workspace_radius;
  const double half_length = kReach * device.workspace_half_length;
  Eigen::VectorX<bool> result(points.cols());
  for (int i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d p = points.col(i);
    const Eigen::Vector3d x_h = map.R_DB * (p - map.p_cw) / map.scale;
    result(i) = std::hypot(x_h.y(), x_h.z()) <= radius &&
                std::abs(x_h.x()) <= half_length;
  }
  return result;
}

OperatorPathParams Scenario::CalcOperatorPath() const {
  if (!operator_params.recording.empty()) return CalcRecordedMotion().path;
  const std::vector<Waypoint>& points = operator_params.waypoints;
  const auto count = static_cast<Eigen::Index>(points.size());
  OperatorPathParams path{.times = Eigen::VectorXd(count),
                          .points = Eigen::Matrix3Xd(3, count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    path.times(i) = points[i].time;
    path.points.col(i) = points[i].position;
  }
  const bool rotates = std::any_of(
      points.begin(), points.end(),
      [](const Waypoint& point) { return !point.rotation.isZero(0); });
  if (rotates) {
    path.rotations.resize(3, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      path.rotations.col(i) = points[i].rotation;
    }
  }
  return path;
}

PlacedRecording Scenario::CalcRecordedMotion() const {
  const OperatorParams& params = operator_params;
  const auto reachable = [this](const Eigen::Matrix3Xd& points) {
    return Reachable(points).all();
  };
  try {
    return PlaceRecording(
        ReadRecording(params.recording, params.recording_units,
                      params.recording_scale),
        scene.start_position, scene.contact_height(), params.press_depth,
        reachable);
  } catch (const std::invalid_argument& error) {
    throw ScenarioError(error.what());
  }
}

std::uint64_t Scenario::CalcSeed(Stream stream) const {
  return SplitSeed(static_cast<std::uint64_t>(seed),
                   static_cast<std::uint64_t>(stream));
}

double Scenario::CalcRunDuration() const {
  double result = duration;
  if (extend_for_delay) {
    const OperatorPathParams path = CalcOperatorPath();
    const double needed =
        path.times(path.times.size() - 1) + 3.0 * link.delay() + 2.0;
    // Rounded up to whole milliseconds, free of floating-point dust.
    const double milliseconds = std::ceil(std::round(needed * 1e9) / 1e6);
    result = std::max(result, milliseconds / 1e3);
  }
  // The last period belongs to it: 2300 x 0.001 s is a bit more than 2.3 s.
  const double last = control_period * std::round(result / control_period);
  return std::abs(last - result) < 1e-9 ? std::max(result, last) : result;
}

}  // namespace dual_proxy
