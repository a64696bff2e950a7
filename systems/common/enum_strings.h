// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace dual_proxy {

/** The names of an enum's values, in YAML and in Python: lower case. Specialise
it beside the enum:

    template <>
    struct EnumStrings<Handover> {
      static constexpr std::pair<Handover, const char*> kValues[] = {
          {Handover::kPrinted, "printed"}, {Handover::kBumpless, "bumpless"}};
    };
*/
template <typename Enum>
struct EnumStrings;

/** The name of a value; "?" for one that is no enumerator. */
template <typename Enum>
const char* EnumToString(Enum value) {
  for (const auto& [candidate, string] : EnumStrings<Enum>::kValues) {
    if (candidate == value) return string;
  }
  return "?";
}

/** The value of a name, if it is one. */
template <typename Enum>
std::optional<Enum> EnumFromString(std::string_view name) {
  for (const auto& [candidate, string] : EnumStrings<Enum>::kValues) {
    if (name == string) return candidate;
  }
  return std::nullopt;
}

/** What an error expects: `one of "printed", "bumpless"`. */
template <typename Enum>
std::string ExpectedEnum() {
  std::string names;
  for (const auto& [value, string] : EnumStrings<Enum>::kValues) {
    names += (names.empty() ? "\"" : ", \"") + std::string(string) + "\"";
  }
  return "one of " + names;
}

}  // namespace dual_proxy
