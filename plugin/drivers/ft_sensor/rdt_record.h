// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace dual_proxy {

/** @file
RDT, the protocol of ATI's Net F/T sensors and of others that speak it: a
request and a stream of records over UDP, all of it big-endian. */

inline constexpr std::size_t kRdtRequestSize = 8;
inline constexpr std::size_t kRdtRecordSize = 36;

/** Of the commands those that are sent here. Nothing is written to the sensor;
its bias command (0x42) is not among them, as a bias that someone else can set
is none to go by. */
enum class RdtCommand : std::uint16_t {
  kStop = 0,
  kStream = 2,  ///< A record a datagram, as fast as the sensor is set to.
};

std::array<std::uint8_t, kRdtRequestSize> EncodeRdtRequest(
    RdtCommand command) noexcept;

/** What the sensor sends. */
struct RdtRecord {
  std::uint32_t sequence{0};  ///< Of the record in its stream.
  std::uint32_t sample{0};    ///< The sensor's own count of its samples.
  std::uint32_t status{0};    ///< 0: all is well.
  /** Forces along x, y, z, then torques. */
  std::array<std::int32_t, 6> counts{};
};

/** @returns whether there is exactly one record; else `record` is unchanged. */
bool DecodeRdtRecord(std::span<const std::uint8_t> datagram,
                     RdtRecord* record) noexcept;

/** Whether a record with this status is not to be believed: any bit is set but
that of a threshold that someone set in the sensor (16). */
bool IsRdtFault(std::uint32_t status) noexcept;

/** "0x80000004: broken gage"; the names are those of ATI's manuals (9610-05-
Ethernet Axia, table 4.7). */
std::string DescribeRdtStatus(std::uint32_t status);

}  // namespace dual_proxy
