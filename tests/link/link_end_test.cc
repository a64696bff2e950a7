// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/link_end.h"

#include <cmath>
#include <deque>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/schemes/dual_proxy/scheme.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPeriod = 0.01;

Message MakeMessage(std::int64_t sequence, double send_time) {
  PoseMessage content;
  content.sequence = sequence;
  content.send_time = send_time;
  return ToMessage(content);
}

// A process with a clock of its own; every second period has a new message.
struct Process {
  Process(LinkDirection sends, std::uint64_t session, double clock)
      : end(sends, LinkMonitorParams{}, LinkEndParams{}),
        state(end.MakeState(session)),
        clock_offset(clock) {}

  double Clock(double time) const { return time + clock_offset; }

  // What it sends in a period, if anything.
  bool Send(double time) {
    if (ticks++ % 2 == 0) message = MakeMessage(++sequence, Clock(time));
    return end.Send(Clock(time), message, flags, &state);
  }

  FrameVerdict Receive(double time, std::span<const std::uint8_t> bytes) {
    return end.Receive(Clock(time), bytes, &state);
  }

  // What its half does.
  bool Monitor(double time) {
    return monitor.Update(Clock(time), FromMessage<PoseMessage>(state.message),
                          &link);
  }

  std::int64_t verdicts(FrameVerdict verdict) const {
    return state.verdicts[static_cast<std::size_t>(verdict)];
  }

  LinkEnd end;
  LinkEndState state;
  double clock_offset;
  LinkMonitor monitor{LinkMonitorParams{}};
  LinkMonitorState link;
  Message message{};
  std::uint32_t flags{0};
  std::int64_t sequence{-1};
  int ticks{0};
};

struct Frame {
  double arrival;
  FrameBytes bytes;
};

class LinkEndTest : public ::testing::Test {
 protected:
  static Process MakeHaptic(std::uint64_t session) {
    return {LinkDirection::kToRobot, session, 5000.0};
  }

  // One period of both, over a link with a delay.
  void Step() {
    time_ += kPeriod;
    if (haptic_runs_ && haptic_.Send(time_) && to_robot_works_) {
      to_robot_.push_back({time_ + delay_, haptic_.state.bytes});
      recorded_.push_back(haptic_.state.bytes);
    }
    if (robot_.Send(time_) && to_haptic_works_) {
      to_haptic_.push_back({time_ + delay_, robot_.state.bytes});
    }
    Deliver(&to_robot_, &robot_);
    if (haptic_runs_) Deliver(&to_haptic_, &haptic_);
    robot_.Monitor(time_);
    if (haptic_runs_) haptic_.Monitor(time_);
  }

  // A transport keeps the newest.
  void Deliver(std::deque<Frame>* frames, Process* process) {
    while (frames->size() > 16 && (*frames)[16].arrival <= time_) {
      frames->pop_front();
    }
    while (!frames->empty() && frames->front().arrival <= time_) {
      process->Receive(time_, frames->front().bytes);
      frames->pop_front();
    }
  }

  void Run(double duration) {
    for (int i = 0; i < std::lround(duration / kPeriod); ++i) Step();
  }

  // As its successor, which knows nothing of what was before.
  void RestartHaptic(std::uint64_t session) {
    haptic_ = MakeHaptic(session);
    to_haptic_.clear();
  }

  double time_{0};
  double delay_{0.05};
  bool to_robot_works_{true};
  bool to_haptic_works_{true};
  bool haptic_runs_{true};
  Process robot_{LinkDirection::kToHaptic, 11, 100.0};
  Process haptic_{MakeHaptic(22)};
  std::deque<Frame> to_robot_;
  std::deque<Frame> to_haptic_;
  std::vector<FrameBytes> recorded_;  // What the haptic side has sent.
};

TEST_F(LinkEndTest, MessagesComeWithTimesByTheOwnClock) {
  haptic_.flags = kLinkClutch;
  Run(2);
  EXPECT_EQ(robot_.link.status, LinkStatus::kConnected);
  EXPECT_EQ(haptic_.link.status, LinkStatus::kConnected);
  EXPECT_TRUE(robot_.end.IsConnected(robot_.Clock(time_), robot_.state));
  EXPECT_NEAR(robot_.state.clock.offset, 4900, 1e-9);
  EXPECT_NEAR(robot_.state.clock.round_trip, 0.1, 1e-9);
  EXPECT_NEAR(robot_.link.min_age, 0.05, 1e-9);
  EXPECT_EQ(robot_.state.flags, kLinkClutch);
  EXPECT_EQ(robot_.verdicts(FrameVerdict::kMalformed), 0);
  EXPECT_EQ(robot_.state.lost, 0);
  EXPECT_GT(robot_.verdicts(FrameVerdict::kAccepted), 80);
  // A round trip until the robot knows that it is heard, and ten for clocks.
  EXPECT_GE(robot_.verdicts(FrameVerdict::kUntimed), 9);
  EXPECT_LE(robot_.verdicts(FrameVerdict::kUntimed), 12);
  EXPECT_GT(robot_.verdicts(FrameVerdict::kUnproven), 0);
}

TEST_F(LinkEndTest, SendsWhatIsNewAtOnceAndElseTheSameAgain) {
  LinkEnd dut(LinkDirection::kToRobot, LinkMonitorParams{}, LinkEndParams{});
  LinkEndState state = dut.MakeState(1);
  const Message none{};
  EXPECT_TRUE(dut.Send(10.0, none, 0, &state));
  EXPECT_FALSE(dut.Send(10.001, none, 0, &state));
  EXPECT_TRUE(dut.Send(10.002, MakeMessage(0, 10.002), 0, &state));
  EXPECT_FALSE(dut.Send(10.003, MakeMessage(0, 10.002), 0, &state));
  EXPECT_TRUE(dut.Send(10.004, MakeMessage(0, 10.002), kLinkFault, &state));
  EXPECT_FALSE(dut.Send(10.022, MakeMessage(0, 10.002), kLinkFault, &state));
  EXPECT_TRUE(dut.Send(10.025, MakeMessage(0, 10.002), kLinkFault, &state));
  LinkFrame frame;
  ASSERT_EQ(DecodeFrame(state.bytes, LinkDirection::kToRobot, &frame),
            WireError::kNone);
  EXPECT_EQ(frame.number, 3u);
  EXPECT_EQ(frame.message.sequence, 0);
  EXPECT_EQ(frame.flags, kLinkFault);
  EXPECT_EQ(state.sent, 4);
  // Its clock went back by an hour.
  EXPECT_FALSE(dut.Send(-3600, MakeMessage(0, 10.002), kLinkFault, &state));
  EXPECT_TRUE(dut.Send(-3599.97, MakeMessage(0, 10.002), kLinkFault, &state));
  EXPECT_FALSE(dut.Send(kNan, MakeMessage(1, 0), 0, &state));
  EXPECT_EQ(state.bad_inputs, 1);
}

TEST_F(LinkEndTest, EachFramePassesOnceAndInOrder) {
  Run(2);
  const auto before = robot_.state;
  const std::size_t count = recorded_.size();
  for (const FrameBytes& bytes : recorded_) {
    if (&bytes - recorded_.data() + 10 > static_cast<long>(count)) break;
    EXPECT_EQ(robot_.Receive(time_, bytes), FrameVerdict::kReplayed);
  }
  EXPECT_EQ(robot_.state.message.sequence, before.message.sequence);
  EXPECT_EQ(robot_.state.heard_time, before.heard_time);
  // Two that overtake one another.
  FrameBytes first{};
  FrameBytes second{};
  time_ += kPeriod;
  while (!haptic_.Send(time_)) time_ += kPeriod;
  first = haptic_.state.bytes;
  time_ += 2 * kPeriod;
  while (!haptic_.Send(time_)) time_ += kPeriod;
  second = haptic_.state.bytes;
  EXPECT_EQ(robot_.Receive(time_, second), FrameVerdict::kAccepted);
  EXPECT_EQ(robot_.Receive(time_, first), FrameVerdict::kReplayed);
}

TEST_F(LinkEndTest, WhatIsThrownBackIsRefused) {
  Run(2);
  EXPECT_EQ(robot_.Receive(time_, robot_.state.bytes),
            FrameVerdict::kMalformed);
  const auto direction = static_cast<std::size_t>(WireError::kDirection);
  EXPECT_EQ(robot_.state.malformed[direction], 1);
  // Also with the direction forged: it is no session that echoes this one.
  FrameBytes forged = robot_.state.bytes;
  forged[6] = 1;
  EXPECT_EQ(robot_.Receive(time_, forged), FrameVerdict::kOtherSession);
}

// All of a run, to a robot side that was started after it.
TEST_F(LinkEndTest, AnEarlierRunIsNoProof) {
  Run(2);
  for (const double later : {0.0, 1.0, 1000.0, -1.5}) {
    Process robot(LinkDirection::kToHaptic, 12, 100.0);
    for (const FrameBytes& bytes : recorded_) {
      robot.Send(time_ + later);
      EXPECT_EQ(robot.Receive(time_ + later, bytes), FrameVerdict::kUnproven);
    }
    EXPECT_EQ(robot.state.message.sequence, -1);
  }
  // And to the one that it was meant for, when the sender has died.
  haptic_runs_ = false;
  Run(3);
  const std::int64_t accepted = robot_.verdicts(FrameVerdict::kAccepted);
  for (const FrameBytes& bytes : recorded_) robot_.Receive(time_, bytes);
  EXPECT_EQ(robot_.verdicts(FrameVerdict::kAccepted), accepted);
}

TEST_F(LinkEndTest, ARestartedSenderComesBackWhenItsLinkIsLost) {
  Run(2);
  const std::int64_t sequence = robot_.link.last_sequence;
  EXPECT_GT(sequence, 50);
  RestartHaptic(23);
  Run(0.4);
  EXPECT_EQ(robot_.state.peer, 22u);
  EXPECT_GT(robot_.verdicts(FrameVerdict::kOtherSession), 10);
  Run(0.6);
  EXPECT_EQ(robot_.state.peer, 23u);
  EXPECT_EQ(robot_.link.losses, 1);
  EXPECT_EQ(robot_.link.status, LinkStatus::kConnected);
  EXPECT_LT(robot_.link.last_sequence, sequence);
  EXPECT_NEAR(robot_.link.min_age, 0.05, kPeriod);
  EXPECT_EQ(haptic_.link.status, LinkStatus::kConnected);
  // What died is never heard again, however silent the other gets.
  const std::vector<FrameBytes> old(recorded_.begin(), recorded_.begin() + 50);
  haptic_runs_ = false;
  Run(2);
  for (const FrameBytes& bytes : old) {
    EXPECT_EQ(robot_.Receive(time_, bytes), FrameVerdict::kOtherSession);
  }
  EXPECT_EQ(robot_.state.peer, 23u);
}

TEST_F(LinkEndTest, OfTwoSendersTheFirstStays) {
  Run(2);
  Process second = MakeHaptic(24);
  for (int i = 0; i < 300; ++i) {
    Step();
    // It hears the robot, and is proven.
    second.Receive(time_, robot_.state.bytes);
    if (second.Send(time_)) {
      EXPECT_EQ(robot_.Receive(time_, second.state.bytes),
                FrameVerdict::kOtherSession);
    }
  }
  EXPECT_EQ(robot_.state.peer, 22u);
  EXPECT_EQ(robot_.link.losses, 0);
  EXPECT_EQ(second.state.message.sequence, -1);
}

TEST_F(LinkEndTest, FailsBothWaysIfItFailsOneWay) {
  Run(2);
  to_haptic_works_ = false;
  Run(0.7);
  EXPECT_EQ(haptic_.link.status, LinkStatus::kLost);
  Run(0.5);
  EXPECT_EQ(robot_.link.status, LinkStatus::kLost);
  EXPECT_GT(robot_.verdicts(FrameVerdict::kStale), 5);
  EXPECT_FALSE(robot_.end.IsConnected(robot_.Clock(time_), robot_.state));
  to_haptic_works_ = true;
  Run(0.5);
  EXPECT_EQ(haptic_.link.status, LinkStatus::kConnected);
  EXPECT_EQ(robot_.link.status, LinkStatus::kConnected);
  EXPECT_EQ(robot_.state.peer, 22u);
}

// It stands still for 5 s, and finds everything that was sent meanwhile.
TEST_F(LinkEndTest, ABacklogIsNotActedOn) {
  Run(2);
  haptic_runs_ = false;
  Run(5);
  EXPECT_EQ(robot_.link.status, LinkStatus::kLost);
  EXPECT_GT(to_haptic_.size(), 200u);
  const std::int64_t accepted = haptic_.verdicts(FrameVerdict::kAccepted);
  haptic_runs_ = true;
  Step();
  // The robot side has not heard it for long.
  EXPECT_EQ(haptic_.verdicts(FrameVerdict::kAccepted), accepted);
  EXPECT_EQ(haptic_.link.status, LinkStatus::kLost);
  Run(0.3);
  EXPECT_GE(haptic_.state.message.sequence, robot_.sequence - 4);
  Run(1);
  EXPECT_EQ(haptic_.link.status, LinkStatus::kConnected);
  EXPECT_EQ(robot_.link.status, LinkStatus::kConnected);
  EXPECT_EQ(robot_.state.clock.jumps, 0);
  EXPECT_LT(robot_.link.age, 0.1);
}

// The network holds everything back for a while, both ways.
TEST_F(LinkEndTest, WhatWasHeldBackIsNotActedOn) {
  for (const double held : {0.2, 3.0}) {
    Run(2);
    const double normal = delay_;
    for (Frame& frame : to_robot_) frame.arrival += held;
    delay_ += held;
    Run(0.1);
    delay_ = normal;
    const auto before = robot_.verdicts(FrameVerdict::kStale);
    time_ += held - 0.1;  // Nothing is made meanwhile.
    Run(0.04);
    EXPECT_EQ(robot_.verdicts(FrameVerdict::kStale) > before, held > 1) << held;
    EXPECT_EQ(robot_.link.status == LinkStatus::kLost, held > 1) << held;
    Run(1);
    EXPECT_EQ(robot_.link.status, LinkStatus::kConnected) << held;
    EXPECT_EQ(robot_.state.clock.jumps, 0) << held;
  }
}

TEST_F(LinkEndTest, WhatIsSkippedIsCounted) {
  Run(2);
  to_robot_works_ = false;
  Run(0.2);
  to_robot_works_ = true;
  Run(0.3);
  EXPECT_EQ(robot_.state.lost, 10);
  EXPECT_EQ(robot_.link.status, LinkStatus::kConnected);
}

// Whichever clock it is, the ages that a LinkMonitor sees do not jump.
TEST_F(LinkEndTest, AClockThatJumpsMakesNoAges) {
  for (Process* process : {&haptic_, &robot_}) {
    for (const double jump : {2.0, -2.0, 500.0}) {
      Run(2);
      process->clock_offset += jump;
      const std::int64_t jumps =
          robot_.state.clock.jumps + haptic_.state.clock.jumps;
      // The own clock is the monitor's, too.
      Process* other = process == &haptic_ ? &robot_ : &haptic_;
      for (int i = 0; i < 200; ++i) {
        Step();
        EXPECT_LT(std::abs(other->link.age), 0.6) << jump;
      }
      EXPECT_EQ(other->link.status, LinkStatus::kConnected);
      EXPECT_EQ(process->link.status, LinkStatus::kConnected) << jump;
      EXPECT_EQ(robot_.state.clock.jumps + haptic_.state.clock.jumps,
                jumps + 2);
      EXPECT_NEAR(other->link.age, 0.05, 0.03);
    }
  }
}

// Decoded, of a live sender, in order: still not everything may be acted on.
TEST_F(LinkEndTest, AHalfRefusesWhatMakesNoSense) {
  const DualProxyRobotHalf half(RobotHalfParams{});
  auto state = half.MakeState();
  Run(2);
  std::int64_t sequence = haptic_.sequence;
  const auto pass = [&](const auto& change, MessageTag tag) {
    time_ += 0.02;
    PoseMessage content;
    content.sequence = ++sequence;
    content.send_time = haptic_.Clock(time_);
    change(&content);
    haptic_.end.Send(haptic_.Clock(time_), ToMessage(content, tag), 0,
                     &haptic_.state);
    haptic_.Receive(time_, robot_.state.bytes);
    robot_.end.Send(robot_.Clock(time_), {}, 0, &robot_.state);
    EXPECT_EQ(robot_.Receive(time_, haptic_.state.bytes),
              FrameVerdict::kAccepted);
    RobotHalfInput input{.message = robot_.state.message};
    half.Update(robot_.Clock(time_), input, &state);
    return state.output.link.last_sequence == sequence;
  };
  const MessageTag tag = PoseMessage::kTag;
  const auto nothing = [](PoseMessage*) {};
  EXPECT_TRUE(pass(nothing, tag));
  EXPECT_FALSE(pass([](PoseMessage* m) { m->pose.R *= 1.1; }, tag));
  EXPECT_FALSE(pass([](PoseMessage* m) { m->pose.R.col(0) *= -1; }, tag));
  EXPECT_FALSE(pass([](PoseMessage* m) { m->pose.p.x() = 1e6; }, tag));
  EXPECT_FALSE(
      pass([](PoseMessage* m) { m->force_selection(0, 0) = 0.5; }, tag));
  EXPECT_FALSE(
      pass([](PoseMessage* m) { m->moment_selection(0, 1) = 1; }, tag));
  EXPECT_FALSE(pass([](PoseMessage* m) { m->contact_normals(0, 0) = 2; }, tag));
  EXPECT_FALSE(pass(nothing, ForceMessage::kTag));
  EXPECT_FALSE(pass(nothing, MakeMessageTag("four_channel")));
  EXPECT_FALSE(pass([](PoseMessage* m) { m->send_time -= 6; }, tag));
  EXPECT_FALSE(pass([](PoseMessage* m) { m->send_time += 6; }, tag));
  EXPECT_TRUE(pass(nothing, tag));
  const LinkMonitorState& link = state.output.link;
  EXPECT_EQ(link.received, 2);
  EXPECT_EQ(link.bad_inputs, 8);
  EXPECT_EQ(link.dropped, 2);
  // An older one, in a frame that is new.
  sequence -= 5;
  EXPECT_FALSE(pass(nothing, tag));
  EXPECT_EQ(state.output.link.dropped, 3);
}

TEST_F(LinkEndTest, RefusesATimeThatIsNone) {
  Run(2);
  const auto before = robot_.state;
  EXPECT_EQ(robot_.end.Receive(kNan, recorded_.back(), &robot_.state),
            FrameVerdict::kStale);
  EXPECT_EQ(robot_.state.bad_inputs, 1);
  EXPECT_EQ(robot_.state.message.sequence, before.message.sequence);
}

TEST_F(LinkEndTest, AllocatesNothing) {
  Run(2);
  Step();
  ScopedNoAlloc guard;
  for (int i = 0; i < 10; ++i) {
    time_ += 0.02;
    haptic_.Send(time_);
    robot_.Receive(time_, haptic_.state.bytes);
    robot_.Receive(time_, recorded_.front());
    robot_.Receive(time_, std::span(recorded_.front()).first(20));
  }
  EXPECT_EQ(guard.count(), 0);
}

TEST(LinkEndParamsTest, NamesTheField) {
  EXPECT_EQ(InvalidArgument([] {
              LinkEndParams params;
              params.interval = 0;
              LinkEnd(LinkDirection::kToRobot, LinkMonitorParams{}, params);
            }),
            "LinkEndParams: field `interval` expected a finite value > 0, got "
            "0");
  EXPECT_EQ(InvalidArgument([] {
              LinkMonitorParams monitor;
              monitor.timeout = -1;
              LinkEnd(LinkDirection::kToRobot, monitor, LinkEndParams{});
            }),
            "LinkMonitorParams: field `timeout` expected a finite value > 0, "
            "got -1");
}

}  // namespace
}  // namespace dual_proxy
