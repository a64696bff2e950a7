// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/filter_trial_plant.h"

#include <algorithm>
#include <cmath>

#include "dual_proxy/simulation/contact_truth.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kStep = kFilterTrialStep;
constexpr double kMaxReferenceChange = 50 * kStep;  // N per control period.
constexpr double kForceDamping = 60;                // N s/m, in force space.

using Normals = Eigen::Matrix<double, 3, ContactScene::kMaxSurfaces>;
using Forces = Eigen::Matrix<double, ContactScene::kMaxSurfaces, 1>;

// Of coordinate descent over the surfaces: two at 70 deg come closer to the
// solution by 0.12 with each.
constexpr int kSweeps = 20;

constexpr double kLeastForce = 1e-3;  // N: less is no contact.

// Of the tool that is always in balance. It is stable while
// stiffness * kBalanceStep / kBalanceDamping is less than 1.2: two surfaces
// give along a direction in which one is stuck and the other is pressed.
constexpr int kBalanceSteps = 8;
constexpr double kBalanceStep = kStep / kBalanceSteps;
constexpr double kBalanceDamping = 8;    // N s/m
constexpr double kStuckStiffness = 0.7;  // Across the normal, over along it.
constexpr double kSlipSpeed = 0.05;      // m/s: takes stiction away.

/** What `count` normal forces (N) come to, without friction. */
SceneContact MakeContact(const Normals& normals, const Forces& forces,
                         int count) {
  SceneContact contact;
  ContactTruth truth;
  for (int i = 0; i < count; ++i) {
    if (!(forces(i) > kLeastForce)) continue;
    contact.normals.col(contact.count) = normals.col(i);
    contact.normal_forces(contact.count) = forces(i);
    ++contact.count;
    truth.Add(forces(i) * normals.col(i), normals.col(i));
  }
  contact.force = truth.force();
  contact.normal = truth.CalcNormal();
  contact.dimension = truth.dimension();
  return contact;
}

}  // namespace

FilterTrialPointRobot::FilterTrialPointRobot(const FilterTrialSetting& setting,
                                             double motion_stiffness)
    : robot_({}, setting.scene),
      state_(robot_.MakeState(setting.path.front())),
      last_goal_(setting.path.front()),
      stiffness_(motion_stiffness),
      damping_(2 * std::sqrt(motion_stiffness)) {}

FilterTrialTick FilterTrialPointRobot::Update(const Vector3d& goal,
                                              const Matrix3d& Omega_f) {
  const Matrix3d Omega_m = Matrix3d::Identity() - Omega_f;
  const Vector3d goal_velocity = (goal - last_goal_) / kStep;
  last_goal_ = goal;
  if ((Omega_f - last_Omega_f_).norm() > 1e-9) {
    const bool is_larger = Omega_f.trace() > last_Omega_f_.trace() + 0.5;
    reference_ = Omega_f * (is_larger ? state_.contact.force : reference_);
    last_Omega_f_ = Omega_f;
  }
  const Vector3d spring =
      Omega_f * (kFilterTrialStiffness * (goal - state_.position));
  const Vector3d change = spring - reference_;
  reference_ += change * std::min(1.0, kMaxReferenceChange /
                                           std::max(change.norm(), 1e-12));
  FilterTrialTick tick;
  tick.motion_force = Omega_m * (stiffness_ * (goal - state_.position) -
                                 damping_ * (state_.velocity - goal_velocity));
  tick.contact_force = reference_ - Omega_f * (kForceDamping * state_.velocity);
  robot_.Update(tick.motion_force + tick.contact_force, &state_);
  tick.velocity = state_.velocity;
  tick.sensed_force = state_.contact.force;
  tick.contact = state_.contact;
  return tick;
}

FilterTrialKinematicTool::FilterTrialKinematicTool(
    const FilterTrialSetting& setting)
    : tool_radius_(setting.scene.tool_radius), position_(setting.path.front()) {
  for (const ContactSurfaceParams& surface : setting.scene.surfaces) {
    surfaces_.emplace_back(surface);
    friction_ = surface.friction;
  }
}

Vector3d FilterTrialKinematicTool::CalcPosition(const Vector3d& goal) const {
  // The nearest place to the goal that is outside of the tangent planes at the
  // last estimate; from where the tool was, as it goes round edges.
  Vector3d position = position_;
  for (int iteration = 0; iteration < 5; ++iteration) {
    Normals normals;
    Forces offsets;  // m: of the planes from the origin, along the normals.
    for (int i = 0; i < num_surfaces(); ++i) {
      const SurfaceContact touch = CalcTouch(i, position);
      normals.col(i) = touch.normal;
      offsets(i) = touch.normal.dot(position) - touch.penetration;
    }
    position = goal;
    Forces depths = Forces::Zero();
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      for (int i = 0; i < num_surfaces(); ++i) {
        const double more =
            std::max(-depths(i), normals.col(i).dot(position) - offsets(i));
        depths(i) += more;
        position -= more * normals.col(i);
      }
    }
  }
  constexpr double kMaxStep = 1.0 * kStep;  // m
  const Vector3d step = position - position_;
  if (step.norm() <= kMaxStep) return position;
  // Over an edge, say, where the spring lets go.
  position = position_ + kMaxStep / step.norm() * step;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (int i = 0; i < num_surfaces(); ++i) {
      const SurfaceContact touch = CalcTouch(i, position);
      position -= std::max(0.0, touch.penetration) * touch.normal;
    }
  }
  return position;
}

SurfaceContact FilterTrialKinematicTool::CalcTouch(
    int surface, const Vector3d& position) const {
  return surfaces_[static_cast<std::size_t>(surface)].Calc(
      position, Vector3d::Zero(), tool_radius_);
}

SceneContact FilterTrialKinematicTool::CalcContact(const Vector3d& push) const {
  Normals normals;
  int count = 0;
  for (int i = 0; i < num_surfaces(); ++i) {
    const SurfaceContact touch = CalcTouch(i, position_ + 1e-6 * push);
    if (touch.penetration > -1e-6 && touch.normal.dot(push) > 0) {
      normals.col(count++) = touch.normal;
    }
  }
  // The normal forces, none negative, that together come closest to the push.
  Forces forces = Forces::Zero();
  Vector3d rest = push;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (int i = 0; i < count; ++i) {
      const double more = std::max(-forces(i), normals.col(i).dot(rest));
      forces(i) += more;
      rest -= more * normals.col(i);
    }
  }
  return MakeContact(normals, forces, count);
}

FilterTrialTick FilterTrialKinematicTool::Update(const Vector3d& goal) {
  FilterTrialTick tick;
  const Vector3d position = CalcPosition(goal);
  tick.velocity = (position - position_) / kStep;
  position_ = position;
  tick.contact = CalcContact(kFilterTrialStiffness * (goal - position));
  constexpr double kStictionSpeed = 0.002;  // m/s, of the surfaces.
  const Vector3d friction = friction_ * tick.contact.normal_forces.sum() *
                            tick.velocity /
                            std::max(tick.velocity.norm(), kStictionSpeed);
  // Commands as a controller that knows the truth would give them: the normal
  // forces, and what overcomes friction and a damping of 2 N s/m.
  tick.contact_force = tick.contact.force;
  tick.motion_force = friction + 2 * tick.velocity;
  tick.contact.force += friction;
  tick.sensed_force = tick.contact.force;
  return tick;
}

FilterTrialQuasiStaticTool::FilterTrialQuasiStaticTool(
    const FilterTrialSetting& setting)
    : tool_radius_(setting.scene.tool_radius),
      stiction_(setting.stiction),
      position_(setting.path.front()) {
  for (const ContactSurfaceParams& surface : setting.scene.surfaces) {
    surfaces_.push_back({ContactSurface(surface)});
  }
}

SceneContact FilterTrialQuasiStaticTool::Advance(const Vector3d& goal) {
  const Vector3d velocity =
      (kFilterTrialStiffness * (goal - position_) - force_) / kBalanceDamping;
  position_ += kBalanceStep * velocity;
  Normals normals;
  Forces forces;
  Vector3d friction = Vector3d::Zero();
  int count = 0;
  for (Touched& touched : surfaces_) {
    const ContactSurfaceParams& params = touched.surface.params();
    const SurfaceDistance distance = touched.surface.CalcDistance(position_);
    normals.col(count) = distance.normal;
    forces(count) =
        params.stiffness * std::max(0.0, tool_radius_ - distance.value);
    if (forces(count) <= kLeastForce) forces(count) = 0;
    // Across the normal it is stretched up to where friction slips.
    const double mu =
        params.friction + stiction_ * std::exp(-touched.slip / kSlipSpeed);
    const double stiffness = kStuckStiffness * params.stiffness;
    const double limit = mu * forces(count) / stiffness;
    touched.stretch += kBalanceStep * velocity;
    touched.stretch -= distance.normal.dot(touched.stretch) * distance.normal;
    const double excess = touched.stretch.norm() - limit;
    touched.slip = std::max(0.0, excess) / kBalanceStep;
    if (excess > 0) touched.stretch *= limit / (limit + excess);
    friction += stiffness * touched.stretch;
    ++count;
  }
  SceneContact contact = MakeContact(normals, forces, count);
  contact.force += friction;
  force_ = contact.force;
  return contact;
}

FilterTrialTick FilterTrialQuasiStaticTool::Update(const Vector3d& goal,
                                                   const Matrix3d& Omega_f) {
  const Vector3d start = position_;
  FilterTrialTick tick;
  for (int i = 0; i < kBalanceSteps; ++i) tick.contact = Advance(goal);
  tick.velocity = (position_ - start) / kStep;
  const Vector3d spring = kFilterTrialStiffness * (goal - position_);
  tick.contact_force = Omega_f * spring;
  tick.motion_force = spring - tick.contact_force;
  tick.sensed_force = tick.contact.force;
  return tick;
}

}  // namespace dual_proxy
