// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/contact_tracker.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/perception/force_space_particle_filter.h"
#include "feeler.h"
#include "no_alloc.h"

// ContactTracker through ForceSpaceParticleFilter, which owns its particles.

namespace dual_proxy {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/** What happens to a filter in a few seconds at 100 Hz: free space, contact,
sliding, a wall, a corner of three, off one, a slip, loss. */
struct Event {
  Vector3d force, velocity;
};
Event MakeEvent(int update, RandomStream* random) {
  Event event{DrawVector(0.2, random), DrawVector(0.0005, random)};
  const Vector3d slide = 0.05 * kAlong;
  const int phase = update / 60 % 9;
  if (phase == 0) {
    event.velocity += Vector3d(0.1, 0.02, -0.03);
  } else if (phase == 1) {
    event.force += 6 * kDown;
  } else if (phase == 2 || phase == 6) {
    event.force += SlidingForce(6, 0.3, slide);
    event.velocity += slide;
  } else if (phase == 3) {
    event.force += 6 * kDown + 5 * kWall;
  } else if (phase == 4) {
    event.force += 6 * kDown + 5 * kWall + 0.3 * 11 * kAlong;
    event.velocity += slide;
  } else if (phase == 5) {
    event.force += 6 * kDown + 5 * kWall + 8 * kAlong;
  } else if (phase == 7) {
    event.force += -9 * kDown;
    event.velocity += 0.3 * kWall;
  }
  return event;
}

TEST(ContactTrackerTest, SameBitsWithEveryInstructionSet) {
  for (const int num_particles : {2, 3, 61, 1000, 1027}) {
    std::vector<ForceSpaceParticleFilter> duts;
    std::vector<ForceSpaceParticleFilterState> states;
    for (const InstructionSet set : AvailableInstructionSets()) {
      states.push_back(
          duts.emplace_back(MakeParams(100, num_particles), set).MakeState(17));
    }
    // And once more with the first.
    duts.push_back(duts.front());
    states.push_back(states.front());
    RandomStream random(13);
    int dimensions[4] = {};
    for (int i = 0; i < 1080; ++i) {
      const Event event = MakeEvent(i, &random);
      for (std::size_t k = 0; k < duts.size(); ++k) {
        if (i % 540 == 50) duts[k].SetPrior(kDown, &states[k]);
        duts[k].Update(event.force, event.velocity, kZero, kZero, &states[k]);
        ExpectSame(states[k], states[0]);
      }
      if (i % 7 == 0) ExpectInvariants(states[0]);
      ASSERT_FALSE(::testing::Test::HasFailure()) << num_particles << " " << i;
      ++dimensions[states[0].dimension];
    }
    for (int d = 0; d < 4; ++d) {
      EXPECT_GT(dimensions[d], 20) << num_particles << " " << d;
    }
  }
}

TEST(ContactTrackerTest, SeedDecidesAndCopyContinues) {
  const ForceSpaceParticleFilter dut(MakeParams(100));
  ForceSpaceParticleFilterState state = dut.MakeState(1);
  ForceSpaceParticleFilterState other = dut.MakeState(2);
  for (int i = 0; i < 20; ++i) {
    dut.Update(6 * kDown, kZero, kZero, kZero, &state);
    dut.Update(6 * kDown, kZero, kZero, kZero, &other);
  }
  EXPECT_NE(state.particles, other.particles);
  ForceSpaceParticleFilterState copy = state;
  for (int i = 0; i < 20; ++i) {
    dut.Update(6 * kDown, 0.05 * kAlong, kZero, kZero, &state);
    dut.Update(6 * kDown, 0.05 * kAlong, kZero, kZero, &copy);
  }
  ExpectSame(state, copy);
}

TEST(ContactTrackerTest, DoesNotAllocate) {
  const ForceSpaceParticleFilter dut(MakeParams(100));
  ForceSpaceParticleFilterState state = dut.MakeState(1);
  const Matrix3Xd normals = kDown.replicate(1, 8);
  RandomStream random(4);
  int largest = 0;
  {
    ScopedNoAlloc guard;
    dut.SetPrior(normals, 0.05, &state);
    for (int i = 0; i < 1080; ++i) {
      const Event event = MakeEvent(i, &random);
      dut.Update(event.force, event.velocity, kZero, kZero, &state);
      largest = std::max(largest, state.dimension);
    }
    EXPECT_EQ(guard.count(), 0);
  }
  EXPECT_EQ(largest, 3);
}

TEST(ContactTrackerTest, InvariantsHoldForRandomInputs) {
  // From nothing, over what is usual, to what nobody would send.
  constexpr double kScales[] = {0, 1e-9, 1e-3, 0.01, 1, 5, 20, 1e6, 1e150};
  for (const int num_particles : {2, 3, 100, 100000}) {
    const ForceSpaceParticleFilter dut(MakeParams(100, num_particles));
    ForceSpaceParticleFilterState state = dut.MakeState(9);
    RandomStream random(11);
    const auto draw = [&random, &kScales] {
      return DrawVector(kScales[static_cast<int>(9 * random.Uniform())],
                        &random);
    };
    Vector3d usual = kZero;
    int dimensions[4] = {};
    const int num_updates = num_particles == 100000 ? 60 : 20000;
    for (int i = 0; i < num_updates; ++i) {
      if (i % 100 == 0) dut.SetPrior(draw(), &state);
      // Contacts live on forces that stay for a while.
      if (i % 10 == 0) usual = draw();
      const Vector3d force = i % 3 == 0 ? draw() : usual;
      ASSERT_EQ(dut.Update(force, 1e-3 * draw(), draw(), draw(), &state),
                FilterStatus::kOk);
      ExpectInvariants(state);
      if (::testing::Test::HasFailure()) {
        FAIL() << num_particles << " particles, input " << i;
      }
      ++dimensions[state.dimension];
    }
    if (num_particles == 100000) continue;
    for (const int count : dimensions) EXPECT_GT(count, 20) << num_particles;
  }
}

TEST(ContactTrackerTest, BadInputIsRefusedAndCounted) {
  Feeler contact;
  contact.Feel(6 * kDown, kZero, 0.3);
  const ForceSpaceParticleFilter dut(MakeParams(100));
  for (ForceSpaceParticleFilterState before :
       {dut.MakeState(0), contact.state()}) {
    ForceSpaceParticleFilterState state = before;
    for (const double bad :
         {kNan, kInfinity, -kInfinity, std::numeric_limits<double>::max()}) {
      for (int argument = 0; argument < 4; ++argument) {
        Vector3d inputs[4] = {kDown, kZero, kDown, kZero};
        inputs[argument].y() = bad;
        EXPECT_EQ(
            dut.Update(inputs[0], inputs[1], inputs[2], inputs[3], &state),
            FilterStatus::kBadInput);
      }
    }
    EXPECT_EQ(state.bad_inputs, 16);
    ExpectSame(state, before);
  }
}

// Without contact, nothing that grows with the number of particles is done.
TEST(ContactTrackerTest, FreeSpaceTouchesNoParticleAndCostsNothing) {
  const ForceSpaceParticleFilter dut(MakeParams(100, 100000));
  const ForceSpaceParticleFilterState start = dut.MakeState(0);
  ForceSpaceParticleFilterState state = start;
  RandomStream random(3);
  const auto measure = [&](int updates, const Vector3d& force) {
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < updates; ++i) {
      dut.Update(force + DrawVector(0.2, &random), 0.1 * kAlong, kZero, kZero,
                 &state);
    }
    return std::chrono::steady_clock::now() - begin;
  };
  const auto free = measure(1000, kZero);
  EXPECT_TRUE(state.particles.isZero(0));
  ExpectSameStreams(state, start);
  EXPECT_EQ(state.updates, 1000);
  EXPECT_EQ(state.direction_uncertainty, std::numbers::pi / 2);
  // Five in contact take some ms, these a tenth of one.
  EXPECT_LT(free, measure(5, 6 * kDown));
  EXPECT_EQ(state.dimension, 1);
}

TEST(ContactTrackerTest, FindsAndLosesWithinAFewUpdates) {
  // Without noise, and the bias learned: 9 of evidence at (|F| - 0.6 N) /
  // (0.25 N)^2 each, at most 5.4, and at 0.45 N / (0.25 N)^2 against it.
  const ForceSpaceParticleFilter dut(MakeParams(100));
  for (const double force : {3.0, 1.0}) {
    ForceSpaceParticleFilterState state = dut.MakeState(0);
    for (int i = 0; i < 100; ++i) {
      dut.Update(kZero, kZero, kZero, kZero, &state);
    }
    for (int i = 1; i <= 2; ++i) {
      EXPECT_EQ(state.dimension, 0);
      dut.Update(force * kDown, kZero, kZero, kZero, &state);
    }
    EXPECT_EQ(state.dimension, 1);
    for (int i = 1; i <= 2; ++i) {
      EXPECT_EQ(state.dimension, 1);
      dut.Update(kZero, kZero, kZero, kZero, &state);
    }
    EXPECT_EQ(state.dimension, 0);
    EXPECT_TRUE(state.particles.isZero(0));
  }
  // With it.
  int num_late_found = 0;
  int num_late_lost = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Feeler strong(100, seed);
    EXPECT_LE(strong.Count(1, 3 * kDown, kZero), 3);
    Feeler weak(100, seed);
    weak.Feel(kZero, kZero, 1);
    num_late_found += weak.Count(1, 1 * kDown, kZero) > 3;
    for (Feeler* feeler : {&strong, &weak}) {
      feeler->Feel(3 * kDown, kZero, 0.2);
      const int lost = feeler->Count(0, kZero, kZero);
      EXPECT_LE(lost, 15);
      num_late_lost += lost > 6;
    }
  }
  EXPECT_LE(num_late_found, 10);
  EXPECT_LE(num_late_lost, 20);
}

// What rests lightly on a surface is there as long as it does not move.
TEST(ContactTrackerTest, LightContactStaysUntilItIsLeft) {
  const ForceSpaceParticleFilter dut(MakeParams(100));
  for (const double pressed : {0.24, 0.4}) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      ForceSpaceParticleFilterState state = dut.MakeState(seed);
      RandomStream random(seed);
      const auto feel = [&](double force, const Vector3d& velocity) {
        const Vector3d command = pressed * kDown +
                                 3.5 * (pressed - force) * kDown +
                                 DrawVector(0.1, &random);
        dut.Update(force * kDown + DrawVector(0.07, &random),
                   velocity + DrawVector(0.0005, &random), kZero, command,
                   &state);
      };
      for (int i = 0; i < 20; ++i) feel(3, kZero);
      ASSERT_EQ(state.dimension, 1);
      for (int i = 0; i < 3000; ++i) {
        feel(i % 7 == 0 ? 0 : pressed, kZero);
        ASSERT_EQ(state.dimension, 1) << pressed << " N, update " << i;
      }
      // Away from it, or on through where it was: a millimetre tells.
      const Vector3d leaving = (seed % 2 == 0 ? -0.02 : 0.02) * kDown;
      int updates = 0;
      while (state.dimension == 1 && updates < 100) {
        feel(0, leaving);
        ++updates;
      }
      EXPECT_LE(updates, 10) << pressed << " N, seed " << seed;
    }
  }
}

// Who commands the tool away, and feels nothing, has no contact any more.
TEST(ContactTrackerTest, AContactThatIsPulledAwayFromIsLost) {
  const ForceSpaceParticleFilter dut(MakeParams(100));
  for (const auto& [command, is_lost] : {std::pair{-1.0, true}, {0.1, false}}) {
    ForceSpaceParticleFilterState state = dut.MakeState(1);
    for (int i = 0; i < 20; ++i) {
      dut.Update(3 * kDown, kZero, kZero, 3 * kDown, &state);
    }
    ASSERT_EQ(state.dimension, 1);
    for (int i = 0; i < 10; ++i) {
      dut.Update(kZero, kZero, kZero, command * kDown, &state);
    }
    EXPECT_EQ(state.dimension, is_lost ? 0 : 1) << command << " N";
  }
}

TEST(ContactTrackerTest, NoiseIsNoContactInTenMinutes) {
  for (const double rate : {15.0, 100.0, 200.0, 1000.0}) {
    const ForceSpaceParticleFilter dut(MakeParams(rate));
    ForceSpaceParticleFilterState state = dut.MakeState(0);
    RandomStream random(5);
    const long updates = std::lround(600 * rate);
    for (long i = 0; i < updates; ++i) {
      const Vector3d force = DrawVector(0.2, &random);
      dut.Update(force, 0.1 * kAlong, kZero, kZero, &state);
      ASSERT_EQ(state.dimension, 0) << rate << " Hz, update " << i;
    }
  }
}

TEST(ContactTrackerTest, PressingStillStaysWhatItIs) {
  for (const double force : {3.0, 6.0, 10.0}) {
    Feeler dut;
    dut.Feel(force * kDown, kZero, 1);
    for (int second = 1; second < 300; ++second) {
      dut.Feel(force * kDown, kZero, 1);
      ASSERT_EQ(dut.dimension(), 1) << force << " N, " << second << " s";
      ASSERT_LT(AngleDeg(dut.normal(), kDown), 2)
          << force << " N, " << second << " s";
    }
    EXPECT_GT(dut.normal().dot(kDown), 0);
    // It is one thing to be precise, another to know it: friction might tilt.
    EXPECT_GT(dut.state().direction_uncertainty, 0.1);
  }
}

TEST(ContactTrackerTest, SlidingTellsTheNormalFromFriction) {
  for (const double mu : {0.0, 0.1, 0.25, 0.5}) {
    Feeler dut;
    dut.Feel(6 * kDown, kZero, 0.2);
    for (const double side : {1.0, -1.0, 1.0}) {
      const Vector3d velocity = 0.05 * side * kAlong;
      dut.Feel(SlidingForce(6, mu, velocity), velocity, 0.3);
      for (int i = 0; i < 100; ++i) {
        dut.Update(SlidingForce(6, mu, velocity), velocity);
        EXPECT_EQ(dut.dimension(), 1);
        EXPECT_LT(AngleDeg(dut.normal(), kDown), 2) << mu << " " << i;
      }
    }
    EXPECT_NEAR(dut.tracker().friction, mu, 0.1);
  }
}

TEST(ContactTrackerTest, NothingThatSlidIsKnownOfFriction) {
  Feeler dut;
  dut.Feel(6 * kDown + 1.5 * kAlong, kZero, 2);
  EXPECT_LT(dut.tracker().friction, 0);
}

/** On the floor, sliding towards a wall. */
class WallTest : public ::testing::TestWithParam<double> {
 protected:
  WallTest() {
    dut_.Feel(6 * kDown, kZero, 0.2);
    dut_.Feel(SlidingForce(6, mu_, towards_), towards_, 1);
  }

  void SetUp() override {
    ASSERT_EQ(dut_.dimension(), 1);
    ASSERT_LT(AngleDeg(dut_.normal(), kDown), 2);
  }

  /** Presses the floor and the wall, sliding along both. */
  void SlideAlong(const Vector3d& velocity, double time) {
    const Vector3d friction = mu_ * 11 * velocity.normalized();
    dut_.Feel(6 * kDown + 5 * kWall + friction, velocity, time);
  }

  const double mu_{GetParam()};
  const Vector3d towards_{0.05 * kWall};
  const Vector3d along_{0.05 * kAlong};
  Feeler dut_;
};

TEST_P(WallTest, IsFoundAndLeft) {
  EXPECT_LE(dut_.Count(2, 6 * kDown + 5 * kWall, kZero), 10);
  dut_.Feel(6 * kDown + 5 * kWall, kZero, 0.5);
  EXPECT_EQ(dut_.dimension(), 2);
  EXPECT_LT(AngleDeg(dut_.free_axis(), kAlong), 10);
  SlideAlong(along_, 0.5);
  EXPECT_EQ(dut_.dimension(), 2);
  EXPECT_LT(AngleDeg(dut_.free_axis(), kAlong), 2);
  SlideAlong(-along_, 0.5);
  EXPECT_EQ(dut_.dimension(), 2);
  EXPECT_LT(AngleDeg(dut_.free_axis(), kAlong), 2);

  // Off the wall, on along the floor.
  EXPECT_LE(dut_.Count(1, SlidingForce(6, mu_, -towards_), -towards_), 10);
  dut_.Feel(SlidingForce(6, mu_, -towards_), -towards_, 0.5);
  EXPECT_EQ(dut_.dimension(), 1);
  EXPECT_LT(AngleDeg(dut_.normal(), kDown), 2);
}

TEST_P(WallTest, ThreeContactsFixTheTool) {
  dut_.Feel(6 * kDown + 5 * kWall, kZero, 0.5);
  SlideAlong(along_, 0.5);
  EXPECT_LE(dut_.Count(3, 6 * kDown + 5 * kWall + 12 * kAlong, kZero), 15);
  dut_.Feel(6 * kDown + 5 * kWall + 12 * kAlong, kZero, 1);
  EXPECT_EQ(dut_.dimension(), 3);
  EXPECT_TRUE(dut_.state().force_selection.isIdentity(0));
  EXPECT_EQ(dut_.state().direction_uncertainty, 0);
  // All of it lost at once.
  EXPECT_LE(dut_.Count(0, kZero, 0.1 * Vector3d::UnitZ()), 10);
}

INSTANTIATE_TEST_SUITE_P(Friction, WallTest, ::testing::Values(0, 0.15, 0.3),
                         [](const auto& info) {
                           return "mu" + std::to_string(static_cast<int>(
                                             std::lround(100 * info.param)));
                         });

// Slowly into something soft: the velocity is along the normal all the time.
TEST(ContactTrackerTest, SlowSinkingIsAContact) {
  for (const double stiffness : {300.0, 1000.0, 5000.0}) {
    Feeler dut;
    const double speed = 0.005;
    const double time = 8 / (stiffness * speed);  // Until 8 N.
    const int updates = static_cast<int>(std::lround(100 * time));
    for (int i = 0; i < updates; ++i) {
      const double force = 8.0 * i / updates;
      dut.Update(force * kDown, speed * kDown);
      if (force > 2.5) {
        ASSERT_EQ(dut.dimension(), 1) << stiffness << " " << force;
      }
    }
    EXPECT_LT(AngleDeg(dut.normal(), kDown), 3) << stiffness;
    dut.Feel(8 * kDown, kZero, 0.3);
    EXPECT_EQ(dut.dimension(), 1);
    EXPECT_LT(AngleDeg(dut.normal(), kDown), 3) << stiffness;
  }
}

// Two contacts whose normals have come close are one.
TEST(ContactTrackerTest, NearContactsMerge) {
  const ForceSpaceParticleFilter dut(MakeParams(100));
  Feeler corner;
  corner.Feel(6 * kDown, kZero, 0.2);
  corner.Feel(6 * kDown, 0.05 * kWall, 0.5);
  corner.Feel(6 * kDown + 5 * kWall, kZero, 0.3);
  ASSERT_EQ(corner.dimension(), 2);
  for (const double angle_deg : {9.0, 30.0}) {
    ForceSpaceParticleFilterState state = corner.state();
    // The second contact's particles go to where only an angle is between.
    const Vector3d normals[2] = {kDown, Turned(kDown, kWall, angle_deg)};
    for (std::size_t i = 0; i < 2; ++i) {
      for (int k = 0; k < 500; ++k) {
        const int column = 500 * static_cast<int>(i) + k;
        state.particles.col(column) = Turned(
            normals[i], kAlong, 2 * std::sin(static_cast<double>(column)));
      }
      state.tracker.contacts[i].normal = normals[i];
      state.tracker.contacts[i].covariance.setZero();
      state.tracker.contacts[i].slid = 1;
    }
    const Vector3d force = 3 * (normals[0] + normals[1]);
    dut.Update(force, kZero, kZero, kZero, &state);
    EXPECT_EQ(state.dimension, angle_deg < 11.4 ? 1 : 2);
    ExpectInvariants(state);
  }
}

// An edge: at once the normal is another one, and the tool moves along the old.
// Both are believed for no longer than it takes to find a contact.
TEST(ContactTrackerTest, NormalThatJumpsTakesThePlaceOfTheOld) {
  const double mu = 0.2;
  for (const double angle_deg : {45.0, 60.0, 80.0}) {
    Feeler dut;
    dut.Feel(6 * kDown, kZero, 0.2);
    const Vector3d before = 0.05 * kWall;
    dut.Feel(SlidingForce(6, mu, before), before, 0.5);
    const Vector3d normal = Turned(kDown, kWall, -angle_deg);
    const Vector3d after = 0.05 * Turned(kWall, kDown, angle_deg);
    int num_two = 0;
    for (int i = 0; i < 50; ++i) {
      dut.Update(6 * (normal + mu * after.normalized()), after);
      num_two += dut.dimension() == 2;
    }
    EXPECT_EQ(dut.dimension(), 1) << angle_deg;
    EXPECT_LT(AngleDeg(dut.normal(), normal), 3) << angle_deg;
    EXPECT_LE(num_two, 10) << angle_deg;
  }
}

// The covariance of one particle is zero but for the rounding.
TEST(ContactTrackerTest, UncertaintyOfOneParticleIsZero) {
  for (const double rounding : {1e-17, -1e-17}) {
    ContactTrackerState state;
    state.count = 1;
    state.contacts[0].normal = kDown;
    state.contacts[1].normal = kWall;
    for (int i = 0; i < 2; ++i) {
      TrackedContact& contact = state.contacts[static_cast<std::size_t>(i)];
      contact.covariance = rounding * Eigen::Matrix3d::Identity();
      contact.slid = 1;
    }
    EXPECT_NEAR(ContactTracker::CalcDirectionUncertainty(state), 0, 1e-7);
    state.count = 2;
    EXPECT_NEAR(ContactTracker::CalcDirectionUncertainty(state), 0, 1e-7);
  }
}

/** What a prior changes: averages over seeds, of the same noise without and
with it. */
struct Comparison {
  double without{0};
  double with{0};
};

constexpr int kNumSeeds = 50;

// Where a contact is expected, less speaks for one. With more noise in fewer or
// more updates there is less to gain.
TEST(ContactTrackerPriorTest, RightPriorFindsARisingForceEarlier) {
  struct Case {
    double rate, rise, noise, share;
  };
  for (const auto& [rate, rise, noise, share] :
       {Case{100, 0.5, 0.2, 0.75}, Case{100, 1, 0.2, 0.75},
        Case{100, 4, 0.2, 0.85}, Case{100, 1, 0.05, 0.7},
        Case{15, 1, 0.2, 0.85}, Case{15, 1, 0.05, 0.7}, Case{500, 1, 0.2, 0.8},
        Case{500, 1, 0.05, 0.7}}) {
    Comparison force;
    for (std::uint64_t seed = 0; seed < kNumSeeds; ++seed) {
      double found[2] = {};
      for (int with = 0; with < 2; ++with) {
        Feeler dut(rate, seed, noise);
        if (with == 1) dut.SetPrior(Turned(kDown, kAlong, 3), 0.05);
        while (dut.dimension() == 0 && found[with] < 10) {
          found[with] += rise / rate;
          dut.Update(found[with] * kDown, kZero);
        }
      }
      // What is expected needs less of each input, and may need one more.
      EXPECT_LE(found[1], found[0] + 1.01 * rise / rate)
          << rate << " Hz, seed " << seed;
      force.without += found[0] / kNumSeeds;
      force.with += found[1] / kNumSeeds;
    }
    EXPECT_LT(force.with, share * force.without)
        << rate << " Hz, " << rise << " N/s, " << noise << " N";
  }
}

TEST(ContactTrackerPriorTest, PriorAloneIsNoContact) {
  const ForceSpaceParticleFilter dut(MakeParams(100));
  ForceSpaceParticleFilterState state = dut.MakeState(0);
  dut.SetPrior(Eigen::Matrix3d::Identity(), 0.05, &state);
  RandomStream random(5);
  for (int i = 0; i < 6000; ++i) {
    dut.Update(DrawVector(0.15, &random), kZero, kZero, kZero, &state);
    ASSERT_EQ(state.dimension, 0) << i;
  }
}

TEST(ContactTrackerPriorTest, RightPriorSeesThroughFriction) {
  // Friction of 0.3 tilts the force by 17 deg, and nothing slides.
  Comparison error;
  for (std::uint64_t seed = 0; seed < kNumSeeds; ++seed) {
    for (const bool with : {false, true}) {
      Feeler dut(100, seed);
      if (with) dut.SetPrior(kDown, 0.05);
      dut.Count(1, 6 * kDown + 1.8 * kAlong, kZero);
      double& sum = with ? error.with : error.without;
      for (int i = 0; i < 50; ++i) {
        dut.Update(6 * kDown + 1.8 * kAlong, kZero);
        sum += AngleDeg(dut.normal(), kDown) / (50 * kNumSeeds);
      }
    }
  }
  EXPECT_GT(error.without, 14);
  EXPECT_LT(error.with, 0.5 * error.without);
}

TEST(ContactTrackerPriorTest, WrongPriorIsOvercome) {
  for (const double wrong_deg : {30.0, 60.0, 90.0}) {
    for (const double std : {0.05, 0.1, 0.3}) {
      for (const double azimuth_deg : {0.0, 90.0, 180.0}) {
        for (std::uint64_t seed = 0; seed < 5; ++seed) {
          SCOPED_TRACE(::testing::Message()
                       << wrong_deg << " deg wrong, std " << std << " rad, at "
                       << azimuth_deg << ", seed " << seed);
          const Vector3d side = Turned(kAlong, kWall, azimuth_deg);
          Feeler still(100, seed);
          still.SetPrior(Turned(kDown, side, wrong_deg), std);
          still.Feel(6 * kDown, kZero, 0.3);
          EXPECT_EQ(still.dimension(), 1);
          EXPECT_LT(AngleDeg(still.normal(), kDown), 5);

          Feeler slides(100, seed);
          const Vector3d velocity = 0.05 * kAlong;
          slides.SetPrior(Turned(kDown, side, wrong_deg), std);
          slides.Feel(SlidingForce(6, 0.3, velocity), velocity, 0.3);
          EXPECT_EQ(slides.dimension(), 1);
          EXPECT_LT(AngleDeg(slides.normal(), kDown), 5);
        }
      }
    }
  }
}

// As far off as friction tilts a force, pressing still cannot tell which of the
// two is wrong; a prior counts less and less then, and sliding decides.
TEST(ContactTrackerPriorTest, PriorAtTheEdgeOfWhatMayBeIsDoubted) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Feeler dut(100, seed, 0.05);
    dut.SetPrior(Turned(kDown, kWall, 17.5), 0.05);
    dut.Count(1, 10 * kDown, kZero);
    EXPECT_GT(AngleDeg(dut.normal(), kDown), 14);
    dut.Feel(10 * kDown, kZero, 0.5);
    EXPECT_LT(AngleDeg(dut.normal(), kDown), 13);
    dut.Feel(SlidingForce(10, 0.3, kAlong), 0.05 * kAlong, 0.3);
    EXPECT_LT(AngleDeg(dut.normal(), kDown), 3);
  }
}

}  // namespace
}  // namespace dual_proxy
