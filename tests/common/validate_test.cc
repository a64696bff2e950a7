// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/validate.h"

#include <limits>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

// The message after "Who: field `x` ", or nothing.
template <typename Value>
std::string Problem(const Value& value, const Range& range) {
  try {
    ThrowUnlessIn("Who", "x", value, range);
  } catch (const InvalidField& error) {
    EXPECT_EQ(std::string(error.what()),
              "Who: field `" + error.field() + "` " + error.problem());
    return (error.field() == "x" ? "" : error.field() + " ") + error.problem();
  }
  return "";
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(ValidateTest, MessageNamesRangeAndValue) {
  EXPECT_EQ(Problem(3.0, Between(0, 2)), "expected a number in [0, 2], got 3");
  EXPECT_EQ(Problem(0.0, Above(0)), "expected a finite value > 0, got 0");
  EXPECT_EQ(Problem(-1.0, AtLeast(0)), "expected a finite value >= 0, got -1");
  EXPECT_EQ(Problem(kNan, Finite()), "expected a finite value, got nan");
}

TEST(ValidateTest, ABoundThatIsAnotherValueIsShownByNameAndValue) {
  EXPECT_EQ(Problem(3.0, Between(0, {2, "max"})),
            "expected a number in [0, max = 2], got 3");
  EXPECT_EQ(Problem(1.0, Above({2, "low"})),
            "expected a finite value > low = 2, got 1");
  EXPECT_EQ(RangeText(Between(0, Open({2, "max"}))), "in [0, max)");
}

TEST(ValidateTest, RangesAsDocumentationShowsThem) {
  EXPECT_EQ(RangeText(Finite()), "");
  EXPECT_EQ(RangeText(AtLeast(0)), ">= 0");
  EXPECT_EQ(RangeText(Above(0.5)), "> 0.5");
  EXPECT_EQ(RangeText(Between(Open(0), std::numbers::pi)), "in (0, pi]");
  EXPECT_EQ(RangeText(Rotation()), "a rotation matrix");
}

TEST(ValidateTest, EntryOutOfRangeIsNamed) {
  EXPECT_EQ(Problem(Eigen::Vector2d(0, 2), Between(0, 2)), "");
  EXPECT_EQ(Problem(Eigen::Vector3d(0, 3, -1), Between(0, 2)),
            "x[1] expected a number in [0, 2], got 3");
}

TEST(ValidateTest, BoundsAreInclusiveAndNanIsNeverInRange) {
  EXPECT_EQ(Problem(0.0, Between(0, 2)), "");
  EXPECT_EQ(Problem(2.0, Between(0, 2)), "");
  EXPECT_NE(Problem(kNan, Between(0, 2)), "");
  EXPECT_NE(Problem(kInfinity, Above(0)), "");
  EXPECT_NE(Problem(-kInfinity, Finite()), "");
}

TEST(ValidateTest, OpenBoundsAreOutOfRangeAndShownSo) {
  EXPECT_EQ(Problem(0.0, Between(0, Open(1))), "");
  EXPECT_EQ(Problem(1.0, Between(Open(0), 1)), "");
  EXPECT_EQ(Problem(1.0, Between(0, Open(1))),
            "expected a number in [0, 1), got 1");
  EXPECT_EQ(Problem(0.0, Between(Open(0), 1)),
            "expected a number in (0, 1], got 0");
  EXPECT_EQ(Problem(2.0, Between(Open(0), Open(std::numbers::pi / 2))),
            "expected a number in (0, pi/2), got 2");
}

TEST(ValidateTest, AValueIsNeverShownAsABoundThatItMisses) {
  EXPECT_EQ(Problem(1 + 1e-9, Between(0, 1)),
            "expected a number in [0, 1], got 1.000000001");
  EXPECT_EQ(NumberText(1e-6), "1e-06");
  EXPECT_EQ(NumberText(0.1), "0.1");
  EXPECT_EQ(NumberText(1.0 / 3), "0.3333333333333333");
  EXPECT_EQ(NumberText(-std::numbers::pi), "-pi");
  EXPECT_EQ(NumberText(kInfinity), "inf");
}

TEST(ValidateTest, ZeroMayStandBesideARange) {
  const Range range = OrZero(AtLeast(0.5));
  EXPECT_EQ(RangeText(range), "0 or >= 0.5");
  EXPECT_EQ(RangeText(OrZero(Between(1, 2))), "0 or in [1, 2]");
  EXPECT_EQ(Problem(0.0, range), "");
  EXPECT_EQ(Problem(-0.0, range), "");
  EXPECT_EQ(Problem(0.5, range), "");
  EXPECT_EQ(Problem(1e-300, range),
            "expected 0 or a finite value >= 0.5, got 1e-300");
  EXPECT_EQ(Problem(3.0, OrZero(Between(1, 2))),
            "expected 0 or a number in [1, 2], got 3");
  EXPECT_NE(Problem(kNan, range), "");
}

TEST(ValidateTest, FiniteAndRotation) {
  EXPECT_EQ(Problem(Eigen::Vector3d(0, 0, 0), Finite()), "");
  EXPECT_EQ(Problem(Eigen::Vector2d(1, kInfinity), Finite()),
            "expected finite values, got [1, inf]");
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  EXPECT_EQ(Problem(identity, Rotation()), "");
  EXPECT_EQ(Problem(Eigen::Matrix3d(2 * identity), Rotation()),
            "expected a rotation matrix, got [2, 0, 0], [0, 2, 0], [0, 0, 2]");
  EXPECT_NE(Problem(Eigen::Matrix3d(-identity), Rotation()), "");
  EXPECT_NE(Problem(Eigen::Matrix3d(kNan * identity), Rotation()), "");
}

}  // namespace
}  // namespace dual_proxy
