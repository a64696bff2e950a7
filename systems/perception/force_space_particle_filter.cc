// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/force_space_particle_filter.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "dual_proxy/common/validate.h"
#include "dual_proxy/perception/particle_kernels.h"

namespace dual_proxy {
namespace {

using Particles = ForceSpaceParticleFilterState::Particles;

/** The weights of eq. (6)-(8) for one force and velocity. */
PaperWeights MakePaperWeights(
    const ForceSpaceParticleFilterThresholds& thresholds,
    const Eigen::Vector3d& force, const Eigen::Vector3d& velocity) noexcept {
  PaperWeights weights;
  Eigen::Map<Eigen::Vector3d>(weights.force) = force;
  Eigen::Map<Eigen::Vector3d>(weights.velocity) = velocity;
  weights.force_low = thresholds.force_low;
  weights.force_slope = 1 / (thresholds.force_high - thresholds.force_low);
  weights.velocity_low = thresholds.velocity_low;
  weights.velocity_slope =
      1 / (thresholds.velocity_high - thresholds.velocity_low);
  const double ramp = (force.norm() - weights.force_low) * weights.force_slope;
  weights.centre = 0.5 * (1 - std::clamp(ramp, 0.0, 1.0));
  return weights;
}

MutableParticleList ListOf(Particles* particles) noexcept {
  return {particles->row(0).data(), particles->row(1).data(),
          particles->row(2).data()};
}

/** True if every entry is finite and small enough to be squared. */
bool IsUsable(const Eigen::Vector3d& value) noexcept {
  return std::isfinite(value.squaredNorm());
}

/** `value` over its norm, or zero if that is at most `epsilon`. */
Eigen::Vector3d NormalizedOrZero(const Eigen::Vector3d& value,
                                 double epsilon) noexcept {
  const double norm = value.norm();
  return norm > epsilon ? Eigen::Vector3d(value / norm)
                        : Eigen::Vector3d::Zero();
}

}  // namespace

void ForceSpaceParticleFilterThresholds::Validate() const {
  ValidateFields("ForceSpaceParticleFilterThresholds", *this);
}

void ForceSpaceParticleFilterParams::Validate() const {
  ValidateFields("ForceSpaceParticleFilterParams", *this);
}

ForceSpaceParticleFilter::ForceSpaceParticleFilter(
    const Params& params, InstructionSet instruction_set)
    : params_(params),
      instruction_set_(instruction_set),
      window_(params.period),
      tracker_(params.friction_cone, params.num_particles,
               params.period * window_.size(), instruction_set) {
  params_.Validate();
  if (std::ranges::count(AvailableInstructionSets(), instruction_set) == 0) {
    ThrowInvalidField("ForceSpaceParticleFilter", "instruction_set",
                      "one of AvailableInstructionSets()",
                      static_cast<int>(instruction_set));
  }
}

ForceSpaceParticleFilterState ForceSpaceParticleFilter::MakeState(
    std::uint64_t seed) const {
  State state;
  state.random = RandomStream(seed);
  state.normals = NormalStream(seed);
  state.tracker = tracker_.MakeState();
  state.particles.setZero(3, params_.num_particles);
  state.augmented->setZero(3, capacity());
  state.cumulative_weights->setZero(capacity());
  state.chosen->setZero(params_.num_particles + 1);
  return state;
}

// Moved particles, at most as many added ones, the priors', and the centre.
int ForceSpaceParticleFilter::capacity() const noexcept {
  return 2 * params_.num_particles + kMaxPriors * params_.prior_particles + 1;
}

bool ForceSpaceParticleFilter::IsCompatible(const State& state) const noexcept {
  return state.particles.cols() == params_.num_particles &&
         state.augmented->cols() == capacity() &&
         state.cumulative_weights->size() == capacity() &&
         state.chosen->size() == params_.num_particles + 1;
}

FilterStatus ForceSpaceParticleFilter::Update(
    const Eigen::Vector3d& sensed_force, const Eigen::Vector3d& velocity,
    const Eigen::Vector3d& motion_force, const Eigen::Vector3d& contact_force,
    State* state) const noexcept {
  if (!IsUsable(sensed_force) || !IsUsable(velocity) ||
      !IsUsable(motion_force) || !IsUsable(contact_force) ||
      !IsCompatible(*state)) {
    ++state->bad_inputs;
    return FilterStatus::kBadInput;
  }
  ++state->updates;
  if (params_.likelihood == Likelihood::kFrictionCone) {
    return UpdateContacts(sensed_force, velocity, contact_force, state);
  }
  const int num_added = CountAdded(sensed_force, velocity, motion_force);
  const bool is_free = state->singular_values(0) == 0;
  return is_free && num_added == 0 && state->num_priors == 0
             ? UpdateFree(sensed_force, velocity, state)
             : UpdateInFull(sensed_force, velocity, motion_force, contact_force,
                            num_added, state);
}

FilterStatus ForceSpaceParticleFilter::UpdateFree(
    const Eigen::Vector3d& sensed_force, const Eigen::Vector3d& velocity,
    State* state) const noexcept {
  // All particles are at the centre and stay there; what is left of a full
  // update is the number that its resampling draws, and whether there was any
  // weight.
  state->random.Uniform();
  if (MakePaperWeights(params_.resampling_thresholds, sensed_force, velocity)
          .centre > 0) {
    return FilterStatus::kOk;
  }
  ++state->all_weights_zero;
  return FilterStatus::kAllWeightsZero;
}

FilterStatus ForceSpaceParticleFilter::UpdateInFull(
    const Eigen::Vector3d& sensed_force, const Eigen::Vector3d& velocity,
    const Eigen::Vector3d& motion_force, const Eigen::Vector3d& contact_force,
    int num_added, State* state) const noexcept {
  int count = MoveParticles(state);
  count = AddPrior(count, state);
  count = AddTentative(motion_force, contact_force, num_added, count, state);
  state->augmented->col(count++).setZero();
  const bool is_ok = Resample(sensed_force, velocity, count, state);
  CalcSpaces(state);
  return is_ok ? FilterStatus::kOk : FilterStatus::kAllWeightsZero;
}

FilterStatus ForceSpaceParticleFilter::UpdateContacts(
    const Eigen::Vector3d& sensed_force, const Eigen::Vector3d& velocity,
    const Eigen::Vector3d& contact_force, State* state) const noexcept {
  ContactInput input{sensed_force, velocity, contact_force};
  if (!window_.Add(&input, &state->inputs)) return FilterStatus::kOk;
  const int count_before = state->tracker.count;
  tracker_.Update(input, {&state->prior, state->num_priors, state->prior_std},
                  {ListOf(&state->particles), ListOf(&*state->augmented),
                   state->cumulative_weights->data(), state->chosen->data(),
                   &state->normals, &state->random},
                  &state->tracker);
  const int count = state->tracker.count;
  if (count > 0 || count_before > 0) {
    if (count == 0) state->particles.setZero();
    CalcSpaces(state);
  }
  state->direction_uncertainty =
      ContactTracker::CalcDirectionUncertainty(state->tracker);
  state->dimension_confidence = tracker_.CalcCountConfidence(state->tracker);
  return FilterStatus::kOk;
}

FilterStatus ForceSpaceParticleFilter::SetPrior(
    const Eigen::Ref<const Eigen::Matrix3Xd>& normals, double std,
    State* state) const noexcept {
  bool is_ok =
      normals.cols() <= kMaxPriors && std > 0 && std <= std::numbers::pi;
  for (int i = 0; is_ok && i < normals.cols(); ++i) {
    is_ok = IsUsable(normals.col(i)) && normals.col(i).norm() > params_.epsilon;
  }
  if (!is_ok) {
    ++state->bad_inputs;
    return FilterStatus::kBadInput;
  }
  state->num_priors = static_cast<int>(normals.cols());
  state->prior_std = std;
  for (int i = 0; i < state->num_priors; ++i) {
    state->prior.col(i) = normals.col(i).normalized();
  }
  return FilterStatus::kOk;
}

int ForceSpaceParticleFilter::MoveParticles(State* state) const noexcept {
  const int n = params_.num_particles;
  if (state->singular_values(0) > 0) {
    ScatterParticles(
        instruction_set_,
        {params_.scatter_mean, params_.scatter_std, params_.epsilon},
        ListOf(&state->particles), n, &state->normals,
        ListOf(&*state->augmented));
  } else {
    state->augmented->leftCols(n).setZero();
  }
  return n;
}

int ForceSpaceParticleFilter::AddPrior(int count, State* state) const noexcept {
  for (int i = 0; i < state->num_priors; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      state->augmented->row(axis)
          .segment(count, params_.prior_particles)
          .setConstant(state->prior(axis, i));
    }
    count += params_.prior_particles;
  }
  return count;
}

int ForceSpaceParticleFilter::CountAdded(
    const Eigen::Vector3d& sensed_force, const Eigen::Vector3d& velocity,
    const Eigen::Vector3d& motion_force) const noexcept {
  if (!(motion_force.norm() > params_.epsilon)) return 0;
  const Eigen::Vector3d tentative =
      NormalizedOrZero(motion_force, params_.epsilon);
  const double share = WeighParticle(
      MakePaperWeights(params_.update_thresholds, sensed_force, velocity),
      tentative.x(), tentative.y(), tentative.z());
  return static_cast<int>(std::floor(share * params_.num_particles + 0.5));
}

int ForceSpaceParticleFilter::AddTentative(const Eigen::Vector3d& motion_force,
                                           const Eigen::Vector3d& contact_force,
                                           int num_added, int count,
                                           State* state) const noexcept {
  const double epsilon = params_.epsilon;
  const Eigen::Vector3d tentative = NormalizedOrZero(motion_force, epsilon);
  const Eigen::Vector3d u_f = NormalizedOrZero(contact_force, epsilon);
  MakeArc(instruction_set_, tentative.data(), u_f.data(), epsilon, num_added,
          ListOf(&*state->augmented).Skip(count));
  return count + num_added;
}

bool ForceSpaceParticleFilter::Resample(const Eigen::Vector3d& sensed_force,
                                        const Eigen::Vector3d& velocity,
                                        int count,
                                        State* state) const noexcept {
  const int n = params_.num_particles;
  const ParticleList augmented = ListOf(&*state->augmented);
  double* weights = state->cumulative_weights->data();
  WeighParticles(
      instruction_set_,
      MakePaperWeights(params_.resampling_thresholds, sensed_force, velocity),
      augmented, count, weights);
  if (!ChooseParticles(instruction_set_, count, state->random.Uniform(), n,
                       weights, state->chosen->data())) {
    ++state->all_weights_zero;
    state->particles = state->augmented->leftCols(n);
    state->particles.col(n - 1).setZero();
    return false;
  }
  CopyChosen(augmented, state->chosen->data(), n, ListOf(&state->particles));
  return true;
}

void ForceSpaceParticleFilter::TurnToMainContact(State* state) const noexcept {
  // Particles do not tell which of two contacts is pushed harder.
  const auto end = state->tracker.contacts.begin() + state->tracker.count;
  const Eigen::Vector3d& normal =
      std::max_element(state->tracker.contacts.begin(), end,
                       [](const TrackedContact& a, const TrackedContact& b) {
                         return a.force < b.force;
                       })
          ->normal;
  Eigen::Matrix3d& U = state->singular_vectors;
  const Eigen::Vector3d across = U.col(2).cross(normal);
  if (!(across.norm() > params_.epsilon)) return;
  U.col(1) = across.normalized();
  U.col(0) = U.col(1).cross(U.col(2));
}

int ForceSpaceParticleFilter::CalcPaperDimension(
    double num_on_sphere, const State& state) const noexcept {
  // Equation (9), with |S|^2 the number of particles on the sphere: compared as
  // integers, so that rounding cannot decide at exactly one half.
  if (2 * std::lround(num_on_sphere) < params_.num_particles) return 0;
  const Eigen::Vector3d& S = state.singular_values;
  const double add = params_.alpha_add * S(0);
  const double remove = params_.alpha_remove * S(0);
  const int at_least = 1 + (S(1) > add) + (S(2) > add);
  const int at_most = 3 - (S(1) < remove) - (S(2) < remove);
  const int d = state.dimension;
  if (params_.dimension_rule == DimensionRule::kPrinted) {
    return d < at_least ? at_most : d > at_most ? at_least : d;
  }
  return std::clamp(d, at_least, at_most);
}

void ForceSpaceParticleFilter::CalcSpaces(State* state) const noexcept {
  const ParticleMoments moments = CalcMoments(
      instruction_set_, ListOf(&state->particles), params_.num_particles);
  const Eigen::Vector3d sum(moments.x, moments.y, moments.z);
  Eigen::Matrix3d second_moment;
  second_moment << moments.xx, moments.xy, moments.xz,  //
      moments.xy, moments.yy, moments.yz,               //
      moments.xz, moments.yz, moments.zz;
  const double num_on_sphere = second_moment.trace();
  if (num_on_sphere > 0) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(second_moment);
    state->singular_values =
        solver.eigenvalues().reverse().cwiseMax(0).cwiseSqrt();
    Eigen::Matrix3d& U = state->singular_vectors;
    U.leftCols<2>() = solver.eigenvectors().rightCols<2>().rowwise().reverse();
    for (int i = 0; i < 2; ++i) {
      if (U.col(i).dot(sum) < 0) U.col(i) *= -1;
    }
    U.col(2) = U.col(0).cross(U.col(1));
  } else {
    state->singular_values.setZero();
    state->singular_vectors.setIdentity();
  }

  if (params_.likelihood == Likelihood::kPaper) {
    state->dimension = CalcPaperDimension(num_on_sphere, *state);
  } else {
    state->dimension = state->tracker.count;
    if (state->dimension > 1) TurnToMainContact(state);
  }
  const Eigen::Matrix3d& U = state->singular_vectors;
  switch (state->dimension) {
    case 0:
      state->force_selection.setZero();
      break;
    case 1:
      state->force_selection = U.col(0) * U.col(0).transpose();
      break;
    case 2:
      state->force_selection =
          Eigen::Matrix3d::Identity() - U.col(2) * U.col(2).transpose();
      break;
    default:
      state->force_selection.setIdentity();
  }
  state->motion_selection =
      Eigen::Matrix3d::Identity() - state->force_selection;
  state->contact_normals.setZero();
  if (params_.likelihood == Likelihood::kPaper) {
    const int known = std::min(state->dimension, 2);
    state->contact_normals.leftCols(known) = U.leftCols(known);
  } else {
    for (int i = 0; i < state->dimension; ++i) {
      state->contact_normals.col(i) = state->tracker.contacts[i].normal;
    }
  }
}

}  // namespace dual_proxy
