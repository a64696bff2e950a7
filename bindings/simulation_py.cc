// SPDX-License-Identifier: BSD-3-Clause
#include <optional>

#include <pybind11/stl.h>

#include "dual_proxy/simulation/contact_scene.h"
#include "dual_proxy/simulation/contact_surface.h"
#include "dual_proxy/simulation/contact_truth.h"
#include "dual_proxy/simulation/force_torque_sensor.h"
#include "dual_proxy/simulation/haptic_device.h"
#include "dual_proxy/simulation/operator.h"
#include "dual_proxy/simulation/point_robot.h"
#include "dual_proxy/simulation/simulated_arm.h"
#include "force_torque_adapter.h"
#include "params.h"

namespace dual_proxy {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

Eigen::VectorXd Times(const py::object& value) {
  const auto array = AsArray(value, "times", "(n,)");
  if (array.ndim() != 1) ThrowShape("times", "(n,)", array);
  return array.cast<Eigen::VectorXd>();
}

Eigen::Matrix3Xd Columns(const py::object& value, const char* name) {
  const auto array = AsArray(value, name, "(3, n)");
  if (array.ndim() != 2 || array.shape(0) != 3) {
    ThrowShape(name, "(3, n)", array);
  }
  return array.cast<Eigen::Matrix3Xd>();
}

void BindOperator(py::module_& m) {
  using Params = OperatorPathParams;
  BindParams<Params>(m, "OperatorPathParams",
                     "Parameters of OperatorPath: where the operator wants the "
                     "tool or the handle, and when.")
      .ArrayField(
          "times",
          [](const Params& self) {
            return ReadOnly(py::array(py::cast(self.times)));
          },
          [](Params* self, const py::object& value) {
            self->times = Times(value);
          },
          "(n,), s, strictly increasing, n >= 1")
      .ArrayField(
          "points",
          [](const Params& self) {
            return ReadOnly(py::array(py::cast(self.points)));
          },
          [](Params* self, const py::object& value) {
            self->points = Columns(value, "points");
          },
          "(3, n), m, one column per time, in B for the tool or D for the "
          "handle")
      .Field("interpolation", &Params::interpolation,
             "\"minimum_jerk\", \"linear\" or \"cubic\" (recorded motion)")
      .ArrayField(
          "rotations",
          [](const Params& self) {
            return ReadOnly(py::array(py::cast(self.rotations)));
          },
          [](Params* self, const py::object& value) {
            self->rotations = Columns(value, "rotations");
          },
          "(3, n), rad, rotation vectors from the start, in the frame of "
          "`points`; or (3, 0): no rotation")
      .Field("clutch", &Params::clutch,
             "[start, end] each, s: the operator presses the clutch")
      .Field("home", &Params::home,
             "[start, end] each, s: the operator asks for the way home and "
             "gives way to it")
      .Field("force_scale", &Params::force_scale,
             "[time, scale] each, s: what the operator asks for from then on")
      .Field("gripper", &Params::gripper,
             "[time, opening] each, s, m: of the device's gripper from then "
             "on");
  BoundClass<OperatorPath>(
      m, "OperatorPath",
      "What the simulated operator intends: a path through given points at "
      "given times,\nat rest before the first and after the last.")
      .def_one_factory(
          [](const Params& params) { return OperatorPath(params); },
          py::arg("params") = Params())
      .def_one_factory(
          [](const py::object& times, const py::object& points,
             const py::object& interpolation, const py::object& rotations) {
            return OperatorPath(
                {.times = Times(times),
                 .points = Columns(points, "points"),
                 .interpolation = EnumFromPython<PathInterpolation>(
                     interpolation, "interpolation"),
                 .rotations = rotations.is_none()
                                  ? Eigen::Matrix3Xd(3, 0)
                                  : Columns(rotations, "rotations")});
          },
          py::arg("times"), py::arg("points"),
          py::arg("interpolation") = "minimum_jerk",
          py::arg("rotations") = py::none(),
          "times: (n,), s. points: (3, n), m. rotations: (3, n), rad, or "
          "(3, 0) for none.")
      .def_property_readonly("params", &ParamsOf<OperatorPath>)
      .def(
          "calc",
          [](const OperatorPath& self, double time) {
            const OperatorPathSample sample = self.Calc(time);
            return py::make_tuple(sample.position, sample.velocity);
          },
          py::arg("time"),
          "Intended (position, velocity) at a time (s): (3,), m and (3,), m/s, "
          "in the frame of the points.")
      .def(
          "calc_rotation",
          [](const OperatorPath& self, double time) {
            return self.Calc(time).rotation;
          },
          py::arg("time"), "Intended rotation from the start, (3, 3).");
}

void BindHapticDevice(py::module_& m) {
  using Params = SimulatedHapticDeviceParams;
  using State = SimulatedHapticDeviceState;
  BindParams<Params>(m, "SimulatedHapticDeviceParams",
                     "Parameters of SimulatedHapticDevice; the defaults are an "
                     "Omega.7 in a firm hand.")
      .Fields();
  BindState<State>(m, "SimulatedHapticDeviceState",
                   "Where hand and device are, and what the driver reads.")
      .def_property_readonly(
          "pose", [](const State& self) { return self.pose; },
          "True pose X_DH of the handle.")
      .def_property_readonly(
          "velocity", [](const State& self) { return self.velocity; },
          "True velocity of the handle, (3,), m/s, in D.")
      .def_property_readonly(
          "read_pose", [](const State& self) { return self.read_pose; },
          "Pose X_DH as read.")
      .def_property_readonly(
          "intended", [](const State& self) { return self.intended; },
          "The last valid pose X_DH that the operator intended.")
      .def_property_readonly(
          "read_velocity", [](const State& self) { return self.read_velocity; },
          "Twist as read, (6,) [linear; angular], m/s and rad/s, in D.")
      .def_property_readonly(
          "hand_force", [](const State& self) { return self.hand_force; },
          "Pull of the hand, (3,), N, in D.")
      .def_property_readonly(
          "handle_force", [](const State& self) { return self.handle_force; },
          "(3,), N, in D: of the handle on the hand, as a sensor there reads.")
      .def_readonly("bad_inputs", &State::bad_inputs,
                    "Updates with an intention or a wrench not usable.");
  BoundClass<SimulatedHapticDevice>(
      m, "SimulatedHapticDevice",
      "A simulated haptic device in a simulated hand that pulls it along.")
      .def_constructor<const Params&>(py::arg("params") = Params())
      .def_property_readonly("params", &ParamsOf<SimulatedHapticDevice>)
      .def(
          "make_state",
          [](const SimulatedHapticDevice& self, const py::object& position,
             const py::object& rotation) {
            return self.MakeState(
                {Vec3(position, "position"), Mat3(rotation, "rotation")});
          },
          py::arg("position") = Pose().p, py::arg("rotation") = Pose().R,
          "At rest at this pose X_DH.")
      .def(
          "update",
          [](const SimulatedHapticDevice& self,
             const py::object& intended_position,
             const py::object& intended_rotation,
             const py::object& intended_velocity,
             const py::object& device_wrench, State* state) {
            self.Update({Vec3(intended_position, "intended_position"),
                         Mat3(intended_rotation, "intended_rotation")},
                        Vec3(intended_velocity, "intended_velocity"),
                        AsFixed<Vector6d>(device_wrench, "device_wrench"),
                        state);
          },
          py::arg("intended_position"), py::arg("intended_rotation"),
          py::arg("intended_velocity"), py::arg("device_wrench"),
          py::arg("state"),
          "Advances by one period.\n\n"
          "intended_position: (3,), m, in D. intended_rotation: R_DH, (3, 3).\n"
          "intended_velocity: (3,), m/s, in D.\n"
          "device_wrench: (6,) [force; moment], N and N m, in D: on the hand.");
}

void BindForceTorqueSensor(py::module_& m) {
  using Params = ForceTorqueSensorParams;
  using State = ForceTorqueSensorState;
  BindParams<Params>(
      m, "ForceTorqueSensorParams",
      "Parameters of ForceTorqueSensor: of what is simulated, and of the "
      "adapter behind it.")
      .Fields();
  BindState<State>(m, "ForceTorqueSensorState",
                   "What the sensor remembers, and its last output.")
      .def_property_readonly(
          "measured", [](const State& self) { return self.measured; },
          "(6,) [force; moment], N and N m, in S, as a driver would give it.")
      .def_property_readonly(
          "wrench", [](const State& self) { return self.adapter.wrench; },
          "(6,) [force; moment] about E, N and N m, in B: robot on "
          "environment.")
      .def_property_readonly(
          "ready", [](const State& self) { return self.adapter.ready; },
          "Whether there are samples, and their bias is known.")
      .def_property_readonly(
          "adapter", [](const State& self) { return self.adapter; },
          "ForceTorqueAdapterState. A copy.")
      .def_property_readonly(
          "bad_inputs",
          [](const State& self) { return self.adapter.bad_inputs; },
          "Samples refused.")
      .def_property_readonly(
          "tares_refused",
          [](const State& self) { return self.adapter.tares_refused; },
          "Times at rest that gave no bias.");
  BoundClass<ForceTorqueSensor>(
      m, "ForceTorqueSensor",
      "A simulated six-axis force/torque sensor between arm and tool, and the "
      "adapter behind it.")
      .def_constructor<const Params&>(py::arg("params") = Params())
      .def_property_readonly("params", &ParamsOf<ForceTorqueSensor>)
      .def("make_state", &ForceTorqueSensor::MakeState, py::arg("seed") = 0,
           "The same seed gives the same noise.")
      .def(
          "update",
          [](const ForceTorqueSensor& self, const py::object& reaction,
             const py::object& robot_position, const py::object& robot_rotation,
             const py::object& p_SE, State& state, bool tare,
             const py::object& robot_velocity) {
            return self.Update(
                {.measured = AsFixed<Vector6d>(reaction, "reaction"),
                 .X_BE = {.p = Vec3(robot_position, "robot_position"),
                          .R = Mat3(robot_rotation, "robot_rotation")},
                 .v_BE = OptionalVelocity(robot_velocity),
                 .p_SE = Vec3(p_SE, "p_SE"),
                 .tare = tare},
                &state);
          },
          py::arg("reaction"), py::arg("robot_position"),
          py::arg("robot_rotation"), py::arg("p_SE"), py::arg("state"),
          py::arg("tare") = false, py::arg("robot_velocity") = py::none(),
          "Takes a sample and returns `state.wrench`.\n\n"
          "reaction: (6,) [force; moment] about the origin of S, N and N m, in "
          "S: arm on tool.\n"
          "robot_position (3,), m, and robot_rotation (3, 3): of the tool "
          "point. p_SE: (3,), m, tool point in S.\n"
          "tare: asks for the bias to be learned anew when it becomes true.\n"
          "robot_velocity: (6,) [linear; angular], m/s, rad/s, in B: of the "
          "tool point, if known.");
}

void BindContact(py::module_& m) {
  using SurfaceParams = ContactSurfaceParams;
  BindParams<SurfaceParams>(m, "ContactSurfaceParams",
                            "Parameters of ContactSurface.")
      .Fields();
  BoundClass<SurfaceContact>(m, "SurfaceContact",
                             "A tool's contact with one surface.")
      .def_readonly("penetration", &SurfaceContact::penetration,
                    "m: depth of the tool; negative is the distance.")
      .def_property_readonly(
          "normal", [](const SurfaceContact& self) { return self.normal; },
          "(3,), unit vector INTO the surface, in B.")
      .def_readonly("normal_force", &SurfaceContact::normal_force, "N, >= 0.")
      .def_property_readonly(
          "force", [](const SurfaceContact& self) { return self.force; },
          "(3,), N, in B: robot on surface.");
  BoundClass<ContactSurface>(
      m, "ContactSurface",
      "An analytic surface that a spherical tool touches, with friction.")
      .def_constructor<const SurfaceParams&>(py::arg("params") =
                                                 SurfaceParams())
      .def_property_readonly("params", &ParamsOf<ContactSurface>)
      .def(
          "calc",
          [](const ContactSurface& self, const py::object& p,
             const py::object& v, double tool_radius) {
            return self.Calc(Vec3(p, "p"), Vec3(v, "v"), tool_radius);
          },
          py::arg("p"), py::arg("v"), py::arg("tool_radius"),
          "p: (3,), m, centre of the tool. v: (3,), m/s. tool_radius: m. In "
          "B.");

  using SceneParams = ContactSceneParams;
  BindParams<SceneParams>(m, "ContactSceneParams",
                          "Parameters of ContactScene.")
      .Fields();
  BoundClass<SceneContact>(m, "SceneContact",
                           "A tool's contact with a scene: the truth.")
      .def_property_readonly(
          "force", [](const SceneContact& self) { return self.force; },
          "(3,), N, in B: robot on scene.")
      .def_property_readonly(
          "normal", [](const SceneContact& self) { return self.normal; },
          "(3,), unit vector along the sum of the normal forces, INTO the "
          "surface, in B; zero without contact.")
      .def_readonly("count", &SceneContact::count,
                    "Number of surfaces with a normal force.")
      .def_readonly("dimension", &SceneContact::dimension,
                    "0 to 3: number of independent normals.")
      .def_property_readonly(
          "normals",
          [](const SceneContact& self) -> Eigen::Matrix3Xd {
            return self.normals.leftCols(self.count);
          },
          "(3, count), unit vectors INTO the surfaces, in B.")
      .def_property_readonly(
          "normal_forces",
          [](const SceneContact& self) -> Eigen::VectorXd {
            return self.normal_forces.head(self.count);
          },
          "(count,), N.");
  m.def(
      "_single_contact_truth",
      [](const py::object& force, const py::object& normal, bool on_tool) {
        ContactTruth truth;
        const Eigen::Vector3d f = Vec3(force, "force");
        const Eigen::Vector3d n = Vec3(normal, "normal");
        truth.Add(on_tool ? -f : f, on_tool ? n : -n);
        return truth.ToVector();
      },
      py::arg("force"), py::arg("normal"), py::arg("on_tool"),
      "`_ContactTruth.to_vector()` of one contact as Drake gives it: the force "
      "on body B and the\nnormal from B to A, B being the tool or not.");
  py::class_<ContactTruth>(m, "_ContactTruth",
                           "What the tool really touches, from a simulator's "
                           "contacts; see the C++ header.")
      .def(py::init<>())
      .def(
          "add",
          [](ContactTruth& self, const py::object& force,
             const py::object& normal, const py::object& p) {
            self.Add(Vec3(force, "force"), Vec3(normal, "normal"),
                     p.is_none() ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                 : Vec3(p, "p"));
          },
          py::arg("force"), py::arg("normal"), py::arg("p") = py::none(),
          "Takes one more contact: force, (3,), N, of the tool on its "
          "environment; unit\nnormal, (3,), INTO the surface; place, (3,), m, "
          "for moments. All in B.")
      .def("to_vector", &ContactTruth::ToVector,
           "(14,): force 3, normal 3, dimension 1, axis of free motion 3; "
           "moment dimension 1,\naxis of free rotation 3.");
  BoundClass<ContactScene>(m, "ContactScene",
                           "A few surfaces and the tool that touches them.")
      .def_constructor<const SceneParams&>(py::arg("params") = SceneParams())
      .def_property_readonly("params", &ParamsOf<ContactScene>)
      .def(
          "calc",
          [](const ContactScene& self, const py::object& p,
             const py::object& v) {
            return self.Calc(Vec3(p, "p"), Vec3(v, "v"));
          },
          py::arg("p"), py::arg("v"),
          "p: (3,), m, centre of the tool. v: (3,), m/s. In B.");
}

void BindPointRobot(py::module_& m) {
  using Params = PointRobotParams;
  using State = PointRobotState;
  BindParams<Params>(m, "PointRobotParams", "Parameters of PointRobot.")
      .Fields();
  BindState<State>(m, "PointRobotState",
                   "Where the point robot is and what it touches there.")
      .def_property_readonly(
          "position", [](const State& self) { return self.position; },
          "(3,), m, in B.")
      .def_property_readonly(
          "velocity", [](const State& self) { return self.velocity; },
          "(3,), m/s, in B.")
      .def_property_readonly(
          "contact", [](const State& self) { return self.contact; },
          "SceneContact at this position and velocity.")
      .def_readonly("bad_inputs", &State::bad_inputs,
                    "Updates with a force that was not finite.");
  BoundClass<PointRobot>(m, "PointRobot",
                         "A mass without gravity that touches a ContactScene.")
      .def_constructor<const Params&, const ContactSceneParams&>(
          py::arg("params") = Params(), py::arg("scene") = ContactSceneParams())
      .def_property_readonly("params", &ParamsOf<PointRobot>)
      .def_property_readonly(
          "scene",
          [](const PointRobot& self) { return ReadOnlyCopy(self.scene()); })
      .def(
          "make_state",
          [](const PointRobot& self, const py::object& position) {
            return self.MakeState(Vec3(position, "position"));
          },
          py::arg("position") = Pose().p, "At rest at this position, m, in B.")
      .def(
          "update",
          [](const PointRobot& self, const py::object& control_force,
             State* state) {
            self.Update(Vec3(control_force, "control_force"), state);
          },
          py::arg("control_force"), py::arg("state"),
          "Advances by one period under a force, (3,), N, in B.");
}

void BindSimulatedArm(py::module_& m) {
  using Params = SimulatedArmParams;
  using State = SimulatedArmState<7>;
  BindParams<Params>(m, "SimulatedArmParams",
                     "Parameters of SimulatedArm. S is the wrist sensor's "
                     "frame, whose axes are E's.")
      .Field("period", &Params::period,
             "s, > 0: the torque is held for it, default 0.001")
      .Field("time_step", &Params::time_step,
             "s, > 0, at least period / 1000: longest integration step, "
             "default 0.001")
      .ArrayField(
          "p_EBall",
          [](const Params& self) {
            return ReadOnly(py::array(py::cast(self.p_EBall)));
          },
          [](Params* self, const py::object& value) {
            self->p_EBall = Columns(value, "p_EBall");
          },
          "(3, n), m, in E, n from 1 to 4: centres of the balls that the tool "
          "touches with, which share the surfaces' stiffness; default one in E")
      .Field("p_SE", &Params::p_SE, "(3,), m, in S: tool point, default 0")
      .Field("tool_mass", &Params::tool_mass,
             "kg, >= 0: mass beyond the sensor, a part of the arm's last link, "
             "default 0")
      .Field("tool_com", &Params::tool_com,
             "(3,), m, in S: centre of that mass, default 0")
      .Field("tool_inertia", &Params::tool_inertia,
             "(3, 3), kg m^2: of that mass about its centre, along the axes of "
             "S, default 0");
  BindState<State>(m, "SimulatedArmState",
                   "Where the arm is and what it touches there.")
      .def_property_readonly(
          "q", [](const State& self) { return self.q; }, "(7,), rad.")
      .def_property_readonly(
          "v", [](const State& self) { return self.v; }, "(7,), rad/s.")
      .def_property_readonly(
          "pose", [](const State& self) { return self.X_BE; },
          "Pose X_BE of the tool point.")
      .def_property_readonly(
          "velocity", [](const State& self) { return self.v_BE; },
          "Twist of the tool point, (6,) [linear; angular], m/s and rad/s, in "
          "B.")
      .def_property_readonly(
          "contact_truth",
          [](const State& self) { return self.truth.ToVector(); },
          "(14,), of the last step: force on the environment 3, N, normal 3, "
          "dimension 1, axis of\nfree motion 3; moment dimension 1, axis of "
          "free rotation 3. In B.")
      .def_property_readonly(
          "reaction", [](const State& self) { return self.reaction; },
          "(6,) [force; moment] about the origin of S, N and N m, in S: of the "
          "arm on the\ntool, in the last step.")
      .def_readonly("bad_inputs", &State::bad_inputs,
                    "Updates with a torque that was not finite.");
  BoundClass<SimulatedArm<7>>(
      m, "SimulatedArm",
      "An arm that torques and gravity move and that touches surfaces with its "
      "tool.")
      .def_constructor<const Params&, const ArmModelParams<7>&,
                       const ContactSceneParams&>(
          py::arg("params"), py::arg("arm"),
          py::arg("scene") = ContactSceneParams(),
          "arm: with the tool as a part of its last link. scene: its "
          "tool_radius is that\nof every ball.")
      .def_property_readonly("params", &ParamsOf<SimulatedArm<7>>)
      .def_property_readonly(
          "arm",
          [](const SimulatedArm<7>& self) { return ReadOnlyCopy(self.arm()); })
      .def_property_readonly("scene",
                             [](const SimulatedArm<7>& self) {
                               return ReadOnlyCopy(self.scene());
                             })
      .def(
          "make_state",
          [](const SimulatedArm<7>& self, const py::object& q,
             const py::object& v) {
            return self.MakeState(AsFixed<Vector7>(q, "q"),
                                  AsFixed<Vector7>(v, "v"));
          },
          py::arg("q"), py::arg("v") = Vector7(Vector7::Zero()),
          "At joint positions q, (7,), rad, with velocities v, (7,), rad/s.")
      .def(
          "update",
          [](const SimulatedArm<7>& self, const py::object& torque,
             State* state) {
            self.Update(AsFixed<Vector7>(torque, "torque"), state);
          },
          py::arg("torque"), py::arg("state"),
          "Advances by one period under joint torques, (7,), N m.");
}

}  // namespace

void BindSimulation(py::module_& m) {
  BindOperator(m);
  BindHapticDevice(m);
  BindForceTorqueSensor(m);
  BindContact(m);
  BindPointRobot(m);
  BindSimulatedArm(m);
}

}  // namespace dual_proxy
