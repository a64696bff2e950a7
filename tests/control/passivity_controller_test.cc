// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/passivity_controller.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const Matrix3d kAlongZ{Vector3d::UnitZ().asDiagonal()};

class TimeDomainPassivityTest : public ::testing::Test {
 protected:
  TimeDomainPassivityParams params_{.initial_energy = 0.001,
                                    .max_energy = 0.002,
                                    .max_damping = 400,
                                    .damping_margin = 0,
                                    .actuation_delay = 0,
                                    .period = 0.001};
};

TEST_F(TimeDomainPassivityTest, StartsWithTheInitialEnergy) {
  const TimeDomainPassivityState state =
      TimeDomainPassivity(params_).MakeState();
  EXPECT_EQ(state.energy, 0.001);
  EXPECT_EQ(state.damping, 0);
  EXPECT_EQ(state.dissipated, 0);
}

TEST_F(TimeDomainPassivityTest, RemembersNothingThatOverflows) {
  params_.damping_margin = 150;
  const TimeDomainPassivity dut(params_);
  TimeDomainPassivityState state = dut.MakeState();
  for (const double v : {1e200, 1e308, -1e308}) {
    dut.Update(Vector3d(0, 0, 1e308), Vector3d(v, 0, v), kAlongZ, &state);
  }
  for (int i = 0; i < 10; ++i) {
    const Vector3d injected =
        dut.Update(Vector3d::Zero(), Vector3d::Zero(), kAlongZ, &state);
    EXPECT_TRUE(injected.allFinite());
  }
  EXPECT_LE(std::abs(state.energy), params_.max_energy);
  EXPECT_TRUE(std::isfinite(state.dissipated));
}

// A force that pushes along a constant velocity: E falls by F v dt per period,
// from the second period on (the first command has not acted before).
TEST_F(TimeDomainPassivityTest, EnergyIsTheWorkDone) {
  params_.enabled = false;
  const TimeDomainPassivity dut(params_);
  TimeDomainPassivityState state = dut.MakeState();
  const Vector3d force(0, 0, 2);
  const Vector3d velocity(0.3, 0, 0.01);
  for (int i = 0; i < 11; ++i) {
    EXPECT_EQ(dut.Update(force, velocity, kAlongZ, &state), Vector3d::Zero());
  }
  EXPECT_NEAR(state.energy, 0.001 - 10 * 2 * 0.01 * 0.001, 1e-15);
}

// The trapezoid rule makes the work exact for a held force and a velocity that
// changes linearly; the delay says which command was held.
TEST_F(TimeDomainPassivityTest, WorkIsThatOfTheDelayedCommand) {
  params_.enabled = false;
  params_.actuation_delay = 2;
  params_.max_energy = 10;
  params_.initial_energy = 5;
  const TimeDomainPassivity dut(params_);
  TimeDomainPassivityState state = dut.MakeState();
  RandomStream random(4);
  double work = 0;
  std::array<double, 53> force{};
  std::array<double, 50> velocity{};
  for (int i = 0; i < 50; ++i) {
    force[i + 3] = random.Normal();
    velocity[i] = random.Normal();
    if (i > 0) {
      work += force[i] * 0.5 * (velocity[i - 1] + velocity[i]) * 0.001;
    }
    dut.Update(Vector3d(0, 0, force[i + 3]), Vector3d(0, 0, velocity[i]),
               kAlongZ, &state);
  }
  EXPECT_NEAR(state.energy, 5 - work, 1e-12);
}

TEST_F(TimeDomainPassivityTest, MarginIsChargedInForceSpaceOnly) {
  params_.enabled = false;
  params_.damping_margin = 100;
  const TimeDomainPassivity dut(params_);
  TimeDomainPassivityState state = dut.MakeState();
  for (int i = 0; i < 20; ++i) {
    dut.Update(Vector3d::Zero(), Vector3d(0.5, 0.5, 0), kAlongZ, &state);
  }
  EXPECT_EQ(state.energy, 0.001);
  dut.Update(Vector3d::Zero(), Vector3d(0, 0, 0.01), kAlongZ, &state);
  dut.Update(Vector3d::Zero(), Vector3d(0, 0, 0.01), kAlongZ, &state);
  EXPECT_NEAR(state.energy, 0.001 - 100 * (0.005 * 0.005 + 1e-4) * 1e-3, 1e-15);
}

TEST_F(TimeDomainPassivityTest, DampingGrowsAsTheEnergyIsSpent) {
  const TimeDomainPassivity dut(params_);
  TimeDomainPassivityState state = dut.MakeState();
  const Vector3d velocity(0.2, 0, 0.05);
  for (const auto& [energy, damping] : {std::pair{0.002, 0.0},
                                        {0.0015, 100.0},
                                        {0.0, 400.0},
                                        {-0.002, 400.0}}) {
    state = dut.MakeState();
    state.energy = energy;
    const Vector3d force =
        dut.Update(Vector3d::Zero(), velocity, kAlongZ, &state);
    EXPECT_NEAR(state.damping, damping, 1e-9);
    EXPECT_NEAR(force.z(), -damping * 0.05, 1e-9);
    EXPECT_EQ(force.x(), 0);
    EXPECT_NEAR(state.dissipated, damping * 0.05 * 0.05 * 0.001, 1e-12);
  }
}

TEST_F(TimeDomainPassivityTest, EnergyIsCappedSoThatOldDissipationPaysNothing) {
  const TimeDomainPassivity dut(params_);
  TimeDomainPassivityState state = dut.MakeState();
  for (int i = 0; i < 1000; ++i) {
    dut.Update(Vector3d(0, 0, -5), Vector3d(0, 0, 0.1), kAlongZ, &state);
  }
  EXPECT_EQ(state.energy, 0.002);
  EXPECT_EQ(state.damping, 0);
}

// Whatever the feedback does, injection never adds energy and stays bounded.
TEST_F(TimeDomainPassivityTest, InjectionIsPassive) {
  params_.damping_margin = 150;
  const TimeDomainPassivity dut(params_);
  TimeDomainPassivityState state = dut.MakeState();
  RandomStream random(5);
  const auto vector = [&random](double size) -> Vector3d {
    return size * Vector3d(random.Normal(), random.Normal(), random.Normal());
  };
  double dissipated = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d axis = vector(1).normalized();
    const Vector3d velocity = vector(0.05);
    const Vector3d force =
        dut.Update(vector(5), velocity, axis * axis.transpose(), &state);
    EXPECT_LE(force.dot(velocity), 1e-15);
    EXPECT_GE(state.damping, 0);
    EXPECT_LE(state.damping, 400);
    EXPECT_LE(std::abs(state.energy), 0.002);
    EXPECT_GE(state.dissipated, dissipated);
    dissipated = state.dissipated;
  }
}

TEST_F(TimeDomainPassivityTest, CopyContinuesAlikeWithoutAllocation) {
  const TimeDomainPassivity dut(params_);
  TimeDomainPassivityState state = dut.MakeState();
  dut.Update(Vector3d(0, 0, 3), Vector3d(0, 0, 0.1), kAlongZ, &state);
  TimeDomainPassivityState copy = state;
  ScopedNoAlloc guard;
  const Vector3d a =
      dut.Update(Vector3d(0, 0, 3), Vector3d(0, 0, 0.1), kAlongZ, &state);
  EXPECT_EQ(guard.count(), 0);
  EXPECT_EQ(dut.Update(Vector3d(0, 0, 3), Vector3d(0, 0, 0.1), kAlongZ, &copy),
            a);
}

TEST_F(TimeDomainPassivityTest, InvalidParamsNameTheField) {
  const auto error = [this](auto set) {
    TimeDomainPassivityParams params = params_;
    set(params);
    EXPECT_THROW(TimeDomainPassivity{params}, std::invalid_argument);
    return ValidationError(params);
  };
  using P = TimeDomainPassivityParams;
  const std::string who = "TimeDomainPassivityParams: field ";
  EXPECT_EQ(error([](P& p) { p.initial_energy = 0.003; }),
            who +
                "`initial_energy` expected a number in [0, max_energy = "
                "0.002], got 0.003");
  EXPECT_EQ(error([](P& p) { p.damping_margin = 500; }),
            who +
                "`damping_margin` expected a number in [0, max_damping = 400], "
                "got 500");
  EXPECT_EQ(error([](P& p) { p.actuation_delay = 8; }),
            who + "`actuation_delay` expected a number in [0, 7], got 8");
  EXPECT_EQ(error([](P& p) { p.max_energy = 0; }),
            who + "`max_energy` expected a finite value > 0, got 0");
  EXPECT_EQ(error([](P& p) { p.max_damping = -1; }),
            who + "`max_damping` expected a finite value >= 0, got -1");
  EXPECT_EQ(error([](P& p) { p.period = 0; }),
            who + "`period` expected a finite value > 0, got 0");
}

}  // namespace
}  // namespace dual_proxy
