// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/panda_scene_params.h"
#include "dual_proxy/experiment/scenario.h"
#include "mapping.h"
#include "params.h"

namespace dual_proxy {
namespace {

void BindScene(py::module_& m) {
  using B = BoxParams;
  BindParams<B>(m, "BoxParams",
                "A box fixed in the world that the tool can touch.")
      .Field("name", &B::name, "unique within the scene")
      .Field("center", &B::center, "(3,), m, in B")
      .Field("size", &B::size,
             "(3,), m, full edge lengths along the box's axes, in [1e-4, 10]")
      .Field("yaw", &B::yaw, "rad, rotation of the box about base z, default 0")
      .Field("color", &B::color,
             "(4,), red, green, blue, opacity, in [0, 1], default (0.80, 0.70, "
             "0.56, 1)");

  using P = PandaSceneParams;
  BindParams<P> scene(
      m, "PandaSceneParams",
      "The simulated arm's surroundings and how contact is computed.");
  scene
      .Field("table_height", &P::table_height,
             "m, height of the table's top over B, in [1e-3, 1.5]; the table "
             "stands on z = 0; default 0.1")
      .Field("table_center", &P::table_center,
             "(2,), m, x and y of the table's centre, default (0.5, 0)")
      .Field("table_size", &P::table_size,
             "(2,), m, edge lengths along x and y, in [1e-3, 10], default "
             "(0.6, 0.8)")
      .Field("boxes", &P::boxes,
             "further BoxParams that the tool can touch (walls, steps)")
      .Field("friction", &P::friction,
             "Coulomb coefficient between the tool and everything, in [0, 5], "
             "default 0.3")
      .Field("contact_stiffness", &P::contact_stiffness,
             "N/m, of tool and surface together, in [1, 1e8], default 3e4; the "
             "corners of a flat tool share it")
      .Field("contact_dissipation", &P::contact_dissipation,
             "s/m, Hunt-Crossley coefficient d in f = k x (1 + d dx/dt), in "
             "[0, 1000]; for the approximations lagged and similar; default "
             "10")
      .Field("relaxation_time", &P::relaxation_time,
             "s, linear dissipation in place of contact_dissipation for sap, "
             "in [0, 10], default 0.01")
      .Field("contact_approximation", &P::contact_approximation,
             "\"lagged\", \"similar\" or \"sap\": Drake's discrete contact "
             "approximation; the first two keep Coulomb's law without sap's "
             "gap of friction * time_step * slip; default \"lagged\"")
      .Field("time_step", &P::time_step,
             "s, step of the plant, in [1e-5, 1e-2], default 0.001; control "
             "has a period of its own")
      .Field(
          "tool", &P::tool,
          "\"sphere\": a ball around E, or \"flat\": a square pad, E in the "
          "middle of its face, that touches with a small ball in each corner; "
          "default \"sphere\"")
      .Field(
          "tool_size", &P::tool_size,
          "m, between the corners of a flat tool along its edges, in [0.005, "
          "0.2], default 0.06")
      .Field("tool_mass", &P::tool_mass,
             "kg, of all that is beyond the flange, in [1e-3, 3]; the inertia "
             "scales with it; default 0.2")
      .Field("gravity", &P::gravity,
             "m/s^2, along -z of B, in [0, 100], default 9.81")
      .Field("start_position", &P::start_position,
             "(3,), m, in B, of the tool point at time 0, in [-2, 2], default "
             "(0.45, 0, 0.18)");
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
  BindParams<L> link(m, "LinkParams",
                     "Both directions of the link alike; in a scenario the "
                     "keys of all three stand directly in `link`.");
  link.EmbeddedField("sender", &L::sender, "PoseSenderParams")
      .EmbeddedField("channel", &L::channel, "CommunicationChannelParams")
      .EmbeddedField("monitor", &L::monitor, "LinkMonitorParams");

  using W = Waypoint;
  BindParams<W>(m, "Waypoint", "A place to be at rest at a time.")
      .Field("time", &W::time, "s, in [0, 3600]")
      .Field("position", &W::position, "(3,), m, in B, in [-2, 2]")
      .Field("rotation", &W::rotation,
             "(3,), rad, in B, in [-pi, pi]: rotation vector of the tool from "
             "map.R_cw, default 0");

  using O = OperatorParams;
  BindParams<O>(m, "OperatorParams",
                "What the operator means to do, in the robot's frame B.")
      .Field("waypoints", &O::waypoints,
             "of Waypoint: minimum-jerk moves from each to the next; first at "
             "time 0")
      .Field("recording", &O::recording,
             "CSV file of a human motion, in place of the waypoints (see "
             "dual_proxy.recording); in a scenario's file relative to that, "
             "else to the working directory")
      .Field("recording_units", &O::recording_units,
             "\"m\", \"cm\" or \"mm\", of the positions in it, default "
             "\"m\"")
      .Field("recording_scale", &O::recording_scale,
             "by which its lengths are multiplied, in (0, 1000], default 1")
      .Field("press_depth", &O::press_depth,
             "m, how far below first touch a recording's contact height goes, "
             "in [0, 0.1], default 0.04");
}

void BindScenario(py::module_& m) {
  using A = AngularFilterParams;
  BindParams<A>(m, "AngularFilterParams",
                "The angular filter: a force-space particle filter of moments "
                "and angular\nvelocity. In a scenario the keys of `filter` "
                "stand directly in `angular_filter`.")
      .Field("enabled", &A::enabled, "whether it runs, default false")
      .EmbeddedField(
          "filter", &A::filter,
          "ForceSpaceParticleFilterParams, with N m for N and rad/s for "
          "m/s; thresholds by default (0.08, 0.2, 0.02, 0.1) for update, "
          "(0, 0.05, 0.02, 0.2) for resampling");

  using S = Scenario;
  // The defaults alone are no valid scenario: they have no waypoints.
  BindParams<S> scenario(
      m, "Scenario",
      "The fields of a scenario. Use dual_proxy.Scenario, which adds mappings "
      "and YAML.",
      false);
  scenario.Field("name", &S::name, "top-level key of the YAML file")
      .Field("description", &S::description, "one line")
      .Field("robot", &S::robot, "\"panda\"")
      .Field("scheme", &S::scheme,
             "\"dual_proxy\" or \"position_force\", the two-channel baseline")
      .Field("law", &S::law,
             "\"default\", this project's, or \"printed\", the paper's to the "
             "letter")
      .Field("duration", &S::duration, "s, in [0.001, 3600], default 20")
      .Field("extend_for_delay", &S::extend_for_delay,
             "lengthen the run to the end of the operator's path + 3 x delay "
             "+ 2 s, so that a late release is part of it; setting `duration` "
             "by an override turns this off; default true")
      .Field("seed", &S::seed, "of everything random, >= 0, default 0")
      .Field("control_period", &S::control_period,
             "s, of both sides' control, in [1e-5, 0.01], default 0.001")
      .Field("scene", &S::scene, "PandaSceneParams")
      .Field("map", &S::map, "WorkspaceMapParams; its p_cw is a copy")
      .Field("link", &S::link, "LinkParams")
      .Field("robot_proxy", &S::robot_proxy, "RobotSideProxyParams")
      .Field("controller", &S::controller, "OperationalSpaceControllerParams")
      .Field("filter", &S::filter, "ForceSpaceParticleFilterParams")
      .Field("angular_filter", &S::angular_filter, "AngularFilterParams")
      .Field("haptic_proxy", &S::haptic_proxy, "HapticSideProxyParams")
      .Field("haptic_controller", &S::haptic_controller,
             "HapticControllerParams")
      .Field("position_force", &S::position_force,
             "PositionForceHapticSideParams")
      .Field("device", &S::device, "SimulatedHapticDeviceParams")
      .Field("sensor", &S::sensor, "ForceTorqueSensorParams")
      .Field("operator", &S::operator_params, "OperatorParams");
  auto& cls = scenario.py_class();
  // A file's presets and overrides are more than fields: load_scenario() reads
  // them, Drake's yaml_load_typed() would not.
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
