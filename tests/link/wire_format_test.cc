// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/wire_format.h"

#include <bit>
#include <cstring>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"

namespace dual_proxy {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

LinkFrame MakeFrame() {
  PoseMessage pose;
  pose.sequence = 7;
  pose.send_time = 12.25;
  pose.pose.p << 0.1, -0.2, 0.3;
  pose.gripper_opening = 0.02;
  return {.direction = LinkDirection::kToHaptic,
          .session = 0x0123456789abcdef,
          .number = 1000,
          .time = 12.5,
          .echo = {.session = 5, .time = -3.5, .age = 0.125},
          .flags = kLinkClutch | kLinkFault,
          .message = ToMessage(pose)};
}

WireError Decode(std::span<const std::uint8_t> bytes, LinkFrame* frame,
                 LinkDirection expected = LinkDirection::kToHaptic) {
  return DecodeFrame(bytes, expected, frame);
}

WireError ErrorOf(const LinkFrame& frame) {
  LinkFrame read;
  return Decode(EncodeFrame(frame), &read);
}

// Bit for bit, which is more than ==.
void ExpectSame(const LinkFrame& a, const LinkFrame& b) {
  EXPECT_EQ(EncodeFrame(a), EncodeFrame(b));
}

std::uint64_t Number(const FrameBytes& bytes, std::size_t at, int size) {
  std::uint64_t value = 0;
  for (int i = size - 1; i >= 0; --i) value = value << 8 | bytes[at + i];
  return value;
}

double Real(const FrameBytes& bytes, std::size_t at) {
  return std::bit_cast<double>(Number(bytes, at, 8));
}

// The table in the header, byte by byte.
TEST(WireFormatTest, EveryFieldIsWhereTheTableHasIt) {
  const LinkFrame frame = MakeFrame();
  const FrameBytes bytes = EncodeFrame(frame);
  EXPECT_EQ(bytes.size(), 416u);
  EXPECT_EQ(std::memcmp(bytes.data(), "DPXY", 4), 0);
  EXPECT_EQ(Number(bytes, 4, 2), 1u);
  EXPECT_EQ(bytes[6], 2);
  EXPECT_EQ(bytes[7], 0);
  EXPECT_EQ(Number(bytes, 8, 8), 0x0123456789abcdefu);
  EXPECT_EQ(bytes[8], 0xef);
  EXPECT_EQ(Number(bytes, 16, 8), 1000u);
  EXPECT_EQ(Real(bytes, 24), 12.5);
  EXPECT_EQ(Number(bytes, 32, 8), 5u);
  EXPECT_EQ(Real(bytes, 40), -3.5);
  EXPECT_EQ(Real(bytes, 48), 0.125);
  EXPECT_EQ(Number(bytes, 56, 4), 5u);
  EXPECT_EQ(Number(bytes, 60, 4), PoseMessage::kTag);
  EXPECT_EQ(Number(bytes, 64, 4), 39u);
  EXPECT_EQ(Number(bytes, 68, 4), 0u);
  EXPECT_EQ(Number(bytes, 72, 8), 7u);
  EXPECT_EQ(Real(bytes, 80), 12.25);
  EXPECT_EQ(Real(bytes, 88), 0.02);
  for (int i = 0; i < Message::kMaxSize; ++i) {
    EXPECT_EQ(Real(bytes, 96 + 8 * i), frame.message.body[i]) << i;
  }
}

TEST(WireFormatTest, AFrameComesBackBitForBit) {
  RandomStream random(1);
  const auto any = [&random](double bound) {
    return bound * (2 * random.Uniform() - 1);
  };
  const auto bits = [&random] {
    return static_cast<std::uint64_t>(random.Uniform() * 0x1p32) << 32 |
           static_cast<std::uint64_t>(random.Uniform() * 0x1p32);
  };
  for (int i = 0; i < 10000; ++i) {
    LinkFrame frame{.direction = i % 2 == 0 ? LinkDirection::kToHaptic
                                            : LinkDirection::kToRobot,
                    .session = bits() | 1,
                    .number = bits(),
                    .time = any(1e11),
                    .echo = {bits(), any(1e11), std::abs(any(1e11))},
                    .flags = static_cast<std::uint32_t>(bits() & kLinkFlags)};
    Message& message = frame.message;
    message.tag = static_cast<MessageTag>(bits() | 1);
    message.size = static_cast<std::int32_t>(41 * random.Uniform());
    message.sequence = static_cast<std::int64_t>(bits() >> 1);
    message.send_time = any(1e11);
    // Any bits at all, NaN of every kind among them.
    message.gripper_opening = std::bit_cast<double>(bits() | bits());
    for (int k = 0; k < message.size; ++k) {
      message.body[k] = i % 3 == 0 ? any(1e300) : -0.0;
    }
    LinkFrame read;
    ASSERT_EQ(Decode(EncodeFrame(frame), &read, frame.direction),
              WireError::kNone);
    EXPECT_EQ(read.direction, frame.direction);
    ExpectSame(read, frame);
    EXPECT_EQ(read.session, frame.session);
    EXPECT_EQ(read.message.sequence, message.sequence);
    EXPECT_EQ(read.message.size, message.size);
  }
}

TEST(WireFormatTest, AFrameWithoutAMessageIsOne) {
  LinkFrame frame{.direction = LinkDirection::kToHaptic, .session = 1};
  EXPECT_EQ(ErrorOf(frame), WireError::kNone);
  frame.message.size = 1;
  EXPECT_EQ(ErrorOf(frame), WireError::kMessage);
  frame.message = {.tag = 3};
  EXPECT_EQ(ErrorOf(frame), WireError::kMessage);
  frame.message = {.sequence = 3};
  EXPECT_EQ(ErrorOf(frame), WireError::kMessage);
}

TEST(WireFormatTest, BytesOfAnyOtherLengthAreNone) {
  const FrameBytes good = EncodeFrame(MakeFrame());
  std::vector<std::uint8_t> bytes(good.begin(), good.end());
  bytes.resize(1000);
  LinkFrame read;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_EQ(Decode({bytes.data(), size}, &read) == WireError::kNone,
              size == kFrameSize)
        << size;
  }
  EXPECT_EQ(Decode({}, &read), WireError::kLength);
}

TEST(WireFormatTest, SaysWhyBytesAreNone) {
  const auto changed = [](std::size_t at, std::uint8_t value) {
    FrameBytes bytes = EncodeFrame(MakeFrame());
    bytes[at] = value;
    LinkFrame read;
    return Decode(bytes, &read);
  };
  EXPECT_EQ(changed(0, 'd'), WireError::kMagic);
  EXPECT_EQ(changed(4, 2), WireError::kVersion);
  EXPECT_EQ(changed(5, 1), WireError::kVersion);
  EXPECT_EQ(changed(6, 0), WireError::kDirection);
  EXPECT_EQ(changed(6, 1), WireError::kDirection);
  EXPECT_EQ(changed(6, 3), WireError::kDirection);
  EXPECT_EQ(changed(7, 1), WireError::kReserved);
  EXPECT_EQ(changed(56, 8), WireError::kReserved);
  EXPECT_EQ(changed(59, 1), WireError::kReserved);
  EXPECT_EQ(changed(64, 41), WireError::kMessage);
  EXPECT_EQ(changed(67, 0x80), WireError::kMessage);
  EXPECT_EQ(changed(70, 1), WireError::kReserved);
  EXPECT_EQ(changed(79, 0xff), WireError::kMessage);
  EXPECT_EQ(changed(415, 1), WireError::kUnused);
  LinkFrame frame = MakeFrame();
  frame.session = 0;
  EXPECT_EQ(ErrorOf(frame), WireError::kSession);
  // Another version may have another length.
  FrameBytes bytes = EncodeFrame(MakeFrame());
  bytes[4] = 2;
  EXPECT_EQ(Decode(std::span(bytes).first(100), &frame), WireError::kVersion);
}

TEST(WireFormatTest, EveryNumberIsFinite) {
  double LinkFrame::* const kTime = &LinkFrame::time;
  for (const double bad : {kNan, kInfinity, -kInfinity, 1e12}) {
    LinkFrame frame = MakeFrame();
    frame.*kTime = bad;
    EXPECT_EQ(ErrorOf(frame), WireError::kNotFinite);
    frame = MakeFrame();
    frame.echo.time = bad;
    EXPECT_EQ(ErrorOf(frame), WireError::kNotFinite);
    frame = MakeFrame();
    frame.echo.age = bad;
    EXPECT_EQ(ErrorOf(frame), WireError::kNotFinite);
    frame = MakeFrame();
    frame.message.send_time = bad;
    EXPECT_EQ(ErrorOf(frame), WireError::kNotFinite);
    frame = MakeFrame();
    frame.message.gripper_opening = bad;
    EXPECT_EQ(ErrorOf(frame), WireError::kNone);
    for (int i = 0; i < Message::kMaxSize; ++i) {
      frame = MakeFrame();
      frame.message.body[i] = bad;
      const WireError expected = i >= frame.message.size ? WireError::kUnused
                                 : std::isfinite(bad) ? WireError::kNone
                                                      : WireError::kNotFinite;
      EXPECT_EQ(ErrorOf(frame), expected) << i;
    }
  }
  LinkFrame frame = MakeFrame();
  frame.echo.age = -1e-9;
  EXPECT_EQ(ErrorOf(frame), WireError::kNotFinite);
}

// One bit of a frame in the air.
TEST(WireFormatTest, WhatIsTakenIsWhatTheBytesSay) {
  const FrameBytes good = EncodeFrame(MakeFrame());
  int taken = 0;
  for (std::size_t bit = 0; bit < 8 * kFrameSize; ++bit) {
    FrameBytes bytes = good;
    bytes[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    LinkFrame read = MakeFrame();
    read.number = 77;
    if (Decode(bytes, &read) == WireError::kNone) {
      EXPECT_EQ(EncodeFrame(read), bytes) << bit;
      ++taken;
    } else {
      EXPECT_EQ(read.number, 77u) << bit;
    }
  }
  // TLS, not the format, sees to it that no bit is changed on the way.
  EXPECT_GT(taken, 2000);
}

TEST(WireFormatTest, EveryErrorHasANameAndAText) {
  std::set<std::string> names;
  std::set<std::string> texts;
  for (const auto& [error, name] : EnumStrings<WireError>::kValues) {
    names.insert(name);
    texts.insert(DescribeWireError(error));
  }
  EXPECT_EQ(names.size(), kWireErrors);
  EXPECT_EQ(texts.size(), kWireErrors);
  EXPECT_NE(texts.count("are no frame"), 1u);
}

TEST(WireFormatTest, AllocatesNothing) {
  const LinkFrame frame = MakeFrame();
  LinkFrame read;
  ScopedNoAlloc guard;
  const FrameBytes bytes = EncodeFrame(frame);
  Decode(bytes, &read);
  Decode(std::span(bytes).first(10), &read);
  EXPECT_EQ(guard.count(), 0);
}

}  // namespace
}  // namespace dual_proxy
