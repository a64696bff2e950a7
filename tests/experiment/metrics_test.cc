// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/metrics.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "log_table.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::RowVector3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kPi = std::numbers::pi;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
/** Contact lasts from here to there; the hand begins to lift before its end. */
constexpr double kContactStart = 3;
constexpr double kContactEnd = 16.2;
constexpr double kLift = 16;
constexpr double kContactHeight = 0.41;
constexpr double kDepth = 0.04;
constexpr double kForce = 6.5;

const SignalSlice kSignals[] = {
    {"hand_position", 0, 3},        {"device_position", 3, 3},
    {"device_force", 6, 3},         {"robot_position", 9, 3},
    {"reference_force", 12, 3},     {"sensed_force", 15, 3},
    {"contact_force", 18, 3},       {"contact_normal", 21, 3},
    {"contact_dimension", 24, 1},   {"dimension", 25, 1},
    {"force_direction", 26, 3},     {"force_selection", 29, 9},
    {"observed_energy", 38, 1},     {"robot_link_dropped", 39, 1},
    {"haptic_link_dropped", 40, 1}, {"robot_proxy_position", 41, 3},
    {"robot_velocity", 44, 3},      {"joint_position", 47, 7},
    {"joint_velocity", 54, 7},      {"torque", 61, 7}};
constexpr int kColumns = 68;

/** Height of the hand: down, below the surface, and up again. */
double HandHeight(double time) {
  constexpr double kDown = kContactHeight - kDepth;
  constexpr double kUp = 0.48;
  const double down = std::clamp((kContactStart - time) / 2, 0.0, 1.0);
  const double up = std::clamp((time - kLift) / 0.4, 0.0, 1.0);
  return kDown + (kUp - kDown) * (down + up);
}

/** A run that presses on a table along -z, without any error: every metric is
known by hand. Tests change what they are about. */
class MetricsTest : public testing::Test {
 protected:
  MetricsTest() {
    params_.map.p_cw = Vector3d(0.45, 0, 0.48);
    constexpr int kRows = 20001;
    log_.time = VectorXd::LinSpaced(kRows, 0, 20);
    log_.signals.assign(std::begin(kSignals), std::end(kSignals));
    log_.values.setZero(kRows, kColumns);
    Column("joint_position", 3).setConstant(-1);
    SetPositions();
    for (int i = 0; i < kRows; ++i) {
      if (!Touching(i)) continue;
      Column("contact_force", 2)(i) = -kForce;
      Column("contact_normal", 2)(i) = -1;
      Column("contact_dimension")(i) = 1;
      Column("dimension")(i) = 1;
      Column("force_direction", 2)(i) = -1;
      Column("force_selection", 8)(i) = 1;
    }
  }

  void SetPositions() {
    for (int i = 0; i < log_.time.size(); ++i) {
      const WorkspaceMap map(params_.map);
      const Vector3d hand(0.45, 0, HandHeight(log_.time(i)));
      const Vector3d robot(0.45, 0, std::max(hand.z(), kContactHeight));
      Columns("hand_position").row(i) =
          map.HapticProxy(hand, Matrix3d::Identity()).p.transpose();
      Columns("device_position").row(i) =
          map.HapticProxy(robot, Matrix3d::Identity()).p.transpose();
      Columns("robot_position").row(i) = robot.transpose();
      Columns("robot_proxy_position").row(i) = hand.transpose();
    }
  }

  /** One column of a signal. */
  Eigen::MatrixXd::ColXpr Column(const std::string& name, int component = 0) {
    return log_.values.col(StartOf(name) + component);
  }

  /** A signal of three. */
  Eigen::MatrixXd::NColsBlockXpr<3>::Type Columns(const std::string& name) {
    return log_.values.middleCols<3>(StartOf(name));
  }

  /** A run without these signals. */
  void Forget(const std::set<std::string>& names) {
    std::erase_if(log_.signals, [&names](const SignalSlice& signal) {
      return names.contains(signal.name);
    });
  }

  static int StartOf(const std::string& name) {
    for (const SignalSlice& slice : kSignals) {
      if (slice.name == name) return slice.start;
    }
    throw std::logic_error(name);
  }

  bool Touching(int row) const {
    // With half a sample of tolerance.
    return log_.time(row) > kContactStart - 5e-4 &&
           log_.time(row) < kContactEnd - 5e-4;
  }

  /** The row at a time. */
  static int At(double time) {
    return static_cast<int>(std::lround(1000 * time));
  }

  MetricValue Value(const std::string& key) const {
    for (const auto& [name, value] : ComputeMetrics(log_, params_, 4.0)) {
      if (name == key) return value;
    }
    throw std::logic_error(key);
  }

  double Number(const std::string& key) const {
    return std::get<double>(Value(key));
  }

  bool IsNull(const std::string& key) const {
    return std::holds_alternative<std::monostate>(Value(key));
  }

  std::int64_t Count(const std::string& key) const {
    return std::get<std::int64_t>(Value(key));
  }

  std::vector<std::string> Names(const std::string& key) const {
    return std::get<std::vector<std::string>>(Value(key));
  }

  LogTable log_;
  MetricsParams params_;
};

TEST_F(MetricsTest, KeysAreAllOfTheTableInOrder) {
  const Metrics metrics = ComputeMetrics(log_, params_);
  ASSERT_EQ(metrics.size(), MetricDescriptions().size());
  EXPECT_EQ(metrics.size(), 40u);
  for (std::size_t i = 0; i < metrics.size(); ++i) {
    EXPECT_EQ(metrics[i].first, MetricDescriptions()[i].key);
  }
  EXPECT_EQ(metrics.front().first, "position_rms_free_m");
  EXPECT_EQ(metrics.back().first, "real_time_factor");
}

TEST_F(MetricsTest, ASensorWhoseBiasWasNotLearnedIsSeen) {
  EXPECT_TRUE(std::holds_alternative<std::monostate>(Value("sensor_ready")));
  const int start = static_cast<int>(log_.values.cols());
  log_.signals.push_back({"sensor_ready", start, 1});
  log_.signals.push_back({"sensor_tares_refused", start + 1, 1});
  const auto rows = log_.values.rows();
  log_.values.conservativeResizeLike(Eigen::MatrixXd::Zero(rows, start + 2));
  EXPECT_EQ(std::get<bool>(Value("sensor_ready")), true);  // None was refused.
  log_.values(rows - 1, start + 1) = 1;
  EXPECT_EQ(std::get<bool>(Value("sensor_ready")), false);
  log_.values(rows / 2, start) = 1;
  EXPECT_EQ(std::get<bool>(Value("sensor_ready")), true);
}

// The filter finds two blocked rotations and turns the axis between them by
// `tilt` while the tool presses; at first it has found one only.
TEST_F(MetricsTest, AngularFilter) {
  const int start = static_cast<int>(log_.values.cols());
  log_.signals.push_back({"moment_dimension", start, 1});
  log_.signals.push_back({"contact_moment_dimension", start + 1, 1});
  log_.signals.push_back({"contact_rotation_axis", start + 2, 3});
  log_.signals.push_back({"moment_selection", start + 5, 9});
  log_.values.conservativeResizeLike(
      Eigen::MatrixXd::Zero(log_.values.rows(), start + 14));
  const double tilt = 0.1;
  const Vector3d axis(std::sin(tilt), 0, std::cos(tilt));
  const Matrix3d selection = Matrix3d::Identity() - axis * axis.transpose();
  int touching = 0;
  int missed = 0;
  for (int i = 0; i < log_.time.size(); ++i) {
    if (!Touching(i)) continue;
    const bool found = touching++ >= 1000;
    missed += !found;
    log_.values(i, start) = found ? 2 : 1;
    log_.values(i, start + 1) = 2;
    log_.values(i, start + 4) = -1;
    for (int k = 0; k < 9; ++k) {
      log_.values(i, start + 5 + k) = selection(k / 3, k % 3);
    }
  }
  const Metrics metrics = ComputeMetrics(log_, params_);
  const auto described = AngularMetricDescriptions();
  ASSERT_EQ(metrics.size(), MetricDescriptions().size() + described.size());
  for (std::size_t i = 0; i < described.size(); ++i) {
    EXPECT_EQ(metrics[MetricDescriptions().size() + i].first, described[i].key);
  }
  EXPECT_DOUBLE_EQ(Number("moment_dimension_accuracy"),
                   1 - static_cast<double>(missed) / touching);
  EXPECT_NEAR(Number("rotation_axis_error_mean_deg"), tilt * 180 / M_PI, 1e-9);

  log_.values.col(start).setOnes();
  EXPECT_EQ(Number("moment_dimension_accuracy"), 0);
  EXPECT_TRUE(IsNull("rotation_axis_error_mean_deg"));
}

TEST_F(MetricsTest, PerfectRun) {
  for (const char* key :
       {"position_rms_free_m",     "position_rms_free_delay_compensated_m",
        "position_rms_contact_m",  "force_tracking_rms_N",
        "haptic_force_rms_free_N", "haptic_force_std_contact_N",
        "haptic_force_max_N",      "normal_error_mean_deg",
        "normal_error_p95_deg",    "detection_latency_ms",
        "haptic_force_ac_N",       "contact_force_ac_N",
        "observed_energy_min_J",   "position_rms_air_m",
        "haptic_force_max_air_N",  "haptic_force_rms_air_N",
        "false_contact_share",     "tool_speed_max_m_s",
        "joint_speed_share_max",   "torque_share_max",
        "torque_rate_max_Nm_s"}) {
    EXPECT_NEAR(Number(key), 0, 1e-12) << key;
  }
  EXPECT_EQ(Number("haptic_force_swing_contact_N"), 0);
  EXPECT_EQ(Number("haptic_force_swing_air_N"), 0);
  EXPECT_EQ(Number("dimension_accuracy"), 1);
  EXPECT_EQ(Number("dimension_accuracy_total"), 1);
  EXPECT_NEAR(Number("contact_time_s"), kContactEnd - kContactStart, 1e-9);
  EXPECT_NEAR(Number("proxy_distance_max_m"), kDepth, 1e-12);
  EXPECT_NEAR(Number("joint_margin_min_rad"), 0.0175, 1e-12) << "joint 6's";
  EXPECT_TRUE(Names("limits_broken").empty());
  EXPECT_TRUE(FindMetricsOut(ComputeMetrics(log_, params_)).empty());
  EXPECT_EQ(Number("contact_force_max_N"), kForce);
  EXPECT_EQ(Count("contact_losses"), 0);
  EXPECT_EQ(Count("link_messages_dropped"), 0);
  EXPECT_EQ(std::get<bool>(Value("finite")), true);
  EXPECT_EQ(Number("sim_s"), 20);
  EXPECT_EQ(Number("wall_s"), 4);
  EXPECT_EQ(Number("real_time_factor"), 5);
}

TEST_F(MetricsTest, PositionErrorIsSplitByTheTrueNormal) {
  Columns("robot_position").rowwise() += RowVector3d(0.003, -0.001, 0.012);
  // Free motion is no part of it.
  Columns("robot_position").topRows(At(2.9)).array() += 0.5;
  // RMS of x and of y, then their mean; z is the contact.
  EXPECT_NEAR(Number("position_rms_free_m"), 0.002, 1e-12);
  EXPECT_NEAR(Number("position_rms_contact_m"), 0.012, 1e-12);
}

TEST_F(MetricsTest, ATiltedNormalSharesTheAxes) {
  const RowVector3d normal(0.6, 0, -0.8);
  const RowVector3d free(0.8, 0, 0.6);
  Columns("contact_normal").rowwise() = normal;
  Columns("robot_position").rowwise() += 0.01 * normal + 0.02 * free;
  // Along z it is 0.36 free: 0.02 * 0.6 / sqrt(0.36); along x alike with 0.64;
  // y is wholly free, without error. Weights 0.64, 1, 0.36.
  EXPECT_NEAR(Number("position_rms_free_m"), 0.02 * (0.64 + 0.36) / 2, 1e-12);
  EXPECT_NEAR(Number("position_rms_contact_m"), 0.01, 1e-12);
}

TEST_F(MetricsTest, DelayCompensationRemovesExactlyTheDelay) {
  params_.delay = 0.1505;  // Between two samples.
  const auto x = [](const VectorXd& time) -> VectorXd {
    return 0.02 * time.array().sin();
  };
  Column("device_position", 0) = x(log_.time) / params_.map.scale;
  Column("robot_position", 0) =
      0.45 + x(log_.time.array() - params_.delay).array();
  // What linear interpolation over 1 ms leaves: 0.02 * 1e-6 / 8.
  EXPECT_LT(Number("position_rms_free_delay_compensated_m"), 3e-9);
  // 0.02 * 0.15 * cos(t), RMS over whole periods 0.0021, halved by axis y.
  EXPECT_NEAR(Number("position_rms_free_m"), 0.00106, 5e-5);
}

TEST_F(MetricsTest, RotatedDeviceFrameChangesNothing) {
  params_.map.R_DB << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  params_.map.scale = 1.7;
  SetPositions();
  Columns("robot_position").rowwise() += RowVector3d(0.003, -0.001, 0.012);
  Columns("device_force").rowwise() =
      RowVector3d(1, -2, 3) * params_.map.R_DB.transpose();
  EXPECT_NEAR(Number("position_rms_free_m"), 0.002, 1e-12);
  EXPECT_NEAR(Number("position_rms_contact_m"), 0.012, 1e-12);
  EXPECT_NEAR(Number("haptic_force_rms_free_N"), std::sqrt(5.0), 1e-12);
}

TEST_F(MetricsTest, ForceTrackingLooksAtForceSpaceOnly) {
  Columns("sensed_force").rowwise() = RowVector3d(5, 5, -7);
  Column("reference_force", 2).setConstant(-6.5);
  EXPECT_NEAR(Number("force_tracking_rms_N"), 0.5, 1e-12);
  // A selection is row by row: x of the force appears along z.
  Column("force_selection", 6).setConstant(1);
  EXPECT_NEAR(Number("force_tracking_rms_N"), 4.5, 1e-12);
}

TEST_F(MetricsTest, HapticForceOfKnownDeviation) {
  for (int i = 0; i < log_.time.size(); ++i) {
    const double square = i % 100 < 50 ? 1 : -1;
    Columns("device_force").row(i) = RowVector3d(0.6, 0.8, 6 + 0.3 * square);
  }
  Columns("device_force").row(0) << 0, 11, 0;  // Before contact.
  EXPECT_NEAR(Number("haptic_force_rms_free_N"), 1, 1e-12);
  // Steady contact lasts whole periods, from 4 s to 16 s, and one sample.
  EXPECT_NEAR(Number("haptic_force_std_contact_N"), 0.3, 1e-8);
  EXPECT_NEAR(Number("haptic_force_ac_N"), 0.3, 0.006);
  EXPECT_EQ(Number("haptic_force_max_N"), 11);
}

TEST_F(MetricsTest, AcIsTheRmsOfASineLessItsMovingAverage) {
  // In three axes; its mean over any 0.501 s is below 0.1 % of it.
  for (int i = 0; i < log_.time.size(); ++i) {
    const double sine = std::sin(2 * kPi * 50 * log_.time(i));
    Columns("device_force").row(i) = RowVector3d(1, 2, 2) * sine;
    Columns("contact_force").row(i) += RowVector3d(0, 0.5, 0) * sine;
  }
  EXPECT_NEAR(Number("haptic_force_ac_N"), 3 / std::sqrt(2.0), 0.005);
  EXPECT_NEAR(Number("contact_force_ac_N"), 0.5 / std::sqrt(2.0), 0.001);
}

TEST_F(MetricsTest, AcRemovesASlowRamp) {
  Column("device_force", 2) = log_.time;
  // Only the half windows at both ends remain: at most 0.125 N, 4 % of 12 s.
  EXPECT_LT(Number("haptic_force_ac_N"), 0.03);
  EXPECT_NEAR(Number("haptic_force_std_contact_N"), 12 / std::sqrt(12.0), 0.01);
}

TEST_F(MetricsTest, SteadyContactBeginsAfterTheDelayAndEndsWithTheLift) {
  const auto ac_of_disturbance = [this](double time) {
    Column("device_force", 0).setZero();
    Column("device_force", 0).segment(At(time), 20).setConstant(5);
    return Number("haptic_force_ac_N");
  };
  for (const double delay : {0.0, 1.5}) {
    params_.delay = delay;
    const double start = kContactStart + 3 * delay + 1;
    EXPECT_LT(ac_of_disturbance(start - 0.021), 1e-9) << delay;
    EXPECT_GT(ac_of_disturbance(start), 0.1) << delay;
    EXPECT_GT(ac_of_disturbance(kLift - 0.021), 0.1) << delay;
    EXPECT_LT(ac_of_disturbance(kLift + 0.001), 1e-9) << delay;
  }
  params_.delay = 5;
  EXPECT_TRUE(IsNull("haptic_force_ac_N"));
  EXPECT_TRUE(IsNull("haptic_force_std_contact_N"));
}

TEST_F(MetricsTest, NormalErrorHasNoSignAndCountsOnlyRealContact) {
  const double angle = 10 * kPi / 180;
  Columns("force_direction").rowwise() =
      RowVector3d(std::sin(angle), 0, std::cos(angle));
  Column("dimension").setConstant(1);
  EXPECT_NEAR(Number("normal_error_mean_deg"), 10, 1e-12);
  EXPECT_NEAR(Number("normal_error_p95_deg"), 10, 1e-12);
  const VectorXd error = CalcNormalErrorDeg(log_);
  EXPECT_TRUE(std::isnan(error(At(2.999))));
  EXPECT_NEAR(error(At(3)), 10, 1e-12);
  EXPECT_TRUE(std::isnan(error(At(16.2))));
  Column("dimension")(At(5)) = 0;
  EXPECT_TRUE(std::isnan(CalcNormalErrorDeg(log_)(At(5))));
}

TEST_F(MetricsTest, PercentileIsLinear) {
  // Angles that grow evenly from 0 to 40 deg over the contact.
  const int first = At(kContactStart);
  const int last = At(kContactEnd) - 1;
  for (int i = first; i <= last; ++i) {
    const double angle = 40 * kPi / 180 * (i - first) / (last - first);
    Columns("force_direction").row(i) << std::sin(angle), 0, -std::cos(angle);
  }
  EXPECT_NEAR(Number("normal_error_mean_deg"), 20, 1e-9);
  EXPECT_NEAR(Number("normal_error_p95_deg"), 38, 1e-9);
}

TEST_F(MetricsTest, TwoTrueNormalsAreComparedWithTheForceSpace) {
  for (int i = At(kContactStart); i < At(kContactEnd); ++i) {
    Column("contact_dimension")(i) = 2;
    Column("dimension")(i) = 2;
    Columns("contact_normal").row(i) << 0.6, 0, -0.8;
    Column("force_selection", 0)(i) = 1;
  }
  EXPECT_NEAR(Number("normal_error_mean_deg"), 0, 1e-5);
  EXPECT_EQ(Number("dimension_accuracy"), 1);
  Column("force_selection", 0).setZero();
  EXPECT_NEAR(Number("normal_error_mean_deg"), std::acos(0.8) * 180 / kPi,
              1e-9);
}

TEST_F(MetricsTest, LateDetectionCostsAccuracy) {
  Column("dimension").head(At(3.132)).setZero();
  EXPECT_NEAR(Number("detection_latency_ms"), 132, 1e-9);
  EXPECT_NEAR(Number("dimension_accuracy"), 1 - 0.132 / 13.2, 1e-12);
}

TEST_F(MetricsTest, LatencyIsTheMeanOverTheOnsets) {
  // Two contacts, found after 100 ms and 20 ms; a bounce of 15 ms is no onset.
  Columns("contact_force").middleRows(At(3.005), 15).setZero();
  Columns("contact_force").middleRows(At(10), 200).setZero();
  Column("dimension").head(At(3.1)).setZero();
  Column("dimension").segment(At(10), 220).setZero();
  EXPECT_NEAR(Number("detection_latency_ms"), 60, 1e-9);
  // Never found: until the contact's last sample, 5.999 s after its onset.
  Column("dimension").tail(20001 - At(10)).setZero();
  EXPECT_NEAR(Number("detection_latency_ms"), (100 + 5999) / 2.0, 1e-9);
}

TEST_F(MetricsTest, ContactLossesCountWhileTheHandPresses) {
  for (const double time : {5.0, 7.0}) {
    Columns("contact_force").middleRows(At(time), 20).setZero();
  }
  EXPECT_EQ(Count("contact_losses"), 2);
  // Not lost, only light; then lost, once, though it trembles.
  Column("contact_force", 2).segment(At(9), 20).setConstant(-0.3);
  EXPECT_EQ(Count("contact_losses"), 2);
  Column("contact_force", 2)(At(9) + 5) = 0;
  Column("contact_force", 2)(At(9) + 10) = 0;
  EXPECT_EQ(Count("contact_losses"), 3);
  // The hand has begun to lift.
  Columns("contact_force").middleRows(At(16.1), 20).setZero();
  EXPECT_EQ(Count("contact_losses"), 3);
}

TEST_F(MetricsTest, EachPressCounts) {
  // The hand lifts for a while at 8 s; contact is lost 50 ms after it began to.
  for (int i = At(8); i < At(10); ++i) {
    const double lift = 0.1 * std::min(log_.time(i) - 8, 0.5);
    Column("hand_position", 2)(i) += lift / params_.map.scale;
    if (log_.time(i) > 8.05) Columns("contact_force").row(i).setZero();
  }
  EXPECT_EQ(Count("contact_losses"), 0);
  // Steady from 4 s to 8 s and from 11 s to 16 s, each about its own mean.
  Column("device_force", 2).segment(At(10.5), 5600).setConstant(1);
  EXPECT_NEAR(Number("haptic_force_std_contact_N"), 0, 1e-9);
  Column("device_force", 2).segment(At(4), 2000).setConstant(1);
  EXPECT_NEAR(Number("haptic_force_std_contact_N"), 1.0 / 3, 1e-3);
}

// A second surface is touched from 8 s to 12 s, which changes the force.
TEST_F(MetricsTest, AnotherTouchIsNotAVaryingForce) {
  Column("device_force", 2).segment(At(8), 4000).setConstant(3);
  EXPECT_GT(Number("haptic_force_std_contact_N"), 1);
  EXPECT_GT(Number("haptic_force_ac_N"), 0.1);
  Column("contact_dimension").segment(At(8), 4000).setConstant(2);
  EXPECT_NEAR(Number("haptic_force_std_contact_N"), 0, 1e-9);
  EXPECT_NEAR(Number("haptic_force_ac_N"), 0, 1e-9);
  // But what bounces on it, or off it, is varying.
  for (int i = At(8); i < At(12); ++i) {
    Column("contact_dimension")(i) = (i / 400) % 2 == 0 ? 2 : 1;
  }
  EXPECT_GT(Number("haptic_force_std_contact_N"), 1);
}

// A force that swings slowly, which neither its AC nor, in the air, anything
// else shows.
TEST_F(MetricsTest, ASlowSwingIsSeenInContactAndInTheAir) {
  const auto swing = [this](double period, double begin, double end) {
    Columns("device_force").setZero();
    for (int i = At(begin); i < At(end); ++i) {
      Column("device_force", 2)(i) =
          3 * std::sin(2 * kPi * log_.time(i) / period);
    }
  };
  swing(6, 4, 16);
  EXPECT_GT(Number("haptic_force_swing_contact_N"), 1.5);
  EXPECT_LT(Number("haptic_force_swing_contact_N"), 3 / std::sqrt(2.0));
  EXPECT_LT(Number("haptic_force_ac_N"), 0.1);
  EXPECT_EQ(Number("haptic_force_swing_air_N"), 0);
  swing(2, 17.3, 20);
  EXPECT_EQ(Number("haptic_force_swing_contact_N"), 0);
  EXPECT_GT(Number("haptic_force_swing_air_N"), 1.5);
  // A quick one counts as it does in the AC.
  swing(0.02, 4, 16);
  EXPECT_NEAR(Number("haptic_force_swing_contact_N"), 3 / std::sqrt(2.0), 0.02);
  // Across the normal it is the path's.
  Column("device_force", 0) = Column("device_force", 2);
  Column("device_force", 2).setZero();
  EXPECT_EQ(Number("haptic_force_swing_contact_N"), 0);
}

TEST_F(MetricsTest, WhatSettlesAndWhatTheHandDoesAreNoSwing) {
  // In contact it creeps up, in the air it fades; the lift between them is the
  // hand's.
  for (int i = 0; i < log_.time.size(); ++i) {
    const double t = log_.time(i);
    Column("device_force", 2)(i) =
        t < kLift + 5e-4 ? 6 - 3 * std::exp(-t / 5) : -9 * std::exp(kLift - t);
  }
  EXPECT_NEAR(Number("haptic_force_swing_contact_N"), 0, 1e-9);
  EXPECT_NEAR(Number("haptic_force_swing_air_N"), 0, 1e-9);
  // What goes to and fro with the hand's depth: from 8 s to 12 s it moves.
  for (int i = At(8); i < At(12); ++i) {
    const double depth = std::sin(kPi * (log_.time(i) - 8));
    Column("hand_position", 2)(i) += 0.003 * depth;
    Column("device_force", 2)(i) += 4 * depth;
  }
  EXPECT_LT(Number("haptic_force_swing_contact_N"), 0.2);
}

TEST_F(MetricsTest, WhatAPlannerTakesOverIsNoSwing) {
  const int start = static_cast<int>(log_.values.cols());
  log_.signals.push_back({"planner_selection", start, 9});
  log_.values.conservativeResizeLike(
      Eigen::MatrixXd::Zero(log_.values.rows(), start + 9));
  Column("device_force", 2).setConstant(6);
  Column("device_force", 2).segment(At(8), 2500).setZero();
  EXPECT_GT(Number("haptic_force_swing_contact_N"), 2);
  log_.values.col(start + 8).segment(At(8), 2000).setOnes();
  EXPECT_EQ(Number("haptic_force_swing_contact_N"), 0);
}

TEST_F(MetricsTest, ALostLinkIsNoSwing) {
  const int start = static_cast<int>(log_.values.cols());
  log_.signals.push_back({"haptic_link_status", start, 1});
  log_.values.conservativeResizeLike(
      Eigen::MatrixXd::Ones(log_.values.rows(), start + 1));
  log_.values.col(start).setOnes();
  Column("device_force", 2).setConstant(6);
  Column("device_force", 2).segment(At(8), 2500).setZero();
  EXPECT_GT(Number("haptic_force_swing_contact_N"), 2);
  log_.values.col(start).segment(At(8), 2000).setConstant(2);
  EXPECT_EQ(Number("haptic_force_swing_contact_N"), 0);
  params_.delay = 5;
  EXPECT_TRUE(IsNull("haptic_force_swing_contact_N")) << "not steady yet";
}

TEST_F(MetricsTest, TheAxisOfFreeMotion) {
  EXPECT_TRUE(IsNull("motion_axis_error_mean_deg"));
  const int start = static_cast<int>(log_.values.cols());
  log_.signals.push_back({"contact_motion_axis", start, 3});
  log_.values.conservativeResizeLike(
      Eigen::MatrixXd::Zero(log_.values.rows(), start + 3));
  EXPECT_TRUE(IsNull("motion_axis_error_mean_deg"));
  // Table and wall: free along x, believed to be 0.1 rad off it half the time.
  const Vector3d axis(-std::cos(0.1), std::sin(0.1), 0);
  const Matrix3d selection = Matrix3d::Identity() - axis * axis.transpose();
  for (int i = At(6); i < At(8); ++i) {
    Column("contact_dimension")(i) = 2;
    Column("dimension")(i) = i < At(5.9) ? 1 : 2;
    log_.values(i, start) = 1;
    for (int k = 0; k < 9; ++k) {
      Column("force_selection", k)(i) =
          i < At(7) ? selection(k / 3, k % 3) : (k == 4 || k == 8);
    }
  }
  EXPECT_NEAR(Number("motion_axis_error_mean_deg"), 0.05 * 180 / M_PI, 1e-9);
}

TEST_F(MetricsTest, WhatTheFilterSeesInTheAirIsFalseContact) {
  // For half of the 3 s before contact, and for 0.5 s after it: 0.1 s it may.
  Column("dimension").head(1500).setConstant(1);
  Column("dimension").segment(At(kContactEnd), 500).setConstant(1);
  const double air = kContactStart + 20 - kContactEnd - 0.1;
  EXPECT_NEAR(Number("false_contact_share"), (1.5 + 0.4) / air, 1e-3);
  EXPECT_NEAR(Number("dimension_accuracy_total"), 1 - 2.0 / 20, 1e-3);
  EXPECT_EQ(Number("dimension_accuracy"), 1);
  Forget({"dimension", "force_direction", "force_selection"});
  EXPECT_TRUE(IsNull("false_contact_share"));
  EXPECT_TRUE(IsNull("dimension_accuracy_total"));
}

TEST_F(MetricsTest, ALightTouchIsNotTheAir) {
  // 0.24 N is no interaction, but a filter that sees it is right.
  Column("contact_force", 2) = Column("contact_dimension") * -0.24;
  EXPECT_EQ(Number("false_contact_share"), 0);
  EXPECT_EQ(Number("dimension_accuracy_total"), 1);
  EXPECT_TRUE(IsNull("dimension_accuracy"));
  EXPECT_NEAR(Number("contact_time_s"), kContactEnd - kContactStart, 1e-9);
  // Nor is the pause of a bounce.
  Column("contact_dimension").segment(At(7), 90).setZero();
  EXPECT_EQ(Number("false_contact_share"), 0);
  Column("contact_dimension").segment(At(7), 200).setZero();
  EXPECT_GT(Number("false_contact_share"), 0);
}

TEST_F(MetricsTest, WhatTheHandFeelsInTheAir) {
  // Until contact, and from 2 x delay + 1 s after it.
  params_.delay = 0.5;
  const double end = kContactEnd + 2 * params_.delay + 1;
  const auto felt_at = [this](double time) {
    Columns("device_force").setZero();
    Columns("device_force").row(At(time)) << 0.6, 0, -0.8;
    return Number("haptic_force_max_air_N");
  };
  EXPECT_EQ(felt_at(2.999), 1);
  EXPECT_EQ(felt_at(3.001), 0);
  EXPECT_EQ(felt_at(end - 0.002), 0);
  EXPECT_EQ(felt_at(end + 0.002), 1);
  Columns("device_force").rowwise() = RowVector3d(0, 3, 4);
  Column("device_force").segment(At(5), 1000).setConstant(9);
  EXPECT_NEAR(Number("haptic_force_max_air_N"), 5, 1e-12);
  EXPECT_NEAR(Number("haptic_force_rms_air_N"), 5, 1e-12);
}

TEST_F(MetricsTest, PositionInTheAirIsThatOfTheAirAlone) {
  Columns("robot_position").rowwise() += RowVector3d(0.003, -0.001, 0.012);
  EXPECT_NEAR(Number("position_rms_air_m"), (0.003 + 0.001 + 0.012) / 3, 1e-12);
  Columns("robot_position").middleRows(At(4), 5000).array() += 0.5;
  EXPECT_NEAR(Number("position_rms_air_m"), (0.003 + 0.001 + 0.012) / 3, 1e-12);
  params_.delay = 20;  // The device as it was at first: 0.07 m away at most.
  EXPECT_GT(Number("position_rms_air_m"), 0.006);
}

TEST_F(MetricsTest, WithoutAirThereIsNothingToSayOfIt) {
  Column("contact_dimension").setConstant(1);
  for (const char* key : {"false_contact_share", "position_rms_air_m",
                          "haptic_force_max_air_N", "haptic_force_rms_air_N"}) {
    EXPECT_TRUE(IsNull(key)) << key;
  }
  EXPECT_EQ(Number("contact_time_s"), 20);
}

TEST_F(MetricsTest, BrokenLimitsAreNamed) {
  Column("joint_velocity", 6)(At(5)) = -5.22;
  Columns("robot_proxy_position").row(At(6)).array() += 1;
  EXPECT_EQ(Names("limits_broken"),
            (std::vector<std::string>{"joint_speed", "proxy_distance"}));
  EXPECT_EQ(Number("joint_speed_share_max"), 2);
  const auto texts = DescribeBrokenLimits(log_, params_);
  ASSERT_EQ(texts.size(), 2u);
  EXPECT_EQ(texts[0], "joint 7 speed 5.22 rad/s at 5 s (limit 2.61)");
  EXPECT_EQ(
      FindMetricsOut(ComputeMetrics(log_, params_)),
      (std::vector<std::string>{"joint_speed_share_max", "proxy_distance_max_m",
                                "limits_broken"}));
  params_.arm.joint_speed *= 2;
  params_.arm.proxy_distance = 2;
  EXPECT_TRUE(Names("limits_broken").empty());
}

TEST_F(MetricsTest, WithoutTheArmsSignalsItsLimitsAreNotMeasured) {
  log_.signals.resize(15);
  for (const char* key :
       {"tool_speed_max_m_s", "joint_speed_share_max", "joint_margin_min_rad",
        "torque_share_max", "torque_rate_max_Nm_s", "proxy_distance_max_m"}) {
    EXPECT_TRUE(IsNull(key)) << key;
  }
  EXPECT_TRUE(Names("limits_broken").empty());
}

TEST(MetricLimitsTest, EachIsOfAMetricAndWhatIsOutIsFound) {
  Metrics good;
  Metrics bad;
  std::vector<std::string> keys;
  const auto limits = MetricLimits();
  for (const MetricDescription& metric : MetricDescriptions()) {
    for (const MetricLimit& limit : limits) {
      if (std::string(limit.key) != metric.key) continue;
      keys.emplace_back(metric.key);
      const bool least = std::isfinite(limit.least);
      const double bound = least ? limit.least : limit.most;
      good.emplace_back(metric.key, bound);
      bad.emplace_back(metric.key, bound + (least ? -0.01 : 0.01));
    }
  }
  EXPECT_EQ(keys.size(), limits.size());
  EXPECT_TRUE(FindMetricsOut(good).empty());
  EXPECT_EQ(FindMetricsOut(bad), keys);
  EXPECT_EQ(FindMetricsOut({{"contact_losses", std::int64_t{1}},
                            {"finite", false},
                            {"false_contact_share", MetricValue()},
                            {"sim_s", 1e9}}),
            (std::vector<std::string>{"contact_losses", "finite"}));
}

TEST_F(MetricsTest, EnergyAndDroppedMessages) {
  Column("observed_energy")(7000) = -0.25;
  Column("robot_link_dropped").tail(20).setConstant(3);
  Column("haptic_link_dropped").tail(10).setConstant(4);
  EXPECT_EQ(Number("observed_energy_min_J"), -0.25);
  EXPECT_EQ(Count("link_messages_dropped"), 7);
}

TEST_F(MetricsTest, NoContactGivesNullWhereThereIsNothingToMeasure) {
  Columns("contact_force").setZero();
  Columns("contact_normal").setZero();
  Column("dimension").setZero();
  EXPECT_EQ(Number("contact_force_max_N"), 0);
  EXPECT_EQ(Count("contact_losses"), 0);
  for (const char* key :
       {"position_rms_free_m", "position_rms_free_delay_compensated_m",
        "position_rms_contact_m", "force_tracking_rms_N",
        "haptic_force_rms_free_N", "haptic_force_std_contact_N",
        "normal_error_mean_deg", "normal_error_p95_deg", "dimension_accuracy",
        "detection_latency_ms", "haptic_force_ac_N", "contact_force_ac_N"}) {
    EXPECT_TRUE(IsNull(key)) << key;
  }
}

TEST_F(MetricsTest, WithoutAFilterThereIsNoPerception) {
  Forget({"dimension", "force_direction", "force_selection"});
  for (const char* key : {"normal_error_mean_deg", "normal_error_p95_deg",
                          "dimension_accuracy", "detection_latency_ms"}) {
    EXPECT_TRUE(IsNull(key)) << key;
  }
  EXPECT_EQ(Count("contact_losses"), 0);
  EXPECT_NEAR(Number("haptic_force_std_contact_N"), 0, 1e-12);
}

// As from a real robot, which knows no truth.
TEST_F(MetricsTest, WithoutTheTruthWhatNeedsItIsNull) {
  Forget({"contact_force", "contact_normal", "contact_dimension"});
  for (const char* key : {"position_rms_free_m", "contact_force_max_N",
                          "dimension_accuracy", "normal_error_mean_deg"}) {
    EXPECT_TRUE(IsNull(key)) << key;
  }
  EXPECT_EQ(std::get<bool>(Value("finite")), true);
  EXPECT_TRUE(CalcNormalErrorDeg(log_).array().isNaN().all());
}

TEST_F(MetricsTest, NotFiniteIsReportedAndBecomesNull) {
  for (const double bad : {kNaN, std::numeric_limits<double>::infinity()}) {
    Column("device_force", 0)(5000) = bad;
    EXPECT_EQ(std::get<bool>(Value("finite")), false);
    for (const char* key : {"haptic_force_max_N", "haptic_force_rms_free_N",
                            "haptic_force_std_contact_N", "haptic_force_ac_N",
                            "haptic_force_swing_contact_N"}) {
      EXPECT_TRUE(IsNull(key)) << key << bad;
    }
    EXPECT_EQ(Number("contact_force_max_N"), kForce);
    EXPECT_EQ(Number("dimension_accuracy"), 1);
  }
  Column("robot_link_dropped").tail<1>()(0) = kNaN;
  EXPECT_TRUE(IsNull("link_messages_dropped"));
}

TEST_F(MetricsTest, ALogCutShortIsMeasured) {
  for (const int rows : {3500, 2, 1, 0}) {
    log_.time.conservativeResize(rows);
    log_.values.conservativeResize(rows, Eigen::NoChange);
    EXPECT_EQ(std::get<bool>(Value("finite")), true);
    EXPECT_NEAR(Number("sim_s"), std::max(rows - 1, 0) * 1e-3, 1e-12);
    EXPECT_TRUE(IsNull("haptic_force_ac_N")) << "not steady yet";
    if (rows == 3500) {
      EXPECT_EQ(Number("contact_force_max_N"), kForce);
      EXPECT_EQ(Number("dimension_accuracy"), 1);
    } else {
      EXPECT_TRUE(IsNull("dimension_accuracy"));
    }
  }
}

TEST_F(MetricsTest, TimeThatItTookMayBeUnknown) {
  for (const std::optional<double> wall_s :
       {std::optional<double>(), std::optional<double>(0)}) {
    const Metrics metrics = ComputeMetrics(log_, params_, wall_s);
    EXPECT_EQ(metrics.back().second, MetricValue());
  }
}

TEST_F(MetricsTest, InvalidInputIsNamed) {
  const auto error = [this] {
    return InvalidArgument([this] { ComputeMetrics(log_, params_); });
  };
  params_.delay = -1;
  EXPECT_EQ(error(),
            "MetricsParams: field `delay` expected a finite value >= 0, got "
            "-1");
  params_.delay = 0;
  params_.map.scale = 0;
  EXPECT_EQ(error(),
            "WorkspaceMapParams: field `scale` expected a number in [0.001, "
            "1000], got 0");
  params_.map.scale = 1;
  params_.control_period = 0;
  EXPECT_EQ(error(),
            "MetricsParams: field `control_period` expected a finite value > "
            "0, got 0");
  params_.control_period = 1e-3;
  log_.signals.erase(log_.signals.begin() + 14);
  EXPECT_EQ(error(), "RunLog: there is no signal `haptic_link_dropped`");
  log_.time(1) = 0;
  EXPECT_EQ(error(),
            "RunLog: field `time` expected strictly increasing times, got 0");
}

TEST(MetricsJsonTest, LooksAsPythonWritesIt) {
  EXPECT_EQ(MetricsJson({{"number", 0.1},
                         {"whole", 20.0},
                         {"small", 1e-5},
                         {"count", std::int64_t{-3}},
                         {"yes", true},
                         {"no", false},
                         {"none", MetricValue()},
                         {"nan", kNaN},
                         {"empty", std::vector<std::string>{}},
                         {"names", std::vector<std::string>{"a", "b"}}}),
            "{\n"
            "  \"number\": 0.1,\n"
            "  \"whole\": 20.0,\n"
            "  \"small\": 1e-05,\n"
            "  \"count\": -3,\n"
            "  \"yes\": true,\n"
            "  \"no\": false,\n"
            "  \"none\": null,\n"
            "  \"nan\": null,\n"
            "  \"empty\": [],\n"
            "  \"names\": [\n"
            "    \"a\",\n"
            "    \"b\"\n"
            "  ]\n"
            "}\n");
  EXPECT_EQ(MetricsJson({}), "{}\n");
}

}  // namespace
}  // namespace dual_proxy
