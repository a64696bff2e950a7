// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "dual_proxy/experiment/filter_trial.h"
#include "dual_proxy/experiment/filter_trial_metrics.h"

// What the filter's defaults come to over many trials: the targets that they
// were set for, with some slack.

namespace dual_proxy {
namespace {

using Scene = FilterTrialScene;

ForceSpaceParticleFilter MakeFilter(
    double rate, Likelihood likelihood = Likelihood::kFrictionCone) {
  ForceSpaceParticleFilterParams params;
  params.period = 1 / rate;
  params.num_particles = 300;  // 1000 give the same, in three times the time.
  params.likelihood = likelihood;
  return ForceSpaceParticleFilter(params);
}

/** Metrics over drives, friction and seeds of one scene. */
FilterTrialMetrics Measure(Scene scene, const ForceSpaceParticleFilter& filter,
                           std::uint64_t num_seeds = 2) {
  FilterTrialMetrics metrics;
  for (const auto& [drive, name] : EnumStrings<FilterTrialDrive>::kValues) {
    for (const double friction : {0.0, 0.25, 0.5}) {
      for (std::uint64_t seed = 0; seed < num_seeds; ++seed) {
        FilterTrialParams params;
        params.scene = scene;
        params.drive = drive;
        params.friction = friction;
        params.seed = seed;
        metrics.Add(RunFilterTrial(params, filter, seed + 50));
      }
    }
  }
  return metrics;
}

double Mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(values.size());
}

/** The value that a share of `values` does not exceed. */
double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return -1;
  const auto index = static_cast<std::size_t>(
      share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values,
                           values.begin() + static_cast<std::ptrdiff_t>(index));
  return values[index];
}

double RightDimension(const FilterTrialMetrics& metrics) {
  return static_cast<double>(metrics.right_dimension_samples) /
         static_cast<double>(metrics.contact_samples);
}

TEST(FilterQualityTest, Probe) {
  for (const double rate : {100.0, 15.0, 60.0, 500.0, -15.0}) {
    for (const auto& [scene, name] : EnumStrings<Scene>::kValues) {
      const FilterTrialMetrics m = Measure(
          scene, rate < 0 ? MakeFilter(-rate, Likelihood::kPaper)
                          : MakeFilter(rate));
      if (scene == Scene::kFree) {
        std::printf("%g %s false %ld changes %ld\n", rate, name,
                    m.false_contact_samples, m.dimension_changes);
        continue;
      }
      std::printf(
          "%5g %-12s err mean %.2f 95%% %.2f axis %.2f dim %.3f det95 %.3f "
          "loss95 %.3f second95 %.3f changes %ld false %ld\n",
          rate, name, Mean(m.direction_error),
          Quantile(m.direction_error, 0.95),
          m.axis_error.empty() ? 0 : Mean(m.axis_error), RightDimension(m),
          Quantile(m.detection_latency, 0.95), Quantile(m.loss_latency, 0.95),
          m.second_latency.empty() ? 0 : Quantile(m.second_latency, 0.5),
          m.dimension_changes, m.false_contact_samples);
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace dual_proxy
