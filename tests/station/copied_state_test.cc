// SPDX-License-Identifier: BSD-3-Clause
// The state of a loop and its plant is a value: a copy goes on with the same
// bits, and shares nothing with the one that it was copied from. With every
// scene and every scheme.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/experiment/bare_engine.h"
#include "dual_proxy/experiment/scenario_error.h"
#include "dual_proxy/experiment/teleop_loop_params.h"
#include "dual_proxy/station/panda.h"
#include "dual_proxy/station/teleop_station.h"

namespace dual_proxy {
namespace {

constexpr double kCopyTime = 4.5;  // s; in every scene the tool touches then.
constexpr double kDuration = 0.5;  // s, from there on.

template <typename Plant>
struct Bench {
  using Robot = typename Plant::Robot;

  struct State {
    TeleopLoopState<Robot> loop;
    typename Plant::State plant;
    int num_periods{0};
  };

  /** Goes on for `duration`, s.
  @returns all signals of each period, one after the other. */
  std::vector<double> Advance(double duration, State* state) const {
    const int size = SizeOf(loop.layout());
    Eigen::VectorXd row(size);
    std::vector<double> rows;
    for (int i = 0; i < duration / loop.period(); ++i) {
      TeleopLoopInput<Robot> input;
      if constexpr (Robot::kRotates) {
        input = {.q = state->plant.q,
                 .v = state->plant.v,
                 .reaction = state->plant.reaction};
      } else {
        input = {.q = state->plant.position, .v = state->plant.velocity};
        input.reaction.template head<3>() = state->plant.contact.force;
      }
      input.has_reaction = state->num_periods > 0;
      loop.Update(state->num_periods * loop.period(), input, &state->loop);
      plant.Update(state->loop.command(), &state->plant);
      ++state->num_periods;
      loop.WriteSignals(state->loop, row);
      rows.insert(rows.end(), row.begin(), row.end());
    }
    return rows;
  }

  void CheckThatCopiesGoOnAlike(typename Plant::State start) const {
    State state{loop.MakeState(), start};
    Advance(kCopyTime, &state);
    const State kept = state;
    State copy = kept;
    const std::vector<double> theirs = Advance(kDuration, &copy);
    // Bits, but for the sign of zero: nothing here is NaN.
    const std::vector<double> rows = Advance(kDuration, &state);
    EXPECT_TRUE(theirs == rows);
    // What has gone on for longer is set back.
    state = kept;
    EXPECT_TRUE(Advance(kDuration, &state) == rows);
    EXPECT_TRUE(std::ranges::any_of(rows, [](double x) { return x != 0; }));
  }

  TeleopLoop<Robot> loop;
  Plant plant;
};

void CheckScenario(const Scenario& scenario) {
  const ContactSceneParams scene = MakeContactSceneParams(scenario);
  if (scenario.robot == RobotKind::kPointMass) {
    const Bench<PointRobot> bench{
        TeleopLoop(MakeTeleopLoopParams<PointMass>(scenario, {})),
        PointRobot(scenario.point_mass, scene)};
    bench.CheckThatCopiesGoOnAlike(
        bench.plant.MakeState(scenario.scene.start_position));
    return;
  }
  const PandaModel model(scenario.scene.tool_mass, scenario.scene.gravity);
  const Bench<SimulatedArm<7>> bench{
      TeleopLoop(
          MakeTeleopLoopParams<SerialArm<7>>(scenario, model.arm_params())),
      SimulatedArm<7>(MakeSimulatedArmParams(scenario), model.arm_params(),
                      scene)};
  bench.CheckThatCopiesGoOnAlike(
      bench.plant.MakeState(model.SolveInverseKinematics(
          scenario.map.p_cw, scenario.map.R_cw, scenario.controller.q_rest)));
}

TEST(CopiedStateTest, GoesOnWithTheSameBits) {
  const std::filesystem::path folder =
      DUAL_PROXY_SOURCE_DIR "/examples/scenarios";
  int num_scenes = 0;
  int num_refused = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    ++num_scenes;
    Schemes::ForEach([&]<typename S>() {
      SCOPED_TRACE(file.path().filename().string() + " " + S::kName);
      Scenario scenario = LoadScenario(file.path());
      if (scenario.scheme != SchemeOf<S>) {
        scenario.scheme = SchemeOf<S>;
        scenario.ApplyPresets();
      }
      try {
        scenario.Validate();
      } catch (const ScenarioError&) {
        ++num_refused;  // The scene needs what the scheme has not.
        return;
      }
      CheckScenario(scenario);
    });
  }
  EXPECT_GE(num_scenes, 9);
  EXPECT_LT(num_refused, 10);
  RecordProperty("refused", num_refused);
}

}  // namespace
}  // namespace dual_proxy
