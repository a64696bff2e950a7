// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace dual_proxy {

/** What came of the records of a sensor's stream. */
struct RdtCounts {
  std::int64_t taken{0};      ///< Records that were newer than all before.
  std::int64_t lost{0};       ///< Not there when a later one came.
  std::int64_t repeated{0};   ///< The newest once more.
  std::int64_t late{0};       ///< Older than the newest; counted as lost, too.
  std::int64_t restarts{0};   ///< Of the numbers, by the sensor.
  std::int64_t malformed{0};  ///< Datagrams that are no record.
  std::int64_t faulty{0};     ///< Taken, with values that are not valid.
  std::int64_t requests{0};   ///< How often the stream was asked for.
};

/** Puts the records of a stream in order by their 32-bit numbers, which wrap
around. One that is further than kLongestJump from the newest, in either
direction, begins a new stream. */
class RdtSequence {
 public:
  static constexpr std::int32_t kLongestJump = 1000;

  /** @returns whether the record is newer than all before. */
  bool Take(std::uint32_t sequence, RdtCounts* counts) noexcept;

  /** A new stream was asked for: its first number may be any. */
  void Restart() noexcept { started_ = false; }

  /** The newest number, unwrapped: it goes on where a stream restarts. */
  std::int64_t position() const { return position_; }

 private:
  bool started_{false};
  std::uint32_t newest_{0};
  std::int64_t position_{0};
};

}  // namespace dual_proxy
