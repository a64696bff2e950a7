// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** What a planner on the robot's side asks for in one cycle, in B. What of it
lies in directions that it does not own does not count. */
struct PlannerReference {
  /** Omega_p, an orthogonal projection: the directions that the planner owns.
  Zero: none; identity: all of the tool point's reference. */
  Eigen::Matrix3d selection{Eigen::Matrix3d::Zero()};
  /** m, m/s: where the tool point is to be now, where motion is controlled. */
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};
  /** N: what the robot is to exert on its environment, where force is
  controlled. */
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};
};

/** Parameters of LocalPlanner. */
struct LocalPlannerParams {
  std::vector<Eigen::Vector2d> active{};
  std::vector<Eigen::Vector3d> directions{};
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d scan_amplitude{Eigen::Vector3d::Zero()};
  double scan_frequency{0.5};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("active", &active,
                   "[start, end] each, s: when the planner has the directions; "
                   "none: never"));
    a->Visit(Field("directions", &directions,
                   "vectors in B of any length: the planner owns what they "
                   "span"));
    a->Visit(Field("force", &force, Finite(), "N",
                   "on the environment, in B, where force is controlled"));
    a->Visit(Field("scan_amplitude", &scan_amplitude, Between(-1, 1), "m",
                   "in B: of a sinusoid about where the tool was, where motion "
                   "is controlled"));
    a->Visit(Field("scan_frequency", &scan_frequency, Between(0, 100), "Hz",
                   "of the sinusoid"));
  }
};

/** Memory of LocalPlanner. */
struct LocalPlannerState {
  PlannerReference output;  ///< Of the last cycle.
  double start{0};          ///< s: when the planner last took over.
  Eigen::Vector3d origin{Eigen::Vector3d::Zero()};  ///< m: the tool, then.
};

/** A planner for scenarios: at set times it takes directions over, keeps a
constant force where there is contact, and elsewhere moves the tool to and fro
about where that was. */
class LocalPlanner {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit LocalPlanner(LocalPlannerParams params = {});

  const LocalPlannerParams& params() const { return params_; }

  /** Whether it ever does anything. */
  bool enabled() const { return !params_.active.empty(); }

  LocalPlannerState MakeState() const { return {}; }

  /** Advances to `time`, s; the result is state->output. No heap, no throw.
  @param p_BE  m, where the tool point is.
  @param ready  false: the planner lets go, and starts anew when it may. */
  void Update(double time, const Eigen::Vector3d& p_BE, bool ready,
              LocalPlannerState* state) const noexcept;

 private:
  LocalPlannerParams params_;
  Eigen::Matrix3d selection_;
};

}  // namespace dual_proxy
