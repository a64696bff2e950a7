// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/contact_perception.h"

#include <numbers>

namespace dual_proxy {
namespace {

Eigen::Matrix<double, 12, 1> MakeSample(const FilterInput& input) noexcept {
  Eigen::Matrix<double, 12, 1> sample;
  sample << input.sensed, input.velocity, input.motion, input.contact;
  return sample;
}

}  // namespace

FilterInput ScheduledFilterState::mean_input() const {
  return {.sensed = means.mean.segment<3>(0),
          .velocity = means.mean.segment<3>(3),
          .motion = means.mean.segment<3>(6),
          .contact = means.mean.segment<3>(9)};
}

ContactPerception::ContactPerception(const ContactPerceptionParams& params)
    : force_((params.Validate(), params.filter)),
      support_(params.angular_filter.filter.period) {
  const AngularFilterParams& angular = params.angular_filter;
  if (!angular.enabled) return;
  moment_.emplace(angular.filter);
  if (angular.method == AngularMethod::kPressureCentre) {
    pressure_centre_.emplace(angular.pressure_centre, angular.filter.period);
  }
}

ContactPerceptionState ContactPerception::MakeState(
    std::uint64_t seed, std::uint64_t angular_seed) const {
  State state;
  state.force.filter = force_.filter.MakeState(seed);
  if (moment_) state.moment.filter = moment_->filter.MakeState(angular_seed);
  return state;
}

bool ContactPerception::ScheduledFilter::TakeTurn(
    double time, ScheduledFilterState* state) const noexcept {
  const std::optional<std::int64_t> window = means.FindWindow(time);
  // Any other window has its turn, an earlier one, too: time may go back.
  if (!window || *window + 1 == state->next_update) return false;
  state->next_update = *window + 1;
  return true;
}

void ContactPerception::ScheduledFilter::Update(
    double time, ScheduledFilterState* state) const noexcept {
  if (!TakeTurn(time, state)) return;
  const FilterInput input = state->mean_input();
  filter.Update(input.sensed, input.velocity, input.motion, input.contact,
                &state->filter);
}

void ContactPerception::UpdateFilters(double time,
                                      State* state) const noexcept {
  force_.Update(time, &state->force);
  if (pressure_centre_) {
    UpdatePressureCentre(time, state);
  } else if (moment_) {
    moment_->Update(time, &state->moment);
  }
}

void ContactPerception::UpdatePressureCentre(double time,
                                             State* state) const noexcept {
  if (!moment_->TakeTurn(time, &state->moment)) return;
  const ForceSpaceParticleFilterState& forces = state->force.filter;
  const FilterInput input = state->moment.mean_input();
  PressureCentreState& found = state->pressure_centre;
  pressure_centre_->Update({.moment = input.sensed,
                            .angular_velocity = input.velocity,
                            .force = state->support.mean,
                            .normal = forces.force_direction()},
                           &found);
  ForceSpaceParticleFilterState& result = state->moment.filter;
  result.dimension = found.dimension;
  result.force_selection = found.CalcSelection();
  result.motion_selection =
      Eigen::Matrix3d::Identity() - result.force_selection;
  result.singular_vectors = found.axes;
  // At dimension 2 the free axis is the normal.
  result.direction_uncertainty = found.dimension == 2
                                     ? forces.direction_uncertainty
                                     : std::numbers::pi / 2;
  result.updates = found.updates;
  result.bad_inputs = found.bad_inputs;
}

void ContactPerception::AddSamples(double time, const FilterInput& force,
                                   const FilterInput& moment,
                                   State* state) const noexcept {
  force_.means.Update(time, MakeSample(force), &state->force.means);
  if (moment_) {
    moment_->means.Update(time, MakeSample(moment), &state->moment.means);
  }
  if (pressure_centre_) support_.Update(time, force.sensed, &state->support);
}

ContactSelections ContactPerception::GetSelections(
    const State& state) const noexcept {
  ContactSelections selections{.force = state.force.filter.force_selection,
                               .normals = state.force.filter.contact_normals};
  if (moment_) selections.moment = state.moment.filter.force_selection;
  return selections;
}

}  // namespace dual_proxy
