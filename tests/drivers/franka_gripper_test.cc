// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/franka/franka_gripper.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/drivers/clock.h"

namespace dual_proxy {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kMax = 0.08;

class FingerMovesTest : public ::testing::Test {
 protected:
  // As a gripper does, with something of a width between its fingers.
  FingerAction Next(double command) {
    const FingerAction action = dut_.Next(command, width_, kMax);
    if (action == FingerAction::kMove) {
      width_ =
          width_ >= object_ ? std::max(dut_.target(), object_) : dut_.target();
    }
    return action;
  }

  FingerMoves dut_{FrankaGripperParams()};
  double width_{kMax};
  double object_{0};
};

TEST_F(FingerMovesTest, TheyGoWhereTheyAreToldTo) {
  EXPECT_EQ(Next(0.08), FingerAction::kNone);
  EXPECT_EQ(Next(0.05), FingerAction::kMove);
  EXPECT_EQ(dut_.target(), 0.05);
  EXPECT_EQ(Next(0.0515), FingerAction::kNone);  // Hysteresis.
  EXPECT_EQ(Next(0.0485), FingerAction::kNone);
  EXPECT_EQ(Next(0.06), FingerAction::kMove);
  EXPECT_EQ(Next(0), FingerAction::kMove);
  EXPECT_EQ(Next(0.5), FingerAction::kMove);
  EXPECT_EQ(dut_.target(), kMax);
  EXPECT_EQ(Next(-1), FingerAction::kMove);
  EXPECT_EQ(dut_.target(), 0);
}

TEST_F(FingerMovesTest, WhatIsNotFiniteMovesNothing) {
  EXPECT_EQ(Next(kNan), FingerAction::kNone);
  EXPECT_EQ(Next(std::numeric_limits<double>::infinity()), FingerAction::kNone);
  EXPECT_EQ(dut_.Next(0.01, kNan, kMax), FingerAction::kNone);
  EXPECT_EQ(Next(0.01), FingerAction::kMove);
}

TEST(FingerTakeoverTest, NothingIsLetGoOfAtFirst) {
  FingerTakeover dut{FrankaGripperParams()};
  EXPECT_FALSE(dut.Update(0.08, kNan));
  EXPECT_FALSE(dut.Update(0.03, kNan));
  EXPECT_FALSE(dut.Update(kNan, 0.03));
  EXPECT_FALSE(dut.Update(0.08, 0.03));
  EXPECT_FALSE(dut.Update(0.05, 0.03));
  EXPECT_FALSE(dut.Update(0.06, 0.03));
  EXPECT_TRUE(dut.Update(0.031, 0.03));  // It has been there.
  EXPECT_TRUE(dut.Update(0.06, 0.03));
}

TEST(FingerTakeoverTest, ACommandThatPassesThemHasBeenThere) {
  FingerTakeover dut{FrankaGripperParams()};
  EXPECT_FALSE(dut.Update(0.08, 0.03));
  EXPECT_TRUE(dut.Update(0.01, 0.03));
}

TEST_F(FingerMovesTest, WhatTheyMeetTheyHoldUntilTheyAreOpened) {
  object_ = 0.04;
  EXPECT_EQ(Next(0.08), FingerAction::kNone);
  EXPECT_EQ(Next(0.02), FingerAction::kMove);
  EXPECT_EQ(width_, 0.04);
  EXPECT_EQ(Next(0.02), FingerAction::kGrasp);
  EXPECT_EQ(Next(0.02), FingerAction::kNone);
  EXPECT_EQ(Next(0), FingerAction::kNone);
  EXPECT_EQ(Next(0.041), FingerAction::kNone);
  EXPECT_EQ(Next(0.05), FingerAction::kMove);
  EXPECT_EQ(width_, 0.05);
}

TEST_F(FingerMovesTest, WhatFillsThemIsLetGoOfAsWell) {
  object_ = 0.0795;
  EXPECT_EQ(Next(0.08), FingerAction::kNone);
  EXPECT_EQ(Next(0.02), FingerAction::kMove);
  EXPECT_EQ(Next(0.02), FingerAction::kGrasp);
  EXPECT_EQ(Next(0.0799), FingerAction::kNone);
  EXPECT_EQ(Next(0.08), FingerAction::kMove);
}

TEST_F(FingerMovesTest, ARefusedMoveIsNotRepeated) {
  EXPECT_EQ(dut_.Next(kMax, kMax, kMax), FingerAction::kNone);
  EXPECT_EQ(dut_.Next(0.05, kMax, kMax), FingerAction::kMove);
  dut_.Refuse();
  EXPECT_EQ(dut_.Next(0.05, kMax, kMax), FingerAction::kNone);
  EXPECT_EQ(dut_.Next(0.04, kMax, kMax), FingerAction::kMove);
}

TEST_F(FingerMovesTest, ParamsAreChecked) {
  FrankaGripperParams params;
  params.speed = 0.2;
  EXPECT_THROW(FingerMoves{params}, std::invalid_argument);
}

// A Franka Hand that does as a test says.
struct Hand {
  std::mutex mutex;
  std::vector<double> moves;
  std::vector<double> grasps;
  std::atomic<double> width{kMax};
  std::atomic<double> object{0};
  std::atomic<bool> blocks{false};
  std::atomic<bool> in_move{false};
  std::atomic<bool> stopped{false};
  std::function<void()> on_move = [] {};
};

struct FakeHand {
  struct Exception : std::runtime_error {
    using std::runtime_error::runtime_error;
  };
  struct CommandException : Exception {
    using Exception::Exception;
  };
  struct State {
    double width;
    double max_width;
  };
  static inline Hand* hand = nullptr;

  struct Gripper {
    explicit Gripper(const std::string&) {
      if (hand == nullptr) throw Exception("no route to host");
    }
    State readOnce() const { return {hand->width, kMax}; }
    bool move(double width, double) {
      {
        const std::lock_guard lock(hand->mutex);
        hand->moves.push_back(width);
      }
      hand->on_move();
      hand->in_move = true;
      while (hand->blocks && !hand->stopped) std::this_thread::yield();
      hand->in_move = false;
      hand->width = std::max(width, hand->object.load());
      return true;
    }
    bool grasp(double width, double, double, double, double) {
      const std::lock_guard lock(hand->mutex);
      hand->grasps.push_back(width);
      return true;
    }
    bool stop() {
      hand->stopped = true;
      return true;
    }
  };
};

class FrankaGripperTest : public ::testing::Test {
 protected:
  void SetUp() override { FakeHand::hand = &hand_; }
  void TearDown() override { FakeHand::hand = nullptr; }

  static void WaitFor(const std::function<bool()>& done) {
    const double end = MonotonicTime() + 10;
    while (!done() && MonotonicTime() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_TRUE(done());
  }
  std::vector<double> moves() {
    const std::lock_guard lock(hand_.mutex);
    return hand_.moves;
  }
  std::vector<double> grasps() {
    const std::lock_guard lock(hand_.mutex);
    return hand_.grasps;
  }

  Hand hand_;
  FrankaGripper<FakeHand> dut_;
};

TEST_F(FrankaGripperTest, OpensAndClosesAsTold) {
  dut_.Open("arm");
  WaitFor([this] { return dut_.GetStatus().width == kMax; });
  dut_.Command(kNan);
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  EXPECT_TRUE(moves().empty());
  dut_.Command(0.01);  // Which the fingers are not.
  dut_.Command(0.02);
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  EXPECT_TRUE(moves().empty());
  dut_.Command(kMax);
  dut_.Command(0.01);
  WaitFor([this] { return dut_.GetStatus().width == 0.01; });
  dut_.Command(0.05);
  WaitFor([this] { return dut_.GetStatus().width == 0.05; });
  EXPECT_EQ(moves(), (std::vector<double>{0.01, 0.05}));
  hand_.object = 0.03;
  dut_.Command(0.02);
  WaitFor([this] { return grasps().size() == 1; });
  EXPECT_EQ(grasps(), std::vector<double>{0.03});
  EXPECT_EQ(dut_.fault(), "");
  dut_.Close();
  EXPECT_FALSE(hand_.stopped);  // What it holds it goes on holding.
}

TEST_F(FrankaGripperTest, NobodyWaitsForOneThatIsStuck) {
  hand_.blocks = true;
  dut_.Open("arm");
  WaitFor([this] { return dut_.GetStatus().width == kMax; });
  dut_.Command(kMax);
  dut_.Command(0.05);
  WaitFor([this] { return hand_.in_move.load(); });
  // The thread is in a move that does not end, and these return.
  for (int i = 0; i < 100000; ++i) {
    dut_.Command(1e-7 * i);
    dut_.GetStatus();
  }
  EXPECT_TRUE(hand_.in_move);
  EXPECT_EQ(moves().size(), 1U);
  dut_.Close();
  EXPECT_TRUE(hand_.stopped);
}

TEST_F(FrankaGripperTest, ARefusedMoveIsToldAndTheNextIsMade) {
  hand_.on_move = [this] {
    if (moves().size() == 1) throw FakeHand::CommandException("not homed");
  };
  dut_.Open("arm");
  WaitFor([this] { return dut_.GetStatus().width == kMax; });
  dut_.Command(kMax);
  dut_.Command(0.05);
  WaitFor([this] { return dut_.fault() == "not homed"; });
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  EXPECT_EQ(moves().size(), 1U);
  dut_.Command(0.02);
  WaitFor([this] { return dut_.GetStatus().width == 0.02; });
  EXPECT_TRUE(grasps().empty());
  EXPECT_EQ(dut_.GetStatus().failures, 1);
}

TEST_F(FrankaGripperTest, OneThatIsGoneIsToldAndNoMore) {
  hand_.on_move = [] { throw FakeHand::Exception("connection lost"); };
  dut_.Open("arm");
  WaitFor([this] { return dut_.GetStatus().width == kMax; });
  dut_.Command(kMax);
  dut_.Command(0.02);
  WaitFor([this] { return dut_.fault() == "connection lost"; });
  dut_.Command(0.05);
  dut_.Close();
  EXPECT_EQ(moves().size(), 1U);
}

TEST_F(FrankaGripperTest, OneThatIsNotThereIsSaid) {
  FakeHand::hand = nullptr;
  try {
    dut_.Open("arm");
    FAIL();
  } catch (const DriverError& e) {
    EXPECT_STREQ(e.what(), "gripper at arm: no route to host");
  }
  dut_.Command(0.02);
  dut_.Close();
}

}  // namespace
}  // namespace dual_proxy
