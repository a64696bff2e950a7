// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/contact_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "dual_proxy/perception/contact_kernels.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// What depends on neither sensor nor surface. Chosen on simulated trials and
// recordings; kSlack weighs finding a second wall against inventing one.
constexpr double kSmoothingTime = 0.03;    // s: of the force, for its rate.
constexpr double kFrictionTime = 0.1;      // s: over which mu is learned.
constexpr double kImpulseTime = 0.02;      // s: to the mean force, sticking.
constexpr double kPriorTime = 0.05;        // s: until a wrong prior is gone.
constexpr double kEntryTime = 0.02;        // s: the approach's speed is gone.
constexpr double kSettlingTime = 0.05;     // s: no drop by velocity before.
constexpr double kDepartureTime = 0.5;     // s: until a departure is forgotten.
constexpr double kDeparted = 3e-4;         // m: beyond its noise it is clear.
constexpr double kLightWay = 5e-4;         // m: having moved on by this.
constexpr double kMemoryTime = 1;          // s: a lost normal is remembered,
constexpr double kMemoryStd = 0.1;         // rad: this well,
constexpr double kMemoryAngle = 0.5;       // rad: where one is as near.
constexpr double kPressed = 4;             // times loss_force: not lightly.
constexpr double kWithdrawn = 0.5;         // times loss_force: pulled away.
constexpr double kConflictTime = 0.03;     // s: of motion along a normal.
constexpr double kSettledSlide = 0.002;    // m: the normal is known by then.
constexpr double kTilt = 0.12;             // rad: usual tilt by friction.
constexpr double kFirstTilt = 0.22;        // rad: with 95 %, of one contact,
constexpr double kNextTilt = 0.38;         // and of the free axis of two.
constexpr double kFirstStd = 0.2;          // rad: of a first contact's normal.
constexpr double kNextStd = 0.3;           // rad: of another one's.
constexpr double kSlack = 0.05;            // rad: what a model leaves out.
constexpr double kMaxSlack = 0.15;         // rad.
constexpr double kDrift = 1e-6;            // rad^2/s: of a normal at rest.
constexpr double kDistinctAngle = 0.2;     // rad: below, contacts are one.
constexpr double kAstray = 0.1;            // rad: between friction and motion.
constexpr double kFrictionMargin = 0.1;    // Over the mu that was seen,
constexpr double kFrictionFactor = 1.2;    // as sticking friction is larger.
constexpr double kExpectedLevel = 0.6;     // Of the evidence that a contact
constexpr double kExpectedEvidence = 0.5;  // needs where it is expected.

double Share(double period, double time) { return -std::expm1(-period / time); }

/** `value`, at most as long as `limit`. */
Vector3d Shortened(const Vector3d& value, double limit) noexcept {
  const double norm = value.norm();
  return norm > limit ? Vector3d(value * (limit / norm)) : value;
}

double CalcStd(const TrackedContact& contact) noexcept {
  return std::sqrt(std::max(0.0, contact.covariance.trace()));
}

/** rad^2: square of how far friction may have tilted what never slid. */
double CalcTilt2(const TrackedContact& contact, double tilt) noexcept {
  return contact.slid < kSettledSlide ? tilt * tilt : 0;
}

MutableParticleList Skip(const MutableParticleList& list, int count) noexcept {
  return list.Skip(count);
}

void SetArray(const Vector3d& value, double* array) noexcept {
  Eigen::Map<Vector3d>{array} = value;
}

/** Unit vector across `normal`, along `direction` if that has such a part. */
Vector3d MakeTangent(const Vector3d& normal,
                     const Vector3d& direction) noexcept {
  const Vector3d tangent = direction - direction.dot(normal) * normal;
  return tangent.norm() > 1e-9 ? tangent.normalized() : normal.unitOrthogonal();
}

/** Two columns whose random multiples have the variances `xx`, `yy` and the
covariance `xy` along x and y. */
void SetSpread(const Vector3d& x, const Vector3d& y, double xx, double xy,
               double yy, ContactMove* move) noexcept {
  const double a = std::sqrt(std::max(xx, 1e-14));
  const double b = xy / a;
  const double c = std::sqrt(std::max(yy - b * b, 1e-14));
  SetArray(a * x + b * y, move->first);
  SetArray(c * y, move->second);
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
      smoothing_gain_(Share(period, kSmoothingTime)),
      friction_gain_(Share(period, kFrictionTime)),
      impulse_gain_(Share(period, kImpulseTime)),
      departure_decay_(std::exp(-period / kDepartureTime)),
      departure_noise_(2 * params.velocity_noise *
                       std::sqrt(0.5 * kDepartureTime * period)),
      prior_decay_(std::exp(-period / kPriorTime)) {
  // Updates count as they come at 100 Hz. Faster ones are not independent of
  // each other; slower ones may end a contact alone, but not begin one.
  const double information = 1 / (params.force_noise * params.force_noise);
  const double updates = std::max(0.2, period / 0.01);
  information_ = std::min(updates, 1.0);
  found_rate_ = std::min(updates, 1.0) * information;
  lost_rate_ = std::min(updates, 4.0) * information;
}

double ContactTracker::CalcMaxFriction(const State& state) const noexcept {
  return state.friction < 0
             ? params_.max_friction
             : std::min(params_.max_friction,
                        kFrictionFactor * state.friction + kFrictionMargin);
}

void ContactTracker::Update(const Vector3d& force_in,
                            const Vector3d& velocity_in,
                            const Vector3d& command, const ContactPrior& prior,
                            const ContactParticles& particles,
                            State* state) const noexcept {
  // Squares and quotients of what is larger would overflow.
  const Vector3d force = Shortened(force_in, 1e6);
  const Vector3d velocity = Shortened(velocity_in, 1e6);
  NoteSinking(force, velocity, state);
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
      Follow(i, total - forces[i], force, velocity, particles, state);
    }
    Explain(force, velocity, state);
    state->settled_time += period_;
    LearnFriction(force, velocity, state);
    NoteMotion(velocity, state);
    if (DropLost(velocity, command, particles, state)) {
      Explain(force, velocity, state);
    }
  }
  AddFound(force, velocity, prior, particles, state);
  MergeNear(particles, state);
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
  const double sine =
      params_.max_friction / std::hypot(1.0, params_.max_friction);
  const double sink =
      2 * std::max({0.0, forward - sine * speed, -forward - 0.1 * speed});
  const double entry =
      state->entry_speed * std::exp(-state->settled_time / kEntryTime);
  state->sinking_speed =
      state->count > 0 ? std::sqrt(give * give + sink * sink + entry * entry)
                       : 0;
}

void ContactTracker::Explain(const Vector3d& force, const Vector3d& velocity,
                             State* state) const noexcept {
  const int count = state->count;
  state->sliding = 0;
  state->unexplained = force;
  if (count == 0) return;

  Vector3d slide = Vector3d::Zero();
  const Vector3d& first = state->contacts[0].normal;
  if (count == 1) {
    slide = velocity - velocity.dot(first) * first;
  } else if (count == 2) {
    const Vector3d axis = first.cross(state->contacts[1].normal).normalized();
    slide = velocity.dot(axis) * axis;
  }
  const double speed = slide.norm();
  state->sliding = std::clamp(speed / params_.sliding_speed - 0.5, 0.0, 1.0);
  const Vector3d direction = slide / std::max(speed, 1e-9);

  // Non-negative least squares by coordinates; first without friction, whose
  // bound follows from the normal forces.
  const double mu = CalcMaxFriction(*state);
  double total = 0;
  double friction = 0;
  Vector3d rest = force;
  for (int pass = 0; pass < 2; ++pass) {
    if (pass > 0) {
      friction =
          std::clamp(force.dot(direction), 0.0, mu * total) * state->sliding;
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
  const double allowed = (1 - state->sliding) * mu * total + astray * friction;
  const double size = rest.norm();
  state->unexplained =
      size > allowed ? Vector3d(rest * (1 - allowed / size)) : Vector3d::Zero();
}

void ContactTracker::Follow(int index, double other_force,
                            const Vector3d& force, const Vector3d& velocity,
                            const ContactParticles& particles,
                            State* state) const noexcept {
  const int count = state->count;
  const int first = First(index, count);
  const int size = First(index + 1, count) - first;
  if (size == 0) return;
  TrackedContact& contact = state->contacts[index];
  const Vector3d& normal = contact.normal;
  // Along the normal it sinks.
  const double speed = (velocity - velocity.dot(normal) * normal).norm();
  const double slides =
      std::clamp(speed / params_.sliding_speed - 0.5, 0.0, 1.0);
  const double sticks = (1 - slides) * (1 - slides);

  // Shrunk towards their mean and spread by as much, particles keep their mean
  // and covariance, and no two stay the same (Liu and West's kernel).
  ContactMove move;
  const double bandwidth2 = 1 / std::cbrt(static_cast<double>(size));
  const double keep2 = 1 - bandwidth2;
  move.keep = std::sqrt(keep2);
  const Vector3d x = MakeTangent(normal, velocity);
  const Vector3d y = normal.cross(x);
  const double distance = slides * speed * period_;
  const double drift = kDrift * period_;
  const double curvature = count == 1 ? params_.curvature : params_.torsion;
  const Vector3d Cx = contact.covariance * x;
  const Vector3d Cy = contact.covariance * y;
  SetSpread(x, y, bandwidth2 * Cx.dot(x) + curvature * distance + drift,
            bandwidth2 * Cx.dot(y),
            bandwidth2 * Cy.dot(y) + params_.torsion * distance + drift, &move);
  SetArray(normal, move.normal);
  Vector3d centre = normal;
  if (count == 1 && contact.slid < kSettledSlide) {
    // The mean force is the best guess, as good as kTilt; with an expected
    // normal it is one of two, unless they exclude each other.
    contact.impulse += sticks * period_ * force;
    Vector3d guess = contact.impulse.stableNormalized() / (kTilt * kTilt);
    const double prior = contact.prior.norm();
    if (prior > 0) {
      const double angle2 =
          2 * (1 - contact.prior.dot(guess) * kTilt * kTilt / prior);
      if (angle2 > 4 * (1 / prior + kTilt * kTilt)) {
        contact.prior *= prior_decay_;
      }
      guess += contact.prior;
    }
    if (guess.norm() > 0) {
      centre += impulse_gain_ * sticks * (guess.normalized() - normal);
    }
  }
  SetArray(centre, move.centre);

  ContactWeights weights;
  const Vector3d other =
      count == 2 ? state->contacts[1 - index].normal : Vector3d::Zero();
  const double speed_variance =
      params_.velocity_noise * params_.velocity_noise +
      state->sinking_speed * state->sinking_speed;
  // What speaks for another contact must not turn this one towards it.
  const double foreign = std::max(
      0.0, state->unexplained.norm() - CalcUnexplainedLevel(force, *state));
  const double force_variance =
      params_.force_noise * params_.force_noise + 4 * foreign * foreign;
  SetArray(force - force.dot(other) * other, weights.force);
  SetArray(velocity, weights.velocity);
  SetArray(velocity - velocity.dot(other) * other, weights.sliding);
  SetArray(other, weights.other);
  weights.velocity_scale = 1 / (3 * speed_variance);
  weights.force_scale = count < 3 ? information_ / force_variance : 0;
  weights.direction_scale =
      params_.velocity_noise * params_.velocity_noise / force_variance;
  weights.friction = CalcMaxFriction(*state);
  weights.usual_friction = std::max(0.0, state->friction);
  weights.usual_weight = state->friction >= 0 ? 1 : 0;
  weights.other_force = other_force;
  weights.sliding_low = 0.5 * params_.sliding_speed;
  weights.sliding_slope = 1 / params_.sliding_speed;

  const MutableParticleList mine = Skip(particles.particles, first);
  MoveContactParticles(instruction_set_, move, mine, size, particles.normals,
                       particles.moved);
  WeighContactParticles(instruction_set_, weights, particles.moved, size,
                        particles.weights);
  if (ChooseParticles(instruction_set_, size, particles.random->Uniform(), size,
                      particles.weights, particles.chosen)) {
    CopyChosen(particles.moved, particles.chosen, size, mine);
  }
  CalcStatistics(index, particles, state);
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
    state->friction = std::min(params_.max_friction, seen + 0.3);
  }
  // The slower it slides, the less the velocity tells friction from a tilt.
  const double ratio = velocity.norm() / (20 * params_.velocity_noise);
  state->friction +=
      friction_gain_ * std::min(1.0, ratio * ratio) * (seen - state->friction);
}

void ContactTracker::NoteMotion(const Vector3d& velocity,
                                State* state) const noexcept {
  const double speed = velocity.norm();
  const bool is_clear = state->sinking_speed < 2 * params_.velocity_noise;
  for (int i = 0; i < state->count; ++i) {
    TrackedContact& contact = state->contacts[i];
    if (is_clear) contact.slid += state->sliding * speed * period_;
  }
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
      change = std::max(share * change, light);
    } else {
      contact.departed = contact.way = 0;
    }
    if (state->count > 1 && state->settled_time > kSettlingTime) {
      const double excess = std::abs(velocity.dot(contact.normal)) /
                                (0.002 + (kSlack + CalcStd(contact)) * speed) -
                            1;
      if (excess > 0) {
        change = std::max(change, 0.0) + params_.evidence *
                                             std::min(1.0, excess) * period_ /
                                             kConflictTime;
      }
    }
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
  if (state.count == 0) return params_.contact_force;
  double spread = 0;
  for (int i = 0; i < state.count; ++i) {
    spread = std::max(spread, CalcStd(state.contacts[i]));
  }
  return 0.5 * params_.contact_force + (kSlack + spread) * force.norm();
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
  state->evidence =
      std::max(0.0, state->evidence + found_rate_ * (size - level));
  if (state->evidence > 0) {
    state->unexplained_impulse += period_ * state->unexplained;
  }
  if (state->evidence < needed || count == kMaxContacts) return;

  Vector3d normal = state->unexplained_impulse.stableNormalized();
  state->evidence = 0;
  int replaced = -1;
  // What was just found, at little force or in a bounce, may be off itself.
  if (count == 1 && state->settled_time < kSettlingTime) replaced = 0;
  if (count == 2) {
    // Within their plane a third one would be needless.
    const Vector3d axis =
        state->contacts[0].normal.cross(state->contacts[1].normal).normalized();
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
  if (count == 0) contact.impulse = state->unexplained_impulse;
  if (expected >= 0) {
    contact.prior = prior.normals->col(expected) / (prior.std * prior.std);
    normal = (normal / (std * std) + contact.prior).normalized();
    std = 1 / std::sqrt(1 / (std * std) + 1 / (prior.std * prior.std));
  } else if (count == 0 && state->lost_time < kMemoryTime &&
             normal.dot(state->lost_normal) > std::cos(kMemoryAngle)) {
    // It was lost, and is met again: at little force friction and noise would
    // tilt the normal, and the tool would slide off along it.
    normal = state->lost_normal;
    std = kMemoryStd;
    contact.impulse.setZero();
  }
  // Make room: what is there keeps every other particle, or two in three.
  for (int i = 0; i < count; ++i) {
    const int old_first = First(i, count);
    const int old_size = First(i + 1, count) - old_first;
    const int first = First(i, count + 1);
    const int new_size = First(i + 1, count + 1) - first;
    const MutableParticleList from = Skip(particles.particles, old_first);
    const MutableParticleList to = Skip(particles.particles, first);
    // Forwards in place: the source is never before the target.
    for (int k = 0; k < new_size; ++k) {
      const int source =
          static_cast<int>(static_cast<std::int64_t>(k) * old_size / new_size);
      to.x[k] = from.x[source];
      to.y[k] = from.y[source];
      to.z[k] = from.z[source];
    }
  }
  state->contacts[count] = contact;
  ++state->count;
  state->settled_time = 0;
  state->entry_speed = velocity.norm();
  Draw(count, normal, std, particles, state);
  for (int i = 0; i < count; ++i) {
    state->contacts[i].loss = 0;
    CalcStatistics(i, particles, state);
  }
}

void ContactTracker::MergeNear(const ContactParticles& particles,
                               State* state) const noexcept {
  // Opposite normals are one direction, too: pushed from the other side.
  const double cosine = std::cos(kDistinctAngle);
  for (int i = 0; i < state->count; ++i) {
    for (int j = state->count - 1; j > i; --j) {
      const TrackedContact& a = state->contacts[i];
      const TrackedContact& b = state->contacts[j];
      if (std::abs(a.normal.dot(b.normal)) > cosine) {
        Remove(j, particles, state);
      }
    }
  }
}

void ContactTracker::Remove(int index, const ContactParticles& particles,
                            State* state) const noexcept {
  const int count = state->count;
  // Those that stay share the room; through the work space, as they may move
  // either way.
  int target = 0;
  for (int i = 0; i < count; ++i) {
    if (i == index) continue;
    const int old_first = First(i, count);
    const int old_size = First(i + 1, count) - old_first;
    const int first = First(target, count - 1);
    const int size = First(target + 1, count - 1) - first;
    const MutableParticleList from = Skip(particles.particles, old_first);
    const MutableParticleList to = Skip(particles.moved, first);
    for (int k = 0; k < size; ++k) {
      const int source =
          static_cast<int>(static_cast<std::int64_t>(k) * old_size / size);
      const bool exists = source < old_size;
      to.x[k] = exists ? from.x[source] : state->contacts[i].normal.x();
      to.y[k] = exists ? from.y[source] : state->contacts[i].normal.y();
      to.z[k] = exists ? from.z[source] : state->contacts[i].normal.z();
    }
    state->contacts[target++] = state->contacts[i];
  }
  state->count = count - 1;
  if (state->count == 0) {
    state->lost_normal = state->contacts[index].normal;
    state->lost_time = 0;
    state->contacts[0] = {};
    return;
  }
  std::copy_n(particles.moved.x, num_particles_, particles.particles.x);
  std::copy_n(particles.moved.y, num_particles_, particles.particles.y);
  std::copy_n(particles.moved.z, num_particles_, particles.particles.z);
  for (int i = 0; i < state->count; ++i) CalcStatistics(i, particles, state);
}

void ContactTracker::Draw(int index, const Vector3d& normal, double std,
                          const ContactParticles& particles,
                          State* state) const noexcept {
  TrackedContact& contact = state->contacts[index];
  const int first = First(index, state->count);
  const int size = First(index + 1, state->count) - first;
  const MutableParticleList mine = Skip(particles.particles, first);
  for (int k = 0; k < size; ++k) {
    mine.x[k] = normal.x();
    mine.y[k] = normal.y();
    mine.z[k] = normal.z();
  }
  ContactMove move;
  SetArray(normal, move.normal);
  SetArray(normal, move.centre);
  const Vector3d x = normal.unitOrthogonal();
  SetSpread(x, normal.cross(x), std * std, 0, std * std, &move);
  MoveContactParticles(instruction_set_, move, mine, size, particles.normals,
                       particles.moved);
  std::copy_n(particles.moved.x, size, mine.x);
  std::copy_n(particles.moved.y, size, mine.y);
  std::copy_n(particles.moved.z, size, mine.z);
  contact.normal = normal;
  CalcStatistics(index, particles, state);
}

void ContactTracker::CalcStatistics(int index,
                                    const ContactParticles& particles,
                                    State* state) const noexcept {
  const int first = First(index, state->count);
  const int size = First(index + 1, state->count) - first;
  if (size == 0) return;
  TrackedContact& contact = state->contacts[index];
  const ParticleMoments sums =
      CalcMoments(instruction_set_, Skip(particles.particles, first), size);
  const Vector3d mean = Vector3d(sums.x, sums.y, sums.z) / size;
  Matrix3d second;
  second << sums.xx, sums.xy, sums.xz,  //
      sums.xy, sums.yy, sums.yz,        //
      sums.xz, sums.yz, sums.zz;
  contact.covariance = second / size - mean * mean.transpose();
  if (mean.norm() > 0) contact.normal = mean.normalized();
}

double ContactTracker::CalcDirectionUncertainty(const State& state) noexcept {
  // Of a plane normal distribution with variances a >= b the radius that holds
  // 95 % is, within 1 %, the root of 3.84 a + 2.16 b. Noises are set larger
  // than they are, and so are the clouds: kScale2 makes the 95 % come true.
  constexpr double kScale2 = 0.64;
  switch (state.count) {
    case 0:
      return 0.5 * std::numbers::pi;
    case 1: {
      const TrackedContact& contact = state.contacts[0];
      const Vector3d x = MakeTangent(contact.normal, Vector3d::UnitX());
      const Vector3d y = contact.normal.cross(x);
      const double xx = x.dot(contact.covariance * x);
      const double yy = y.dot(contact.covariance * y);
      const double xy = x.dot(contact.covariance * y);
      const double half = 0.5 * std::hypot(xx - yy, 2 * xy);
      const double middle = 0.5 * (xx + yy);
      return std::sqrt(kScale2 * (3.84 * std::max(0.0, middle + half) +
                                  2.16 * std::max(0.0, middle - half)) +
                       CalcTilt2(contact, kFirstTilt));
    }
    case 2: {
      const Vector3d axis =
          state.contacts[0].normal.cross(state.contacts[1].normal).normalized();
      double square = 0;
      for (int i = 0; i < 2; ++i) {
        const TrackedContact& contact = state.contacts[i];
        square +=
            kScale2 * 3.84 * std::max(0.0, axis.dot(contact.covariance * axis));
      }
      return std::sqrt(square +
                       std::max(CalcTilt2(state.contacts[0], kNextTilt),
                                CalcTilt2(state.contacts[1], kNextTilt)));
    }
    default:
      return 0;
  }
}

double ContactTracker::CalcCountConfidence(const State& state) const noexcept {
  double pending = state.evidence;
  for (int i = 0; i < state.count; ++i) {
    pending = std::max(pending, state.contacts[i].loss);
  }
  // How often the count was right at a share of the evidence that is needed.
  return 1 / (1 + std::exp((pending / params_.evidence - 0.34) / 0.075));
}

}  // namespace dual_proxy
