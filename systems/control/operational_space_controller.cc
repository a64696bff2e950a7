// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/operational_space_controller.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "dual_proxy/link/message.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;

template <int kJoints>
ForceLoopParams MakeForceLoopParams(
    const OperationalSpaceControllerParams<kJoints>& params) {
  ForceLoopParams loop{.gain = params.force_gain,
                       .integral_gain = params.force_integral_gain,
                       .damping = params.force_damping,
                       .max_proportional_force = params.max_proportional_force,
                       .max_integral_force = params.max_integral_force,
                       .integral_delay = params.force_integral_delay,
                       .speed_limit = params.force_speed_limit,
                       .filter_cutoff = params.force_filter_cutoff,
                       .release_time = params.selection_blend_time,
                       .passivity = params.force_passivity,
                       .period = params.period};
  loop.passivity.enabled = params.passivity;
  return loop;
}

namespace {

// s: in which joints slow down when there is nothing to go by.
constexpr double kBrakeTime = 0.05;

template <int kJoints>
ForceLoopParams MakeMomentLoopParams(
    const OperationalSpaceControllerParams<kJoints>& params) {
  ForceLoopParams loop{.gain = params.moment_gain,
                       .integral_gain = params.moment_integral_gain,
                       .damping = params.moment_damping,
                       .max_proportional_force = params.max_proportional_moment,
                       .max_integral_force = params.max_integral_moment,
                       .integral_delay = params.force_integral_delay,
                       .speed_limit = params.moment_speed_limit,
                       .filter_cutoff = params.force_filter_cutoff,
                       .release_time = params.selection_blend_time,
                       .passivity = params.moment_passivity,
                       .period = params.period};
  loop.passivity.enabled = params.passivity;
  return loop;
}

// Of the motion law in use; of operational space for a unit mass.
template <int kJoints>
CartesianImpedanceParams MakeGains(
    const OperationalSpaceControllerParams<kJoints>& params) {
  if (params.motion == MotionLaw::kCartesianImpedance) return params.impedance;
  return {.stiffness = params.position_stiffness,
          .damping = params.position_damping,
          .rotational_stiffness = params.rotation_stiffness,
          .rotational_damping = params.rotation_damping};
}

// The lower triangle of A becomes its Cholesky factor; false if A is not
// positive definite. These two are plain loops, as Eigen's are made for large
// matrices.
template <int n>
bool FactorInPlace(Eigen::Matrix<double, n, n>* A) {
  for (int j = 0; j < n; ++j) {
    double pivot = (*A)(j, j);
    for (int k = 0; k < j; ++k) pivot -= (*A)(j, k) * (*A)(j, k);
    if (!(pivot > 0)) return false;
    const double root = std::sqrt(pivot);
    (*A)(j, j) = root;
    for (int i = j + 1; i < n; ++i) {
      double sum = (*A)(i, j);
      for (int k = 0; k < j; ++k) sum -= (*A)(i, k) * (*A)(j, k);
      (*A)(i, j) = sum / root;
    }
  }
  return true;
}

// X becomes L^-1 X, with the lower triangle of L; below, L^-T X.
template <int n, int m>
void SolveLowerInPlace(const Eigen::Matrix<double, n, n>& L,
                       Eigen::Matrix<double, n, m>* X) {
  for (int i = 0; i < n; ++i) {
    const double scale = 1 / L(i, i);
    for (int j = 0; j < i; ++j) X->row(i) -= L(i, j) * X->row(j);
    X->row(i) *= scale;
  }
}

template <int n>
void SolveLowerTransposedInPlace(const Eigen::Matrix<double, n, n>& L,
                                 Eigen::Matrix<double, n, 1>* x) {
  for (int i = n - 1; i >= 0; --i) {
    for (int j = i + 1; j < n; ++j) (*x)(i) -= L(j, i) * (*x)(j);
    (*x)(i) /= L(i, i);
  }
}

/** The change of the joints' accelerations that is `change` in the limited
joints and leaves the tool to its task as far as the others can make up for it:
its place before its orientation. Of all such changes the one of the least
kinetic energy. @param L Cholesky factor of the mass matrix. */
template <int kJoints>
JointVector<kJoints> CalcCorrection(
    const JointMatrix<kJoints>& L, const Jacobian<kJoints>& J_BE,
    const std::array<bool, kJoints>& is_limited,
    const JointVector<kJoints>& change) noexcept {
  constexpr int kRows = kJoints + 6;
  // 1/kg and 1/(kg m^2): how soft a demand is, beside the tool's mobility.
  constexpr double kPlace = 1e-3;
  constexpr double kOrientation = 1;
  // Rows that are to be zero or `change`; a row of zeros asks for nothing.
  using Rows = Eigen::Matrix<double, kRows, 1>;
  Eigen::Matrix<double, kRows, kJoints> C =
      Eigen::Matrix<double, kRows, kJoints>::Zero();
  Rows wanted = Rows::Zero();
  for (int i = 0; i < kJoints; ++i) {
    if (!is_limited[i]) continue;
    C(i, i) = 1;
    wanted(i) = change(i);
  }
  C.template bottomRows<6>() = J_BE;
  Eigen::Matrix<double, kJoints, kRows> X = C.transpose();
  SolveLowerInPlace(L, &X);
  Eigen::Matrix<double, kRows, kRows> S = X.transpose().lazyProduct(X);
  for (int i = 0; i < kJoints; ++i) S(i, i) += is_limited[i] ? 1e-9 : 1;
  for (int i = kJoints; i < kJoints + 3; ++i) S(i, i) += kPlace;
  for (int i = kJoints + 3; i < kRows; ++i) S(i, i) += kOrientation;
  if (!FactorInPlace(&S)) return JointVector<kJoints>::Zero();
  Rows y = wanted;
  SolveLowerInPlace(S, &y);
  SolveLowerTransposedInPlace(S, &y);
  JointVector<kJoints> correction = X.lazyProduct(y);
  SolveLowerTransposedInPlace(L, &correction);
  return correction;
}

template <int kJoints>
bool IsFinite(const ModelTerms<kJoints>& model) {
  return model.J_BE.allFinite() && model.mass.allFinite() &&
         model.bias.allFinite() && model.gravity.allFinite() &&
         model.Jdot_v.allFinite();
}

template <int kJoints>
bool IsValid(const OperationalSpaceControllerInput<kJoints>& input) {
  return input.q.allFinite() && input.v.allFinite() &&
         input.motion_error.allFinite() && input.rotation_error.allFinite() &&
         input.proxy_velocity.allFinite() &&
         input.proxy_acceleration.allFinite() &&
         input.reference_force.allFinite() &&
         input.reference_moment.allFinite() &&
         input.sensed_wrench.allFinite() &&
         IsSelection(input.force_selection) &&
         IsSelection(input.moment_selection);
}

}  // namespace

template <int kJoints>
void OperationalSpaceControllerParams<kJoints>::Validate() const {
  ValidateFields("OperationalSpaceControllerParams", *this);
}

template <int kJoints>
OperationalSpaceInertia CalcOperationalSpaceInertia(
    const Jacobian<kJoints>& J_BE, const JointMatrix<kJoints>& mass,
    double max_mass, double length) noexcept {
  OperationalSpaceInertia result;
  JointMatrix<kJoints> L_mass = mass;
  if (!FactorInPlace(&L_mass)) return result;
  result.valid = true;

  // Scaled so that all eigenvalues are 1/kg. X^T X with X = L^-1 J^T is exactly
  // symmetric.
  Vector6 scale;
  scale << 1, 1, 1, length, length, length;
  Eigen::Matrix<double, kJoints, 6> X = J_BE.transpose() * scale.asDiagonal();
  SolveLowerInPlace(L_mass, &X);
  const Matrix6 mobility = X.transpose().lazyProduct(X);

  const double smallest = 1 / max_mass;
  Matrix6 margin = mobility - smallest * Matrix6::Identity();
  Matrix6 scaled;
  if (FactorInPlace(&margin)) {
    Matrix6 L = mobility;
    FactorInPlace(&L);
    Matrix6 L_inverse = Matrix6::Identity();
    SolveLowerInPlace(L, &L_inverse);
    scaled = L_inverse.transpose().lazyProduct(L_inverse);
  } else {
    result.singular = true;
    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(mobility);
    Vector6 masses;
    for (int i = 0; i < 6; ++i) {
      const double mu = std::max(0.0, eigen.eigenvalues()(i));
      const double r = mu * max_mass;
      masses(i) = r >= 1 ? 1 / mu : max_mass * (3 * r - 2 * r * r);
    }
    scaled = eigen.eigenvectors() * masses.asDiagonal() *
             eigen.eigenvectors().transpose();
  }
  result.Lambda = scale.asDiagonal() * scaled * scale.asDiagonal();
  return result;
}

template <int kJoints>
OperationalSpaceController<kJoints>::OperationalSpaceController(Params params)
    : params_((params.Validate(), params)),
      gains_(MakeGains(params)),
      force_loop_(MakeForceLoopParams(params)),
      moment_loop_(MakeMomentLoopParams(params)),
      friction_(params.friction_feedback, params.period),
      blend_(
          {.blend_time = params.selection_blend_time, .period = params.period}),
      joint_limits_(params.joint_limits) {}

template <int kJoints>
OperationalSpaceControllerState<kJoints>
OperationalSpaceController<kJoints>::MakeState() const noexcept {
  State state;
  state.force = force_loop_.MakeState();
  state.moment = moment_loop_.MakeState();
  return state;
}

template <int kJoints>
JointVector<kJoints> OperationalSpaceController<kJoints>::CalcLimiting(
    const Input& input, const Joints& net, State* state) const noexcept {
  if (!joint_limits_.IsNear(input.q, input.v)) return Joints::Zero();
  JointMatrix<kJoints> L = input.model.mass;
  if (!FactorInPlace(&L)) return Joints::Zero();
  Joints asked = net;
  SolveLowerInPlace(L, &asked);
  SolveLowerTransposedInPlace(L, &asked);

  const Joints change = joint_limits_.Limit(input.q, input.v, asked) - asked;
  // Joints are added until none of the others has to be limited, too.
  std::array<bool, kJoints> is_limited{};
  Joints acceleration = asked;
  Joints correction = Joints::Zero();
  for (int count = 0; count < kJoints;) {
    const Joints allowed = joint_limits_.Limit(input.q, input.v, acceleration);
    const int before = count;
    for (int i = 0; i < kJoints; ++i) {
      if (is_limited[i] || allowed(i) == acceleration(i)) continue;
      is_limited[i] = true;
      ++count;
    }
    if (count == before) break;
    correction =
        CalcCorrection<kJoints>(L, input.model.J_BE, is_limited, change);
    acceleration = asked + correction;
  }
  if (correction.isZero(0)) return Joints::Zero();
  ++state->joint_limited;
  return input.model.mass * correction;
}

template <int kJoints>
JointVector<kJoints> OperationalSpaceController<kJoints>::CalcHolding(
    const Joints& gravity) const noexcept {
  if (params_.gravity_compensation) return -gravity;
  return Joints::Zero();
}

template <int kJoints>
JointVector<kJoints> OperationalSpaceController<kJoints>::Send(
    const Joints& torque, const Input& input, State* state) const noexcept {
  const double usable = 1 - params_.torque_margin;
  const Joints limit = usable * params_.torque_limit;
  const Joints limited = torque.cwiseMax(-limit).cwiseMin(limit);
  if (limited != torque) ++state->torque_limited;
  if (!state->initialized) {
    state->initialized = true;
    state->torque =
        CalcHolding(state->gravity).cwiseMax(-limit).cwiseMin(limit);
  }
  if (input.received_torque && input.received_torque->allFinite()) {
    state->torque = input.received_torque->cwiseMax(-limit).cwiseMin(limit);
  }
  const Joints step =
      Joints::Constant(usable * params_.torque_rate_limit * params_.period);
  const Joints sent =
      limited.cwiseMax(state->torque - step).cwiseMin(state->torque + step);
  if (sent != limited) ++state->rate_limited;
  state->torque = sent;
  return sent;
}

template <int kJoints>
OperationalSpaceControllerOutput<kJoints>
OperationalSpaceController<kJoints>::Refuse(const Input& input,
                                            State* state) const noexcept {
  ++state->bad_inputs;
  Output output;
  output.torque = state->torque;
  // Once there was a model.
  if (!state->mass.isZero(0)) {
    Joints torque = CalcHolding(state->gravity);
    if (input.v.allFinite()) torque -= state->mass * input.v / kBrakeTime;
    output.torque = Send(torque, input, state);
  }
  output.observed_energy = state->force.passivity.energy;
  output.observed_moment_energy = state->moment.passivity.energy;
  return output;
}

template <int kJoints>
OperationalSpaceControllerOutput<kJoints>
OperationalSpaceController<kJoints>::Update(const Input& input,
                                            State* state) const noexcept {
  const ModelTerms<kJoints>& model = input.model;
  if (!IsFinite(model)) return Refuse(input, state);
  const OperationalSpaceInertia inertia = CalcOperationalSpaceInertia(
      model.J_BE, model.mass, params_.max_mass, params_.characteristic_length);
  if (!inertia.valid) return Refuse(input, state);
  state->mass = model.mass;
  state->gravity = model.gravity;
  if (!IsValid(input)) return Refuse(input, state);
  if (inertia.singular) ++state->singular;
  const Matrix6& Lambda = inertia.Lambda;

  const Vector6 twist = model.J_BE * input.v;
  const Vector3d v_BE = twist.head<3>();
  const Vector3d w_BE = twist.tail<3>();
  // Without a sensor that is ready no loop is closed: there is no force space,
  // and no error of force.
  const bool ready = input.sensor_ready || !input.force_feedback;
  const Matrix3d none = Matrix3d::Zero();
  const Matrix3d& asked_f = ready ? input.force_selection : none;
  const Matrix3d& asked_tau = ready ? input.moment_selection : none;
  Vector6 sensed = input.sensed_wrench;
  if (!input.sensor_ready)
    sensed << input.reference_force, input.reference_moment;
  const Matrix3d& Omega_f = blend_.Update(asked_f, &state->force_selection);
  const Matrix3d& Omega_tau =
      blend_.Update(asked_tau, &state->moment_selection);

  // Motion: what accelerates a unit mass, eq. (12), and what is a force.
  Vector6 velocity_error = twist;
  Vector6 acceleration = Vector6::Zero();
  if (params_.feed_forward) {
    velocity_error -= input.proxy_velocity;
    if (params_.acceleration_feed_forward) {
      acceleration = input.proxy_acceleration;
    }
  }
  Vector6 spring_wrench = Vector6::Zero();
  const bool impedance = params_.motion == MotionLaw::kCartesianImpedance;
  Vector6& pulled = impedance ? spring_wrench : acceleration;
  pulled.head<3>() -=
      SaturateUnlessZero(gains_.stiffness * input.motion_error,
                         gains_.damping * params_.motion_speed_limit) +
      gains_.damping * velocity_error.head<3>();
  pulled.tail<3>() -=
      SaturateUnlessZero(
          gains_.rotational_stiffness * input.rotation_error,
          gains_.rotational_damping * params_.rotation_speed_limit) +
      gains_.rotational_damping * velocity_error.tail<3>();
  for (Vector6* command : {&acceleration, &spring_wrench}) {
    command->head<3>() -= Omega_f * command->head<3>().eval();
    command->tail<3>() -= Omega_tau * command->tail<3>().eval();
  }

  // Force: eq. (13).
  Output output;
  if (input.force_feedback) {
    output.contact_force =
        force_loop_.Update(input.reference_force, sensed.head<3>(), v_BE,
                           asked_f, Omega_f, &state->force);
    output.contact_moment =
        moment_loop_.Update(input.reference_moment, sensed.tail<3>(), w_BE,
                            asked_tau, Omega_tau, &state->moment);
  } else {
    output.contact_force = Omega_f * input.reference_force;
    output.contact_moment = Omega_tau * input.reference_moment;
  }
  Vector6 contact_wrench;
  contact_wrench << output.contact_force, output.contact_moment;
  if (input.force_feedback && input.sensor_ready) {
    contact_wrench.head<3>() +=
        friction_.Update(sensed.head<3>(), v_BE, Omega_f, &state->friction);
  }

  // Torque: eq. (14) to (17).
  Joints posture = params_.posture_stiffness * (params_.q_rest - input.q);
  const double pull = params_.posture_damping * params_.posture_speed_limit;
  if (pull > 0) {
    posture = posture.cwiseMax(-pull).cwiseMin(pull).eval();
  }
  posture -= params_.posture_damping * input.v;
  const Vector6 wrench =
      Lambda * (acceleration - model.Jdot_v - model.J_BE * posture) +
      spring_wrench + contact_wrench;
  const Joints net = model.J_BE.transpose() * wrench + model.mass * posture;
  const Joints torque = net + model.bias + CalcHolding(model.gravity) +
                        CalcLimiting(input, net, state);
  if (!torque.allFinite()) return Refuse(input, state);
  output.torque = Send(torque, input, state);

  const Vector6 motion_wrench = Lambda * acceleration + spring_wrench;
  const bool unit_mass = params_.unit_mass_motion_force && !impedance;
  const bool unit_inertia = params_.unit_inertia_motion_moment && !impedance;
  output.motion_force = (unit_mass ? acceleration : motion_wrench).head<3>();
  output.motion_moment =
      (unit_inertia ? acceleration : motion_wrench).tail<3>();
  output.observed_energy = state->force.passivity.energy;
  output.injected_damping = state->force.passivity.damping;
  output.observed_moment_energy = state->moment.passivity.energy;
  output.injected_moment_damping = state->moment.passivity.damping;
  return output;
}

template struct OperationalSpaceControllerParams<6>;
template struct OperationalSpaceControllerParams<7>;
template class OperationalSpaceController<6>;
template class OperationalSpaceController<7>;
template ForceLoopParams MakeForceLoopParams(
    const OperationalSpaceControllerParams<6>&);
template ForceLoopParams MakeForceLoopParams(
    const OperationalSpaceControllerParams<7>&);
template OperationalSpaceInertia CalcOperationalSpaceInertia(
    const Jacobian<6>&, const JointMatrix<6>&, double, double) noexcept;
template OperationalSpaceInertia CalcOperationalSpaceInertia(
    const Jacobian<7>&, const JointMatrix<7>&, double, double) noexcept;

}  // namespace dual_proxy
