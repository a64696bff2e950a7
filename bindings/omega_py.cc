// SPDX-License-Identifier: BSD-3-Clause
#include <exception>
#include <memory>

#include "dual_proxy/drivers/omega/omega_device.h"
#include "params.h"

namespace dual_proxy {
namespace {

using Handle = Reading<HandleState>;

void BindReading(py::module_& m) {
  BoundClass<Handle>(m, "HandleReading",
                     "What was read of a haptic device, and when.")
      .def_readonly("time", &Handle::time,
                    "s, of time.monotonic(), at which the device had it")
      .def_readonly("valid", &Handle::valid,
                    "whether the device answered; what is not valid is the "
                    "last that was")
      .def("age", &Handle::Age, py::arg("now"), "s, at `now`.")
      .def_property_readonly(
          "pose", [](const Handle& self) { return self.value.X_DH; },
          "X_DH, Pose, of the handle from the device's home. A copy.")
      .def_property_readonly(
          "velocity", [](const Handle& self) { return self.value.velocity; },
          "(6,) [linear; angular], m/s, rad/s, in D")
      .def_property_readonly(
          "gripper_opening",
          [](const Handle& self) { return self.value.gripper_opening; },
          "m; not a number: no gripper")
      .def_property_readonly(
          "clutch",
          [](const Handle& self) { return self.value.buttons.clutch; },
          "whether it is pressed");
}

void BindCounters(py::module_& m) {
  using C = HapticDeviceCounters;
  BoundClass<C>(m, "HapticDeviceCounters",
                "What a haptic device's thread has counted since it was "
                "opened.")
      .def_readonly("cycles", &C::cycles)
      .def_readonly("overruns", &C::overruns,
                    "cycles that took longer than a period")
      .def_readonly("watchdogs", &C::watchdogs,
                    "times that commands stayed away")
      .def_readonly("device_watchdogs", &C::device_watchdogs,
                    "times that the device found so itself")
      .def_readonly("bad_reads", &C::bad_reads,
                    "failed, not finite or beyond reason")
      .def_readonly("failed_writes", &C::failed_writes,
                    "forces that the device did not take")
      .def_readonly("bad_commands", &C::bad_commands,
                    "not finite, and so not taken");
}

}  // namespace

void BindOmega(py::module_& m) {
  BindReading(m);
  BindCounters(m);
  BindParams<HapticDeviceThreadParams>(
      m, "HapticDeviceThreadParams",
      "Parameters of the thread that serves a haptic device.")
      .Fields();
  BindParams<OmegaDeviceParams>(m, "OmegaDeviceParams",
                                "Parameters of OmegaDevice.")
      .Fields();

  using D = OmegaDevice;
  const auto open = [](D& self) {
    const py::gil_scoped_release release;
    self.Open();
  };
  const auto close = [](D& self) {
    const py::gil_scoped_release release;
    self.Close();
  };
  BoundClass<D>(
      m, "OmegaDevice",
      "An Omega.7, or another device of Force Dimension's, by the vendor's "
      "SDK, "
      "which is loaded\nwhen it is opened (docs/omega.md). A thread of its own "
      "serves the device; `read` and\n`write` exchange newest values with it, "
      "and return at once.")
      .def_factory(
          [](const OmegaDeviceParams& params) {
            return std::make_unique<D>(params);
          },
          py::arg("params") = OmegaDeviceParams{})
      .def("open", open,
           "Finds the device and makes it ready, with no force on the hand. "
           "Raises DriverError.")
      .def("read", &D::Read, "The newest HandleReading.")
      .def(
          "write",
          [](D& self, const py::object& wrench, double gripper_force) {
            self.Write(AsFixed<Vector6>(wrench, "wrench"), gripper_force);
          },
          py::arg("wrench"), py::arg("gripper_force") = 0.0,
          "wrench: (6,) [force; moment] on the hand, N, N m, in D; "
          "gripper_force: N, > 0 opens.\nIt acts until the next call, or the "
          "watchdog. What is not finite is no command.")
      .def("close", close,
           "Takes the force off the hand and lets go of the device.")
      .def("__enter__",
           [open](D& self) -> D& {
             open(self);
             return self;
           })
      .def("__exit__", [close](D& self, const py::args&) { close(self); })
      .def_property_readonly("fault", &D::fault,
                             "What is wrong with it; empty: nothing.")
      .def_property_readonly("name", &D::name,
                             "Which device it is, once it was opened.")
      .def_property_readonly("counters", &D::counters,
                             "HapticDeviceCounters. A copy.")
      .def_property_readonly("real_time", &D::real_time,
                             "Whether its thread has real-time priority.");
}

}  // namespace dual_proxy
