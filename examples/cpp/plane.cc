// SPDX-License-Identifier: BSD-3-Clause
// Runs a scenario natively and writes metrics.json, as `dual-proxy run` does:
//
//     plane examples/scenarios/plane.yaml OUT_DIR [DELAY_S]
#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>

#include <drake/systems/analysis/simulator.h>
#include <drake/systems/framework/diagram_builder.h>

#include "dual_proxy/experiment/metrics.h"
#include "dual_proxy/experiment/scenario_error.h"
#include "dual_proxy/station/teleop_station.h"

namespace {

int Run(const std::string& scenario_path, const std::string& out_dir,
        const std::string& delay) {
  dual_proxy::Scenario scenario = dual_proxy::LoadScenario(scenario_path);
  if (!delay.empty()) scenario.link.channel.delay = std::stod(delay);

  drake::systems::DiagramBuilder<double> builder;
  const dual_proxy::TeleopStation station =
      dual_proxy::AddTeleopStation(&builder, scenario);
  const auto diagram = builder.Build();
  drake::systems::Simulator<double> simulator(*diagram);
  simulator.Initialize();

  const double end = scenario.CalcRunDuration();
  const auto store = MakeRunLogStore(station, end);

  const dual_proxy::MetricsParams params = MakeMetricsParams(scenario);

  const auto begin = std::chrono::steady_clock::now();
  for (double time = 0; time < end;) {
    time = std::min(time + 1.0, end);
    simulator.AdvanceTo(time);
    MoveLog(station, &simulator.get_mutable_context(), store.get());
  }
  const std::chrono::duration<double> wall =
      std::chrono::steady_clock::now() - begin;

  const dual_proxy::RunLog log = MakeRunLog(store, station.signals);
  const dual_proxy::Metrics metrics =
      dual_proxy::ComputeMetrics(log, params, wall.count());
  std::filesystem::create_directories(out_dir);
  std::ofstream file(out_dir + "/metrics.json");
  file << dual_proxy::MetricsJson(metrics);
  if (!file.flush()) {
    throw std::runtime_error("cannot write " + out_dir + "/metrics.json");
  }
  for (const std::string& text :
       dual_proxy::DescribeBrokenLimits(log, params)) {
    std::cerr << "limit of the arm broken: " << text << "\n";
  }
  bool failed = false;
  for (const std::string& key : dual_proxy::FindMetricsOut(metrics)) {
    if (key != "finite" && key != "sensor_ready" && key != "limits_broken") {
      continue;
    }
    std::cerr << "the run failed, see " << key << " in metrics.json\n";
    failed = true;
  }
  return failed ? 3 : 0;
}

}  // namespace

int main(int argc, char* argv[]) {
  if (argc != 3 && argc != 4) {
    std::cerr << "usage: plane SCENARIO.yaml OUT_DIR [DELAY_S]\n";
    return 2;
  }
  try {
    return Run(argv[1], argv[2], argc == 4 ? argv[3] : "");
  } catch (const dual_proxy::ScenarioError& error) {
    std::cerr << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 3;
  }
}
