// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/window_mean.h"
#include "dual_proxy/sides/haptic_side.h"
#include "dual_proxy/sides/robot_side.h"
#include "params.h"

namespace dual_proxy {

namespace {

// Arrays and messages are handed out as copies: the state goes on changing.
constexpr auto kCopy = py::return_value_policy::copy;

/** {name: slice(start, stop)} in the order of the vector. */
py::dict LayoutDict(const std::vector<SignalSlice>& layout) {
  py::dict result;
  for (const SignalSlice& signal : layout) {
    result[py::str(signal.name)] =
        py::slice(signal.start, signal.start + signal.size, 1);
  }
  return result;
}

template <typename Side, typename Output>
py::array_t<double> AsVector(const Output& output) {
  py::array_t<double> result(Side::OutputSize());
  Side::WriteVector(output, Eigen::Map<Eigen::VectorXd>(result.mutable_data(),
                                                        result.size()));
  return result;
}

constexpr const char* kAsVectorDoc =
    "All signals as one flat float64 vector, by `output_layout()`.";
constexpr const char* kLayoutDoc =
    "{signal: slice} of `output.as_vector()`, in its order. A 3x3 matrix is "
    "row-major, a rotation a quaternion w, x, y, z.";

void BindWindowMean(py::module_& m) {
  using S = WindowMeanState<3>;
  BindState<S>(m, "WindowMeanState", "Memory of WindowMean, and its result.")
      .def_readonly("mean", &S::mean, kCopy, "(3,), zero before any sample")
      .def_readonly("samples", &S::samples, "in the current window so far")
      .def_readonly("bad_inputs", &S::bad_inputs, "samples refused");

  using M = WindowMean<3>;
  py::class_<M>(m, "WindowMean",
                "Mean of a 3-vector over the current window [k T, (k + 1) T): "
                "what a process that\nruns every T takes.")
      .def(py::init<double>(), py::arg("window"), "window: T, s, > 0.")
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

void BindRobotSide(py::module_& m) {
  using P = RobotSideParams;
  BindParams<P>(m, "RobotSideParams",
                "Parameters of RobotSide; all `period` fields are the same.")
      .Fields();

  using M = FilterMeans;
  BindState<M>(m, "FilterMeans",
               "Inputs of the force-space particle filter, in B.")
      .def_readonly("sensed_force", &M::sensed_force, kCopy, "F_s, (3,), N")
      .def_readonly("velocity", &M::velocity, kCopy, "v_BE, (3,), m/s")
      .def_readonly("motion_force", &M::motion_force, kCopy, "F_m, (3,), N")
      .def_readonly("contact_force", &M::contact_force, kCopy, "F_f, (3,), N");

  using A = AngularFilterMeans;
  BindState<A>(m, "AngularFilterMeans",
               "Inputs of the angular filter, in B; moments about E.")
      .def_readonly("sensed_moment", &A::sensed_moment, kCopy, "M_s, (3,), N m")
      .def_readonly("angular_velocity", &A::angular_velocity, kCopy,
                    "w_BE, (3,), rad/s")
      .def_readonly("motion_moment", &A::motion_moment, kCopy, "M_m, (3,), N m")
      .def_readonly("contact_moment", &A::contact_moment, kCopy,
                    "M_f, (3,), N m");

  using O = RobotSideOutput;
  const auto proxy = [](auto member) {
    return [member](const O& self) { return self.proxy.*member; };
  };
  using Q = RobotSideProxyOutput;
  BindState<O>(m, "RobotSideOutput", "Results of one cycle, in B.")
      .def_property_readonly("motion_error", proxy(&Q::motion_error),
                             "dx_m, (3,), m")
      .def_property_readonly("rotation_error", proxy(&Q::rotation_error),
                             "(3,), rad")
      .def_property_readonly("reference_force", proxy(&Q::reference_force),
                             "F_r, (3,), N")
      .def_property_readonly("reference_moment", proxy(&Q::reference_moment),
                             "M_r, (3,), N m")
      .def_property_readonly("proxy_velocity", proxy(&Q::proxy_velocity),
                             "(6,) [linear; angular]")
      .def_property_readonly("proxy_acceleration",
                             proxy(&Q::proxy_acceleration),
                             "(6,) [linear; angular]")
      .def_property_readonly(
          "proxy_position",
          [](const O& self) { return self.proxy.proxy_pose.p; },
          "x_pr after its limiter, (3,), m")
      .def_property_readonly(
          "proxy_rotation",
          [](const O& self) { return self.proxy.proxy_pose.R; }, "(3, 3)")
      .def_property_readonly("link_status", proxy(&Q::link_status))
      .def_property_readonly("link_age", proxy(&Q::link_age), "s")
      .def_readonly("controller", &O::controller)
      .def_property_readonly(
          "torque", [](const O& self) { return self.controller.torque; },
          "(7,), N m")
      .def_readonly("velocity", &O::v_BE, kCopy, "v_BE, (6,) [linear; angular]")
      .def_readonly("filter_means", &O::filter_means,
                    "means since the filter's last update")
      .def_readonly("angular_filter_means", &O::angular_filter_means,
                    "the same of the angular filter, zero without one")
      .def_readonly("message", &O::message, kCopy,
                    "newest PoseMessage to the haptic side")
      .def_readonly("force_message", &O::force_message, kCopy,
                    "the same for the two-channel baseline")
      .def_readonly("link_dropped", &O::link_dropped, "messages refused so far")
      .def_readonly("bad_inputs", &O::bad_inputs, "cycles refused so far")
      .def("as_vector", &AsVector<RobotSide, O>, kAsVectorDoc);

  using S = RobotSideState;
  BindState<S>(m, "RobotSideState", "Memory of RobotSide.")
      .def_readonly("output", &S::output, "of the last cycle")
      .def_readonly("controller", &S::controller);

  py::class_<RobotSide>(
      m, "RobotSide",
      "All of the robot side's work in one control cycle: proxy, controller, "
      "means for the filter, senders.")
      .def(py::init<P>(), py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<RobotSide>)
      .def("make_state", &RobotSide::MakeState)
      .def_static(
          "calc_twist",
          [](const py::object& jacobian, const py::object& v) {
            return RobotSide::CalcTwist(AsFixed<Matrix67>(jacobian, "jacobian"),
                                        AsFixed<Vector7>(v, "v"));
          },
          py::arg("jacobian"), py::arg("v"),
          "Twist of the tool point, (6,) [linear; angular], with the very bits "
          "that `update` uses.")
      .def_static(
          "output_layout", [] { return LayoutDict(RobotSide::OutputLayout()); },
          kLayoutDoc)
      .def_static("output_size", &RobotSide::OutputSize,
                  "Length of `output.as_vector()`.")
      .def(
          "update",
          [](const RobotSide& self, double time, const PoseMessage& message,
             const py::object& robot_position, const py::object& robot_rotation,
             const py::object& jacobian, const py::object& mass,
             const py::object& bias, const py::object& gravity,
             const py::object& jdot_v, const py::object& q, const py::object& v,
             const py::object& force_selection,
             const py::object& moment_selection,
             const py::object& sensed_wrench, S& state, bool sensor_ready) {
            self.Update(
                time,
                {.message = message,
                 .X_BE = {.p = Vec3(robot_position, "robot_position"),
                          .R = Mat3(robot_rotation, "robot_rotation")},
                 .model = {.J_BE = AsFixed<Matrix67>(jacobian, "jacobian"),
                           .mass = AsFixed<Matrix7>(mass, "mass"),
                           .bias = AsFixed<Vector7>(bias, "bias"),
                           .gravity = AsFixed<Vector7>(gravity, "gravity"),
                           .Jdot_v = AsFixed<Vector6>(jdot_v, "jdot_v")},
                 .q = AsFixed<Vector7>(q, "q"),
                 .v = AsFixed<Vector7>(v, "v"),
                 .force_selection = Mat3(force_selection, "force_selection"),
                 .moment_selection = Mat3(moment_selection, "moment_selection"),
                 .sensed_wrench =
                     AsFixed<Vector6>(sensed_wrench, "sensed_wrench"),
                 .sensor_ready = sensor_ready},
                &state);
          },
          py::arg("time"), py::arg("message"), py::arg("robot_position"),
          py::arg("robot_rotation"), py::arg("jacobian"), py::arg("mass"),
          py::arg("bias"), py::arg("gravity"), py::arg("jdot_v"), py::arg("q"),
          py::arg("v"), py::arg("force_selection"), py::arg("moment_selection"),
          py::arg("sensed_wrench"), py::arg("state"),
          py::arg("sensor_ready") = true,
          "Advances `state` by one period; results are in `state.output`. "
          "Without a sensor that is ready the robot holds its place. "
          "Six-vectors are [linear; angular] or [force; moment], in B; "
          "jacobian (6, 7), mass (7, 7), bias (7,) without gravity, gravity "
          "(7,) as Drake's CalcGravityGeneralizedForces.");
}

void BindHapticSide(py::module_& m) {
  using P = HapticSideParams;
  BindParams<P>(m, "HapticSideParams",
                "Parameters of HapticSide; all `period` fields are the same.")
      .Fields();

  using O = HapticSideOutput;
  using Q = HapticSideProxyOutput;
  const auto proxy = [](auto member) {
    return [member](const O& self) { return self.proxy.*member; };
  };
  BindState<O>(m, "HapticSideOutput", "Results of one cycle, in D.")
      .def_readonly("device_wrench", &O::device_wrench, kCopy,
                    "(6,) [force; moment] on the hand, N, N m")
      .def_property_readonly("reference_force", proxy(&Q::reference_force),
                             "F_h, on the hand, (3,), N")
      .def_property_readonly("reference_moment", proxy(&Q::reference_moment),
                             "M_h, on the hand, (3,), N m")
      .def_property_readonly("force_selection", proxy(&Q::force_selection),
                             "Omega_fh, (3, 3)")
      .def_property_readonly("moment_selection", proxy(&Q::moment_selection),
                             "(3, 3)")
      .def_property_readonly(
          "proxy_position",
          [](const O& self) { return self.proxy.proxy_pose.p; },
          "x_ph, (3,), m")
      .def_property_readonly(
          "proxy_rotation",
          [](const O& self) { return self.proxy.proxy_pose.R; }, "(3, 3)")
      .def_property_readonly("link_status", proxy(&Q::link_status))
      .def_property_readonly("link_age", proxy(&Q::link_age), "s")
      .def_readonly("message", &O::message, kCopy,
                    "newest PoseMessage to the robot side")
      .def_readonly("link_dropped", &O::link_dropped, "messages refused so far")
      .def_readonly("bad_inputs", &O::bad_inputs, "cycles refused so far")
      .def("as_vector", &AsVector<HapticSide, O>, kAsVectorDoc);

  using S = HapticSideState;
  BindState<S>(m, "HapticSideState", "Memory of HapticSide.")
      .def_readonly("output", &S::output, "of the last cycle");

  py::class_<HapticSide>(
      m, "HapticSide",
      "All of the haptic side's work in one control cycle: proxy, device "
      "controller, sender.")
      .def(py::init<P>(), py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<HapticSide>)
      .def("make_state", &HapticSide::MakeState)
      .def_static(
          "output_layout",
          [] { return LayoutDict(HapticSide::OutputLayout()); }, kLayoutDoc)
      .def_static("output_size", &HapticSide::OutputSize,
                  "Length of `output.as_vector()`.")
      .def(
          "update",
          [](const HapticSide& self, double time, const PoseMessage& message,
             const py::object& device_position,
             const py::object& device_rotation,
             const py::object& device_velocity, S& state) {
            self.Update(
                time,
                {.message = message,
                 .X_DH = {.p = Vec3(device_position, "device_position"),
                          .R = Mat3(device_rotation, "device_rotation")},
                 .device_velocity = AsFixed<Eigen::Matrix<double, 6, 1>>(
                     device_velocity, "device_velocity")},
                &state);
          },
          py::arg("time"), py::arg("message"), py::arg("device_position"),
          py::arg("device_rotation"), py::arg("device_velocity"),
          py::arg("state"),
          "Advances `state` by one period; results are in `state.output`. "
          "Device pose from home, velocity (6,) [linear; angular], in D.");
}

}  // namespace

void BindSides(py::module_& m) {
  BindWindowMean(m);
  BindRobotSide(m);
  BindHapticSide(m);
}

}  // namespace dual_proxy
