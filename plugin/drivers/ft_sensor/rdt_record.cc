// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/ft_sensor/rdt_record.h"

#include <cstdio>

namespace dual_proxy {
namespace {

constexpr std::uint16_t kRequestHeader = 0x1234;
/** A monitored threshold was passed, which says nothing of the values. */
constexpr std::uint32_t kThresholdPassed = 1u << 16;

struct StatusBit {
  int bit;
  const char* name;
};

constexpr StatusBit kStatusBits[] = {
    {0, "temperature out of range"},
    {1, "supply voltage out of range"},
    {2, "broken gage"},
    {3, "busy"},
    {27, "gage out of range"},
    {28, "simulated error"},
    {29, "calibration checksum"},
    {30, "force or torque out of range"},
};

std::uint32_t TakeWord(const std::uint8_t* bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 |
         std::uint32_t{bytes[2]} << 8 | std::uint32_t{bytes[3]};
}

}  // namespace

std::array<std::uint8_t, kRdtRequestSize> EncodeRdtRequest(
    RdtCommand command) noexcept {
  const auto code = static_cast<std::uint16_t>(command);
  // The last four bytes are how many records; 0: until it is stopped.
  return {kRequestHeader >> 8, kRequestHeader & 0xff,
          static_cast<std::uint8_t>(code >> 8),
          static_cast<std::uint8_t>(code & 0xff)};
}

bool DecodeRdtRecord(std::span<const std::uint8_t> datagram,
                     RdtRecord* record) noexcept {
  if (datagram.size() != kRdtRecordSize) return false;
  const std::uint8_t* bytes = datagram.data();
  record->sequence = TakeWord(bytes);
  record->sample = TakeWord(bytes + 4);
  record->status = TakeWord(bytes + 8);
  for (std::size_t i = 0; i < record->counts.size(); ++i) {
    record->counts[i] = static_cast<std::int32_t>(TakeWord(bytes + 12 + 4 * i));
  }
  return true;
}

bool IsRdtFault(std::uint32_t status) noexcept {
  return (status & ~kThresholdPassed) != 0;
}

std::string DescribeRdtStatus(std::uint32_t status) {
  char number[16];
  std::snprintf(number, sizeof(number), "0x%08x", status);
  std::string text = number;
  const char* separator = ": ";
  for (const auto& [bit, name] : kStatusBits) {
    if ((status >> bit & 1) == 0) continue;
    text += separator;
    text += name;
    separator = ", ";
  }
  return text;
}

}  // namespace dual_proxy
