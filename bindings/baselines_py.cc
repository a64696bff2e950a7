// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/baselines/position_force.h"
#include "params.h"

namespace dual_proxy {

void BindBaselines(py::module_& m) {
  using Params = PositionForceHapticSideParams;
  using State = PositionForceHapticSideState;
  BindParams<Params>(m, "PositionForceHapticSideParams",
                     "Parameters of PositionForceHapticSide.")
      .Fields();
  BindState<State>(m, "PositionForceHapticSideState",
                   "State and output of PositionForceHapticSide.")
      .def_property_readonly(
          "reference_force",
          [](const State& self) { return self.reference_force; },
          "F_h, (3,), N, in D: on the hand.")
      .def_property_readonly(
          "sensed_force", [](const State& self) { return self.sensed_force; },
          "F_s of the message in use, (3,), N, in B.")
      .def_readonly("link", &State::link, "State of the link monitor.");
  py::class_<PositionForceHapticSide>(
      m, "PositionForceHapticSide",
      "Haptic side of the two-channel scheme: the sensed force comes straight "
      "back,\nF_h = -force_scale R_DB F_s.")
      .def(py::init<const Params&>(), py::arg("params") = Params())
      .def_property_readonly("params", &ParamsOf<PositionForceHapticSide>)
      .def("make_state", &PositionForceHapticSide::MakeState)
      .def("update", &PositionForceHapticSide::Update, py::arg("time"),
           py::arg("message"), py::arg("state").none(false),
           "Looks at the newest message (ForceMessage), which may be the last "
           "one again.\nSets `state.reference_force`. time: s, receiver's "
           "clock.");
}

}  // namespace dual_proxy
