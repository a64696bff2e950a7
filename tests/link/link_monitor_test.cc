// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/link_monitor.h"

#include <limits>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using StatusVector = Eigen::Matrix<double, kLinkStatusSize, 1>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class LinkMonitorTest : public ::testing::Test {
 protected:
  bool Update(double time, std::int64_t sequence, double send_time,
              bool valid = true) {
    return dut_.Update(time, sequence, send_time, valid, &state_);
  }

  const LinkMonitor dut_{LinkMonitorParams{}};
  LinkMonitorState state_{dut_.MakeState()};
};

TEST_F(LinkMonitorTest, WaitsForTheFirstMessageForEver) {
  for (const double time : {0.0, 1.0, 100.0}) {
    EXPECT_FALSE(Update(time, -1, 0.0));
    EXPECT_EQ(state_.status, LinkStatus::kWaiting);
  }
  EXPECT_EQ(state_.losses, 0);
  EXPECT_EQ(state_.age, 0.0);
}

TEST_F(LinkMonitorTest, AcceptsAMessageOnceAndGivesItsAge) {
  EXPECT_TRUE(Update(10.0, 7, 9.9));
  EXPECT_EQ(state_.status, LinkStatus::kConnected);
  EXPECT_NEAR(state_.age, 0.1, 1e-12);
  EXPECT_FALSE(Update(10.01, 7, 9.9));
  EXPECT_NEAR(state_.age, 0.11, 1e-12);
  EXPECT_EQ(state_.received, 1);
  EXPECT_EQ(state_.dropped, 0);
}

// Its own clock was wrong for a while, with a message in it.
TEST_F(LinkMonitorTest, TimeThatGoesBackHoldsNoLossUp) {
  Update(0.0, 0, 0.0);
  EXPECT_TRUE(Update(3.0, 1, 0.02));
  EXPECT_TRUE(Update(0.04, 2, 0.04));
  EXPECT_EQ(state_.status, LinkStatus::kConnected);
  Update(0.55, 2, 0.04);
  EXPECT_EQ(state_.status, LinkStatus::kLost);
  state_ = dut_.MakeState();
  Update(3.0, 0, 0.0);
  Update(0.1, 0, 0.0);
  Update(0.7, 0, 0.0);
  EXPECT_EQ(state_.status, LinkStatus::kLost);
}

// The sender's was: stamps within max_age, and beyond.
TEST_F(LinkMonitorTest, AStampAheadOfTimeHoldsNothingUp) {
  for (const double ahead : {3.0, 100.0, 1e300}) {
    state_ = dut_.MakeState();
    EXPECT_TRUE(Update(1.0, 0, 1.0));
    EXPECT_EQ(Update(1.02, 1, 1.02 + ahead), ahead < 5);
    for (int i = 2; i < 10; ++i) {
      EXPECT_TRUE(Update(1 + 0.02 * i, i, 1 + 0.02 * i)) << ahead;
    }
    EXPECT_EQ(state_.spikes, 0) << ahead;
    EXPECT_EQ(state_.dropped, ahead < 5 ? 0 : 1);
    EXPECT_EQ(state_.status, LinkStatus::kConnected);
  }
}

TEST_F(LinkMonitorTest, IsLostAfterTheTimeoutAndComesBack) {
  Update(0.0, 0, 0.0);
  Update(0.5, 0, 0.0);
  EXPECT_EQ(state_.status, LinkStatus::kConnected);
  Update(0.501, 0, 0.0);
  EXPECT_EQ(state_.status, LinkStatus::kLost);
  Update(3.0, 0, 0.0);
  EXPECT_EQ(state_.losses, 1);
  EXPECT_TRUE(Update(3.1, 1, 3.0));
  EXPECT_EQ(state_.status, LinkStatus::kConnected);
  EXPECT_EQ(state_.losses, 1);
}

TEST_F(LinkMonitorTest, SilenceIsCountedFromTheArrivalNotFromTheSending) {
  // A constant delay longer than the timeout is no loss.
  for (int k = 0; k < 100; ++k) {
    EXPECT_TRUE(Update(0.1 * k + 1.5, k, 0.1 * k));
    EXPECT_EQ(state_.status, LinkStatus::kConnected);
  }
  EXPECT_EQ(state_.losses, 0);
}

TEST_F(LinkMonitorTest, DropsWhatComesOutOfOrder) {
  Update(0.0, 5, 0.0);
  EXPECT_FALSE(Update(0.01, 4, -0.02));
  EXPECT_FALSE(Update(0.02, 4, -0.02));  // The same one, still held.
  EXPECT_EQ(state_.dropped, 1);
  EXPECT_EQ(state_.last_sequence, 5);
  EXPECT_TRUE(Update(0.03, 6, 0.02));
  EXPECT_EQ(state_.gaps, 0);
}

TEST_F(LinkMonitorTest, DropsWhatIsTooOldOrFromTheFuture) {
  EXPECT_FALSE(Update(10.0, 0, 4.9));
  EXPECT_FALSE(Update(10.0, 1, 15.1));
  EXPECT_EQ(state_.dropped, 2);
  EXPECT_EQ(state_.status, LinkStatus::kWaiting);
  EXPECT_TRUE(Update(10.0, 2, 5.1));
}

TEST_F(LinkMonitorTest, OldMessagesDoNotKeepTheLinkAlive) {
  Update(10.0, 0, 10.0);
  for (int k = 1; k < 100; ++k) Update(10.0 + 0.02 * k, k, 1.0);
  EXPECT_EQ(state_.status, LinkStatus::kLost);
  EXPECT_EQ(state_.dropped, 99);
}

TEST_F(LinkMonitorTest, CountsGapsAndSpikes) {
  Update(0.05, 0, 0.0);
  EXPECT_TRUE(Update(0.10, 3, 0.05));
  EXPECT_EQ(state_.gaps, 2);
  EXPECT_EQ(state_.spikes, 0);
  EXPECT_TRUE(Update(0.30, 4, 0.10));  // 0.2 s old, the fastest was 0.05 s.
  EXPECT_EQ(state_.spikes, 1);
  EXPECT_TRUE(Update(0.31, 5, 0.26));
  EXPECT_EQ(state_.spikes, 1);
}

TEST_F(LinkMonitorTest, InvalidMessagesAreRefusedAndDoNotBlockLaterOnes) {
  EXPECT_FALSE(Update(0.0, 0, 0.0, false));
  EXPECT_FALSE(Update(0.001, 0, 0.0, false));
  EXPECT_FALSE(Update(0.02, 1, kNan));
  EXPECT_FALSE(Update(0.02, -5, 0.0));
  EXPECT_EQ(state_.bad_inputs, 3);
  EXPECT_EQ(state_.status, LinkStatus::kWaiting);
  EXPECT_TRUE(Update(0.04, 2, 0.04));
  EXPECT_FALSE(Update(kNan, 3, 0.06));
  EXPECT_EQ(state_.bad_inputs, 4);
  EXPECT_TRUE(Update(0.06, 3, 0.06));
}

TEST_F(LinkMonitorTest, ARestartedSenderIsAcceptedOnceTheLinkIsLost) {
  Update(0.0, 500, 0.0);
  EXPECT_FALSE(Update(0.1, 0, 0.1));  // Might be a late message of the old one.
  Update(0.6, 0, 0.1);
  ASSERT_EQ(state_.status, LinkStatus::kLost);
  EXPECT_FALSE(Update(0.61, 499, -0.02));  // This one is.
  EXPECT_TRUE(Update(0.62, 1, 0.62));
  EXPECT_EQ(state_.status, LinkStatus::kConnected);
  EXPECT_TRUE(Update(0.64, 2, 0.64));
  EXPECT_EQ(state_.gaps, 0);
}

TEST_F(LinkMonitorTest, AForgedSequenceNumberNeitherOverflowsNorBlocksForGood) {
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  Update(0.0, 0, 0.0);
  EXPECT_TRUE(Update(0.02, kMax, 0.02));
  EXPECT_EQ(state_.gaps, kMax - 1);
  EXPECT_FALSE(Update(0.04, 2, 0.04));
  Update(0.6, 2, 0.04);
  EXPECT_TRUE(Update(0.62, 31, 0.62));
  EXPECT_TRUE(Update(0.64, kMax, 0.64));
  EXPECT_EQ(state_.gaps, kMax);
}

TEST_F(LinkMonitorTest, RandomTrafficNeverStepsBack) {
  RandomStream random(8);
  std::int64_t first = -1, last = -1;
  std::int64_t offered = 0, previous = -1;
  for (int i = 0; i < 10'000; ++i) {
    const double time = 0.02 * i;
    const auto sequence =
        static_cast<std::int64_t>(i + 3.0 * random.Normal() + 100.0);
    const bool valid = random.Uniform() > 0.1;
    if (sequence != previous) ++offered;
    previous = sequence;
    if (Update(time, sequence, time - 0.3 * random.Uniform(), valid)) {
      ASSERT_TRUE(valid);
      ASSERT_GT(sequence, last) << i;
      if (first < 0) first = sequence;
      last = sequence;
    }
    ASSERT_NE(state_.status, LinkStatus::kLost) << i;
  }
  EXPECT_EQ(state_.received + state_.dropped + state_.bad_inputs, offered);
  EXPECT_EQ(state_.received + state_.gaps, last - first + 1);
}

TEST_F(LinkMonitorTest, DoesNotAllocate) {
  ScopedNoAlloc guard;
  for (int k = 0; k < 100; ++k) Update(0.1 * k, k, 0.1 * k);
  EXPECT_EQ(guard.count(), 0);
}

TEST(LinkMonitorParamsTest, InvalidParametersAreNamed) {
  const auto message = [](double LinkMonitorParams::* field, double value) {
    LinkMonitorParams params;
    params.*field = value;
    return InvalidArgument([&] { LinkMonitor{params}; });
  };
  EXPECT_NE(message(&LinkMonitorParams::timeout, 0.0)
                .find("LinkMonitorParams: field `timeout`"),
            std::string::npos);
  EXPECT_NE(message(&LinkMonitorParams::max_age, -1.0).find("`max_age`"),
            std::string::npos);
  EXPECT_NE(message(&LinkMonitorParams::max_age, -1.0).find("-1"),
            std::string::npos);
  EXPECT_NE(message(&LinkMonitorParams::spike_threshold, kNan)
                .find("`spike_threshold`"),
            std::string::npos);
}

TEST_F(LinkMonitorTest, StatusAsAVectorHasAllThatIsCounted) {
  EXPECT_EQ(LinkStatusVector(state_),
            (StatusVector() << 0, 0, 0, 0, 0, 0, 0).finished());
  state_.status = LinkStatus::kLost;
  state_.age = 0.25;
  state_.received = 3;
  state_.dropped = 4;
  state_.gaps = 5;
  state_.spikes = 6;
  state_.losses = 7;
  EXPECT_EQ(LinkStatusVector(state_),
            (StatusVector() << 2, 0.25, 3, 4, 5, 6, 7).finished());
}

}  // namespace
}  // namespace dual_proxy
