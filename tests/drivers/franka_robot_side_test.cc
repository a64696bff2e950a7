// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/franka/franka_robot_side.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/drivers/hardware_defaults.h"
#include "dual_proxy/link/message.h"
#include "fake_franka.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Side = FrankaRobotSide<FakeFranka>;

constexpr double kPressed = -0.052;  // m: of the handle, 1:1, below its start.

RobotCycleParams MakeCycleParams() {
  RobotCycleParams params;
  params.model = MakeTestArm();
  params.side.controller.q_rest = kTestArmAtRest;
  params.side.proxy.map.scale = 1;
  params.side.proxy.limiter.max_velocity = 0.2;
  params.side.perception.filter.period = 0.01;
  params.side = MakeHardwareDefaults(params.side);
  params.sensor.tool_mass = FakeArm::kToolMass;
  params.sensor.tool_com = Vector3d(0.002, 0, 0.04);
  params.p_SE = params.model.p_LE - kPandaFlange;
  return params;
}

FrankaRobotSideParams MakeParams() {
  FrankaRobotSideParams params;
  params.load.mass = FakeArm::kToolMass;
  params.push_test = false;
  return params;
}

double Deviation(const std::vector<double>& values) {
  const Eigen::Map<const Eigen::VectorXd> all(values.data(),
                                              std::ssize(values));
  return std::sqrt((all.array() - all.mean()).square().mean());
}

class FrankaRobotSideTest : public ::testing::Test {
 protected:
  FrankaRobotSideTest() { FakeFranka::arm = &arm_; }

  void Make(const FrankaRobotSideParams& params = MakeParams(),
            const RobotCycleParams& cycle = MakeCycleParams(),
            bool has_sensor = true) {
    side_ =
        std::make_unique<Side>(params, cycle, has_sensor ? &sensor_ : nullptr,
                               [this] { return arm_.ReadClock(); });
    arm_.on_cycle = [this](std::int64_t cycle_number) {
      if (cycle_number % 20 == 0) Send();
      on_cycle_(cycle_number);
    };
  }

  // The hand: from 1 s on it goes down by `depth_`, in half a second.
  void Send() {
    const double share =
        std::clamp((arm_.time() - 100 - hand_start_) / 0.5, 0.0, 1.0);
    const double z = hand_depth_ * share;
    side_->SetMessage(
        ToMessage(PoseMessage{.sequence = ++sequence_,
                              .send_time = arm_.time() - 0.02,
                              .pose = {.p = hand_ + Vector3d(0, 0, z)}}));
  }

  // Runs until `cycles` callbacks are over, and stops.
  void RunFor(std::int64_t cycles,
              std::function<void(std::int64_t)> on_cycle = {}) {
    on_cycle_ = [=, this](std::int64_t i) {
      if (on_cycle) on_cycle(i);
      if (i == cycles) side_->Stop();
      ASSERT_LT(i, cycles + 5000) << "it did not stop";
    };
    side_->Run([this](const std::string& question) {
      question_ = question;
      EXPECT_EQ(arm_.controls, 0);
      return confirmed_;
    });
  }

  // The message of the DriverError that ends a run.
  std::string RunToError(std::int64_t cycles,
                         std::function<void(std::int64_t)> on_cycle = {}) {
    try {
      RunFor(cycles, std::move(on_cycle));
    } catch (const DriverError& e) {
      EXPECT_EQ(side_->fault(), e.what());
      EXPECT_EQ(side_->GetStatus().phase, FrankaPhase::kStopped);
      EXPECT_FALSE(sensor_.is_open);
      return e.what();
    }
    return "no error";
  }

  FakeArm arm_;
  FakeSensor sensor_{&arm_};
  std::unique_ptr<Side> side_;
  std::function<void(std::int64_t)> on_cycle_;
  std::string question_;
  bool confirmed_{true};
  std::int64_t sequence_{-1};
  Vector3d hand_{0.01, -0.02, 0.03};
  double hand_start_{1};
  double hand_depth_{0};
};

TEST_F(FrankaRobotSideTest, HoldsAContactUnderAPathOfMessages) {
  hand_depth_ = kPressed;
  Make();
  std::vector<double> forces;
  std::vector<FrankaPhase> phases;
  RunFor(6000, [&](std::int64_t i) {
    const FrankaPhase phase = side_->GetStatus().phase;
    if (phases.empty() || phases.back() != phase) phases.push_back(phase);
    // From 4 s on it slides along x.
    if (i >= 4000) hand_.x() = 0.01 + 2e-5 * static_cast<double>(i - 4000);
    if (i >= 3000 && i < 6000) forces.push_back(arm_.state().truth.force().z());
  });
  // Deeper by 22 mm than the table, of which the spring makes 500 N/m.
  const double mean = Eigen::Map<Eigen::VectorXd>(forces.data(), 1000).mean();
  EXPECT_NEAR(mean, -500 * (-kPressed - 0.03 + 0.01), 2);
  EXPECT_LT(Deviation({forces.begin(), forces.begin() + 1000}), 0.2);
  EXPECT_LT(*std::max_element(forces.begin(), forces.end()), -3);
  const FrankaStatus& status = side_->GetStatus();
  EXPECT_EQ(status.reflexes, 0);
  EXPECT_EQ(status.bad_inputs, 0);
  EXPECT_EQ(status.lost_cycles, 0);
  EXPECT_EQ(status.tares, 1);
  EXPECT_EQ(status.phase, FrankaPhase::kStopped);
  EXPECT_LT(
      (status.sensed_wrench.head<3>() - arm_.state().truth.force()).norm(),
      0.5);
  EXPECT_EQ(phases, (std::vector<FrankaPhase>{
                        FrankaPhase::kWaiting, FrankaPhase::kTaring,
                        FrankaPhase::kRunning, FrankaPhase::kStopping}));
  EXPECT_GT(side_->GetMessage().sequence, 250);
  EXPECT_EQ(arm_.allocations, 0);
  EXPECT_EQ(side_->statistics().count(), status.cycles);
  EXPECT_GT(side_->statistics().Quantile(0.5), 0);
  EXPECT_LT(side_->statistics().max(), 1e-4);
}

TEST_F(FrankaRobotSideTest, TellsTheArmWhatItNeeds) {
  Make();
  RunFor(10);
  EXPECT_TRUE(arm_.enforced);
  EXPECT_EQ(arm_.cutoff_frequency, FakeFranka::kMaxCutoffFrequency);
  EXPECT_FALSE(arm_.limit_rate);
  EXPECT_EQ(arm_.load_mass, FakeArm::kToolMass);
  EXPECT_EQ(arm_.collision_torque[0], 40);
  EXPECT_NE(question_.find("172.16.0.2"), std::string::npos);
  EXPECT_EQ(question_.find("push"), std::string::npos);
  FrankaRobotSideParams params = MakeParams();
  params.real_time = false;
  params.push_test = true;
  Make(params);
  on_cycle_ = [](std::int64_t) {};
  EXPECT_THROW(side_->Run([](const std::string& question) {
    EXPECT_NE(question.find("push the tool by hand once, with more than 5 N"),
              std::string::npos);
    return false;
  }),
               DriverError);
  EXPECT_FALSE(arm_.enforced);
}

TEST_F(FrankaRobotSideTest, NothingMovesBeforeAPersonConfirms) {
  Make();
  confirmed_ = false;
  EXPECT_EQ(RunToError(10), "nobody confirmed, and nothing has moved");
  EXPECT_EQ(arm_.controls, 0);
  EXPECT_EQ(arm_.state().v, Vector7::Zero());
}

TEST_F(FrankaRobotSideTest, AnArmThatIsNotReadyIsRefused) {
  Make();
  arm_.mode = FakeArm::Mode::kUserStopped;
  EXPECT_EQ(RunToError(10),
            "the arm's user stop is pressed, or its brakes are closed");
  arm_.mode = FakeArm::Mode::kReflex;
  arm_.errors = "joint_reflex";
  EXPECT_EQ(RunToError(10),
            "the arm has errors: [joint_reflex]; clear them in Desk");
  EXPECT_EQ(question_, "");
  arm_.mode = FakeArm::Mode::kIdle;
  arm_.errors.clear();
  // Between question and answer.
  try {
    side_->Run([this](const std::string&) {
      arm_.mode = FakeArm::Mode::kGuiding;
      return true;
    });
    FAIL();
  } catch (const DriverError& e) {
    EXPECT_STREQ(e.what(),
                 "the arm is being guided by hand: let go of its buttons");
  }
  arm_.mode = FakeArm::Mode::kIdle;
  RobotCycleParams cycle = MakeCycleParams();
  cycle.side.controller.joint_limits.upper(1) = 0.01;
  Make(MakeParams(), cycle);
  EXPECT_EQ(RunToError(10).substr(0, 16), "joint 2 is at -0");
  EXPECT_EQ(arm_.controls, 0);
}

TEST_F(FrankaRobotSideTest, AnArmThatIsNotThereIsSaid) {
  Make();
  arm_.is_unreachable = true;
  EXPECT_EQ(RunToError(10),
            "no connection to the arm at 172.16.0.2: no route to host (cable, "
            "address, FCI active in Desk, no other program connected?)");
  arm_.is_unreachable = false;
  Make();
  EXPECT_EQ(RunToError(2000,
                       [this](std::int64_t i) {
                         if (i == 1000) arm_.is_unreachable = true;
                       })
                .substr(0, 52),
            "no connection to the arm at 172.16.0.2: timeout (cab");
  EXPECT_EQ(side_->GetStatus().cycles, 1000);
}

TEST_F(FrankaRobotSideTest, AStallOfTenPeriodsIsEndured) {
  Make();
  RunFor(2000, [this](std::int64_t i) {
    if (i == 1200) arm_.stall = 10;
  });
  EXPECT_EQ(side_->GetStatus().reflexes, 0);
  EXPECT_EQ(side_->GetStatus().lost_cycles, 10);
}

TEST_F(FrankaRobotSideTest, RecoversFromAStallInContactWithoutTravel) {
  hand_depth_ = kPressed;
  Make();
  const std::int64_t kStall = 3000;
  Vector3d before;
  double travel = 0;
  double force = 0;
  std::int64_t sequence = 0;
  std::int64_t after = 0;
  std::vector<FrankaPhase> phases;
  RunFor(5000, [&](std::int64_t i) {
    if (i == kStall) {
      before = arm_.state().X_BE.p;
      sequence = side_->GetMessage().sequence;
      arm_.stall = 50;
    }
    if (i > kStall) {
      travel = std::max(travel, (arm_.state().X_BE.p - before).norm());
      force = std::max(force, arm_.state().truth.force().norm());
      if (side_->GetStatus().phase == FrankaPhase::kRunning) ++after;
    }
    if (i == kStall + 100) {
      EXPECT_GT(side_->GetMessage().sequence, sequence);
    }
  });
  const FrankaStatus& status = side_->GetStatus();
  EXPECT_EQ(status.reflexes, 1);
  EXPECT_EQ(status.recoveries, 1);
  EXPECT_EQ(side_->reflex(),
            "motion aborted by reflex! [communication_constraints_violation]");
  EXPECT_EQ(status.tares, 1);  // The bias stays known.
  EXPECT_EQ(arm_.controls, 2);
  EXPECT_LT(travel, 2e-3);
  EXPECT_LT(force, 1.5 * 11);
  EXPECT_GT(after, 1900);
  EXPECT_EQ(arm_.allocations, 0);
}

TEST_F(FrankaRobotSideTest, TheHandIsFollowedFromWhereItIsAfterARecovery) {
  Make();
  Vector3d before;
  RunFor(4000, [&](std::int64_t i) {
    if (i == 1500) {
      before = arm_.state().X_BE.p;
      arm_.stall = 50;
      hand_ += Vector3d(0.2, 0, 0.1);  // Meanwhile it goes elsewhere.
    }
    if (i == 2500) {
      EXPECT_LT((arm_.state().X_BE.p - before).norm(), 2e-3);
      hand_ += Vector3d(0, 0.03, 0);
    }
  });
  EXPECT_EQ(side_->GetStatus().recoveries, 1);
  EXPECT_NEAR(arm_.state().X_BE.p.y() - before.y(), 0.03, 2e-3);
  EXPECT_NEAR(arm_.state().X_BE.p.x() - before.x(), 0, 2e-3);
}

TEST_F(FrankaRobotSideTest, OneReflexTooManyEndsIt) {
  FrankaRobotSideParams params = MakeParams();
  params.max_recoveries = 2;
  Make(params);
  const std::string error = RunToError(9000, [this](std::int64_t i) {
    if (i >= 1000 && i % 500 == 0) arm_.stall = 50;
  });
  EXPECT_EQ(error,
            "the arm has stopped: motion aborted by reflex! "
            "[communication_constraints_violation]");
  EXPECT_EQ(side_->GetStatus().reflexes, 3);
  EXPECT_EQ(side_->GetStatus().recoveries, 2);
}

TEST_F(FrankaRobotSideTest, ReflexesThatAreFarApartAreNoRow) {
  FrankaRobotSideParams params = MakeParams();
  params.max_recoveries = 1;
  params.recovery_time = 0.4;
  Make(params);
  RunFor(3000, [this](std::int64_t i) {
    if (i >= 1000 && i < 3000 && i % 500 == 0) arm_.stall = 50;
  });
  EXPECT_GE(side_->GetStatus().recoveries, 3);
}

TEST_F(FrankaRobotSideTest, ASchemeThatWouldTravelIsNotRecovered) {
  RobotCycleParams cycle = MakeCycleParams();
  cycle.side.proxy.reclutch = false;
  Make(MakeParams(), cycle);
  EXPECT_EQ(RunToError(3000,
                       [this](std::int64_t i) {
                         if (i == 1000) arm_.stall = 50;
                       })
                .substr(0, 20),
            "the arm has stopped:");
  EXPECT_EQ(side_->GetStatus().recoveries, 0);
}

TEST_F(FrankaRobotSideTest, ARecoveryThatFailsEndsIt) {
  Make();
  arm_.recovers = false;
  EXPECT_EQ(RunToError(3000,
                       [this](std::int64_t i) {
                         if (i == 1000) arm_.stall = 50;
                       }),
            "the arm refused: user stop pressed");
}

TEST_F(FrankaRobotSideTest, AStateThatIsNoNumberIsHeldNotSentOn) {
  hand_depth_ = -0.01;
  Make();
  RunFor(3000, [this](std::int64_t i) {
    arm_.says_no_number = i >= 1300 && i < 1320;
    if (i == 1315) {
      EXPECT_EQ(side_->GetStatus().hold, HoldReason::kBadInputs);
    }
  });
  EXPECT_EQ(side_->GetStatus().bad_inputs, 20);
  EXPECT_EQ(side_->GetStatus().reflexes, 0);
}

TEST_F(FrankaRobotSideTest, ASilentSensorHoldsAndGoesOnWithoutAHit) {
  hand_depth_ = kPressed;
  Make();
  double before = 0;
  double force = 0;
  RunFor(5000, [&](std::int64_t i) {
    if (i == 3000) before = arm_.state().truth.force().norm();
    if (i > 3000) {
      force = std::max(force, arm_.state().truth.force().norm());
    }
    sensor_.is_silent = i >= 3000 && i < 4000;
    if (i == 3012 || i == 3999) {
      EXPECT_EQ(side_->GetStatus().phase, FrankaPhase::kHolding);
      EXPECT_EQ(side_->GetStatus().hold, HoldReason::kNoSensor);
    }
  });
  const FrankaStatus& status = side_->GetStatus();
  EXPECT_EQ(status.holds[static_cast<int>(HoldReason::kNoSensor)], 2);
  EXPECT_EQ(status.reflexes, 0);
  EXPECT_GT(before, 5);
  EXPECT_LT(force, 1.5 * before);
}

TEST_F(FrankaRobotSideTest, HoldsWhileItIsAskedTo) {
  Make();
  RunFor(3000, [this](std::int64_t i) {
    if (i == 1000) side_->Hold(true);
    if (i == 1100) {
      EXPECT_EQ(side_->GetStatus().hold, HoldReason::kAsked);
      EXPECT_EQ(side_->GetStatus().phase, FrankaPhase::kHolding);
      hand_ += Vector3d(0.1, 0, 0);
    }
    if (i == 2000) {
      EXPECT_LT(side_->GetStatus().v.norm(), 1e-2);
      side_->Hold(false);
    }
  });
  EXPECT_EQ(side_->GetStatus().hold, HoldReason::kAsked);  // By Stop().
}

TEST_F(FrankaRobotSideTest, StopBrakesBeforeItEnds) {
  Make();
  double speed = 0;
  RunFor(1500, [&](std::int64_t i) {
    if (i >= 1000) hand_.y() += 2e-4;
    if (i == 1500) speed = arm_.state().v.norm();
    if (i == 1510) {
      EXPECT_EQ(side_->GetStatus().phase, FrankaPhase::kStopping);
    }
  });
  EXPECT_GT(speed, 0.1);
  EXPECT_LT(arm_.state().v.cwiseAbs().maxCoeff(), 0.01);
  EXPECT_GT(side_->GetStatus().cycles, 1550);
  EXPECT_EQ(side_->fault(), "");
}

// Which decides nothing in time: the arm's is simulated, and fast.
TEST_F(FrankaRobotSideTest, AnotherThreadTalksToIt) {
  Make();
  arm_.on_cycle = [](std::int64_t) { std::this_thread::yield(); };
  std::thread robot(
      [this] { side_->Run([](const std::string&) { return true; }); });
  std::int64_t running = 0;
  while (running < 100) {
    const FrankaStatus& status = side_->GetStatus();
    side_->SetMessage(ToMessage(
        PoseMessage{.sequence = ++sequence_, .send_time = status.time}));
    if (status.phase == FrankaPhase::kRunning) ++running;
    EXPECT_LE(side_->statistics().Quantile(0.5), 1e-4);
  }
  side_->Stop();
  robot.join();
  EXPECT_EQ(side_->GetStatus().phase, FrankaPhase::kStopped);
  EXPECT_EQ(side_->fault(), "");
}

// A hand that pushes the tool in a direction that nobody was told.
class FrankaPushTest : public FrankaRobotSideTest {
 protected:
  void MakeWithPush(bool has_sensor = true) {
    FrankaRobotSideParams params = MakeParams();
    params.push_test = true;
    params.push_time = 2;
    Make(params, MakeCycleParams(), has_sensor);
  }

  std::function<void(std::int64_t)> Push() {
    return [this](std::int64_t i) {
      if (i == 800) {
        EXPECT_EQ(side_->GetStatus().phase, FrankaPhase::kPushTest);
      }
      arm_.push.setZero();
      if (i >= 1000 && i < 1500) arm_.push = Vector3d(6, -5, 4);
    };
  }
};

TEST_F(FrankaPushTest, TheRobotFollowsAfterAPush) {
  MakeWithPush();
  RunFor(3000, Push());
  EXPECT_GT(side_->GetMessage().sequence, 50);
  EXPECT_EQ(side_->GetStatus().holds[static_cast<int>(HoldReason::kAsked)], 2);
}

TEST_F(FrankaPushTest, TheWrongSignIsRefused) {
  sensor_.sign = -1;
  MakeWithPush();
  EXPECT_EQ(RunToError(3000, Push()).substr(0, 65),
            "push test: the sensed force does not oppose the push (cosine "
            "-0.8");
}

TEST_F(FrankaPushTest, NobodyPushes) {
  MakeWithPush();
  EXPECT_EQ(RunToError(4000),
            "push test: no push of 5 N was sensed within 2 s");
  EXPECT_LT(arm_.state().v.cwiseAbs().maxCoeff(), 0.01);
}

TEST_F(FrankaPushTest, TheArmsOwnEstimatePasses) {
  MakeWithPush(false);
  RunFor(3000, Push());
  EXPECT_EQ(side_->fault(), "");
}

TEST_F(FrankaRobotSideTest, AToolThatTouchesCannotBeTared) {
  arm_.push = Vector3d(0, 0, 12);
  Make();
  EXPECT_EQ(RunToError(6000).substr(0, 45),
            "no bias of the force sensor could be learned:");
  EXPECT_EQ(side_->GetStatus().tares_refused, 5);
}

// The arm's estimate has lost the tool's weight already, is given about another
// point in another frame, and comes out as the force on the table all the same.
TEST_F(FrankaRobotSideTest, TheArmsEstimateIsTheForceOnTheTable) {
  hand_depth_ = kPressed;
  Make(MakeParams(), MakeCycleParams(), false);
  std::vector<double> forces;
  RunFor(4000, [&](std::int64_t i) {
    if (i < 3000) return;
    forces.push_back(arm_.state().truth.force().z());
    const Vector6& sensed = side_->GetStatus().sensed_wrench;
    const Vector3d truth = arm_.state().truth.force();
    // It is a period old.
    EXPECT_LT((sensed.head<3>() - truth).norm(), 0.1);
    const Vector3d moment = Vector3d(0, 0, -0.01).cross(truth);
    EXPECT_LT((sensed.tail<3>() - moment).norm(), 5e-3);
  });
  EXPECT_LT(Deviation(forces), 0.2);
  EXPECT_LT(*std::max_element(forces.begin(), forces.end()), -5);
}

TEST(ExternalWrenchSensorTest, ZeroIsNoEstimate) {
  ExternalWrenchSensor dut(MakeTestArm(), Vector3d::Zero());
  EXPECT_FALSE(dut.Read().valid);
  ExternalWrench wrench;
  for (int i = 0; i < 4; ++i) wrench.F_T_EE[5 * i] = wrench.EE_T_K[5 * i] = 1;
  dut.Take(1, wrench);
  EXPECT_FALSE(dut.Read().valid);
  wrench.K_F_ext_hat_K[2] = -3;
  dut.Take(2, wrench);
  EXPECT_TRUE(dut.Read().valid);
  EXPECT_EQ(dut.Read().time, 2);
  wrench.K_F_ext_hat_K[2] = std::nan("");
  dut.Take(3, wrench);
  EXPECT_FALSE(dut.Read().valid);
  EXPECT_EQ(dut.Read().value(2), -3);
}

TEST(FrankaRobotSideParamsTest, WhatDoesNotGoTogetherIsNamed) {
  const auto make = [](const FrankaRobotSideParams& params,
                       const RobotCycleParams& cycle) -> std::string {
    try {
      Side(params, cycle);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  RobotCycleParams cycle = MakeCycleParams();
  cycle.side.controller.gravity_compensation = true;
  EXPECT_EQ(make({}, cycle),
            "FrankaRobotSide: field `side.controller.gravity_compensation` "
            "expected false: the arm holds its weight itself, got 1");
  FrankaRobotSideParams params;
  params.load.mass = 3;
  EXPECT_EQ(make(params, MakeCycleParams()),
            "FrankaRobotSide: field `load.mass` expected a number in [0, the "
            "mass of the model's last link = 1.2], got 3");
  params = {};
  params.collision.collision_force(2) = 10;
  EXPECT_EQ(ValidationError(params),
            "FrankaCollisionParams: field `collision_force` expected at least "
            "contact_force, got -10");
  params = {};
  params.host = "";
  EXPECT_EQ(ValidationError(params),
            "FrankaRobotSideParams: field `host` expected a name or address, "
            "got \"\"");
  params = {};
  params.load.inertia(0, 0) = -1;
  EXPECT_NE(ValidationError(params).find("principal moments >= 0"),
            std::string::npos);
  EXPECT_EQ(ValidationError(FrankaRobotSideParams()), "no exception");
}

}  // namespace
}  // namespace dual_proxy
