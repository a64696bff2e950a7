// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace dual_proxy {

/** What the std::invalid_argument of `action` says, or "no exception". */
template <typename Action>
std::string InvalidArgument(const Action& action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no exception";
}

/** What `params.Validate()` says, or "no exception". */
template <typename Params>
std::string ValidationError(const Params& params) {
  return InvalidArgument([&params] { params.Validate(); });
}

}  // namespace dual_proxy
