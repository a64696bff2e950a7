// SPDX-License-Identifier: BSD-3-Clause
#include <cctype>
#include <string>
#include <type_traits>

#include "dual_proxy/schemes/schemes.h"
#include "params.h"

namespace dual_proxy {

namespace {

/** "PositionForceParams" of "position_force". */
std::string ParamsName(const char* scheme) {
  std::string name;
  bool upper = true;
  for (const char* c = scheme; *c != 0; ++c) {
    if (*c != '_') {
      name += upper ? static_cast<char>(std::toupper(*c)) : *c;
    }
    upper = *c == '_';
  }
  return name + "Params";
}

}  // namespace

void BindSchemes(py::module_& m) {
  Schemes::ForEach([&m]<typename S>() {
    if constexpr (!std::is_same_v<typename S::Params, NoParams>) {
      const std::string doc =
          std::string("Parameters of scheme `") + S::kName + "`.";
      BindParams<typename S::Params>(m, ParamsName(S::kName).c_str(),
                                     doc.c_str())
          .Fields();
    }
  });
  m.def(
      "_scheme_tags",
      [](const py::str& scheme) {
        const auto value = EnumFromPython<Scheme>(scheme, "scheme");
        return py::make_tuple(ToRobotTag(value), ToDeviceTag(value));
      },
      py::arg("scheme"),
      "The tags of what a scheme sends to the robot and to the device.");
  BindParams<SchemesParams>(m, "SchemesParams",
                            "Parameters of all schemes, side by side.")
      .Fields();
}

}  // namespace dual_proxy
