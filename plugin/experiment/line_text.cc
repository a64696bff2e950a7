// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/line_text.h"

namespace dual_proxy {

std::string_view StartOf(std::string_view text, std::size_t size) {
  if (text.size() <= size) return text;
  const auto continues = [text](std::size_t i) {
    return (static_cast<unsigned char>(text[i]) & 0xC0) == 0x80;
  };
  while (size > 0 && continues(size)) --size;
  return text.substr(0, size);
}

std::string LineText(std::string_view text, std::size_t size) {
  std::string line(StartOf(text, size));
  for (char& c : line) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) c = ' ';
  }
  return line.size() < text.size() ? line + "..." : line;
}

}  // namespace dual_proxy
