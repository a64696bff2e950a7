// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/perception/force_space_particle_filter.h"

namespace dual_proxy {

/** What a trial's tool does; on the way there are free space, touching,
pressing still, sliding and lifting. */
enum class FilterTrialScene {
  kFree,         ///< Moves about and touches nothing.
  kPlane,        ///< Presses and slides a triangle on a plane.
  kCylinder,     ///< Slides across a cylinder of radius 0.1 m, at some angle.
  kInnerCorner,  ///< Floor, into a wall, along the corner, off one of the two.
  kStepEdge,     ///< Floor, into a step's side, up it, over the edge, its top.
  kStill,        ///< Presses on a plane without moving.
  kGrazing,      ///< Skims a plane fast and with little force.
  kSoft,         ///< Sinks slowly into a soft plane, then slides.
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
      {FilterTrialScene::kSoft, "soft"}};
};

/** Where a trial's inputs come from. */
enum class FilterTrialDrive {
  /** The point robot, controlled with the selections of the filter on trial. */
  kClosedLoop,
  /** The point robot, controlled with the true selections, 20 ms late. */
  kTrueSelection,
  /** No dynamics: the tool is where the path meets the surfaces. */
  kKinematic,
};

template <>
struct EnumStrings<FilterTrialDrive> {
  static constexpr std::pair<FilterTrialDrive, const char*> kValues[] = {
      {FilterTrialDrive::kClosedLoop, "closed_loop"},
      {FilterTrialDrive::kTrueSelection, "true_selection"},
      {FilterTrialDrive::kKinematic, "kinematic"}};
};

/** Parameters of RunFilterTrial(). What is not here, `seed` varies: the scene's
orientation, the path, stiffness of contact and controller, the tool's radius.
*/
struct FilterTrialParams {
  FilterTrialScene scene{FilterTrialScene::kPlane};
  FilterTrialDrive drive{FilterTrialDrive::kClosedLoop};
  double friction{0.3};          ///< mu, 0 to 2: static and kinetic.
  double speed{0.05};            ///< m/s, > 0: of sliding.
  double force{6};               ///< N, > 0: of pressing.
  double force_noise{0.2};       ///< N, >= 0: std per axis, of every update.
  double velocity_noise{0.0005};  ///< m/s, >= 0: likewise.
  double hold_time{0.7};         ///< s, >= 0: of pressing still.
  std::uint64_t seed{0};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "FilterTrialParams", "scene", &scene);
    VisitEnum(a, "FilterTrialParams", "drive", &drive);
    a->Visit(MakeNameValue("friction", &friction));
    a->Visit(MakeNameValue("speed", &speed));
    a->Visit(MakeNameValue("force", &force));
    a->Visit(MakeNameValue("force_noise", &force_noise));
    a->Visit(MakeNameValue("velocity_noise", &velocity_noise));
    a->Visit(MakeNameValue("hold_time", &hold_time));
    a->Visit(MakeNameValue("seed", &seed));
  }
};

/** One update of a trial: the filter's inputs, its result, and the truth at the
end of the period. */
struct FilterTrialSample {
  double time{0};  ///< s.
  Eigen::Vector3d sensed_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};
  Eigen::Vector3d motion_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d contact_force{Eigen::Vector3d::Zero()};
  int dimension{0};                  ///< The filter's.
  Eigen::Matrix3d singular_vectors{Eigen::Matrix3d::Zero()};  ///< The filter's.
  int true_dimension{0};
  Eigen::Vector3d true_force{Eigen::Vector3d::Zero()};   ///< N: of contact.
  Eigen::Vector3d true_normal{Eigen::Vector3d::Zero()};  ///< Resultant of normal forces, unit or zero.
  /** Dimension 1: as true_normal; 2: of the free axis; else zero. */
  Eigen::Vector3d true_axis{Eigen::Vector3d::Zero()};
  /** rad: between the filter's axis (U1, or U3 at dimension 2) and the true one
  where the dimensions agree; else between true_normal and the force space; NaN
  where one of the two has no contact. */
  double direction_error{0};
};

/** Runs `filter` from its initial state along a trial.
@throws std::invalid_argument if `params` is invalid. */
std::vector<FilterTrialSample> RunFilterTrial(
    const FilterTrialParams& params, const ForceSpaceParticleFilter& filter,
    std::uint64_t filter_seed);

/** What the samples of one or more trials come to; times in s, angles in deg.
Contact counts from a true force of 0.5 N. */
struct FilterTrialMetrics {
  std::int64_t contact_samples{0};
  std::int64_t right_dimension_samples{0};
  std::vector<double> direction_error;
  std::vector<double> axis_error;          ///< Of these, at dimension 2.
  std::vector<double> detection_latency;   ///< Onset to dimension > 0.
  std::vector<double> loss_latency;        ///< End to dimension 0.
  std::vector<double> second_latency;      ///< Second wall to dimension 2.
  std::int64_t false_contact_samples{0};   ///< While never touched before.
  std::int64_t samples{0};

  /** Adds a trial of samples `period` (s) apart. */
  void Add(const std::vector<FilterTrialSample>& samples, double period);
};

}  // namespace dual_proxy
