// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/contact_perception.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::uint64_t kSeed = 5;
constexpr std::uint64_t kAngularSeed = 6;

class ContactPerceptionTest : public ::testing::Test {
 protected:
  ContactPerceptionTest() {
    params_.filter.num_particles = 50;
    params_.filter.period = 0.02;
    params_.angular_filter.enabled = true;
    params_.angular_filter.method = AngularMethod::kParticles;
    params_.angular_filter.filter.num_particles = 40;
    params_.angular_filter.filter.period = 0.05;
  }

  // A tool that is pressed onto a table, on its edge.
  FilterInput Force() { return Sample({0, 0, -8}, 0.5); }
  FilterInput Moment() { return Sample({0.3, 0, 0}, 0.01); }

  FilterInput Sample(const Vector3d& force, double noise) {
    const auto shake = [&] {
      return Vector3d(noise * Vector3d(random_.Normal(), random_.Normal(),
                                       random_.Normal()));
    };
    return {.sensed = force + shake(),
            .velocity = 1e-4 * shake(),
            .motion = force + shake(),
            .contact = shake()};
  }

  ContactPerceptionParams params_;
  RandomStream random_{4};
};

// As one who looks at the multiples of the filter's period, before the control
// acts, and runs filters and means by hand.
TEST_F(ContactPerceptionTest, SameAsMeansAndFiltersByHand) {
  const ContactPerception dut(params_);
  ContactPerceptionState state = dut.MakeState(kSeed, kAngularSeed);
  struct ByHand {
    ByHand(const ForceSpaceParticleFilterParams& params, std::uint64_t seed)
        : filter(params), state(filter.MakeState(seed)), mean(params.period) {}

    void Update() {
      filter.Update(sensed.mean, velocity.mean, motion.mean, contact.mean,
                    &state);
    }
    void Add(double time, const FilterInput& sample) {
      mean.Update(time, sample.sensed, &sensed);
      mean.Update(time, sample.velocity, &velocity);
      mean.Update(time, sample.motion, &motion);
      mean.Update(time, sample.contact, &contact);
    }

    ForceSpaceParticleFilter filter;
    ForceSpaceParticleFilterState state;
    WindowMean<3> mean;
    WindowMeanState<3> sensed, velocity, motion, contact;
  };
  ByHand force(params_.filter, kSeed);
  ByHand moment(params_.angular_filter.filter, kAngularSeed);
  for (int i = 0; i <= 1000; ++i) {
    const double time = 0.001 * i;
    dut.UpdateFilters(time, &state);
    if (i % 20 == 0) force.Update();
    if (i % 50 == 0) moment.Update();
    ASSERT_EQ(state.force.filter.particles, force.state.particles) << i;
    ASSERT_EQ(state.force.filter.dimension, force.state.dimension) << i;
    ASSERT_EQ(state.moment.filter.particles, moment.state.particles) << i;
    const ContactSelections selections = dut.GetSelections(state);
    EXPECT_EQ(selections.force, force.state.force_selection);
    EXPECT_EQ(selections.moment, moment.state.force_selection);
    const FilterInput f = Force();
    const FilterInput m = Moment();
    dut.AddSamples(time, f, m, &state);
    force.Add(time, f);
    moment.Add(time, m);
  }
  EXPECT_EQ(state.force.filter.updates, 51);
  EXPECT_EQ(state.moment.filter.updates, 21);
  EXPECT_EQ(state.force.filter.dimension, 1);
  EXPECT_GT(state.moment.filter.dimension, 0);
}

// 0.3 / 0.1 is below 3 in floating point: the filter is due all the same, and
// sees all samples of the hundred periods before, and no other.
TEST_F(ContactPerceptionTest, FilterSeesExactlyOneFullWindow) {
  params_.filter.period = 0.1;
  const ContactPerception dut(params_);
  ContactPerceptionState state = dut.MakeState(kSeed, kAngularSeed);
  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i <= 2000; ++i) {
    const double time = i * 0.001;
    const auto updates = state.force.filter.updates;
    const Vector3d mean = state.force.mean_input().sensed;
    const auto samples = state.force.means.samples;
    dut.UpdateFilters(time, &state);
    EXPECT_EQ(state.force.filter.updates - updates, i % 100 == 0) << i;
    if (i % 100 == 0 && i > 0) {
      EXPECT_EQ(samples, 100) << i;
      EXPECT_TRUE(mean.isApprox(sum / 100, 1e-12)) << i;
      sum.setZero();
    }
    const FilterInput force = Force();
    dut.AddSamples(time, force, Moment(), &state);
    sum += force.sensed;
  }
}

TEST_F(ContactPerceptionTest, MissedTimesAreOneUpdate) {
  const ContactPerception dut(params_);
  ContactPerceptionState state = dut.MakeState(kSeed, kAngularSeed);
  dut.UpdateFilters(0, &state);
  dut.UpdateFilters(1, &state);
  dut.UpdateFilters(1.019, &state);
  EXPECT_EQ(state.force.filter.updates, 2);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  dut.UpdateFilters(nan, &state);
  EXPECT_EQ(state.force.filter.updates, 2);
  dut.UpdateFilters(1.02, &state);
  EXPECT_EQ(state.force.filter.updates, 3);
}

TEST_F(ContactPerceptionTest, TimeThatGoesBackHoldsNoUpdateUp) {
  const ContactPerception dut(params_);
  ContactPerceptionState state = dut.MakeState(kSeed, kAngularSeed);
  for (int i = 0; i < 1000; ++i) {
    const double time = 0.001 * i + (i >= 300 && i < 350 ? 100 : 0);
    dut.UpdateFilters(time, &state);
    dut.AddSamples(time, Force(), Moment(), &state);
  }
  EXPECT_GE(state.force.filter.updates, 50);
  EXPECT_GE(state.moment.filter.updates, 20);
}

TEST_F(ContactPerceptionTest, SamplesThatAreNotFiniteAreCountedOnly) {
  const ContactPerception dut(params_);
  ContactPerceptionState state = dut.MakeState(kSeed, kAngularSeed);
  FilterInput bad = Force();
  bad.motion.y() = std::numeric_limits<double>::infinity();
  dut.AddSamples(0, bad, Moment(), &state);
  EXPECT_EQ(state.force.means.samples, 0);
  EXPECT_EQ(state.force.means.bad_inputs, 1);
  EXPECT_EQ(state.moment.means.samples, 1);
  EXPECT_EQ(state.moment.means.bad_inputs, 0);
}

TEST_F(ContactPerceptionTest, WithoutTheAngularFilterNothingOfForcesChanges) {
  const ContactPerception with(params_);
  params_.angular_filter.enabled = false;
  const ContactPerception without(params_);
  EXPECT_TRUE(with.has_angular_filter());
  EXPECT_FALSE(without.has_angular_filter());
  ContactPerceptionState a = with.MakeState(kSeed, kAngularSeed);
  ContactPerceptionState b = without.MakeState(kSeed, kAngularSeed);
  for (int i = 0; i < 500; ++i) {
    with.UpdateFilters(0.001 * i, &a);
    without.UpdateFilters(0.001 * i, &b);
    const FilterInput force = Force();
    const FilterInput moment = Moment();
    with.AddSamples(0.001 * i, force, moment, &a);
    without.AddSamples(0.001 * i, force, moment, &b);
  }
  EXPECT_EQ(a.force.filter.particles, b.force.filter.particles);
  EXPECT_EQ(b.moment.means.samples, 0);
  EXPECT_EQ(without.GetSelections(b).moment, Matrix3d::Zero());
}

// It takes the normal that the filter of forces has found by then, and the mean
// force of its own period.
TEST_F(ContactPerceptionTest, SameAsMeansAndPressureCentreByHand) {
  params_.angular_filter.method = AngularMethod::kPressureCentre;
  const ContactPerception dut(params_);
  ContactPerceptionState state = dut.MakeState(kSeed, kAngularSeed);
  const double period = params_.angular_filter.filter.period;
  const PressureCentreTracker tracker(params_.angular_filter.pressure_centre,
                                      period);
  PressureCentreState by_hand;
  const WindowMean<3> mean(period);
  WindowMeanState<3> force, moment, velocity;
  for (int i = 0; i <= 1000; ++i) {
    const double time = 0.001 * i;
    dut.UpdateFilters(time, &state);
    if (i % 50 == 0) {
      tracker.Update({.moment = moment.mean,
                      .angular_velocity = velocity.mean,
                      .force = force.mean,
                      .normal = state.force.filter.force_direction()},
                     &by_hand);
    }
    const ForceSpaceParticleFilterState& found = state.moment.filter;
    ASSERT_EQ(found.dimension, by_hand.dimension) << i;
    ASSERT_EQ(found.force_selection, by_hand.CalcSelection()) << i;
    ASSERT_EQ(dut.GetSelections(state).moment, by_hand.CalcSelection()) << i;
    EXPECT_EQ(found.force_selection + found.motion_selection,
              Matrix3d::Identity());
    EXPECT_EQ(found.singular_vectors, by_hand.axes);
    const FilterInput f = Force();
    const FilterInput m = Moment();
    dut.AddSamples(time, f, m, &state);
    mean.Update(time, f.sensed, &force);
    mean.Update(time, m.sensed, &moment);
    mean.Update(time, m.velocity, &velocity);
  }
  EXPECT_EQ(state.moment.filter.updates, 21);
  EXPECT_EQ(state.moment.filter.dimension, 1);
  EXPECT_GT(std::abs(state.moment.filter.force_direction().x()), 0.99);
}

TEST_F(ContactPerceptionTest, ThePressureCentreRefusesNothingThatIsFinite) {
  params_.angular_filter.method = AngularMethod::kPressureCentre;
  const ContactPerception dut(params_);
  ContactPerceptionState state = dut.MakeState(kSeed, kAngularSeed);
  FilterInput bad = Moment();
  bad.sensed.x() = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i <= 100; ++i) {
    dut.UpdateFilters(0.001 * i, &state);
    dut.AddSamples(0.001 * i, Force(), i % 2 ? Moment() : bad, &state);
  }
  EXPECT_EQ(state.moment.means.bad_inputs, 51);
  EXPECT_EQ(state.moment.filter.bad_inputs, 0);
}

TEST_F(ContactPerceptionTest, DoesNotAllocate) {
  for (const AngularMethod method :
       {AngularMethod::kParticles, AngularMethod::kPressureCentre}) {
    params_.angular_filter.method = method;
    const ContactPerception dut(params_);
    ContactPerceptionState state = dut.MakeState(kSeed, kAngularSeed);
    ScopedNoAlloc guard;
    for (int i = 0; i < 300; ++i) {
      dut.UpdateFilters(0.001 * i, &state);
      dut.AddSamples(0.001 * i, Force(), Moment(), &state);
    }
    EXPECT_EQ(guard.count(), 0);
  }
}

TEST_F(ContactPerceptionTest, ErrorsNameTheFilter) {
  params_.filter.num_particles = 0;
  EXPECT_NE(ValidationError(params_).find("num_particles"), std::string::npos);
  EXPECT_THROW(ContactPerception{params_}, std::invalid_argument);
  params_.filter.num_particles = 50;
  params_.angular_filter.pressure_centre.edge_distance = 0;
  EXPECT_NE(ValidationError(params_).find("edge_distance"), std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
