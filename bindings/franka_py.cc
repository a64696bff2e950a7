// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/franka/external_wrench.h"
#include "dual_proxy/drivers/franka/franka_robot_side_params.h"
#include "params.h"

namespace dual_proxy {
namespace {

// Of an array that libfranka gives, as it gives it.
template <int n>
std::array<double, n> ToArray(const py::object& value, const char* name) {
  using Vector = Eigen::Matrix<double, n, 1>;
  std::array<double, n> result;
  Eigen::Map<Vector>(result.data()) = AsFixed<Vector>(value, name);
  return result;
}

}  // namespace

void BindFranka(py::module_& m) {
  BindParams<FrankaLoadParams>(m, "FrankaLoadParams",
                               "What is beyond an arm's flange.")
      .Fields();
  BindParams<FrankaCollisionParams>(
      m, "FrankaCollisionParams",
      "Where an arm says contact, and where it stops with a reflex.")
      .Fields();
  BindParams<FrankaRobotSideParams>(m, "FrankaRobotSideParams",
                                    "How a Panda or FR3 is run.")
      .Fields();

  using S = ExternalWrenchSensor;
  BoundClass<S, ForceTorqueSensorDriver>(
      m, "ExternalWrenchSensor",
      "Franka's estimate of the external wrench in the place of a force "
      "sensor. The adapter that takes it\nhas a tool of no mass: libfranka has "
      "taken the load's weight out.")
      .def_factory(
          [](const ArmModelParams<7>& arm, const py::object& p_SE) {
            return S(arm, Vec3(p_SE, "p_SE"));
          },
          py::arg("arm"), py::arg("p_SE"),
          "arm: ArmModelParams, with E beyond the flange; p_SE: (3,), m, in S, "
          "whose axes are E's: from its\norigin to E.")
      .def(
          "take",
          [](S& self, double time, const py::object& K_F_ext_hat_K,
             const py::object& F_T_EE, const py::object& EE_T_K) {
            self.Take(time, {.K_F_ext_hat_K =
                                 ToArray<6>(K_F_ext_hat_K, "K_F_ext_hat_K"),
                             .F_T_EE = ToArray<16>(F_T_EE, "F_T_EE"),
                             .EE_T_K = ToArray<16>(EE_T_K, "EE_T_K")});
          },
          py::arg("time"), py::arg("K_F_ext_hat_K"), py::arg("F_T_EE"),
          py::arg("EE_T_K"),
          "What libfranka's RobotState said at a time, s: (6,), and (16,) "
          "each, column by column.");
}

}  // namespace dual_proxy
