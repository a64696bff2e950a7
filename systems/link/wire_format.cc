// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/wire_format.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <type_traits>

#include "dual_proxy/common/possible.h"

namespace dual_proxy {
namespace {

static_assert(std::numeric_limits<double>::is_iec559);

constexpr std::array<std::uint8_t, 4> kMagic{'D', 'P', 'X', 'Y'};
constexpr std::size_t kPrefixSize = 6;  // What every version begins with.

// An integer, or a double's bits, as unsigned.
template <typename T>
auto ToBits(T value) noexcept {
  if constexpr (std::is_same_v<T, double>) {
    return std::bit_cast<std::uint64_t>(value);
  } else {
    return static_cast<std::make_unsigned_t<T>>(value);
  }
}

class Writer {
 public:
  explicit Writer(std::uint8_t* next) : next_(next) {}

  template <typename T>
  void Put(T value) noexcept {
    const auto bits = ToBits(value);
    for (std::size_t i = 0; i < sizeof(bits); ++i) {
      *next_++ = static_cast<std::uint8_t>(bits >> (8 * i));
    }
  }

 private:
  std::uint8_t* next_;
};

class Reader {
 public:
  explicit Reader(const std::uint8_t* next) : next_(next) {}

  template <typename T>
  T Take() noexcept {
    using Bits = decltype(ToBits(T{}));
    Bits bits{0};
    for (std::size_t i = 0; i < sizeof(bits); ++i) {
      bits = static_cast<Bits>(bits | static_cast<Bits>(*next_++) << (8 * i));
    }
    return std::bit_cast<T>(bits);
  }

 private:
  const std::uint8_t* next_;
};

bool IsTime(double value) noexcept { return IsWithin(value, kMaxTime); }

WireError Check(const LinkFrame& frame) noexcept {
  const Message& message = frame.message;
  if (frame.session == 0) return WireError::kSession;
  if ((frame.flags & ~kLinkFlags) != 0) return WireError::kReserved;
  const bool none = message.sequence == -1;
  if (message.size < 0 || message.size > Message::kMaxSize ||
      message.sequence < -1 || (message.tag == 0) != none ||
      (none && message.size != 0)) {
    return WireError::kMessage;
  }
  if (!IsTime(frame.time) || !IsTime(frame.echo.time) ||
      !IsTime(frame.echo.age) || frame.echo.age < 0 ||
      !IsTime(message.send_time) || !IsFinite(message)) {
    return WireError::kNotFinite;
  }
  if (std::any_of(message.body.begin() + message.size, message.body.end(),
                  [](double value) { return ToBits(value) != 0; })) {
    return WireError::kUnused;
  }
  return WireError::kNone;
}

}  // namespace

const char* DescribeWireError(WireError error) noexcept {
  switch (error) {
    case WireError::kNone:
      return "are a frame";
    case WireError::kLength:
      return "are not as many as a frame has (416)";
    case WireError::kMagic:
      return "do not begin with \"DPXY\": no dual-proxy made them";
    case WireError::kVersion:
      return "have another version of the format: both sides need the same "
             "version of dual-proxy";
    case WireError::kDirection:
      return "go the other way: both sides are the same one, or they came back";
    case WireError::kSession:
      return "have no session";
    case WireError::kReserved:
      return "have a flag or a reserved byte that is not 0";
    case WireError::kMessage:
      return "have a tag, size and sequence that no message has";
    case WireError::kNotFinite:
      return "have a number that is not finite, or a time out of range";
    case WireError::kUnused:
      return "have a number beyond the message's size that is not 0";
  }
  return "are no frame";
}

FrameBytes EncodeFrame(const LinkFrame& frame) noexcept {
  FrameBytes bytes{};
  std::copy(kMagic.begin(), kMagic.end(), bytes.begin());
  Writer writer(bytes.data() + kMagic.size());
  writer.Put(kWireVersion);
  writer.Put(static_cast<std::uint8_t>(frame.direction));
  writer.Put(std::uint8_t{0});
  writer.Put(frame.session);
  writer.Put(frame.number);
  writer.Put(frame.time);
  writer.Put(frame.echo.session);
  writer.Put(frame.echo.time);
  writer.Put(frame.echo.age);
  writer.Put(frame.flags);
  writer.Put(frame.message.tag);
  writer.Put(frame.message.size);
  writer.Put(std::uint32_t{0});
  writer.Put(frame.message.sequence);
  writer.Put(frame.message.send_time);
  writer.Put(frame.message.gripper_opening);
  for (const double value : frame.message.body) writer.Put(value);
  return bytes;
}

WireError DecodeFrame(std::span<const std::uint8_t> bytes,
                      LinkDirection expected, LinkFrame* frame) noexcept {
  if (bytes.size() < kPrefixSize) return WireError::kLength;
  if (!std::equal(kMagic.begin(), kMagic.end(), bytes.begin())) {
    return WireError::kMagic;
  }
  Reader reader(bytes.data() + kMagic.size());
  // Before the length, which another version may have changed.
  if (reader.Take<std::uint16_t>() != kWireVersion) return WireError::kVersion;
  if (bytes.size() != kFrameSize) return WireError::kLength;
  if (reader.Take<std::uint8_t>() != static_cast<std::uint8_t>(expected)) {
    return WireError::kDirection;
  }
  if (reader.Take<std::uint8_t>() != 0) return WireError::kReserved;
  LinkFrame read{.direction = expected};
  read.session = reader.Take<std::uint64_t>();
  read.number = reader.Take<std::uint64_t>();
  read.time = reader.Take<double>();
  read.echo.session = reader.Take<std::uint64_t>();
  read.echo.time = reader.Take<double>();
  read.echo.age = reader.Take<double>();
  read.flags = reader.Take<std::uint32_t>();
  read.message.tag = reader.Take<std::uint32_t>();
  read.message.size = reader.Take<std::int32_t>();
  if (reader.Take<std::uint32_t>() != 0) return WireError::kReserved;
  read.message.sequence = reader.Take<std::int64_t>();
  read.message.send_time = reader.Take<double>();
  read.message.gripper_opening = reader.Take<double>();
  for (double& value : read.message.body) value = reader.Take<double>();
  const WireError error = Check(read);
  if (error == WireError::kNone) *frame = read;
  return error;
}

}  // namespace dual_proxy
