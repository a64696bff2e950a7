// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace dual_proxy {

/** What `params.Validate()` says, or "valid". */
template <typename Params>
std::string ValidationError(const Params& params) {
  try {
    params.Validate();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "valid";
}

}  // namespace dual_proxy
