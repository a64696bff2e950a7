// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/local_planner.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include <Eigen/Eigenvalues>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/common/validate_entries.h"

namespace dual_proxy {

namespace {

// The projection onto what some vectors span.
Eigen::Matrix3d CalcSpan(const std::vector<Eigen::Vector3d>& vectors) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& vector : vectors) {
    const Eigen::Vector3d u = vector.stableNormalized();
    sum += u * u.transpose();
  }
  // Squared sines of the angles at which directions count as different.
  constexpr double kLeast = 1e-6;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(sum);
  Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    if (eigen.eigenvalues()(i) < kLeast) continue;
    const Eigen::Vector3d u = eigen.eigenvectors().col(i);
    result += u * u.transpose();
  }
  return result;
}

}  // namespace

void LocalPlannerParams::Validate() const {
  const char* who = "LocalPlannerParams";
  ValidateFields(who, *this);
  ThrowUnlessSpans(who, "active", active);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const std::string entry = EntryName("directions", i);
    ThrowUnlessIn(who, entry.c_str(), directions[i], Finite());
    if (directions[i] == Eigen::Vector3d::Zero()) {
      ThrowInvalidField(who, entry.c_str(), "a vector with a direction", 0);
    }
  }
  if (!active.empty() && directions.empty()) {
    ThrowInvalidField(who, "directions", "at least one if it is ever `active`",
                      0);
  }
}

LocalPlanner::LocalPlanner(LocalPlannerParams params)
    : params_((params.Validate(), std::move(params))),
      selection_(CalcSpan(params_.directions)) {}

void LocalPlanner::Update(double time, const Eigen::Vector3d& p_BE, bool ready,
                          LocalPlannerState* state) const noexcept {
  PlannerReference& output = state->output;
  const bool active =
      ready && std::any_of(params_.active.begin(), params_.active.end(),
                           [time](const Eigen::Vector2d& interval) {
                             return time >= interval(0) && time < interval(1);
                           });
  if (!active) {
    output.selection.setZero();
    return;
  }
  if (output.selection.isZero(0)) {
    state->start = time;
    state->origin = p_BE;
  }
  const double rate = 2 * std::numbers::pi * params_.scan_frequency;
  const SinCos phase = CalcSinCos(rate * (time - state->start));
  output.selection = selection_;
  output.position = state->origin + phase.sin * params_.scan_amplitude;
  output.velocity = rate * phase.cos * params_.scan_amplitude;
  output.force = params_.force;
}

}  // namespace dual_proxy
