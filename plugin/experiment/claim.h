// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/schemes/schemes.h"

namespace dual_proxy {

/** What is said of a scene, by the paper or as an aim of this project, as a
range for one of a run's metrics. */
struct Claim {
  std::string metric{};
  std::optional<double> at_least{};
  std::optional<double> at_most{};
  std::string paper{};
  std::string source{};
  Scheme scheme{SchemeOf<DualProxyScheme>};
  double min_delay{0};
  double max_delay{10};
  std::optional<double> max_friction{};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("metric", &metric, "one of a run's").Required());
    a->Visit(Field("at_least", &at_least, Finite(), "",
                   "bound of the metric, in its unit"));
    a->Visit(Field("at_most", &at_most, Finite(), "",
                   "likewise; there is one of them, or both"));
    a->Visit(Field("paper", &paper,
                   "what the paper says, in words; without it the claim is an "
                   "aim of this project"));
    a->Visit(Field("source", &source, "where: section, figure"));
    VisitEnum(a, "Claim", "scheme", &scheme, "of the runs that it is about");
    a->Visit(Field("min_delay", &min_delay, AtLeast(0), "s",
                   "of the runs that it is about, one way"));
    a->Visit(Field("max_delay", &max_delay, AtLeast(0), "s", "likewise"));
    a->Visit(Field("max_friction", &max_friction, AtLeast(0), "",
                   "scene.friction of the runs that it is about"));
  }
};

}  // namespace dual_proxy
