// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/clock_offset.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Round trips at 50 Hz over a link of which everything is known.
class ClockOffsetTest : public ::testing::Test {
 protected:
  double PeerTime(double time) const { return time + offset_ + drift_ * time; }

  double OffsetNow() const { return PeerTime(time_) - time_; }

  // The other end keeps the echo for up to an interval.
  void RoundTrip() {
    const auto way = [this](double delay) {
      return delay - jitter_ * std::log(1 - random_.Uniform());
    };
    const double there = time_ + way(to_peer_);
    const double back = there + 0.02 * random_.Uniform();
    const double arrival = back + way(from_peer_);
    const double peer_there = PeerTime(there);
    const double peer_back = PeerTime(back);
    dut_.Update(arrival, time_, peer_back - peer_there, peer_back, &state_);
    time_ += 0.02;
  }

  // @returns the largest error on the way.
  double Run(int count) {
    double worst = 0;
    for (int i = 0; i < count; ++i) {
      const double before = state_.offset;
      const bool estimated = state_.estimated;
      const double last = state_.last_time;
      RoundTrip();
      if (!estimated || !state_.estimated) continue;
      worst = std::max(worst, std::abs(state_.offset - OffsetNow()));
      const double most =
          dut_.params().max_slew * std::max(0.0, state_.last_time - last);
      EXPECT_LE(std::abs(state_.offset - before), most + 1e-9);
    }
    return worst;
  }

  static ClockOffsetParams EachCounts() {
    ClockOffsetParams params;
    params.spacing = 0;
    return params;
  }

  ClockOffset dut_{EachCounts()};
  ClockOffsetState state_{dut_.MakeState()};
  RandomStream random_{3};
  double time_{1000};
  double offset_{-123.4};
  double drift_{0};
  double to_peer_{0.025};
  double from_peer_{0.025};
  double jitter_{0};
};

TEST_F(ClockOffsetTest, SaysWhenThereIsNoEstimateYet) {
  for (int i = 0; i < 9; ++i) RoundTrip();
  EXPECT_FALSE(state_.estimated);
  EXPECT_FALSE(ClockOffset::IsTrusted(state_));
  RoundTrip();
  EXPECT_TRUE(ClockOffset::IsTrusted(state_));
  EXPECT_NEAR(state_.offset, -123.4, 1e-9);
  EXPECT_NEAR(state_.round_trip, 0.05, 1e-9);
  EXPECT_NEAR(ClockOffset::ToLocal(PeerTime(7), state_), 7, 1e-9);
}

// Both ways wait 5 ms on average, exponentially.
TEST_F(ClockOffsetTest, IgnoresWhatWaited) {
  jitter_ = 0.005;
  Run(100);
  const double worst = Run(2000);
  RecordProperty("worst_us", static_cast<int>(1e6 * worst));
  // A quarter of the mean wait: single trips are off by up to 20 ms.
  EXPECT_LT(worst, 0.00125);
  EXPECT_EQ(state_.jumps, 0);
}

// What nobody can know is half the difference of both ways.
TEST_F(ClockOffsetTest, IsOffByHalfOfTheAsymmetry) {
  to_peer_ = 0.030;
  from_peer_ = 0.010;
  Run(1000);
  EXPECT_NEAR(state_.offset - OffsetNow(), 0.010, 1e-6);
  EXPECT_NEAR(state_.round_trip, 0.040, 1e-6);
  EXPECT_EQ(state_.jumps, 0);
}

TEST_F(ClockOffsetTest, FollowsClocksThatDriftApart) {
  for (const double drift : {50e-6, -200e-6}) {
    drift_ = drift;
    state_ = dut_.MakeState();
    Run(200);
    // It lags by no more than the 2 s that it looks at.
    EXPECT_LT(Run(5000), 2 * std::abs(drift) + 1e-6) << drift;
    EXPECT_EQ(state_.jumps, 0) << drift;
  }
}

// A route that is 100 ms longer one way looks like an offset of 50 ms.
TEST_F(ClockOffsetTest, ANewRouteMovesItSlowly) {
  Run(200);
  to_peer_ += 0.1;
  Run(60 * 50);  // The steps are checked on the way.
  EXPECT_EQ(state_.jumps, 0);
  EXPECT_NEAR(state_.offset - OffsetNow(), 0.05, 1e-4);
}

TEST_F(ClockOffsetTest, TellsThatAClockHasJumped) {
  for (const double jump : {0.1, -5.0, 3600.0, -0.03}) {
    state_ = dut_.MakeState();
    Run(200);
    offset_ += jump;
    int untrusted = 0;
    for (int i = 0; i < 50; ++i) {
      RoundTrip();
      if (!ClockOffset::IsTrusted(state_)) {
        ++untrusted;
      } else {
        // Never what it was before.
        EXPECT_NEAR(state_.offset, OffsetNow(), 1e-6) << jump;
      }
    }
    EXPECT_EQ(state_.jumps, 1) << jump;
    EXPECT_EQ(untrusted,
              ClockOffset::kContradictions + dut_.params().min_samples - 2)
        << jump;
  }
}

// The own clock goes back, also while a frame is under way.
TEST_F(ClockOffsetTest, TellsThatTheOwnClockHasJumped) {
  Run(200);
  dut_.Update(time_ - 2, time_, 0, PeerTime(time_ + 0.025), &state_);
  EXPECT_EQ(state_.bad_inputs, 1);
  offset_ += 2 + 2 * drift_;
  time_ -= 2;
  Run(50);
  EXPECT_EQ(state_.jumps, 1);
  EXPECT_NEAR(state_.offset, OffsetNow(), 1e-6);
}

TEST_F(ClockOffsetTest, ASingleContradictionIsForgotten) {
  Run(200);
  const double before = state_.offset;
  dut_.Update(time_ + 0.05, time_, 0, PeerTime(time_ + 0.025) + 1, &state_);
  EXPECT_FALSE(ClockOffset::IsTrusted(state_));
  EXPECT_EQ(state_.offset, before);
  RoundTrip();
  EXPECT_TRUE(ClockOffset::IsTrusted(state_));
  EXPECT_EQ(state_.jumps, 0);
}

// An hour without a word, in which clocks drift.
TEST_F(ClockOffsetTest, SilenceIsNoJump) {
  drift_ = 1e-4;
  Run(200);
  time_ += 3600;
  Run(300);
  EXPECT_EQ(state_.jumps, 0);
  EXPECT_NEAR(state_.offset, OffsetNow(), 2e-4);
}

TEST_F(ClockOffsetTest, RefusesWhatIsNoRoundTrip) {
  Run(100);
  const ClockOffsetState before = state_;
  const double huge = std::numeric_limits<double>::max();
  for (const double bad :
       {kNan, std::numeric_limits<double>::infinity(), huge, -huge}) {
    dut_.Update(bad, time_, 0, PeerTime(time_), &state_);
    dut_.Update(time_, bad, 0, PeerTime(time_), &state_);
    dut_.Update(time_, time_, bad, PeerTime(time_), &state_);
  }
  dut_.Update(time_, time_, 0, kNan, &state_);
  dut_.Update(time_, time_ - 1, -0.1, PeerTime(time_), &state_);
  dut_.Update(time_, time_ - 1, 1.1, PeerTime(time_), &state_);
  EXPECT_EQ(state_.offset, before.offset);
  EXPECT_EQ(state_.jumps, 0);
  EXPECT_GE(state_.bad_inputs, 12);
  Run(100);
  EXPECT_NEAR(state_.offset, OffsetNow(), 1e-6);
}

// Five hundred that come at once after a second and a half.
TEST_F(ClockOffsetTest, ABurstIsOneRoundTrip) {
  Run(200);
  const double start = time_;
  const ClockOffset dut{ClockOffsetParams{}};
  for (int i = 0; i < 500; ++i) {
    dut.Update(start + 1.5 + 1e-5 * i, start + 0.002 * i, 0,
               PeerTime(start + 0.002 * i + 0.025), &state_);
  }
  EXPECT_EQ(state_.jumps, 0);
  EXPECT_NEAR(state_.round_trip, 0.05, 1e-6);
}

TEST_F(ClockOffsetTest, AllocatesNothing) {
  Run(100);
  ScopedNoAlloc guard;
  Run(300);
  EXPECT_EQ(guard.count(), 0);
}

TEST(ClockOffsetParamsTest, NamesTheField) {
  ClockOffsetParams params;
  params.samples = 101;
  EXPECT_EQ(ValidationError(params),
            "ClockOffsetParams: field `samples` expected a number in [1, 100], "
            "got 101");
  params = {.samples = 5};
  EXPECT_EQ(ValidationError(params),
            "ClockOffsetParams: field `min_samples` expected a number in [1, "
            "samples = 5], got 10");
  EXPECT_EQ(ValidationError(ClockOffsetParams{}), "no exception");
}

}  // namespace
}  // namespace dual_proxy
