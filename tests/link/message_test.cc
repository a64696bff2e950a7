// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/message.h"

#include <limits>
#include <set>

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(MessageTest, EmptyMessagesAreValidAndCarryNoSequence) {
  EXPECT_EQ(PoseMessage{}.sequence, -1);
  EXPECT_EQ(ForceMessage{}.sequence, -1);
  EXPECT_TRUE(IsValid(PoseMessage{}));
  EXPECT_TRUE(IsValid(ForceMessage{}));
}

// Whichever number of the body it is, and the time.
template <typename Content>
void ExpectEveryNumberIsChecked() {
  Content content;
  content.sequence = 1;
  const Message good = ToMessage(content);
  ASSERT_TRUE(IsFinite(good));
  ASSERT_TRUE(IsValid(FromMessage<Content>(good)));
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    Message message = good;
    message.send_time = bad;
    EXPECT_FALSE(IsFinite(message));
    EXPECT_FALSE(IsValid(FromMessage<Content>(message)));
    for (int i = 0; i < Content::kSize; ++i) {
      message = good;
      message.body[i] = bad;
      EXPECT_FALSE(IsFinite(message)) << i;
      EXPECT_FALSE(IsValid(FromMessage<Content>(message))) << i;
    }
  }
}

TEST(MessageTest, EveryNumberIsChecked) {
  ExpectEveryNumberIsChecked<PoseMessage>();
  ExpectEveryNumberIsChecked<ForceMessage>();
}

TEST(MessageTest, ContentComesBackAsItWas) {
  PoseMessage pose{.sequence = 7, .send_time = 0.14, .pose = {}};
  pose.pose.p << 0.1, -0.2, 0.3;
  pose.pose.R << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  pose.force_selection(2, 2) = 1;
  pose.moment_selection(0, 0) = 1;
  pose.contact_normals(2, 1) = -1;
  const Message message = ToMessage(pose);
  EXPECT_EQ(message.tag, PoseMessage::kTag);
  EXPECT_EQ(message.size, PoseMessage::kSize);
  const auto back = FromMessage<PoseMessage>(message);
  EXPECT_EQ(back.sequence, pose.sequence);
  EXPECT_EQ(back.send_time, pose.send_time);
  EXPECT_EQ(back.pose.p, pose.pose.p);
  EXPECT_EQ(back.pose.R, pose.pose.R);
  EXPECT_EQ(back.force_selection, pose.force_selection);
  EXPECT_EQ(back.moment_selection, pose.moment_selection);
  EXPECT_EQ(back.contact_normals, pose.contact_normals);

  const ForceMessage force{.sequence = 3, .send_time = 1, .force = {1, 2, 3}};
  const auto felt = FromMessage<ForceMessage>(ToMessage(force));
  EXPECT_EQ(felt.sequence, 3);
  EXPECT_EQ(felt.send_time, 1);
  EXPECT_EQ(felt.force, force.force);
}

// It stays a new message, so that whoever gets it counts it.
TEST(MessageTest, ContentOfAnotherKindIsNotValid) {
  const PoseMessage pose{.sequence = 7, .pose = {}};
  const auto other = FromMessage<ForceMessage>(ToMessage(pose));
  EXPECT_EQ(other.sequence, 7);
  EXPECT_FALSE(IsValid(other));
  constexpr MessageTag kTag = MakeMessageTag("a scheme's poses");
  EXPECT_FALSE(IsValid(FromMessage<PoseMessage>(ToMessage(pose, kTag))));
  EXPECT_FALSE(IsValid(FromMessage<PoseMessage>(ToMessage(pose), kTag)));
  EXPECT_TRUE(IsValid(FromMessage<PoseMessage>(ToMessage(pose, kTag), kTag)));
  Message cut = ToMessage(pose);
  --cut.size;
  EXPECT_FALSE(IsValid(FromMessage<PoseMessage>(cut)));
  // What has not come yet is of no kind, and no mistake.
  EXPECT_TRUE(IsValid(FromMessage<ForceMessage>(Message{})));
}

TEST(MessageTest, NormalsAreUnitVectorsOrNone) {
  PoseMessage pose{.sequence = 7, .pose = {}};
  pose.contact_normals.col(1) << 0.6, 0, -0.8;
  EXPECT_TRUE(IsValid(pose));
  pose.contact_normals.col(0) << 1, 0.1, 0;
  EXPECT_FALSE(IsValid(pose));
}

TEST(MessageTest, SizeBeyondTheBodyIsNotFinite) {
  for (const int size : {-1, Message::kMaxSize + 1}) {
    Message message;
    message.size = size;
    EXPECT_FALSE(IsFinite(message));
  }
}

TEST(MessageTest, TagsOfDifferentNamesDiffer) {
  const std::set<MessageTag> tags{
      PoseMessage::kTag,      ForceMessage::kTag,      MakeMessageTag(""),
      MakeMessageTag("wave"), MakeMessageTag("waves"), MakeMessageTag("evaw")};
  EXPECT_EQ(tags.size(), 6u);
  EXPECT_EQ(tags.count(0), 0u);
  EXPECT_EQ(DescribeTag(PoseMessage::kTag), "PoseMessage");
  EXPECT_EQ(DescribeTag(ForceMessage::kTag), "ForceMessage");
  EXPECT_EQ(DescribeTag(17), "a message with tag 17");
}

TEST(MessageTest, FiniteIsNotEnoughForARotationOrASelection) {
  PoseMessage message;
  message.pose.R *= 2.0;
  EXPECT_TRUE(IsFinite(ToMessage(message)));
  EXPECT_FALSE(IsValid(message));
  message = {};
  // Would amplify every force tenfold.
  message.force_selection = 10.0 * Eigen::Matrix3d::Identity();
  EXPECT_FALSE(IsValid(message));
}

TEST(MessageTest, SelectionMustBeAnOrthogonalProjection) {
  const Eigen::Vector3d n = Eigen::Vector3d(1, 2, 3).normalized();
  EXPECT_TRUE(IsSelection(Eigen::Matrix3d::Zero()));
  EXPECT_TRUE(IsSelection(Eigen::Matrix3d::Identity()));
  EXPECT_TRUE(IsSelection(n * n.transpose()));
  EXPECT_TRUE(IsSelection(Eigen::Matrix3d::Identity() - n * n.transpose()));
  Eigen::Matrix3d oblique = Eigen::Matrix3d::Zero();
  oblique(0, 0) = 1.0;
  oblique(0, 1) = 5.0;  // Idempotent, but not symmetric.
  ASSERT_TRUE((oblique * oblique).isApprox(oblique));
  EXPECT_FALSE(IsSelection(oblique));
  EXPECT_FALSE(IsSelection(0.5 * Eigen::Matrix3d::Identity()));
}

}  // namespace
}  // namespace dual_proxy
