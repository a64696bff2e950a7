// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <drake/systems/framework/context.h>
#include <drake/systems/framework/diagram_builder.h>
#include <drake/systems/primitives/vector_log_sink.h>

#include "dual_proxy/common/signal_layout.h"
#include "dual_proxy/experiment/metrics.h"
#include "dual_proxy/experiment/run_log.h"
#include "dual_proxy/experiment/run_log_store.h"
#include "dual_proxy/experiment/scenario.h"
#include "dual_proxy/simulation/operator.h"
#include "dual_proxy/station/panda.h"

namespace dual_proxy {

/** Reads a scenario from a YAML file with one top-level key, its name, as
`dual-proxy run` does (see Scenario).
@throws std::exception naming file and field if the file cannot be read, has an
unknown key, or a value is of the wrong type or out of range. */
Scenario LoadScenario(const std::string& path);

/** What AddTeleopStation() added, and what is needed to read its log. */
struct TeleopStation {
  PandaScene scene;
  /** Notes one row per control period, all in memory until MoveLog(). */
  const drake::systems::VectorLogSink<double>* log{};
  /** Where in a row of the run's log a signal is; the first columns are those
  of `log`. */
  std::vector<SignalSlice> signals;
  /** In a row of the run's log. */
  int num_columns{0};
  /** Between two rows, s. */
  double log_period{0};
  /** Where the operator means the handle to be, in D. */
  OperatorPath path;
};

/** How a station is wired; both give the same bits. */
enum class Wiring {
  kFused,    ///< All but the arm is one system: fast.
  kSystems,  ///< Systems to look at, to change and to replace.
};

/** Adds all of a scenario to a diagram; nothing here is control.

    kFused:                 loop <-> panda
    kSystems: haptic_side -> to_robot -> robot_side <-> panda
              haptic_side <- to_device <- robot_side

The systems have the names of the picture, and the diagram's outputs are
`robot_state` (14), `sensed_wrench` (6), `torque` (7), `device_pose`,
`device_wrench` (6), with a scheme that uses them `force_selection` (9) and
`dimension` (1), and with the angular filter `moment_selection` (9) and
`moment_dimension` (1). The same as dual_proxy.station in Python, and the same
bits.
@throws std::exception if the scenario is not valid, or no posture of the arm
reaches the start. */
TeleopStation AddTeleopStation(drake::systems::DiagramBuilder<double>* builder,
                               const Scenario& scenario,
                               Wiring wiring = Wiring::kFused);

/** Room for the log of a run.
@param duration of the run, s, >= 0.
@throws std::system_error if there is no space for it. */
std::shared_ptr<RunLogStore> MakeRunLogStore(const TeleopStation& station,
                                             double duration);

/** Moves what was logged so far to `store`, so that the memory of a run does
not grow with its length. A second's rows at a time are a good measure.
@param context of the diagram that `station` is part of.
@throws std::exception if the rows do not go into the store, see
RunLogStore::Append(); they are forgotten all the same. */
void MoveLog(const TeleopStation& station,
             drake::systems::Context<double>* context, RunLogStore* store);

/** The log so far, for ComputeMetrics(), of a run that is not moved elsewhere.
@param context of the diagram that `station` is part of. */
RunLog MakeRunLog(const TeleopStation& station,
                  const drake::systems::Context<double>& context);

/** What ComputeMetrics() needs to know of a scenario. */
MetricsParams MakeMetricsParams(const Scenario& scenario);

}  // namespace dual_proxy
