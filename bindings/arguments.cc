// SPDX-License-Identifier: BSD-3-Clause
#include "arguments.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>

namespace dual_proxy {

bool IsCalledByName(std::string_view function) {
  return !function.starts_with("__") || function == "__init__";
}

void ThrowArguments(const char* function,
                    const std::vector<ArgumentName>& names,
                    const py::args& args, const py::kwargs& kwargs) {
  std::string all;
  for (const auto& [name, required] : names) {
    all += (all.empty() ? "" : ", ") + std::string(name) +
           (required ? "" : "=...");
  }
  const auto refuse = [&](const std::string& problem) {
    throw py::type_error(std::string(function) + "() " + problem +
                         ", expected (" + all + ")");
  };
  for (const auto& [key, value] : kwargs) {
    const auto is_key =
        [text = key.cast<std::string>()](const ArgumentName& name) {
          return name.name == text;
        };
    const auto found = std::find_if(names.begin(), names.end(), is_key);
    if (found == names.end()) refuse("has no argument " + Show(key));
    if (static_cast<std::size_t>(found - names.begin()) < args.size()) {
      refuse("got " + Show(key) + " twice");
    }
  }
  for (std::size_t i = args.size(); i < names.size(); ++i) {
    if (names[i].required && !kwargs.contains(names[i].name)) {
      refuse("misses `" + std::string(names[i].name) + "`");
    }
  }
  refuse("got " + std::to_string(args.size()) + " arguments without a name");
  std::abort();
}

}  // namespace dual_proxy
