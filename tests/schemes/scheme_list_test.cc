// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/schemes.h"

#include <set>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "validation_error.h"

namespace dual_proxy {
namespace {

TEST(SchemeListTest, NamesAreUniqueAndThoseOfTheEnum) {
  std::set<std::string> names;
  Schemes::ForEach([&]<typename S>() {
    EXPECT_TRUE(names.insert(S::kName).second) << S::kName;
    const auto& [value, name] =
        EnumStrings<Scheme>::kValues[Schemes::IndexOf<S>()];
    EXPECT_EQ(value, SchemeOf<S>);
    EXPECT_STREQ(name, S::kName);
    EXPECT_EQ(UsesSelections(SchemeOf<S>), S::kUsesSelections);
    EXPECT_EQ(ToRobotTag(SchemeOf<S>), S::kToRobot);
    EXPECT_EQ(ToDeviceTag(SchemeOf<S>), S::kToDevice);
  });
  EXPECT_EQ(names.size(), Schemes::kSize);
}

// Two schemes may send a pose or a force, with the same meaning; what is of one
// scheme alone is of no other.
TEST(SchemeListTest, TagsThatAreNotShared) {
  const std::set<MessageTag> shared{PoseMessage::kTag, ForceMessage::kTag};
  EXPECT_EQ(shared.size(), 2u);
  std::set<MessageTag> seen;
  Schemes::ForEach([&]<typename S>() {
    for (const MessageTag tag :
         std::set<MessageTag>{S::kToRobot, S::kToDevice}) {
      if (shared.contains(tag)) continue;
      EXPECT_TRUE(seen.insert(tag).second) << S::kName;
    }
  });
}

// What a half sends has the tag that the scheme says, and the other side's half
// takes it; that of no other kind.
TEST(SchemeListTest, HalvesUnderstandEachOtherAndNobodyElse) {
  Schemes::ForEach([]<typename S>() {
    const int scheme = Schemes::IndexOf<S>();
    const auto robot = Schemes::MakeRobotHalf(scheme, {}, {});
    const auto haptic = Schemes::MakeHapticHalf(scheme, {}, {});
    auto robot_state = robot.MakeState();
    auto haptic_state = haptic.MakeState();
    robot.Update(0, {}, &robot_state);
    haptic.Update(0, {}, &haptic_state);
    Message to_device = robot_state.output().message;
    Message to_robot = haptic_state.output().message;
    EXPECT_EQ(to_device.sequence, 0) << S::kName;
    EXPECT_EQ(to_device.tag, S::kToDevice) << S::kName;
    EXPECT_EQ(to_robot.tag, S::kToRobot) << S::kName;
    robot.Update(0.001, {.message = to_robot, .X_BE = {}}, &robot_state);
    haptic.Update(0.001, {.message = to_device, .X_DH = {}}, &haptic_state);
    EXPECT_EQ(robot_state.output().link.status, LinkStatus::kConnected);
    EXPECT_EQ(haptic_state.output().link.status, LinkStatus::kConnected);
    for (Message* message : {&to_device, &to_robot}) {
      message->tag = MakeMessageTag("of something else");
      message->sequence = 1;
      message->send_time = 0.001;
    }
    robot.Update(0.002, {.message = to_robot, .X_BE = {}}, &robot_state);
    haptic.Update(0.002, {.message = to_device, .X_DH = {}}, &haptic_state);
    EXPECT_EQ(robot_state.output().link.bad_inputs, 1) << S::kName;
    EXPECT_EQ(haptic_state.output().link.bad_inputs, 1) << S::kName;
  });
}

TEST(SchemeListTest, UnknownPlaceIsAnError) {
  EXPECT_EQ(InvalidArgument([] { Schemes::MakeRobotHalf(99, {}, {}); }),
            "scheme: expected a scheme's place in the list, 0 to " +
                std::to_string(Schemes::kSize - 1) + ", got 99");
  EXPECT_THROW(Schemes::MakeHapticHalf(-1, {}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
