// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/run_watch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dual_proxy/common/validate.h"
#include "dual_proxy/experiment/arm_limit_check.h"

namespace dual_proxy {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using RowMajorMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Most that may be off in projections and quaternions.
constexpr double kProjectionError = 1e-12;
constexpr double kRotationError = 1e-9;
// W: a delayed spring gives back a few millijoules more than it took each time
// it is pressed, which add up in hours.
constexpr double kUnnoticedPower = 1e-3;
// Of the proxy from where the hand was, m, if it follows, and how often that is
// looked at, s.
constexpr double kFollows = 5e-3;
constexpr double kLook = 0.01;
constexpr double kConnected = 1;

// NaN is worse than all.
bool IsWorse(double value, double than) {
  return value > than || (std::isnan(value) && !std::isnan(than));
}

// The worst of a piece's values, and its row.
struct Worst {
  Index row{0};
  double value{-1};
};

template <typename Value>
Worst FindWorst(Index first, Index end, const Value& value_of) {
  Worst worst{.row = std::min(first, end - 1)};
  for (Index i = first; i < end; ++i) {
    const double value = value_of(i);
    if (IsWorse(value, worst.value)) worst = {i, value};
  }
  return worst;
}

// A matrix of a log, row by row.
template <typename Row>
Matrix3d ToMatrix(const Row& row) {
  RowMajorMatrix3d matrix;
  for (int j = 0; j < 9; ++j) matrix.data()[j] = row(j);
  return matrix;
}

// How far a matrix is from a symmetric projection.
double ProjectionError(const Matrix3d& P) {
  const double asymmetry = (P - P.transpose()).cwiseAbs().maxCoeff();
  return std::max(asymmetry, (P * P - P).cwiseAbs().maxCoeff());
}

}  // namespace

void RunWatchParams::Validate() const {
  constexpr const char* kWho = "RunWatchParams";
  ThrowUnlessIn(kWho, "device_force", device_force, AtLeast(0));
  ThrowUnlessIn(kWho, "device_moment", device_moment, AtLeast(0));
  ThrowUnlessIn(kWho, "reference_force_rate", reference_force_rate.value_or(0),
                AtLeast(0));
  ThrowUnlessIn(kWho, "reference_moment_rate",
                reference_moment_rate.value_or(0), AtLeast(0));
  ThrowUnlessIn(kWho, "control_period", control_period, Above(0));
  ThrowUnlessIn(kWho, "rest_start", rest_start, AtLeast(0));
  ThrowUnlessIn(kWho, "fault_end", fault_end.value_or(0), AtLeast(0));
  ThrowUnlessIn(kWho, "follow_lag", follow_lag, AtLeast(0));
  map.Validate();
}

double RunWatch::Port::Add(double power, double period) {
  energy += period * (power - kUnnoticedPower);
  least = std::min(least, energy);
  return energy - least;
}

RunWatch::RunWatch(const RunWatchParams& params)
    : params_((params.Validate(), params)),
      swings_{{"rest_contact_force", "N", "contact_force"},
              {"rest_robot_position", "m", "robot_position"},
              {"rest_device_force", "N", "device_force"},
              {"rest_device_position", "m", "device_position"}} {}

void RunWatch::Keep(const std::string& name, const std::string& unit,
                    double value, double time, std::optional<double> most,
                    const std::string& detail) {
  const auto found =
      std::find_if(values_.begin(), values_.end(),
                   [&name](const auto& kept) { return kept.name == name; });
  if (found == values_.end()) {
    values_.push_back({name, unit, value, time, most, detail});
  } else if (IsWorse(value, found->value)) {
    *found = {name, unit, value, time, most, detail};
  }
}

void RunWatch::Add(const RunLog& piece) {
  if (piece.time.size() == 0) return;
  const Index first = has_begun_ ? 1 : 0;
  has_begun_ = true;
  Index bad_rows = 0;
  if (!piece.AllFinite()) {
    for (Index i = first; i < piece.time.size(); ++i) {
      bad_rows += std::any_of(
          piece.signals.begin(), piece.signals.end(),
          [i](const auto& s) { return !s.values.row(i).allFinite(); });
    }
  }
  Keep("rows_not_finite", "", static_cast<double>(bad_rows), piece.time(first),
       0.0);
  for (const char* sent :
       {"torque", "commanded_force", "device_force", "device_moment"}) {
    if (!piece.Has(sent)) continue;
    const bool finite = piece.Signal(sent).allFinite();
    Keep("commands_not_finite", "", finite ? 0 : 1, piece.time(first), 0.0);
  }
  AddArm(piece);
  AddDevice(piece);
  AddShapes(piece, first);
  AddEnergy(piece, first);
  AddLoopEnergy(piece);
  AddRecovery(piece, first);
  AddRest(piece, first);
  AddEnd(piece);
}

void RunWatch::AddArm(const RunLog& piece) {
  for (const ArmLimitCheck& check :
       CheckArmLimits(piece, params_.arm, params_.control_period)) {
    Keep(check.limit, "of the limit", std::max(0.0, check.share), check.time,
         1 + kLimitTolerance, check.worst);
  }
}

void RunWatch::AddDevice(const RunLog& piece) {
  const auto keep_norm = [&](const char* signal, const char* unit,
                             double most) {
    if (!piece.Has(signal)) return;
    const auto values = piece.Signal<3>(signal);
    Index row = 0;
    const double worst = values.rowwise().norm().maxCoeff(&row);
    Keep(signal, unit, values.allFinite() ? worst : kNaN, piece.time(row),
         most * (1 + 1e-9));
  };
  keep_norm("device_force", "N", params_.device_force);
  keep_norm("device_moment", "N m", params_.device_moment);
  // A piece begins with the last row of the one before.
  const auto keep_rate = [&](const char* signal, const char* name,
                             const char* unit, std::optional<double> most) {
    if (!piece.Has(signal) || piece.time.size() < 2) return;
    const auto values = piece.Signal<3>(signal);
    const auto rate_of = [&](Index i) {
      return (values.row(i) - values.row(i - 1)).norm() /
             params_.control_period;
    };
    const Worst worst = FindWorst(1, values.rows(), rate_of);
    if (most) *most *= 1 + 1e-9;
    Keep(name, unit, worst.value, piece.time(worst.row), most);
  };
  keep_rate("haptic_reference_force", "reference_force_rate", "N/s",
            params_.reference_force_rate);
  keep_rate("haptic_reference_moment", "reference_moment_rate", "N m/s",
            params_.reference_moment_rate);
}

void RunWatch::AddShapes(const RunLog& piece, Index first) {
  for (const auto& [name, values] : piece.signals) {
    if (name.ends_with("selection")) {
      const auto error = [&values](Index i) {
        return ProjectionError(ToMatrix(values.row(i)));
      };
      const Worst worst = FindWorst(first, values.rows(), error);
      Keep("projection_error", "", worst.value, piece.time(worst.row),
           kProjectionError);
    } else if (name.ends_with("proxy_orientation")) {
      const auto error = [&values](Index i) {
        return std::abs(values.row(i).norm() - 1);
      };
      const Worst worst = FindWorst(first, values.rows(), error);
      Keep("rotation_error", "", worst.value, piece.time(worst.row),
           kRotationError);
    }
  }
}

void RunWatch::AddEnergy(const RunLog& piece, Index first) {
  if (piece.Has("device_force") && piece.Has("device_velocity")) {
    const auto force = piece.Signal<3>("device_force");
    const auto velocity = piece.Signal<3>("device_velocity");
    const auto given = [&](Index i) {
      return hand_.Add(force.row(i).dot(velocity.row(i)),
                       params_.control_period);
    };
    const Worst worst = FindWorst(first, force.rows(), given);
    Keep("device_energy", "J", worst.value, piece.time(worst.row));
  }
}

void RunWatch::AddLoopEnergy(const RunLog& piece) {
  if (!params_.closes_force_loop) return;
  struct Loop {
    RunLog::Values<3> force;
    RunLog::Values<3> reference;
    RunLog::Values<9> selection;
    RunLog::Values<3> velocity;
  };
  std::vector<Loop> loops;
  const auto add = [&](const char* force, const char* reference,
                       const char* selection, const char* velocity) {
    for (const char* name : {force, reference, selection, velocity}) {
      if (!piece.Has(name)) return;
    }
    loops.push_back({piece.Signal<3>(force), piece.Signal<3>(reference),
                     piece.Signal<9>(selection), piece.Signal<3>(velocity)});
  };
  add("force_space_force", "reference_force", "force_selection",
      "robot_velocity");
  add("moment_space_moment", "reference_moment", "moment_selection",
      "robot_angular_velocity");
  if (loops.empty() || piece.time.size() < 2) return;
  // What is sent in a row acts until the next one.
  const auto given = [&](Index i) {
    double power = 0;
    for (const Loop& loop : loops) {
      const Vector3d sent = loop.force.row(i - 1);
      const Vector3d asked = loop.reference.row(i - 1);
      const Vector3d feedback =
          sent - ToMatrix(loop.selection.row(i - 1)) * asked;
      power +=
          0.5 *
          feedback.dot(
              (loop.velocity.row(i - 1) + loop.velocity.row(i)).transpose());
    }
    return loop_.Add(power, params_.control_period);
  };
  const Worst worst = FindWorst(1, piece.time.size(), given);
  Keep("force_loop_energy", "J", worst.value, piece.time(worst.row));
}

void RunWatch::AddRecovery(const RunLog& piece, Index first) {
  if (!params_.fault_end || follows_) return;
  for (const char* name : {"device_position", "robot_proxy_position",
                           "robot_link_status", "haptic_link_status"}) {
    if (!piece.Has(name)) return;
  }
  const auto hand = piece.Signal<3>("device_position");
  const auto proxy = piece.Signal<3>("robot_proxy_position");
  const auto at_robot = piece.Signal<1>("robot_link_status");
  const auto at_hand = piece.Signal<1>("haptic_link_status");
  const WorkspaceMap map(params_.map);
  const auto step =
      std::max<Index>(1, std::lround(kLook / params_.control_period));
  for (Index i = first; i < piece.time.size(); ++i) {
    if (rows_++ % step != 0) continue;
    const double time = piece.time(i);
    hand_path_.emplace_back(
        time, map.RobotProxy(hand.row(i), Matrix3d::Identity()).p);
    while (hand_path_.front().first < time - params_.follow_lag) {
      hand_path_.pop_front();
    }
    if (time < *params_.fault_end) continue;
    since_fault_ = time - *params_.fault_end;
    const Vector3d x_pr = proxy.row(i);
    follows_ = at_robot(i) == kConnected && at_hand(i) == kConnected &&
               std::any_of(hand_path_.begin(), hand_path_.end(),
                           [&x_pr](const auto& place) {
                             return (place.second - x_pr).norm() <= kFollows;
                           });
    if (follows_) return;
  }
}

void RunWatch::AddRest(const RunLog& piece, Index first) {
  const Index end = piece.time.size();
  while (first < end && piece.time(first) < params_.rest_start) ++first;
  for (Swing& swing : swings_) {
    if (first == end || !piece.Has(swing.signal)) continue;
    const auto values = piece.Signal<3>(swing.signal);
    if (rest_count_ == 0) swing.first = values.row(first).transpose();
    for (Index i = first; i < end; ++i) {
      const Vector3d change = values.row(i).transpose() - swing.first;
      swing.sum += change;
      swing.sum_t += (piece.time(i) - params_.rest_start) * change;
      swing.sum_squares += change.cwiseAbs2();
    }
  }
  for (Index i = first; i < end; ++i) {
    const double t = piece.time(i) - params_.rest_start;
    rest_count_ += 1;
    rest_t_ += t;
    rest_tt_ += t * t;
  }
}

void RunWatch::AddEnd(const RunLog& piece) {
  const Index last = piece.time.size() - 1;
  const auto set = [&](const char* name, const char* unit, double value) {
    std::erase_if(values_, [name](const auto& v) { return v.name == name; });
    values_.push_back({name, unit, value, piece.time(last)});
  };
  for (const char* status : {"robot_link_status", "haptic_link_status"}) {
    if (piece.Has(status)) {
      set(status, "", piece.Signal<1>(status)(last, 0));
    }
  }
  if (piece.Has("motion_error")) {
    set("motion_error", "m", piece.Signal<3>("motion_error").row(last).norm());
  }
}

std::vector<WatchedValue> RunWatch::Summarise() const {
  std::vector<WatchedValue> result = values_;
  if (since_fault_) {
    result.push_back({"recovery_time",
                      "s",
                      *since_fault_,
                      kNaN,
                      {},
                      follows_ ? "" : "not yet"});
  }
  // Less than this many rows tell nothing about a line.
  constexpr double kLeast = 10;
  if (rest_count_ < kLeast) return result;
  const double n = rest_count_;
  const double spread = rest_tt_ - rest_t_ * rest_t_ / n;
  for (const Swing& swing : swings_) {
    const Vector3d slope = (swing.sum_t - rest_t_ / n * swing.sum) / spread;
    const Vector3d left = swing.sum_squares - swing.sum.cwiseAbs2() / n -
                          spread * slope.cwiseAbs2();
    result.push_back({swing.name, swing.unit,
                      std::sqrt(std::max(0.0, left.sum()) / n), kNaN});
  }
  return result;
}

}  // namespace dual_proxy
