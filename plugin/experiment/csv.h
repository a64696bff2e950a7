// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace dual_proxy {

/** Splits a CSV text, as spreadsheets write it, into rows of fields.

Fields are separated by commas; one in double quotes may hold commas, line ends
and, doubled, quotes. A row ends with LF, CR or CR LF; a blank line is a row
without fields. A byte order mark at the start is skipped.
@throws std::invalid_argument if the text is not UTF-8 or a field is longer than
131072 bytes (a quote that is never closed). */
std::vector<std::vector<std::string>> ParseCsv(std::string_view text);

}  // namespace dual_proxy
