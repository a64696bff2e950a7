// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/communication_channel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using State = CommunicationChannelState;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Message MakeMessage(std::int64_t sequence, double send_time) {
  return ToMessage(
      PoseMessage{.sequence = sequence, .send_time = send_time, .pose = {}});
}

CommunicationChannelParams Params(double delay, double jitter = 0.0,
                                  double loss = 0.0, bool reordering = true) {
  CommunicationChannelParams params;
  params.delay = delay;
  params.jitter = jitter;
  params.loss = loss;
  params.reordering = reordering;
  return params;
}

// Sends at 50 Hz for `messages` messages and looks every millisecond until all
// are there; returns (sequence, time) of each change of what is received.
std::vector<std::pair<std::int64_t, double>> Transmit(
    const CommunicationChannel& dut, State* state, int messages) {
  std::vector<std::pair<std::int64_t, double>> received;
  std::int64_t last = -1;
  for (int i = 0; i < 20 * messages + 5000; ++i) {
    const double time = 0.001 * i;
    const int k = i / 20;
    if (k < messages) dut.Send(time, MakeMessage(k, 0.02 * k), state);
    const Message& message = dut.Receive(time, *state);
    if (message.sequence == last) continue;
    last = message.sequence;
    received.emplace_back(last, time);
  }
  return received;
}

TEST(CommunicationChannelTest, IsEmptyAtFirst) {
  const CommunicationChannel dut(Params(0.0));
  const State state = dut.MakeState(0);
  EXPECT_EQ(dut.Receive(100.0, state).sequence, -1);
}

TEST(CommunicationChannelTest, WithoutDelayAMessageIsThereAtOnce) {
  const CommunicationChannel dut(Params(0.0));
  State state = dut.MakeState(0);
  dut.Send(1.0, MakeMessage(4, 1.0), &state);
  EXPECT_EQ(dut.Receive(1.0, state).sequence, 4);
}

TEST(CommunicationChannelTest, DelaysEveryMessageByTheSame) {
  const CommunicationChannel dut(Params(0.35));
  State state = dut.MakeState(0);
  const auto received = Transmit(dut, &state, 100);
  ASSERT_EQ(received.size(), 100u);
  for (int k = 0; k < 100; ++k) {
    EXPECT_EQ(received[k].first, k);
    EXPECT_NEAR(received[k].second, 0.02 * k + 0.35, 1.001e-3);
  }
  EXPECT_EQ(state.sent, 100);
  EXPECT_EQ(state.lost, 0);
}

TEST(CommunicationChannelTest, DeliversTheContentUnchanged) {
  const CommunicationChannel dut(Params(0.1));
  State state = dut.MakeState(0);
  const ForceMessage force{.sequence = 0, .force = {1, 2, 3}};
  dut.Send(0.0, ToMessage(force), &state);
  const Message& received = dut.Receive(0.2, state);
  EXPECT_EQ(received.tag, ForceMessage::kTag);
  EXPECT_EQ(received.size, ForceMessage::kSize);
  EXPECT_EQ(FromMessage<ForceMessage>(received).force, force.force);
}

TEST(CommunicationChannelTest, RepeatedEmptyAndBadMessagesAreNotSent) {
  const CommunicationChannel dut(Params(0.0));
  State state = dut.MakeState(0);
  dut.Send(0.0, MakeMessage(-1, 0.0), &state);
  dut.Send(0.0, MakeMessage(0, 0.0), &state);
  dut.Send(0.001, MakeMessage(0, 0.0), &state);
  EXPECT_EQ(state.sent, 1);
  dut.Send(0.002, MakeMessage(1, kNan), &state);
  dut.Send(0.003, MakeMessage(1, kNan), &state);  // The same one, still held.
  dut.Send(kNan, MakeMessage(2, 0.0), &state);
  EXPECT_EQ(state.sent, 1);
  EXPECT_EQ(state.refused, 2);
  EXPECT_EQ(dut.Receive(1.0, state).sequence, 0);
}

TEST(CommunicationChannelTest, LossHasItsProbability) {
  const CommunicationChannel dut(Params(0.0, 0.0, 0.3));
  State state = dut.MakeState(11);
  constexpr int kMessages = 20'000;
  for (int k = 0; k < kMessages; ++k) dut.Send(k, MakeMessage(k, k), &state);
  // Five standard deviations of a binomial.
  EXPECT_NEAR(static_cast<double>(state.lost) / kMessages, 0.3,
              5.0 * std::sqrt(0.3 * 0.7 / kMessages));
}

TEST(CommunicationChannelTest, JitterIsHalfNormal) {
  const CommunicationChannel dut(Params(0.1, 0.02));
  State state = dut.MakeState(5);
  double sum = 0.0, sum2 = 0.0;
  constexpr int kMessages = 20'000;
  for (int k = 0; k < kMessages; ++k) {
    dut.Send(k, MakeMessage(k, k), &state);
    const double extra = state.last_arrival_time - k - 0.1;
    ASSERT_GE(extra, -1e-9);
    sum += extra / kMessages;
    sum2 += extra * extra / kMessages;
  }
  // Mean sqrt(2/pi) sigma and mean square sigma^2, with five standard errors.
  EXPECT_NEAR(sum, 0.02 * std::sqrt(2.0 / std::numbers::pi),
              5.0 * 0.02 * 0.603 / std::sqrt(kMessages));
  EXPECT_NEAR(sum2, 4e-4, 5.0 * 4e-4 * std::sqrt(2.0 / kMessages));
}

TEST(CommunicationChannelTest, MessagesOvertakeOnlyWhereAllowed) {
  for (const bool reordering : {true, false}) {
    const CommunicationChannel dut(Params(0.05, 0.1, 0.0, reordering));
    State state = dut.MakeState(2);
    const auto received = Transmit(dut, &state, 500);
    const bool in_order = std::is_sorted(received.begin(), received.end());
    EXPECT_EQ(in_order, !reordering);
    EXPECT_EQ(state.sent, 500);
  }
}

TEST(CommunicationChannelTest, SameSeedSameBitsOtherSeedOthers) {
  const CommunicationChannel dut(Params(0.05, 0.03, 0.2));
  State a = dut.MakeState(9);
  State b = dut.MakeState(9);
  State c = dut.MakeState(10);
  const auto received = Transmit(dut, &a, 200);
  EXPECT_EQ(received, Transmit(dut, &b, 200));
  EXPECT_NE(received, Transmit(dut, &c, 200));
}

TEST(CommunicationChannelTest, LossesDoNotDependOnDelayAndJitter) {
  const auto lost = [](double delay, double jitter) {
    const CommunicationChannel dut(Params(delay, jitter, 0.3));
    State state = dut.MakeState(4);
    std::vector<std::int64_t> result;
    for (int k = 0; k < 300; ++k) {
      const auto before = state.lost;
      dut.Send(0.02 * k, MakeMessage(k, 0.02 * k), &state);
      result.push_back(state.lost - before);
    }
    return result;
  };
  EXPECT_EQ(lost(0.0, 0.0), lost(1.5, 0.2));
}

TEST(CommunicationChannelTest, CopiesContinueAlikeAndAreIndependent) {
  const CommunicationChannel dut(Params(0.2, 0.05, 0.1));
  State state = dut.MakeState(1);
  for (int k = 0; k < 50; ++k) {
    dut.Send(0.02 * k, MakeMessage(k, 0.02 * k), &state);
  }
  State copy = state;
  State assigned = dut.MakeState(77);
  assigned = state;
  for (int k = 50; k < 150; ++k) {
    dut.Send(0.02 * k, MakeMessage(k, 0.02 * k), &state);
  }
  EXPECT_LT(dut.Receive(3.0, copy).sequence, 50);
  for (State* other : {&copy, &assigned}) {
    for (int k = 50; k < 150; ++k) {
      dut.Send(0.02 * k, MakeMessage(k, 0.02 * k), other);
    }
    EXPECT_EQ(dut.Receive(3.0, *other).sequence,
              dut.Receive(3.0, state).sequence);
    EXPECT_EQ(other->lost, state.lost);
    EXPECT_EQ(other->last_arrival_time, state.last_arrival_time);
  }
}

TEST(CommunicationChannelTest, AFullChannelDropsTheOldest) {
  const CommunicationChannel dut(Params(10));
  State state = dut.MakeState(0);
  const int capacity = static_cast<int>(InFlightMessages::kCapacity);
  for (int k = 0; k < capacity + 3; ++k) {
    dut.Send(0.001 * k, MakeMessage(k, 0.001 * k), &state);
  }
  EXPECT_EQ(state.overflow, 3);
  EXPECT_EQ(state.in_flight.size(), InFlightMessages::kCapacity);
  EXPECT_EQ(state.in_flight[0].message.sequence, 3);
  EXPECT_EQ(dut.Receive(20, state).sequence, capacity + 2);
}

TEST(CommunicationChannelTest, DoesNotAllocate) {
  const CommunicationChannel dut(Params(0.3, 0.1, 0.1));
  State state = dut.MakeState(0);
  State target = dut.MakeState(1);
  std::int64_t last = 0;
  ScopedNoAlloc guard;
  for (int k = 0; k < 2000; ++k) {
    dut.Send(0.0001 * k, MakeMessage(k, 0.0001 * k), &state);
    last = dut.Receive(0.0001 * k, state).sequence;
  }
  target = state;
  EXPECT_EQ(guard.count(), 0);
  EXPECT_EQ(target.in_flight.size(), state.in_flight.size());
  EXPECT_LT(last, 2000);
}

TEST(CommunicationChannelParamsTest, InvalidParametersAreNamed) {
  const auto message = [](const CommunicationChannelParams& params) {
    return InvalidArgument([&] { CommunicationChannel{params}; });
  };
  EXPECT_NE(
      message(Params(-0.1)).find("CommunicationChannelParams: field `delay`"),
      std::string::npos);
  EXPECT_NE(message(Params(-0.1)).find("-0.1"), std::string::npos);
  EXPECT_NE(message(Params(0.0, kNan)).find("`jitter`"), std::string::npos);
  EXPECT_EQ(message(Params(0.0, 0.0, 1.0001)),
            "CommunicationChannelParams: field `loss` expected a number in "
            "[0, 1], got 1.0001");
}

TEST(CommunicationChannelTest, OutagesLoseWhatIsSentInThemAndNothingElse) {
  CommunicationChannelParams params = Params(0.05, 0.01, 0.2);
  const CommunicationChannel without(params);
  params.outages = {{1, 1.5}, {3, 4}};
  const CommunicationChannel with(params);
  State state = without.MakeState(4);
  auto expected = Transmit(without, &state, 300);
  std::erase_if(expected, [](const auto& received) {
    const double sent = 0.02 * static_cast<double>(received.first);
    return (sent >= 1 && sent < 1.5) || (sent >= 3 && sent < 4);
  });
  state = with.MakeState(4);
  EXPECT_EQ(Transmit(with, &state, 300), expected);
  EXPECT_GT(state.lost, 75);
}

TEST(CommunicationChannelParamsTest, AnOutageEndsAfterItsStart) {
  CommunicationChannelParams params;
  params.outages = {{1, 2}, {5, 5}};
  EXPECT_EQ(
      ValidationError(params),
      "CommunicationChannelParams: field `outages[1][1]` expected a finite "
      "value > its start = 5, got 5");
  params.outages = {{-1, 2}};
  EXPECT_NE(ValidationError(params).find(">= 0"), std::string::npos);
}

TEST(CommunicationChannelTest, ADeadLinkDeliversNothing) {
  const CommunicationChannel dut(Params(0.0, 0.0, 1.0));
  auto state = dut.MakeState(0);
  for (int i = 0; i < 1000; ++i) {
    dut.Send(0.02 * i, MakeMessage(i, 0.02 * i), &state);
  }
  EXPECT_EQ(state.lost, 1000);
  EXPECT_EQ(dut.Receive(100, state).sequence, -1);
}

}  // namespace
}  // namespace dual_proxy
