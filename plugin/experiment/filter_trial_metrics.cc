// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/filter_trial_metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace dual_proxy {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kRightAngle = 90 * kDegree;
constexpr double kShortest = 0.1;  // s: what is over sooner need not be found.

/** Adds how long the filter takes to show, by `shows(dimension)`, what is true
from `begin` to `end` (s). */
template <typename Shows>
void AddLatency(const std::vector<FilterTrialSample>& samples, double begin,
                double end, Shows shows, std::vector<double>* latencies) {
  if (samples.empty()) return;
  auto sample = std::upper_bound(
      samples.begin(), samples.end(), begin,
      [](double time, const FilterTrialSample& s) { return time < s.time; });
  if (sample != samples.begin() && shows(std::prev(sample)->dimension)) {
    latencies->push_back(0);
    return;
  }
  for (; sample != samples.end() && sample->time < end; ++sample) {
    if (shows(sample->dimension)) {
      latencies->push_back(sample->time - begin);
      return;
    }
  }
  if (std::min(end, samples.back().time) - begin >= kShortest) {
    latencies->push_back(kInfinity);
  }
}

}  // namespace

void FilterTrialMetrics::Add(const FilterTrial& trial) {
  bool explained = false;  // By a touch, since the filter last had no contact.
  int last_dimension = 0;
  for (const FilterTrialSample& sample : trial.samples) {
    ++samples;
    free_samples += !sample.touched;
    explained = explained || sample.touched;
    if (sample.dimension > 0 && !explained) ++false_contact_samples;
    if (sample.dimension == 0 && !sample.touched) explained = false;
    if (sample.dimension != last_dimension) ++dimension_changes;
    last_dimension = sample.dimension;

    if (sample.true_force.norm() < kFilterTrialContactForce) continue;
    ++contact_samples;
    const bool is_right = sample.dimension == sample.true_dimension;
    right_dimension_samples += is_right;
    if (sample.dimension_confidence > 0.9) {
      ++confident_samples;
      confident_right_samples += is_right;
    }
    if (is_right && sample.dimension % 3 != 0 &&
        sample.direction_uncertainty < kRightAngle) {
      ++stated_samples;
      covered_samples += sample.direction_error <= sample.direction_uncertainty;
    }
    if (sample.dimension == 0) continue;
    const double degrees = sample.direction_error / kDegree;
    direction_error.push_back(degrees);
    if (sample.dimension == 2 && sample.true_dimension == 2) {
      axis_error.push_back(degrees);
    }
  }

  const auto has_contact = [](int dimension) { return dimension > 0; };
  const auto has_none = [](int dimension) { return dimension == 0; };
  const auto has_two = [](int dimension) { return dimension == 2; };
  for (std::size_t i = 0; i < trial.contacts.size(); ++i) {
    const auto& [begin, end] = trial.contacts[i];
    AddLatency(trial.samples, begin, end, has_contact, &detection_latency);
    const double next =
        i + 1 < trial.contacts.size() ? trial.contacts[i + 1].begin : kInfinity;
    if (end < kInfinity) {
      AddLatency(trial.samples, end, next, has_none, &loss_latency);
    }
  }
  for (const auto& [begin, end] : trial.second_walls) {
    AddLatency(trial.samples, begin, end, has_two, &second_latency);
  }
}

}  // namespace dual_proxy
