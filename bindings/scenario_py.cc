// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/bare_engine.h"
#include "dual_proxy/experiment/drake_scene.h"
#include "dual_proxy/experiment/scenario.h"
#include "dual_proxy/experiment/scene_params.h"
#include "dual_proxy/experiment/teleop_loop_params.h"
#include "mapping.h"
#include "params.h"

namespace dual_proxy {
namespace {

void BindScene(py::module_& m) {
  using U = SurfaceParams;
  BindParams<U>(m, "SurfaceParams",
                "A surface fixed in the world that the tool can touch. Of its "
                "lengths it has those that its shape needs and no others.")
      .Fields();

  using P = SceneParams;
  BindParams<P> scene(
      m, "SceneParams",
      "The simulated arm's surroundings and how contact is computed.");
  scene.Fields();
  auto& cls = scene.py_class();
  cls.attr("TIP_RADIUS") = kTipRadius;
  cls.attr("CORNER_RADIUS") = kCornerRadius;
  cls.attr("TOOL_MASS") = kToolMass;
  cls.attr("TOOL_COM_S") =
      py::make_tuple(kToolCom.x(), kToolCom.y(), kToolCom.z());
  cls.def(
         "all_surfaces",
         [](const P& self) { return AsTuple(self.AllSurfaces()); },
         "The table, if there is one, followed by `surfaces`, as "
         "SurfaceParams; "
         "each has a material.")
      .def(
          "contact_surfaces",
          [](const P& self) { return AsTuple(self.ContactSurfaces()); },
          "The same as ContactSurfaceParams.")
      .def(
          "corners", [](const P& self) { return AsTuple(self.Corners()); },
          "Centres of a flat tool's corners, four (3,), m, in E.")
      .def_property_readonly(
          "contact_height", &P::contact_height,
          "Height of the tool point when the tool, pointing down, touches the "
          "table's top, m.");
}

// The scene as Drake's plant takes it, for dual_proxy.panda.
void BindDrakeScene(py::module_& m) {
  py::class_<DrakeMaterial>(m, "_DrakeMaterial")
      .def_readonly("stiffness", &DrakeMaterial::stiffness)
      .def_readonly("dissipation", &DrakeMaterial::dissipation)
      .def_readonly("friction", &DrakeMaterial::friction)
      .def_readonly("relaxation_time", &DrakeMaterial::relaxation_time);
  using S = DrakeSurface;
  py::class_<S>(m, "_DrakeSurface")
      .def_readonly("name", &S::name)
      .def_property_readonly(
          "shape", [](const S& self) { return EnumToString(self.shape); })
      .def_property_readonly("p_BG", [](const S& self) { return self.X_BG.p; })
      .def_property_readonly("R_BG", [](const S& self) { return self.X_BG.R; })
      .def_property_readonly("size", [](const S& self) { return self.size; })
      .def_readonly("radius", &S::radius)
      .def_readonly("length", &S::length)
      .def_property_readonly("color", [](const S& self) { return self.color; })
      .def_readonly("material", &S::material);
  m.def(
      "_make_drake_scene",
      [](const SceneParams& params) {
        const DrakeScene scene = MakeDrakeScene(params);
        return py::make_tuple(scene.ball, scene.surfaces);
      },
      py::arg("params"),
      "Material of each ball of the tool, and list of _DrakeSurface: what "
      "touches; a ball's contact with\na surface has that surface's stiffness "
      "(shared by all balls), dissipation and friction.\nRaises ScenarioError "
      "if there is something that Drake has not.");
  m.def("_make_picture", &MakePicture, py::arg("params"),
        "List of _DrakeSurface: what is to be seen.");
  m.def("_ellipsoid_problem", &EllipsoidProblem, py::arg("geometry"),
        py::arg("body"), py::arg("model"),
        "What is said of a geometry whose contacts would be wrong.");
}

void BindLinkAndOperator(py::module_& m) {
  BindParams<ClockParams>(m, "ClockParams", "A clock that is wrong.").Fields();

  using L = LinkParams;
  BindParams<L>(m, "LinkParams",
                "Both directions of the link alike; in a scenario the keys of "
                "all of them stand directly in `link`.")
      .Fields();

  using W = Waypoint;
  BindParams<W>(m, "Waypoint", "A place to be at rest at a time.").Fields();

  using O = OperatorParams;
  BindParams<O>(m, "OperatorParams",
                "What the operator means to do, in the robot's frame B.")
      .Fields();
}

void BindScenario(py::module_& m) {
  BindParams<InputFault>(m, "InputFault",
                         "An input of the loop that is wrong for a while.")
      .Fields();
  BindParams<ArmMismatchParams>(
      m, "ArmMismatchParams",
      "What a simulated arm is that its controllers do not know of.")
      .Fields();
  BindParams<Claim>(m, "Claim",
                    "What is said of a scene, by the paper or as an aim of "
                    "this project, as a range for one of a run's metrics.")
      .Fields();

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
           "Makes `operator.recording` and `scene.model_directives` absolute; "
           "relative ones are in `directory`.")
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
      .def("simulated_arm_params", &MakeSimulatedArmParams,
           "SimulatedArmParams of engine bare for this scenario.")
      .def("contact_scene_params", &MakeContactSceneParams,
           "ContactSceneParams of engine bare for this scenario. Raises "
           "ScenarioError if it needs Drake.")
      .def(
          "handle_path",
          [](const S& self) { return OperatorPath(CalcHandlePath(self)); },
          "OperatorPath: where the operator means the handle to go, in D. "
          "Raises ScenarioError\nif a recording cannot be read.")
      .def_property_readonly(
          "has_angular_filter", &S::has_angular_filter,
          "Whether the angular filter runs: it is enabled, and the scheme has "
          "it.")
      .def("_check_for_drake", &S::CheckForDrake, py::arg("fused"),
           "Raises ScenarioError if there is something that a Drake diagram "
           "has not; fused: whether the loop is one system.")
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
          "workspace. The set is convex.");
}

}  // namespace

void BindScenarios(py::module_& m) {
  py::register_exception<ScenarioError>(m, "ScenarioError", PyExc_ValueError)
      .doc() =
      "A scenario is wrong; the message is one line that names the field.";
  BindScene(m);
  BindDrakeScene(m);
  BindLinkAndOperator(m);
  BindScenario(m);
}

}  // namespace dual_proxy
