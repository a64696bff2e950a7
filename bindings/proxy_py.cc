// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/haptic_side_proxy.h"
#include "dual_proxy/proxy/robot_side_proxy.h"
#include "dual_proxy/proxy/trajectory_limiter.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"
#include "dual_proxy/proxy/virtual_spring.h"
#include "dual_proxy/proxy/workspace_limits.h"
#include "dual_proxy/proxy/workspace_map.h"
#include "messages.h"
#include "params.h"

namespace dual_proxy {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

void BindWorkspace(py::module_& m) {
  using P = WorkspaceMapParams;
  BindParams<P>(m, "WorkspaceMapParams",
                "How the device's workspace lies in the robot's.")
      .Fields();
  BoundClass<WorkspaceMap>(
      m, "WorkspaceMap",
      "The map between the device's and the robot's workspace, eq. (1)-(3).\n\n"
      "    x_pr = p_cw + s R_DB^T x_h        R_pr = R_DB^T R_h R_DB R_cw\n"
      "    x_ph = R_DB (x_r - p_cw) / s      R_ph = R_DB R_r R_cw^T R_DB^T\n"
      "    Omega_h = R_DB Omega R_DB^T")
      .def_one_factory([](const P& params) { return WorkspaceMap(params); },
                       py::arg("params"))
      .def_one_factory(
          [](const py::object& R_DB, const py::object& p_cw,
             const py::object& R_cw, double scale) {
            P params;
            params.R_DB = Mat3(R_DB, "R_DB");
            params.p_cw = Vec3(p_cw, "p_cw");
            params.R_cw = Mat3(R_cw, "R_cw");
            params.scale = scale;
            return WorkspaceMap(params);
          },
          py::kw_only(), py::arg("R_DB") = P{}.R_DB, py::arg("p_cw") = P{}.p_cw,
          py::arg("R_cw") = P{}.R_cw, py::arg("scale") = P{}.scale,
          "R_DB: (3, 3); p_cw: (3,), m, in B; R_cw: (3, 3); scale > 0. Raises "
          "ValueError that names\nthe one that has another shape, is no "
          "rotation, not finite or out of range.")
      .def_property_readonly("params", &ParamsOf<WorkspaceMap>)
      .def(
          "robot_proxy",
          [](const WorkspaceMap& self, const py::object& x_h,
             const py::object& R_h) {
            const Pose pose =
                self.RobotProxy(Vec3(x_h, "x_h"), Mat3(R_h, "R_h"));
            return py::make_tuple(pose.p, pose.R);
          },
          py::arg("x_h"), py::arg("R_h"),
          "Robot proxy of a device pose: x_h (3,), m, in D, from home, and R_h "
          "(3, 3).\nReturns (x_pr, R_pr): (3,), m, and (3, 3), in B.")
      .def(
          "haptic_proxy",
          [](const WorkspaceMap& self, const py::object& x_r,
             const py::object& R_r) {
            const Pose pose =
                self.HapticProxy(Vec3(x_r, "x_r"), Mat3(R_r, "R_r"));
            return py::make_tuple(pose.p, pose.R);
          },
          py::arg("x_r"), py::arg("R_r"),
          "Haptic proxy of a robot pose: x_r (3,), m, in B, and R_r (3, 3).\n"
          "Returns (x_ph, R_ph): (3,), m, and (3, 3), in D.")
      .def(
          "haptic_selection",
          [](const WorkspaceMap& self, const py::object& Omega) {
            return self.HapticSelection(Mat3(Omega, "Omega"));
          },
          py::arg("Omega"),
          "A selection (3, 3) in B, for the device: (3, 3), in D.");

  using L = WorkspaceLimitsParams;
  BindParams<L>(m, "WorkspaceLimitsParams", "Where the robot proxy may go.")
      .Fields();
  BoundClass<WorkspaceLimits>(m, "WorkspaceLimits",
                              "Keeps positions inside a convex workspace.")
      .def_constructor<const L&>(py::arg("params") = L{})
      .def_property_readonly("params", &ParamsOf<WorkspaceLimits>)
      .def(
          "clamp",
          [](const WorkspaceLimits& self, const py::object& p) {
            return self.Clamp(Vec3(p, "p"));
          },
          py::arg("p"), "The nearest point inside, (3,), m, in B.")
      .def(
          "contains",
          [](const WorkspaceLimits& self, const py::object& p) {
            return self.Contains(Vec3(p, "p"));
          },
          py::arg("p"), "Whether p, (3,), m, in B, is inside.");
}

// Infinity is one that bounds nothing.
void CheckBound(const char* who, const char* name, double value) {
  if (!(value >= 0)) ThrowInvalidField(who, name, "a number >= 0", value);
}

void BindLimiters(py::module_& m) {
  Def(
      &m, "rate_limit",
      [](const py::object& previous, const py::object& target,
         double max_step) {
        CheckBound("rate_limit", "max_step", max_step);
        return RateLimit(Vec3(previous, "previous"), Vec3(target, "target"),
                         max_step);
      },
      py::arg("previous"), py::arg("target"), py::arg("max_step"),
      "The vector (3,) nearest to `target` within `max_step` (norm, >= 0) of "
      "`previous`.");
  Def(
      &m, "saturate",
      [](const py::object& value, double max_norm) {
        CheckBound("saturate", "max_norm", max_norm);
        return Saturate(Vec3(value, "value"), max_norm);
      },
      py::arg("value"), py::arg("max_norm"),
      "`value` (3,) shortened to `max_norm`, >= 0, if it is longer.");

  using P = TrajectoryLimiterParams;
  BindParams<P>(m, "TrajectoryLimiterParams",
                "Limits of the motion of the robot proxy, per axis of B.")
      .Fields();
  using S = TrajectoryLimiterState;
  BindState<S>(m, "TrajectoryLimiterState", "The limited motion, in B.")
      .def_property_readonly(
          "pose", [](const S& self) { return self.pose; }, "Pose. A copy.")
      .def_property_readonly(
          "v", [](const S& self) { return self.v; }, "(3,), m/s.")
      .def_property_readonly(
          "a", [](const S& self) { return self.a; }, "(3,), m/s^2.")
      .def_property_readonly(
          "w", [](const S& self) { return self.w; }, "(3,), rad/s.")
      .def_property_readonly(
          "alpha", [](const S& self) { return self.alpha; }, "(3,), rad/s^2.")
      .def_readonly("bad_inputs", &S::bad_inputs, "Targets refused.");
  BoundClass<TrajectoryLimiter>(
      m, "TrajectoryLimiter",
      "Moves a pose towards a target that may change every tick, within limits "
      "of velocity and\nacceleration: the time-optimal way of every axis, on "
      "its own.")
      .def_constructor<const P&>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<TrajectoryLimiter>)
      .def(
          "make_state",
          [](const TrajectoryLimiter& self, const py::object& position,
             const py::object& rotation) {
            return self.MakeState(
                {Vec3(position, "position"), Mat3(rotation, "rotation")});
          },
          py::arg("position"), py::arg("rotation"),
          "At rest at a pose: (3,), m, and (3, 3), in B.")
      .def(
          "update",
          [](const TrajectoryLimiter& self, const py::object& position,
             const py::object& rotation, S& state, const py::object& velocity) {
            self.Update(
                {Vec3(position, "position"), Mat3(rotation, "rotation")},
                AsFixed<Eigen::Matrix<double, 6, 1>>(velocity, "velocity"),
                &state);
          },
          py::arg("position"), py::arg("rotation"), py::arg("state"),
          py::arg("velocity") = py::make_tuple(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
          "Advances by one period towards a target: (3,), m, and (3, 3), in B, "
          "which moves with\n`velocity`, (6,) [linear; angular], m/s, rad/s.")
      .def(
          "stop",
          [](const TrajectoryLimiter& self, S& state) { self.Stop(&state); },
          py::arg("state"), "Advances by one period, braking to rest.");
}

void BindVirtualSpring(py::module_& m) {
  using P = VirtualSpringParams;
  BindParams<P>(m, "VirtualSpringParams",
                "Parameters of VirtualSpring; of moments with N m and rad.")
      .Fields();
  using S = VirtualSpringState;
  BindState<S>(m, "VirtualSpringState", "Memory of VirtualSpring.")
      .def_property_readonly(
          "reference", [](const S& self) { return self.reference; },
          "The reference force, (3,), N.")
      .def_property_readonly(
          "selection", [](const S& self) { return self.selection; },
          "The selection of the last update, (3, 3).");
  BoundClass<VirtualSpring>(
      m, "VirtualSpring",
      "The spring between proxy and robot (or hand) in force space, eq. (4) "
      "and (5), saturated\nand rate-limited: F = -k Omega (x - x_p).")
      .def_constructor<const P&>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<VirtualSpring>)
      .def("make_state", &VirtualSpring::MakeState)
      .def(
          "update",
          [](const VirtualSpring& self, const py::object& displacement,
             const py::object& selection, const py::object& sensed, bool active,
             S& state) {
            Eigen::Vector3d value = Eigen::Vector3d::Zero();
            if (!sensed.is_none()) value = Vec3(sensed, "sensed");
            self.Update(Vec3(displacement, "displacement"),
                        Mat3(selection, "selection"),
                        sensed.is_none() ? nullptr : &value, active, &state);
          },
          py::arg("displacement"), py::arg("selection"), py::arg("sensed"),
          py::arg("active"), py::arg("state"),
          "Advances by one period: displacement x - x_p (3,), m; selection "
          "(3, 3); sensed force (3,),\nN, or None; active False lets the force "
          "fade.");
}

void BindRobotSideProxy(py::module_& m) {
  BindParams<PoseInterpolatorParams>(m, "PoseInterpolatorParams",
                                     "Parameters of PoseInterpolator.")
      .Fields();
  using P = RobotSideProxyParams;
  BindParams<P>(m, "RobotSideProxyParams",
                "Parameters of the robot side of the dual proxy.")
      .Fields();
  using O = RobotSideProxyOutput;
  BindState<O>(m, "RobotSideProxyOutput", "Outputs of one tick, in B.")
      .def_readonly("motion_error", &O::motion_error, "dx_m, (3,), m.")
      .def_readonly("rotation_error", &O::rotation_error, "(3,), rad.")
      .def_readonly("reference_force", &O::reference_force, "F_r, (3,), N.")
      .def_readonly("reference_moment", &O::reference_moment, "M_r, (3,), N m.")
      .def_readonly("proxy_pose", &O::proxy_pose,
                    "Pose of the limited robot proxy.")
      .def_readonly("proxy_velocity", &O::proxy_velocity,
                    "(6,) [linear; angular], m/s, rad/s.")
      .def_readonly("proxy_acceleration", &O::proxy_acceleration,
                    "(6,) [linear; angular], m/s^2, rad/s^2.")
      .def_readonly("force_selection", &O::force_selection,
                    "(3, 3), of the inputs', what dx_m and F_r go by: for the "
                    "controller.")
      .def_readonly("moment_selection", &O::moment_selection, "Likewise.")
      .def_readonly("link_status", &O::link_status, "LinkStatus.")
      .def_readonly("link_age", &O::link_age, "s.");
  using S = RobotSideProxyState;
  BindState<S>(m, "RobotSideProxyState", "Memory of the robot side.")
      .def_property_readonly(
          "output", [](const S& self) { return self.output; },
          "Of the last tick. A copy.")
      .def_property_readonly(
          "link", [](const S& self) { return self.link; },
          "LinkMonitorState. A copy.")
      .def_readonly("initialized", &S::initialized,
                    "Whether a robot pose has been seen.")
      .def_readonly("bad_inputs", &S::bad_inputs, "Ticks refused.");
  BoundClass<RobotSideProxy>(
      m, "RobotSideProxy",
      "The robot side of the dual proxy: turns the device's delayed poses into "
      "motion errors and\nreference forces, eq. (4).")
      .def_constructor<const P&>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<RobotSideProxy>)
      .def("make_state", &RobotSideProxy::MakeState)
      .def(
          "update",
          [](const RobotSideProxy& self, double time, const py::object& message,
             const py::object& robot_position, const py::object& robot_rotation,
             const py::object& force_selection,
             const py::object& moment_selection,
             const py::object& sensed_wrench, S& state, bool sensor_ready) {
            RobotSideProxyInput input;
            input.sensor_ready = sensor_ready;
            input.message = PoseMessageFromPython(message);
            input.X_BE = {Vec3(robot_position, "robot_position"),
                          Mat3(robot_rotation, "robot_rotation")};
            input.force_selection = Mat3(force_selection, "force_selection");
            input.moment_selection = Mat3(moment_selection, "moment_selection");
            input.has_sensed = !sensed_wrench.is_none();
            if (input.has_sensed) {
              const Vector6 wrench =
                  AsFixed<Vector6>(sensed_wrench, "sensed_wrench");
              input.sensed_force = wrench.head<3>();
              input.sensed_moment = wrench.tail<3>();
            }
            self.Update(time, input, &state);
          },
          py::arg("time"), py::arg("message"), py::arg("robot_position"),
          py::arg("robot_rotation"), py::arg("force_selection"),
          py::arg("moment_selection"), py::arg("sensed_wrench"),
          py::arg("state"), py::arg("sensor_ready") = true,
          "Advances by one period; the outputs are in `state.output`. time: s; "
          "message: PoseMessage, or a Message with one;\nrobot pose (3,), m, "
          "and (3, 3); selections "
          "(3, 3); sensed_wrench: (6,) [force; moment], N, N m,\nor None (no "
          "bumpless hand-over). In B.");
}

void BindHapticSideProxy(py::module_& m) {
  using P = HapticSideProxyParams;
  BindParams<P>(m, "HapticSideProxyParams",
                "Parameters of the haptic side of the dual proxy.")
      .Fields();
  using O = HapticSideProxyOutput;
  BindState<O>(m, "HapticSideProxyOutput", "Outputs of one tick, in D.")
      .def_readonly("reference_force", &O::reference_force,
                    "F_h, (3,), N, on the hand.")
      .def_readonly("reference_moment", &O::reference_moment,
                    "M_h, (3,), N m, on the hand.")
      .def_readonly("proxy_pose", &O::proxy_pose, "Pose of the haptic proxy.")
      .def_readonly("force_selection", &O::force_selection, "Omega_fh, (3, 3).")
      .def_readonly("moment_selection", &O::moment_selection,
                    "Omega_tauh, (3, 3).")
      .def_readonly("contact_normals", &O::contact_normals,
                    "Unit vectors into the surfaces as columns, (3, 3).")
      .def_readonly("link_status", &O::link_status, "LinkStatus.")
      .def_readonly("link_age", &O::link_age, "s.");
  using S = HapticSideProxyState;
  BindState<S>(m, "HapticSideProxyState", "Memory of the haptic side.")
      .def_property_readonly(
          "output", [](const S& self) { return self.output; },
          "Of the last tick. A copy.")
      .def_property_readonly(
          "link", [](const S& self) { return self.link; },
          "LinkMonitorState. A copy.")
      .def_readonly("bad_inputs", &S::bad_inputs, "Ticks refused.");
  BoundClass<HapticSideProxy>(
      m, "HapticSideProxy",
      "The haptic side of the dual proxy: what the hand is to feel, eq. (5).")
      .def_constructor<const P&>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<HapticSideProxy>)
      .def_property_readonly("stiffness", &HapticSideProxy::stiffness,
                             "k_vir_h in use, N/m.")
      .def("make_state", &HapticSideProxy::MakeState)
      .def(
          "update",
          [](const HapticSideProxy& self, double time,
             const py::object& message, const py::object& device_position,
             const py::object& device_rotation, S& state) {
            self.Update(time,
                        {PoseMessageFromPython(message),
                         {Vec3(device_position, "device_position"),
                          Mat3(device_rotation, "device_rotation")}},
                        &state);
          },
          py::arg("time"), py::arg("message"), py::arg("device_position"),
          py::arg("device_rotation"), py::arg("state"),
          "Advances by one period; the outputs are in `state.output`. time: s; "
          "message: PoseMessage, or a Message with one;\ndevice pose (3,), m, "
          "from home, and (3, 3), "
          "in D.");
}

}  // namespace

void BindProxy(py::module_& m) {
  BindWorkspace(m);
  BindLimiters(m);
  BindVirtualSpring(m);
  BindRobotSideProxy(m);
  BindHapticSideProxy(m);
}

}  // namespace dual_proxy
