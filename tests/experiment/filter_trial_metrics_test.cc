// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/filter_trial_metrics.h"

#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

using ::std::vector;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPeriod = 0.01;

/** Samples every 10 ms, ending at 0.01, 0.02, ..., of which a test sets what
it is about. */
FilterTrial MakeTrial(int size) {
  FilterTrial trial;
  for (int i = 1; i <= size; ++i) {
    FilterTrialSample sample;
    sample.time = kPeriod * i;
    trial.samples.push_back(sample);
  }
  return trial;
}

/** Sets a dimension of the samples that end in [begin, end), s. */
void Set(int FilterTrialSample::* dimension, int value, double begin,
         double end, FilterTrial* trial) {
  for (FilterTrialSample& sample : trial->samples) {
    if (sample.time > begin - 1e-6 && sample.time < end - 1e-6) {
      sample.*dimension = value;
    }
  }
}

FilterTrialMetrics Measure(const FilterTrial& trial) {
  FilterTrialMetrics metrics;
  metrics.Add(trial);
  return metrics;
}

TEST(FilterTrialMetricsTest, LatenciesAreFromTheEventToTheUpdateThatShowsIt) {
  FilterTrial trial = MakeTrial(200);
  trial.contacts = {{0.203, 1.505}};
  trial.second_walls = {{0.7, 1.2}};
  Set(&FilterTrialSample::dimension, 1, 0.25, 1.6, &trial);
  Set(&FilterTrialSample::dimension, 2, 0.78, 1.3, &trial);
  const FilterTrialMetrics dut = Measure(trial);
  ASSERT_EQ(dut.detection_latency.size(), 1u);
  EXPECT_NEAR(dut.detection_latency[0], 0.047, 1e-12);
  ASSERT_EQ(dut.loss_latency.size(), 1u);
  EXPECT_NEAR(dut.loss_latency[0], 0.095, 1e-12);
  ASSERT_EQ(dut.second_latency.size(), 1u);
  EXPECT_NEAR(dut.second_latency[0], 0.08, 1e-12);
  EXPECT_EQ(dut.dimension_changes, 4);
}

TEST(FilterTrialMetricsTest, WhatIsShownAlreadyTakesNoTime) {
  FilterTrial trial = MakeTrial(200);
  trial.contacts = {{0.2, 1.0}};
  trial.second_walls = {{0.5, 0.9}};
  Set(&FilterTrialSample::dimension, 2, 0.2, 0.95, &trial);
  const FilterTrialMetrics dut = Measure(trial);
  EXPECT_EQ(dut.detection_latency, vector<double>{0});
  EXPECT_EQ(dut.loss_latency, vector<double>{0});
  EXPECT_EQ(dut.second_latency, vector<double>{0});
}

TEST(FilterTrialMetricsTest, WhatIsNeverShownTakesForever) {
  FilterTrial trial = MakeTrial(200);
  // Missed; kept for the whole gap up to a third, which is found.
  trial.contacts = {{0.2, 0.4}, {0.6, 0.9}, {1.2, kInfinity}};
  trial.second_walls = {{0.7, 0.85}};
  Set(&FilterTrialSample::dimension, 1, 0.6, 3, &trial);
  const FilterTrialMetrics dut = Measure(trial);
  EXPECT_EQ(dut.detection_latency[0], kInfinity);
  EXPECT_EQ(dut.detection_latency.size(), 3u);
  EXPECT_EQ(dut.loss_latency, (vector<double>{0, kInfinity}));
  EXPECT_EQ(dut.second_latency, vector<double>{kInfinity});
}

TEST(FilterTrialMetricsTest, WhatIsOverSoonNeedNotBeShown) {
  FilterTrial trial = MakeTrial(200);
  trial.contacts = {{0.2, 0.29}, {1.95, kInfinity}};
  trial.second_walls = {{0.21, 0.25}};
  Set(&FilterTrialSample::dimension, 1, 0.5, 0.55, &trial);
  const FilterTrialMetrics dut = Measure(trial);
  EXPECT_TRUE(dut.detection_latency.empty());
  EXPECT_TRUE(dut.second_latency.empty());
  EXPECT_EQ(dut.loss_latency, vector<double>{0});
}

TEST(FilterTrialMetricsTest, OnlyUntouchedContactsAreFalse) {
  FilterTrial trial = MakeTrial(100);
  // Found a period after a bounce, and kept for a while: not false.
  trial.samples[9].touched = true;
  Set(&FilterTrialSample::dimension, 1, 0.11, 0.2, &trial);
  EXPECT_EQ(Measure(trial).false_contact_samples, 0);
  // Once given up, it is.
  Set(&FilterTrialSample::dimension, 1, 0.3, 0.35, &trial);
  EXPECT_EQ(Measure(trial).false_contact_samples, 5);
  // Two periods after a bounce is too late.
  trial.samples[49].touched = true;
  Set(&FilterTrialSample::dimension, 1, 0.52, 0.54, &trial);
  EXPECT_EQ(Measure(trial).false_contact_samples, 7);
}

TEST(FilterTrialMetricsTest, ErrorsAndDimensionsCountFromHalfANewton) {
  FilterTrial trial = MakeTrial(5);
  const auto set = [&](int i, double force, int dimension, int true_dimension,
                       double error_deg) {
    FilterTrialSample& sample = trial.samples[static_cast<std::size_t>(i)];
    sample.touched = true;
    sample.true_force = {0, force, 0};
    sample.dimension = dimension;
    sample.true_dimension = true_dimension;
    sample.direction_error = dimension == 0
                                 ? std::numeric_limits<double>::quiet_NaN()
                                 : error_deg * std::numbers::pi / 180;
  };
  set(0, 0.49, 2, 1, 80);
  set(1, 0.5, 1, 1, 4);
  set(2, 6, 0, 1, 0);
  set(3, 6, 2, 2, 3);
  set(4, 6, 1, 2, 10);
  FilterTrialMetrics dut = Measure(trial);
  EXPECT_EQ(dut.samples, 5);
  EXPECT_EQ(dut.contact_samples, 4);
  EXPECT_EQ(dut.right_dimension_samples, 2);
  ASSERT_EQ(dut.direction_error.size(), 3u);
  EXPECT_NEAR(dut.direction_error[0], 4, 1e-12);
  EXPECT_NEAR(dut.direction_error[2], 10, 1e-12);
  ASSERT_EQ(dut.axis_error.size(), 1u);
  EXPECT_NEAR(dut.axis_error[0], 3, 1e-12);
  dut.Add(trial);
  EXPECT_EQ(dut.contact_samples, 8);
  EXPECT_EQ(dut.direction_error.size(), 6u);
}

TEST(FilterTrialMetricsTest, WhatTheFilterStatesIsHeldAgainstTheTruth) {
  FilterTrial trial = MakeTrial(7);
  const auto set = [&](int i, int dimension, double error, double uncertainty,
                       double confidence) {
    FilterTrialSample& sample = trial.samples[static_cast<std::size_t>(i)];
    sample.touched = true;
    sample.true_force = {0, 6, 0};
    sample.true_dimension = 1;
    sample.dimension = dimension;
    sample.direction_error = error;
    sample.direction_uncertainty = uncertainty;
    sample.dimension_confidence = confidence;
  };
  set(0, 1, 0.1, 0.2, 0.95);
  set(1, 1, 0.3, 0.2, 0.95);
  set(2, 1, 0.3, std::numbers::pi / 2, 0.5);  // States nothing.
  set(3, 2, 0.1, 0.2, 0.95);                  // The wrong dimension.
  set(4, 2, 0.1, 0.2, 0.85);
  const FilterTrialMetrics dut = Measure(trial);
  EXPECT_EQ(dut.stated_samples, 2);
  EXPECT_EQ(dut.covered_samples, 1);
  EXPECT_EQ(dut.confident_samples, 3);
  EXPECT_EQ(dut.confident_right_samples, 2);
  EXPECT_EQ(dut.free_samples, 2);
}

TEST(FilterTrialMetricsTest, ATrialWithoutSamplesAddsNothing) {
  FilterTrial trial;
  trial.contacts = {{0.2, 0.9}};
  const FilterTrialMetrics dut = Measure(trial);
  EXPECT_EQ(dut.samples, 0);
  EXPECT_TRUE(dut.detection_latency.empty());
}

}  // namespace
}  // namespace dual_proxy
