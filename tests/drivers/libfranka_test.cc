// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/franka/libfranka.h"

#include <string>

#include <gtest/gtest.h>

#include "dual_proxy/drivers/hardware_defaults.h"
#include "test_arm.h"

namespace dual_proxy {
namespace {

static_assert(FrankaApi<Libfranka>);

TEST(LibfrankaTest, AnArmThatIsNotThereIsSaid) {
  FrankaRobotSideParams params;
  params.host = "127.0.0.250";
  params.real_time = false;
  RobotCycleParams cycle;
  cycle.side = MakeHardwareDefaults();
  cycle.model = MakeTestArm();
  FrankaRobotSide<Libfranka> dut(params, cycle);
  try {
    dut.Run([](const std::string&) {
      ADD_FAILURE();
      return false;
    });
    FAIL();
  } catch (const DriverError& e) {
    EXPECT_EQ(std::string(e.what()).substr(0, 39),
              "no connection to the arm at 127.0.0.250");
    EXPECT_EQ(dut.fault(), e.what());
  }
  EXPECT_EQ(dut.GetStatus().phase, FrankaPhase::kStopped);
}

}  // namespace
}  // namespace dual_proxy
