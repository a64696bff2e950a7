// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/force_space_particle_filter.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "dual_proxy/common/rotation.h"
#include "filter_test_support.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {

/** Carries out an update in full, also where Update() need not. */
class ForceSpaceParticleFilterTester {
 public:
  static FilterStatus UpdateInFull(const ForceSpaceParticleFilter& dut,
                                   const Eigen::Vector3d& sensed_force,
                                   const Eigen::Vector3d& velocity,
                                   const Eigen::Vector3d& motion_force,
                                   const Eigen::Vector3d& contact_force,
                                   ForceSpaceParticleFilterState* state) {
    ++state->updates;
    return dut.UpdateInFull(
        sensed_force, velocity, motion_force, contact_force,
        dut.CountAdded(sensed_force, velocity, motion_force), state);
  }
};

namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/** The printed filter, of which these tests are. What both likelihoods share
is tested with it; of ContactTracker see contact_tracker_test.cc. */
ForceSpaceParticleFilterParams MakePaperParams() {
  ForceSpaceParticleFilterParams params;
  params.likelihood = Likelihood::kPaper;
  return params;
}

class ForceSpaceParticleFilterTest : public ::testing::Test {
 protected:
  /** A few updates of pressing with 8 N along `normals`, while sliding in a
  direction that all of them allow, with the command `motion` first along the
  new normal and then gone, as the robot's controller does it. */
  void Press(const Vector3d& force, const Vector3d& motion,
             const Vector3d& contact, int updates) {
    for (int i = 0; i < updates; ++i) {
      status_ = dut_.Update(force, slide_, motion, contact, &state_);
    }
  }

  ForceSpaceParticleFilter dut_{MakePaperParams()};
  ForceSpaceParticleFilterState state_{dut_.MakeState(1)};
  FilterStatus status_{};
  Vector3d slide_{Vector3d::Zero()};
  const Vector3d zero_{Vector3d::Zero()};
  const Vector3d down_{-Vector3d::UnitZ()};
  const Vector3d side_{Vector3d::UnitY()};
};

TEST_F(ForceSpaceParticleFilterTest, StartsFree) {
  EXPECT_EQ(state_.dimension, 0);
  EXPECT_EQ(state_.particles.cols(), 1000);
  EXPECT_TRUE(state_.particles.isZero(0));
  ExpectInvariants(state_);
}

TEST_F(ForceSpaceParticleFilterTest, FreeMotionStaysFree) {
  RandomStream random(3);
  for (int i = 0; i < 300; ++i) {
    Vector3d noise;
    for (double& value : noise) value = 0.2 * random.Normal();
    EXPECT_EQ(dut_.Update(noise, Vector3d(0.1, 0, 0.05), Vector3d(5, 0, 2.5),
                          zero_, &state_),
              FilterStatus::kOk);
    EXPECT_EQ(state_.dimension, 0);
  }
  EXPECT_TRUE(state_.particles.isZero(0));
  EXPECT_EQ(state_.updates, 300);
}

TEST_F(ForceSpaceParticleFilterTest, FreeSpaceIsSkippedWithTheSameBits) {
  // Between free motion, with weak and strong forces, there are contacts.
  RandomStream random(5);
  const auto vector = [&random](double size) {
    return Vector3d(size * random.Normal(), size * random.Normal(),
                    size * random.Normal());
  };
  const ForceSpaceParticleFilter dut(MakePaperParams());
  ForceSpaceParticleFilterState state = dut.MakeState(3);
  ForceSpaceParticleFilterState expected = dut.MakeState(3);
  int num_free = 0;
  int num_in_contact = 0;
  for (int i = 0; i < 2000; ++i) {
    const bool pressing = i % 400 > 350;
    const Vector3d sensed =
        pressing ? Vector3d(0.2, 0, -8) : vector(i % 10 == 0 ? 10 : 0.3);
    const Vector3d velocity = pressing ? Vector3d::Zero() : vector(0.1);
    const Vector3d motion = pressing ? Vector3d(0, 0, -9) : vector(2);
    const Vector3d contact = pressing ? Vector3d(0, 0, -3) : Vector3d::Zero();
    num_free += state.singular_values(0) == 0;
    num_in_contact += state.dimension > 0;
    const FilterStatus status =
        dut.Update(sensed, velocity, motion, contact, &state);
    ASSERT_EQ(status, ForceSpaceParticleFilterTester::UpdateInFull(
                          dut, sensed, velocity, motion, contact, &expected));
    ExpectSame(state, expected);
  }
  EXPECT_GT(num_free, 1000);
  EXPECT_GT(num_in_contact, 100);
  EXPECT_GT(state.all_weights_zero, 10);
}

TEST_F(ForceSpaceParticleFilterTest, OneWallIsFoundAndItsNormalPointsInward) {
  slide_ = Vector3d(0.05, 0, 0);
  Press(8 * down_, 8 * down_, zero_, 2);
  EXPECT_EQ(state_.dimension, 1);
  Press(8 * down_, zero_, 8 * down_, 15);
  EXPECT_EQ(state_.dimension, 1);
  EXPECT_LT(AngleDeg(state_.singular_vectors.col(0), down_), 5);
  EXPECT_GT(state_.singular_vectors.col(0).dot(down_), 0);
  ExpectInvariants(state_);
}

TEST_F(ForceSpaceParticleFilterTest, LiftingFreesAgain) {
  Press(8 * down_, 8 * down_, zero_, 3);
  ASSERT_EQ(state_.dimension, 1);
  Press(zero_, zero_, zero_, 5);
  EXPECT_EQ(state_.dimension, 0);
  EXPECT_TRUE(state_.force_selection.isZero(0));
}

TEST_F(ForceSpaceParticleFilterTest, CornerGivesTwoWithoutPassingThree) {
  slide_ = Vector3d(0.02, 0, 0);
  Press(8 * down_, 8 * down_, zero_, 2);
  Press(8 * down_, zero_, 8 * down_, 5);
  ASSERT_EQ(state_.dimension, 1);
  for (int i = 0; i < 15; ++i) {
    Press(8 * down_ + 8 * side_, 8 * side_, 8 * down_, 1);
    EXPECT_LE(state_.dimension, 2);
  }
  EXPECT_EQ(state_.dimension, 2);
  EXPECT_LT(AngleDeg(state_.singular_vectors.col(2), Vector3d::UnitX()), 5);
}

// At rest the scatter alone spreads the particles beyond alpha_remove in every
// direction, d_lb = 3; the second wall makes d_hb = 2.
TEST_F(ForceSpaceParticleFilterTest, PrintedRuleJumpsToThreeInACorner) {
  ForceSpaceParticleFilterParams params = MakePaperParams();
  params.dimension_rule = DimensionRule::kPrinted;
  const ForceSpaceParticleFilter printed(params);
  ForceSpaceParticleFilterState state = printed.MakeState(1);
  const auto press = [&](const Vector3d& force, const Vector3d& motion,
                         const Vector3d& contact, int updates) {
    Press(force, motion, contact, updates);
    for (int i = 0; i < updates; ++i) {
      printed.Update(force, slide_, motion, contact, &state);
    }
  };
  press(8 * down_, 8 * down_, zero_, 2);
  press(8 * down_, zero_, 8 * down_, 30);
  EXPECT_EQ(state.dimension, 1);
  // Of the particles themselves the rule changes nothing.
  for (int i = 0; i < 15 && state_.dimension < 2; ++i) {
    press(8 * down_ + 8 * side_, 8 * side_, 8 * down_, 1);
    EXPECT_EQ(state.particles, state_.particles);
    EXPECT_EQ(state.dimension, state_.dimension < 2 ? 1 : 3);
  }
  ASSERT_EQ(state_.dimension, 2);
  EXPECT_TRUE(state.force_selection.isIdentity(0));
}

// Every input turned by R turns the axis by R. The random numbers are not
// turned, hence the filter's own accuracy.
TEST_F(ForceSpaceParticleFilterTest, TurnsWithItsInputs) {
  RandomStream random(5);
  for (int trial = 0; trial < 20; ++trial) {
    Vector3d vector;
    for (double& value : vector) value = random.Normal();
    const Matrix3d R = ExpRotation(vector);
    state_ = dut_.MakeState(static_cast<std::uint64_t>(trial));
    slide_ = R * Vector3d(0.05, 0, 0);
    Press(8 * R * down_, 8 * R * down_, zero_, 2);
    Press(8 * R * down_, zero_, 8 * R * down_, 10);
    EXPECT_EQ(state_.dimension, 1) << "trial " << trial;
    EXPECT_LT(AngleDeg(state_.singular_vectors.col(0), R * down_), 5)
        << "trial " << trial;
  }
}

// Without scatter the share on the sphere follows from equations (6)-(8): half
// of n_p particles added with weight 1/2, against n_p + 1 at the centre with
// weight 1/4, hence n_p 250 / (250 + 250.25) of the new particles.
TEST_F(ForceSpaceParticleFilterTest, SharesFollowTheWeights) {
  ForceSpaceParticleFilterParams params = MakePaperParams();
  params.scatter_std = 0;
  params.update_thresholds = {0, 10, 0.001, 0.005};
  params.resampling_thresholds = {0, 10, 0.001, 0.005};
  const ForceSpaceParticleFilter dut(params);
  state_ = dut.MakeState(0);
  EXPECT_EQ(dut.Update(5 * down_, zero_, down_, zero_, &state_),
            FilterStatus::kOk);
  const double expected = 1000 * 250 / 500.25;
  EXPECT_NEAR(state_.singular_values.squaredNorm(), expected, 1);
  EXPECT_NEAR(state_.singular_values(1), 0, 1e-12);

  // Sinking at 3 mm/s halves w_v: a quarter of n_p is added, of weight 1/4.
  state_ = dut.MakeState(0);
  dut.Update(5 * down_, 0.003 * down_, down_, zero_, &state_);
  EXPECT_NEAR(state_.singular_values.squaredNorm(),
              1000 * 62.5 / (62.5 + 250.25), 1);
}

// The added particles lie at s = (i - 1/2) / n_add between F_m and F_f.
TEST_F(ForceSpaceParticleFilterTest, AddsAlongTheArcBetweenTheCommands) {
  ForceSpaceParticleFilterParams params = MakePaperParams();
  params.scatter_std = 0;
  const ForceSpaceParticleFilter dut(params);
  state_ = dut.MakeState(0);
  // Saturates every weight on the arc, and excludes the centre.
  dut.Update(100 * (down_ + side_), zero_, 3 * side_, 7 * down_, &state_);
  Matrix3d expected = Matrix3d::Zero();
  for (int i = 0; i < 1000; ++i) {
    const double s = (i + 0.5) / 1000;
    const Vector3d added = (s * down_ + (1 - s) * side_).normalized();
    expected += added * added.transpose();
    EXPECT_LT((state_.particles.col(i) - added).norm(), 1e-14);
  }
  const Matrix3d& U = state_.singular_vectors;
  EXPECT_LT(
      (U * state_.singular_values.cwiseAbs2().asDiagonal() * U.transpose() -
       expected)
          .norm(),
      1e-10);
}

TEST_F(ForceSpaceParticleFilterTest, AllWeightsZeroKeepsMovedParticles) {
  ForceSpaceParticleFilterParams params = MakePaperParams();
  params.scatter_std = 0;
  const ForceSpaceParticleFilter dut(params);
  state_ = dut.MakeState(0);
  dut.Update(8 * down_, zero_, down_, zero_, &state_);
  ASSERT_EQ(state_.dimension, 1);
  ForceSpaceParticleFilterState::Particles expected = state_.particles;
  expected.col(999).setZero();
  // The force speaks against all particles and against the centre.
  EXPECT_EQ(dut.Update(-8 * down_, zero_, zero_, zero_, &state_),
            FilterStatus::kAllWeightsZero);
  EXPECT_EQ(state_.particles, expected);
  EXPECT_EQ(state_.all_weights_zero, 1);
  EXPECT_EQ(state_.dimension, 1);
  ExpectInvariants(state_);
}

TEST_F(ForceSpaceParticleFilterTest, BadInputIsRefusedAndCounted) {
  Press(8 * down_, 8 * down_, zero_, 3);
  const ForceSpaceParticleFilterState before = state_;
  int refused = 0;
  for (const double bad : {kNan, -std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::max()}) {
    for (int argument = 0; argument < 4; ++argument) {
      Vector3d inputs[4] = {down_, zero_, down_, zero_};
      inputs[argument].y() = bad;
      EXPECT_EQ(
          dut_.Update(inputs[0], inputs[1], inputs[2], inputs[3], &state_),
          FilterStatus::kBadInput);
      EXPECT_EQ(state_.bad_inputs, ++refused);
    }
  }
  ExpectSame(state_, before);
}

TEST_F(ForceSpaceParticleFilterTest, StateOfAnotherFilterIsRefused) {
  ForceSpaceParticleFilterParams params = MakePaperParams();
  params.prior_particles = 51;
  for (const int num_particles : {1000, 500}) {
    params.num_particles = num_particles;
    state_ = ForceSpaceParticleFilter(params).MakeState(0);
    EXPECT_FALSE(dut_.IsCompatible(state_));
    EXPECT_EQ(dut_.Update(down_, zero_, down_, zero_, &state_),
              FilterStatus::kBadInput);
    EXPECT_EQ(state_.bad_inputs, 1);
  }
  EXPECT_TRUE(dut_.IsCompatible(dut_.MakeState(0)));
}

TEST_F(ForceSpaceParticleFilterTest, InvariantsHoldForRandomInputs) {
  ForceSpaceParticleFilterParams params = MakePaperParams();
  params.num_particles = 60;
  params.prior_particles = 5;
  params.scatter_std = 0.3;  // So that three dimensions are met as well.
  params.alpha_add = 0.3;
  const ForceSpaceParticleFilter dut(params);
  state_ = dut.MakeState(9);
  RandomStream random(11);
  // From nothing, over what is usual, to what nobody would send.
  constexpr double kScales[] = {0, 1e-9, 1e-3, 0.01, 1, 5, 20, 1e6, 1e150};
  const auto draw = [&random, &kScales] {
    Vector3d value;
    for (double& entry : value) entry = random.Normal();
    return Vector3d(value * kScales[static_cast<int>(9 * random.Uniform())]);
  };
  int dimensions[4] = {};
  for (int i = 0; i < 10000; ++i) {
    if (i % 100 == 0) dut.SetPrior(draw(), &state_);
    const Vector3d force = draw();
    ASSERT_NE(dut.Update(force, 1e-3 * draw(), draw(), draw(), &state_),
              FilterStatus::kBadInput);
    ExpectInvariants(state_);
    if (HasFailure()) FAIL() << "input " << i;
    ++dimensions[state_.dimension];
  }
  // The sweep has been everywhere.
  for (const int count : dimensions) EXPECT_GT(count, 20);
}

TEST_F(ForceSpaceParticleFilterTest, SameSeedSameBitsAndCopyContinues) {
  ForceSpaceParticleFilterState other = dut_.MakeState(1);
  Press(8 * down_, 8 * down_, zero_, 4);
  for (int i = 0; i < 4; ++i) {
    dut_.Update(8 * down_, slide_, 8 * down_, zero_, &other);
  }
  ExpectSame(state_, other);

  const ForceSpaceParticleFilterState saved = state_;
  Press(8 * side_, 8 * side_, 8 * down_, 4);
  const ForceSpaceParticleFilterState after = state_;
  state_ = saved;
  Press(8 * side_, 8 * side_, 8 * down_, 4);
  ExpectSame(state_, after);

  other = dut_.MakeState(2);
  dut_.Update(8 * down_, zero_, 8 * down_, zero_, &other);
  dut_.Update(8 * down_, zero_, zero_, zero_, &other);
  EXPECT_NE(other.particles, saved.particles);
}

TEST_F(ForceSpaceParticleFilterTest, SameBitsWithEveryInstructionSet) {
  for (const int num_particles : {2, 61, 1000, 1027}) {
    ForceSpaceParticleFilterParams params = MakePaperParams();
    params.num_particles = num_particles;
    std::vector<ForceSpaceParticleFilter> duts;
    std::vector<ForceSpaceParticleFilterState> states;
    for (const InstructionSet set : AvailableInstructionSets()) {
      states.push_back(duts.emplace_back(params, set).MakeState(17));
    }
    RandomStream random(13);
    const auto vector = [&random](double size) {
      return Vector3d(size * random.Normal(), size * random.Normal(),
                      size * random.Normal());
    };
    int num_in_contact = 0;
    for (int i = 0; i < 400; ++i) {
      const Vector3d force = (i / 20 % 4 == 0 ? 0 : 6) * down_ + vector(2);
      const Vector3d velocity = vector(0.004);
      const Vector3d motion = vector(3) + force;
      const Vector3d contact = vector(3);
      for (std::size_t k = 0; k < duts.size(); ++k) {
        if (i % 50 == 30) {
          duts[k].SetPrior(Matrix3Xd(3, 0), &states[k]);
        } else if (i % 50 == 20) {
          duts[k].SetPrior(side_, &states[k]);
        }
        duts[k].Update(force, velocity, motion, contact, &states[k]);
        ExpectSame(states[k], states[0]);
      }
      ASSERT_FALSE(HasFailure()) << num_particles << " " << i;
      num_in_contact += states[0].dimension > 0;
    }
    EXPECT_GT(num_in_contact, 50);
    EXPECT_LT(num_in_contact, 380);
  }
}

TEST_F(ForceSpaceParticleFilterTest, DoesNotAllocate) {
  Matrix3Xd normals = Matrix3Xd::Random(3, 8);
  ScopedNoAlloc guard;
  dut_.SetPrior(normals, &state_);
  Press(8 * down_, 8 * down_, zero_, 3);
  Press(8 * down_ + 8 * side_, 8 * side_, 8 * down_, 3);
  Press(-20 * down_ - 20 * side_, zero_, zero_, 2);
  EXPECT_EQ(guard.count(), 0);
}

// With no command into the wall only the prior can tell of it.
TEST_F(ForceSpaceParticleFilterTest, PriorFindsWhatNoCommandPointsTo) {
  Press(2 * down_, zero_, zero_, 20);
  EXPECT_EQ(state_.dimension, 0);
  ASSERT_EQ(dut_.SetPrior(3 * down_, &state_), FilterStatus::kOk);
  EXPECT_EQ(Vector3d(state_.prior.col(0)), down_);
  Press(2 * down_, zero_, zero_, 20);
  EXPECT_EQ(state_.dimension, 1);
  EXPECT_LT(AngleDeg(state_.singular_vectors.col(0), down_), 5);
}

TEST_F(ForceSpaceParticleFilterTest, PriorAloneIsNoContact) {
  ASSERT_EQ(dut_.SetPrior(Matrix3d::Identity(), &state_), FilterStatus::kOk);
  EXPECT_EQ(state_.num_priors, 3);
  slide_ = Vector3d(0.05, 0.02, 0);
  Press(zero_, zero_, zero_, 50);
  EXPECT_EQ(state_.dimension, 0);
}

// In 0.3 s. While it presses still, as far as the force excludes the prior.
TEST_F(ForceSpaceParticleFilterTest, WrongPriorIsOvercome) {
  for (const double deg : {30.0, 60.0, 90.0}) {
    state_ = dut_.MakeState(1);
    slide_.setZero();
    const double angle = deg * std::numbers::pi / 180;
    ASSERT_EQ(dut_.SetPrior(std::cos(angle) * down_ + std::sin(angle) * side_,
                            &state_),
              FilterStatus::kOk);
    Press(8 * down_, 8 * down_, zero_, 1);
    Press(8 * down_, zero_, 8 * down_, 4);
    EXPECT_EQ(state_.dimension, 1) << deg;
    EXPECT_LT(AngleDeg(state_.singular_vectors.col(0), down_), 10) << deg;
    slide_ = 0.05 * side_;
    Press(8 * down_ + 2 * side_, 2 * side_, 8 * down_, 5);
    EXPECT_EQ(state_.dimension, 1) << deg;
    EXPECT_LT(AngleDeg(state_.singular_vectors.col(0), down_), 2) << deg;
  }
}

TEST_F(ForceSpaceParticleFilterTest, RightPriorFindsARisingForceEarlier) {
  double found[2] = {};
  for (int with = 0; with < 2; ++with) {
    state_ = dut_.MakeState(1);
    if (with == 1) dut_.SetPrior(down_, &state_);
    while (state_.dimension == 0 && found[with] < 20) {
      found[with] += 1.0 / 15;
      Press(found[with] * down_, found[with] * down_, zero_, 1);
    }
  }
  EXPECT_LT(found[1], 0.7 * found[0]);
  EXPECT_GT(found[1], 0.5);
}

TEST_F(ForceSpaceParticleFilterTest, BadPriorIsRefusedAndGoodOneRemovable) {
  ASSERT_EQ(dut_.SetPrior(down_, &state_), FilterStatus::kOk);
  const ForceSpaceParticleFilterState before = state_;
  EXPECT_EQ(dut_.SetPrior(Matrix3Xd::Ones(3, 9), &state_),
            FilterStatus::kBadInput);
  EXPECT_EQ(dut_.SetPrior(zero_, &state_), FilterStatus::kBadInput);
  EXPECT_EQ(dut_.SetPrior(Vector3d(0, kNan, 1), &state_),
            FilterStatus::kBadInput);
  EXPECT_EQ(state_.bad_inputs, 3);
  ExpectSame(state_, before);
  EXPECT_EQ(dut_.SetPrior(Matrix3Xd(3, 0), &state_), FilterStatus::kOk);
  EXPECT_EQ(state_.num_priors, 0);
}

TEST(ForceSpaceParticleFilterParamsTest, InstructionSetMustBeAvailable) {
  try {
    ForceSpaceParticleFilter({}, static_cast<InstructionSet>(9));
    ADD_FAILURE() << "no exception";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(),
                 "ForceSpaceParticleFilter: field `instruction_set` expected "
                 "one of AvailableInstructionSets(), got 9");
  }
}

TEST(ForceSpaceParticleFilterParamsTest, DefaultsAreThePapersAndValid) {
  const ForceSpaceParticleFilterParams params;
  EXPECT_EQ(ValidationError(params), "no exception");
  EXPECT_EQ(params.likelihood, Likelihood::kFrictionCone);  // All but this.
  EXPECT_EQ(params.num_particles, 1000);
  EXPECT_EQ(params.period, 1.0 / 15.0);
  EXPECT_EQ(params.update_thresholds.force_low, 3);
  EXPECT_EQ(params.update_thresholds.force_high, 10);
  EXPECT_EQ(params.update_thresholds.velocity_high, 0.005);
  EXPECT_EQ(params.resampling_thresholds.force_high, 3);
  EXPECT_EQ(params.resampling_thresholds.velocity_high, 0.01);
}

TEST(ForceSpaceParticleFilterParamsTest, ErrorsNameFieldRangeAndValue) {
  using Params = ForceSpaceParticleFilterParams;
  const auto error = [](auto change) {
    Params params;
    change(&params);
    EXPECT_THROW(ForceSpaceParticleFilter{params}, std::invalid_argument);
    return ValidationError(params);
  };
  const std::string who = "ForceSpaceParticleFilterParams: field ";
  const std::string who_thresholds =
      "ForceSpaceParticleFilterThresholds: field ";
  EXPECT_EQ(error([](Params* p) { p->num_particles = 1; }),
            who + "`num_particles` expected a number in [2, 100000], got 1");
  EXPECT_EQ(error([](Params* p) { p->period = 0; }),
            who + "`period` expected a number in (0, 1e+11], got 0");
  EXPECT_EQ(error([](Params* p) { p->scatter_mean = 2; }),
            who + "`scatter_mean` expected a number in [-1, 1], got 2");
  EXPECT_EQ(error([](Params* p) { p->scatter_std = kNan; }),
            who + "`scatter_std` expected a number in [0, 1], got nan");
  EXPECT_EQ(error([](Params* p) { p->alpha_add = 1; }),
            who + "`alpha_add` expected a number in (0, 1), got 1");
  EXPECT_EQ(
      error([](Params* p) { p->alpha_remove = 0.6; }),
      who +
          "`alpha_remove` expected a number in (0, alpha_add = 0.5], got 0.6");
  EXPECT_EQ(error([](Params* p) { p->epsilon = 0; }),
            who + "`epsilon` expected a number in [1e-12, 0.1], got 0");
  EXPECT_EQ(error([](Params* p) { p->prior_particles = -1; }),
            who + "`prior_particles` expected a number in [0, 100000], got -1");
  EXPECT_EQ(error([](Params* p) { p->update_thresholds.force_high = 3; }),
            who_thresholds +
                "`force_high` expected a finite value > force_low = 3, got 3");
  EXPECT_EQ(
      error([](Params* p) { p->resampling_thresholds.velocity_low = 0.02; }),
      who_thresholds +
          "`velocity_high` expected a finite value > velocity_low = 0.02, got "
          "0.01");
  EXPECT_EQ(
      error([](Params* p) { p->update_thresholds.velocity_low = -1; }),
      who_thresholds + "`velocity_low` expected a finite value >= 0, got -1");
  EXPECT_EQ(
      error([](Params* p) { p->likelihood = static_cast<Likelihood>(9); }),
      who + "`likelihood` expected one of \"paper\", \"friction_cone\", got 9");
  EXPECT_EQ(error([](Params* p) { p->prior_std = 4; }),
            who + "`prior_std` expected a number in (0, pi], got 4");
  const std::string who_cone = "FrictionConeParams: field ";
  EXPECT_EQ(error([](Params* p) { p->friction_cone.evidence = 0; }),
            who_cone + "`evidence` expected a finite value > 0, got 0");
  EXPECT_EQ(error([](Params* p) { p->friction_cone.loss_force = 0.6; }),
            who_cone +
                "`loss_force` expected a number in [0, contact_force = 0.6), "
                "got 0.6");
  EXPECT_EQ(error([](Params* p) { p->friction_cone.curvature = -1; }),
            who_cone + "`curvature` expected a finite value >= 0, got -1");
}

}  // namespace
}  // namespace dual_proxy
