// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/csv.h"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "validation_error.h"

namespace dual_proxy {
namespace {

using Rows = std::vector<std::vector<std::string>>;

Rows ParseCsv(std::string_view text) {
  CsvReader reader(text);
  Rows rows;
  std::vector<std::string> row{"what was", "there before"};
  while (reader.Next(&row)) rows.push_back(row);
  EXPECT_EQ(row.size(), 0u);
  return rows;
}

TEST(CsvTest, RowsEndInEveryWay) {
  const Rows expected{{"t", "px"}, {"0", "1"}};
  for (const char* text : {"t,px\n0,1\n", "t,px\n0,1", "t,px\r\n0,1\r\n",
                           "t,px\r0,1\r", "\xEF\xBB\xBFt,px\n0,1\n"}) {
    EXPECT_EQ(ParseCsv(text), expected) << text;
  }
}

TEST(CsvTest, BlankLinesAreRowsWithoutFields) {
  EXPECT_EQ(ParseCsv(""), Rows{});
  EXPECT_EQ(ParseCsv("\n"), Rows{{}});
  EXPECT_EQ(ParseCsv("a\r\n\r\nb\n\n"), (Rows{{"a"}, {}, {"b"}, {}}));
  // Not blank: one field of one space.
  EXPECT_EQ(ParseCsv(" \n"), Rows{{" "}});
}

TEST(CsvTest, EmptyFieldsCount) {
  EXPECT_EQ(ParseCsv(",a,,\n,"), (Rows{{"", "a", "", ""}, {"", ""}}));
}

TEST(CsvTest, QuotesHoldCommasLineEndsAndQuotes) {
  EXPECT_EQ(ParseCsv("\"a,b\",\"c\r\nd\",\"\"\n\"e\"\"f\",g\"h\n"),
            (Rows{{"a,b", "c\r\nd", ""}, {"e\"f", "g\"h"}}));
  // What follows a closing quote belongs to the field.
  EXPECT_EQ(ParseCsv("\"a\"b,c"), (Rows{{"ab", "c"}}));
  // Never closed: up to the end.
  EXPECT_EQ(ParseCsv("a,\"b\nc,d"), (Rows{{"a", "b\nc,d"}}));
}

TEST(CsvTest, AQuoteThatIsNeverClosedIsNotReadForEver) {
  EXPECT_EQ(
      InvalidArgument([] { ParseCsv("\"" + std::string(131073, 'x')); }),
      "a field of more than 131072 bytes (a quote that is never closed?)");
  EXPECT_EQ(ParseCsv("\"" + std::string(131072, 'x'))[0][0].size(), 131072u);
}

TEST(CsvTest, OnlyUtf8) {
  EXPECT_EQ(ParseCsv("\u00e9,\u20ac,\U0001F600"),
            (Rows{{"\u00e9", "\u20ac", "\U0001F600"}}));
  const std::pair<const char*, const char*> cases[] = {
      {"ab\xFF", "byte 0xff in position 2: invalid start byte"},
      {"\x80", "byte 0x80 in position 0: invalid start byte"},
      {"\xC0\x80", "byte 0xc0 in position 0: invalid start byte"},
      {"\xE2(\xA1", "byte 0xe2 in position 0: invalid continuation byte"},
      {"\xF0\x90(", "bytes in position 0-1: invalid continuation byte"},
      {"\xED\xA0\x80", "byte 0xed in position 0: invalid continuation byte"},
      {"\xF4\x90\x80\x80",
       "byte 0xf4 in position 0: invalid continuation byte"},
      {"\xE0\x80\x80", "byte 0xe0 in position 0: invalid continuation byte"},
      {"a\xF0\x9F\x98", "bytes in position 1-3: unexpected end of data"},
  };
  for (const auto& [text, message] : cases) {
    EXPECT_EQ(InvalidArgument([text = text] { ParseCsv(text); }),
              std::string("text that is not UTF-8 (") + message + ")");
  }
}

}  // namespace
}  // namespace dual_proxy
