// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/drivers/driver.h"
#include "dual_proxy/drivers/latest_value.h"

namespace dual_proxy {

/** Parameters of HapticDeviceThread; the defaults are an Omega.7's. */
struct HapticDeviceThreadParams {
  double rate{2000};
  double watchdog{0.02};
  double max_force{12};
  double max_moment{0};
  double max_gripper_force{8};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("rate", &rate, Between(1000, 4000), "Hz",
                   "at which the device is served"));
    a->Visit(Field("watchdog", &watchdog, Between(0.002, 0.1), "s",
                   "without a fresh command after which there is no force"));
    a->Visit(Field("max_force", &max_force, Between(0, 20), "N",
                   "largest force on the hand; an Omega.7 has 12"));
    a->Visit(Field("max_moment", &max_moment, Between(0, 1), "N m",
                   "largest moment on the hand; an Omega.7 has none"));
    a->Visit(Field("max_gripper_force", &max_gripper_force, Between(0, 8), "N",
                   "largest force on the fingers; an Omega.7 has 8"));
  }
};

/** What HapticDeviceThread has counted since Open(). */
struct HapticDeviceCounters {
  std::int64_t cycles{0};
  std::int64_t overruns{0};          ///< Cycles that took longer than a period.
  std::int64_t watchdogs{0};         ///< Times that commands stayed away.
  std::int64_t device_watchdogs{0};  ///< Times that the device found so itself.
  std::int64_t bad_reads{0};         ///< Failed, not finite or beyond reason.
  std::int64_t failed_writes{0};     ///< Forces that the device did not take.
  std::int64_t bad_commands{0};      ///< Not finite, and so not taken.
};

/** What a device that answers says of itself. */
struct HapticTrouble {
  std::string text{};        ///< What keeps it from working; empty: nothing.
  bool was_watchdog{false};  ///< Its own had ended forces; they are on again.
};

/** A haptic device as its vendor's library has it: what HapticDeviceThread
serves. It is opened and closed by one thread, and in between read and written
by another. */
class HapticHardware {
 public:
  virtual ~HapticHardware() = default;

  /** Finds the device and makes it ready, without force; if that fails it is
  closed again.
  @throws DriverError */
  virtual void Open() = 0;

  /** Lets go of it. */
  virtual void Close() noexcept = 0;

  /** @returns whether the device answered; if not, `state` may be anything. */
  virtual bool Read(HandleState* state) noexcept = 0;

  /** @returns whether the device took it. */
  virtual bool Write(const Vector6& wrench, double gripper_force) noexcept = 0;

  /** Which device it is, once it is open. */
  virtual std::string name() const = 0;

  /** What its library said last, may be empty. */
  virtual std::string GetLastError() = 0;

  /** Asked for ten times a second. */
  virtual HapticTrouble GetTrouble() = 0;
};

/** Serves a haptic device at its own rate by a thread, at absolute deadlines
and with real-time priority where that can be had. The side's thread never waits
for the device: both exchange newest values.

Each period the handle is read and the newest command written, limited in size.
A command that is older than the watchdog counts as none. What is not finite is
not valid, nor is what no device that is held in the hand can be: beyond 1 m,
20 m/s, 200 rad/s, or a rotation that is none.

A device that has failed for 0.1 s is lost: fault() says so, and there is no
force until it is opened again. */
class HapticDeviceThread : public HapticDeviceDriver {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  HapticDeviceThread(const HapticDeviceThreadParams& params,
                     std::unique_ptr<HapticHardware> hardware);
  ~HapticDeviceThread() override;

  HapticDeviceThread(const HapticDeviceThread&) = delete;
  HapticDeviceThread& operator=(const HapticDeviceThread&) = delete;

  /** A device that is open is closed first. What Read() has afterwards is
  valid. */
  void Open() override;
  Reading<HandleState> Read() noexcept override;
  void Write(const Vector6& wrench, double gripper_force) noexcept override;

  /** Returns when the device's own calls do. */
  void Close() noexcept override;
  std::string fault() const override;

  HapticDeviceCounters counters() const noexcept;

  /** Whether the thread has real-time priority. */
  bool real_time() const noexcept { return real_time_; }

  /** Which device it is, once it was opened. */
  std::string name() const;

 private:
  struct Command {
    double time{-std::numeric_limits<double>::infinity()};
    Vector6 wrench{Vector6::Zero()};
    double gripper_force{0};
  };

  struct AtomicCounters {
    std::atomic<std::int64_t> cycles{0};
    std::atomic<std::int64_t> overruns{0};
    std::atomic<std::int64_t> watchdogs{0};
    std::atomic<std::int64_t> device_watchdogs{0};
    std::atomic<std::int64_t> bad_reads{0};
    std::atomic<std::int64_t> failed_writes{0};
    std::atomic<std::int64_t> bad_commands{0};
  };

  void CloseLocked() noexcept;
  bool AwaitReading();
  void Serve() noexcept;
  void ServeUntilStopped();
  void SetFault(const std::string& fault);
  Command Limited(const Command& command) const noexcept;

  HapticDeviceThreadParams params_;
  std::unique_ptr<HapticHardware> hardware_;

  std::mutex open_mutex_;  // Open() and Close().
  std::thread thread_;
  std::atomic<bool> open_{false};
  std::atomic<bool> stop_{false};
  std::atomic<bool> real_time_{false};
  std::atomic<bool> has_gripper_{false};
  AtomicCounters counters_;

  Reading<HandleState> newest_;  // The thread's, while there is one.
  LatestValue<Reading<HandleState>> readings_;
  LatestValue<Command> commands_;

  mutable std::mutex text_mutex_;  // Of these, which change with faults alone.
  std::string name_;
  std::string fault_;
};

}  // namespace dual_proxy
