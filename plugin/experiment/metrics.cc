// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/metrics.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <map>
#include <numbers>
#include <string_view>

#include "dual_proxy/common/validate.h"
#include "dual_proxy/experiment/arm_limit_check.h"
#include "dual_proxy/experiment/monotone_fit.h"
#include "dual_proxy/experiment/number_text.h"
#include "dual_proxy/experiment/quantile.h"

namespace dual_proxy {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixX3d;
using Eigen::RowVector3d;
using Eigen::VectorXd;
using Mask = Eigen::Array<bool, Eigen::Dynamic, 1>;

/** True contact force above which the tool counts as touching, N. */
constexpr double kContactForce = 0.5;
/** True contact force below which a contact counts as lost, N. */
constexpr double kLostForce = 0.05;
/** A contact is new, and the robot in the air, if there was no contact for so
long, s. */
constexpr double kNewContactPause = 0.1;
/** The hand lifts when it moves out of the surface faster than this, and rests
when it moves slower, m/s. */
constexpr double kLiftSpeed = 1e-3;
/** Contact is steady so long after 3 x delay, s; so long another number of
contacts has to last to count as another touch, and a rest to be looked at. */
constexpr double kSettlingTime = 1.0;
/** Window of the moving average that the `_ac_` metrics remove, s. */
constexpr double kAcWindow = 0.5;
/** The hand is in the air so long after 2 x delay, s: an F_h of 12 N fades at
20 N/s, and a link of a few hertz has its period. */
constexpr double kFadingTime = 1.0;
/** `robot_link_status` and `haptic_link_status` of a lost link. */
constexpr double kLinkLost = 2;
/** Times that differ by less are the same, s. */
constexpr double kTimeTolerance = 1e-9;

constexpr MetricDescription kMetrics[] = {
    {"position_rms_free_m", "m",
     "robot against mapped device during the interaction, in the true free "
     "directions: RMS per axis of B, then the mean over the axes, each "
     "weighted by how much of it was free"},
    {"position_rms_free_delay_compensated_m", "m",
     "the same, against the device as it was one delay ago"},
    {"position_rms_contact_m", "m",
     "robot against mapped device along the true normal, RMS"},
    {"position_rms_air_m", "m",
     "robot against mapped device one delay ago while the robot is in the air: "
     "RMS per axis, then their mean"},
    {"force_tracking_rms_N", "N",
     "RMS of Omega_f (F_s - F_r) while the filter's dimension is not 0"},
    {"haptic_force_rms_free_N", "N",
     "RMS of the force on the hand in the true free directions during the "
     "interaction"},
    {"haptic_force_std_contact_N", "N",
     "standard deviation of the force on the hand along the true normal in "
     "steady contact, about the mean of each touch"},
    {"haptic_force_max_N", "N", "largest force on the hand"},
    {"haptic_force_max_air_N", "N",
     "largest force on the hand while that is in the air: from 2 x delay + 1 s "
     "after the last true contact, and before the first"},
    {"haptic_force_rms_air_N", "N", "RMS of that force"},
    {"contact_force_max_N", "N", "largest true contact force"},
    {"normal_error_mean_deg", "deg",
     "angle between the filter's first direction and the true normal while "
     "both are there; with two true normals or more, between their resultant "
     "and the estimated force space"},
    {"normal_error_p95_deg", "deg", "95th percentile of that angle"},
    {"motion_axis_error_mean_deg", "deg",
     "angle between estimated and true axis of free motion while both "
     "dimensions are 2"},
    {"dimension_accuracy", "",
     "share of the interaction with the true dimension, onset included"},
    {"dimension_accuracy_total", "",
     "share of the whole run with the true dimension"},
    {"false_contact_share", "",
     "share of the time in the air (no true contact, nor any in the 0.1 s "
     "before) in which the filter's dimension is not 0"},
    {"detection_latency_ms", "ms",
     "from the onset of a contact until the filter's dimension is not 0 (or "
     "the contact's end); mean over the onsets"},
    {"contact_losses", "",
     "times the true contact broke while the hand was pressing"},
    {"contact_time_s", "s", "time with a true contact, however light"},
    {"haptic_force_ac_N", "N",
     "RMS of the force on the hand in steady contact, less its moving average "
     "over 0.5 s"},
    {"contact_force_ac_N", "N", "the same of the true contact force"},
    {"haptic_force_swing_contact_N", "N",
     "how much the force on the hand along the true normal goes to and fro in "
     "steady contact, while the hand's intended position rests along it: RMS "
     "about the nearest course that only rises or only falls; of a stretch of "
     "1 s or more with the link and without a planner, the largest"},
    {"haptic_force_swing_air_N", "N",
     "the same of the force's three components while the hand is in the air "
     "and its intended position rests"},
    {"observed_energy_min_J", "J",
     "least energy that the passivity observer saw"},
    {"tool_speed_max_m_s", "m/s", "largest speed of the tool point"},
    {"joint_speed_share_max", "",
     "largest speed of a joint, as a share of that joint's limit"},
    {"joint_margin_min_rad", "rad",
     "least distance of a joint from its nearer limit; negative beyond it"},
    {"torque_share_max", "",
     "largest commanded torque of a joint, as a share of that joint's limit"},
    {"torque_rate_max_Nm_s", "N m/s",
     "largest change of a commanded torque from one control period to the "
     "next, per time; only of a log that has every period"},
    {"proxy_distance_max_m", "m",
     "largest distance of the robot from its proxy"},
    {"limits_broken", "",
     "the limits of the arm that the run broke: joint_position, joint_speed, "
     "tool_speed, torque, torque_rate, proxy_distance",
     false},
    {"link_messages_dropped", "",
     "messages refused by both sides: too old or out of order"},
    {"link_messages_lost", "", "messages that the link lost, both ways"},
    {"recording_scale", "",
     "lengths of the operator's motion per length that was recorded"},
    {"finite", "", "no NaN or infinity anywhere in the log", false},
    {"sensor_ready", "",
     "false: the force sensor's bias was not learned though the tool was at "
     "rest (sensor.tare_max_force, sensor.tare_max_noise), so the robot held "
     "still",
     false},
    {"sim_s", "s", "simulated time"},
    {"wall_s", "s", "time it took"},
    {"real_time_factor", "", "sim_s / wall_s"},
};

constexpr MetricDescription kAngularMetrics[] = {
    {"moment_dimension_accuracy", "",
     "share of the interaction with the true number of blocked rotations, "
     "onset "
     "included"},
    {"rotation_axis_error_mean_deg", "deg",
     "angle between the angular filter's axis of free rotation and the true "
     "one while both are there"},
};

using Values = std::map<std::string_view, MetricValue>;

/** Rows [begin, end) of a log. */
struct Interval {
  Index begin{0};
  Index end{0};

  Index size() const { return end - begin; }
};

/** Each run of true. */
std::vector<Interval> FindIntervals(const Mask& mask) {
  std::vector<Interval> intervals;
  for (Index i = 0; i < mask.size(); ++i) {
    if (!mask(i)) continue;
    if (intervals.empty() || intervals.back().end < i) {
      intervals.push_back({i, i});
    }
    intervals.back().end = i + 1;
  }
  return intervals;
}

/** The first row whose time is `at` or later. */
Index FindRow(const VectorXd& time, double at) {
  return std::lower_bound(time.begin(), time.end(), at) - time.begin();
}

// Whether the log has all of some signals: without them a metric is null.
bool HasAll(const RunLog& log, std::initializer_list<const char*> names) {
  return std::all_of(names.begin(), names.end(),
                     [&log](const char* name) { return log.Has(name); });
}

Mask FindTouching(const RunLog& log) {
  return log.Signal<3>("contact_force").rowwise().norm().array() >
         kContactForce;
}

Matrix3d RowMajor(const Eigen::RowVector<double, 9>& elements) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
      elements.data());
}

Matrix3d SelectionAt(const RunLog& log, Index row) {
  return RowMajor(log.Signal<9>("force_selection").row(row));
}

/** When the tool really touches, when the hand presses, along which normal. */
struct Truth {
  Mask touching;
  /** Any contact, however light. */
  Mask contact;
  /** The robot is in the air; what the hand feels is that of the air. */
  Mask air;
  Mask hand_air;
  /** Of the last contact so far; zero before the first. */
  MatrixX3d normal;
  /** [contact, lift) of each time that the hand presses. */
  std::vector<Interval> presses;
  /** [start, lift) of steady contact. */
  std::vector<Interval> steady;
  /** Of those and of the hand in the air, where the hand rests, along the
  normal or altogether, for long enough, and the link is not lost. */
  std::vector<Interval> steady_rests;
  std::vector<Interval> air_rests;
};

/** Where something is not so, and was not for longer than `pause` (s). */
Mask FindAbsence(const VectorXd& time, const Mask& some, double pause) {
  Mask absent = !some;
  double last = -std::numeric_limits<double>::infinity();
  for (Index i = 0; i < time.size(); ++i) {
    if (some(i)) last = time(i);
    if (time(i) - last <= pause) absent(i) = false;
  }
  return absent;
}

/** The parts of a press between which another surface is touched, too, or no
more: where the number of contacts changes and stays. A contact that breaks for
a moment, or bounces, divides nothing. */
std::vector<Interval> FindTouches(const VectorXd& time,
                                  const VectorXd& dimension,
                                  const Interval& press) {
  std::vector<Interval> touches;
  Index begin = press.begin;
  for (Index i = press.begin; i < press.end;) {
    Index end = i;
    while (end < press.end && dimension(end) == dimension(i)) ++end;
    const bool stays = time(end - 1) - time(i) >= kSettlingTime;
    if (stays && dimension(i) > 0 && dimension(i) != dimension(begin)) {
      touches.push_back({begin, i});
      begin = i;
    }
    i = end;
  }
  touches.push_back({begin, press.end});
  return touches;
}

/** Finds where the hand rests, from its intended position in B. */
void FindRests(const RunLog& log, const MatrixX3d& hand, double delay,
               Truth* truth) {
  const VectorXd& time = log.time;
  // From the hand, by what is no swing.
  Mask taken = Mask::Constant(time.size(), false);
  for (const char* status : {"robot_link_status", "haptic_link_status"}) {
    if (log.Has(status)) {
      taken = taken || log.Signal<1>(status).array() == kLinkLost;
    }
  }
  if (log.Has("planner_selection")) {
    taken = taken ||
            (log.Signal<9>("planner_selection").array() != 0).rowwise().any();
  }
  const Mask left = FindAbsence(time, taken, 3 * delay + kSettlingTime);
  Mask steady = Mask::Constant(time.size(), false);
  for (const Interval& interval : truth->steady) {
    steady.segment(interval.begin, interval.size()).setConstant(true);
  }
  Mask in_contact = Mask::Constant(time.size(), false);
  Mask in_air = in_contact;
  for (Index i = 1; i < time.size(); ++i) {
    const RowVector3d velocity =
        (hand.row(i) - hand.row(i - 1)) / (time(i) - time(i - 1));
    in_contact(i) = steady(i) && left(i) &&
                    std::abs(velocity.dot(truth->normal.row(i))) < kLiftSpeed;
    in_air(i) = truth->hand_air(i) && left(i) && velocity.norm() < kLiftSpeed;
  }
  const auto long_ones = [&time](const Mask& mask) {
    std::vector<Interval> rests = FindIntervals(mask);
    std::erase_if(rests, [&time](const Interval& rest) {
      return time(rest.end - 1) - time(rest.begin) <
             kSettlingTime - kTimeTolerance;
    });
    return rests;
  };
  truth->steady_rests = long_ones(in_contact);
  truth->air_rests = long_ones(in_air);
}

Truth FindTruth(const RunLog& log, const MetricsParams& params) {
  const VectorXd& time = log.time;
  const auto contact_normal = log.Signal<3>("contact_normal");
  const auto robot = log.Signal<3>("robot_position");
  const VectorXd dimension = log.Signal<1>("contact_dimension");
  const MatrixX3d hand =
      MapDevicePositions(params.map, log.Signal<3>("hand_position"));
  Truth truth;
  truth.touching = FindTouching(log);
  truth.contact = truth.touching || dimension.array() > 0;
  truth.air = FindAbsence(time, truth.contact, kNewContactPause);
  truth.hand_air =
      FindAbsence(time, truth.contact, 2 * params.delay + kFadingTime);
  truth.normal.setZero(time.size(), 3);
  Mask pressing = Mask::Constant(time.size(), false);
  Index last = -1;  // Row of the last contact.
  for (Index i = 0; i < time.size(); ++i) {
    if (truth.touching(i)) last = i;
    if (last < 0) continue;
    truth.normal.row(i) = contact_normal.row(last);
    pressing(i) = truth.normal.row(i).dot(hand.row(i) - robot.row(last)) > 0;
  }
  const auto lifts = [&](Index i) {
    if (i == 0) return false;
    const RowVector3d step = hand.row(i) - hand.row(i - 1);
    return truth.normal.row(i).dot(step) / (time(i) - time(i - 1)) <
           -kLiftSpeed;
  };
  for (const Interval& press : FindIntervals(pressing)) {
    Index contact = press.begin;
    while (contact < press.end && !truth.touching(contact)) ++contact;
    if (contact == press.end) continue;
    Index lift = press.end;
    if (lift < time.size()) {
      while (lift > contact && lifts(lift - 1)) --lift;
    }
    truth.presses.push_back({contact, lift});
    for (const Interval& touch :
         FindTouches(time, dimension, {contact, lift})) {
      const double settled =
          time(touch.begin) + 3 * params.delay + kSettlingTime;
      const Index start = FindRow(time, settled - kTimeTolerance);
      if (start < touch.end) truth.steady.push_back({start, touch.end});
    }
  }
  FindRests(log, hand, params.delay, &truth);
  return truth;
}

/** Root of the mean of squares over the rows of `mask`. */
double CalcRms(const VectorXd& values, const Mask& mask) {
  return std::sqrt(mask.select(values.array().square(), 0.0).sum() /
                   static_cast<double>(mask.count()));
}

/** RMS per axis of the part orthogonal to the normal (which may be zero) over
the rows of `mask`, mean over the axes. */
MetricValue CalcFreeRms(const MatrixX3d& error, const MatrixX3d& normals,
                        const Mask& mask) {
  RowVector3d squares = RowVector3d::Zero();
  RowVector3d share = RowVector3d::Zero();
  for (Index i = 0; i < error.rows(); ++i) {
    if (!mask(i)) continue;
    const RowVector3d normal = normals.row(i);
    const RowVector3d free = error.row(i) - error.row(i).dot(normal) * normal;
    squares += free.cwiseAbs2();
    share.array() += 1.0 - normal.array().square();
  }
  const double total = share.sum();
  if (!(total > 0)) return {};
  const RowVector3d rms =
      squares.cwiseQuotient(share.cwiseMax(1e-9 * total)).cwiseSqrt();
  return share.dot(rms) / total;
}

/** Rows of a signal as they were `delay` ago, linear between samples. */
MatrixX3d Delayed(const VectorXd& time, const MatrixX3d& values, double delay) {
  MatrixX3d result(values.rows(), 3);
  Index j = 0;
  for (Index i = 0; i < values.rows(); ++i) {
    const double then = time(i) - delay;
    while (j + 1 < values.rows() && time(j + 1) <= then) ++j;
    result.row(i) = values.row(j);
    if (then > time(j)) {
      const RowVector3d slope =
          (values.row(j + 1) - values.row(j)) / (time(j + 1) - time(j));
      result.row(i) += slope * (then - time(j));
    }
  }
  return result;
}

/** The rows of an interval less their centred mean over kAcWindow, or over what
there is of it at the ends. */
MatrixX3d RemoveMovingAverage(const VectorXd& time, const MatrixX3d& values,
                              const Interval& interval) {
  MatrixX3d total = MatrixX3d::Zero(interval.size() + 1, 3);
  for (Index i = 0; i < interval.size(); ++i) {
    total.row(i + 1) = total.row(i) + values.row(interval.begin + i);
  }
  MatrixX3d result(interval.size(), 3);
  const VectorXd span = time.segment(interval.begin, interval.size());
  constexpr double kHalf = kAcWindow / 2;
  for (Index i = 0; i < interval.size(); ++i) {
    const Index first = FindRow(span, span(i) - kHalf - kTimeTolerance);
    const Index last = FindRow(span, span(i) + kHalf + kTimeTolerance);
    result.row(i) =
        values.row(interval.begin + i) - (total.row(last) - total.row(first)) /
                                             static_cast<double>(last - first);
  }
  return result;
}

/** RMS over steady contact of a force less its moving average. */
double CalcAcRms(const VectorXd& time, const MatrixX3d& force,
                 const Truth& truth) {
  double squares = 0;
  Index count = 0;
  for (const Interval& interval : truth.steady) {
    squares += RemoveMovingAverage(time, force, interval).squaredNorm();
    count += interval.size();
  }
  return std::sqrt(squares / static_cast<double>(count));
}

/** Standard deviation over steady contact, about the mean of each touch. */
double CalcSteadyStd(const VectorXd& values, const Truth& truth) {
  double squares = 0;
  Index count = 0;
  for (const Interval& interval : truth.steady) {
    const auto touch = values.segment(interval.begin, interval.size()).array();
    squares += (touch - touch.mean()).square().sum();
    count += interval.size();
  }
  return std::sqrt(squares / static_cast<double>(count));
}

/** The largest swing of a force, (n, 1) or (n, 3), in some stretches: see
metrics.h. */
MetricValue CalcSwing(const Eigen::Ref<const Eigen::MatrixXd>& force,
                      const std::vector<Interval>& stretches) {
  if (stretches.empty()) return {};
  double largest = 0;
  for (const Interval& stretch : stretches) {
    double squares = 0;
    for (Index k = 0; k < force.cols(); ++k) {
      squares += CalcMonotoneResidual(
          force.col(k).segment(stretch.begin, stretch.size()));
    }
    squares /= static_cast<double>(stretch.size());
    if (!std::isfinite(squares)) return {};
    largest = std::max(largest, squares);
  }
  return std::sqrt(largest);
}

int CountContactLosses(const RunLog& log, const Truth& truth) {
  const VectorXd force = log.Signal<3>("contact_force").rowwise().norm();
  int losses = 0;
  for (const Interval& press : truth.presses) {
    bool touches = false;
    // Between the two forces it stays as it was.
    for (Index i = press.begin; i < press.end; ++i) {
      if (force(i) > kContactForce) {
        touches = true;
      } else if (force(i) < kLostForce) {
        losses += touches;
        touches = false;
      }
    }
  }
  return losses;
}

/** The intervals of contact, joined over pauses too short to count. */
std::vector<Interval> FindContacts(const VectorXd& time, const Mask& touching) {
  std::vector<Interval> contacts;
  for (const Interval& interval : FindIntervals(touching)) {
    if (!contacts.empty() &&
        time(interval.begin) - time(contacts.back().end - 1) <
            kNewContactPause) {
      contacts.back().end = interval.end;
    } else {
      contacts.push_back(interval);
    }
  }
  return contacts;
}

double CalcDetectionLatencyMs(const RunLog& log, const Truth& truth) {
  const auto dimension = log.Signal<1>("dimension");
  const std::vector<Interval> contacts = FindContacts(log.time, truth.touching);
  double sum = 0;
  for (const Interval& contact : contacts) {
    Index found = contact.begin;
    while (found + 1 < contact.end && !(dimension(found) > 0)) ++found;
    sum += log.time(found) - log.time(contact.begin);
  }
  return 1e3 * (sum / static_cast<double>(contacts.size()));
}

void AddPositionMetrics(const RunLog& log, const MetricsParams& params,
                        const Truth& truth, Values* values) {
  const auto robot = log.Signal<3>("robot_position");
  const MatrixX3d device =
      MapDevicePositions(params.map, log.Signal<3>("device_position"));
  const MatrixX3d error = robot - device;
  const MatrixX3d compensated = robot - Delayed(log.time, device, params.delay);
  const MatrixX3d none = MatrixX3d::Zero(error.rows(), 3);
  values->at("position_rms_air_m") = CalcFreeRms(compensated, none, truth.air);
  if (!truth.touching.any()) return;
  values->at("position_rms_free_m") =
      CalcFreeRms(error, truth.normal, truth.touching);
  values->at("position_rms_free_delay_compensated_m") =
      CalcFreeRms(compensated, truth.normal, truth.touching);
  values->at("position_rms_contact_m") =
      CalcRms(error.cwiseProduct(truth.normal).rowwise().sum(), truth.touching);
}

void AddForceMetrics(const RunLog& log, const MetricsParams& params,
                     const Truth& truth, Values* values) {
  const MatrixX3d device_force = log.Signal<3>("device_force");
  const MatrixX3d contact_force = log.Signal<3>("contact_force");
  values->at("haptic_force_max_N") =
      device_force.rowwise().norm().maxCoeff<Eigen::PropagateNaN>();
  values->at("contact_force_max_N") =
      contact_force.rowwise().norm().maxCoeff<Eigen::PropagateNaN>();
  values->at("observed_energy_min_J") =
      log.Signal<1>("observed_energy").minCoeff<Eigen::PropagateNaN>();

  if (truth.hand_air.any()) {
    const VectorXd felt = device_force.rowwise().norm();
    values->at("haptic_force_max_air_N") =
        truth.hand_air.select(felt.array(), 0.0)
            .maxCoeff<Eigen::PropagateNaN>();
    values->at("haptic_force_rms_air_N") = CalcRms(felt, truth.hand_air);
  }

  const Mask active = log.Has("dimension")
                          ? Mask(log.Signal<1>("dimension").array() > 0)
                          : Mask::Constant(log.time.size(), false);
  if (active.any()) {
    const MatrixX3d error =
        log.Signal<3>("sensed_force") - log.Signal<3>("reference_force");
    VectorXd selected(error.rows());
    for (Index i = 0; i < error.rows(); ++i) {
      selected(i) = (SelectionAt(log, i) * error.row(i).transpose()).norm();
    }
    values->at("force_tracking_rms_N") = CalcRms(selected, active);
  }

  // The true normal in the device's frame D.
  const MatrixX3d normal_D = truth.normal * params.map.R_DB.transpose();
  const VectorXd along = device_force.cwiseProduct(normal_D).rowwise().sum();
  if (truth.touching.any()) {
    const MatrixX3d free = device_force - along.asDiagonal() * normal_D;
    values->at("haptic_force_rms_free_N") =
        CalcRms(free.rowwise().norm(), truth.touching);
  }
  if (!truth.steady.empty()) {
    values->at("haptic_force_std_contact_N") = CalcSteadyStd(along, truth);
    values->at("haptic_force_ac_N") = CalcAcRms(log.time, device_force, truth);
    values->at("contact_force_ac_N") =
        CalcAcRms(log.time, contact_force, truth);
  }
  values->at("haptic_force_swing_contact_N") =
      CalcSwing(along, truth.steady_rests);
  values->at("haptic_force_swing_air_N") =
      CalcSwing(device_force, truth.air_rests);
}

/** Mean angle, deg, between the one free axis that a selection leaves and the
true one, while both dimensions are 2. */
MetricValue CalcAxisErrorDeg(const Mask& mask, const VectorXd& dimension,
                             const VectorXd& true_dimension,
                             const Eigen::MatrixX<double>& selection,
                             const MatrixX3d& axis) {
  Index count = 0;
  double sum = 0;
  for (Index i = 0; i < dimension.size(); ++i) {
    if (!mask(i) || dimension(i) != 2 || true_dimension(i) != 2) continue;
    // What is left of the true axis in the space that is not free.
    const double sine =
        (RowMajor(selection.row(i)) * axis.row(i).transpose()).norm();
    sum += std::asin(std::min(sine, 1.0));
    ++count;
  }
  if (count == 0) return {};
  return sum / static_cast<double>(count) * (180.0 / std::numbers::pi);
}

void AddPerceptionMetrics(const RunLog& log, const Truth& truth,
                          Values* values) {
  if (!HasAll(log, {"dimension", "force_direction", "force_selection"})) return;
  const auto dimension = log.Signal<1>("dimension").array();
  const Mask right = dimension == log.Signal<1>("contact_dimension").array();
  const auto share = [](const Mask& some, const Mask& all) {
    return static_cast<double>((some && all).count()) /
           static_cast<double>(all.count());
  };
  values->at("dimension_accuracy_total") =
      share(right, Mask::Constant(right.size(), true));
  if (truth.air.any()) {
    values->at("false_contact_share") = share(dimension > 0, truth.air);
  }
  if (!truth.touching.any()) return;
  values->at("dimension_accuracy") = share(right, truth.touching);
  std::vector<double> errors;
  for (const double error : CalcNormalErrorDeg(log)) {
    if (std::isfinite(error)) errors.push_back(error);
  }
  if (!errors.empty()) {
    const auto error = Eigen::Map<const VectorXd>(
        errors.data(), static_cast<Index>(errors.size()));
    values->at("normal_error_mean_deg") = error.mean();
    values->at("normal_error_p95_deg") = CalcQuantile(error, 0.95);
  }
  if (log.Has("contact_motion_axis")) {
    values->at("motion_axis_error_mean_deg") = CalcAxisErrorDeg(
        truth.touching, log.Signal<1>("dimension"),
        log.Signal<1>("contact_dimension"), log.Signal<9>("force_selection"),
        log.Signal<3>("contact_motion_axis"));
  }
  values->at("detection_latency_ms") = CalcDetectionLatencyMs(log, truth);
}

void AddRotationMetrics(const RunLog& log, const Truth& truth, Values* values) {
  if (!truth.touching.any()) return;
  const auto dimension = log.Signal<1>("moment_dimension");
  const auto true_dimension = log.Signal<1>("contact_moment_dimension");
  const Mask right = dimension.array() == true_dimension.array();
  values->at("moment_dimension_accuracy") =
      static_cast<double>((right && truth.touching).count()) /
      static_cast<double>(truth.touching.count());
  values->at("rotation_axis_error_mean_deg") =
      CalcAxisErrorDeg(truth.touching, dimension, true_dimension,
                       log.Signal<9>("moment_selection"),
                       log.Signal<3>("contact_rotation_axis"));
}

void AddArmMetrics(const RunLog& log, const MetricsParams& params,
                   Values* values) {
  std::vector<std::string> broken;
  for (const ArmLimitCheck& check :
       CheckArmLimits(log, params.arm, params.control_period)) {
    values->at(check.metric) = check.value;
    if (check.broken) broken.emplace_back(check.limit);
  }
  values->at("limits_broken") = std::move(broken);
}

void AddCounts(const RunLog& log, const Truth& truth, Values* values) {
  const Index n = log.time.size();
  const VectorXd steps = log.time.tail(n - 1) - log.time.head(n - 1);
  values->at("contact_time_s") =
      truth.contact.tail(n - 1).select(steps.array(), 0.0).sum();
  values->at("contact_losses") = CountContactLosses(log, truth);
  const double dropped = log.Signal<1>("robot_link_dropped").tail<1>()(0) +
                         log.Signal<1>("haptic_link_dropped").tail<1>()(0);
  if (std::isfinite(dropped)) {
    values->at("link_messages_dropped") = static_cast<std::int64_t>(dropped);
  }
  if (log.Has("to_robot_lost") && log.Has("to_device_lost")) {
    const double lost = log.Signal<1>("to_robot_lost").tail<1>()(0) +
                        log.Signal<1>("to_device_lost").tail<1>()(0);
    if (std::isfinite(lost)) {
      values->at("link_messages_lost") = static_cast<std::int64_t>(lost);
    }
  }
}

std::string ValueJson(const MetricValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) {
    return *flag ? "true" : "false";
  }
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    return std::to_string(*integer);
  }
  if (const auto* names = std::get_if<std::vector<std::string>>(&value)) {
    std::string text;
    for (const std::string& name : *names) {
      text += (text.empty() ? "[\n    \"" : ",\n    \"") + name + "\"";
    }
    return text.empty() ? "[]" : text + "\n  ]";
  }
  const auto* number = std::get_if<double>(&value);
  return number && std::isfinite(*number) ? ShortestText(*number) : "null";
}

}  // namespace

std::span<const MetricDescription> MetricDescriptions() { return kMetrics; }

std::span<const MetricDescription> AngularMetricDescriptions() {
  return kAngularMetrics;
}

std::vector<MetricLimit> MetricLimits(const ArmLimits<7>& arm) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return {
      {"position_rms_air_m", -kInfinity, 0.01, false},
      {"haptic_force_max_air_N", -kInfinity, 0.5, false},
      {"normal_error_mean_deg", -kInfinity, 5, false},
      {"false_contact_share", -kInfinity, 0.01, false},
      {"contact_losses", -kInfinity, 0, false},
      {"tool_speed_max_m_s", -kInfinity, arm.tool_speed, true},
      {"joint_speed_share_max", -kInfinity, 1, true},
      {"joint_margin_min_rad", 0, kInfinity, true},
      {"torque_share_max", -kInfinity, 1, true},
      {"torque_rate_max_Nm_s", -kInfinity, arm.torque_rate, true},
      {"proxy_distance_max_m", -kInfinity, arm.proxy_distance, true},
  };
}

void MetricsParams::Validate() const {
  map.Validate();
  ThrowUnlessIn("MetricsParams", "delay", delay, AtLeast(0));
  ThrowUnlessIn("MetricsParams", "control_period", control_period, Above(0));
}

Metrics ComputeMetrics(const RunLog& log, const MetricsParams& params,
                       std::optional<double> wall_s) {
  log.Validate();
  params.Validate();
  const Index n = log.time.size();
  const double sim_s = n > 0 ? log.time(n - 1) : 0;  // Starts at 0.
  Values values;
  std::vector<MetricDescription> metrics_of_run(std::begin(kMetrics),
                                                std::end(kMetrics));
  const bool angular = log.Has("moment_dimension");
  if (angular) {
    metrics_of_run.insert(metrics_of_run.end(), std::begin(kAngularMetrics),
                          std::end(kAngularMetrics));
  }
  for (const MetricDescription& metric : metrics_of_run) values[metric.key];
  if (params.recording_scale) {
    values.at("recording_scale") = *params.recording_scale;
  }
  values.at("finite") = log.AllFinite();
  if (n > 0 && log.Has("sensor_ready") && log.Has("sensor_tares_refused")) {
    values.at("sensor_ready") =
        (log.Signal<1>("sensor_ready").array() > 0).any() ||
        log.Signal<1>("sensor_tares_refused")(n - 1) == 0;
  }
  values.at("sim_s") = sim_s;
  if (wall_s) {
    values.at("wall_s") = *wall_s;
    values.at("real_time_factor") = sim_s / *wall_s;
  }
  AddArmMetrics(log, params, &values);
  log.Release();
  if (n > 1 &&
      HasAll(log, {"contact_force", "contact_normal", "contact_dimension",
                   "robot_position", "hand_position", "device_position"})) {
    const Truth truth = FindTruth(log, params);
    AddPositionMetrics(log, params, truth, &values);
    log.Release();
    AddForceMetrics(log, params, truth, &values);
    log.Release();
    AddPerceptionMetrics(log, truth, &values);
    if (angular) AddRotationMetrics(log, truth, &values);
    AddCounts(log, truth, &values);
  }
  Metrics metrics;
  for (const MetricDescription& metric : metrics_of_run) {
    MetricValue value = values.at(metric.key);
    const auto* number = std::get_if<double>(&value);
    if (number && !std::isfinite(*number)) value = {};
    metrics.emplace_back(metric.key, value);
  }
  return metrics;
}

std::vector<std::string> DescribeBrokenLimits(const RunLog& log,
                                              const MetricsParams& params) {
  log.Validate();
  params.Validate();
  std::vector<std::string> texts;
  for (ArmLimitCheck& check :
       CheckArmLimits(log, params.arm, params.control_period)) {
    if (check.broken) texts.push_back(std::move(check.worst));
  }
  return texts;
}

std::vector<std::string> FindMetricsOut(const Metrics& metrics,
                                        const ArmLimits<7>& arm) {
  const std::vector<MetricLimit> limits = MetricLimits(arm);
  const auto is_out = [&limits](const std::string& key,
                                const MetricValue& value) {
    if (const auto* flag = std::get_if<bool>(&value)) return !*flag;
    if (const auto* names = std::get_if<std::vector<std::string>>(&value)) {
      return !names->empty();
    }
    double number{};
    if (const auto* integer = std::get_if<std::int64_t>(&value)) {
      number = static_cast<double>(*integer);
    } else if (const auto* real = std::get_if<double>(&value)) {
      number = *real;
    } else {
      return false;
    }
    return std::any_of(
        limits.begin(), limits.end(), [&](const MetricLimit& limit) {
          return limit.key == key && (IsOverLimit(-number, -limit.least) ||
                                      IsOverLimit(number, limit.most));
        });
  };
  std::vector<std::string> out;
  for (const auto& [key, value] : metrics) {
    if (is_out(key, value)) out.push_back(key);
  }
  return out;
}

std::string MetricsJson(const Metrics& metrics) {
  std::string text = "{";
  for (const auto& [key, value] : metrics) {
    text += text.size() > 1 ? ",\n" : "\n";
    text += "  \"" + key + "\": " + ValueJson(value);
  }
  return text + (metrics.empty() ? "}\n" : "\n}\n");
}

VectorXd CalcNormalErrorDeg(const RunLog& log) {
  VectorXd error = VectorXd::Constant(log.time.size(),
                                      std::numeric_limits<double>::quiet_NaN());
  if (!HasAll(log, {"contact_force", "contact_normal", "contact_dimension",
                    "dimension", "force_direction", "force_selection"})) {
    return error;
  }
  const auto normal = log.Signal<3>("contact_normal");
  const auto direction = log.Signal<3>("force_direction");
  const auto true_dimension = log.Signal<1>("contact_dimension");
  const auto dimension = log.Signal<1>("dimension");
  const Mask touching = FindTouching(log);
  for (Index i = 0; i < error.size(); ++i) {
    if (!touching(i) || !(dimension(i) > 0) || !(normal.row(i).norm() > 0.5)) {
      continue;
    }
    const double cosine =
        true_dimension(i) > 1
            ? (SelectionAt(log, i) * normal.row(i).transpose()).norm()
            : std::abs(direction.row(i).dot(normal.row(i)));
    error(i) = std::acos(std::min(cosine, 1.0)) * (180.0 / std::numbers::pi);
  }
  return error;
}

MatrixX3d MapDevicePositions(const WorkspaceMapParams& map,
                             const Eigen::Ref<const MatrixX3d>& x_D) {
  const WorkspaceMap workspace_map(map);
  MatrixX3d x_B(x_D.rows(), 3);
  for (Index i = 0; i < x_D.rows(); ++i) {
    x_B.row(i) =
        workspace_map.RobotProxy(x_D.row(i).transpose(), Matrix3d::Identity())
            .p.transpose();
  }
  return x_B;
}

}  // namespace dual_proxy
