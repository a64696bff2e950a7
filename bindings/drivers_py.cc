// SPDX-License-Identifier: BSD-3-Clause
#include <optional>

#include "dual_proxy/drivers/cycle_statistics.h"
#include "dual_proxy/drivers/driver.h"
#include "dual_proxy/drivers/hardware_defaults.h"
#include "dual_proxy/drivers/robot_cycle.h"
#include "messages.h"
#include "params.h"

namespace dual_proxy {

void BindOmega(py::module_& m);
void BindFtSensor(py::module_& m);
void BindFranka(py::module_& m);

namespace {

void BindRobotCycle(py::module_& m) {
  using S = RobotCycleState;
  BindState<S>(m, "RobotCycleState",
               "Memory of RobotCycle, and the results of the last cycle.")
      .def_property_readonly(
          "torque", [](const S& self) { return Vector7(self.torque()); },
          "(7,), N m, for the arm")
      .def_property_readonly(
          "message",
          [](const S& self) { return MessageToPython(self.message()); },
          "for the haptic side")
      .def_property_readonly(
          "pose", [](const S& self) { return self.X_BE; },
          "Pose: X_BE. A copy.")
      .def_readonly("side", &S::side, "RobotSideState. Not a copy.")
      .def_property_readonly(
          "sensor", [](const S& self) { return self.sensor; },
          "ForceTorqueAdapterState. A copy.")
      .def_readonly("sensor_time", &S::sensor_time,
                    "s: of the last reading that was taken.");

  using C = RobotCycle;
  BoundClass<C>(m, "RobotCycle",
                "All that a process which has a real arm does in a period, but "
                "for reading and writing:\nthe model's terms, the sensor's "
                "adapter, the robot side.")
      .def_factory(
          [](const RobotSideParams<SerialArm<7>>& side,
             const ArmModelParams<7>& model,
             const ForceTorqueAdapterParams& sensor, const py::object& p_SE) {
            return C({.side = side,
                      .model = model,
                      .sensor = sensor,
                      .p_SE = Vec3(p_SE, "p_SE")});
          },
          py::kw_only(), py::arg("side"), py::arg("model"), py::arg("sensor"),
          py::arg("p_SE"),
          "side: RobotSideParams; model: ArmModelParams, of the arm with all "
          "that is beyond its flange;\nsensor: ForceTorqueAdapterParams, whose "
          "period is the side's; p_SE: (3,), m, in the sensor's\nframe S: from "
          "its origin to the tool point E.")
      .def_property_readonly("period", &C::period, "s")
      .def("make_state", &C::MakeState, py::arg("seed") = 0,
           py::arg("angular_seed") = 1, "With the seeds of the filters.")
      .def(
          "restart",
          [](const C& self, S& state, std::uint64_t seed,
             std::uint64_t angular_seed) {
            self.Restart(&state, seed, angular_seed);
          },
          py::arg("state"), py::arg("seed") = 0, py::arg("angular_seed") = 1,
          "As after a start, but that the sensor's bias stays known: the arm "
          "has been stopped, and may be\nsomewhere else.")
      .def(
          "update",
          [](const C& self, double time, const py::object& q,
             const py::object& v, const py::object& message, S& state,
             double sensor_time, bool sensor_valid, const py::object& measured,
             const py::object& received_torque, bool hold, bool tare,
             bool distrust_sensor) {
            std::optional<Vector7> received;
            if (!received_torque.is_none()) {
              received = AsFixed<Vector7>(received_torque, "received_torque");
            }
            self.Update(
                time,
                {.q = AsFixed<Vector7>(q, "q"),
                 .v = AsFixed<Vector7>(v, "v"),
                 .received_torque = received,
                 .message = MessageFromPython(message),
                 .sensor = {.time = sensor_time,
                            .valid = sensor_valid,
                            .value = AsFixed<Vector6>(measured, "measured")},
                 .hold = hold,
                 .tare = tare,
                 .distrust_sensor = distrust_sensor},
                &state);
          },
          py::arg("time"), py::arg("q"), py::arg("v"), py::arg("message"),
          py::arg("state"), py::kw_only(), py::arg("sensor_time"),
          py::arg("sensor_valid"), py::arg("measured"),
          py::arg("received_torque") = py::none(), py::arg("hold") = false,
          py::arg("tare") = false, py::arg("distrust_sensor") = false,
          "Advances `state` by one period. time: s, not decreasing, "
          "time.monotonic(); q, v: (7,), rad, rad/s;\nmessage: the newest from "
          "the haptic side, stamped by this machine's clock; sensor_time: s, "
          "sensor_valid,\nmeasured: (6,) [force; moment], N, N m, in S, of the "
          "arm on the tool; received_torque: (7,), N m,\nwhat the arm got "
          "last, "
          "or None; hold: whether the robot is to hold its place; tare: "
          "whether "
          "the\nsensor's bias is to be learned anew; distrust_sensor: the "
          "sensor is read, but not to be relied on yet.");
}

void BindCycleStatistics(py::module_& m) {
  using C = CycleStatistics;
  BoundClass<C>(m, "CycleStatistics",
                "How long cycles take, as a histogram of fixed size.")
      .def_constructor<>()
      .def("add", &C::Add, py::arg("duration"), "duration: s.")
      .def("quantile", &C::Quantile, py::arg("probability"),
           "s: the upper end of the half microsecond in which the quantile "
           "lies; beyond 2 ms the maximum.\nprobability: in [0, 1].")
      .def_property_readonly("count", &C::count, "cycles so far")
      .def_property_readonly("max", &C::max, "s");
}

}  // namespace

void BindDrivers(py::module_& m) {
  py::register_exception<DriverError>(m, "DriverError", PyExc_RuntimeError)
      .doc() = "What went wrong with hardware, in one line.";
  m.def("make_hardware_defaults", &MakeHardwareDefaults, py::arg("side"),
        "A copy of `side`, RobotSideParams of a simulation, with what a Panda "
        "or FR3 at the end of a cable\nneeds otherwise: force_gain and "
        "moment_gain at most 0.5, as a torque acts two to three periods "
        "late,\nand actuation_delay 3; no acceleration fed forward; no gravity "
        "compensation, which the arm adds\nitself; a robot that never travels "
        "to where the hand is (proxy.reclutch), so that a scheme whose\nrobot "
        "has to is not valid.");
  BindCycleStatistics(m);
  BindRobotCycle(m);
  BindOmega(m);
  BindFtSensor(m);
  BindFranka(m);
}

}  // namespace dual_proxy
