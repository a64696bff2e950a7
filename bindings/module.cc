// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/pybind11.h>

namespace dual_proxy {

void BindLink(pybind11::module_& m);
void BindWire(pybind11::module_& m);
void BindProxy(pybind11::module_& m);
void BindPerception(pybind11::module_& m);
void BindControl(pybind11::module_& m);
void BindSimulation(pybind11::module_& m);
void BindSchemes(pybind11::module_& m);
void BindSides(pybind11::module_& m);
void BindLoop(pybind11::module_& m);
void BindDrivers(pybind11::module_& m);
void BindFaces(pybind11::module_& m);
void BindScenarios(pybind11::module_& m);
void BindExperiment(pybind11::module_& m);
void BindFilterTrial(pybind11::module_& m);

}  // namespace dual_proxy

// In the order of dependence: a default argument's type is bound before it is
// used.
PYBIND11_MODULE(_core, m) {
  m.doc() = "The Drake-free algorithms of dual_proxy.";
  dual_proxy::BindLink(m);
  dual_proxy::BindWire(m);
  dual_proxy::BindProxy(m);
  dual_proxy::BindPerception(m);
  dual_proxy::BindControl(m);
  dual_proxy::BindSimulation(m);
  dual_proxy::BindSchemes(m);
  dual_proxy::BindSides(m);
  dual_proxy::BindDrivers(m);
  dual_proxy::BindScenarios(m);
  dual_proxy::BindLoop(m);
  dual_proxy::BindFaces(m);
  dual_proxy::BindExperiment(m);
  dual_proxy::BindFilterTrial(m);
}
