// SPDX-License-Identifier: BSD-3-Clause
#include <optional>

#include "dual_proxy/common/window_mean.h"
#include "dual_proxy/sides/haptic_side.h"
#include "dual_proxy/sides/robot_side.h"
#include "layout.h"
#include "messages.h"
#include "params.h"

namespace dual_proxy {

namespace {

template <typename Side, typename State>
void CheckState(const Side& side, const State& state) {
  if (!side.IsCompatible(state)) {
    throw py::value_error(
        "`state` expected one that a side with the same scheme has made");
  }
}

// Arrays are handed out as copies: the state goes on changing.
constexpr auto kCopy = py::return_value_policy::copy;

template <typename Side, typename State>
py::array_t<double> Signals(const Side& self, const State& state) {
  py::array_t<double> result(SizeOf(self.layout()));
  Eigen::Map<Eigen::VectorXd> map(result.mutable_data(), result.size());
  Eigen::Ref<Eigen::VectorXd> vector(map);
  SignalSink sink(&vector);
  self.VisitSignals(state, &sink);
  return result;
}

constexpr const char* kSignalsDoc =
    "All signals of a state as one flat float64 vector, by `layout`.";
constexpr const char* kLayoutDoc =
    "{signal: slice} of `signals()`, in its order. A 3x3 matrix is row-major, "
    "a rotation a\nquaternion w, x, y, z.";

void BindWindowMean(py::module_& m) {
  using S = WindowMeanState<3>;
  BindState<S>(m, "WindowMeanState", "Memory of WindowMean, and its result.")
      .def_readonly("mean", &S::mean, kCopy, "(3,), zero before any sample")
      .def_readonly("samples", &S::samples, "in the current window so far")
      .def_readonly("bad_inputs", &S::bad_inputs, "samples refused");

  using M = WindowMean<3>;
  BoundClass<M>(m, "WindowMean",
                "Mean of a 3-vector over the current window [k T, (k + 1) T): "
                "what a process that\nruns every T takes.")
      .def_constructor<double>(py::arg("window"), "window: T, s, in (0, 1e11].")
      .def_property_readonly("window", &M::window, "s")
      .def("make_state", &M::MakeState)
      .def(
          "update",
          [](const M& self, double time, const py::object& value, S& state) {
            self.Update(time, Vec3(value, "value"), &state);
          },
          py::arg("time"), py::arg("value"), py::arg("state"),
          "Takes a sample, (3,); the mean with it is in `state.mean`. One that "
          "is not finite is\nrefused and counted.");
}

void BindPlanner(py::module_& m) {
  using R = PlannerReference;
  BoundClass<R>(m, "PlannerReference",
                "What a planner on the robot's side asks for in one cycle.")
      .def_factory(
          [](const py::object& selection, const py::object& position,
             const py::object& velocity, const py::object& force) {
            return R{.selection = Mat3(selection, "selection"),
                     .position = Vec3(position, "position"),
                     .velocity = Vec3(velocity, "velocity"),
                     .force = Vec3(force, "force")};
          },
          py::kw_only(), py::arg("selection") = R{}.selection,
          py::arg("position") = R{}.position,
          py::arg("velocity") = R{}.velocity, py::arg("force") = R{}.force,
          "selection: (3, 3), Omega_p, the projection onto the directions "
          "that the planner owns;\nposition: (3,), m, and velocity: (3,), "
          "m/s, of the tool point; force: (3,), N, on the\nenvironment; all "
          "in B.")
      .def_readonly("selection", &R::selection, kCopy, "(3, 3)")
      .def_readonly("position", &R::position, kCopy, "(3,), m")
      .def_readonly("velocity", &R::velocity, kCopy, "(3,), m/s")
      .def_readonly("force", &R::force, kCopy, "(3,), N");

  BindParams<GripperParams>(m, "GripperParams",
                            "How the robot's gripper follows the device's.")
      .Fields();
  BindParams<LocalPlannerParams>(
      m, "LocalPlannerParams",
      "Parameters of the robot side's own planner, that of scenarios.")
      .Fields();
}

void BindRobotSide(py::module_& m) {
  using P = RobotSideParams<SerialArm<7>>;
  BindParams<P>(m, "RobotSideParams",
                "Parameters of RobotSide; all `period` fields of the control "
                "are the same.")
      .Fields();

  BindState<FilterInput>(m, "FilterInput",
                         "What a filter takes: of forces, or of moments.")
      .def_readonly("sensed", &FilterInput::sensed, kCopy,
                    "F_s, (3,), N, or M_s, N m")
      .def_readonly("velocity", &FilterInput::velocity, kCopy,
                    "v_BE, (3,), m/s, or w_BE, rad/s")
      .def_readonly("motion", &FilterInput::motion, kCopy, "F_m or M_m, (3,)")
      .def_readonly("contact", &FilterInput::contact, kCopy,
                    "F_f or M_f, (3,)");

  using S = RobotSideState<SerialArm<7>>;
  const auto filter = [](ScheduledFilterState ContactPerceptionState::* part) {
    return [part](const S& self) { return (self.perception.*part).filter; };
  };
  const auto means = [](ScheduledFilterState ContactPerceptionState::* part) {
    return
        [part](const S& self) { return (self.perception.*part).mean_input(); };
  };
  const auto setpoint = [](auto member) {
    return [member](const S& self) { return self.output.setpoint.*member; };
  };
  using Q = RobotSetpoint;
  BindState<S>(m, "RobotSideState",
               "Memory of RobotSide, and the results of the last cycle, in B.")
      .def_property_readonly(
          "torque", [](const S& self) { return self.output.controller.torque; },
          "(7,), N m")
      .def_property_readonly(
          "message",
          [](const S& self) {
            return MessageToPython(self.half.output().message);
          },
          "newest message to the haptic side")
      .def_property_readonly("motion_error", setpoint(&Q::motion_error),
                             "dx_m, (3,), m")
      .def_property_readonly("rotation_error", setpoint(&Q::rotation_error),
                             "(3,), rad")
      .def_property_readonly("reference_force", setpoint(&Q::reference_force),
                             "F_r, (3,), N")
      .def_property_readonly("reference_moment", setpoint(&Q::reference_moment),
                             "M_r, (3,), N m")
      .def_property_readonly("proxy_velocity", setpoint(&Q::velocity),
                             "(6,) [linear; angular]")
      .def_property_readonly("proxy_acceleration", setpoint(&Q::acceleration),
                             "(6,) [linear; angular]")
      .def_property_readonly(
          "proxy_position",
          [](const S& self) { return self.output.reference_pose.p; },
          "where scheme and planner want the tool point, (3,), m")
      .def_property_readonly(
          "proxy_rotation",
          [](const S& self) { return self.output.reference_pose.R; }, "(3, 3)")
      .def_property_readonly(
          "link", [](const S& self) { return self.half.output().link; },
          "LinkMonitorState. A copy.")
      .def_property_readonly(
          "controller", [](const S& self) { return self.output.controller; },
          "OperationalSpaceControllerOutput. A copy.")
      .def_property_readonly(
          "controller_state", [](const S& self) { return self.controller; },
          "OperationalSpaceControllerState. A copy.")
      .def_property_readonly(
          "velocity", [](const S& self) { return self.output.v_BE; },
          "v_BE, (6,) [linear; angular]")
      .def_property_readonly(
          "force_selection",
          [](const S& self) { return self.output.selections.force; },
          "Omega_f in force, (3, 3)")
      .def_property_readonly(
          "moment_selection",
          [](const S& self) { return self.output.selections.moment; },
          "Omega_tau in force, (3, 3)")
      .def_property_readonly(
          "gripper_width_command",
          [](const S& self) { return self.gripper.width; },
          "m, for the gripper's driver")
      .def_property_readonly(
          "planner_selection",
          [](const S& self) { return self.blend.planner.selection; },
          "Omega_p in force, (3, 3)")
      .def_property_readonly("filter", filter(&ContactPerceptionState::force),
                             "ForceSpaceParticleFilterState. A copy.")
      .def_property_readonly("angular_filter",
                             filter(&ContactPerceptionState::moment),
                             "The angular filter's. A copy.")
      .def_property_readonly("filter_means",
                             means(&ContactPerceptionState::force),
                             "FilterInput: means since the last update")
      .def_property_readonly("angular_filter_means",
                             means(&ContactPerceptionState::moment),
                             "the same of the angular filter, zero without one")
      .def_property_readonly(
          "hold", [](const S& self) { return EnumToString(self.output.hold); },
          "why the robot holds its place: \"none\" (it follows), \"no_link\", "
          "\"no_sensor\", \"asked\" or \"bad_inputs\"")
      .def_property_readonly(
          "bad_inputs", [](const S& self) { return self.output.bad_inputs; },
          "cycles refused so far");

  const auto selections =
      [](const py::object& force, const py::object& moment,
         const py::object& normals) -> std::optional<ContactSelections> {
    if (force.is_none() && moment.is_none() && normals.is_none()) {
      return std::nullopt;
    }
    ContactSelections result;
    if (!force.is_none()) result.force = Mat3(force, "force_selection");
    if (!moment.is_none()) result.moment = Mat3(moment, "moment_selection");
    if (!normals.is_none()) result.normals = Mat3(normals, "contact_normals");
    return result;
  };
  const auto planner =
      [](const py::object& reference) -> std::optional<PlannerReference> {
    if (reference.is_none()) return std::nullopt;
    if (!py::isinstance<PlannerReference>(reference)) {
      ThrowExpected<py::type_error>("", "planner_reference",
                                    "PlannerReference or None", reference);
    }
    return reference.cast<PlannerReference>();
  };
  const auto command = [](const py::object& torque) -> std::optional<Vector7> {
    if (torque.is_none()) return std::nullopt;
    return AsFixed<Vector7>(torque, "received_torque");
  };
  BoundClass<RobotSide<SerialArm<7>>>(
      m, "RobotSide",
      "All of the robot side's work in one control cycle: "
      "the scheme's half, controller, perception.")
      .def_constructor<P>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<RobotSide<SerialArm<7>>>)
      .def("make_state", &RobotSide<SerialArm<7>>::MakeState,
           py::arg("seed") = 0, py::arg("angular_seed") = 1,
           "With the seeds of the filters.")
      .def_static(
          "calc_twist",
          [](const py::object& jacobian, const py::object& v) {
            return CalcTwist<7>(
                {.J_BE = AsFixed<Matrix67>(jacobian, "jacobian")},
                AsFixed<Vector7>(v, "v"));
          },
          py::arg("jacobian"), py::arg("v"),
          "Twist of the tool point, (6,) [linear; angular], with the very bits "
          "that `update` uses.")
      .def_property_readonly(
          "layout",
          [](const RobotSide<SerialArm<7>>& self) {
            return LayoutDict(self.layout());
          },
          kLayoutDoc)
      .def("signals", &Signals<RobotSide<SerialArm<7>>, S>, py::arg("state"),
           kSignalsDoc)
      .def(
          "update",
          [selections, planner, command](
              const RobotSide<SerialArm<7>>& self, double time,
              const py::object& message, const py::object& robot_position,
              const py::object& robot_rotation, const py::object& jacobian,
              const py::object& mass, const py::object& bias,
              const py::object& gravity, const py::object& jdot_v,
              const py::object& q, const py::object& v,
              const py::object& force_selection,
              const py::object& moment_selection,
              const py::object& sensed_wrench, S& state, bool sensor_ready,
              const py::object& contact_normals,
              const py::object& planner_reference, double sensor_age, bool hold,
              const py::object& received_torque) {
            CheckState(self, state);
            self.Update(
                time,
                {.message = MessageFromPython(message),
                 .X_BE = {.p = Vec3(robot_position, "robot_position"),
                          .R = Mat3(robot_rotation, "robot_rotation")},
                 .model = {.J_BE = AsFixed<Matrix67>(jacobian, "jacobian"),
                           .mass = AsFixed<Matrix7>(mass, "mass"),
                           .bias = AsFixed<Vector7>(bias, "bias"),
                           .gravity = AsFixed<Vector7>(gravity, "gravity"),
                           .Jdot_v = AsFixed<Vector6>(jdot_v, "jdot_v")},
                 .q = AsFixed<Vector7>(q, "q"),
                 .v = AsFixed<Vector7>(v, "v"),
                 .selections = selections(force_selection, moment_selection,
                                          contact_normals),
                 .sensed_wrench =
                     AsFixed<Vector6>(sensed_wrench, "sensed_wrench"),
                 .sensor_ready = sensor_ready,
                 .sensor_age = sensor_age,
                 .hold = hold,
                 .received_command = command(received_torque),
                 .planner = planner(planner_reference)},
                &state);
          },
          py::arg("time"), py::arg("message"), py::arg("robot_position"),
          py::arg("robot_rotation"), py::arg("jacobian"), py::arg("mass"),
          py::arg("bias"), py::arg("gravity"), py::arg("jdot_v"), py::arg("q"),
          py::arg("v"), py::arg("force_selection"), py::arg("moment_selection"),
          py::arg("sensed_wrench"), py::arg("state"),
          py::arg("sensor_ready") = true,
          py::arg("contact_normals") = py::none(),
          py::arg("planner_reference") = py::none(),
          py::arg("sensor_age") = 0.0, py::arg("hold") = false,
          py::arg("received_torque") = py::none(),
          "Advances `state` by one period. force_selection, moment_selection, "
          "contact_normals: (3, 3),\nthe directions of contact if somebody "
          "else "
          "knows them; None, all: the side's own filters find them.\nWithout a "
          "sensor "
          "that "
          "is ready the robot holds its place. Six-vectors are [linear; "
          "angular]\nor [force; moment], in B; jacobian (6, 7), mass (7, 7), "
          "bias (7,) without gravity, gravity\n(7,) as Drake's "
          "CalcGravityGeneralizedForces. planner_reference: a PlannerReference "
          "in place of the side's\nown planner, or None. sensor_age: s, of the "
          "sensed "
          "wrench; hold: whether the robot is to hold its place;\n"
          "received_torque: (7,), N m, what the arm got last, or None.");
}

void BindHapticSide(py::module_& m) {
  BindParams<ClutchParams>(m, "ClutchParams",
                           "Parameters of the clutch, which moves the "
                           "device's home.")
      .Fields();
  BindParams<HomingParams>(m, "HomingParams",
                           "How the handle is led to the device's home.")
      .Fields();
  BindParams<WorkspaceWallParams>(m, "WorkspaceWallParams",
                                  "A soft wall at the edge of the device's "
                                  "workspace.")
      .Fields();
  BindParams<GuidanceParams>(m, "GuidanceParams",
                             "A virtual fixture that guides the hand.")
      .Fields();
  BindParams<OperatorAidsParams>(m, "OperatorAidsParams",
                                 "What operators of haptic devices expect of "
                                 "every scheme.")
      .Fields();
  using P = HapticSideParams;
  BindParams<P>(m, "HapticSideParams",
                "Parameters of HapticSide; all `period` fields are the same.")
      .Fields();

  using S = HapticSideState;
  using Q = HapticSetpoint;
  const auto setpoint = [](auto member) {
    return [member](const S& self) { return self.output.setpoint.*member; };
  };
  BindState<S>(m, "HapticSideState",
               "Memory of HapticSide, and the results of the last cycle, in D.")
      .def_property_readonly(
          "device_wrench",
          [](const S& self) { return self.output.device_wrench; },
          "(6,) [force; moment] on the hand, N, N m")
      .def_property_readonly(
          "message",
          [](const S& self) { return MessageToPython(self.message()); },
          "newest message to the robot side")
      .def_property_readonly("reference_force", setpoint(&Q::reference_force),
                             "F_h, on the hand, (3,), N")
      .def_property_readonly("reference_moment", setpoint(&Q::reference_moment),
                             "M_h, on the hand, (3,), N m")
      .def_property_readonly("force_selection", setpoint(&Q::force_selection),
                             "Omega_fh, (3, 3)")
      .def_property_readonly("moment_selection", setpoint(&Q::moment_selection),
                             "(3, 3)")
      .def_property_readonly(
          "proxy_position",
          [](const S& self) { return self.half.output().proxy_pose.p; },
          "x_ph, (3,), m")
      .def_property_readonly(
          "proxy_rotation",
          [](const S& self) { return self.half.output().proxy_pose.R; },
          "(3, 3)")
      .def_property_readonly(
          "link", [](const S& self) { return self.half.output().link; },
          "LinkMonitorState. A copy.")
      .def_property_readonly(
          "bad_inputs", [](const S& self) { return self.output.bad_inputs; },
          "cycles refused so far")
      .def_property_readonly(
          "clutched", [](const S& self) { return self.aids.clutch.clutched; },
          "whether the robot holds its place and the hand is free")
      .def_property_readonly(
          "homing",
          [](const S& self) {
            return self.aids.homing.active && !self.aids.homing.done;
          },
          "whether the handle is on its way home");

  BoundClass<HapticSide>(m, "HapticSide",
                         "All of the haptic side's work in one control cycle: "
                         "the scheme's half and the device's controller.")
      .def_constructor<P>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<HapticSide>)
      .def("make_state", &HapticSide::MakeState)
      .def_property_readonly(
          "layout",
          [](const HapticSide& self) { return LayoutDict(self.layout()); },
          kLayoutDoc)
      .def("signals", &Signals<HapticSide, S>, py::arg("state"), kSignalsDoc)
      .def(
          "update",
          [](const HapticSide& self, double time, const py::object& message,
             const py::object& device_position,
             const py::object& device_rotation,
             const py::object& device_velocity, S& state,
             const py::object& handle_force, bool clutch, bool home,
             double force_scale, double gripper_opening) {
            CheckState(self, state);
            self.Update(
                time,
                {.message = MessageFromPython(message),
                 .X_DH = {.p = Vec3(device_position, "device_position"),
                          .R = Mat3(device_rotation, "device_rotation")},
                 .device_velocity =
                     AsFixed<Vector6>(device_velocity, "device_velocity"),
                 .handle_force = Vec3(handle_force, "handle_force"),
                 .buttons = {.clutch = clutch,
                             .home = home,
                             .force_scale = force_scale},
                 .gripper_opening = gripper_opening},
                &state);
          },
          py::arg("time"), py::arg("message"), py::arg("device_position"),
          py::arg("device_rotation"), py::arg("device_velocity"),
          py::arg("state"),
          py::arg("handle_force") = Eigen::Vector3d(Eigen::Vector3d::Zero()),
          py::arg("clutch") = false, py::arg("home") = false,
          py::arg("force_scale") = 1.0, py::arg("gripper_opening") = kNoGripper,
          "Advances `state` by one period. Device pose from home, velocity "
          "(6,) [linear; angular],\nsensed force of the handle on the hand "
          "(3,), N, in D; clutch pressed, way home asked for,\nand the force "
          "scale, for `params.aids.buttons`; opening of the device's gripper, "
          "m, NaN: none.");
}

}  // namespace

void BindSides(py::module_& m) {
  BindParams<PressureCentreParams>(m, "PressureCentreParams",
                                   "What the angular filter's method "
                                   "\"pressure_centre\" knows of sensor and "
                                   "tool;\nnothing is per update.")
      .Fields();
  BindParams<AngularFilterParams>(
      m, "AngularFilterParams",
      "The angular filter, of moments and angular velocity. In a scenario the "
      "keys of\n`filter`, the paper's, stand directly in `angular_filter`.")
      .Fields();
  BindParams<ContactPerceptionParams>(m, "ContactPerceptionParams",
                                      "Parameters of what a robot side feels.")
      .Fields();
  BindWindowMean(m);
  BindPlanner(m);
  BindRobotSide(m);
  BindHapticSide(m);
}

}  // namespace dual_proxy
