// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "dual_proxy/drivers/driver.h"
#include "dual_proxy/drivers/franka/finger_moves.h"
#include "dual_proxy/drivers/latest_value.h"

namespace dual_proxy {

/** What of libfranka's gripper is used, under libfranka's names. */
template <typename Api>
concept FrankaGripperApi =
    std::derived_from<typename Api::CommandException,
                      typename Api::Exception> &&
    std::constructible_from<typename Api::Gripper, const std::string&> &&
    requires(typename Api::Gripper& gripper, const double number) {
      { gripper.move(number, number) } -> std::same_as<bool>;
      {
        gripper.grasp(number, number, number, number, number)
      } -> std::same_as<bool>;
      { gripper.stop() } -> std::same_as<bool>;
      { gripper.readOnce().width } -> std::convertible_to<double>;
      { gripper.readOnce().max_width } -> std::convertible_to<double>;
    };

/** What other threads may know of a gripper. */
struct FrankaGripperStatus {
  /** m, between the fingers, as it said last; NaN: not yet. */
  double width{std::numeric_limits<double>::quiet_NaN()};
  std::int64_t moves{0};   ///< That it was told, with those that failed.
  std::int64_t grasps{0};  ///< Likewise.
  std::int64_t failures{0};
};

/** A Franka Hand in a thread of its own, as libfranka returns from a command
only when the fingers have come to rest. Command() and GetStatus() are for one
other thread, the arm's or the link's, which never waits for it; whatever the
gripper does, or that it is not there, is told by fault() and nowhere else. */
template <FrankaGripperApi Api>
class FrankaGripper {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit FrankaGripper(const FrankaGripperParams& params = {})
      : moves_(params), takeover_(params) {}
  ~FrankaGripper() { Close(); }

  FrankaGripper(const FrankaGripper&) = delete;
  FrankaGripper& operator=(const FrankaGripper&) = delete;

  /** Connects; nothing moves before a command. It has to be homed.
  @throws DriverError if it cannot be reached. */
  void Open(const std::string& host) {
    Close();
    moves_ = FingerMoves(moves_.params());
    takeover_ = FingerTakeover(moves_.params());
    try {
      gripper_ = std::make_unique<typename Api::Gripper>(host);
    } catch (const std::exception& e) {
      throw DriverError("gripper at " + host + ": " + e.what());
    }
    done_ = false;
    thread_ = std::thread([this] { Serve(); });
  }

  /** m, between the fingers, from now on; what is not finite is ignored, as is
  all of it until it has once been where the fingers are (FingerTakeover). */
  void Command(double width) noexcept {
    if (takeover_.Update(width, GetStatus().width) && std::isfinite(width)) {
      commands_.Set(width);
    }
  }

  const FrankaGripperStatus& GetStatus() noexcept { return statuses_.Get(); }

  /** What went wrong last, in one line; empty: nothing. For any thread. */
  std::string fault() const {
    const std::lock_guard lock(fault_mutex_);
    return fault_;
  }

  /** Ends a move that is under way; what is held goes on being held. */
  void Close() noexcept {
    done_ = true;
    if (thread_.joinable()) {
      try {
        if (busy_) gripper_->stop();
      } catch (const std::exception&) {
        // Then the move ends by itself.
      }
      thread_.join();
    }
    gripper_.reset();
  }

 private:
  /** s: between two looks at a gripper that has nothing to do. */
  static constexpr std::chrono::milliseconds kPause{20};
  /** m: whatever the fingers have met is what they are to hold. */
  static constexpr double kAnyWidth = 0.1;

  void Serve() noexcept {
    while (!done_) {
      try {
        const auto state = gripper_->readOnce();
        status_.width = state.width;
        statuses_.Set(status_);
        const FingerAction action =
            moves_.Next(commands_.Get(), state.width, state.max_width);
        if (action == FingerAction::kNone) {
          std::this_thread::sleep_for(kPause);
        } else {
          Do(action, state.width);
        }
      } catch (const typename Api::CommandException& e) {
        moves_.Refuse();
        ++status_.failures;
        SetFault(e.what());
      } catch (const std::exception& e) {
        ++status_.failures;
        SetFault(e.what());
        break;
      }
    }
    statuses_.Set(status_);
  }

  void Do(FingerAction action, double width) {
    struct Busy {
      explicit Busy(std::atomic<bool>* flag) : flag(flag) { *flag = true; }
      ~Busy() { *flag = false; }
      std::atomic<bool>* flag;
    } busy(&busy_);
    const FrankaGripperParams& params = moves_.params();
    if (action == FingerAction::kMove) {
      ++status_.moves;
      gripper_->move(moves_.target(), params.speed);
    } else {
      ++status_.grasps;
      gripper_->grasp(width, params.speed, params.force, kAnyWidth, kAnyWidth);
    }
  }

  void SetFault(const std::string& fault) {
    const std::lock_guard lock(fault_mutex_);
    fault_ = fault;
  }

  FingerMoves moves_;
  FingerTakeover takeover_;  // Of the other thread.
  std::unique_ptr<typename Api::Gripper> gripper_;
  std::thread thread_;
  std::atomic<bool> done_{true};
  std::atomic<bool> busy_{false};
  LatestValue<double> commands_{kNoGripper};
  LatestValue<FrankaGripperStatus> statuses_;
  mutable std::mutex fault_mutex_;
  std::string fault_;
  FrankaGripperStatus status_;  // Of the thread.
};

}  // namespace dual_proxy
