// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/perception/force_space_particle_filter.h"

/** @file
Trials of the force-space particle filter: a simulated tool moves over analytic
surfaces, the filter gets what a controller would give it, and its result is
kept beside the truth. */

namespace dual_proxy {

/** What a trial's tool does; on the way there are free space, touching,
pressing still, sliding and lifting. */
enum class FilterTrialScene {
  kFree,         ///< Moves about and touches nothing.
  kPlane,        ///< Presses and slides a triangle on a plane.
  kCylinder,     ///< Slides across a cylinder of radius 0.1 m, at some angle.
  kInnerCorner,  ///< Floor, into a wall, along the corner, off one of the two.
  kStepEdge,     ///< Floor, into a step's side, up it, over its edge, its top.
  kStill,        ///< Presses on a plane without moving.
  kGrazing,      ///< Skims a plane fast and with little force.
  kSoft,         ///< Sinks slowly into a soft plane, then slides.
  kPulled,       ///< Presses on a plane, pulled aside less than friction holds.
  /** At rest in a corner while the forces on floor and wall change between 4
  and 18 N; then along it. */
  kPressedCorner,
  kWallAtRest,  ///< Slides on a floor, rests beside a wall, and presses it.
  kGroove,      ///< Down one side of a V of 60 to 90 degrees, and along it.
  kSlot,        ///< A floor between walls 1 mm wider than the tool, by turns.
  /** Along a bore 1 mm wider than the tool, all around it; not kKinematic. */
  kBore,
  kChamfer,  ///< A floor, up a slope of 30 to 45 degrees, and back.
};

template <>
struct EnumStrings<FilterTrialScene> {
  static constexpr std::pair<FilterTrialScene, const char*> kValues[] = {
      {FilterTrialScene::kFree, "free"},
      {FilterTrialScene::kPlane, "plane"},
      {FilterTrialScene::kCylinder, "cylinder"},
      {FilterTrialScene::kInnerCorner, "inner_corner"},
      {FilterTrialScene::kStepEdge, "step_edge"},
      {FilterTrialScene::kStill, "still"},
      {FilterTrialScene::kGrazing, "grazing"},
      {FilterTrialScene::kSoft, "soft"},
      {FilterTrialScene::kPulled, "pulled"},
      {FilterTrialScene::kPressedCorner, "pressed_corner"},
      {FilterTrialScene::kWallAtRest, "wall_at_rest"},
      {FilterTrialScene::kGroove, "groove"},
      {FilterTrialScene::kSlot, "slot"},
      {FilterTrialScene::kBore, "bore"},
      {FilterTrialScene::kChamfer, "chamfer"}};
};

/** Where a trial's inputs come from. */
enum class FilterTrialDrive {
  /** The point robot, controlled with the selections of the filter on trial. */
  kClosedLoop,
  /** The point robot, controlled with the true selections, 20 ms late. */
  kTrueSelection,
  /** No dynamics: the tool is where the path meets the surfaces. */
  kKinematic,
  /** No inertia: the spring to the path is in balance with surfaces that give
  and friction that sticks. The filter on trial splits its force in commands,
  but does not change the motion. */
  kQuasiStatic,
};

template <>
struct EnumStrings<FilterTrialDrive> {
  static constexpr std::pair<FilterTrialDrive, const char*> kValues[] = {
      {FilterTrialDrive::kClosedLoop, "closed_loop"},
      {FilterTrialDrive::kTrueSelection, "true_selection"},
      {FilterTrialDrive::kKinematic, "kinematic"},
      {FilterTrialDrive::kQuasiStatic, "quasi_static"}};
};

/** Parameters of RunFilterTrial(). `seed` decides what is not here: the scene's
orientation, details of the path, stiffness of contact and controller, the
tool's radius, the noise, the bias's direction, when there are spikes, and when
within a period the filter's first update is. */
struct FilterTrialParams {
  FilterTrialScene scene{FilterTrialScene::kPlane};
  FilterTrialDrive drive{FilterTrialDrive::kClosedLoop};
  double friction{0.3};
  double speed{0.05};
  double force{6};
  double force_noise{0.2};
  double velocity_noise{0.0005};
  double hold_time{0.7};
  std::optional<double> stiffness{};
  double stiction{0};
  double radius{0.1};
  double surface_speed{0};
  double breathing{0};
  double tool_compliance{0};
  double sensor_noise{0};
  double sensor_hum{0};
  double sensor_step{0};
  double sensor_bias{0};
  double bias_turn{0};
  double spike{0};
  std::optional<double> filter_start{};
  std::uint64_t seed{0};

  /** @throws std::invalid_argument naming the field, its range and value, or a
  drive that the scene has not. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "FilterTrialParams", "scene", &scene, "what is touched");
    VisitEnum(a, "FilterTrialParams", "drive", &drive,
              "a point robot with the filter's selections, with the true ones "
              "20 ms late, no dynamics, or none but what friction and "
              "stiffness do");
    a->Visit(Field("friction", &friction, Between(0, 2), "",
                   "mu, static and kinetic"));
    a->Visit(Field("speed", &speed, Above(0), "m/s", "of sliding"));
    a->Visit(Field("force", &force, Above(0), "N", "of pressing"));
    a->Visit(Field("force_noise", &force_noise, AtLeast(0), "N",
                   "standard deviation per axis on each update's mean"));
    a->Visit(Field("velocity_noise", &velocity_noise, AtLeast(0), "m/s",
                   "likewise"));
    a->Visit(
        Field("hold_time", &hold_time, AtLeast(0), "s", "of pressing still"));
    a->Visit(Field("stiffness", &stiffness, Between(100, 50000), "N/m",
                   "of the surfaces; without it, drawn"));
    a->Visit(Field("stiction", &stiction, Between(0, 2), "",
                   "by which mu is more at rest, with drive quasi_static: the "
                   "tool sticks and slips"));
    a->Visit(Field("radius", &radius, Above(0), "m", "of the cylinder"));
    a->Visit(Field("surface_speed", &surface_speed, AtLeast(0), "m/s",
                   "of the surfaces along the floor, as on a conveyor; in a "
                   "corner along that"));
    a->Visit(Field("breathing", &breathing, AtLeast(0), "m",
                   "amplitude of the surfaces along the floor's normal, at "
                   "0.3 Hz"));
    a->Visit(Field("tool_compliance", &tool_compliance, AtLeast(0), "m/N",
                   "of the tool beyond where its velocity is measured"));
    a->Visit(Field("sensor_noise", &sensor_noise, AtLeast(0), "N",
                   "standard deviation per axis of each sample of the force "
                   "sensor, 1 kHz"));
    a->Visit(Field("sensor_hum", &sensor_hum, AtLeast(0), "N",
                   "amplitude of the sensor's hum at 50 Hz"));
    a->Visit(Field("sensor_step", &sensor_step, AtLeast(0), "N",
                   "of the sensor's quantisation; 0 is none"));
    a->Visit(Field("sensor_bias", &sensor_bias, AtLeast(0), "N",
                   "size of the sensor's bias"));
    a->Visit(Field("bias_turn", &bias_turn, AtLeast(0), "rad/s",
                   "at which the bias turns"));
    a->Visit(Field("spike", &spike, AtLeast(0), "N",
                   "of the sensor for 2 ms, every 0.3 to 0.9 s"));
    a->Visit(Field("filter_start", &filter_start, AtLeast(0), "s",
                   "from the first contact to the filter's first period; "
                   "without it, the filter begins with the trial"));
    a->Visit(Field("seed", &seed, AtLeast(0), "", "of what is not here"));
  }
};

/** One update of a trial: the filter's inputs, its result, and the truth at the
end of the period. All in B. */
struct FilterTrialSample {
  double time{0};  ///< s: end of the period.
  /** Inputs, means over the period with their noise: N, m/s, N, N. */
  Eigen::Vector3d sensed_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};
  Eigen::Vector3d motion_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d contact_force{Eigen::Vector3d::Zero()};
  /** The filter's. */
  int dimension{0};
  Eigen::Matrix3d singular_vectors{Eigen::Matrix3d::Identity()};
  double direction_uncertainty{0};  ///< rad
  double dimension_confidence{0};
  /** Whether the tool touched anything, however briefly, in the period. */
  bool touched{false};
  int true_dimension{0};
  /** N: of the robot on the scene, with friction. */
  Eigen::Vector3d true_force{Eigen::Vector3d::Zero()};
  /** Along the sum of the normal forces: unit, INTO the surface, or zero. */
  Eigen::Vector3d true_normal{Eigen::Vector3d::Zero()};
  /** Of dimension 1 the normal, of 2 the axis of free motion; else zero. */
  Eigen::Vector3d true_axis{Eigen::Vector3d::Zero()};
  /** rad, 0 to pi/2: between the filter's axis (U1, or U3 at dimension 2) and
  the true one where the dimensions agree; else between true_normal and the
  force space; NaN where filter or truth has no contact. */
  double direction_error{0};
};

/** A true contact's time, s: from the control period at whose end its force is
first kFilterTrialContactForce to the one at whose end it is no longer, or
infinity. Gaps of less than 50 ms (bounces) are not gaps. */
struct FilterTrialInterval {
  double begin{0};
  double end{0};
};

/** N: a contact counts from here, and a second wall from this normal force. */
inline constexpr double kFilterTrialContactForce = 0.5;

/** A trial that was run. */
struct FilterTrial {
  std::vector<FilterTrialSample> samples;  ///< One per update.
  std::vector<FilterTrialInterval> contacts;
  std::vector<FilterTrialInterval> second_walls;  ///< Of true dimension >= 2.
};

/** Runs `filter` from its initial state along a trial; controls run at 1 kHz.
The same arguments give the same result, bit for bit.
@throws std::invalid_argument if `params` is invalid or the filter's period is
  below 1 ms. */
FilterTrial RunFilterTrial(const FilterTrialParams& params,
                           const ForceSpaceParticleFilter& filter,
                           std::uint64_t filter_seed);

/** What the filter's updates along a trial take, us per second of the trial:
the median of `repeats` >= 1 runs over its inputs, after one to warm up.
@throws std::invalid_argument if there is no sample or no repeat. */
double MeasureFilterCost(const FilterTrial& trial,
                         const ForceSpaceParticleFilter& filter,
                         std::uint64_t filter_seed, int repeats);

}  // namespace dual_proxy
