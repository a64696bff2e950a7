// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/arm_limit_check.h"

#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

namespace dual_proxy {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/** The largest element of a table; NaN does not count. */
struct Worst {
  Index row{0};
  Index column{0};
  double value{-std::numeric_limits<double>::infinity()};
};

/** The table may be an expression: it takes no memory. */
template <typename Derived>
Worst FindWorst(const Eigen::MatrixBase<Derived>& table) {
  Worst worst;
  for (Index j = 0; j < table.cols(); ++j) {
    for (Index i = 0; i < table.rows(); ++i) {
      const double value = table(i, j);
      if (value > worst.value) worst = {i, j, value};
    }
  }
  return worst;
}

/** Whether the log has every control period. */
bool HasEveryPeriod(const RunLog& log, double control_period) {
  const Index n = log.time.size() - 1;
  const auto steps = log.time.tail(n) - log.time.head(n);
  return (steps.array() <= control_period * (1 + kLimitTolerance)).all();
}

/** Collects checks of one log. */
class Checks {
 public:
  explicit Checks(const RunLog& log) : log_(log) {}

  /** Takes the sizes of a quantity that has a limit, one column or one for each
  joint, from row `first` of the log on.
  @param share whether the metric is relative to the limit. */
  template <typename Derived, int kColumns>
  void Add(const char* name, const char* metric, const char* quantity,
           const char* unit, const Eigen::MatrixBase<Derived>& sizes,
           const Eigen::Matrix<double, kColumns, 1>& limit, bool share,
           Index first = 0) {
    const auto shares = sizes.array().rowwise() / limit.transpose().array();
    const Worst worst = FindWorst(shares.matrix());
    const double size = sizes(worst.row, worst.column);
    Add(name, metric, sizes.allFinite(), share ? worst.value : size,
        IsOverLimit(worst.value, 1), first + worst.row, worst.value,
        Describe(quantity, kColumns > 1 ? worst.column : -1, size, unit,
                 first + worst.row, limit(worst.column)));
  }

  /** Takes the joints' positions. */
  void AddPositions(const RunLog::Values<7>& q, const ArmLimits<7>& limits) {
    // How far beyond the nearer limit; negative within.
    const auto above = q.rowwise() - limits.joint_upper.transpose();
    const auto below = -(q.rowwise() - limits.joint_lower.transpose());
    const Worst worst = FindWorst(above.cwiseMax(below));
    const Index j = worst.column;
    const bool is_above = above(worst.row, j) >= below(worst.row, j);
    Add("joint_position", "joint_margin_min_rad", q.allFinite(), -worst.value,
        IsOverLimit(worst.value, 0), worst.row, 1 + worst.value,
        Describe("position", j, q(worst.row, j), "rad", worst.row,
                 is_above ? limits.joint_upper(j) : limits.joint_lower(j)));
  }

  std::vector<ArmLimitCheck> Take() { return std::move(checks_); }

 private:
  std::string Describe(const char* quantity, Index joint, double value,
                       const char* unit, Index row, double limit) const {
    std::ostringstream text;
    if (joint >= 0) text << "joint " << joint + 1 << " ";
    text << quantity << " " << value << " " << unit << " at " << log_.time(row)
         << " s (limit " << limit << ")";
    return text.str();
  }

  void Add(const char* name, const char* metric, bool finite, double value,
           bool broken, Index row, double share, std::string worst) {
    if (!finite) value = std::numeric_limits<double>::quiet_NaN();
    checks_.push_back(
        {name, metric, value, broken, std::move(worst), log_.time(row), share});
  }

  const RunLog& log_;
  std::vector<ArmLimitCheck> checks_;
};

}  // namespace

bool IsOverLimit(double value, double limit) {
  return value > limit + kLimitTolerance * (limit == 0 ? 1 : std::abs(limit));
}

std::vector<ArmLimitCheck> CheckArmLimits(const RunLog& log,
                                          const ArmLimits<7>& limits,
                                          double control_period) {
  using One = Eigen::Matrix<double, 1, 1>;
  if (log.time.size() == 0) return {};
  Checks checks(log);
  if (log.Has("joint_position")) {
    checks.AddPositions(log.Signal<7>("joint_position"), limits);
  }
  if (log.Has("joint_velocity")) {
    checks.Add("joint_speed", "joint_speed_share_max", "speed", "rad/s",
               log.Signal<7>("joint_velocity").cwiseAbs(), limits.joint_speed,
               true);
  }
  if (log.Has("robot_velocity")) {
    checks.Add("tool_speed", "tool_speed_max_m_s", "tool speed", "m/s",
               VectorXd(log.Signal<3>("robot_velocity").rowwise().norm()),
               One(limits.tool_speed), false);
  }
  if (log.Has("torque")) {
    const auto torque = log.Signal<7>("torque");
    checks.Add("torque", "torque_share_max", "torque", "N m", torque.cwiseAbs(),
               limits.torque, true);
    const Index n = torque.rows() - 1;
    if (n > 0 && HasEveryPeriod(log, control_period)) {
      const auto change = torque.bottomRows(n) - torque.topRows(n);
      checks.Add("torque_rate", "torque_rate_max_Nm_s", "torque rate", "N m/s",
                 change.cwiseAbs() / control_period,
                 ArmLimits<7>::Joints(
                     ArmLimits<7>::Joints::Constant(limits.torque_rate)),
                 false, 1);
    }
  }
  if (log.Has("robot_position") && log.Has("robot_proxy_position")) {
    checks.Add("proxy_distance", "proxy_distance_max_m",
               "distance from the proxy", "m",
               VectorXd((log.Signal<3>("robot_position") -
                         log.Signal<3>("robot_proxy_position"))
                            .rowwise()
                            .norm()),
               One(limits.proxy_distance), false);
  }
  return checks.Take();
}

}  // namespace dual_proxy
