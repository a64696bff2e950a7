// SPDX-License-Identifier: BSD-3-Clause
// ContactTracker: what is learned of surfaces and sensor on the way.
#include "dual_proxy/perception/contact_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/perception/contact_tracker_tools.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

constexpr double kEntryTime = 0.02;       // s: the approach's speed is gone.
constexpr double kFittedSlide = 0.006;    // m: friction is known by then.
constexpr double kMostFriction = 1.2;     // mu, sliding, before it is known.
constexpr double kMostForward = 0.7;      // Of a force, along the sliding.
constexpr double kFrictionMargin = 0.1;   // Over the mu that was seen,
constexpr double kFrictionFactor = 1.2;   // as sticking friction is larger.
constexpr double kCreepingFactor = 3;     // What gives along the surface, both
                                          // ways, to what gives into it.
constexpr double kPresliding = 5e-4;      // m: what friction takes to turn.
constexpr double kMaxCompliance = 0.005;  // m/N
constexpr double kGrowth = 1.3;           // times: a force so much larger
                                          // begins a contact once more.

}  // namespace

double ContactTracker::CalcCompliance(
    const TrackedContact& contact) const noexcept {
  return std::clamp(CalcGiven(contact), params_.compliance, kMaxCompliance);
}

double ContactTracker::CalcSinkingSpeed(
    const TrackedContact& contact) const noexcept {
  return CalcCompliance(contact) * contact.grown / kSinkingTime;
}

double ContactTracker::CalcSlidingShare(double speed) const noexcept {
  return std::clamp(speed / params_.sliding_speed - 0.5, 0.0, 1.0);
}

double ContactTracker::CalcMaxFriction(const State& state) const noexcept {
  return state.friction < 0
             ? params_.max_friction
             : kFrictionFactor * state.friction + kFrictionMargin;
}

double ContactTracker::CalcSlidingFriction(const State& state) const noexcept {
  return state.friction < 0 ? std::max(params_.max_friction, kMostFriction)
                            : CalcMaxFriction(state);
}

double ContactTracker::CalcStickingFriction(const State& state) const noexcept {
  const double mu = CalcMaxFriction(state);
  // A normal that never slid is that of the mean force, which friction may have
  // tilted by as much the other way.
  const double tilted =
      std::clamp(params_.max_friction, mu,
                 mu + kFrictionFactor * std::max(0.0, state.friction));
  double most = 0;
  for (int i = 0; i < state.count; ++i) {
    const TrackedContact& contact = state.contacts[i];
    most += (contact.slid < kSettledSlide ? tilted : mu) * contact.force;
  }
  return most;
}

void ContactTracker::NoteSinking(const Vector3d& force,
                                 const Vector3d& velocity,
                                 State* state) const noexcept {
  // Where the force changes, the tool moves into what gives, or out of it.
  const double change = smoothing_gain_ * (force.norm() - state->force);
  state->force += change;
  const double give = params_.compliance * std::abs(change) / period_;
  // Sliding, the force has a part along the velocity between zero and the sine
  // of the cone; the rest of the velocity is along the normal.
  const double speed = velocity.norm();
  const double forward =
      velocity.dot(force) / std::max(force.norm(), params_.force_noise);
  const double sink = 6 * std::max({0.0, forward - kMostForward * speed,
                                    (-forward - 0.1 * speed) / 3});
  const double entry =
      state->entry_speed * Exp(-state->settled_time / kEntryTime);
  state->sinking_speed =
      state->count > 0 ? std::sqrt(give * give + sink * sink + entry * entry)
                       : 0;
}

void ContactTracker::NoteCreeping(const Vector3d& velocity,
                                  State* state) const noexcept {
  state->passed = creeping_decay_ * (state->passed + period_ * velocity);
  state->creeping = 0;
  if (state->count == 0) return;
  // From friction one way to friction the other way what gives moves by this.
  double given = kPresliding;
  for (int i = 0; i < state->count; ++i) {
    const TrackedContact& contact = state->contacts[i];
    given += kCreepingFactor * CalcMaxFriction(*state) * contact.smooth_force *
             CalcGiven(contact);
  }
  const double way = CalcFreePart(state->passed, *state).norm();
  state->creeping = std::clamp(2 - 2 * way / std::max(given, 1e-9), 0.0, 1.0);
}

void ContactTracker::LearnFriction(const Vector3d& force,
                                   const Vector3d& velocity,
                                   State* state) const noexcept {
  const TrackedContact& contact = state->contacts[0];
  if (state->count != 1 || state->sliding < 1 || contact.force < 1 ||
      contact.slid < kSettledSlide ||
      state->sinking_speed > 2 * params_.velocity_noise ||
      state->unexplained.norm() > 0.5 + 0.1 * force.norm()) {
    return;
  }
  const double seen = std::max(
      0.0, (force - contact.force * contact.normal).dot(velocity.normalized()) /
               contact.force);
  if (state->friction < 0) {
    state->friction = seen;
  }
  // The slower it slides, the less the velocity tells friction from a tilt.
  const double ratio = velocity.norm() / (20 * params_.velocity_noise);
  state->friction +=
      friction_gain_ * std::min(1.0, ratio * ratio) * (seen - state->friction);
}

void ContactTracker::LearnMisfit(const Vector3d& force,
                                 const Vector3d& velocity,
                                 State* state) const noexcept {
  const TrackedContact& contact = state->contacts[0];
  if (state->sliding < 1 || contact.slid < kFittedSlide) return;
  double total = 0;
  for (int i = 0; i < state->count; ++i) total += state->contacts[i].force;
  if (total < 1) return;
  const Vector3d along = CalcFreePart(velocity, *state).normalized();
  const double noise2 = params_.force_noise * params_.force_noise;
  const double across =
      state->count == 1 ? contact.normal.cross(along).dot(force) : 0;
  const double seen = force.dot(along) / total;
  const double change =
      seen - (state->friction < 0 ? std::clamp(seen, 0.0, params_.max_friction)
                                  : state->friction);
  // Noticed fast and forgotten slowly.
  const auto follow = [this](double square, double* mean) {
    const double more = square - *mean;
    *mean += (more > 0 ? misfit_gain_ : forgetting_gain_) * more;
  };
  follow(std::max(0.0, across * across - noise2), &state->astray2);
  follow(std::max(0.0, change * change - noise2 / (total * total)),
         &state->friction_variance);
  double into2 = 0;
  for (int i = 0; i < state->count; ++i) {
    const TrackedContact& each = state->contacts[i];
    const double into = velocity.dot(each.normal) - CalcSinkingSpeed(each);
    into2 = std::max(into2, into * into);
  }
  const double speed2 = velocity.squaredNorm();
  follow(std::max(0.0, into2 / speed2 - params_.velocity_noise *
                                            params_.velocity_noise / speed2),
         &state->into2);
}

void ContactTracker::LearnBias(const Vector3d& sensed, const Vector3d& velocity,
                               State* state) const noexcept {
  const TrackedContact& contact = state->contacts[0];
  if (state->count != 1 || state->sliding < 1 || contact.force < 1 ||
      contact.slid < kSettledSlide ||
      velocity.norm() < 10 * params_.velocity_noise ||
      state->sinking_speed > 2 * params_.velocity_noise) {
    return;
  }
  bias_.LearnSliding(sensed, {contact.normal, velocity, contact.force},
                     &state->bias);
}

void ContactTracker::NoteSurfaceMotion(const TrackedContact& contact,
                                       double sinking,
                                       State* state) const noexcept {
  // At rest on a surface that neither moves nor gives the tool does not move.
  const double given = CalcSinkingSpeed(contact);
  state->rising += misfit_gain_ * (sinking - given - state->rising);
  if (state->sliding > 0 || Begins(contact)) return;
  const double speed = std::max(
      0.0, std::abs(state->rising) - params_.velocity_noise - std::abs(given));
  state->surface_speed = std::max(speed, surface_decay_ * state->surface_speed);
}

void ContactTracker::NoteMotion(const Vector3d& velocity,
                                State* state) const noexcept {
  const double speed = velocity.norm();
  const bool is_clear = state->sinking_speed < 2 * params_.velocity_noise;
  for (int i = 0; i < state->count; ++i) {
    TrackedContact& contact = state->contacts[i];
    const Vector3d& normal = contact.normal;
    const double sinking = velocity.dot(normal);
    if (contact.pressed == 0) contact.last_force = contact.force;
    contact.onset += period_;
    contact.pressed += period_ * contact.force;
    contact.displaced *= slide_decay_;
    if (is_clear) {
      contact.displaced +=
          state->sliding * period_ * (velocity - sinking * normal);
      contact.slid = std::max(contact.slid, contact.displaced.norm());
    }
    contact.sunk = sinking_decay_ * (contact.sunk + period_ * sinking);
    contact.passed = sinking_decay_ * (contact.passed + period_ * speed);
    contact.grown =
        sinking_decay_ * (contact.grown + contact.force - contact.last_force);
    contact.last_force = contact.force;
    contact.smooth_force +=
        smoothing_gain_ * (contact.force - contact.smooth_force);
    if (contact.smooth_force > kGrowth * contact.onset_force) {
      contact.onset = 0;
      contact.onset_force = contact.smooth_force;
    }
    if (state->count == 1) NoteSurfaceMotion(contact, sinking, state);
    contact.give = give_decay_ * contact.give + contact.sunk * contact.grown;
    contact.give_weight =
        give_decay_ * contact.give_weight + contact.grown * contact.grown;
  }
}

}  // namespace dual_proxy
