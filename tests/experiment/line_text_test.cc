// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/line_text.h"

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

TEST(LineTextTest, CutsNoCharacterInTwo) {
  const std::string text = "a\u00e9\u20acz";  // 1, 2, 3 and 1 bytes.
  EXPECT_EQ(StartOf(text, 7), text);
  EXPECT_EQ(StartOf(text, 100), text);
  EXPECT_EQ(StartOf(text, 6), "a\u00e9\u20ac");
  EXPECT_EQ(StartOf(text, 5), "a\u00e9");
  EXPECT_EQ(StartOf(text, 3), "a\u00e9");
  EXPECT_EQ(StartOf(text, 2), "a");
  EXPECT_EQ(StartOf(text, 0), "");
}

TEST(LineTextTest, IsALineOfSomeLength) {
  EXPECT_EQ(LineText("plane.seed: expected", 100), "plane.seed: expected");
  EXPECT_EQ(LineText("a\nb\r\tc\x7F", 100), "a b  c ");
  EXPECT_EQ(LineText("a\u00e9b", 2), "a...");
  EXPECT_EQ(LineText("", 0), "");
}

}  // namespace
}  // namespace dual_proxy
