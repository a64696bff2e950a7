// SPDX-License-Identifier: BSD-3-Clause

// How a force loop whose torques act late holds a contact: RobotCycle with the
// hardware's defaults, in lockstep with a simulated arm. Prints the grid.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/drivers/hardware_defaults.h"
#include "dual_proxy/drivers/robot_cycle.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/simulation/simulated_arm.h"
#include "test_arm.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

constexpr double kPeriod = 0.001;
constexpr double kToolRadius = 0.01;
constexpr double kGap = 0.002;    // m: from where the tool starts.
constexpr double kPress = 0.012;  // m: 6 N at 500 N/m.
constexpr int kTareSteps = 100;
constexpr int kSettleSteps = 1200;
constexpr int kSteps = 1700;
constexpr double kSteady = 0.2;  // N: largest AC.

const Vector3d kSensorToTool{0, 0, 0.1};

RobotCycleParams MakeParams(double force_gain) {
  RobotCycleParams params;
  params.model = MakeTestArm();
  params.side.controller.q_rest = kTestArmAtRest;
  params.side.proxy.map.scale = 1;
  params.side.perception.filter.period = 0.01;
  params.side = MakeHardwareDefaults(params.side);
  params.side.controller.force_gain = force_gain;
  params.sensor.tool_mass = 0.5;
  params.sensor.tool_com = Vector3d(0, 0, 0.05);
  params.sensor.tare = true;
  params.sensor.tare_time = 0.05;
  params.p_SE = kSensorToTool;
  return params;
}

/** RobotCycle and the arm that it presses on a table, in lockstep. */
class Pressing {
 public:
  /** @param delay  periods from computing a torque to its acting. */
  Pressing(const RobotCycle& cycle, int delay, double stiffness)
      : cycle_(cycle),
        arm_(MakeArm(stiffness)),
        plant_(arm_.MakeState(kTestArmAtRest)),
        state_(cycle.MakeState()),
        late_(static_cast<std::size_t>(delay), Vector7::Zero()) {
    // At rest, but for the first step's reaction.
    arm_.Update(-plant_.terms.gravity, &plant_);
    input_.received_torque = Vector7::Zero();
  }

  /** @param hold  whether the arm is asked to hold its place. */
  void Step(bool hold = false) {
    const double time = kPeriod * step_;
    if (step_ % 20 == 0) {
      const double share = std::clamp((step_ - kTareSteps) / 200.0, 0.0, 1.0);
      input_.message = ToMessage(
          PoseMessage{.sequence = step_ / 20,
                      .send_time = time,
                      .pose = {.p = Vector3d(0, 0, -share * (kGap + kPress))}});
    }
    ++step_;
    input_.q = plant_.q;
    input_.v = plant_.v;
    input_.hold = hold;
    input_.sensor = {.time = time, .valid = true, .value = plant_.reaction};
    cycle_.Update(time, input_, &state_);
    input_.received_torque = state_.torque();
    late_.push_back(state_.torque());
    arm_.Update(late_.front() - plant_.terms.gravity, &plant_);
    late_.pop_front();
  }

  /** N: of the tool on the table. */
  double force() const { return -plant_.truth.force().z(); }
  const Vector3d& position() const { return plant_.X_BE.p; }
  const RobotSetpoint& setpoint() const { return state_.side.output.setpoint; }

 private:
  static SimulatedArm<7> MakeArm(double stiffness) {
    SimulatedArmParams params;
    params.time_step = kPeriod / 4;
    params.p_SE = kSensorToTool;
    params.tool_mass = 0.5;
    params.tool_com = Vector3d(0, 0, 0.05);
    const Pose start =
        SimulatedArm<7>({}, MakeTestArm()).MakeState(kTestArmAtRest).X_BE;
    ContactSurfaceParams table;
    table.position = start.p - Vector3d(0, 0, kGap + kToolRadius);
    table.stiffness = stiffness;
    table.dissipation = 2;
    return SimulatedArm<7>(params, MakeTestArm(),
                           {.surfaces = {table}, .tool_radius = kToolRadius});
  }

  const RobotCycle& cycle_;
  const SimulatedArm<7> arm_;
  SimulatedArmState<7> plant_;
  RobotCycleState state_;
  RobotCycleInput input_;
  std::deque<Vector7> late_;
  int step_{0};
};

struct Contact {
  double mean{0};  // N
  double ac{0};    // N: standard deviation.
};

Contact Press(const RobotCycle& cycle, int delay, double stiffness) {
  Pressing pressing(cycle, delay, stiffness);
  std::vector<double> forces;
  for (int i = 0; i < kSteps; ++i) {
    pressing.Step();
    if (i >= kSettleSteps) forces.push_back(pressing.force());
  }
  const Eigen::Map<Eigen::ArrayXd> all(forces.data(), std::ssize(forces));
  return {.mean = all.mean(),
          .ac = std::sqrt((all - all.mean()).square().mean())};
}

TEST(HardwareStabilityTest, DefaultsAreSteadyUpToThreePeriodsAnd100kNm) {
  const double gains[] = {0.25, 0.5, 1, 2.5};
  const double stiffnesses[] = {1e4, 3e4, 1e5, 3e5};
  const double hardware = MakeHardwareDefaults().controller.force_gain;
  std::printf("AC of the contact's force, N (mean %g N wanted)\n",
              500 * kPress);
  for (const double gain : gains) {
    const RobotCycle cycle(MakeParams(gain));
    std::printf(
        "force_gain %g\n  kN/m  delay: 0      1      2      3      4"
        "      5      6 periods\n",
        gain);
    for (const double stiffness : stiffnesses) {
      std::printf("%6g      ", stiffness / 1000);
      for (int delay = 0; delay <= 6; ++delay) {
        const Contact contact = Press(cycle, delay, stiffness);
        std::printf(" %6.3f", contact.ac);
        if (gain == hardware && delay <= 3 && stiffness <= 1e5) {
          EXPECT_LT(contact.ac, kSteady) << delay << " " << stiffness;
          EXPECT_NEAR(contact.mean, 500 * kPress, 0.5)
              << delay << " " << stiffness;
        }
        // Simulations' own gain, where the hardware's is steady.
        if (gain == 2.5 && delay == 3 && stiffness == 1e5) {
          EXPECT_GT(contact.ac, kSteady);
        }
      }
      std::printf("\n");
    }
  }
}

// The filter goes on saying that there is a surface, as it did when the arm
// pressed; what is left of the force is what the sensor is wrong by.
TEST(HardwareStabilityTest, AnArmThatHoldsAfterContactStaysWhereItIs) {
  const RobotCycle cycle(MakeParams(0.5));
  Pressing pressing(cycle, 2, 3e4);
  for (int i = 0; i < kSettleSteps; ++i) pressing.Step();
  EXPECT_GT(pressing.setpoint().force_selection(2, 2), 0.9);
  for (int i = 0; i < 500; ++i) pressing.Step(true);
  const Vector3d held = pressing.position();
  double largest = 0;
  for (int i = 0; i < 4000; ++i) {
    pressing.Step(true);
    largest = std::max(largest, (pressing.position() - held).norm());
  }
  EXPECT_LT(largest, 5e-5);
}

TEST(HardwareDefaultsTest, ChangeWhatIsOfHardwareAlone) {
  RobotSideParams<SerialArm<7>> side;
  side.proxy.max_force = 7;
  side.controller.moment_gain = 0.2;
  const RobotSideParams<SerialArm<7>> dut = MakeHardwareDefaults(side);
  EXPECT_EQ(dut.proxy.max_force, 7);
  EXPECT_EQ(dut.controller.moment_gain, 0.2);
  EXPECT_EQ(dut.controller.force_gain, 0.5);
  EXPECT_EQ(dut.controller.force_passivity.actuation_delay, 3);
  EXPECT_EQ(dut.controller.moment_passivity.actuation_delay, 3);
  EXPECT_FALSE(dut.controller.acceleration_feed_forward);
  EXPECT_TRUE(dut.controller.feed_forward);
  EXPECT_FALSE(dut.controller.gravity_compensation);
  EXPECT_TRUE(dut.proxy.reclutch);
}

TEST(HardwareDefaultsTest, ASchemeWhoseRobotTravelsIsRefused) {
  for (const auto& [scheme, name] : EnumStrings<Scheme>::kValues) {
    RobotSideParams<SerialArm<7>> side;
    side.scheme = scheme;
    const RobotSideParams<SerialArm<7>> dut = MakeHardwareDefaults(side);
    if (Reclutches(scheme)) {
      EXPECT_NO_THROW(dut.Validate()) << name;
    } else {
      EXPECT_THROW(dut.Validate(), std::invalid_argument) << name;
    }
  }
}

}  // namespace
}  // namespace dual_proxy
