// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace dual_proxy {

/** The start of a text in UTF-8, of at most `size` bytes and no part of a
character. */
std::string_view StartOf(std::string_view text, std::size_t size);

/** A text in UTF-8 as a line for people: control characters become spaces; of a
text longer than `size` bytes the start, and "...". */
std::string LineText(std::string_view text, std::size_t size);

}  // namespace dual_proxy
