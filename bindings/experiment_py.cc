// SPDX-License-Identifier: BSD-3-Clause
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include "dual_proxy/experiment/metrics.h"
#include "dual_proxy/experiment/recording.h"
#include "dual_proxy/experiment/rotation_truth.h"
#include "params.h"

// dual_proxy.metrics and dual_proxy.recording are the typed faces of what is
// bound here.

namespace dual_proxy {

namespace {

/** Rows of three, as numpy keeps them. */
using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
/** Name and number of columns of each signal, side by side. */
using Signals = std::vector<std::pair<std::string, int>>;

RunLog MakeRunLog(Eigen::VectorXd time, Eigen::MatrixXd values,
                  const Signals& signals) {
  RunLog log{std::move(time), {}, std::move(values)};
  int start = 0;
  for (const auto& [name, size] : signals) {
    log.signals.push_back({name, start, size});
    start += size;
  }
  log.Validate();
  return log;
}

/** (n, 3, 3), or None if there are none. */
std::optional<py::array_t<double>> RotationArray(
    const std::vector<Eigen::Matrix3d>& rotations) {
  if (rotations.empty()) return {};
  const auto n = static_cast<py::ssize_t>(rotations.size());
  py::array_t<double> array({n, py::ssize_t{3}, py::ssize_t{3}});
  auto view = array.mutable_unchecked<3>();
  for (py::ssize_t k = 0; k < n; ++k) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) view(k, i, j) = rotations[k](i, j);
    }
  }
  return array;
}

void BindMetrics(py::module_& m) {
  const auto list = [](std::span<const MetricDescription> metrics) {
    std::vector<std::tuple<const char*, const char*, const char*>> result;
    for (const auto& [key, unit, description] : metrics) {
      result.emplace_back(key, unit, description);
    }
    return result;
  };
  m.def(
      "_metric_descriptions", [list] { return list(MetricDescriptions()); },
      "[(key, unit, description)] of every metric, in order.");
  m.def(
      "_angular_metric_descriptions",
      [list] { return list(AngularMetricDescriptions()); },
      "The same of those of the angular filter.");
  m.def(
      "_compute_metrics",
      [](Eigen::VectorXd time, Eigen::MatrixXd values, const Signals& signals,
         const WorkspaceMapParams& map, double delay, bool has_filter,
         std::optional<double> recording_scale, std::optional<double> wall_s) {
        return ComputeMetrics(
            MakeRunLog(std::move(time), std::move(values), signals),
            {map, delay, has_filter, recording_scale}, wall_s);
      },
      py::arg("time"), py::arg("values"), py::arg("signals"), py::arg("map"),
      py::arg("delay"), py::arg("has_filter"),
      py::arg("recording_scale"), py::arg("wall_s"),
      "[(key, value)] of every metric, in order.\n\n"
      "time: (n,), s. values: (n, m). signals: [(name, number of columns)].");
  m.def("_metrics_json", &MetricsJson, py::arg("metrics"),
        "The text of metrics.json for [(key, value)].");
  m.def(
      "_normal_error_deg",
      [](Eigen::VectorXd time, Eigen::MatrixXd values, const Signals& signals) {
        return CalcNormalErrorDeg(
            MakeRunLog(std::move(time), std::move(values), signals));
      },
      py::arg("time"), py::arg("values"), py::arg("signals"),
      "(n,), deg; the arguments are those of `_compute_metrics`.");
  m.def(
      "_map_device_positions",
      [](const WorkspaceMapParams& map, const Eigen::MatrixX3d& x_D) {
        return MapDevicePositions(map, x_D);
      },
      py::arg("map"), py::arg("x_D"), "(n, 3), m, from D to B.");
}

void BindRecording(py::module_& m) {
  m.attr("_RECORDING_MOVE_TIME") = kRecordingMoveTime;
  m.attr("_RECORDING_FORMAT") = kRecordingFormat;
  m.attr("_RECORDING_EXAMPLE") = kRecordingExample;
  m.def(
      "_read_recording",
      [](const std::string& path, const py::str& units, double scale) {
        const Recording recording = ReadRecording(
            path, EnumFromPython<LengthUnit>(units, "units"), scale);
        return std::make_tuple(recording.times,
                               Rows3(recording.positions.transpose()),
                               RotationArray(recording.rotations));
      },
      py::arg("path"), py::arg("units"), py::arg("scale"),
      "(times (n,), positions (n, 3), rotations (n, 3, 3) or None).");
  m.def(
      "_place_recording",
      [](const Eigen::VectorXd& times, const Rows3& positions,
         const py::object& start, double contact_height, double press_depth,
         const std::function<bool(const Rows3&)>& reachable) {
        Recording recording;
        recording.times = times;
        recording.positions = positions.transpose();
        const OperatorPathParams path =
            PlaceRecording(recording, Vec3(start, "start"), contact_height,
                           press_depth,
                           [&reachable](const Eigen::Matrix3Xd& points) {
                             return reachable(points.transpose());
                           })
                .path;
        return std::make_tuple(path.times, Rows3(path.points.transpose()));
      },
      py::arg("times"), py::arg("positions"), py::arg("start"),
      py::arg("contact_height"), py::arg("press_depth"), py::arg("reachable"),
      "(times (m,), positions (m, 3)). reachable: whether all of some points, "
      "(n, 3), can be\nreached.");
}

void BindRotationTruth(py::module_& m) {
  py::class_<RotationTruth>(m, "_RotationTruth",
                            "Which rotations the true contacts of the tool "
                            "block; see the C++ header.")
      .def(py::init<>())
      .def(
          "add",
          [](RotationTruth& self, const py::object& p,
             const py::object& normal) {
            self.Add(Vec3(p, "p"), Vec3(normal, "normal"));
          },
          py::arg("p"), py::arg("normal"),
          "Takes one more contact: (3,), m, and a unit vector, (3,), in B.")
      .def_property_readonly("dimension", &RotationTruth::dimension,
                             "Number of directions that are blocked, 0 to 3.")
      .def(
          "calc_free_axis", &RotationTruth::CalcFreeAxis,
          "Unit vector, (3,), in B: the axis of free rotation if there is just "
          "one,\nat dimension 2; zero otherwise.");
}

}  // namespace

void BindExperiment(py::module_& m) {
  BindRotationTruth(m);
  BindMetrics(m);
  BindRecording(m);
}

}  // namespace dual_proxy
