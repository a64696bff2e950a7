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

#include "dual_proxy/faces/block_system.h"
#include "dual_proxy/station/contact_truth_system.h"
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

  m.def(
      "add_block",
      [](const py::object& builder, const std::string& name,
         const std::shared_ptr<Block>& block) {
        Add<BlockSystem>(builder, name, block);
      },
      py::arg("builder"), py::arg("name"), py::arg("block"),
      "Adds a `_core._Block` as a C++ system.");
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
