// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/link/message.h"

namespace dual_proxy {

/** @file
The bytes with which two processes exchange what the loop's link carries. A
frame has a fixed size and is a whole: its sender's newest message, whatever was
sent before, and what the receiver needs to trust it (LinkEnd).

All numbers are little-endian; u: unsigned, i: two's complement, f64: IEEE 754.

    byte  type     field
       0  4 bytes  "DPXY"
       4  u16      version, kWireVersion
       6  u8       direction: 1 to the robot, 2 to the haptic side
       7  u8       0
       8  u64      session: random, of a start of the sender; never 0
      16  u64      number: 0, 1, 2, ... of the frames of a session
      24  f64      time, s: sender's clock when the frame was made
      32  u64      echo, session: of the newest frame it has; 0: it has none
      40  f64      echo, time, s: of that frame, by the clock of who made it
      48  f64      echo, age, s, >= 0: how long ago it came, by sender's clock
      56  u32      flags: 1 clutch pressed, 2 holding, 4 fault; others are 0
      60  u32      message: tag; 0: none yet
      64  i32      message: size, 0 to 40
      68  u32      0
      72  i64      message: sequence, >= 0; -1: none yet
      80  f64      message: send_time, s: sender's clock
      88  f64      message: gripper_opening, m; not finite: none
      96  40 f64   message: body; 0 beyond size
     416

Whoever changes this changes kWireVersion. */

inline constexpr std::uint16_t kWireVersion = 1;
inline constexpr std::size_t kFrameSize = 416;

/** Where a frame goes; one that is thrown back is refused. */
enum class LinkDirection : std::uint8_t { kToRobot = 1, kToHaptic = 2 };

template <>
struct EnumStrings<LinkDirection> {
  static constexpr std::pair<LinkDirection, const char*> kValues[] = {
      {LinkDirection::kToRobot, "to_robot"},
      {LinkDirection::kToHaptic, "to_haptic"}};
};

/** What a sender says of itself, in LinkFrame::flags. */
inline constexpr std::uint32_t kLinkClutch = 1;   ///< The clutch is pressed.
inline constexpr std::uint32_t kLinkHolding = 2;  ///< It follows no message.
inline constexpr std::uint32_t kLinkFault = 4;    ///< Its hardware has failed.
inline constexpr std::uint32_t kLinkFlags = 7;    ///< All there are.

/** The newest frame that a sender has received. */
struct LinkEcho {
  std::uint64_t session{0};  ///< Of who made it; 0: there is none.
  double time{0};            ///< s, by the clock of who made it.
  double age{0};             ///< s, >= 0, since it came, by the sender's clock.
};

/** What is in a frame. */
struct LinkFrame {
  LinkDirection direction{LinkDirection::kToRobot};
  std::uint64_t session{0};
  std::uint64_t number{0};
  double time{0};  ///< s, sender's clock.
  LinkEcho echo{};
  std::uint32_t flags{0};
  Message message{};  ///< sequence -1 and tag 0: none yet.
};

/** Why bytes are no frame. */
enum class WireError {
  kNone = 0,
  kLength,
  kMagic,
  kVersion,
  kDirection,
  kSession,
  kReserved,
  kMessage,
  kNotFinite,
  kUnused,
};

template <>
struct EnumStrings<WireError> {
  static constexpr std::pair<WireError, const char*> kValues[] = {
      {WireError::kNone, "none"},           {WireError::kLength, "length"},
      {WireError::kMagic, "magic"},         {WireError::kVersion, "version"},
      {WireError::kDirection, "direction"}, {WireError::kSession, "session"},
      {WireError::kReserved, "reserved"},   {WireError::kMessage, "message"},
      {WireError::kNotFinite, "number"},    {WireError::kUnused, "unused"}};
};

inline constexpr std::size_t kWireErrors =
    std::size(EnumStrings<WireError>::kValues);

/** The same for people, to complete "the bytes ...". */
const char* DescribeWireError(WireError error) noexcept;

using FrameBytes = std::array<std::uint8_t, kFrameSize>;

/** The bytes of a frame, whatever is in it: bit for bit what DecodeFrame()
gives back of a frame that it takes. No heap, no throw. */
FrameBytes EncodeFrame(const LinkFrame& frame) noexcept;

/** The frame that bytes are.
@param expected  the direction in which they came.
@param[out] frame  left as it is by bytes that are none.

Its form is right then: numbers are finite (the gripper's opening need not be)
and times within kMaxTime. Whether the message makes sense is for IsValid() of
what is in it, and whether it is fresh for LinkEnd. No heap, no throw. */
WireError DecodeFrame(std::span<const std::uint8_t> bytes,
                      LinkDirection expected, LinkFrame* frame) noexcept;

}  // namespace dual_proxy
