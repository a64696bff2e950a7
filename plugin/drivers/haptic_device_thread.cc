// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/haptic_device_thread.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <system_error>
#include <utility>

#include <Eigen/LU>

#include "dual_proxy/common/norm.h"
#include "dual_proxy/drivers/clock.h"

namespace dual_proxy {
namespace {

// s: a device that fails for so long is lost; between looks at its status.
constexpr double kLostAfter = 0.1;
constexpr double kStatusPeriod = 0.1;

// s: for a device that was opened to be read.
constexpr double kFirstReading = 1;

// Above what applications use, below the kernel's own threads.
constexpr int kPriority = 80;

// Nothing in the hand is or moves beyond these.
constexpr double kMostPosition = 1;
constexpr double kMostVelocity = 20;
constexpr double kMostAngularVelocity = 200;
constexpr double kMostOpening = 0.2;
constexpr double kRotationTolerance = 1e-3;

bool IsPossible(const HandleState& state) {
  const Eigen::Matrix3d& R = state.X_DH.R;
  // So that what is not finite fails, too.
  const auto within = [](double value, double most) {
    return std::abs(value) <= most;
  };
  return within(StableNorm(state.X_DH.p), kMostPosition) &&
         within(StableNorm(state.velocity.head<3>()), kMostVelocity) &&
         within(StableNorm(state.velocity.tail<3>()), kMostAngularVelocity) &&
         within((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(),
                kRotationTolerance) &&
         R.determinant() > 0 &&
         (std::isnan(state.gripper_opening) ||
          within(state.gripper_opening, kMostOpening));
}

bool TryRealTime(pthread_t thread) noexcept {
  sched_param param{};
  param.sched_priority = kPriority;
  return pthread_setschedparam(thread, SCHED_FIFO, &param) == 0;
}

Eigen::Vector3d LimitSize(const Eigen::Vector3d& value, double most) {
  const double size = StableNorm(value);
  return size > most ? Eigen::Vector3d(value * (most / size)) : value;
}

}  // namespace

void HapticDeviceThreadParams::Validate() const {
  ValidateFields("HapticDeviceThreadParams", *this);
}

HapticDeviceThread::HapticDeviceThread(const HapticDeviceThreadParams& params,
                                       std::unique_ptr<HapticHardware> hardware)
    : params_(params), hardware_(std::move(hardware)) {
  params_.Validate();
}

HapticDeviceThread::~HapticDeviceThread() { Close(); }

void HapticDeviceThread::Open() {
  const std::lock_guard lock(open_mutex_);
  CloseLocked();
  hardware_->Open();
  if (!AwaitReading()) {
    const std::string error = hardware_->GetLastError();
    const std::string problem = hardware_->name() +
                                ": was opened, but cannot be read" +
                                (error.empty() ? "" : " (" + error + ")");
    hardware_->Close();
    throw DriverError(problem);
  }
  readings_.Set(newest_);
  commands_.Set({});
  has_gripper_ = std::isfinite(newest_.value.gripper_opening);
  counters_.cycles = 0;
  counters_.overruns = 0;
  counters_.watchdogs = 0;
  counters_.device_watchdogs = 0;
  counters_.bad_reads = 0;
  counters_.failed_writes = 0;
  counters_.bad_commands = 0;
  {
    const std::lock_guard text_lock(text_mutex_);
    name_ = hardware_->name();
    fault_.clear();
  }
  stop_ = false;
  try {
    thread_ = std::thread(&HapticDeviceThread::Serve, this);
  } catch (const std::system_error& error) {
    hardware_->Close();
    throw DriverError(std::string("No thread for the device: ") + error.what());
  }
  real_time_ = TryRealTime(thread_.native_handle());
  open_ = true;
}

// Velocities are estimated over a window of time, and may fail until it is
// full.
bool HapticDeviceThread::AwaitReading() {
  const double start = MonotonicTime();
  while (true) {
    const double time = MonotonicTime();
    HandleState state;
    if (hardware_->Read(&state) && IsPossible(state)) {
      newest_ = {.time = time, .valid = true, .value = state};
      return true;
    }
    if (time - start > kFirstReading) return false;
    hardware_->Write(Vector6::Zero(), 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

void HapticDeviceThread::Close() noexcept {
  const std::lock_guard lock(open_mutex_);
  CloseLocked();
}

void HapticDeviceThread::CloseLocked() noexcept {
  if (!thread_.joinable()) return;
  stop_ = true;
  thread_.join();
  open_ = false;
  hardware_->Close();
}

Reading<HandleState> HapticDeviceThread::Read() noexcept {
  Reading<HandleState> reading = readings_.Get();
  reading.valid = reading.valid && open_;
  return reading;
}

void HapticDeviceThread::Write(const Vector6& wrench,
                               double gripper_force) noexcept {
  if (!wrench.allFinite() || (has_gripper_ && !std::isfinite(gripper_force))) {
    ++counters_.bad_commands;
    return;
  }
  commands_.Set({.time = MonotonicTime(),
                 .wrench = wrench,
                 .gripper_force = has_gripper_ ? gripper_force : 0});
}

std::string HapticDeviceThread::fault() const {
  const std::lock_guard lock(text_mutex_);
  return fault_;
}

std::string HapticDeviceThread::name() const {
  const std::lock_guard lock(text_mutex_);
  return name_;
}

void HapticDeviceThread::SetFault(const std::string& fault) {
  const std::lock_guard lock(text_mutex_);
  fault_ = fault;
}

HapticDeviceCounters HapticDeviceThread::counters() const noexcept {
  return {.cycles = counters_.cycles,
          .overruns = counters_.overruns,
          .watchdogs = counters_.watchdogs,
          .device_watchdogs = counters_.device_watchdogs,
          .bad_reads = counters_.bad_reads,
          .failed_writes = counters_.failed_writes,
          .bad_commands = counters_.bad_commands};
}

HapticDeviceThread::Command HapticDeviceThread::Limited(
    const Command& command) const noexcept {
  Command limited = command;
  limited.wrench.head<3>() =
      LimitSize(command.wrench.head<3>(), params_.max_force);
  limited.wrench.tail<3>() =
      LimitSize(command.wrench.tail<3>(), params_.max_moment);
  limited.gripper_force =
      std::clamp(command.gripper_force, -params_.max_gripper_force,
                 params_.max_gripper_force);
  return limited;
}

void HapticDeviceThread::Serve() noexcept {
  try {
    ServeUntilStopped();
  } catch (const std::exception& error) {
    hardware_->Write(Vector6::Zero(), 0);
    SetFault(std::string("The device's thread ended: ") + error.what());
  }
}

void HapticDeviceThread::ServeUntilStopped() {
  using Clock = std::chrono::steady_clock;
  const auto period = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(1 / params_.rate));
  Clock::time_point deadline = Clock::now();
  Reading<HandleState>& reading = newest_;
  double worked = MonotonicTime();  // Last time that the device did.
  double next_status = worked;
  bool commanded = false;
  while (!stop_) {
    const double time = MonotonicTime();
    HandleState state;
    const bool is_read = hardware_->Read(&state) && IsPossible(state);
    if (is_read) {
      reading = {.time = time, .valid = true, .value = state};
    } else {
      reading.valid = false;
      ++counters_.bad_reads;
    }
    readings_.Set(reading);

    const Command& command = commands_.Get();
    const bool fresh = MonotonicTime() - command.time <= params_.watchdog;
    if (commanded && !fresh) ++counters_.watchdogs;
    commanded = fresh;
    const Command out = fresh ? Limited(command) : Command{};
    const bool is_written = hardware_->Write(out.wrench, out.gripper_force);
    if (!is_written) ++counters_.failed_writes;
    ++counters_.cycles;

    if (is_read && is_written) {
      worked = time;
    } else if (MonotonicTime() - worked > kLostAfter) {
      const std::string error = hardware_->GetLastError();
      SetFault(hardware_->name() + " no longer answers" +
               (error.empty() ? "" : " (" + error + ")") +
               ": see to its plug and power, then open it again");
      break;
    }
    if (time >= next_status) {
      next_status = time + kStatusPeriod;
      const HapticTrouble trouble = hardware_->GetTrouble();
      if (trouble.was_watchdog) ++counters_.device_watchdogs;
      SetFault(trouble.text.empty() ? ""
                                    : hardware_->name() + ": " + trouble.text);
    }

    deadline += period;
    const Clock::time_point now = Clock::now();
    if (now > deadline) {
      ++counters_.overruns;
      deadline = now;
    } else {
      std::this_thread::sleep_until(deadline);
    }
  }
  reading.valid = false;
  readings_.Set(reading);
  hardware_->Write(Vector6::Zero(), 0);
}

}  // namespace dual_proxy
