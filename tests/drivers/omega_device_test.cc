// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/omega/omega_device.h"

#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/drivers/clock.h"
#include "dual_proxy/drivers/omega/force_dimension_sdk.h"
#include "no_alloc.h"

namespace dual_proxy {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kHandStiffness = 600;  // N/m, of the stand-in's.

// What the stand-in's device and its user do.
class StandIn {
 public:
  StandIn() : handle_(dlopen(DUAL_PROXY_STAND_IN, RTLD_NOW)) {
    if (handle_ == nullptr) throw std::runtime_error(dlerror());
    Call<void()>("standInReset")();
  }

  template <typename Function>
  Function* Call(const char* name) const {
    void* const symbol = dlsym(handle_, name);
    if (symbol == nullptr) throw std::runtime_error(name);
    return reinterpret_cast<Function*>(symbol);
  }

  void SetPath(const char* path) const {
    Call<void(const char*)>("standInSetPath")(path);
  }
  void UnplugAfter(long calls) const {
    Call<void(long)>("standInUnplugAfter")(calls);
  }
  void Set(const char* name, int value) const { Call<void(int)>(name)(value); }
  void Set(const char* name, double value) const {
    Call<void(double)>(name)(value);
  }
  void Fail(const char* function, int times) const {
    Call<void(const char*, int)>("standInFail")(function, times);
  }
  std::array<double, 7> force() const {
    std::array<double, 7> force{};
    Call<void(double*)>("standInGetForce")(force.data());
    return force;
  }
  long Count(const char* function) const {
    return Call<long(const char*)>("standInCount")(function);
  }

 private:
  void* handle_;
};

void Sleep(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

// Within a time that is long on any machine.
bool Eventually(const std::function<bool()>& condition) {
  for (const double start = MonotonicTime(); MonotonicTime() < start + 5;) {
    if (condition()) return true;
    Sleep(0.001);
  }
  return false;
}

Vector6 Force(double x, double y, double z) {
  Vector6 wrench = Vector6::Zero();
  wrench.head<3>() << x, y, z;
  return wrench;
}

OmegaDeviceParams Params() {
  OmegaDeviceParams params;
  params.library = DUAL_PROXY_STAND_IN;
  return params;
}

class OmegaDeviceTest : public testing::Test {
 protected:
  // Commands until it is so.
  bool WriteUntil(HapticDeviceDriver* device, const Vector6& wrench,
                  double gripper_force,
                  const std::function<bool()>& condition) const {
    return Eventually([&] {
      device->Write(wrench, gripper_force);
      return condition();
    });
  }

  bool ForceIs(double x, double y, double z) const {
    const std::array<double, 7> f = stand_in_.force();
    return std::hypot(f[0] - x, f[1] - y, f[2] - z) < 1e-9;
  }

  StandIn stand_in_;
};

TEST_F(OmegaDeviceTest, ReadsTheHandle) {
  stand_in_.SetPath("0 0.01 -0.02 0.03");
  stand_in_.Set("standInSetYaw", 0.3);
  stand_in_.Set("standInSetGripper", 0.2);
  OmegaDevice dut(Params());
  EXPECT_FALSE(dut.Read().valid);
  dut.Open();
  EXPECT_TRUE(dut.Read().valid);
  EXPECT_EQ(dut.name(), "omega.7, serial 1234");
  const Eigen::Vector3d goal(0.01, -0.02, 0.03);
  EXPECT_TRUE(Eventually([&] {
    return (dut.Read().value.X_DH.p - goal).norm() < 1e-6 &&
           dut.Read().value.velocity.norm() < 1e-5;
  }));
  const Reading<HandleState> reading = dut.Read();
  EXPECT_TRUE(reading.valid);
  EXPECT_LE(reading.time, MonotonicTime());
  EXPECT_LT(reading.Age(MonotonicTime()), 1);
  EXPECT_NEAR(reading.value.X_DH.R(1, 0), std::sin(0.3), 1e-12);
  EXPECT_NEAR(reading.value.X_DH.R(0, 1), -std::sin(0.3), 1e-12);
  EXPECT_NEAR(reading.value.gripper_opening, 0.09 * 0.2, 1e-12);
  EXPECT_FALSE(reading.value.buttons.clutch);
  EXPECT_EQ(dut.fault(), "");
  EXPECT_EQ(dut.counters().bad_reads, 0);
  EXPECT_EQ(dut.counters().failed_writes, 0);
}

TEST_F(OmegaDeviceTest, VelocityIsThatOfTheHandle) {
  stand_in_.SetPath("0 0 0 0; 2 0.1 0 0");
  OmegaDevice dut(Params());
  dut.Open();
  EXPECT_TRUE(Eventually(
      [&] { return std::abs(dut.Read().value.velocity[0] - 0.05) < 1e-3; }));
}

TEST_F(OmegaDeviceTest, ForceMovesTheHand) {
  OmegaDevice dut(Params());
  dut.Open();
  EXPECT_TRUE(WriteUntil(&dut, Force(6, 0, 0), 1.5, [&] {
    return std::abs(dut.Read().value.X_DH.p.x() - 6 / kHandStiffness) < 1e-5;
  }));
  EXPECT_TRUE(ForceIs(6, 0, 0));
  EXPECT_EQ(stand_in_.force()[6], 1.5);
}

TEST_F(OmegaDeviceTest, WeightIsCompensated) {
  OmegaDevice dut(Params());
  dut.Open();
  EXPECT_TRUE(WriteUntil(&dut, Vector6::Zero(), 0, [&] {
    return stand_in_.Count("dhdSetForceAndTorqueAndGripperForce") > 100;
  }));
  EXPECT_TRUE(ForceIs(0, 0, 0));
}

TEST_F(OmegaDeviceTest, ForceIsLimited) {
  OmegaDeviceParams params = Params();
  params.thread.max_force = 5;
  params.thread.max_gripper_force = 2;
  OmegaDevice dut(params);
  dut.Open();
  Vector6 wrench = Force(30, 0, 40);
  wrench[4] = 1;
  EXPECT_TRUE(WriteUntil(&dut, wrench, -9, [&] { return ForceIs(3, 0, 4); }));
  EXPECT_EQ(stand_in_.force()[6], -2);
  EXPECT_EQ(stand_in_.force()[4], 0);
}

TEST_F(OmegaDeviceTest, WatchdogTakesTheForceOff) {
  OmegaDevice dut(Params());
  dut.Open();
  Sleep(0.05);
  EXPECT_EQ(dut.counters().watchdogs, 0);  // Nothing was commanded yet.
  ASSERT_TRUE(
      WriteUntil(&dut, Force(0, 4, 0), 0, [&] { return ForceIs(0, 4, 0); }));
  const double start = MonotonicTime();
  EXPECT_TRUE(Eventually([&] { return ForceIs(0, 0, 0); }));
  std::cout << "force off " << 1e3 * (MonotonicTime() - start)
            << " ms after the last command\n";
  EXPECT_TRUE(Eventually([&] { return dut.counters().watchdogs > 0; }));
  EXPECT_TRUE(dut.Read().valid);
  EXPECT_EQ(dut.fault(), "");
  EXPECT_TRUE(
      WriteUntil(&dut, Force(0, 4, 0), 0, [&] { return ForceIs(0, 4, 0); }));
}

TEST_F(OmegaDeviceTest, WhatIsNotFiniteIsNoCommand) {
  OmegaDevice dut(Params());
  dut.Open();
  for (const double bad : {kNan, std::numeric_limits<double>::infinity()}) {
    ASSERT_TRUE(
        WriteUntil(&dut, Force(2, 0, 0), 0, [&] { return ForceIs(2, 0, 0); }));
    EXPECT_TRUE(WriteUntil(&dut, Force(0, bad, 0), 0,
                           [&] { return ForceIs(0, 0, 0); }));
    ASSERT_TRUE(
        WriteUntil(&dut, Force(2, 0, 0), 0, [&] { return ForceIs(2, 0, 0); }));
    EXPECT_TRUE(WriteUntil(&dut, Force(1, 0, 0), bad,
                           [&] { return ForceIs(0, 0, 0); }));
  }
  EXPECT_GT(dut.counters().bad_commands, 0);
  EXPECT_EQ(dut.fault(), "");
}

TEST_F(OmegaDeviceTest, ImpossibleReadingsAreNotValid) {
  stand_in_.SetPath("0 0.02 0 0");
  OmegaDevice dut(Params());
  dut.Open();
  for (const int corruption : {1, 2}) {
    stand_in_.Set("standInCorrupt", corruption);
    ASSERT_TRUE(Eventually([&] { return !dut.Read().valid; }));
    const Reading<HandleState> reading = dut.Read();
    EXPECT_TRUE(reading.value.X_DH.p.allFinite());
    EXPECT_LT(reading.value.X_DH.p.norm(), 0.1);
    EXPECT_EQ(dut.Read().time, reading.time);
    stand_in_.Set("standInCorrupt", 0);
    if (!dut.fault().empty()) dut.Open();  // A machine that slept in between.
    EXPECT_TRUE(Eventually([&] { return dut.Read().valid; }));
  }
}

TEST_F(OmegaDeviceTest, ReadingsThatStayImpossibleAreAFault) {
  OmegaDevice dut(Params());
  dut.Open();
  stand_in_.Set("standInCorrupt", 1);
  EXPECT_TRUE(Eventually([&] { return !dut.fault().empty(); }));
  EXPECT_TRUE(
      WriteUntil(&dut, Force(1, 0, 0), 0, [&] { return ForceIs(0, 0, 0); }));
}

TEST_F(OmegaDeviceTest, UnpluggedAndPluggedInAgain) {
  OmegaDevice dut(Params());
  dut.Open();
  ASSERT_TRUE(
      WriteUntil(&dut, Force(3, 0, 0), 0, [&] { return ForceIs(3, 0, 0); }));
  stand_in_.UnplugAfter(1000);
  EXPECT_TRUE(WriteUntil(&dut, Force(3, 0, 0), 0,
                         [&] { return !dut.fault().empty(); }));
  EXPECT_EQ(dut.fault(),
            "omega.7, serial 1234 no longer answers (communication error): "
            "see to its plug and power, then open it again");
  EXPECT_FALSE(dut.Read().valid);
  EXPECT_TRUE(dut.Read().value.X_DH.p.allFinite());
  try {
    dut.Open();
    ADD_FAILURE() << "opened a device that is not there";
  } catch (const DriverError& error) {
    EXPECT_NE(std::string(error.what()).find("no device found"),
              std::string::npos)
        << error.what();
  }
  EXPECT_FALSE(dut.Read().valid);
  dut.Close();
  stand_in_.UnplugAfter(-1);
  dut.Open();
  EXPECT_EQ(dut.fault(), "");
  EXPECT_TRUE(dut.Read().valid);
  EXPECT_TRUE(ForceIs(0, 0, 0));  // Nothing of what was commanded before.
  EXPECT_TRUE(
      WriteUntil(&dut, Force(3, 0, 0), 0, [&] { return ForceIs(3, 0, 0); }));
}

TEST_F(OmegaDeviceTest, SlowCallIsNoFault) {
  OmegaDeviceParams params = Params();
  params.thread.watchdog = 0.1;
  OmegaDevice dut(params);
  dut.Open();
  const std::int64_t before = dut.counters().overruns;
  stand_in_.Set("standInDelay", 0.03);
  EXPECT_TRUE(Eventually([&] { return dut.counters().overruns > before; }));
  const std::int64_t cycles = dut.counters().cycles;
  EXPECT_TRUE(Eventually([&] { return dut.counters().cycles > cycles + 10; }));
  EXPECT_TRUE(dut.Read().valid);
}

// The thread is held up, so only the device itself can.
TEST_F(OmegaDeviceTest, DevicesOwnWatchdogIsBehind) {
  OmegaDevice dut(Params());
  dut.Open();
  unsigned char watchdog = 0;
  stand_in_.Call<int(unsigned char*, signed char)>("dhdGetWatchdog")(&watchdog,
                                                                     0);
  EXPECT_EQ(watchdog, 240);  // 30 ms, in units of 125 us.
  ASSERT_TRUE(
      WriteUntil(&dut, Force(3, 0, 0), 0, [&] { return ForceIs(3, 0, 0); }));
  stand_in_.Set("standInDelay", 0.3);
  const double start = MonotonicTime();
  EXPECT_TRUE(
      WriteUntil(&dut, Force(3, 0, 0), 0, [&] { return ForceIs(0, 0, 0); }));
  std::cout << "force off " << 1e3 * (MonotonicTime() - start)
            << " ms after the thread was held up\n";
  EXPECT_TRUE(
      WriteUntil(&dut, Force(3, 0, 0), 0, [&] { return ForceIs(3, 0, 0); }));
  EXPECT_GT(dut.counters().device_watchdogs, 0);
  EXPECT_EQ(dut.fault(), "");
}

TEST_F(OmegaDeviceTest, DeviceWithoutAWatchdogSaysSo) {
  stand_in_.Fail("dhdSetWatchdog", -1);
  OmegaDevice dut(Params());
  dut.Open();
  EXPECT_EQ(dut.name(), "omega.7, serial 1234, without a watchdog of its own");
}

TEST_F(OmegaDeviceTest, HomesOnlyWhenAllowed) {
  stand_in_.Set("standInSetHomed", 0);
  OmegaDeviceParams params = Params();
  OmegaDevice refused(params);
  try {
    refused.Open();
    ADD_FAILURE() << "opened a device that was not homed";
  } catch (const DriverError& error) {
    EXPECT_NE(std::string(error.what()).find("allow `homing`"),
              std::string::npos);
  }
  EXPECT_EQ(stand_in_.Count("drdAutoInit"), 0);
  params.homing = true;
  OmegaDevice dut(params);
  dut.Open();  // Which the refused one has let go of.
  EXPECT_EQ(stand_in_.Count("drdAutoInit"), 1);
  EXPECT_EQ(stand_in_.Count("drdStop"), 1);
  dut.Open();
  EXPECT_EQ(stand_in_.Count("drdAutoInit"), 1);
}

TEST_F(OmegaDeviceTest, LeftHanded) {
  stand_in_.Set("standInSetType", 37);
  stand_in_.Set("standInSetGripper", 0.3);
  OmegaDeviceParams params = Params();
  params.clutch = HandleClutch::kGripper;
  OmegaDevice dut(params);
  dut.Open();
  EXPECT_NEAR(dut.Read().value.gripper_opening, 0.027, 1e-12);
  EXPECT_FALSE(dut.Read().value.buttons.clutch);
  EXPECT_TRUE(WriteUntil(&dut, Vector6::Zero(), 2,
                         [&] { return stand_in_.force()[6] == -2; }));
}

TEST_F(OmegaDeviceTest, WithoutWristAndGripper) {
  stand_in_.Set("standInSetType", 33);
  stand_in_.Set("standInSetYaw", 0.3);
  OmegaDevice dut(Params());
  dut.Open();
  EXPECT_EQ(dut.Read().value.X_DH.R, Eigen::Matrix3d::Identity());
  EXPECT_TRUE(std::isnan(dut.Read().value.gripper_opening));
  EXPECT_TRUE(WriteUntil(&dut, Force(1, 0, 0), kNoGripper,
                         [&] { return ForceIs(1, 0, 0); }));
  EXPECT_EQ(dut.counters().bad_commands, 0);
  stand_in_.Set("standInPressButton", 1);
  EXPECT_TRUE(Eventually([&] { return dut.Read().value.buttons.clutch; }));

  OmegaDeviceParams params = Params();
  params.clutch = HandleClutch::kGripper;
  dut.Close();
  EXPECT_THROW(OmegaDevice(params).Open(), DriverError);
}

TEST_F(OmegaDeviceTest, ClutchIsTheButton) {
  OmegaDevice dut(Params());
  dut.Open();
  stand_in_.Set("standInSetGripper", 0.0);
  EXPECT_TRUE(Eventually([&] { return dut.Read().value.buttons.clutch; }));
  stand_in_.Set("standInSetGripper", 0.2);
  EXPECT_TRUE(Eventually([&] { return !dut.Read().value.buttons.clutch; }));
}

TEST_F(OmegaDeviceTest, ClutchIsTheGripperWithHysteresis) {
  OmegaDeviceParams params = Params();
  params.clutch = HandleClutch::kGripper;
  params.gripper_angle = 0.1;
  OmegaDevice dut(params);
  stand_in_.Set("standInSetGripper", 0.11);
  dut.Open();
  EXPECT_FALSE(dut.Read().value.buttons.clutch);
  stand_in_.Set("standInSetGripper", 0.09);
  EXPECT_TRUE(Eventually([&] { return dut.Read().value.buttons.clutch; }));
  stand_in_.Set("standInSetGripper", 0.11);
  EXPECT_TRUE(Eventually([&] {
    return std::abs(dut.Read().value.gripper_opening - 0.09 * 0.11) < 1e-12;
  }));
  EXPECT_TRUE(dut.Read().value.buttons.clutch);
  stand_in_.Set("standInSetGripper", 0.13);
  EXPECT_TRUE(Eventually([&] { return !dut.Read().value.buttons.clutch; }));
}

TEST_F(OmegaDeviceTest, SaysThatForcesAreOff) {
  OmegaDevice dut(Params());
  dut.Open();
  stand_in_.Call<int(signed char)>("dhdStop")(0);
  EXPECT_TRUE(Eventually([&] { return !dut.fault().empty(); }));
  EXPECT_EQ(dut.fault(),
            "omega.7, serial 1234: its forces are off, by another program: "
            "close and open it again");
  EXPECT_TRUE(dut.Read().valid);
}

TEST_F(OmegaDeviceTest, ForceEndsWithTheDriver) {
  {
    OmegaDevice dut(Params());
    dut.Open();
    ASSERT_TRUE(
        WriteUntil(&dut, Force(3, 0, 0), 0, [&] { return ForceIs(3, 0, 0); }));
    dut.Close();
    EXPECT_EQ(stand_in_.Count("drdClose"), 1);
    EXPECT_FALSE(dut.Read().valid);
    dut.Close();
    dut.Write(Force(3, 0, 0), 0);
    EXPECT_EQ(stand_in_.Count("drdClose"), 1);
    dut.Open();
  }
  EXPECT_EQ(stand_in_.Count("drdClose"), 2);
  try {
    OmegaDevice dut(Params());
    dut.Open();
    ASSERT_TRUE(
        WriteUntil(&dut, Force(3, 0, 0), 0, [&] { return ForceIs(3, 0, 0); }));
    throw std::runtime_error("of whoever uses it");
  } catch (const std::runtime_error&) {
    EXPECT_EQ(stand_in_.Count("drdClose"), 3);
  }
}

TEST_F(OmegaDeviceTest, ErrorsOfOpeningNameTheCall) {
  for (const char* function : {"dhdGetSystemType", "dhdSetGravityCompensation",
                               "dhdEmulateButton", "dhdEnableForce"}) {
    stand_in_.Call<void()>("standInReset")();
    stand_in_.Fail(function, -1);
    OmegaDevice dut(Params());
    try {
      dut.Open();
      ADD_FAILURE() << function;
    } catch (const DriverError& error) {
      EXPECT_NE(std::string(error.what()).find(function), std::string::npos)
          << error.what();
    }
    EXPECT_EQ(stand_in_.Count("drdClose"), 1) << function;
  }
}

TEST_F(OmegaDeviceTest, SerialNumber) {
  OmegaDeviceParams params = Params();
  params.serial = 1234;
  OmegaDevice(params).Open();
  params.serial = 99;
  try {
    OmegaDevice(params).Open();
    ADD_FAILURE();
  } catch (const DriverError& error) {
    EXPECT_NE(std::string(error.what()).find("serial 99"), std::string::npos);
  }
}

TEST_F(OmegaDeviceTest, SideNeitherAllocatesNorWaits) {
  OmegaDevice dut(Params());
  dut.Open();
  const auto cycle = [&] {
    const Reading<HandleState> reading = dut.Read();
    dut.Write(Force(reading.value.X_DH.p.x(), 0, 0), 0);
  };
  cycle();
  {
    const ScopedNoAlloc guard;
    for (int i = 0; i < 100; ++i) cycle();
    EXPECT_EQ(guard.count(), 0);
  }
  std::vector<double> times;
  for (int i = 0; i < 10000; ++i) {
    const double start = MonotonicTime();
    cycle();
    times.push_back(MonotonicTime() - start);
  }
  std::sort(times.begin(), times.end());
  std::cout << "Read() and Write(): median " << 1e6 * times[5000]
            << " us, 99.9 % " << 1e6 * times[9990] << " us, worst "
            << 1e6 * times.back() << " us\n";
}

TEST_F(OmegaDeviceTest, RunsAtItsRate) {
  OmegaDeviceParams params = Params();
  params.thread.rate = 4000;
  OmegaDevice dut(params);
  const double start = MonotonicTime();
  dut.Open();
  Sleep(0.5);
  const HapticDeviceCounters counters = dut.counters();
  const double seconds = MonotonicTime() - start;
  std::cout << "4 kHz: " << counters.cycles / seconds << " cycles and "
            << counters.overruns / seconds << " overruns a second, "
            << (dut.real_time() ? "with" : "without")
            << " real-time priority\n";
  EXPECT_GT(counters.cycles, 10);
  EXPECT_LE(counters.cycles, 4000 * seconds + 10);
}

TEST(OmegaDeviceParamsTest, AreChecked) {
  const auto message = [](const OmegaDeviceParams& params) -> std::string {
    try {
      OmegaDevice device(params);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return {};
  };
  OmegaDeviceParams params;
  EXPECT_EQ(message(params), "");
  params.thread.rate = 100;
  EXPECT_EQ(message(params),
            "HapticDeviceThreadParams: field `rate` expected a number in "
            "[1000, 4000], got 100");
  params = {};
  params.button = 32;
  EXPECT_EQ(message(params),
            "OmegaDeviceParams: field `button` expected a number in [0, 31], "
            "got 32");
}

class ForceDimensionSdkTest : public testing::Test {
 protected:
  ForceDimensionSdkTest() {
    folder_ = std::filesystem::path(testing::TempDir()) /
              ("sdk" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    unsetenv("FDSDK");
  }
  ~ForceDimensionSdkTest() override {
    unsetenv("FDSDK");
    std::filesystem::remove_all(folder_);
  }

  static std::string Error(const std::string& library) {
    try {
      LoadForceDimensionSdk(library);
    } catch (const DriverError& error) {
      return error.what();
    }
    return {};
  }

  std::filesystem::path folder_;
};

TEST_F(ForceDimensionSdkTest, ErrorsSayWhatWasTriedAndWhereToGetIt) {
  const std::string error = Error("/no/such/libdrd.so");
  EXPECT_NE(error.find("Tried: /no/such/libdrd.so: "), std::string::npos)
      << error;
  EXPECT_NE(error.find("forcedimension.com"), std::string::npos) << error;
  EXPECT_NE(error.find("FDSDK"), std::string::npos) << error;
  setenv("FDSDK", folder_.c_str(), 1);
  EXPECT_NE(Error("").find(folder_.string() + "/lib/release/lin-"),
            std::string::npos)
      << Error("");
}

TEST_F(ForceDimensionSdkTest, LibraryThatIsAnotherIsNamed) {
  const std::string error = Error("libc.so.6");
  EXPECT_NE(error.find("libc.so.6: has no dhdErrorGetLastStr, "),
            std::string::npos)
      << error;
}

TEST_F(ForceDimensionSdkTest, NewestOfAFolder) {
  const auto lib = folder_ / "lib" / "release" / DUAL_PROXY_SDK_PLATFORM;
  std::filesystem::create_directories(lib);
  for (const char* version : {"3.9.1", "3.17.5"}) {
    std::filesystem::create_symlink(
        DUAL_PROXY_STAND_IN, lib / (std::string("libdrd.so.") + version));
  }
  setenv("FDSDK", folder_.c_str(), 1);
  const ForceDimensionSdk sdk = LoadForceDimensionSdk("");
  EXPECT_EQ(sdk.path, lib / "libdrd.so.3.17.5");
  EXPECT_EQ(sdk.version, "3.17.5.0");
  EXPECT_EQ(LoadForceDimensionSdk(lib).path, sdk.path);
}

}  // namespace
}  // namespace dual_proxy
