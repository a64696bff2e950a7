// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace dual_proxy {

/** What an RDT sensor sends, byte by byte, told without the code under test. */
struct RdtDatagram {
  std::uint32_t sequence{1};
  std::uint32_t sample{1};
  std::uint32_t status{0};
  std::array<std::int32_t, 6> counts{};

  std::array<std::uint8_t, 36> Bytes() const {
    std::array<std::uint8_t, 36> bytes{};
    std::size_t at = 0;
    const auto put = [&bytes, &at](std::uint32_t word) {
      for (int shift = 24; shift >= 0; shift -= 8) {
        bytes[at++] = static_cast<std::uint8_t>(word >> shift);
      }
    };
    put(sequence);
    put(sample);
    put(status);
    for (const std::int32_t count : counts) {
      put(static_cast<std::uint32_t>(count));
    }
    return bytes;
  }
};

}  // namespace dual_proxy
