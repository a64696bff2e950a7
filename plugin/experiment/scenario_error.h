// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>

namespace dual_proxy {

/** A scenario is wrong. The message is one line: the dotted path of the field,
what was expected, what was found, e.g.
"plane.link.delay: expected a number in [0, 10], got 10.5". */
class ScenarioError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

}  // namespace dual_proxy
