// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/csv.h"

#include <cstddef>
#include <cstdio>

namespace dual_proxy {
namespace {

constexpr std::size_t kMaxFieldSize = 131072;

/** @throws InvalidCsv naming what stands at [first, last] in `text`
and why it is no UTF-8. */
[[noreturn]] void ThrowNotUtf8(std::string_view text, std::size_t first,
                               std::size_t last, const char* reason) {
  std::string where;
  if (first == last) {
    char byte[3];
    std::snprintf(byte, sizeof(byte), "%02x",
                  static_cast<unsigned char>(text[first]));
    where =
        "byte 0x" + std::string(byte) + " in position " + std::to_string(first);
  } else {
    where = "bytes in position " + std::to_string(first) + "-" +
            std::to_string(last);
  }
  throw InvalidCsv("text that is not UTF-8 (" + where + ": " + reason + ")");
}

void ThrowUnlessUtf8(std::string_view text) {
  std::size_t i = 0;
  while (i < text.size()) {
    const auto lead = static_cast<unsigned char>(text[i]);
    std::size_t length = 0;
    // What the second byte may be: no overlong form, no surrogate, nothing
    // beyond U+10FFFF.
    unsigned char low = 0x80;
    unsigned char high = 0xBF;
    if (lead < 0x80) {
      length = 1;
    } else if (lead >= 0xC2 && lead < 0xE0) {
      length = 2;
    } else if (lead >= 0xE0 && lead < 0xF0) {
      length = 3;
      if (lead == 0xE0) low = 0xA0;
      if (lead == 0xED) high = 0x9F;
    } else if (lead >= 0xF0 && lead < 0xF5) {
      length = 4;
      if (lead == 0xF0) low = 0x90;
      if (lead == 0xF4) high = 0x8F;
    } else {
      ThrowNotUtf8(text, i, i, "invalid start byte");
    }
    for (std::size_t k = 1; k < length; ++k) {
      if (i + k == text.size()) {
        ThrowNotUtf8(text, i, i + k - 1, "unexpected end of data");
      }
      const auto byte = static_cast<unsigned char>(text[i + k]);
      if (byte < low || byte > high) {
        ThrowNotUtf8(text, i, i + k - 1, "invalid continuation byte");
      }
      low = 0x80;
      high = 0xBF;
    }
    i += length;
  }
}

}  // namespace

CsvReader::CsvReader(std::string_view text) : text_(text) {
  if (text_.starts_with(kByteOrderMark)) {
    text_.remove_prefix(kByteOrderMark.size());
  }
  ThrowUnlessUtf8(text_);
}

bool CsvReader::Next(std::vector<std::string>* row) {
  if (next_ == text_.size()) {
    row->clear();
    return false;
  }
  // Fields of the last row keep their memory.
  std::size_t count = 0;
  const auto begin_field = [&]() -> std::string* {
    if (count == row->size()) row->emplace_back();
    std::string* field = &(*row)[count++];
    field->clear();
    return field;
  };
  enum { kRowStart, kFieldStart, kPlain, kQuoted, kQuoteInQuoted } state{};
  std::string* field = begin_field();
  while (next_ < text_.size()) {
    const char c = text_[next_++];
    if (state == kQuoted && c == '"') {
      state = kQuoteInQuoted;
      continue;
    }
    if (state != kQuoted) {
      if (c == '\n' || c == '\r') {
        if (c == '\r' && text_.substr(next_).starts_with('\n')) ++next_;
        break;
      }
      if (c == ',') {
        field = begin_field();
        state = kFieldStart;
        continue;
      }
      if (c == '"' && (state == kRowStart || state == kFieldStart)) {
        state = kQuoted;
        continue;
      }
      state = state == kQuoteInQuoted && c == '"' ? kQuoted : kPlain;
    }
    *field += c;
    if (field->size() > kMaxFieldSize) {
      throw InvalidCsv("a field of more than " + std::to_string(kMaxFieldSize) +
                       " bytes (a quote that is never closed?)");
    }
  }
  row->resize(state == kRowStart ? 0 : count);
  return true;
}

}  // namespace dual_proxy
