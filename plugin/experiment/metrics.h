// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/arm_limits.h"
#include "dual_proxy/experiment/run_log.h"
#include "dual_proxy/proxy/workspace_map.h"

namespace dual_proxy {

/** @file
What a run is judged by, from its log and a few values of its scenario.

All truth comes from the simulator's contacts, never from the filter. The
*interaction* is the time with a true contact force above 0.5 N; true free
directions are those orthogonal to the true contact normal. The *hand presses*
while its intended position lies beyond the surface that was touched last.
*Steady contact* runs from first contact + 3 x delay + 1 s until the hand begins
to lift; where the hand presses several times, each time counts, and where
another surface is touched for a second or more, or no more, it begins anew.

Any true contact counts, however light, where it is about its absence. The robot
is *in the air* while there is none, and was none in the 0.1 s before: a filter
may take that long to let go. The hand learns of it one delay later, and what it
feels then fades at a limited rate: the hand is *in the air* from 2 x delay +
1 s after the last true contact. What was true at the start of a run, no
contact, counts as having been so for long.

A force *swings* by what it goes to and fro while the hand does not: its RMS
about the nearest course (least squares) that only rises or only falls. That
takes away where it has been led and how slowly it settles, and leaves
oscillations of any period of which the stretch that is looked at has one or
more. Such a stretch is 1 s or longer, in it the hand's intended position rests
(moves slower than 1 mm/s, in the robot's scale), and neither is the link lost
nor has a planner taken directions over, nor was so in the 3 x delay + 1 s
before. In steady contact that is judged along the true normal: the hand may
slide meanwhile. In the air the hand has to rest altogether, as drag follows its
motion. */

/** What a metric means. */
struct MetricDescription {
  const char* key;
  const char* unit;  ///< Empty if it has none.
  const char* description;
  bool is_number{true};  ///< False of flags and of names.
};

/** Every metric, in order: the keys of metrics.json. */
std::span<const MetricDescription> MetricDescriptions();

/** Those of the angular filter, which follow where it ran. */
std::span<const MetricDescription> AngularMetricDescriptions();

/** The range in which a metric is as it should be. */
struct MetricLimit {
  const char* key;
  double least;  ///< -infinity if there is no such bound.
  double most;   ///< Infinity if there is no such bound.
  /** True: a limit of the arm; a run that breaks it has failed. False: what a
  good run of a sound scheme keeps to. */
  bool of_arm;
};

/** The range of each metric that has one, in the metrics' order. */
std::vector<MetricLimit> MetricLimits(const ArmLimits<7>& arm = {});

/** A metric that cannot be given is std::monostate (null in JSON): there was
no contact, or a value that it needs is not finite. `finite` says whether the
latter happened. Names are those of the limits that were broken. */
using MetricValue = std::variant<std::monostate, bool, std::int64_t, double,
                                 std::vector<std::string>>;

/** Key and value of each of MetricDescriptions(), in its order, and with the
angular filter of AngularMetricDescriptions(). */
using Metrics = std::vector<std::pair<std::string, MetricValue>>;

/** What metrics need to know of a scenario. */
struct MetricsParams {
  /** Between the device's and the robot's workspace. */
  WorkspaceMapParams map{};
  /** One-way delay of the link, s, >= 0. */
  double delay{0};
  /** What the run must not exceed. */
  ArmLimits<7> arm{};
  /** s, > 0. */
  double control_period{0.001};
  /** PlacedRecording::scale, if the operator followed a recording. */
  std::optional<double> recording_scale{};

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;
};

/** Computes every metric.
@param log of any length, with the signals `hand_position`, `device_position`,
  `device_force`, `robot_position`, `reference_force`, `sensed_force`,
  `contact_force`, `contact_normal`, `contact_dimension`,
  `contact_motion_axis`, `dimension`,
  `force_direction`, `force_selection`, `observed_energy`, `robot_link_dropped`
  and `haptic_link_dropped`; with the angular filter `moment_dimension`,
  `moment_selection`, `contact_moment_dimension` and `contact_rotation_axis`,
  too. A limit of the arm is measured if its signals are there (see
  CheckArmLimits()).
@param wall_s how long the run took, s, if that is known.
@throws std::invalid_argument if `log` or `params` is invalid. */
Metrics ComputeMetrics(const RunLog& log, const MetricsParams& params,
                       std::optional<double> wall_s = {});

/** Where each limit of the arm that a run broke was broken most: "joint 4 speed
2.31 rad/s at 3.214 s (limit 2.175)". */
std::vector<std::string> DescribeBrokenLimits(const RunLog& log,
                                              const MetricsParams& params);

/** The keys of the metrics that are not as they should be: out of their limits,
not `finite`, `limits_broken`. What cannot be given is not among them. */
std::vector<std::string> FindMetricsOut(const Metrics& metrics,
                                        const ArmLimits<7>& arm = {});

/** The text of metrics.json. */
std::string MetricsJson(const Metrics& metrics);

/** The angle between estimated and true normal at each row of a log: deg, in
[0, 90], NaN where there is no true contact or no estimate. With two true
normals or more it is that between their resultant and the estimated force
space. */
Eigen::VectorXd CalcNormalErrorDeg(const RunLog& log);

/** Maps device positions, one per row, m, in D, to the robot, in B, eq. (1). */
Eigen::MatrixX3d MapDevicePositions(
    const WorkspaceMapParams& map,
    const Eigen::Ref<const Eigen::MatrixX3d>& x_D);

}  // namespace dual_proxy
