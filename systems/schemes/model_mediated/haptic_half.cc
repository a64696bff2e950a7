// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/common/rotation.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"
#include "dual_proxy/schemes/model_mediated/scheme.h"

namespace dual_proxy {

using Eigen::Vector3d;

namespace {

/** N: of the spring, from which on a surface damps in full. Damping that comes
at once would be a step at touch. */
constexpr double kWholeDamping = 1;

// m: how deep x_d is in the surface.
double CalcDepth(const ModelMediatedSurface& surface, const Vector3d& x_d) {
  return std::max(0.0, surface.normal.dot(x_d) - surface.offset);
}

// Turns the unit vector *n towards `goal`, by max_angle (rad) at most, and
// returns by how much.
double Turn(const Vector3d& goal, double max_angle, Vector3d* n) {
  const double cosine = n->dot(goal);
  Vector3d across = goal - cosine * *n;
  const double angle = Atan2(across.norm(), cosine);
  if (angle <= max_angle) {
    *n = goal;
    return angle;
  }
  constexpr double kTooShort = 1e-6;  // For a direction: they are opposite.
  if (across.norm() < kTooShort) across = n->unitOrthogonal();
  const auto [sin, cos] = CalcSinCos(max_angle);
  *n = (cos * *n + sin * across.normalized()).normalized();
  return max_angle;
}

double ClampStep(double way, double max_step) {
  return std::clamp(way, -max_step, max_step);
}

}  // namespace

ModelMediatedHapticHalf::ModelMediatedHapticHalf(const HapticHalfParams& shared,
                                                 const ModelMediatedParams& own)
    : params_((own.Validate(), own)),
      map_(shared.proxy.map),
      monitor_(shared.proxy.link),
      sender_(shared.sender),
      max_step_(own.surface_speed * shared.proxy.period),
      max_force_step_(own.force_rate * shared.proxy.period / own.force_scale),
      damping_(own.device_damping /
               (own.force_scale * shared.proxy.map.scale)) {}

ModelMediatedHapticHalfState ModelMediatedHapticHalf::MakeState() const {
  return {.link = monitor_.MakeState(), .sender = sender_.MakeState()};
}

void ModelMediatedHapticHalf::MoveSurface(const Vector3d& x_d,
                                          State* state) const noexcept {
  const ModelMediatedSurfaceMessage& goal = state->goal;
  ModelMediatedSurface& surface = state->surface;
  const double depth = CalcDepth(surface, x_d);
  double left = max_force_step_;
  if (depth == 0) {
    surface.normal = goal.normal;
    surface.stiffness = goal.stiffness;
    surface.offset = std::numeric_limits<double>::infinity();
  } else {
    const double force = surface.stiffness * depth;
    const double turned = Turn(goal.normal, left / force, &surface.normal);
    left = std::max(0.0, left - force * turned);
    const double change =
        ClampStep(goal.stiffness - surface.stiffness, left / depth);
    surface.stiffness += change;
    left = std::max(0.0, left - std::abs(change) * depth);
    surface.offset = surface.normal.dot(x_d) - depth;
  }
  const double step = std::min(max_step_, left / surface.stiffness);
  const double found = surface.normal.dot(goal.point);
  // At the hand, but for a step, there is no force.
  const double at_hand = surface.normal.dot(x_d) - step;
  surface.offset =
      depth == 0 ? std::max(found, at_hand)
                 : surface.offset + ClampStep(found - surface.offset, step);
}

void ModelMediatedHapticHalf::Update(double time, const HapticHalfInput& input,
                                     State* state) const noexcept {
  const auto message = FromMessage<ModelMediatedSurfaceMessage>(input.message);
  if (monitor_.Update(time, message, &state->link)) {
    // A robot that has forgotten its model does not take it from the hand.
    state->known = state->known || message.contact;
    if (!message.normal.isZero(0)) state->goal = message;
  }
  HapticHalfOutput& output = state->output;
  Pose proxy = map_.RobotProxy(input.X_DH.p, input.X_DH.R);
  Vector3d commanded = Vector3d::Zero();
  const bool valid = std::isfinite(time) && IsValidPose(input.X_DH) &&
                     input.device_velocity.allFinite();
  if (!valid) ++output.bad_inputs;
  if (valid && state->link.status == LinkStatus::kConnected) {
    state->fading = RateLimit(state->fading, Vector3d::Zero(), max_force_step_);
    state->force = state->fading;
    if (state->known) {
      MoveSurface(proxy.p, state);
      const Vector3d& n = state->surface.normal;
      const double depth = CalcDepth(state->surface, proxy.p);
      const double spring = state->surface.stiffness * depth;
      const double speed =
          map_.params().scale * n.dot(map_.params().R_DB.transpose() *
                                      input.device_velocity.head<3>());
      const double damping =
          std::min(1.0, spring / kWholeDamping) * damping_ * speed;
      state->force += std::max(0.0, spring + damping) * n;
      proxy.p -= depth * n;
      commanded = spring * n;
    }
  } else {
    state->known = false;
    state->surface = {};
    state->force = RateLimit(state->force, Vector3d::Zero(), max_force_step_);
    state->fading = state->force;
  }
  output.setpoint.reference_force =
      -params_.force_scale * (map_.params().R_DB * state->force);
  if (valid) output.proxy_pose = map_.HapticProxy(proxy.p, proxy.R);
  output.message = ToMessage(sender_.Update(
      time, {.pose = proxy, .force = commanded}, &state->sender));
  output.link = state->link;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
