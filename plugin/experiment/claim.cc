// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/claim.h"

#include <algorithm>

#include "dual_proxy/common/validate.h"
#include "dual_proxy/experiment/metrics.h"

namespace dual_proxy {

void Claim::Validate() const {
  ValidateFields("Claim", *this);
  const auto fits = [this](const MetricDescription& description) {
    return description.is_number && metric == description.key;
  };
  if (std::ranges::none_of(MetricDescriptions(), fits) &&
      std::ranges::none_of(AngularMetricDescriptions(), fits)) {
    throw InvalidField(
        "Claim", "metric",
        "expected a number among the keys of metrics.json, got \"" + metric +
            "\"");
  }
  if (!at_least && !at_most) {
    throw InvalidField("Claim", "at_most",
                       "expected that or at_least, got neither");
  }
  if (at_least && at_most) {
    ThrowUnlessIn("Claim", "at_most", *at_most,
                  AtLeast({*at_least, "at_least"}));
  }
  ThrowUnlessIn("Claim", "max_delay", max_delay,
                AtLeast({min_delay, "min_delay"}));
}

}  // namespace dual_proxy
