// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/scenario_error.h"

#include "dual_proxy/experiment/line_text.h"

namespace dual_proxy {

ScenarioError::ScenarioError(const std::string& text)
    : std::invalid_argument(LineText(text, 1500)) {}

}  // namespace dual_proxy
