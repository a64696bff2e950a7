// SPDX-License-Identifier: BSD-3-Clause
// ContactTracker: what is there. The decisions.
#include "dual_proxy/perception/contact_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/perception/contact_tracker_tools.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

// What depends on neither sensor nor surface. Chosen on simulated trials and
// recordings.

// Over which a quantity is smoothed, learned or remembered, s.
constexpr double kSmoothingTime = 0.03;  // Force and velocity.
constexpr double kCreepingTime = 0.3;    // The way that may be creeping.
constexpr double kGiveTime = 2;          // What gives.
constexpr double kSlideTime = 2;         // The way slid, so that noise is none.
constexpr double kFrictionTime = 0.1;    // mu.
constexpr double kMisfitTime = 0.15;     // What fits badly, as it grows,
constexpr double kForgettingTime = 3;    // and as it fades.
constexpr double kRollTime = 3;          // How a normal turned aside.
constexpr double kSurfaceTime = 10;      // That a surface moved.
constexpr double kMeanTime = 1;          // The mean force at the beginning,
constexpr double kImpulseTime = 0.02;    // to which the normal goes.
constexpr double kPriorTime = 0.05;      // A wrong prior.
constexpr double kDepartureTime = 0.5;   // A departure from a light contact.

// Finding.
constexpr double kFirstShare = 0.6;        // Of the evidence that is needed
constexpr double kNextShare = 0.4;         // the most that one input gives: for
constexpr double kLossShare = 0.6;         // a contact, another, against one.
constexpr double kExpectedLevel = 0.6;     // Of the evidence that a contact
constexpr double kExpectedEvidence = 0.5;  // needs where it is expected.
constexpr double kFirstStd = 0.2;          // rad: of a first contact's normal.
constexpr double kNextStd = 0.3;           // rad: of another one's.
constexpr double kSlack = 0.05;            // rad: what a model leaves out. It
                                           // weighs finding a second wall
                                           // against inventing one.
constexpr double kMaxSlack = 0.15;         // rad.
constexpr double kAstray = 0.1;            // rad: between friction and motion.
constexpr double kMemoryTime = 1;          // s: a lost normal is remembered,
constexpr double kMemoryStd = 0.1;         // rad: this well,
const double kCosMemory = CalcSinCos(0.5).cos;  // Where one is as near.
constexpr double kForeseenTime = 0.05;  // s: two that were foreseen, not one
const double kCosForeseen = CalcSinCos(0.35).cos;  // As far from either,
constexpr double kForeseenRest = 0.25;  // and explained by both but for it,
constexpr double kForeseenShare = 0.2;  // each with at least this part.

// Losing.
constexpr double kSettlingTime = 0.05;  // s: no drop by velocity before.
constexpr double kConflictTime = 0.03;  // s: of motion along a normal,
constexpr double kSunk = 2e-4;          // m: at least by this.
constexpr double kDeparted = 3e-4;      // m: beyond its noise it is clear.
constexpr double kLightWay = 5e-4;      // m: having moved on by this.
constexpr double kLeastForce = 0.15;    // N: of a hand that rests lightly.
constexpr double kPressed = 4;          // times loss_force: not lightly.
constexpr double kWithdrawn = 0.5;      // times loss_force: pulled away.

double Share(double period, double time) {
  return -ExpMinusOne(-period / time);
}

/** `value`, at most as long as `limit`. */
Vector3d Shortened(const Vector3d& value, double limit) noexcept {
  const double norm = value.norm();
  return norm > limit ? Vector3d(value * (limit / norm)) : value;
}

/** Which two of the expected normals explain `normal`, if not one: they push
both, and the tool does not move along either.
@param[out] pair  their indices. */
bool FindPair(const Vector3d& normal, const Vector3d& velocity,
              const ContactPrior& prior, int* pair) noexcept {
  const double speed = velocity.norm();
  const auto moves = [&](const Vector3d& n) {
    return std::abs(velocity.dot(n)) > 0.003 + 0.25 * speed;
  };
  bool is_found = false;
  for (int i = 0; i < prior.count; ++i) {
    const Vector3d a = prior.normals->col(i);
    if (normal.dot(a) > kCosForeseen) return false;
    for (int j = 0; j < i; ++j) {
      const Vector3d b = prior.normals->col(j);
      const double cosine = a.dot(b);
      if (std::abs(cosine) > kCosForeseen || moves(a) || moves(b)) continue;
      const double sine2 = 1 - cosine * cosine;
      const double share_a = (normal.dot(a) - cosine * normal.dot(b)) / sine2;
      const double share_b = (normal.dot(b) - cosine * normal.dot(a)) / sine2;
      if (share_a < kForeseenShare || share_b < kForeseenShare) continue;
      if ((normal - share_a * a - share_b * b).norm() > kForeseenRest) continue;
      pair[0] = i;
      pair[1] = j;
      is_found = true;
    }
  }
  return is_found;
}

}  // namespace

void FrictionConeParams::Validate() const {
  ValidateFields("FrictionConeParams", *this);
}

ContactTracker::ContactTracker(const Params& params, int num_particles,
                               double period, InstructionSet instruction_set)
    : params_(params),
      num_particles_(num_particles),
      period_(period),
      instruction_set_(instruction_set),
      bias_(params.bias, params.bias_drift, params.force_noise,
            params.velocity_noise, period),
      smoothing_gain_(Share(period, kSmoothingTime)),
      friction_gain_(Share(period, kFrictionTime)),
      misfit_gain_(Share(period, kMisfitTime)),
      forgetting_gain_(Share(period, kForgettingTime)),
      impulse_gain_(Share(period, kImpulseTime)),
      onset_decay_(Exp(-period / kMeanTime)),
      departure_decay_(Exp(-period / kDepartureTime)),
      sinking_decay_(Exp(-period / kSinkingTime)),
      creeping_decay_(Exp(-period / kCreepingTime)),
      surface_decay_(Exp(-period / kSurfaceTime)),
      give_decay_(Exp(-period / kGiveTime)),
      roll_decay_(Exp(-period / kRollTime)),
      slide_decay_(Exp(-period / kSlideTime)),
      departure_noise_(2 * params.velocity_noise *
                       std::sqrt(0.5 * kDepartureTime * period)),
      prior_decay_(Exp(-period / kPriorTime)) {
  // Updates count as they come at 100 Hz. Faster ones are not independent of
  // each other; slower ones count more against a contact, up to what one input
  // may.
  const double information = 1 / (params.force_noise * params.force_noise);
  const double updates = std::max(0.2, period / 0.01);
  information_ = std::min(updates, 1.0);
  found_rate_ = std::min(updates, 1.0) * information;
  lost_rate_ = std::min(updates, 4.0) * information;
}

ContactTrackerState ContactTracker::MakeState() const {
  State state;
  state.bias = bias_.MakeState();
  return state;
}

void ContactTracker::Update(const ContactInput& input,
                            const ContactPrior& prior,
                            const ContactParticles& particles,
                            State* state) const noexcept {
  // Squares and quotients of what is larger would overflow.
  const Vector3d sensed = Shortened(input.force, 1e6);
  const Vector3d velocity = Shortened(input.velocity, 1e6);
  const Vector3d& command = input.command;
  const Vector3d force = sensed - state->bias.mean;
  bias_.Drift(&state->bias);
  NoteSinking(force, velocity, state);
  NoteCreeping(velocity, state);
  Explain(force, velocity, state);
  state->lost_time += period_;
  if (state->count > 0) {
    double forces[kMaxContacts]{};
    double total = 0;
    for (int i = 0; i < state->count; ++i) {
      forces[i] = state->contacts[i].force;
      total += forces[i];
    }
    for (int i = 0; i < state->count; ++i) {
      Follow(i, total - forces[i], {force, velocity, command}, prior, particles,
             state);
    }
    Explain(force, velocity, state);
    state->settled_time += period_;
    LearnFriction(force, velocity, state);
    NoteMotion(velocity, state);
    LearnMisfit(force, velocity, state);
    LearnBias(sensed, velocity, state);
    if (DropLost(velocity, command, particles, state)) {
      Explain(force, velocity, state);
    }
  }
  AddFound(force, velocity, prior, particles, state);
  SplitForeseen(velocity, prior, particles, state);
  state->velocity += smoothing_gain_ * (velocity - state->velocity);
  if (state->count == 0 && state->evidence == 0) {
    bias_.LearnFree(sensed, &state->bias);
  }
  MergeNear(particles, state);
}

void ContactTracker::Explain(const Vector3d& force, const Vector3d& velocity,
                             State* state) const noexcept {
  const int count = state->count;
  state->sliding = 0;
  state->unexplained = force;
  if (count == 0) return;

  const Vector3d slide = CalcFreePart(velocity, *state);
  const double speed = slide.norm();
  state->sliding = (1 - state->creeping) * CalcSlidingShare(speed);
  const Vector3d direction = slide / std::max(speed, 1e-9);

  // Non-negative least squares by coordinates; first without friction, whose
  // bound follows from the normal forces.
  double total = 0;
  double friction = 0;
  Vector3d rest = force;
  for (int pass = 0; pass < 2; ++pass) {
    if (pass > 0) {
      friction = std::clamp(force.dot(direction), 0.0,
                            CalcSlidingFriction(*state) * total) *
                 state->sliding;
    }
    rest = force - friction * direction;
    for (int i = 0; i < count; ++i) state->contacts[i].force = 0;
    const int sweeps = count == 1 ? 1 : 30;
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      double change = 0;
      for (int i = 0; i < count; ++i) {
        TrackedContact& contact = state->contacts[i];
        const double more = std::max(-contact.force, contact.normal.dot(rest));
        contact.force += more;
        rest -= more * contact.normal;
        change = std::max(change, std::abs(more));
      }
      if (change < 1e-6) break;
    }
    total = 0;
    for (int i = 0; i < count; ++i) total += state->contacts[i].force;
  }
  // Where it sticks, friction takes what it can; where it slides, it is not
  // exactly along a velocity that is not exact.
  const double astray = std::min(
      1.0, kAstray + 0.3 * params_.velocity_noise / std::max(speed, 1e-9));
  const double allowed =
      (1 - state->sliding) * CalcStickingFriction(*state) + astray * friction;
  const double size = rest.norm();
  state->unexplained =
      size > allowed ? Vector3d(rest * (1 - allowed / size)) : Vector3d::Zero();
}

double ContactTracker::CalcLossShare(const TrackedContact& contact,
                                     const Vector3d& command) const noexcept {
  if (command.isZero(0)) return 1;
  // Part of the way along a normal that is not exact seems along it.
  const double departed = std::abs(contact.departed) -
                          CalcStd(contact) * contact.way - departure_noise_;
  // Without the contact a force loop commands a multiple of its reference.
  const double unit = params_.loss_force + 1e-9;  // It may be 0.
  const double commanded = command.dot(contact.normal) / unit;
  const double pressed = commanded / kPressed - 1;
  // Nobody asks for a contact that is pulled away from. What is sensed beside
  // it cancels some of the noise that a force loop feeds back.
  const double withdrawn =
      -(commanded + contact.force / unit) / kWithdrawn - 0.5;
  return std::clamp(std::max({departed / kDeparted, pressed, withdrawn}), 0.0,
                    1.0);
}

bool ContactTracker::DropLost(const Vector3d& velocity, const Vector3d& command,
                              const ContactParticles& particles,
                              State* state) const noexcept {
  const double speed = velocity.norm();
  int lost = -1;
  for (int i = 0; i < state->count; ++i) {
    TrackedContact& contact = state->contacts[i];
    // As the other normals are not exact, some of their force seems this one's.
    double level = params_.loss_force;
    for (int j = 0; j < state->count; ++j) {
      const TrackedContact& other = state->contacts[j];
      if (j != i) level += other.force * std::min(kMaxSlack, CalcStd(other));
    }
    double change = lost_rate_ * (level - contact.force);
    if (change > 0) {
      contact.departed = departure_decay_ * contact.departed +
                         period_ * velocity.dot(contact.normal);
      contact.way = departure_decay_ * contact.way + period_ * speed;
      const double share = CalcLossShare(contact, command);
      // Where it has moved on, a force into the surface is sensed, and
      // commanded, on average.
      const double moved = std::clamp(contact.way / kLightWay - 1, 0.0, 1.0);
      const double pushed =
          std::max(command.dot(contact.normal), -2 * params_.loss_force);
      const double light = -0.5 * moved * lost_rate_ * (contact.force + pushed);
      // If it is there, a little is sensed.
      const double absent = moved * lost_rate_ * kLeastForce *
                            (0.5 * kLeastForce - contact.force);
      change = std::max({share * change, light, absent});
    } else {
      contact.departed = contact.way = 0;
    }
    if (state->count > 1 && state->settled_time > kSettlingTime) {
      // What gives lets it move along the normal as the force changes.
      const double given = 2 * CalcCompliance(contact) * contact.grown;
      const double moved = contact.sunk > 0
                               ? contact.sunk - std::max(0.0, given)
                               : -contact.sunk - std::max(0.0, -given);
      const double excess =
          moved / (kSunk + (kSlack + CalcStd(contact)) * contact.passed) - 1;
      if (excess > 0) {
        change = std::max(change, 0.0) + params_.evidence *
                                             std::min(1.0, excess) * period_ /
                                             kConflictTime;
      }
    }
    change = std::min(change, kLossShare * params_.evidence);
    contact.loss = std::clamp(contact.loss + change, 0.0, 2 * params_.evidence);
    if (contact.loss > params_.evidence &&
        (lost < 0 || contact.loss > state->contacts[lost].loss)) {
      lost = i;
    }
  }
  if (lost < 0) return false;
  Remove(lost, particles, state);
  state->evidence = 0;
  return true;
}

double ContactTracker::CalcUnexplainedLevel(const Vector3d& force,
                                            const State& state) const noexcept {
  if (state.count == 0) {
    return params_.contact_force + 1.5 * ForceBias::CalcStd(state.bias);
  }
  // Before it has slid, that friction may be tilting the force and that the
  // normal is not known are the same.
  double spread = 0;
  for (int i = 0; i < state.count; ++i) {
    const TrackedContact& contact = state.contacts[i];
    const double known = contact.slid < kSettledSlide ? state.sliding : 1;
    spread = std::max(spread, known * CalcStd(contact));
  }
  const double slack = kSlack * (0.5 + 0.5 * state.sliding);
  return 0.5 * params_.contact_force + (slack + spread) * force.norm();
}

void ContactTracker::AddFound(const Vector3d& force, const Vector3d& velocity,
                              const ContactPrior& prior,
                              const ContactParticles& particles,
                              State* state) const noexcept {
  const int count = state->count;
  const double size = state->unexplained.norm();
  if (state->evidence <= 0) state->unexplained_impulse.setZero();

  // The expected normal that is nearest, if any is near.
  int expected = -1;
  double nearest = 6.25 * (prior.std * prior.std + kTilt * kTilt);
  for (int i = 0; i < prior.count && size > 0; ++i) {
    const double distance2 =
        2 * (1 - prior.normals->col(i).dot(state->unexplained) / size);
    if (distance2 < nearest) {
      nearest = distance2;
      expected = i;
    }
  }

  double level = CalcUnexplainedLevel(force, *state);
  double needed = params_.evidence;
  if (expected >= 0) {
    level *= kExpectedLevel;
    needed *= kExpectedEvidence;
  }
  // However wild, one input decides nothing; nor do two, unless the tool is
  // stopped, too.
  const double stopped =
      (state->velocity - velocity).dot(state->unexplained) / (size + 1e-9);
  const bool sure = count == 0 || stopped > 3 * params_.velocity_noise;
  const double most = needed * (sure ? kFirstShare : kNextShare);
  const double change = std::clamp(found_rate_ * (size - level), -most, most);
  state->evidence = std::max(0.0, state->evidence + change);
  if (state->evidence > 0) {
    // However wild, one input does not say where.
    state->unexplained_impulse +=
        period_ * Shortened(state->unexplained, level + most / found_rate_);
  }
  if (state->evidence < needed || count == kMaxContacts) return;

  Vector3d normal = state->unexplained_impulse.stableNormalized();
  state->evidence = 0;
  int replaced = -1;
  // What was just found, at little force or in a bounce, may be off itself.
  if (count == 1 && state->settled_time < kSettlingTime) replaced = 0;
  if (count == 2) {
    // Within their plane a third one would be needless.
    const Vector3d axis = CalcFreeAxis(*state);
    if (std::abs(normal.dot(axis)) < 0.7) {
      replaced = state->contacts[0].force < state->contacts[1].force ? 1 : 0;
    }
  }
  if (replaced >= 0) {
    const Vector3d slide = velocity.stableNormalized();
    normal = force - (state->sliding > 0.5 ? force.dot(slide) : 0.0) * slide;
    if (!(normal.norm() > 0)) return;
    TrackedContact& contact = state->contacts[replaced];
    contact.impulse.setZero();
    contact.loss = contact.departed = contact.way = 0;
    Draw(replaced, normal.normalized(), kFirstStd, particles, state);
    return;
  }

  double std = count == 0 ? kFirstStd : kNextStd;
  TrackedContact contact;
  contact.impulse = state->unexplained_impulse;
  if (expected >= 0) {
    contact.prior = prior.normals->col(expected) / (prior.std * prior.std);
    normal = (normal / (std * std) + contact.prior).normalized();
    std = 1 / std::sqrt(1 / (std * std) + 1 / (prior.std * prior.std));
  } else if (count == 0 && state->lost_time < kMemoryTime &&
             normal.dot(state->lost_normal) > kCosMemory) {
    // It was lost, and is met again: at little force friction and noise would
    // tilt the normal, and the tool would slide off along it.
    normal = state->lost_normal;
    std = kMemoryStd;
    contact.impulse.setZero();
  }
  AddContact(contact, normal, std, particles, state);
  state->settled_time = 0;
  state->entry_speed = velocity.norm();
  // What did not fit was this.
  state->astray2 = state->into2 = state->friction_variance = 0;
}

void ContactTracker::SplitForeseen(const Vector3d& velocity,
                                   const ContactPrior& prior,
                                   const ContactParticles& particles,
                                   State* state) const noexcept {
  int pair[2];
  if (state->count != 1 ||
      !FindPair(state->contacts[0].normal, velocity, prior, pair)) {
    state->foreseen_time = 0;
    return;
  }
  state->foreseen_time += period_;
  if (state->foreseen_time < kForeseenTime) return;
  state->foreseen_time = 0;
  TrackedContact& first = state->contacts[0];
  first.impulse.setZero();
  first.loss = 0;
  Draw(0, prior.normals->col(pair[0]), prior.std, particles, state);
  AddContact({}, prior.normals->col(pair[1]), prior.std, particles, state);
}

}  // namespace dual_proxy
