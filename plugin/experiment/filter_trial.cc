// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/filter_trial.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/experiment/filter_trial_plant.h"
#include "dual_proxy/experiment/filter_trial_sensor.h"
#include "dual_proxy/experiment/filter_trial_setting.h"
#include "dual_proxy/experiment/quantile.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kStep = kFilterTrialStep;

/** Collects the time intervals in which something holds. */
class IntervalRecorder {
 public:
  void Update(double time, bool holds) {
    if (holds == holds_) return;
    holds_ = holds;
    if (!holds) {
      intervals_.back().end = time;
    } else if (!intervals_.empty() &&
               time - intervals_.back().end < kLongestBounce) {
      intervals_.back().end = kForever;
    } else {
      intervals_.push_back({time, kForever});
    }
  }
  const std::vector<FilterTrialInterval>& intervals() const {
    return intervals_;
  }

 private:
  static constexpr double kForever = std::numeric_limits<double>::infinity();
  static constexpr double kLongestBounce = 0.05;  // s

  std::vector<FilterTrialInterval> intervals_;
  bool holds_{false};
};

/** The axis of free motion (dimension 2), the normal (1), or zero. */
Vector3d CalcTrueAxis(const SceneContact& contact) {
  if (contact.dimension == 1) return contact.normal;
  if (contact.dimension != 2) return Vector3d::Zero();
  const Vector3d first = contact.normals.col(0);
  for (int i = 1; i < contact.count; ++i) {
    const Vector3d axis = first.cross(Vector3d(contact.normals.col(i)));
    // The sine of half the angle from which normals count as independent.
    if (axis.norm() > 0.1) return axis.normalized();
  }
  return Vector3d::Zero();
}

Matrix3d CalcTrueSelection(const SceneContact& contact) {
  const Vector3d axis = CalcTrueAxis(contact);
  switch (contact.dimension) {
    case 0:
      return Matrix3d::Zero();
    case 1:
      return axis * axis.transpose();
    case 2:
      return Matrix3d::Identity() - axis * axis.transpose();
    default:
      return Matrix3d::Identity();
  }
}

/** N: of the second strongest of independent normal forces, or 0. */
double CalcSecondForce(const SceneContact& contact) {
  if (contact.dimension < 2) return 0;
  double first = 0;
  double second = 0;
  for (int i = 0; i < contact.count; ++i) {
    const double force = contact.normal_forces(i);
    second = std::max(second, std::min(first, force));
    first = std::max(first, force);
  }
  return second;
}

double CalcDirectionError(const FilterTrialSample& sample,
                          const Matrix3d& force_selection) {
  if (sample.dimension == 0 || sample.true_dimension == 0) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const Matrix3d& U = sample.singular_vectors;
  double cosine = 0;
  if (sample.dimension == sample.true_dimension && sample.dimension < 3) {
    const Vector3d axis = sample.dimension == 1 ? U.col(0) : U.col(2);
    cosine = std::abs(axis.dot(sample.true_axis));
  } else {
    cosine = (force_selection * sample.true_normal).norm();
  }
  return std::acos(std::min(1.0, cosine));
}

/** The sums of a filter period. */
class PeriodSums {
 public:
  void Add(const FilterTrialTick& tick) {
    sums_.sensed_force += tick.sensed_force;
    sums_.velocity += tick.velocity;
    sums_.motion_force += tick.motion_force;
    sums_.contact_force += tick.contact_force;
    sums_.touched = sums_.touched || !tick.contact.force.isZero(0);
    ++count_;
  }

  /** The means with noise, and the beginning of the next period. */
  FilterTrialSample TakeMeans(const FilterTrialParams& params,
                              RandomStream* noise) {
    FilterTrialSample sample = sums_;
    sample.sensed_force /= count_;
    sample.sensed_force += params.force_noise * DrawNormal3(noise);
    sample.velocity /= count_;
    sample.velocity += params.velocity_noise * DrawNormal3(noise);
    sample.motion_force /= count_;
    sample.contact_force /= count_;
    *this = {};
    return sample;
  }

 private:
  FilterTrialSample sums_;
  int count_{0};
};

FilterStatus UpdateFilter(const ForceSpaceParticleFilter& filter,
                          const FilterTrialSample& sample,
                          ForceSpaceParticleFilterState* state) {
  return filter.Update(sample.sensed_force, sample.velocity,
                       sample.motion_force, sample.contact_force, state);
}

void SetResult(const ForceSpaceParticleFilterState& state,
               const SceneContact& truth, FilterTrialSample* sample) {
  sample->dimension = state.dimension;
  sample->singular_vectors = state.singular_vectors;
  sample->direction_uncertainty = state.direction_uncertainty;
  sample->dimension_confidence = state.dimension_confidence;
  sample->true_dimension = truth.dimension;
  sample->true_force = truth.force;
  sample->true_normal = truth.normal;
  sample->true_axis = CalcTrueAxis(truth);
  sample->direction_error = CalcDirectionError(*sample, state.force_selection);
}

/** Whether the filter's period that begins at `time` is one of the trial. */
bool HasBegun(const FilterTrialParams& params,
              const std::vector<FilterTrialInterval>& contacts, double time) {
  if (!params.filter_start) return true;
  return !contacts.empty() && time >= contacts[0].begin + *params.filter_start;
}

/** The tool of a trial, driven in the way that its parameters ask for. */
class Tool {
 public:
  Tool(FilterTrialDrive drive, const FilterTrialSetting& setting,
       double motion_stiffness)
      : drive_(drive),
        dynamic_(setting, motion_stiffness),
        kinematic_(setting),
        quasi_static_(setting) {}

  FilterTrialTick Update(const Vector3d& goal, const Matrix3d& estimate) {
    switch (drive_) {
      case FilterTrialDrive::kKinematic:
        return kinematic_.Update(goal);
      case FilterTrialDrive::kQuasiStatic:
        return quasi_static_.Update(goal, estimate);
      case FilterTrialDrive::kTrueSelection:
        return dynamic_.Update(goal, UpdateTrueSelection());
      default:
        return dynamic_.Update(goal, estimate);
    }
  }

 private:
  Matrix3d UpdateTrueSelection() {
    constexpr std::size_t kDelay = 20;  // Control periods.
    true_selections_.push_back(CalcTrueSelection(dynamic_.contact()));
    const std::size_t size = true_selections_.size();
    if (size <= kDelay) return Matrix3d::Zero();
    return true_selections_[size - 1 - kDelay];
  }

  FilterTrialDrive drive_;
  FilterTrialPointRobot dynamic_;
  FilterTrialKinematicTool kinematic_;
  FilterTrialQuasiStaticTool quasi_static_;
  std::vector<Matrix3d> true_selections_;
};

}  // namespace

void FilterTrialParams::Validate() const {
  ValidateFields("FilterTrialParams", *this);
  if (scene == FilterTrialScene::kBore &&
      drive == FilterTrialDrive::kKinematic) {
    throw InvalidField("FilterTrialParams", "drive",
                       "expected another in scene \"bore\", where it finds no "
                       "rest, got \"kinematic\"");
  }
}

FilterTrial RunFilterTrial(const FilterTrialParams& params,
                           const ForceSpaceParticleFilter& filter,
                           std::uint64_t filter_seed) {
  params.Validate();
  const double period = filter.params().period;
  ThrowUnlessIn("RunFilterTrial", "filter.period", period,
                Between(kStep, std::numeric_limits<double>::max()));
  RandomStream random(params.seed);
  const FilterTrialSetting setting = MakeFilterTrialSetting(params, &random);
  Tool tool(params.drive, setting, std::pow(10, DrawUniform(2, 3.3, &random)));
  double next_update = period * DrawUniform(0, 1, &random);
  RandomStream noise(SplitSeed(params.seed, 1));
  FilterTrialSensor sensor(params);
  ForceSpaceParticleFilterState state = filter.MakeState(filter_seed);

  FilterTrial trial;
  IntervalRecorder contacts;
  IntervalRecorder second_walls;
  PeriodSums sums;
  Vector3d last_force = Vector3d::Zero();
  for (std::size_t i = 0; i < setting.path.size(); ++i) {
    FilterTrialTick tick = tool.Update(setting.path[i], state.force_selection);
    tick.velocity +=
        setting.frame_velocity[i] +
        params.tool_compliance / kStep * (tick.contact.force - last_force);
    last_force = tick.contact.force;
    tick.sensed_force = sensor.Measure(tick.sensed_force);
    const double time = static_cast<double>(i + 1) * kStep;
    contacts.Update(time,
                    tick.contact.force.norm() >= kFilterTrialContactForce);
    second_walls.Update(
        time, CalcSecondForce(tick.contact) >= kFilterTrialContactForce);
    sums.Add(tick);
    if (time < next_update - 0.5 * kStep) continue;
    next_update += period;
    FilterTrialSample sample = sums.TakeMeans(params, &noise);
    if (!HasBegun(params, contacts.intervals(), time - period)) continue;
    sample.time = time;
    UpdateFilter(filter, sample, &state);
    SetResult(state, tick.contact, &sample);
    trial.samples.push_back(sample);
  }
  trial.contacts = contacts.intervals();
  trial.second_walls = second_walls.intervals();
  return trial;
}

double MeasureFilterCost(const FilterTrial& trial,
                         const ForceSpaceParticleFilter& filter,
                         std::uint64_t filter_seed, int repeats) {
  constexpr const char* kWho = "MeasureFilterCost";
  if (trial.samples.empty()) {
    ThrowInvalidField(kWho, "trial.samples", "at least one", 0);
  }
  if (repeats < 1) ThrowInvalidField(kWho, "repeats", "at least 1", repeats);
  using Clock = std::chrono::steady_clock;
  Eigen::VectorXd costs(repeats);
  for (int i = -1; i < repeats; ++i) {
    ForceSpaceParticleFilterState state = filter.MakeState(filter_seed);
    const Clock::time_point begin = Clock::now();
    for (const FilterTrialSample& sample : trial.samples) {
      UpdateFilter(filter, sample, &state);
    }
    const std::chrono::duration<double, std::micro> cost = Clock::now() - begin;
    if (i >= 0) costs(i) = cost.count();
  }
  const double duration =
      static_cast<double>(trial.samples.size()) * filter.params().period;
  return CalcQuantile(costs, 0.5) / duration;
}

}  // namespace dual_proxy
