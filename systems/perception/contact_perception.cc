// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/contact_perception.h"

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
    : force_((params.Validate(), params.filter)) {
  if (params.angular_filter.enabled) {
    moment_.emplace(params.angular_filter.filter);
  }
}

ContactPerceptionState ContactPerception::MakeState(
    std::uint64_t seed, std::uint64_t angular_seed) const {
  State state;
  state.force.filter = force_.filter.MakeState(seed);
  if (moment_) state.moment.filter = moment_->filter.MakeState(angular_seed);
  return state;
}

void ContactPerception::ScheduledFilter::Update(
    double time, ScheduledFilterState* state) const noexcept {
  const std::optional<std::int64_t> window = means.FindWindow(time);
  if (!window || *window < state->next_update) return;
  state->next_update = *window + 1;
  const FilterInput input = state->mean_input();
  filter.Update(input.sensed, input.velocity, input.motion, input.contact,
                &state->filter);
}

void ContactPerception::UpdateFilters(double time,
                                      State* state) const noexcept {
  force_.Update(time, &state->force);
  if (moment_) moment_->Update(time, &state->moment);
}

void ContactPerception::AddSamples(double time, const FilterInput& force,
                                   const FilterInput& moment,
                                   State* state) const noexcept {
  force_.means.Update(time, MakeSample(force), &state->force.means);
  if (moment_) {
    moment_->means.Update(time, MakeSample(moment), &state->moment.means);
  }
}

ContactSelections ContactPerception::GetSelections(
    const State& state) const noexcept {
  ContactSelections selections{.force = state.force.filter.force_selection};
  if (moment_) selections.moment = state.moment.filter.force_selection;
  return selections;
}

}  // namespace dual_proxy
