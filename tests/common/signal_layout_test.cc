// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/signal_layout.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

void Visit(SignalSink* sink) {
  sink->Scalar({"scalar", "s", "", "a number"}, 7);
  sink->Vector({"vector", "m", "B", "a place"}, Vector3d(1, 2, 3));
  sink->Matrix({"matrix", "", "D", "nine numbers"},
               (Matrix3d() << 1, 2, 3, 4, 5, 6, 7, 8, 9).finished());
  sink->Rotation({"rotation", "", "B", "a quaternion"},
                 Eigen::AngleAxisd(-3.0, Vector3d::UnitX()).toRotationMatrix());
}

TEST(SignalLayoutTest, NamesAndPlacesFollowOneAnother) {
  const std::vector<SignalSlice> layout = MakeLayout(Visit);
  ASSERT_EQ(layout.size(), 4u);
  EXPECT_EQ(layout[0].name, "scalar");
  EXPECT_EQ(layout[0].unit, "s");
  EXPECT_EQ(layout[1].frame, "B");
  EXPECT_EQ(layout[1].kind, SignalKind::kVector);
  EXPECT_EQ(layout[2].meaning, "nine numbers");
  EXPECT_EQ(layout[1].start, 1);
  EXPECT_EQ(layout[1].size, 3);
  EXPECT_EQ(layout[2].start, 4);
  EXPECT_EQ(layout[2].size, 9);
  EXPECT_EQ(layout[3].start, 13);
  EXPECT_EQ(layout[3].size, 4);
  EXPECT_EQ(SizeOf(layout), 17);
}

TEST(SignalLayoutTest, ValuesAreWrittenInThatOrder) {
  VectorXd vector = VectorXd::Constant(17, -1);
  Eigen::Ref<VectorXd> ref(vector);
  SignalSink sink(&ref);
  Visit(&sink);
  EXPECT_EQ(vector(0), 7);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(vector(1 + i), i + 1);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(vector(4 + i), i + 1) << "row-major";
  EXPECT_NEAR(vector(13), std::cos(1.5), 1e-12);
  EXPECT_NEAR(vector(14), -std::sin(1.5), 1e-12);
  EXPECT_GE(vector(13), 0);
}

}  // namespace
}  // namespace dual_proxy
