// SPDX-License-Identifier: BSD-3-Clause
// ContactTracker: where the contacts are. Their particles.
#include "dual_proxy/perception/contact_tracker.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/common/vector_math.h"
#include "dual_proxy/perception/contact_kernels.h"
#include "dual_proxy/perception/contact_tracker_tools.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDrift = 1e-6;  // rad^2/s: of a normal at rest.
// Of 0.2 rad: nearer to each other, contacts are one.
const double kCosDistinct = CalcSinCos(0.2).cos;
constexpr double kPriorHold = 0.1;   // s: a prior says the same so long.
constexpr double kShapeWay = 0.01;   // m: over which a shape is learned,
constexpr double kEdgeWay = 0.02;    // m: of two contacts; four times what
                                     // these lag, so that it does not swing.
constexpr double kMostShape = 100;   // 1/m: over edges it is no shape.
constexpr double kSinkingDoubt = 2;  // Of sinking that is expected.

MutableParticleList Skip(const MutableParticleList& list, int count) noexcept {
  return list.Skip(count);
}

void SetArray(const Vector3d& value, double* array) noexcept {
  Eigen::Map<Vector3d>{array} = value;
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

void ContactTracker::Follow(int index, double other_force,
                            const ContactInput& input,
                            const ContactPrior& prior,
                            const ContactParticles& particles,
                            State* state) const noexcept {
  const Vector3d& force = input.force;
  const Vector3d& velocity = input.velocity;
  const int count = state->count;
  const int first = First(index, count);
  const int size = First(index + 1, count) - first;
  if (size == 0) return;
  TrackedContact& contact = state->contacts[index];
  const Vector3d& normal = contact.normal;
  // Along the normal it sinks.
  const double speed = (velocity - velocity.dot(normal) * normal).norm();
  const double moves = CalcSlidingShare(speed);
  const bool begins = Begins(contact);
  if (!begins && moves == 0) return;  // At rest no normal turns.
  const double slides = (1 - state->creeping) * moves;
  const double rests = (1 - moves) * (1 - moves);

  // Shrunk towards their mean and spread by as much, particles keep their mean
  // and covariance, and no two stay the same (Liu and West's kernel).
  ContactMove move;
  const double bandwidth2 = Exp(-LogOfPositive(size) / 3);
  const double keep2 = 1 - bandwidth2;
  move.keep = std::sqrt(keep2);
  const Vector3d x = MakeTangent(normal, velocity);
  const Vector3d y = normal.cross(x);
  const double distance = slides * speed * period_;
  const double drift = kDrift * period_;
  const double curvature = count == 1 ? params_.curvature : params_.torsion;
  // Of two, turning within their plane is nothing that anything shows.
  const double aside = count == 1 ? params_.torsion : 0;
  const Vector3d Cx = contact.covariance * x;
  const Vector3d Cy = contact.covariance * y;
  SetSpread(x, y, bandwidth2 * Cx.dot(x) + curvature * distance + drift,
            bandwidth2 * Cx.dot(y),
            bandwidth2 * Cy.dot(y) + aside * distance + drift, &move);
  SetArray(normal, move.normal);
  Vector3d centre = normal;
  if (contact.slid < kSettledSlide && begins) {
    // The mean force is the best guess, as good as kTilt; with an expected
    // normal it is one of two, unless they exclude each other.
    Vector3d mine = force;
    for (int i = 0; i < count; ++i) {
      const TrackedContact& other = state->contacts[i];
      if (i != index) mine -= other.force * other.normal;
    }
    contact.impulse = onset_decay_ * contact.impulse + rests * period_ * mine;
    Vector3d guess = contact.impulse.stableNormalized() / (kTilt * kTilt);
    const double known = contact.prior.norm();
    if (known > 0) {
      const double angle2 =
          2 * (1 - contact.prior.dot(guess) * kTilt * kTilt / known);
      if (angle2 > 4 * (1 / known + kTilt * kTilt)) {
        contact.prior *= prior_decay_;
      }
      guess += contact.prior;
    }
    if (guess.norm() > 0) {
      centre += impulse_gain_ * rests * (guess.normalized() - normal);
    }
  }
  centre += CalcPriorPull(contact, prior);
  // It goes on turning as it has turned.
  const Vector3d step =
      slides * period_ * (velocity - velocity.dot(normal) * normal);
  const Vector3d turn = contact.shape * step;
  centre += turn;
  const Vector3d expected = centre.normalized();
  SetArray(centre, move.centre);

  ContactWeights weights;
  const Vector3d other =
      count == 2 ? state->contacts[1 - index].normal : Vector3d::Zero();
  // As the forces change, the tool sinks into what gives.
  Vector3d sinking = Vector3d::Zero();
  for (int i = 0; i < count; ++i) {
    const TrackedContact& each = state->contacts[i];
    sinking += CalcSinkingSpeed(each) * each.normal;
  }
  const double sinking2 = state->sinking_speed * state->sinking_speed +
                          state->surface_speed * state->surface_speed +
                          kSinkingDoubt * kSinkingDoubt * sinking.squaredNorm();
  const double speed_variance =
      params_.velocity_noise * params_.velocity_noise + sinking2;
  // What speaks for another contact must not turn this one towards it.
  const double foreign = std::max(
      0.0, state->unexplained.norm() - CalcUnexplainedLevel(force, *state));
  const double bias = ForceBias::CalcStd(state->bias);
  const double force_variance = params_.force_noise * params_.force_noise +
                                4 * foreign * foreign + bias * bias +
                                state->astray2;
  SetArray(force - force.dot(other) * other, weights.force);
  SetArray(velocity, weights.velocity);
  SetArray((1 - state->creeping) * (velocity - velocity.dot(other) * other),
           weights.sliding);
  SetArray(other, weights.other);
  weights.velocity_scale = 1 / (3 * speed_variance);
  weights.force_scale = count < 3 ? information_ / force_variance : 0;
  weights.direction_scale =
      params_.velocity_noise * params_.velocity_noise / force_variance;
  weights.friction =
      begins ? CalcMaxFriction(*state) : CalcSlidingFriction(*state);
  weights.sticking_weight = begins ? 1 : 0;
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
  const Vector3d before = normal;
  CalcStatistics(index, particles, state);
  contact.rolled *= roll_decay_;
  if (count < 3 && slides == 1 && contact.slid >= kSettledSlide) {
    Vector3d beside = contact.normal - expected;
    if (count == 1) {
      contact.rolled += (contact.normal - before).dot(y);
    } else {
      // How it turns within the plane of both nothing shows.
      beside = beside.dot(x) * x;
    }
    // What it has turned beside what was expected, of that a part; less as long
    // as that may be a bias.
    const double doubt =
        bias * bias / (params_.force_noise * params_.force_noise);
    const double share =
        std::min(1.0, distance / (count == 1 ? kShapeWay : kEdgeWay)) /
        (distance * (1 + doubt * doubt));
    contact.shape += beside * (share / distance * step).transpose();
    const double largest = contact.shape.norm();
    if (largest > kMostShape) contact.shape *= kMostShape / largest;
  }
}

Vector3d ContactTracker::CalcPriorPull(
    const TrackedContact& contact, const ContactPrior& prior) const noexcept {
  if (prior.count == 0 || contact.slid < kSettledSlide) {
    return Vector3d::Zero();
  }
  // The expected normal that is nearest, as one measurement of many alike.
  const double variance = prior.std * prior.std * (kPriorHold / period_ + 1);
  double nearest = 12 * prior.std * prior.std;
  Vector3d away = Vector3d::Zero();
  for (int i = 0; i < prior.count; ++i) {
    const Vector3d difference = prior.normals->col(i) - contact.normal;
    if (difference.squaredNorm() > nearest) continue;
    nearest = difference.squaredNorm();
    away = difference;
  }
  Matrix3d total = contact.covariance;
  total.diagonal().array() += variance;
  return contact.covariance * (total.inverse() * away);
}

void ContactTracker::AddContact(const TrackedContact& contact,
                                const Vector3d& normal, double std,
                                const ContactParticles& particles,
                                State* state) const noexcept {
  // Make room: what is there keeps every other particle, or two in three.
  const int count = state->count;
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
  Draw(count, normal, std, particles, state);
  for (int i = 0; i < count; ++i) {
    state->contacts[i].loss = 0;
    CalcStatistics(i, particles, state);
  }
}

void ContactTracker::MergeNear(const ContactParticles& particles,
                               State* state) const noexcept {
  // Opposite normals are one direction, too: pushed from the other side.
  for (int i = 0; i < state->count; ++i) {
    for (int j = state->count - 1; j > i; --j) {
      const TrackedContact& a = state->contacts[i];
      const TrackedContact& b = state->contacts[j];
      if (std::abs(a.normal.dot(b.normal)) > kCosDistinct) {
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

}  // namespace dual_proxy
