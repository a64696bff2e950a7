// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include <Eigen/Core>

#include "dual_proxy/drivers/driver.h"
#include "dual_proxy/drivers/ft_sensor/rdt_sensor_params.h"
#include "dual_proxy/drivers/ft_sensor/rdt_sequence.h"

namespace dual_proxy {

/** Why a reading of an RDT sensor is not valid. */
enum class RdtFault {
  kNone,
  kClosed,  ///< Nobody asked for records.
  kSilent,  ///< None comes.
  kStatus,  ///< The sensor reports a fault of its own.
  kRange,   ///< Beyond what it can measure.
  kFrozen,  ///< The same again and again.
};

/** From an RDT sensor's datagrams to readings, without network and clock.

A record is taken if it is newer than all before. It is valid if the sensor
reports no fault, no value is out of range, and it is no copy: where the
sensor's count of its samples stands still, the reading stays as old as it is,
and where count or values stand still for `frozen_time`, it is not valid.
Nothing here allocates or throws, but the constructor. */
class RdtStream {
 public:
  /** @throws std::invalid_argument if `params` is invalid. */
  explicit RdtStream(const RdtSensorParams& params);

  /** Takes a datagram.
  @param time  s, MonotonicTime() at which it arrived. */
  void Take(std::span<const std::uint8_t> datagram, double time) noexcept;

  /** A new stream is asked for. */
  void NoteRequest() noexcept;

  /** Until NoteRequest() there is nothing. */
  void Close() noexcept { Refuse(RdtFault::kClosed); }

  /** [force; moment about the sensor's origin], N, N m, in S: of the arm on the
  tool. While it is not valid, time and value are those of the last that was. */
  const Reading<Vector6>& reading() const { return reading_; }
  RdtFault fault() const { return fault_; }
  std::uint32_t status() const { return status_; }  ///< Of the last record.
  const RdtCounts& counts() const { return counts_; }
  /** s: at which the last record was taken, valid or not. */
  double last_arrival() const { return last_arrival_; }

 private:
  static constexpr double kNever = -std::numeric_limits<double>::infinity();

  void Refuse(RdtFault fault) noexcept;

  /** From forces in counts to N in S, from torques to N m. */
  Eigen::Matrix3d force_scale_;
  Eigen::Matrix3d moment_scale_;
  double max_force_;
  double max_moment_;
  double frozen_time_;

  RdtSequence sequence_;
  RdtCounts counts_;
  Reading<Vector6> reading_{.value = Vector6::Zero()};
  RdtFault fault_{RdtFault::kClosed};
  std::uint32_t status_{0};
  double last_arrival_{kNever};
  std::uint32_t sample_{0};
  std::array<std::int32_t, 6> values_{};
  /** s: when sample and values last were others than before. */
  double last_change_{kNever};
};

}  // namespace dual_proxy
