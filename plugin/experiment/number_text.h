// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace dual_proxy {

/** The shortest text that reads back as exactly this number, laid out as Python
does it in `repr` and JSON: "0.1", "8.0", "1e-05", "1e+16"; "nan", "inf" and
"-inf" for what is not finite. */
std::string ShortestText(double value);

}  // namespace dual_proxy
