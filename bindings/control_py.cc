// SPDX-License-Identifier: BSD-3-Clause
#include <array>

#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/control/force_loop.h"
#include "dual_proxy/control/haptic_controller.h"
#include "dual_proxy/control/inverse_kinematics.h"
#include "dual_proxy/control/operational_space_controller.h"
#include "dual_proxy/control/passivity_controller.h"
#include "dual_proxy/control/point_controller.h"
#include "dual_proxy/control/selection_blend.h"
#include "params.h"

namespace dual_proxy {

namespace {

// Arrays and messages are handed out as copies: the state goes on changing.
constexpr auto kCopy = py::return_value_policy::copy;

Vector6 Vec6(const py::handle& value, const char* name) {
  return AsFixed<Vector6>(value, name);
}

Vector7 Vec7(const py::handle& value, const char* name) {
  return AsFixed<Vector7>(value, name);
}

void BindPassivity(py::module_& m) {
  using P = TimeDomainPassivityParams;
  BindParams<P>(m, "TimeDomainPassivityParams",
                "Parameters of TimeDomainPassivity; for moments N m s/rad "
                "instead of N s/m.")
      .Fields();
  BindState<TimeDomainPassivityState>(m, "TimeDomainPassivityState",
                                      "Memory of TimeDomainPassivity.")
      .def_readonly("energy", &TimeDomainPassivityState::energy, "J")
      .def_readonly("damping", &TimeDomainPassivityState::damping,
                    "N s/m, injected last")
      .def_readonly("dissipated", &TimeDomainPassivityState::dissipated,
                    "J, by injection");
  BoundClass<TimeDomainPassivity>(
      m, "TimeDomainPassivity",
      "Time-domain passivity observer and controller of a force port.")
      .def_constructor<P>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<TimeDomainPassivity>)
      .def("make_state", &TimeDomainPassivity::MakeState)
      .def(
          "update",
          [](const TimeDomainPassivity& self, const py::object& feedback_force,
             const py::object& velocity, const py::object& force_selection,
             TimeDomainPassivityState& state) {
            return self.Update(Vec3(feedback_force, "feedback_force"),
                               Vec3(velocity, "velocity"),
                               Mat3(force_selection, "force_selection"),
                               &state);
          },
          py::arg("feedback_force"), py::arg("velocity"),
          py::arg("force_selection"), py::arg("state"),
          "Advances `state` by one period. Takes F_f - F_r without injection "
          "(3,), N; v_BE (3,), m/s; Omega_f (3, 3); in B.\n"
          "Returns the force to inject, (3,), N.");
}

void BindSelectionBlend(py::module_& m) {
  using P = SelectionBlendParams;
  BindParams<P>(m, "SelectionBlendParams", "Parameters of SelectionBlend.")
      .Fields();
  BindState<SelectionBlendState>(m, "SelectionBlendState",
                                 "Memory of SelectionBlend.")
      .def_readonly("blended", &SelectionBlendState::blended, kCopy,
                    "(3, 3): what is in force now")
      .def_readonly("progress", &SelectionBlendState::progress,
                    "0 at a change, 1 when it is complete");
  BoundClass<SelectionBlend>(
      m, "SelectionBlend",
      "Replaces the switch of a selection matrix by a linear blend.")
      .def_constructor<P>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<SelectionBlend>)
      .def("make_state", &SelectionBlend::MakeState)
      .def(
          "update",
          [](const SelectionBlend& self, const py::object& selection,
             SelectionBlendState& state) {
            return Eigen::Matrix3d(
                self.Update(Mat3(selection, "selection"), &state));
          },
          py::arg("selection"), py::arg("state"),
          "Advances `state` by one period. Takes a projection (3, 3), returns "
          "the blend (3, 3).");
}

void BindJointLimits(py::module_& m) {
  using P = JointLimitsParams<7>;
  BindParams<P>(m, "JointLimitsParams",
                "Parameters of JointLimits; the defaults are the Panda's.")
      .Fields();
  BoundClass<JointLimits<7>>(
      m, "JointLimits",
      "Keeps joints within their ends and speeds by damping that sets in "
      "before them.")
      .def_constructor<P>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<JointLimits<7>>)
      .def(
          "limit",
          [](const JointLimits<7>& self, const py::object& q,
             const py::object& v, const py::object& acceleration) {
            return self.Limit(AsFixed<Vector7>(q, "q"),
                              AsFixed<Vector7>(v, "v"),
                              AsFixed<Vector7>(acceleration, "acceleration"));
          },
          py::arg("q"), py::arg("v"), py::arg("acceleration"),
          "What of a joint acceleration (7,), rad/s^2, is let through at q "
          "(7,), rad, and v (7,), rad/s.");
}

void BindFrictionFeedback(py::module_& m) {
  BindParams<FrictionFeedbackParams>(
      m, "FrictionFeedbackParams",
      "What of the friction on a tool that slides is fed forward.")
      .Fields();
}

void BindForceLoop(py::module_& m) {
  using P = ForceLoopParams;
  BindParams<P>(m, "ForceLoopParams",
                "Parameters of ForceLoop; for moments N m and N m s/rad.")
      .Fields();
  BindState<ForceLoopState>(m, "ForceLoopState", "Memory of ForceLoop.")
      .def_readonly("sensed", &ForceLoopState::sensed, kCopy,
                    "(3,), N, filtered F_s")
      .def_readonly("integral", &ForceLoopState::integral, kCopy, "(3,), N s")
      .def_readonly("released", &ForceLoopState::released, kCopy,
                    "(3,), N, fading")
      .def_readonly("passivity", &ForceLoopState::passivity);
  BoundClass<ForceLoop>(m, "ForceLoop",
                        "Force loop of eq. (13) with passivity controller.")
      .def_constructor<P>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<ForceLoop>)
      .def("make_state", &ForceLoop::MakeState)
      .def(
          "update",
          [](const ForceLoop& self, const py::object& reference,
             const py::object& sensed, const py::object& velocity,
             const py::object& selection, const py::object& blended,
             ForceLoopState& state) {
            return self.Update(
                Vec3(reference, "reference"), Vec3(sensed, "sensed"),
                Vec3(velocity, "velocity"), Mat3(selection, "selection"),
                Mat3(blended, "blended"), &state);
          },
          py::arg("reference"), py::arg("sensed"), py::arg("velocity"),
          py::arg("selection"), py::arg("blended"), py::arg("state"),
          "Advances `state` by one period. Takes F_r, F_s (3,), N; v_BE (3,), "
          "m/s; Omega_f and its blend (3, 3); in B.\nReturns F_f, (3,), N.");
}

void BindOperationalSpaceController(py::module_& m) {
  BindParams<CartesianImpedanceParams>(
      m, "CartesianImpedanceParams",
      "Gains of OperationalSpaceControllerParams.motion "
      "\"cartesian_impedance\".")
      .Fields();
  using P = OperationalSpaceControllerParams<7>;
  BindParams<P>(m, "OperationalSpaceControllerParams",
                "Parameters of OperationalSpaceController.")
      .Fields();

  using O = OperationalSpaceControllerOutput<7>;
  BindState<O>(m, "OperationalSpaceControllerOutput",
               "Results of one cycle, in B.")
      .def_readonly("torque", &O::torque, kCopy,
                    "(7,), N m, gravity compensated")
      .def_readonly("motion_force", &O::motion_force, kCopy, "(3,), N")
      .def_readonly("motion_moment", &O::motion_moment, kCopy, "(3,), N m")
      .def_readonly("contact_force", &O::contact_force, kCopy, "F_f, (3,), N")
      .def_readonly("contact_moment", &O::contact_moment, kCopy,
                    "M_f, (3,), N m")
      .def_readonly("observed_energy", &O::observed_energy, "J, force loop")
      .def_readonly("injected_damping", &O::injected_damping,
                    "N s/m, force loop")
      .def_readonly("observed_moment_energy", &O::observed_moment_energy,
                    "J, moment loop")
      .def_readonly("injected_moment_damping", &O::injected_moment_damping,
                    "N m s/rad, moment loop");

  using S = OperationalSpaceControllerState<7>;
  BindState<S>(m, "OperationalSpaceControllerState",
               "Memory of OperationalSpaceController.")
      .def_readonly("force_selection", &S::force_selection)
      .def_readonly("moment_selection", &S::moment_selection)
      .def_readonly("force", &S::force)
      .def_readonly("moment", &S::moment)
      .def_readonly("torque", &S::torque, kCopy, "(7,), N m, sent last")
      .def_readonly("bad_inputs", &S::bad_inputs, "cycles refused")
      .def_readonly("singular", &S::singular,
                    "cycles in which Lambda was bounded")
      .def_readonly("joint_limited", &S::joint_limited,
                    "cycles in which joint_limits acted")
      .def_readonly("torque_limited", &S::torque_limited,
                    "cycles in which torque_limit acted")
      .def_readonly("rate_limited", &S::rate_limited,
                    "cycles in which torque_rate_limit acted");

  BoundClass<OperationalSpaceController<7>>(
      m, "OperationalSpaceController",
      "Unified force/motion control in operational space, eq. (10) to (17).")
      .def_constructor<P>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<OperationalSpaceController<7>>)
      .def("make_state", &OperationalSpaceController<7>::MakeState)
      .def(
          "update",
          [](const OperationalSpaceController<7>& self,
             const py::object& jacobian, const py::object& mass,
             const py::object& bias, const py::object& gravity,
             const py::object& jdot_v, const py::object& q, const py::object& v,
             const py::object& motion_error, const py::object& rotation_error,
             const py::object& proxy_velocity,
             const py::object& proxy_acceleration,
             const py::object& reference_force,
             const py::object& reference_moment,
             const py::object& force_selection,
             const py::object& moment_selection,
             const py::object& sensed_wrench, S& state, bool sensor_ready) {
            return self.Update(
                {.model = {.J_BE = AsFixed<Matrix67>(jacobian, "jacobian"),
                           .mass = AsFixed<Matrix7>(mass, "mass"),
                           .bias = Vec7(bias, "bias"),
                           .gravity = Vec7(gravity, "gravity"),
                           .Jdot_v = Vec6(jdot_v, "jdot_v")},
                 .q = Vec7(q, "q"),
                 .v = Vec7(v, "v"),
                 .motion_error = Vec3(motion_error, "motion_error"),
                 .rotation_error = Vec3(rotation_error, "rotation_error"),
                 .proxy_velocity = Vec6(proxy_velocity, "proxy_velocity"),
                 .proxy_acceleration =
                     Vec6(proxy_acceleration, "proxy_acceleration"),
                 .reference_force = Vec3(reference_force, "reference_force"),
                 .reference_moment = Vec3(reference_moment, "reference_moment"),
                 .force_selection = Mat3(force_selection, "force_selection"),
                 .moment_selection = Mat3(moment_selection, "moment_selection"),
                 .sensed_wrench = Vec6(sensed_wrench, "sensed_wrench"),
                 .sensor_ready = sensor_ready},
                &state);
          },
          py::arg("jacobian"), py::arg("mass"), py::arg("bias"),
          py::arg("gravity"), py::arg("jdot_v"), py::arg("q"), py::arg("v"),
          py::arg("motion_error"), py::arg("rotation_error"),
          py::arg("proxy_velocity"), py::arg("proxy_acceleration"),
          py::arg("reference_force"), py::arg("reference_moment"),
          py::arg("force_selection"), py::arg("moment_selection"),
          py::arg("sensed_wrench"), py::arg("state"),
          py::arg("sensor_ready") = true,
          "Advances `state` by one period. Six-vectors are [linear; angular] "
          "or [force; moment], in B; jacobian (6, 7), mass (7, 7), bias "
          "(7,) without gravity, gravity (7,) as Drake's "
          "CalcGravityGeneralizedForces. Unless `sensor_ready` nothing is "
          "force-controlled.\n"
          "Returns an OperationalSpaceControllerOutput.");

  Def(
      &m, "calc_operational_space_inertia",
      [](const py::object& jacobian, const py::object& mass, double max_mass,
         double length) {
        const OperationalSpaceInertia inertia = CalcOperationalSpaceInertia<7>(
            AsFixed<Matrix67>(jacobian, "jacobian"),
            AsFixed<Matrix7>(mass, "mass"), max_mass, length);
        if (!inertia.valid) {
          throw py::value_error("mass: expected a positive definite matrix");
        }
        return py::make_tuple(inertia.Lambda, inertia.singular);
      },
      py::arg("jacobian"), py::arg("mass"), py::arg("max_mass") = P{}.max_mass,
      py::arg("length") = P{}.characteristic_length,
      "Returns (Lambda, singular): (J A^-1 J^T)^-1 bounded, (6, 6), in B, and "
      "whether the bound acted.");
}

using Matrix3dPerJoint = std::array<Eigen::Matrix3d, 7>;

Matrix3dPerJoint AsMatrixPerJoint(const py::handle& value, const char* name) {
  const char* expected = "(7, 3, 3)";
  const auto array = AsArray(value, name, expected);
  if (array.ndim() != 3 || array.shape(0) != 7 || array.shape(1) != 3 ||
      array.shape(2) != 3) {
    ThrowShape(name, expected, array);
  }
  const auto view = array.unchecked<3>();
  Matrix3dPerJoint result;
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) result[i](j, k) = view(i, j, k);
    }
  }
  return result;
}

// As BindParams::Field() does for one matrix.
void MatrixPerJointField(BindParams<ArmModelParams<7>>* params,
                         const char* name,
                         Matrix3dPerJoint ArmModelParams<7>::* member,
                         const char* doc) {
  params->ArrayField(
      name,
      [member](const ArmModelParams<7>& self) {
        py::array_t<double> array({7, 3, 3});
        auto view = array.mutable_unchecked<3>();
        for (int i = 0; i < 7; ++i) {
          for (int j = 0; j < 3; ++j) {
            for (int k = 0; k < 3; ++k) view(i, j, k) = (self.*member)[i](j, k);
          }
        }
        return ReadOnly(array);
      },
      [member, name](ArmModelParams<7>* self, const py::object& value) {
        self->*member = AsMatrixPerJoint(value, name);
      },
      doc);
}

void BindPointController(py::module_& m) {
  using P = PointControllerParams;
  BindParams<P>(m, "PointControllerParams",
                "Parameters of PointController; the gains are the paper's for "
                "its point robot (V.C).")
      .Fields();

  using O = PointControllerOutput;
  BindState<O>(m, "PointControllerOutput", "Results of one cycle, in B.")
      .def_readonly("force", &O::force, kCopy, "(3,), N: what pushes the mass")
      .def_readonly("motion_force", &O::motion_force, kCopy,
                    "command in motion space, (3,): m/s^2 = N for 1 kg, or F_m "
                    "in N")
      .def_readonly("contact_force", &O::contact_force, kCopy, "F_f, (3,), N")
      .def_readonly("observed_energy", &O::observed_energy, "J")
      .def_readonly("injected_damping", &O::injected_damping, "N s/m");

  using S = PointControllerState;
  BindState<S>(m, "PointControllerState", "Memory of PointController.")
      .def_readonly("bad_inputs", &S::bad_inputs, "cycles refused")
      .def_readonly("force_limited", &S::force_limited,
                    "cycles in which force_limit acted")
      .def_readonly("rate_limited", &S::rate_limited,
                    "cycles in which force_rate_limit acted");

  BoundClass<PointController>(
      m, "PointController",
      "Unified force/motion control of a point of mass, eq. (12) to (14).")
      .def_constructor<P>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<PointController>)
      .def("make_state", &PointController::MakeState)
      .def(
          "update",
          [](const PointController& self, double mass, const py::object& v,
             const py::object& motion_error, const py::object& proxy_velocity,
             const py::object& proxy_acceleration,
             const py::object& reference_force,
             const py::object& force_selection, const py::object& sensed_force,
             S& state, bool sensor_ready) {
            return self.Update(
                {.model = {.mass = mass},
                 .v = Vec3(v, "v"),
                 .motion_error = Vec3(motion_error, "motion_error"),
                 .proxy_velocity = Vec3(proxy_velocity, "proxy_velocity"),
                 .proxy_acceleration =
                     Vec3(proxy_acceleration, "proxy_acceleration"),
                 .reference_force = Vec3(reference_force, "reference_force"),
                 .force_selection = Mat3(force_selection, "force_selection"),
                 .sensed_force = Vec3(sensed_force, "sensed_force"),
                 .sensor_ready = sensor_ready},
                &state);
          },
          py::arg("mass"), py::arg("v"), py::arg("motion_error"),
          py::arg("proxy_velocity"), py::arg("proxy_acceleration"),
          py::arg("reference_force"), py::arg("force_selection"),
          py::arg("sensed_force"), py::arg("state"),
          py::arg("sensor_ready") = true,
          "Advances by one period, mass in kg, vectors (3,) in B; see "
          "control/point_controller.h.\nReturns a PointControllerOutput.");
}

void BindArmModel(py::module_& m) {
  using P = ArmModelParams<7>;
  BindParams<P> params(m, "ArmModelParams",
                       "Parameters of ArmModel: P is the link in front of a "
                       "joint, J what the joint turns about its z.");
  params.Field("p_PJ", &P::p_PJ,
               "(3, 7), m: column i is the position of J in P");
  MatrixPerJointField(&params, "R_PJ", &P::R_PJ,
                      "(7, 3, 3): orientations of J in P at q = 0");
  params.Field("mass", &P::mass, "(7,), kg, > 0: of the links, no default")
      .Field("com", &P::com, "(3, 7), m: centres of mass in J");
  MatrixPerJointField(&params, "inertia", &P::inertia,
                      "(7, 3, 3), kg m^2: about the centres of mass, in J");
  params.Field("p_LE", &P::p_LE, "(3,), m: tool point in the last J")
      .Field("R_LE", &P::R_LE, "(3, 3): orientation of E in the last J")
      .Field("gravity", &P::gravity,
             "(3,), m/s^2, in B, default (0, 0, -9.81)");
  BoundClass<ArmModel<7>>(
      m, "ArmModel",
      "Kinematics and dynamics of a serial arm with seven revolute joints.")
      .def_constructor<P>(py::arg("params"))
      .def_property_readonly("params", &ParamsOf<ArmModel<7>>)
      .def(
          "calc",
          [](const ArmModel<7>& self, const py::object& q,
             const py::object& v) {
            Pose X_BE;
            ModelTerms<7> terms;
            self.Calc(Vec7(q, "q"), Vec7(v, "v"), &X_BE, &terms);
            return py::make_tuple(X_BE.p, X_BE.R, terms.J_BE, terms.mass,
                                  terms.bias, terms.gravity, terms.Jdot_v);
          },
          py::arg("q"), py::arg("v"),
          "Takes q (7,), rad, and v (7,), rad/s.\n"
          "Returns (p_BE (3,), R_BE (3, 3), J_BE (6, 7), mass (7, 7), bias "
          "(7,) without gravity, gravity (7,) as Drake's "
          "CalcGravityGeneralizedForces, Jdot_v (6,)); six-vectors and rows "
          "are [linear; angular] of E in B.")
      .def(
          "find_posture",
          [](const ArmModel<7>& self, const py::object& p_BE,
             const py::object& R_BE, const py::object& q_near,
             const py::object& lower, const py::object& upper) {
            return FindPosture<7>(
                self, {.p = Vec3(p_BE, "p_BE"), .R = Mat3(R_BE, "R_BE")},
                Vec7(q_near, "q_near"), Vec7(lower, "lower"),
                Vec7(upper, "upper"));
          },
          py::arg("p_BE"), py::arg("R_BE"), py::arg("q_near"), py::arg("lower"),
          py::arg("upper"),
          "Returns the q (7,), rad, within `lower` and `upper` that puts E at "
          "p_BE (3,), m, R_BE (3, 3), nearest to q_near; None if none was "
          "found.");
}

void BindHapticController(py::module_& m) {
  using P = HapticControllerParams;
  BindParams<P>(m, "HapticControllerParams", "Parameters of HapticController.")
      .Fields();
  BindState<HapticControllerState>(m, "HapticControllerState",
                                   "Memory of HapticController.")
      .def_readonly("bad_inputs", &HapticControllerState::bad_inputs,
                    "cycles refused");
  BoundClass<HapticController>(
      m, "HapticController",
      "Local control of the haptic device: open-loop, eq. (18), by a force "
      "sensor, or holding\nthe haptic proxy.")
      .def_constructor<P>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<HapticController>)
      .def("make_state", &HapticController::MakeState)
      .def(
          "update",
          [](const HapticController& self, const py::object& reference_force,
             const py::object& reference_moment,
             const py::object& device_velocity,
             const py::object& force_selection, HapticControllerState& state,
             const py::object& contact_normals,
             const py::object& proxy_displacement,
             const py::object& handle_force, const py::object& fixture_force) {
            return self.Update(
                {.reference_force = Vec3(reference_force, "reference_force"),
                 .reference_moment = Vec3(reference_moment, "reference_moment"),
                 .device_velocity = Vec6(device_velocity, "device_velocity"),
                 .force_selection = Mat3(force_selection, "force_selection"),
                 .contact_normals = NormalsOrNone(contact_normals),
                 .proxy_displacement =
                     Vec3(proxy_displacement, "proxy_displacement"),
                 .fixture_force = Vec3(fixture_force, "fixture_force"),
                 .handle_force = Vec3(handle_force, "handle_force")},
                &state);
          },
          py::arg("reference_force"), py::arg("reference_moment"),
          py::arg("device_velocity"), py::arg("force_selection"),
          py::arg("state"), py::arg("contact_normals") = py::none(),
          py::arg("proxy_displacement") =
              Eigen::Vector3d(Eigen::Vector3d::Zero()),
          py::arg("handle_force") = Eigen::Vector3d(Eigen::Vector3d::Zero()),
          py::arg("fixture_force") = Eigen::Vector3d(Eigen::Vector3d::Zero()),
          "Takes F_h (3,), N, M_h (3,), N m, v_h (6,) [linear; angular], "
          "Omega_fh (3, 3), contact normals (3, 3), columns, x_h - x_ph (3,), "
          "m,\nof method `position`, the sensed force of the handle on the "
          "hand "
          "(3,), N, of `force_feedback`, and the force of fixtures (3,), N; in "
          "D.\nReturns "
          "the device wrench (6,) [force; "
          "moment] on the hand, in D.");
}

}  // namespace

void BindControl(py::module_& m) {
  BindPassivity(m);
  BindSelectionBlend(m);
  BindJointLimits(m);
  BindFrictionFeedback(m);
  BindForceLoop(m);
  BindOperationalSpaceController(m);
  BindPointController(m);
  BindArmModel(m);
  BindHapticController(m);
}

}  // namespace dual_proxy
