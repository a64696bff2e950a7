// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/validate.h"

#include <limits>
#include <numbers>
#include <stdexcept>

#include <gtest/gtest.h>

#include "validation_error.h"

namespace dual_proxy {
namespace {

TEST(ValidateTest, MessageNamesWhoFieldRangeAndValue) {
  EXPECT_EQ(
      InvalidArgument([] { ThrowUnlessInRange("Who", "field", 3, 0, 2); }),
      "Who: field `field` expected a number in [0, 2], got 3");
  EXPECT_EQ(InvalidArgument([] { ThrowUnlessPositive("Who", "field", 0); }),
            "Who: field `field` expected a finite value > 0, got 0");
  EXPECT_EQ(InvalidArgument([] { ThrowUnlessNonNegative("Who", "field", -1); }),
            "Who: field `field` expected a finite value >= 0, got -1");
}

TEST(ValidateTest, ErrorHasItsParts) {
  try {
    ThrowUnlessPositive("Who", "field", 0);
    FAIL();
  } catch (const InvalidField& error) {
    EXPECT_EQ(error.field(), "field");
    EXPECT_EQ(error.problem(), "expected a finite value > 0, got 0");
  }
}

TEST(ValidateTest, EntryOutOfRangeIsNamed) {
  EXPECT_NO_THROW(
      ThrowUnlessAllInRange("Who", "field", Eigen::Vector2d(0, 2), 0, 2));
  EXPECT_EQ(InvalidArgument([] {
              ThrowUnlessAllInRange("Who", "field", Eigen::Vector3d(0, 3, -1),
                                    0, 2);
            }),
            "Who: field `field[1]` expected a number in [0, 2], got 3");
}

TEST(ValidateTest, BoundsAreInclusiveAndNanIsNeverInRange) {
  EXPECT_NO_THROW(ThrowUnlessInRange("Who", "field", 0, 0, 2));
  EXPECT_NO_THROW(ThrowUnlessInRange("Who", "field", 2, 0, 2));
  EXPECT_THROW(
      ThrowUnlessInRange("Who", "field",
                         std::numeric_limits<double>::quiet_NaN(), 0, 2),
      std::invalid_argument);
  EXPECT_THROW(ThrowUnlessPositive("Who", "field",
                                   std::numeric_limits<double>::infinity()),
               std::invalid_argument);
}

TEST(ValidateTest, OpenBoundsAreOutOfRangeAndShownSo) {
  const auto error = [](double value, Bound low, Bound high) {
    return InvalidArgument(
               [&] { ThrowUnlessInRange("Who", "x", value, low, high); })
        .substr(15);
  };
  EXPECT_NO_THROW(ThrowUnlessInRange("Who", "x", 0, 0, Open(1)));
  EXPECT_NO_THROW(ThrowUnlessInRange("Who", "x", 1, Open(0), 1));
  EXPECT_EQ(error(1, 0, Open(1)), "expected a number in [0, 1), got 1");
  EXPECT_EQ(error(0, Open(0), 1), "expected a number in (0, 1], got 0");
  EXPECT_EQ(error(2, Open(0), Open(std::numbers::pi / 2)),
            "expected a number in (0, pi/2), got 2");
}

TEST(ValidateTest, AValueIsNeverShownAsABoundThatItMisses) {
  EXPECT_EQ(
      InvalidArgument([] { ThrowUnlessInRange("Who", "x", 1 + 1e-9, 0, 1); }),
      "Who: field `x` expected a number in [0, 1], got 1.000000001");
  EXPECT_EQ(NumberText(1e-6), "1e-06");
  EXPECT_EQ(NumberText(0.1), "0.1");
  EXPECT_EQ(NumberText(1.0 / 3), "0.3333333333333333");
  EXPECT_EQ(NumberText(-std::numbers::pi), "-pi");
  EXPECT_EQ(NumberText(std::numeric_limits<double>::infinity()), "inf");
}

TEST(ValidateTest, FiniteAndRotation) {
  EXPECT_NO_THROW(ThrowUnlessFinite("Who", "p", Eigen::Vector3d::Zero()));
  EXPECT_EQ(InvalidArgument([] {
              ThrowUnlessFinite(
                  "Who", "p",
                  Eigen::Vector2d(1, std::numeric_limits<double>::infinity()));
            }),
            "Who: field `p` expected finite values, got [1, inf]");
  EXPECT_NO_THROW(ThrowUnlessRotation("Who", "R", Eigen::Matrix3d::Identity()));
  EXPECT_THROW(ThrowUnlessRotation("Who", "R", -Eigen::Matrix3d::Identity()),
               std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
