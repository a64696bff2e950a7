// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/franka/external_wrench.h"
#include "dual_proxy/drivers/franka/finger_moves.h"
#include "dual_proxy/drivers/franka/franka_robot_side_params.h"
#include "dual_proxy/drivers/franka/push_test.h"
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
  BindParams<FrankaGripperParams>(
      m, "FrankaGripperParams",
      "Parameters of FingerMoves, and of the gripper that it is for.")
      .Fields();

  using F = FingerMoves;
  BoundClass<F>(
      m, "FingerMoves",
      "Makes single moves of a width that changes all the while, for "
      "a gripper that takes nothing else.\nFingers that are stopped on their "
      "way hold what stopped them, until they are told to open wider.")
      .def_constructor<const FrankaGripperParams&>(py::arg("params") =
                                                       FrankaGripperParams())
      .def_property_readonly("params", &ParamsOf<F>)
      .def(
          "next",
          [](F& self, double command, double width, double max_width) {
            return EnumToString(self.Next(command, width, max_width));
          },
          py::arg("command"), py::arg("width"), py::arg("max_width"),
          "\"none\", \"move\" (to `target`) or \"grasp\", once the last has "
          "ended. command: m, between the\nfingers, NaN: there is none; width, "
          "max_width: m, as the gripper says; 0 if it knows no maximum.")
      .def("refuse", &F::Refuse,
           "The gripper refused the last move: the fingers have met nothing.")
      .def_property_readonly("target", &F::target, "m, of the last move");

  using T = FingerTakeover;
  BoundClass<T>(m, "FingerTakeover",
                "Whether a command counts yet: once it has been where the "
                "fingers are. It sees every command.")
      .def_constructor<const FrankaGripperParams&>(py::arg("params") =
                                                       FrankaGripperParams())
      .def("update", &T::Update, py::arg("command"), py::arg("width"),
           "command, width: m, as of FingerMoves.");

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

  using P = PushTest;
  BoundClass<P>(m, "PushTest",
                "Finds out by a push whether a sensor's force has the right "
                "sign and direction: a robot that holds\nits place as a spring "
                "does yields to a hand, and exerts the opposite force on it.")
      .def_constructor<double, double>(
          py::arg("force"), py::arg("period"),
          "force: N, a push is at least that; period: s, between updates.")
      .def(
          "update",
          [](P& self, const py::object& p, const py::object& force) {
            return EnumToString(
                self.Update(Vec3(p, "p"), Vec3(force, "force")));
          },
          py::arg("p"), py::arg("force"),
          "\"none\": nobody has pushed yet, or not enough to tell; "
          "\"passed\"; \"failed\": the force points the\nwrong way. p: (3,), "
          "m, of the tool point; force: (3,), N, of the robot on its "
          "environment as the\nsensor has it. Both in B.")
      .def_property_readonly(
          "cosine", &P::cosine,
          "minus the cosine between displacement and force, of the last push");
}

}  // namespace dual_proxy
