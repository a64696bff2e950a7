// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/panda_scene_params.h"
#include "dual_proxy/experiment/scenario.h"
#include "dual_proxy/experiment/teleop_loop_params.h"
#include "mapping.h"
#include "params.h"

namespace dual_proxy {
namespace {

void BindScene(py::module_& m) {
  using B = BoxParams;
  BindParams<B>(m, "BoxParams",
                "A box fixed in the world that the tool can touch.")
      .Fields();

  using P = PandaSceneParams;
  BindParams<P> scene(
      m, "PandaSceneParams",
      "The simulated arm's surroundings and how contact is computed.");
  scene.Fields();
  auto& cls = scene.py_class();
  cls.attr("TIP_RADIUS") = kTipRadius;
  cls.attr("CORNER_RADIUS") = kCornerRadius;
  cls.attr("TOOL_MASS") = kToolMass;
  cls.attr("TOOL_COM_S") =
      py::make_tuple(kToolCom.x(), kToolCom.y(), kToolCom.z());
  cls.def(
         "all_boxes", [](const P& self) { return AsTuple(self.AllBoxes()); },
         "The table followed by `boxes`, as BoxParams.")
      .def(
          "corners", [](const P& self) { return AsTuple(self.Corners()); },
          "Centres of a flat tool's corners, four (3,), m, in E.")
      .def_property_readonly(
          "contact_height", &P::contact_height,
          "Height of the tool point when the tool, pointing down, touches the "
          "table, m.");
}

void BindLinkAndOperator(py::module_& m) {
  using L = LinkParams;
  BindParams<L>(m, "LinkParams",
                "Both directions of the link alike; in a scenario the keys of "
                "all three stand directly in `link`.")
      .Fields();

  using W = Waypoint;
  BindParams<W>(m, "Waypoint", "A place to be at rest at a time.").Fields();

  using O = OperatorParams;
  BindParams<O>(m, "OperatorParams",
                "What the operator means to do, in the robot's frame B.")
      .Fields();
}

void BindScenario(py::module_& m) {
  using S = Scenario;
  // The defaults alone are no valid scenario: they have no waypoints.
  BindParams<S> scenario(
      m, "Scenario",
      "The fields of a scenario. Use dual_proxy.Scenario, which adds mappings "
      "and YAML.",
      false);
  scenario.Field("name", &S::name, "top-level key of the YAML file")
      .Fields([](S* self, auto* a) { self->VisitFields(a, true); });
  auto& cls = scenario.py_class();
  // A file's presets and overrides are more than fields: load_scenario() reads
  // them, Drake's yaml_load_typed() would not.
  cls.attr("_fields") = cls.attr("__fields__");
  py::delattr(cls, "__fields__");
  cls.attr("SCHEMES") = EnumNames<Scheme>();
  cls.attr("LAWS") = EnumNames<Law>();
  cls.def(
         "_read",
         [](S& self, const py::dict& mapping) {
           MappingReader::ReadStruct(mapping, self.name, "", &self);
         },
         py::arg("mapping"),
         "Reads what a YAML file has below the scenario's name; presets and "
         "overrides included.\nRaises ScenarioError.")
      .def(
          "_write",
          [](S& self) {
            return MappingWriter::WriteStruct(
                [&self](auto* writer) { self.SerializeSections(writer); });
          },
          "The mapping that _read() reads, without overrides.")
      .def("_apply_presets", &S::ApplyPresets,
           "Sets what `scheme` and `law` decide.")
      .def(
          "_calc_operator_path",
          [](const S& self) {
            PlacedRecording motion;
            if (self.operator_params.recording.empty()) {
              motion.path = self.CalcOperatorPath();
            } else {
              motion = self.CalcRecordedMotion();
            }
            const OperatorPathParams& path = motion.path;
            return py::make_tuple(
                path.times, Eigen::MatrixX3d(path.points.transpose()),
                path.interpolation == PathInterpolation::kCubic,
                Eigen::MatrixX3d(path.rotations.transpose()), motion.scale,
                motion.note);
          },
          "Where the operator means the tool to go: times (n,), s; positions "
          "(n, 3), m, in B;\nwhether it is densely sampled; rotation vectors "
          "from map.R_cw, (n, 3), rad, in B, or (0, 3)\nfor none; of a "
          "recording, lengths in it per length recorded, else 1, and a line "
          "about it,\nelse \"\". Raises "
          "ScenarioError if a recording cannot be read.")
      .def("_resolve_paths", &S::ResolvePaths, py::arg("directory"),
           "Makes `operator.recording` absolute; a relative one is in "
           "`directory`.")
      .def(
          "calc_seed",
          [](const S& self, const py::str& stream) {
            return self.CalcSeed(EnumFromPython<Stream>(stream, "stream"));
          },
          py::arg("stream"),
          "The seed of a stream of random numbers, from `seed`: of the "
          "\"filter\", the \"sensor\", the\nchannels \"to_robot\" and "
          "\"to_device\", the \"angular_filter\".")
      .def_property_readonly(
          "uses_selections",
          [](const S& self) { return UsesSelections(self.scheme); },
          "Whether the scheme has use for what perception finds.")
      .def("robot_side_params", &MakeRobotSideParams<SerialArm<7>>,
           "RobotSideParams of this scenario.")
      .def("haptic_side_params", &MakeHapticSideParams,
           "HapticSideParams of this scenario.")
      .def(
          "handle_path",
          [](const S& self) { return OperatorPath(CalcHandlePath(self)); },
          "OperatorPath: where the operator means the handle to go, in D. "
          "Raises ScenarioError\nif a recording cannot be read.")
      .def_property_readonly(
          "has_angular_filter", &S::has_angular_filter,
          "Whether the angular filter runs: it is enabled, and the scheme has "
          "it.")
      .def("run_duration", &S::CalcRunDuration,
           "How long a run lasts, s; see `extend_for_delay`. Raises "
           "ScenarioError if a recording\ncannot be read.")
      .def(
          "reachable",
          [](const S& self, const py::object& points) {
            const auto array = AsArray(points, "points", "(n, 3)");
            if (array.ndim() != 2 || array.shape(1) != 3) {
              ThrowShape("points", "(n, 3)", array);
            }
            return self.Reachable(array.cast<Eigen::MatrixX3d>().transpose());
          },
          py::arg("points"),
          "Tells which points, (n, 3), m, in B, the device can ask for: (n,) "
          "bool.\n\nThey lie, mapped to the device, within 95 % of its "
          "workspace, and over the table. The set\nis convex.");
}

}  // namespace

void BindScenarios(py::module_& m) {
  py::register_exception<ScenarioError>(m, "ScenarioError", PyExc_ValueError)
      .doc() =
      "A scenario is wrong; the message is one line that names the field.";
  BindScene(m);
  BindLinkAndOperator(m);
  BindScenario(m);
}

}  // namespace dual_proxy
