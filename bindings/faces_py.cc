// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <pybind11/stl.h>

#include "dual_proxy/experiment/scenario.h"
#include "dual_proxy/experiment/teleop_loop_params.h"
#include "dual_proxy/faces/blocks.h"
#include "dual_proxy/faces/example_blocks.h"
#include "layout.h"
#include "messages.h"
#include "params.h"

namespace dual_proxy {

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

const char* TypeName(PortType type) {
  switch (type) {
    case PortType::kVector:
      return "vector";
    case PortType::kPose:
      return "pose";
    case PortType::kMessage:
      return "message";
    case PortType::kNormals:
      return "normals";
    default:
      return "reaction";
  }
}

/** What a face remembers; Contexts share it. */
struct PyMemory {
  SharedMemory shared;
};

// What a pose is to Python: (position, rotation).
Pose PoseFromPython(const py::handle& value, const char* name) {
  const auto pair = value.cast<py::tuple>();
  return {.p = Vec3(pair[0], name), .R = Mat3(pair[1], name)};
}

// Reads values that stand in the order of the ports; None is not connected.
// With `by_name` those that are asked for stand alone.
class ValueReader final : public InputPorts {
 public:
  explicit ValueReader(
      py::list values,
      const std::map<std::string, py::object>* by_name = nullptr)
      : values_(std::move(values)), by_name_(by_name) {}

 private:
  [[noreturn]] static void Refuse(const PortText& text,
                                  const std::string& expected,
                                  const std::string& got) {
    throw py::type_error("input port `" + std::string(text.name) +
                         "` expected " + expected + ", got " + got);
  }
  [[noreturn]] static void Refuse(const PortText& text,
                                  const std::string& expected,
                                  const py::object& got) {
    Refuse(text, expected,
           py::type::of(got).attr("__name__").cast<std::string>());
  }

  py::object Find(const PortText& text) {
    if (by_name_ != nullptr) return by_name_->at(text.name);
    return values_[next_++];
  }

  const double* VisitVector(const PortText& text, int size, Need) override {
    const py::object value = Find(text);
    if (value.is_none()) return nullptr;
    // It belongs to the list.
    const auto array = value.cast<py::array_t<double>>();
    if (array.size() != size) ThrowShape(text.name, FixedShape(size, 1), array);
    return array.data();
  }

  bool VisitPose(const PortText& text, Pose* value) override {
    *value = PoseFromPython(Find(text), text.name);
    return true;
  }

  bool VisitMessage(const PortText& text, MessageTag tag,
                    Message* value) override {
    const py::object object = Find(text);
    if (object.is_none()) return false;
    if (!IsMessage(object)) Refuse(text, DescribeTag(tag), object);
    *value = MessageFromPython(object);
    if (value->sequence != -1 && value->tag != tag) {
      Refuse(text, DescribeTag(tag), DescribeTag(value->tag));
    }
    return true;
  }

  bool VisitNormals(const PortText& text, Eigen::Matrix3Xd* value) override {
    const py::object object = Find(text);
    if (object.is_none()) return false;
    if (!py::isinstance<py::array>(object)) Refuse(text, "ndarray", object);
    const auto array = object.cast<py::array_t<double>>();
    if (array.ndim() == 2 && array.shape(0) == 3) {
      *value = object.cast<Eigen::Matrix3Xd>();
    } else {
      // For the algorithm to refuse.
      value->setConstant(3, 1, std::numeric_limits<double>::quiet_NaN());
    }
    return true;
  }

  bool VisitReaction(const PortText& text, int, Vector6* value) override {
    const py::object object = Find(text);
    if (object.is_none()) return false;
    const auto pair = object.cast<py::tuple>();
    *value << Vec3(pair[0], text.name), Vec3(pair[1], text.name);
    return true;
  }

  py::list values_;
  const std::map<std::string, py::object>* by_name_;
  int next_{0};
};

// Takes the port of that index.
class ValueWriter final : public OutputPorts {
 public:
  explicit ValueWriter(int index) : index_(index) {}

  py::object value;

 private:
  bool Visit(const PortText&, PortType, int size, MessageTag,
             const Direct&) override {
    size_ = size;
    return next_++ == index_;
  }
  VectorRef vector() override {
    py::array_t<double> array(size_);
    value = array;
    return Eigen::Map<Eigen::VectorXd>(array.mutable_data(), size_);
  }
  void Set(const Pose& X) override { value = py::make_tuple(X.p, X.R); }
  void Set(const Message& message) override {
    value = MessageToPython(message);
  }
  void Set(const Eigen::Ref<const Eigen::Matrix3Xd>& normals) override {
    value = py::cast(Eigen::Matrix3Xd(normals));
  }

  int index_;
  int next_{0};
  int size_{0};
};

// Writes all ports that have an array.
class ArrayWriter final : public OutputPorts {
 public:
  explicit ArrayWriter(const py::list& arrays) : arrays_(arrays) {}

 private:
  bool Visit(const PortText&, PortType, int, MessageTag,
             const Direct&) override {
    array_ = arrays_[next_++];
    return !array_.is_none();
  }
  VectorRef vector() override {
    auto array = array_.cast<py::array_t<double>>();
    return Eigen::Map<Eigen::VectorXd>(array.mutable_data(), array.size());
  }
  void Set(const Pose&) override {}
  void Set(const Message&) override {}
  void Set(const Eigen::Ref<const Eigen::Matrix3Xd>&) override {}

  const py::list& arrays_;
  py::object array_;
  int next_{0};
};

void BindBlock(py::module_& m) {
  py::class_<PortInfo>(m, "_Port", "What is known of a port of a block.")
      .def_readonly("name", &PortInfo::name)
      .def_readonly("meaning", &PortInfo::meaning)
      .def_property_readonly(
          "type", [](const PortInfo& self) { return TypeName(self.type); },
          "vector, pose, message, normals or reaction")
      .def_readonly("size", &PortInfo::size, "of a vector")
      .def_readonly("tag", &PortInfo::tag, "of messages")
      .def_readonly("joint", &PortInfo::joint, "of a reaction")
      .def_property_readonly(
          "required",
          [](const PortInfo& self) { return self.need != Need::kOptional; },
          "of an input")
      .def_property_readonly(
          "after_start",
          [](const PortInfo& self) { return self.need == Need::kAfterStart; },
          "of an input: at time 0 there is nothing")
      .def_readonly("timed", &PortInfo::timed,
                    "of an output: it changes with time")
      .def_readonly("direct", &PortInfo::direct,
                    "of an output: the inputs that it reads");

  py::class_<PyMemory>(m, "_BlockMemory",
                       "What a block remembers; never changed.")
      .def("__copy__", [](const PyMemory& self) { return self; })
      .def("__deepcopy__",
           [](const py::object& self, const py::object&) { return self; });

  py::class_<Block, std::shared_ptr<Block>>(
      m, "_Block",
      "An algorithm as a block of a block diagram; see systems/faces/block.h.")
      .def_property_readonly("name", &Block::name)
      .def_property_readonly(
          "period", [](const Block& self) { return self.timing().period; },
          "s; 0: it has no memory")
      .def_property_readonly(
          "offset", [](const Block& self) { return self.timing().offset; },
          "s, of the first step")
      .def_property_readonly(
          "feedthrough",
          [](const Block& self) { return self.timing().feedthrough; })
      .def_property_readonly("inputs", &ListInputs)
      .def_property_readonly("outputs", &ListOutputs)
      .def_property_readonly(
          "start", [](const Block& self) { return PyMemory{self.start()}; })
      .def_property_readonly(
          "layout", [](const Block& self) { return LayoutDict(self.layout()); },
          "{signal: slice} of its port `signals`, if it has one.")
      .def(
          "step",
          [](const Block& self, double time, const PyMemory& before,
             const py::list& values, const py::list& arrays) {
            ValueReader inputs(values);
            PyMemory after{self.Step(time, before.shared, &inputs)};
            if (!arrays.empty()) {
              ArrayWriter outputs(arrays);
              self.VisitOutputs(time, *after.shared, nullptr, &outputs);
            }
            return after;
          },
          py::arg("time"), py::arg("before"), py::arg("values"),
          py::arg("arrays"),
          "The memory after a step. values: of the input ports; arrays: to be "
          "filled with the\nvalues of the output ports, of vectors, None for "
          "those that are not wanted; or [].")
      .def(
          "read",
          [](const Block& self, int index, double time, const PyMemory& memory,
             const std::map<std::string, py::object>& values) {
            ValueReader inputs(py::list(), &values);
            ValueWriter output(index);
            self.VisitOutputs(time, *memory.shared, &inputs, &output);
            return output.value;
          },
          py::arg("index"), py::arg("time"), py::arg("memory"),
          py::arg("values"),
          "The value of an output port. values: of the inputs that it reads.");
}

std::optional<Vector7> OptionalVector7(const py::object& value,
                                       const char* name) {
  if (value.is_none()) return std::nullopt;
  return AsFixed<Vector7>(value, name);
}

// As Python holds it: Block's functions are const.
std::shared_ptr<Block> ForPython(const BlockPtr& block) {
  return std::const_pointer_cast<Block>(block);
}

void BindMakers(py::module_& m) {
  const py::arg params("params");
  const py::arg seed("seed");
  const py::arg period("period");
  const py::arg arm("arm");
  const py::arg joint("sensor_joint");
  const py::arg q_start("q_start");
  const py::arg p_SE("p_SE");
  const py::arg path("path");
  Def(
      &m, "_make_RobotSideProxy",
      [](const RobotSideProxyParams& params) {
        return ForPython(MakeRobotSideProxyBlock(params));
      },
      params);
  Def(
      &m, "_make_HapticSideProxy",
      [](const HapticSideProxyParams& params) {
        return ForPython(MakeHapticSideProxyBlock(params));
      },
      params);
  Def(
      &m, "_make_PoseSender",
      [](const PoseSenderParams& params) {
        return ForPython(MakePoseSenderBlock(params));
      },
      params);
  Def(
      &m, "_make_CommunicationChannel",
      [](const CommunicationChannelParams& params, std::uint64_t seed,
         double rate, double period, bool counted, MessageTag tag) {
        return ForPython(MakeCommunicationChannelBlock(params, seed, rate,
                                                       period, counted, tag));
      },
      params, seed, py::arg("rate"), period, py::arg("counted"),
      py::arg("tag"));
  Def(
      &m, "_make_ForceSpaceParticleFilter",
      [](const ForceSpaceParticleFilterParams& params, std::uint64_t seed) {
        return ForPython(MakeForceSpaceParticleFilterBlock(params, seed));
      },
      params, seed);
  Def(
      &m, "_make_ContactHistory",
      [](const ContactHistoryParams& params) {
        return ForPython(MakeContactHistoryBlock(params));
      },
      params);
  Def(
      &m, "_make_WindowMean",
      [](double window, double period) {
        return ForPython(MakeWindowMeanBlock(window, period));
      },
      py::arg("window"), period);
  Def(
      &m, "_make_ArmKinematics",
      [](const ArmModelParams<7>& arm) {
        return ForPython(MakeArmKinematicsBlock(arm));
      },
      arm);
  Def(
      &m, "_make_OperationalSpaceController",
      [](const OperationalSpaceControllerParams<7>& params,
         const ArmModelParams<7>& arm) {
        return ForPython(MakeOperationalSpaceControllerBlock(params, arm));
      },
      params, arm);
  Def(
      &m, "_make_HapticController",
      [](const HapticControllerParams& params) {
        return ForPython(MakeHapticControllerBlock(params));
      },
      params);
  Def(
      &m, "_make_ForceTorqueSensor",
      [](const ForceTorqueSensorParams& params, const py::object& p_SE,
         std::uint64_t seed) {
        return ForPython(MakeForceTorqueSensorBlock(
            params, Vec3(p_SE, "ForceTorqueSensor: p_SE"), seed));
      },
      params, p_SE, seed);
  Def(
      &m, "_make_SimulatedHapticDevice",
      [](const OperatorPath& path, const SimulatedHapticDeviceParams& params) {
        return ForPython(MakeSimulatedHapticDeviceBlock(path.params(), params));
      },
      path, params);
  Def(
      &m, "_make_SensorReaction",
      [](int sensor_joint) {
        return ForPython(MakeSensorReactionBlock(sensor_joint));
      },
      joint);
  Def(
      &m, "_make_RobotSide",
      [](const RobotSideParams<SerialArm<7>>& params,
         const ArmModelParams<7>& arm, const py::object& q_start,
         const std::optional<ForceTorqueSensorParams>& sensor,
         const py::object& p_SE, std::uint64_t seed, std::uint64_t filter_seed,
         std::uint64_t angular_filter_seed) {
        std::optional<RobotSideSensor> simulated;
        if (sensor) {
          simulated = {.params = *sensor,
                       .p_SE = Vec3(p_SE, "RobotSide: p_SE"),
                       .seed = seed};
        }
        return ForPython(MakeRobotSideBlock(
            params, arm, OptionalVector7(q_start, "RobotSide: q_start"),
            simulated, {filter_seed, angular_filter_seed}));
      },
      params, arm, q_start, py::arg("sensor"), p_SE, seed,
      py::arg("filter_seed"), py::arg("angular_filter_seed"));
  Def(
      &m, "_make_HapticSide",
      [](const HapticSideParams& params,
         const std::optional<SimulatedHapticDeviceParams>& device,
         const std::optional<OperatorPath>& path) {
        std::optional<HapticSideDevice> simulated;
        if (device.has_value() != path.has_value()) {
          throw py::value_error("HapticSide: `device` and `path` go together");
        }
        if (device) simulated = {.params = *device, .path = path->params()};
        return ForPython(MakeHapticSideBlock(params, simulated));
      },
      params, py::arg("device"), path);
  Def(
      &m, "_make_TeleopLoop",
      [](const Scenario& scenario, const ArmModelParams<7>& arm,
         int sensor_joint, const py::object& q_start) {
        return ForPython(MakeTeleopLoopBlock(
            MakeTeleopLoopParams<SerialArm<7>>(scenario, arm), sensor_joint,
            OptionalVector7(q_start, "TeleopLoop: q_start")));
      },
      py::arg("scenario"), arm, joint, q_start);
}

}  // namespace

void BindFaces(py::module_& m) {
  BindBlock(m);
  BindMakers(m);
  m.def(
      "_example_blocks",
      [] {
        std::vector<std::shared_ptr<Block>> result;
        for (const BlockPtr& block : MakeExampleBlocks()) {
          result.push_back(ForPython(block));
        }
        return result;
      },
      "See MakeExampleBlocks().");
}

}  // namespace dual_proxy
