// SPDX-License-Identifier: BSD-3-Clause
// The C++ LeafSystems for pydrake. pydrake's objects belong to another copy of
// pybind11 than this module's, so its types are unknown here; but they offer
// the method `_pybind11_conduit_v1_`, which hands out raw pointers to whoever
// was built for the same C++ ABI. Through it a C++ system is added to a pydrake
// DiagramBuilder, and messages are read from and written to AbstractValues.
#include <link.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <regex>
#include <string>
#include <typeinfo>
#include <utility>
#include <vector>

#include <drake/systems/framework/diagram_builder.h>
#include <pybind11/stl.h>

#include "dual_proxy/common/window_mean_system.h"
#include "dual_proxy/control/arm_kinematics_system.h"
#include "dual_proxy/control/haptic_controller_system.h"
#include "dual_proxy/control/operational_space_controller_system.h"
#include "dual_proxy/experiment/teleop_loop_params.h"
#include "dual_proxy/link/communication_channel_system.h"
#include "dual_proxy/link/pose_sender_system.h"
#include "dual_proxy/perception/contact_history_system.h"
#include "dual_proxy/perception/force_space_particle_filter_system.h"
#include "dual_proxy/proxy/haptic_side_proxy_system.h"
#include "dual_proxy/proxy/robot_side_proxy_system.h"
#include "dual_proxy/sides/haptic_side_system.h"
#include "dual_proxy/sides/robot_side_system.h"
#include "dual_proxy/simulation/force_torque_sensor_system.h"
#include "dual_proxy/simulation/simulated_haptic_device_system.h"
#include "dual_proxy/station/contact_truth_system.h"
#include "dual_proxy/station/sensor_reaction_system.h"
#include "dual_proxy/station/teleop_loop_system.h"
#include "messages.h"
#include "params.h"

namespace dual_proxy {

namespace {

using drake::AbstractValue;
using drake::systems::DiagramBuilder;
using drake::systems::System;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

// The platform ids of all copies of pybind11 in this interpreter. Each copy
// keeps its internals under a key with its id, in the builtins or in the
// interpreter's own dictionary.
std::vector<std::string> FindPlatformIds() {
  const std::regex pattern("__pybind11_internals_v[0-9]+(.+)__");
  std::vector<std::string> ids;
  for (PyObject* dict : {PyEval_GetBuiltins(), PyInterpreterState_GetDict(
                                                   PyInterpreterState_Get())}) {
    for (const auto& [key, value] : py::reinterpret_borrow<py::dict>(dict)) {
      if (!py::isinstance<py::str>(key)) continue;
      const auto text = key.cast<std::string>();
      std::smatch match;
      if (std::regex_match(text, match, pattern)) ids.push_back(match[1]);
    }
  }
  return ids;
}

// The C++ object behind a pydrake object. @throws TypeError if it is no T.
template <typename T>
T* FromPydrake(const py::handle& object, const char* name) {
  if (py::hasattr(object, "_pybind11_conduit_v1_")) {
    const py::capsule type(&typeid(T), typeid(std::type_info).name());
    for (const std::string& id : FindPlatformIds()) {
      const py::object pointer = object.attr("_pybind11_conduit_v1_")(
          py::bytes(id), type, py::bytes("raw_pointer_ephemeral"));
      if (!pointer.is_none()) {
        return static_cast<T*>(
            py::reinterpret_borrow<py::capsule>(pointer).get_pointer());
      }
    }
  }
  throw py::type_error("`" + std::string(name) + "` expected a pydrake " +
                       drake::NiceTypeName::Get<T>() + ", got " +
                       py::repr(py::type::of(object)).cast<std::string>());
}

template <typename S, typename... Args>
void Add(const py::object& builder, const std::string& name, Args&&... args) {
  FromPydrake<DiagramBuilder<double>>(builder, "builder")
      ->AddNamedSystem(name, std::make_unique<S>(std::forward<Args>(args)...));
}

// Binds add_<face> for a system that is made from its params alone.
template <typename S, typename Params>
void AddFace(py::module_& m, const std::string& face) {
  m.def(("add_" + face).c_str(),
        [](const py::object& builder, const std::string& name,
           const Params& params) { Add<S>(builder, name, params); },
        py::arg("builder"), py::arg("name"), py::arg("params"));
}

// Messages in AbstractValues.

template <typename T>
void SetValue(AbstractValue* abstract, const T& value) {
  T* target = abstract->maybe_get_mutable_value<T>();
  if (target == nullptr) {
    throw py::type_error("`value` expected " + abstract->GetNiceTypeName() +
                         ", got " + drake::NiceTypeName::Get<T>());
  }
  *target = value;
}

void SetFromPython(AbstractValue* abstract, const py::object& value) {
  if (IsMessage(value)) {
    SetValue(abstract, MessageFromPython(value));
  } else {
    SetValue(abstract, value.cast<Matrix3Xd>());
  }
}

// @throws TypeError for a type that SetFromPython() does not make.
py::object GetForPython(const AbstractValue& abstract) {
  if (const auto* message = abstract.maybe_get_value<Message>()) {
    return MessageToPython(*message);
  }
  if (const auto* normals = abstract.maybe_get_value<Matrix3Xd>()) {
    return py::cast(*normals);
  }
  throw py::type_error("`abstract` expected a message or an array, got " +
                       abstract.GetNiceTypeName());
}

// A system that only serves to have its output's value allocated.
template <typename T>
class Prototype final : public drake::systems::LeafSystem<double> {
 public:
  Prototype() {
    DeclareAbstractOutputPort(
        "value", [] { return std::make_unique<drake::Value<T>>(); },
        [](const drake::systems::Context<double>&, AbstractValue*) {});
  }
};

// Two copies of Drake's library in one process do not know each other's types.
int CountDrakeLibraries() {
  int count = 0;
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* data) {
        const char* file = std::strrchr(info->dlpi_name, '/');
        if (file != nullptr && std::strcmp(file, "/libdrake.so") == 0) {
          ++*static_cast<int*>(data);
        }
        return 0;
      },
      &count);
  return count;
}

}  // namespace

PYBIND11_MODULE(_native, m) {
  m.doc() =
      "The C++ LeafSystems for pydrake diagrams. Not for direct use: see "
      "`add_to` of the\nclasses in dual_proxy.systems.";
  const auto framework = py::module_::import("pydrake.systems.framework");
  if (!py::hasattr(framework.attr("DiagramBuilder"), "_pybind11_conduit_v1_")) {
    throw py::import_error(
        "pydrake hands out no C++ objects, as Drake 1.57 and earlier do");
  }
  py::module_::import("dual_proxy._core");
  if (CountDrakeLibraries() != 1) {
    throw py::import_error(
        "dual_proxy._native was built with another copy of libdrake.so than "
        "pydrake's");
  }

  m.def(
      "set_value",
      [](const py::object& abstract, const py::object& value) {
        SetFromPython(FromPydrake<AbstractValue>(abstract, "abstract"), value);
      },
      py::arg("abstract"), py::arg("value"),
      "Puts a message or a (3, k) array into a pydrake "
      "AbstractValue of\nthe C++ type.");
  m.def(
      "get_value",
      [](const py::object& abstract) {
        return GetForPython(*FromPydrake<AbstractValue>(abstract, "abstract"));
      },
      py::arg("abstract"), "A copy of the value that `set_value` puts there.");
  m.def(
      "add_prototype",
      [](const py::object& builder, const std::string& name,
         const py::object& value) {
        if (IsMessage(value)) {
          Add<Prototype<Message>>(builder, name);
        } else {
          Add<Prototype<Matrix3Xd>>(builder, name);
        }
      },
      py::arg("builder"), py::arg("name"), py::arg("value"),
      "Adds a system whose one output port has the C++ type for `value`.");

  AddFace<PoseSenderSystem, PoseSenderParams>(m, "PoseSender");
  AddFace<RobotSideProxySystem, RobotSideProxyParams>(m, "RobotSideProxy");
  AddFace<HapticSideProxySystem, HapticSideProxyParams>(m, "HapticSideProxy");
  AddFace<HapticControllerSystem, HapticControllerParams>(m,
                                                          "HapticController");
  AddFace<ContactHistorySystem, ContactHistoryParams>(m, "ContactHistory");
  m.def(
      "add_CommunicationChannel",
      [](const py::object& builder, const std::string& name,
         const CommunicationChannelParams& params, std::uint64_t seed,
         double rate, double period, MessageTag tag, bool counted) {
        Add<CommunicationChannelSystem>(builder, name, params, seed, rate,
                                        period, counted, tag);
      },
      py::arg("builder"), py::arg("name"), py::arg("params"), py::arg("seed"),
      py::arg("rate"), py::arg("period"), py::arg("tag"), py::arg("counted"));
  m.def(
      "add_ForceSpaceParticleFilter",
      [](const py::object& builder, const std::string& name,
         const ForceSpaceParticleFilterParams& params, std::uint64_t seed) {
        Add<ForceSpaceParticleFilterSystem>(builder, name, params, seed);
      },
      py::arg("builder"), py::arg("name"), py::arg("params"), py::arg("seed"));
  m.def(
      "add_WindowMean",
      [](const py::object& builder, const std::string& name, double window,
         double period) {
        Add<WindowMeanSystem>(builder, name, window, period);
      },
      py::arg("builder"), py::arg("name"), py::arg("window"),
      py::arg("period"));
  m.def(
      "add_ArmKinematics",
      [](const py::object& builder, const std::string& name,
         const ArmModelParams<7>& arm) {
        Add<ArmKinematicsSystem>(builder, name, arm);
      },
      py::arg("builder"), py::arg("name"), py::arg("arm"));
  m.def(
      "add_OperationalSpaceController",
      [](const py::object& builder, const std::string& name,
         const OperationalSpaceControllerParams<7>& params,
         const ArmModelParams<7>& arm) {
        Add<OperationalSpaceControllerSystem>(builder, name, params, arm);
      },
      py::arg("builder"), py::arg("name"), py::arg("params"), py::arg("arm"));
  m.def(
      "add_ForceTorqueSensor",
      [](const py::object& builder, const std::string& name,
         const ForceTorqueSensorParams& params, const py::object& p_SE,
         std::uint64_t seed) {
        Add<ForceTorqueSensorSystem>(builder, name, params,
                                     AsFixed<Vector3d>(p_SE, "p_SE"), seed);
      },
      py::arg("builder"), py::arg("name"), py::arg("params"), py::arg("p_SE"),
      py::arg("seed"));
  m.def(
      "add_SimulatedHapticDevice",
      [](const py::object& builder, const std::string& name,
         const OperatorPath& path, const SimulatedHapticDeviceParams& params) {
        Add<SimulatedHapticDeviceSystem>(builder, name, path.params(), params);
      },
      py::arg("builder"), py::arg("name"), py::arg("path"), py::arg("params"));
  m.def(
      "add_RobotSide",
      [](const py::object& builder, const std::string& name,
         const RobotSideParams<SerialArm<7>>& params,
         const ArmModelParams<7>& arm, const std::optional<py::object>& q_start,
         const std::optional<ForceTorqueSensorParams>& sensor,
         const py::object& p_SE, std::uint64_t seed, std::uint64_t filter_seed,
         std::uint64_t angular_filter_seed) {
        std::optional<Vector7> q;
        if (q_start) q = AsFixed<Vector7>(*q_start, "q_start");
        std::optional<RobotSideSensor> simulated;
        if (sensor) {
          simulated = {.params = *sensor,
                       .p_SE = AsFixed<Vector3d>(p_SE, "p_SE"),
                       .seed = seed};
        }
        Add<RobotSideSystem>(builder, name, params, arm, q, simulated,
                             RobotSideSeeds{filter_seed, angular_filter_seed});
      },
      py::arg("builder"), py::arg("name"), py::arg("params"), py::arg("arm"),
      py::arg("q_start"), py::arg("sensor"), py::arg("p_SE"), py::arg("seed"),
      py::arg("filter_seed"), py::arg("angular_filter_seed"));
  m.def(
      "add_TeleopLoop",
      [](const py::object& builder, const std::string& name,
         const Scenario& scenario, const ArmModelParams<7>& arm,
         int sensor_joint, const std::optional<py::object>& q_start) {
        std::optional<Vector7> q;
        if (q_start) q = AsFixed<Vector7>(*q_start, "q_start");
        Add<TeleopLoopSystem>(builder, name,
                              MakeTeleopLoopParams<SerialArm<7>>(scenario, arm),
                              drake::multibody::JointIndex(sensor_joint), q);
      },
      py::arg("builder"), py::arg("name"), py::arg("scenario"), py::arg("arm"),
      py::arg("sensor_joint"), py::arg("q_start"));
  m.def(
      "add_HapticSide",
      [](const py::object& builder, const std::string& name,
         const HapticSideParams& params,
         const std::optional<SimulatedHapticDeviceParams>& device,
         const std::optional<OperatorPath>& path) {
        std::optional<HapticSideDevice> simulated;
        if (device) simulated = {.params = *device, .path = path->params()};
        Add<HapticSideSystem>(builder, name, params, simulated);
      },
      py::arg("builder"), py::arg("name"), py::arg("params"), py::arg("device"),
      py::arg("path"));
  m.def(
      "add_SensorReaction",
      [](const py::object& builder, const std::string& name, int sensor_joint) {
        Add<SensorReactionSystem>(builder, name,
                                  drake::multibody::JointIndex(sensor_joint));
      },
      py::arg("builder"), py::arg("name"), py::arg("sensor_joint"));
  m.def(
      "add_ContactTruthSystem",
      [](const py::object& builder, const std::string& name, int tool_body,
         bool rotations) {
        Add<ContactTruthSystem>(
            builder, name, drake::multibody::BodyIndex(tool_body), rotations);
      },
      py::arg("builder"), py::arg("name"), py::arg("tool_body"),
      py::arg("rotations"));
}

}  // namespace dual_proxy
