// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/simulated_arm.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "dual_proxy/common/quantise.h"
#include "dual_proxy/common/validate.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr int kMaxSteps = 1000;

static_assert(SimulatedArmParams::kMaxBalls * ContactScene::kMaxSurfaces <=
              kMaxPointContacts);

}  // namespace

void SimulatedArmParams::Validate() const {
  constexpr const char* kWho = "SimulatedArmParams";
  ThrowUnlessIn(kWho, "period", period, Above(0));
  ThrowUnlessIn(kWho, "time_step", time_step, Above(0));
  if (time_step < period / kMaxSteps) {
    ThrowInvalidField(kWho, "time_step", "at least period / 1000", time_step);
  }
  if (p_EBall.cols() < 1 || p_EBall.cols() > SimulatedArmParams::kMaxBalls) {
    ThrowInvalidField(kWho, "p_EBall", "1 to 4 columns",
                      static_cast<double>(p_EBall.cols()));
  }
  ThrowUnlessIn(kWho, "p_EBall", p_EBall, Finite());
  ThrowUnlessIn(kWho, "p_SE", p_SE, Finite());
  ThrowUnlessIn(kWho, "tool_mass", tool_mass, AtLeast(0));
  ThrowUnlessIn(kWho, "tool_com", tool_com, Finite());
  ThrowUnlessInertia(kWho, "tool_inertia", tool_inertia);
  ThrowUnlessIn(kWho, "joint_friction", joint_friction, AtLeast(0));
  ThrowUnlessIn(kWho, "torque_step", torque_step, AtLeast(0));
  ThrowUnlessIn(kWho, "torque_delay", torque_delay,
                Between(0, kMaxTorqueDelay));
}

template <int kJoints>
SimulatedArm<kJoints>::SimulatedArm(const Params& params,
                                    const ArmModelParams<kJoints>& arm,
                                    const ContactSceneParams& scene)
    : params_(params), model_(arm), scene_(scene) {
  params_.Validate();
  scene_.Validate();
  ThrowUnlessIn("SimulatedArmParams", "tool_mass", params_.tool_mass,
                Between(0, arm.mass(kJoints - 1)));
  for (const ContactSurfaceParams& surface : scene_.surfaces) {
    surfaces_.emplace_back(surface);
  }
  // A quotient that is whole but for rounding is whole.
  num_steps_ =
      std::max(1, static_cast<int>(std::ceil(params_.period /
                                             params_.time_step * (1 - 1e-12))));
  step_ = params_.period / num_steps_;
}

template <int kJoints>
SimulatedArmState<kJoints> SimulatedArm<kJoints>::MakeState(
    const Joints& q, const Joints& v) const {
  ThrowUnlessIn("SimulatedArm", "q", q, Finite());
  ThrowUnlessIn("SimulatedArm", "v", v, Finite());
  State state;
  state.q = q;
  state.v = v;
  CalcKinematics(&state);
  return state;
}

template <int kJoints>
void SimulatedArm<kJoints>::Update(const Joints& torque,
                                   State* state) const noexcept {
  const bool is_good = torque.allFinite();
  if (!is_good) ++state->bad_inputs;
  const Joints applied = TakeTorque(is_good ? torque : Joints::Zero(), state);
  for (int i = 0; i < num_steps_; ++i) Step(applied, state);
}

template <int kJoints>
JointVector<kJoints> SimulatedArm<kJoints>::TakeTorque(
    const Joints& torque, State* state) const noexcept {
  Joints result = Quantise(torque, params_.torque_step);
  if (params_.torque_delay > 0) {
    if (state->periods == 0) state->late.colwise() = result;
    auto oldest = state->late.col(state->periods % params_.torque_delay);
    result.swap(oldest);
  }
  ++state->periods;
  return result;
}

template <int kJoints>
void SimulatedArm<kJoints>::CalcKinematics(State* state) const noexcept {
  model_.Calc(state->q, state->v, &state->X_BE, &state->terms);
  state->v_BE = state->terms.J_BE * state->v;
}

template <int kJoints>
void SimulatedArm<kJoints>::Step(const Joints& torque,
                                 State* state) const noexcept {
  const ModelTerms<kJoints>& terms = state->terms;
  JointMatrix<kJoints> inertia = terms.mass;
  Joints drive = torque + terms.gravity - terms.bias;
  if (params_.joint_friction > 0) {
    // Linear in the velocity after the step, and so never too much.
    const Joints damping =
        params_.joint_friction / (state->v.array().abs() + kCreep);
    inertia.diagonal() += step_ * damping;
    drive -= damping.cwiseProduct(state->v);
  }
  const Eigen::LLT<JointMatrix<kJoints>> mass(inertia);
  Joints v = state->v + step_ * mass.solve(drive);
  Vector6 twist = terms.J_BE * v;

  Contacts contacts;
  const int count = FindContacts(*state, twist, &contacts);
  state->impulses.setZero();
  state->truth = {};
  Vector6 wrench = Vector6::Zero();  // Of the tool on its environment, about E.
  if (count > 0) {
    const Eigen::Matrix<double, kJoints, 6> half =
        mass.matrixL().solve(terms.J_BE.transpose());
    SolveContacts(step_, half.transpose() * half,
                  std::span(contacts.points).first(count), &twist);
    for (int i = 0; i < count; ++i) {
      const PointContact& contact = contacts.points[i];
      const Vector3d force = contact.impulse / step_;
      wrench.head<3>() += force;
      wrench.tail<3>() += contact.p.cross(force);
      state->impulses.col(contacts.pairs[i]) = contact.impulse;
      state->truth.Add(force, contact.normal, state->X_BE.p + contact.p);
    }
    v -= step_ * mass.solve(terms.J_BE.transpose() * wrench);
  }

  const Joints acceleration = (v - state->v) / step_;
  state->reaction =
      CalcReaction(*state, terms.J_BE * acceleration + terms.Jdot_v, wrench);
  state->v = v;
  state->q += step_ * v;
  CalcKinematics(state);
}

template <int kJoints>
int SimulatedArm<kJoints>::FindContacts(const State& state,
                                        const Vector6& twist,
                                        Contacts* contacts) const noexcept {
  const int num_balls = static_cast<int>(params_.p_EBall.cols());
  int count = 0;
  int pair = 0;
  for (int i = 0; i < num_balls; ++i) {
    const Vector3d p_EBall_B = state.X_BE.R * params_.p_EBall.col(i);
    const Vector3d p_BBall = state.X_BE.p + p_EBall_B;
    const Vector3d velocity =
        twist.head<3>() + twist.tail<3>().cross(p_EBall_B);
    for (const ContactSurface& surface : surfaces_) {
      const SurfaceDistance distance = surface.CalcDistance(p_BBall);
      const double penetration = scene_.tool_radius - distance.value;
      const double sinking = std::max(0.0, distance.normal.dot(velocity));
      if (penetration + step_ * sinking > 0) {
        // Half way between ball and surface, as if both yielded alike.
        const double reach =
            scene_.tool_radius - std::max(0.0, penetration) / 2;
        contacts->points[count] = {
            .normal = distance.normal,
            .p = p_EBall_B + reach * distance.normal,
            .penetration = penetration,
            .stiffness = surface.params().stiffness / num_balls,
            .dissipation = surface.params().dissipation,
            .friction = surface.params().friction,
            .impulse = state.impulses.col(pair)};
        contacts->pairs[count++] = pair;
      }
      ++pair;
    }
  }
  return count;
}

template <int kJoints>
Vector6 SimulatedArm<kJoints>::CalcReaction(
    const State& state, const Vector6& acceleration,
    const Vector6& wrench) const noexcept {
  // Newton and Euler for the tool.
  const Matrix3d& R_BE = state.X_BE.R;
  const Vector3d p_SE_B = R_BE * params_.p_SE;
  const Vector3d p_SCom_B = R_BE * params_.tool_com;
  const Vector3d p_ECom_B = p_SCom_B - p_SE_B;
  const Matrix3d inertia = R_BE * params_.tool_inertia * R_BE.transpose();
  const Vector3d omega = state.v_BE.template tail<3>();
  const Vector3d angular = acceleration.tail<3>();
  const Vector3d com_force =
      params_.tool_mass *
      (acceleration.head<3>() + angular.cross(p_ECom_B) +
       omega.cross(omega.cross(p_ECom_B)) - model_.params().gravity);
  const Vector3d com_moment = inertia * angular + omega.cross(inertia * omega);
  const Vector3d force = com_force + wrench.head<3>();
  const Vector3d moment = com_moment + p_SCom_B.cross(com_force) +
                          wrench.tail<3>() + p_SE_B.cross(wrench.head<3>());
  Vector6 reaction;
  reaction << R_BE.transpose() * force, R_BE.transpose() * moment;
  return reaction;
}

template class SimulatedArm<6>;
template class SimulatedArm<7>;

}  // namespace dual_proxy
