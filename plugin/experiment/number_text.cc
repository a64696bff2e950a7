// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/number_text.h"

#include <charconv>
#include <cmath>

namespace dual_proxy {

std::string ShortestText(double value) {
  const double magnitude = std::abs(value);
  const bool plain = magnitude == 0 || (magnitude >= 1e-4 && magnitude < 1e16);
  char buffer[32];  // The longest is -2.2250738585072014e-308.
  const std::to_chars_result result = std::to_chars(
      buffer, buffer + sizeof(buffer), value,
      plain ? std::chars_format::fixed : std::chars_format::scientific);
  std::string text(buffer, result.ptr);
  if (plain && text.find('.') == std::string::npos) text += ".0";
  return text;
}

}  // namespace dual_proxy
