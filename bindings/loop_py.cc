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

namespace dual_proxy {

namespace {

using Vector11 = Eigen::Matrix<double, 11, 1>;

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

/** A loop's state that nobody changes any more: Contexts share it. */
struct SharedState {
  std::shared_ptr<TeleopLoopState<SerialArm<7>>> state;
};

/** TeleopLoop for pydrake: it makes a new state from an old one, in memory that
it takes from states which nobody holds any more. */
class LoopStepper {
 public:
  explicit LoopStepper(const TeleopLoopParams<SerialArm<7>>& params)
      : loop_(params) {}

  const TeleopLoop<SerialArm<7>>& loop() const { return loop_; }

  SharedState MakeState() const {
    return {std::make_shared<TeleopLoopState<SerialArm<7>>>(loop_.MakeState())};
  }

  SharedState Step(double time, const SharedState& before,
                   const TeleopLoopInput<SerialArm<7>>& input) {
    SharedState after{TakeSpare()};
    *after.state = *before.state;
    loop_.Update(time, input, after.state.get());
    return after;
  }

 private:
  std::shared_ptr<TeleopLoopState<SerialArm<7>>> TakeSpare() {
    for (const auto& spare : spares_) {
      if (spare.use_count() == 1) return spare;
    }
    return spares_.emplace_back(
        std::make_shared<TeleopLoopState<SerialArm<7>>>(loop_.MakeState()));
  }

  TeleopLoop<SerialArm<7>> loop_;
  // As many as there are Contexts, and one.
  std::vector<std::shared_ptr<TeleopLoopState<SerialArm<7>>>> spares_;
};

template <typename Plant>
void BindEngine(py::module_& m, const char* name) {
  using E = BareEngine<Plant>;
  py::class_<E>(m, name,
                "Runs a scenario without Drake; see experiment/bare_engine.h.")
      .def("advance_to", &E::AdvanceTo, py::arg("time"),
           py::call_guard<py::gil_scoped_release>(),
           "Runs up to `time`, s, and logs every control period.")
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
        const CommunicationChannelState channel =
            CommunicationChannel(CommunicationChannelParams()).MakeState(0);
        py::list result;
        for (const std::vector<SignalSlice>& layout :
             {MakeLayout(VisitHand, Eigen::Vector3d(Eigen::Vector3d::Zero())),
              HapticSide().layout(),
              MakeLayout(VisitDevice, SimulatedHapticDeviceState()),
              RobotSide<SerialArm<7>>(robot_params).layout(),
              RobotSide<PointMass>().layout(),
              MakeLayout(VisitSensor, ForceTorqueSensorState()),
              MakeLayout(VisitChannel, Direction::kToRobot, channel),
              MakeLayout(VisitChannel, Direction::kToDevice, channel),
              MakeLayout(VisitContactTruth, Vector11(Vector11::Zero()),
                         true)}) {
          result.attr("extend")(Describe(layout));
        }
        return result;
      },
      "[(name, kind, size, unit, frame, meaning)] of every signal that a log "
      "may have.");

  py::class_<SharedState>(m, "_TeleopLoopState",
                          "Memory of a TeleopLoop; never changed.")
      .def("__copy__", [](const SharedState& self) { return self; })
      .def("__deepcopy__",
           [](const py::object& self, const py::object&) { return self; })
      .def_property_readonly(
          "torque",
          [](const SharedState& self) { return self.state->command(); },
          "(7,), N m, commanded.")
      .def_property_readonly(
          "sensed_wrench",
          [](const SharedState& self) {
            return self.state->sensor.adapter.wrench;
          },
          "(6,) [force; moment], N, N m, in B.")
      .def_property_readonly(
          "device_pose",
          [](const SharedState& self) { return self.state->device.read_pose; },
          "X_DH.")
      .def_property_readonly(
          "device_wrench",
          [](const SharedState& self) {
            return self.state->haptic.output.device_wrench;
          },
          "(6,) [force; moment] on the hand, N, N m, in D.")
      .def_property_readonly(
          "filter",
          [](const SharedState& self) {
            return self.state->robot.perception.force.filter;
          },
          "ForceSpaceParticleFilterState. A copy.")
      .def_property_readonly(
          "angular_filter",
          [](const SharedState& self) {
            return self.state->robot.perception.moment.filter;
          },
          "The angular filter's. A copy.");

  py::class_<LoopStepper>(
      m, "_TeleopLoop",
      "Everything that happens in a control period of a scenario; see "
      "loop/teleop_loop.h.")
      .def(py::init([](const Scenario& scenario, const ArmModelParams<7>& arm) {
             return std::make_unique<LoopStepper>(
                 MakeTeleopLoopParams<SerialArm<7>>(scenario, arm));
           }),
           py::arg("scenario"), py::arg("arm"))
      .def_property_readonly(
          "period",
          [](const LoopStepper& self) { return self.loop().period(); }, "s")
      .def_property_readonly(
          "layout",
          [](const LoopStepper& self) {
            return LayoutDict(self.loop().layout());
          },
          "{signal: slice} of the vector that `step` fills.")
      .def(
          "holding_torque",
          [](const LoopStepper& self, const py::object& q) {
            return self.loop().CalcHoldingTorque(AsFixed<Vector7>(q, "q"));
          },
          py::arg("q"), "(7,), N m: what holds the arm at rest.")
      .def("make_state", &LoopStepper::MakeState)
      .def(
          "step",
          [](LoopStepper& self, double time, const SharedState& before,
             const py::array_t<double>& x, const py::object& force,
             const py::object& moment, py::array_t<double>& torque,
             py::array_t<double>& signals) {
            const auto state = x.unchecked<1>();
            TeleopLoopInput<SerialArm<7>> input;
            for (int i = 0; i < 7; ++i) {
              input.q(i) = state(i);
              input.v(i) = state(7 + i);
            }
            if (!force.is_none()) {
              input.has_reaction = true;
              input.reaction << Vec3(force, "force"), Vec3(moment, "moment");
            }
            SharedState after = self.Step(time, before, input);
            Eigen::Map<Vector7>(torque.mutable_data()) = after.state->command();
            self.loop().WriteSignals(
                *after.state, Eigen::Map<Eigen::VectorXd>(
                                  signals.mutable_data(), signals.size()));
            return after;
          },
          py::arg("time"), py::arg("state"), py::arg("robot_state"),
          py::arg("force"), py::arg("moment"), py::arg("torque"),
          py::arg("signals"),
          "Returns the state after the period at `time`, and writes to "
          "`torque`, "
          "(7,), N m, and\n`signals`, by `layout`. robot_state: (14,), [q; v]. "
          "force, moment: (3,) each, the reaction\nof the arm on the tool in "
          "S, "
          "or None.");

  BindEngine<SimulatedArm<7>>(m, "_ArmEngine");
  m.def(
      "_make_arm_engine",
      [](const Scenario& scenario, const ArmModelParams<7>& arm,
         const py::object& q_start, double duration) {
        return MakeArmEngine(scenario, arm,
                             AsFixed<Vector7>(q_start, "q_start"), duration);
      },
      py::arg("scenario"), py::arg("arm"), py::arg("q_start"),
      py::arg("duration"), "An engine for a scenario with an arm.");
  BindEngine<PointRobot>(m, "_PointMassEngine");
  m.def("_make_point_mass_engine", &MakePointMassEngine, py::arg("scenario"),
        py::arg("duration"), "An engine for a scenario with a point mass.");
}

}  // namespace dual_proxy
