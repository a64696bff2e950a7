// SPDX-License-Identifier: BSD-3-Clause
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "dual_proxy/experiment/bare_engine.h"
#include "dual_proxy/experiment/teleop_loop_params.h"
#include "dual_proxy/loop/loop_signals.h"
#include "dual_proxy/loop/teleop_loop.h"
#include "layout.h"
#include "params.h"
#include "watched.h"

namespace dual_proxy {

namespace {

using Vector14 = Eigen::Matrix<double, 14, 1>;

const char* KindName(SignalKind kind) {
  switch (kind) {
    case SignalKind::kScalar:
      return "scalar";
    case SignalKind::kInteger:
      return "integer";
    case SignalKind::kCounter:
      return "counter";
    case SignalKind::kVector:
      return "vector";
    case SignalKind::kQuaternion:
      return "quaternion";
    case SignalKind::kMatrix:
      return "matrix";
    default:
      return "joints";
  }
}

/** [(name, kind, size, unit, frame, meaning)] of a layout. */
py::list Describe(const std::vector<SignalSlice>& layout) {
  py::list result;
  for (const SignalSlice& signal : layout) {
    result.append(py::make_tuple(signal.name, KindName(signal.kind),
                                 signal.size, signal.unit, signal.frame,
                                 signal.meaning));
  }
  return result;
}

std::optional<RunWatchParams> MakeWatch(const Scenario& scenario,
                                        double duration,
                                        const std::optional<double>& rest) {
  if (!rest) return std::nullopt;
  return MakeRunWatchParams(scenario, duration, *rest);
}

template <typename Plant>
void BindEngine(py::module_& m, const char* name) {
  using E = BareEngine<Plant>;
  py::class_<E>(m, name,
                "Runs a scenario without Drake; see experiment/bare_engine.h.")
      .def("advance_to", py::overload_cast<double>(&E::AdvanceTo),
           py::arg("time"), py::call_guard<py::gil_scoped_release>(),
           "Runs up to `time`, s, and logs every control period.")
      .def(
          "time_cycles",
          [](E& self, double time) {
            std::vector<double> times;
            std::int64_t faults;
            {
              py::gil_scoped_release release;
              times.reserve(static_cast<std::size_t>(1e3 * time) + 10);
              faults = self.AdvanceTo(time, &times);
            }
            return py::make_tuple(
                Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(
                    times.data(), static_cast<Eigen::Index>(times.size()))),
                faults);
          },
          py::arg("time"),
          "Likewise; returns how long each call of the loop took, (n,), s, and "
          "how many pages were first touched in them.")
      .def(
          "watched",
          [](const E& self) { return WatchedList(self.SummariseWatch()); },
          "What was watched so far: [(name, unit, value, time, most, detail)]; "
          "see experiment/run_watch.h.")
      .def_property_readonly(
          "layout", [](const E& self) { return LayoutDict(self.layout()); },
          "{signal: slice} of a row of the log.")
      .def_property_readonly("log", &E::log, "The log so far, a _RunLogStore.");
}

}  // namespace

void BindLoop(py::module_& m) {
  m.def(
      "_signal_catalogue",
      [] {
        RobotSideParams<SerialArm<7>> robot_params;
        robot_params.perception.angular_filter.enabled = true;
        robot_params.planner.active = {{0, 1}};
        robot_params.planner.directions = {Eigen::Vector3d::UnitZ()};
        robot_params.gripper.enabled = true;
        HapticSideParams haptic_params;
        haptic_params.controller.method = HapticControlMethod::kForceFeedback;
        haptic_params.aids.buttons = true;
        const CommunicationChannelState channel =
            CommunicationChannel(CommunicationChannelParams()).MakeState(0);
        py::list result;
        for (const std::vector<SignalSlice>& layout :
             {MakeLayout(VisitHand, Eigen::Vector3d(Eigen::Vector3d::Zero())),
              HapticSide(haptic_params).layout(),
              MakeLayout(VisitDevice, SimulatedHapticDeviceState()),
              RobotSide<SerialArm<7>>(robot_params).layout(),
              RobotSide<PointMass>().layout(),
              MakeLayout(VisitSensor, ForceTorqueSensorState()),
              MakeLayout(VisitChannel, Direction::kToRobot, channel),
              MakeLayout(VisitChannel, Direction::kToDevice, channel),
              MakeLayout(VisitContactTruth, Vector14(Vector14::Zero()),
                         true)}) {
          result.attr("extend")(Describe(layout));
        }
        return result;
      },
      "[(name, kind, size, unit, frame, meaning)] of every signal that a log "
      "may have.");

  BindEngine<SimulatedArm<7>>(m, "_ArmEngine");
  m.def(
      "_make_arm_engine",
      [](const Scenario& scenario, const ArmModelParams<7>& arm,
         const py::object& q_start, double duration,
         const std::optional<double>& rest) {
        return MakeArmEngine(scenario, arm,
                             AsFixed<Vector7>(q_start, "q_start"), duration,
                             MakeWatch(scenario, duration, rest));
      },
      py::arg("scenario"), py::arg("arm"), py::arg("q_start"),
      py::arg("duration"), py::arg("rest") = py::none(),
      "An engine for a scenario with an arm; with `rest`, s, the run is "
      "watched, that long before its end to be at rest, and not logged.");
  BindEngine<PointRobot>(m, "_PointMassEngine");
  m.def(
      "_make_point_mass_engine",
      [](const Scenario& scenario, double duration,
         const std::optional<double>& rest) {
        return MakePointMassEngine(scenario, duration,
                                   MakeWatch(scenario, duration, rest));
      },
      py::arg("scenario"), py::arg("duration"), py::arg("rest") = py::none(),
      "Likewise for a scenario with a point mass.");
}

}  // namespace dual_proxy
