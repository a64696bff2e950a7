// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/ft_sensor/rdt_stream.h"

#include <algorithm>

#include "dual_proxy/common/possible.h"
#include "dual_proxy/drivers/ft_sensor/rdt_record.h"

namespace dual_proxy {

using Eigen::Vector3d;

RdtStream::RdtStream(const RdtSensorParams& params)
    : max_force_((params.Validate(), params.max_force)),
      max_moment_(params.max_moment),
      frozen_time_(params.frozen_time) {
  const double sign = params.reports == SensedForce::kArmOnTool ? 1 : -1;
  force_scale_ = params.R_SN *
                 (sign * InNewton(params.force_unit) / params.counts_per_force);
  moment_scale_ = params.R_SN * (sign * InNewtonMetre(params.torque_unit) /
                                 params.counts_per_torque);
}

void RdtStream::Refuse(RdtFault fault) noexcept {
  reading_.valid = false;
  fault_ = fault;
}

void RdtStream::NoteRequest() noexcept {
  ++counts_.requests;
  sequence_.Restart();
  Refuse(RdtFault::kSilent);
}

void RdtStream::Take(std::span<const std::uint8_t> datagram,
                     double time) noexcept {
  RdtRecord record;
  if (!DecodeRdtRecord(datagram, &record)) {
    ++counts_.malformed;
    return;
  }
  if (!sequence_.Take(record.sequence, &counts_)) return;
  // Clocks of arrival may be set; what is read does not become older.
  last_arrival_ = std::max(last_arrival_, time);
  status_ = record.status;
  const bool is_first = last_change_ == kNever;
  const bool is_new = is_first || record.sample != sample_;
  if (is_first || (is_new && record.counts != values_)) {
    last_change_ = last_arrival_;
  }
  sample_ = record.sample;
  values_ = record.counts;

  const Vector3d force(values_[0], values_[1], values_[2]);
  const Vector3d moment(values_[3], values_[4], values_[5]);
  Vector6 value;
  value << force_scale_ * force, moment_scale_ * moment;
  RdtFault fault = RdtFault::kNone;
  if (IsRdtFault(record.status)) {
    fault = RdtFault::kStatus;
  } else if (!IsWithin(value.head<3>(), max_force_) ||
             !IsWithin(value.tail<3>(), max_moment_)) {
    fault = RdtFault::kRange;
  } else if (last_arrival_ - last_change_ >= frozen_time_) {
    fault = RdtFault::kFrozen;
  }
  if (fault != RdtFault::kNone) {
    ++counts_.faulty;
    Refuse(fault);
    return;
  }
  if (is_new || !reading_.valid) {
    reading_ = {.time = last_arrival_, .valid = true, .value = value};
  }
  fault_ = RdtFault::kNone;
}

}  // namespace dual_proxy
