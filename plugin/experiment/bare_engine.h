// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/experiment/run_log_store.h"
#include "dual_proxy/experiment/run_watch.h"
#include "dual_proxy/experiment/scenario.h"
#include "dual_proxy/loop/teleop_loop.h"
#include "dual_proxy/simulation/point_robot.h"
#include "dual_proxy/simulation/simulated_arm.h"

namespace dual_proxy {

/** The scene as the bare engine has it: the table and all other surfaces.
@throws ScenarioError if there is something that only Drake has. */
ContactSceneParams MakeContactSceneParams(const Scenario& scenario);

/** The arm with its tool, as the bare engine's plant. */
SimulatedArmParams MakeSimulatedArmParams(const Scenario& scenario);

/** Runs a scenario without Drake: the loop, a plant (SimulatedArm or
PointRobot), and the log. The same loop, to the bit, as in a Drake diagram; the
plant is another. */
template <typename Plant>
class BareEngine {
 public:
  using Robot = typename Plant::Robot;

  /** @param scenario  distributed and valid.
  @param model  the controller's, of the plant's robot.
  @param start  made by plant.MakeState().
  @param duration  of the run, s: room for its log is made, if it is kept.
  @param watch  what to watch; the log is then not kept.
  @throws std::system_error if there is no space for the log. */
  BareEngine(const Scenario& scenario,
             const typename Robot::Model::Params& model, Plant plant,
             typename Plant::State start, double duration,
             const std::optional<RunWatchParams>& watch = {});

  /** Runs up to the first multiple of the control period that is not before
  `time`, s, and logs every period.
  @throws std::system_error if the log cannot be written. */
  void AdvanceTo(double time) { AdvanceTo(time, nullptr); }

  /** The same, and how long each call of the loop takes, s, is added to
  `times`: what both sides, link, sensor and device need of a period.
  @returns how many pages were first touched in those calls. */
  std::int64_t AdvanceTo(double time, std::vector<double>* times);

  double time() const { return period_ * static_cast<double>(num_periods_); }

  /** What the columns of the log are. */
  const std::vector<SignalSlice>& layout() const { return layout_; }

  /** The log so far; empty if the run is watched. */
  const std::shared_ptr<RunLogStore>& log() const { return log_; }

  /** What was watched so far. */
  std::vector<WatchedValue> SummariseWatch() const {
    return watch_ ? watch_->Summarise() : std::vector<WatchedValue>{};
  }

 private:
  /** Puts what arm and device really do in place of what was measured, which
  faults have changed. */
  void PutTruth(Eigen::Ref<Eigen::VectorXd> row) const;
  void Flush();

  TeleopLoop<Robot> loop_;
  Plant plant_;
  OperatorPath path_;
  TeleopLoopState<Robot> loop_state_;
  typename Plant::State plant_state_;
  bool rotations_;
  double period_;
  std::int64_t num_periods_{0};
  std::vector<SignalSlice> layout_;
  std::shared_ptr<RunLogStore> log_;
  // Rows that are not in the log yet; watched, the first is the last that was.
  Eigen::VectorXd times_;
  Eigen::MatrixXd rows_;
  Eigen::Index num_rows_{0};
  std::int64_t num_watched_{0};
  std::optional<RunWatch> watch_;
  bool has_faults_{false};
};

/** An engine for a scenario with an arm.
@param scenario  distributed and valid.
@param arm  with the scenario's tool as a part of its last link.
@param q_start  rad.
@param duration  of the run, s.
@param watch  as BareEngine().
@throws ScenarioError if it needs Drake, and as BareEngine(). */
BareEngine<SimulatedArm<7>> MakeArmEngine(
    const Scenario& scenario, const ArmModelParams<7>& arm,
    const Vector7& q_start, double duration,
    const std::optional<RunWatchParams>& watch = {});

/** Likewise for one with a point mass, which starts at scene.start_position. */
BareEngine<PointRobot> MakePointMassEngine(
    const Scenario& scenario, double duration,
    const std::optional<RunWatchParams>& watch = {});

/** What is watched of a scenario's run.
@param rest_time  s: how long before the end all should be at rest. */
RunWatchParams MakeRunWatchParams(const Scenario& scenario, double duration,
                                  double rest_time);

}  // namespace dual_proxy
