// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/chai3d/chai3d_device.h"

#include <dlfcn.h>

#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "dual_proxy/drivers/clock.h"

namespace dual_proxy {
namespace {

// Where CHAI3D is linked with the stand-in; with the real SDK there is nothing
// to test.
class Chai3dDeviceTest : public testing::Test {
 protected:
  void SetUp() override {
    if (dlsym(RTLD_DEFAULT, "standInReset") == nullptr) {
      GTEST_SKIP() << "CHAI3D is not linked with the stand-in";
    }
    Call<void()>("standInReset")();
  }

  template <typename Function>
  static Function* Call(const char* name) {
    return reinterpret_cast<Function*>(dlsym(RTLD_DEFAULT, name));
  }

  static std::array<double, 7> force() {
    std::array<double, 7> force{};
    Call<void(double*)>("standInGetForce")(force.data());
    return force;
  }

  static bool Eventually(const std::function<bool()>& condition) {
    for (const double start = MonotonicTime(); MonotonicTime() < start + 5;) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }
};

TEST_F(Chai3dDeviceTest, ReadsAndWrites) {
  Call<void(const char*)>("standInSetPath")("0 0.01 -0.02 0.03");
  Call<void(double)>("standInSetYaw")(0.3);
  Chai3dDevice dut({});
  dut.Open();
  EXPECT_EQ(dut.name(), "Force Dimension omega.7R");
  // CHAI3D leaves the weight to the SDK's default, which may be no
  // compensation.
  const Eigen::Vector2d goal(0.01, -0.02);
  EXPECT_TRUE(Eventually([&] {
    return (dut.Read().value.X_DH.p.head<2>() - goal).norm() < 1e-6;
  }));
  EXPECT_NEAR(dut.Read().value.X_DH.p.z(), 0.03, 0.005);
  const Reading<HandleState> reading = dut.Read();
  EXPECT_TRUE(reading.valid);
  EXPECT_NEAR(reading.value.X_DH.R(1, 0), std::sin(0.3), 1e-12);
  EXPECT_NEAR(reading.value.gripper_opening, 0.05 * 0.3, 1e-12);
  const Vector6 wrench = Vector6::Unit(1) * 3;
  EXPECT_TRUE(Eventually([&] {
    dut.Write(wrench, 1);
    return force()[1] == 3 && force()[6] == 1;
  }));
  EXPECT_TRUE(Eventually([&] { return force()[1] == 0; }));
  EXPECT_GT(dut.counters().watchdogs, 0);
}

TEST_F(Chai3dDeviceTest, Unplugged) {
  Chai3dDevice dut({});
  dut.Open();
  Call<void(long)>("standInUnplugAfter")(500);
  EXPECT_TRUE(Eventually([&] { return !dut.fault().empty(); }));
  EXPECT_FALSE(dut.Read().valid);
  EXPECT_THROW(dut.Open(), DriverError);
  Call<void(long)>("standInUnplugAfter")(-1);
  dut.Open();
  EXPECT_TRUE(dut.Read().valid);
  EXPECT_EQ(dut.fault(), "");
}

TEST_F(Chai3dDeviceTest, LimitsAreThoseOfTheDevice) {
  Chai3dDeviceParams params;
  params.thread.max_force = 15;
  try {
    Chai3dDevice(params).Open();
    ADD_FAILURE();
  } catch (const DriverError& error) {
    EXPECT_NE(std::string(error.what()).find("`max_force` expected at most 12"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(Chai3dDeviceTest, CalibratesOnlyWhenAllowed) {
  Call<void(int)>("standInSetHomed")(0);
  Chai3dDeviceParams params;
  Chai3dDevice(params).Open();
  const auto count = Call<long(const char*)>("standInCount");
  EXPECT_EQ(count("drdAutoInit"), 0);
  params.homing = true;
  Chai3dDevice(params).Open();
  EXPECT_EQ(count("drdAutoInit"), 1);
}

}  // namespace
}  // namespace dual_proxy
