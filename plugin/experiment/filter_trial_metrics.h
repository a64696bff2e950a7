// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "dual_proxy/experiment/filter_trial.h"

namespace dual_proxy {

/** What one or more trials come to. Samples count as contact from a true force
of kFilterTrialContactForce at their end. */
struct FilterTrialMetrics {
  std::int64_t samples{0};
  std::int64_t contact_samples{0};
  /** Of contact_samples: the filter's dimension is the true one. */
  std::int64_t right_dimension_samples{0};
  /** Of these, of dimension 1 or 2 with a direction_uncertainty that says
  something (less than pi/2); and those whose direction_error is within it. */
  std::int64_t stated_samples{0};
  std::int64_t covered_samples{0};
  /** Of contact_samples: surer of the dimension than 0.9; and right. */
  std::int64_t confident_samples{0};
  std::int64_t confident_right_samples{0};
  /** Nothing was touched in the period. */
  std::int64_t free_samples{0};
  /** The filter has a contact though nothing was touched, neither in this
  period nor since it last had none. */
  std::int64_t false_contact_samples{0};
  /** How often the filter's dimension changed. */
  std::int64_t dimension_changes{0};

  /** deg, of contact_samples where the filter has a contact. */
  std::vector<double> direction_error;
  /** deg: of these, where both dimensions are 2. */
  std::vector<double> axis_error;

  /** s, per event, from the true event to the end of the update that shows it;
  0 if the filter shows it already, infinity if it was over before the filter
  showed it. What is over within 100 ms and was not shown is left out: a contact
  so short is nobody's loss. */
  std::vector<double> detection_latency;  ///< Contact; dimension > 0.
  std::vector<double> loss_latency;       ///< Contact's end; dimension 0.
  std::vector<double> second_latency;     ///< Second wall; dimension 2.

  void Add(const FilterTrial& trial);
};

}  // namespace dual_proxy
