// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace dual_proxy {

/** A scenario is wrong. The message is one line: the dotted path of the field,
what was expected, what was found, e.g.
"plane.link.delay: expected a number in [0, 10], got 10.5". */
class ScenarioError : public std::invalid_argument {
 public:
  /** @param text  whose control characters become spaces, and of which the
  rest is left out where it is very long. */
  explicit ScenarioError(const std::string& text);
};

}  // namespace dual_proxy
