// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace dual_proxy {

/** With what a text in UTF-8 may begin. */
inline constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/** A text is no CSV text; the message says what it is. */
class InvalidCsv : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/** Reads a CSV text, as spreadsheets write it, row by row.

Fields are separated by commas; one in double quotes may hold commas, line ends
and, doubled, quotes. A row ends with LF, CR or CR LF; a blank line is a row
without fields. A byte order mark at the start is skipped. */
class CsvReader {
 public:
  /** @param text to be kept while this reads.
  @throws InvalidCsv if it is not UTF-8. */
  explicit CsvReader(std::string_view text);

  /** Sets `row` to the next row's fields; false at the end of the text.
  @throws InvalidCsv if a field is longer than 131072 bytes (a quote
  that is never closed). */
  bool Next(std::vector<std::string>* row);

 private:
  std::string_view text_;
  std::size_t next_{0};
};

}  // namespace dual_proxy
