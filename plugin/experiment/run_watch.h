// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/arm_limits.h"
#include "dual_proxy/experiment/run_log.h"
#include "dual_proxy/proxy/workspace_map.h"

namespace dual_proxy {

/** What RunWatch needs to know. */
struct RunWatchParams {
  ArmLimits<7> arm{};
  double device_force{12};    ///< N: most that a device may be told.
  double device_moment{0.5};  ///< N m, likewise.
  /** N/s, N m/s: how fast F_h and M_h may change, if that is limited. */
  std::optional<double> reference_force_rate{};
  std::optional<double> reference_moment_rate{};
  double control_period{1e-3};  ///< s, > 0.
  double rest_start{0};         ///< s: from then on all should be at rest.
  /** s: when the last fault is over, of the link for what arrives. */
  std::optional<double> fault_end{};
  /** Whether F_f and F_r are those of a closed force loop. */
  bool closes_force_loop{true};
  WorkspaceMapParams map{};  ///< Between device and robot.
  /** s: how long ago the hand may have been where the robot's proxy is, if that
  follows it. */
  double follow_lag{0.3};

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;
};

/** Something that was watched. */
struct WatchedValue {
  std::string name;
  std::string unit;
  /** The worst, NaN if it could not be told. */
  double value{0};
  /** Of the worst, s; NaN of what has no moment. */
  double time{0};
  /** Most that it may be, where that does not depend on the run. */
  std::optional<double> most{};
  /** "joint 4 speed 2.31 rad/s at 3.214 s (limit 2.175)", of an arm's limits.
   */
  std::string detail{};
};

/** Watches a run, piece by piece, as it is made: nothing of its log needs to be
kept, and a day can be watched.

In every period: that all is finite; the arm's limits (CheckArmLimits()), the
device's and those of F_h's and M_h's rates; that selections are symmetric
projections and rotations unit quaternions. Over the run, beyond 1 mW and in any
stretch of time: the most energy that the device has given to the hand, and that
the feedback of the closed loops of force and moment, F_f - Omega_f F_r and
alike, has given to the robot. From `fault_end` on: how long until both links
are connected and the robot's proxy is within 5 mm of where the hand was at some
time in the last `follow_lag`; as long as it has not, how long that has been.
From `rest_start` on: how much forces and positions swing about a straight line
(RMS). At the end: both links' status, and how far the tool is from where motion
control wants it. */
class RunWatch {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit RunWatch(const RunWatchParams& params);

  /** Takes the next piece of a log.
  @param piece  begins, but for the first one, with the last row of the one
    before, for rates. What it does not have is not watched. */
  void Add(const RunLog& piece);

  /** All so far. */
  std::vector<WatchedValue> Summarise() const;

 private:
  /** The most energy of a port in any stretch of time, J, beyond 1 mW. */
  struct Port {
    double energy{0};
    double least{0};

    /** Takes a period, W and s; returns the most in a stretch that ends now. */
    double Add(double power, double period);
  };

  /** Sums for the swing of a signal about a straight line. */
  struct Swing {
    const char* name;
    const char* unit;
    const char* signal;
    Eigen::Vector3d sum{Eigen::Vector3d::Zero()};
    Eigen::Vector3d sum_t{Eigen::Vector3d::Zero()};
    Eigen::Vector3d sum_squares{Eigen::Vector3d::Zero()};
    /** What the first was: subtracted from all, for the digits. */
    Eigen::Vector3d first{Eigen::Vector3d::Zero()};
  };

  void AddArm(const RunLog& piece);
  void AddDevice(const RunLog& piece);
  void AddShapes(const RunLog& piece, Eigen::Index first);
  void AddEnergy(const RunLog& piece, Eigen::Index first);
  void AddLoopEnergy(const RunLog& piece);
  void AddRecovery(const RunLog& piece, Eigen::Index first);
  void AddRest(const RunLog& piece, Eigen::Index first);
  void AddEnd(const RunLog& piece);
  /** Keeps the larger. */
  void Keep(const std::string& name, const std::string& unit, double value,
            double time, std::optional<double> most = {},
            const std::string& detail = {});

  RunWatchParams params_;
  std::vector<WatchedValue> values_;
  std::vector<Swing> swings_;
  double rest_count_{0};
  double rest_t_{0};   ///< Sum of times since rest_start, s.
  double rest_tt_{0};  ///< Of their squares, s^2.
  Port hand_;
  Port loop_;
  /** The hand's last places in B, m, and when it was there, s. */
  std::deque<std::pair<double, Eigen::Vector3d>> hand_path_;
  Eigen::Index rows_{0};                 ///< Of those that recovery looks at.
  std::optional<double> since_fault_{};  ///< s.
  bool follows_{false};
  bool has_begun_{false};
};

}  // namespace dual_proxy
