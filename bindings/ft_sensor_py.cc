// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/driver.h"
#include "dual_proxy/drivers/ft_sensor/rdt_sensor.h"
#include "params.h"

namespace dual_proxy {
namespace {

using ForceReading = Reading<Vector6>;

void BindDriver(py::module_& m) {
  BoundClass<ForceReading>(m, "ForceTorqueReading",
                           "What a force/torque sensor measured, and when.")
      .def_readonly("time", &ForceReading::time,
                    "s, of time.monotonic(): when the sensor had this value; "
                    "-inf if never")
      .def_readonly("valid", &ForceReading::valid,
                    "Whether the sensor is there and reports no fault. One "
                    "that is not valid is the last\nthat was.")
      .def_property_readonly(
          "value",
          [](const ForceReading& self) {
            return ReadOnly(py::array_t<double>(py::cast(self.value)));
          },
          "(6,) [force; moment about the sensor's origin], N, N m, in S: of "
          "the arm on the tool")
      .def("age", &ForceReading::Age, py::arg("now"),
           "s: how old it is at `now`, of time.monotonic()");

  using Driver = ForceTorqueSensorDriver;
  py::class_<Driver>(m, "ForceTorqueSensorDriver",
                     "A force/torque sensor at the wrist; a context manager "
                     "that opens and closes it.")
      .def("open", &Driver::Open, py::call_guard<py::gil_scoped_release>(),
           "Returns when there are readings. Raises DriverError.")
      .def("read", &Driver::Read, "Returns the newest reading, at once.")
      .def("close", &Driver::Close, py::call_guard<py::gil_scoped_release>(),
           "May be called at any time, also again.")
      .def_property_readonly("fault", &Driver::fault,
                             "What is wrong with it, in one line; \"\": "
                             "nothing.")
      .def("__enter__",
           [](const py::object& self) {
             self.attr("open")();
             return self;
           })
      .def("__exit__", [](const py::object& self, const py::args&) {
        self.attr("close")();
      });
}

}  // namespace

void BindFtSensor(py::module_& m) {
  BindDriver(m);
  BindParams<RdtSensorParams>(
      m, "RdtSensorParams",
      "Parameters of RdtSensor. S is the frame in which the force is wanted, "
      "N the one in which the\nsensor gives it, with the same origin.")
      .Fields();
  using Counts = RdtCounts;
  py::class_<Counts>(m, "RdtCounts",
                     "What came of the records of a sensor's stream.")
      .def_readonly("taken", &Counts::taken, "newer than all before")
      .def_readonly("lost", &Counts::lost, "not there when a later one came")
      .def_readonly("repeated", &Counts::repeated, "the newest once more")
      .def_readonly("late", &Counts::late,
                    "older than the newest; counted as lost, too")
      .def_readonly("restarts", &Counts::restarts,
                    "of the numbers, by the sensor")
      .def_readonly("malformed", &Counts::malformed,
                    "datagrams that are no record")
      .def_readonly("faulty", &Counts::faulty,
                    "taken, with values that are not valid")
      .def_readonly("requests", &Counts::requests,
                    "how often the stream was asked for");
  BoundClass<RdtSensor, ForceTorqueSensorDriver>(
      m, "RdtSensor",
      "A force/torque sensor that speaks RDT: ATI's Net F/T, Ethernet Axia.\n\n"
      "A thread of its own receives; nothing of the sensor is changed, its "
      "bias least of all.")
      .def_constructor<const RdtSensorParams&>(py::arg("params") =
                                                   RdtSensorParams())
      .def_property_readonly("params", &ParamsOf<RdtSensor>)
      .def_property_readonly("counts", &RdtSensor::counts);
}

}  // namespace dual_proxy
