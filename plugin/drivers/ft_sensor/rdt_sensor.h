// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "dual_proxy/drivers/driver.h"
#include "dual_proxy/drivers/ft_sensor/rdt_record.h"
#include "dual_proxy/drivers/ft_sensor/rdt_sensor_params.h"
#include "dual_proxy/drivers/ft_sensor/rdt_stream.h"
#include "dual_proxy/drivers/latest_value.h"

namespace dual_proxy {

/** A force/torque sensor that speaks RDT: ATI's Net F/T, Ethernet Axia.

A thread receives, and asks for the stream when there is none. Only what the
sensor's own address and port send gets to it. A reading's time is when its
record arrived at this machine, also where the process comes to it later.

Open(), Read() and Close() are for one thread; fault() and counts() may be
called from any. Of the sensor itself nothing is changed, its bias least of all:
that is ForceTorqueAdapter's. */
class RdtSensor final : public ForceTorqueSensorDriver {
 public:
  /** @throws std::invalid_argument if `params` is invalid. */
  explicit RdtSensor(const RdtSensorParams& params = {});
  ~RdtSensor() override { Close(); }

  RdtSensor(const RdtSensor&) = delete;
  RdtSensor& operator=(const RdtSensor&) = delete;

  const RdtSensorParams& params() const { return params_; }

  /** Returns when there is a valid reading.
  @throws DriverError if there is none within a second. Finding a host by its
  name may take the system longer. */
  void Open() override;

  Reading<Vector6> Read() noexcept override { return latest_.Get(); }

  /** Takes a few hundredths of a second. */
  void Close() noexcept override;

  std::string fault() const override;

  RdtCounts counts() const;

 private:
  /** What the receiving thread says to those that have time. */
  struct Report {
    RdtFault fault{RdtFault::kClosed};
    std::uint32_t status{0};
    int error{0};  ///< The last of the system's since a record was taken.
    bool valid{false};
    RdtCounts counts{};
  };

  void Serve() noexcept;
  void Send(RdtCommand command) noexcept;
  void Receive() noexcept;
  void Publish() noexcept;
  std::string Describe(const Report& report) const;

  RdtSensorParams params_;
  std::thread thread_;
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;
  std::condition_variable reported_;
  Report report_;  ///< Guarded by mutex_.

  // Of the thread alone while it runs.
  int socket_{-1};
  int error_{0};
  RdtStream stream_;

  LatestValue<Reading<Vector6>> latest_{stream_.reading()};
};

}  // namespace dual_proxy
