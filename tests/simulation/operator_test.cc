// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/operator.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

constexpr PathInterpolation kAll[] = {PathInterpolation::kMinimumJerk,
                                      PathInterpolation::kLinear,
                                      PathInterpolation::kCubic};

class OperatorPathTest : public ::testing::Test {
 protected:
  OperatorPathTest() {
    params_.times = Eigen::Vector4d(1, 2, 4, 4.5);
    params_.points.resize(3, 4);
    params_.points << 0, 0.1, 0.1, 0.3,  //
        0, 0.2, -0.2, 0,                 //
        0.5, 0.4, 0.4, 0.1;
  }

  OperatorPathParams params_;
};

TEST_F(OperatorPathTest, MinimumJerkMatchesItsPolynomial) {
  const OperatorPath dut(params_);
  // A quarter of the way from the first to the second point.
  const double s = 0.25;
  const double share =
      10 * std::pow(s, 3) - 15 * std::pow(s, 4) + 6 * std::pow(s, 5);
  const OperatorPathSample sample = dut.Calc(1.25);
  EXPECT_LT(
      (sample.position - Vector3d(0.1 * share, 0.2 * share, 0.5 - 0.1 * share))
          .norm(),
      1e-15);
  // Half way the speed is 15/8 of the mean, here over 2 s.
  EXPECT_LT((dut.Calc(3).velocity - Vector3d(0, -0.4 / 2 * 15 / 8, 0)).norm(),
            1e-15);
}

TEST_F(OperatorPathTest, LinearIsStraightAtConstantSpeed) {
  params_.interpolation = PathInterpolation::kLinear;
  const OperatorPath dut(params_);
  EXPECT_LT((dut.Calc(2.5).position - Vector3d(0.1, 0.1, 0.4)).norm(), 1e-15);
  EXPECT_LT((dut.Calc(2.1).velocity - Vector3d(0, -0.2, 0)).norm(), 1e-15);
}

// A parabola is reproduced between inner points of a cubic path, whatever
// their spacing.
TEST_F(OperatorPathTest, CubicReproducesAParabola) {
  params_.interpolation = PathInterpolation::kCubic;
  const auto parabola = [](double t) {
    return Vector3d(1 - t + t * t, 2 * t * t, 3 * t);
  };
  for (int i = 0; i < 4; ++i) {
    params_.points.col(i) = parabola(params_.times(i));
  }
  const OperatorPath dut(params_);
  for (double t = 2; t < 4; t += 0.1) {
    const OperatorPathSample sample = dut.Calc(t);
    EXPECT_LT((sample.position - parabola(t)).norm(), 1e-13);
    EXPECT_LT((sample.velocity - Vector3d(2 * t - 1, 4 * t, 3)).norm(), 1e-13);
  }
}

TEST_F(OperatorPathTest, PassesThroughEveryPointAndRestsOutside) {
  for (const PathInterpolation interpolation : kAll) {
    params_.interpolation = interpolation;
    const OperatorPath dut(params_);
    for (int i = 0; i < 4; ++i) {
      EXPECT_LT(
          (dut.Calc(params_.times(i)).position - params_.points.col(i)).norm(),
          1e-15);
    }
    for (const double time : {-1e9, 0.0, 1.0}) {
      EXPECT_EQ(dut.Calc(time).position, Vector3d(params_.points.col(0)));
      EXPECT_EQ(dut.Calc(time).velocity, Vector3d::Zero());
    }
    for (const double time : {4.5, 1e9}) {
      EXPECT_EQ(dut.Calc(time).position, Vector3d(params_.points.col(3)));
      EXPECT_EQ(dut.Calc(time).velocity, Vector3d::Zero());
    }
  }
}

TEST_F(OperatorPathTest, VelocityIsTheDerivative) {
  RandomStream random(2);
  for (const PathInterpolation interpolation : kAll) {
    params_.interpolation = interpolation;
    const OperatorPath dut(params_);
    for (int i = 0; i < 1000; ++i) {
      const double time = 0.5 + 4.5 * random.Uniform();
      const double h = 1e-6;
      bool has_knot = false;
      for (const double knot : params_.times) {
        has_knot |= std::abs(knot - time) <= h;
      }
      if (has_knot) continue;
      const Vector3d slope =
          (dut.Calc(time + h).position - dut.Calc(time - h).position) / (2 * h);
      // Rounding of the difference is 1e-16 / h.
      EXPECT_LT((dut.Calc(time).velocity - slope).norm(), 1e-8);
    }
  }
}

TEST_F(OperatorPathTest, WithoutRotationsItDoesNotTurn) {
  const OperatorPath dut(params_);
  EXPECT_EQ(dut.Calc(1.25).rotation, Eigen::Matrix3d::Identity());
}

// A rotation vector's coordinates go the way of a point's.
TEST_F(OperatorPathTest, RotationsAreInterpolatedAsPoints) {
  params_.rotations = params_.points;
  for (const PathInterpolation interpolation : kAll) {
    params_.interpolation = interpolation;
    const OperatorPath dut(params_);
    for (double time = 0.5; time < 5; time += 0.05) {
      const OperatorPathSample sample = dut.Calc(time);
      EXPECT_EQ(sample.rotation, ExpRotation(sample.position)) << time;
    }
  }
}

TEST_F(OperatorPathTest, OnePointIsAlwaysThere) {
  const OperatorPath dut;
  EXPECT_EQ(dut.Calc(-3).position, Vector3d::Zero());
  EXPECT_EQ(dut.Calc(3).velocity, Vector3d::Zero());
}

TEST_F(OperatorPathTest, TimeThatIsNoNumberGivesTheFirstPointAtRest) {
  const OperatorPath dut(params_);
  const OperatorPathSample sample =
      dut.Calc(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(sample.position, Vector3d(params_.points.col(0)));
  EXPECT_EQ(sample.velocity, Vector3d::Zero());
}

TEST_F(OperatorPathTest, DoesNotAllocate) {
  params_.rotations = params_.points;
  const OperatorPath dut(params_);
  ScopedNoAlloc guard;
  for (double time = 0; time < 5; time += 0.1) dut.Calc(time);
  EXPECT_EQ(guard.count(), 0);
}

TEST_F(OperatorPathTest, PressesButtonsAtTheirTimes) {
  params_.clutch = {{1, 2}, {3, 3.5}};
  params_.home = {{0.5, 0.7}};
  params_.gripper = {{1, 0.02}};
  params_.force_scale = {{1.5, 0.5}, {2.5, 2}};
  const OperatorPath dut(params_);
  const auto clutch = [&](double time) { return dut.Calc(time).clutch; };
  EXPECT_FALSE(clutch(0.99) || clutch(2) || clutch(3.6));
  EXPECT_TRUE(clutch(1) && clutch(1.99) && clutch(3.2));
  EXPECT_FALSE(dut.Calc(0.49).home || dut.Calc(0.7).home);
  EXPECT_TRUE(dut.Calc(0.5).home);
  EXPECT_TRUE(std::isnan(dut.Calc(0.99).gripper_opening));
  EXPECT_EQ(dut.Calc(1).gripper_opening, 0.02);
  EXPECT_EQ(dut.Calc(1.4).force_scale, 1);
  EXPECT_EQ(dut.Calc(1.5).force_scale, 0.5);
  EXPECT_EQ(dut.Calc(9).force_scale, 2);
  params_.clutch = {{2, 1}};
  EXPECT_EQ(
      ValidationError(params_),
      "OperatorPathParams: field `clutch[0][1]` expected a finite value > its "
      "start = 2, got 1");
  params_.clutch.clear();
  params_.home = {{2, 2}};
  EXPECT_NE(ValidationError(params_).find("`home[0][1]`"), std::string::npos);
  params_.home.clear();
  params_.force_scale = {{1, 1}, {1, 2}};
  EXPECT_NE(ValidationError(params_).find("`force_scale[1][0]`"),
            std::string::npos);
}

TEST_F(OperatorPathTest, ErrorsNameFieldRangeAndValue) {
  const std::string who = "OperatorPathParams: field ";
  OperatorPathParams params = params_;
  EXPECT_EQ(ValidationError(params), "no exception");
  params.times(2) = 2;
  EXPECT_EQ(ValidationError(params),
            who + "`times` expected strictly increasing times, got 2");
  EXPECT_THROW(OperatorPath{params}, std::invalid_argument);
  params = params_;
  params.times = Eigen::VectorXd();
  EXPECT_EQ(ValidationError(params),
            who + "`times` expected at least one time, got 0");
  params = params_;
  params.points = Eigen::Matrix3Xd::Zero(3, 2);
  EXPECT_EQ(ValidationError(params),
            who + "`points` expected one column per time, got 2");
  params = params_;
  params.points(1, 1) = std::numeric_limits<double>::infinity();
  EXPECT_NE(ValidationError(params).find(who + "`points` expected finite"),
            std::string::npos);
  params = params_;
  params.interpolation = static_cast<PathInterpolation>(7);
  EXPECT_EQ(ValidationError(params),
            who + "`interpolation` expected a PathInterpolation, got 7");
  params = params_;
  params.rotations = Eigen::Matrix3Xd::Zero(3, 2);
  EXPECT_EQ(ValidationError(params),
            who + "`rotations` expected none, or one column per time, got 2");
  params.rotations = Eigen::Matrix3Xd::Constant(3, 4, std::nan(""));
  EXPECT_NE(ValidationError(params).find("`rotations`"), std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
