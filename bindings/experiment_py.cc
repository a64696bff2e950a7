// SPDX-License-Identifier: BSD-3-Clause
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include "dual_proxy/common/arm_limits.h"
#include "dual_proxy/experiment/metrics.h"
#include "dual_proxy/experiment/recording.h"
#include "dual_proxy/experiment/run_log_store.h"
#include "dual_proxy/robots/panda/panda.h"
#include "params.h"
#include "watched.h"

// dual_proxy.metrics and dual_proxy.recording are the typed faces of what is
// bound here.

namespace dual_proxy {

namespace {

/** Rows of three, as numpy keeps them. */
using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
/** Name and values, (n,) or (n, size), of each signal. */
using Signals = std::vector<std::pair<std::string, py::array>>;

/** Looks at the arrays where they are, if they hold doubles column by column;
others are copied. `store` is what they are in, if
it is one. */
RunLog MakeRunLog(Eigen::VectorXd time, const Signals& signals,
                  std::optional<const RunLogStore*> store) {
  using Columns = py::array_t<double, py::array::f_style>;
  const auto copies = std::make_shared<std::vector<Columns>>();
  RunLog log;
  log.time = std::move(time);
  log.storage = copies;
  if (store && *store) log.release = [&file = **store] { file.Release(); };
  for (const auto& [name, array] : signals) {
    py::array values = array;
    if (!py::isinstance<py::array_t<double>>(values) || values.ndim() < 1 ||
        values.strides(0) != sizeof(double)) {
      values = copies->emplace_back(Columns::ensure(values));
    }
    if (!values || values.ndim() < 1 || values.ndim() > 2) {
      throw std::invalid_argument("RunLog: signal `" + name +
                                  "` expected shape (n,) or (n, size)");
    }
    const py::ssize_t size = values.ndim() == 2 ? values.shape(1) : 1;
    const py::ssize_t stride =
        values.ndim() == 2 ? values.strides(1) / py::ssize_t{sizeof(double)}
                           : values.shape(0);
    log.signals.push_back(
        {name, RunLog::Values<>(static_cast<const double*>(values.data()),
                                values.shape(0), size,
                                Eigen::OuterStride<>(stride))});
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

// plugin/robots/panda, for panda.py.
void BindPanda(py::module_& m) {
  const ArmLimits<7> limits;
  py::dict values;
  values["joint_lower"] = limits.joint_lower;
  values["joint_upper"] = limits.joint_upper;
  values["joint_speed"] = limits.joint_speed;
  values["torque"] = limits.torque;
  values["q_rest"] = kPandaQRest;
  values["tool_pointing_down"] = kToolPointingDown;
  values["flange"] = kPandaFlange;
  m.attr("_PANDA") = values;
}

void BindMetrics(py::module_& m) {
  const auto list = [](std::span<const MetricDescription> metrics) {
    std::vector<std::tuple<const char*, const char*, const char*>> result;
    for (const MetricDescription& metric : metrics) {
      result.emplace_back(metric.key, metric.unit, metric.description);
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
      "_metric_limits",
      [] {
        std::vector<std::tuple<const char*, double, double, bool>> result;
        for (const auto& [key, least, most, of_arm] : MetricLimits()) {
          result.emplace_back(key, least, most, of_arm);
        }
        return result;
      },
      "[(key, least, most, whether it is the arm's)] of the metrics that have "
      "limits.");
  m.def(
      "_compute_metrics",
      [](Eigen::VectorXd time, const Signals& signals,
         std::optional<const RunLogStore*> store, const WorkspaceMapParams& map,
         double delay, double control_period,
         std::optional<double> recording_scale, std::optional<double> wall_s) {
        return ComputeMetrics(MakeRunLog(std::move(time), signals, store),
                              {.map = map,
                               .delay = delay,
                               .control_period = control_period,
                               .recording_scale = recording_scale},
                              wall_s);
      },
      py::arg("time"), py::arg("signals"), py::arg("store"), py::arg("map"),
      py::arg("delay"), py::arg("control_period"), py::arg("recording_scale"),
      py::arg("wall_s"),
      "[(key, value)] of every metric, in order.\n\n"
      "time: (n,), s. signals: [(name, (n,) or (n, size))]. store: what they "
      "are in, or None.");
  m.def(
      "_describe_broken_limits",
      [](Eigen::VectorXd time, const Signals& signals,
         std::optional<const RunLogStore*> store, double control_period) {
        return DescribeBrokenLimits(MakeRunLog(std::move(time), signals, store),
                                    {.control_period = control_period});
      },
      py::arg("time"), py::arg("signals"), py::arg("store"),
      py::arg("control_period"),
      "A text for each limit of the arm that was broken; the arguments are "
      "those of\n`_compute_metrics`.");
  m.def(
      "_watch_log",
      [](Eigen::VectorXd time, const Signals& signals,
         std::optional<const RunLogStore*> store, const Scenario& scenario,
         double duration, double rest) {
        RunWatch watch(MakeRunWatchParams(scenario, duration, rest));
        watch.Add(MakeRunLog(std::move(time), signals, store));
        return WatchedList(watch.Summarise());
      },
      py::arg("time"), py::arg("signals"), py::arg("store"),
      py::arg("scenario"), py::arg("duration"), py::arg("rest"),
      "[(name, unit, value, time, most, detail)] of a log; see "
      "experiment/run_watch.h.");
  m.def(
      "_metrics_out",
      [](const Metrics& metrics) { return FindMetricsOut(metrics); },
      py::arg("metrics"),
      "The keys of the metrics [(key, value)] that are not as they should be.");
  m.def("_metrics_json", &MetricsJson, py::arg("metrics"),
        "The text of metrics.json for [(key, value)].");
  m.def(
      "_normal_error_deg",
      [](Eigen::VectorXd time, const Signals& signals,
         std::optional<const RunLogStore*> store) {
        return CalcNormalErrorDeg(MakeRunLog(std::move(time), signals, store));
      },
      py::arg("time"), py::arg("signals"), py::arg("store"),
      "(n,), deg; the arguments are those of `_compute_metrics`.");
  m.def(
      "_map_device_positions",
      [](const WorkspaceMapParams& map, const Eigen::MatrixX3d& x_D) {
        return MapDevicePositions(map, x_D);
      },
      py::arg("map"), py::arg("x_D"), "(n, 3), m, from D to B.");
}

/** An array over what a store holds, which keeps the store. */
template <typename Values>
py::array StoreArray(const py::object& store, const Values& values) {
  const std::vector<py::ssize_t> shape{values.rows(), values.cols()};
  const std::vector<py::ssize_t> strides{
      sizeof(double), py::ssize_t{sizeof(double)} * values.outerStride()};
  py::array array(py::dtype::of<double>(), shape, strides, values.data(),
                  store);
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

void BindRunLogStore(py::module_& m) {
  py::register_local_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const std::system_error& error) {
      const int code = error.code().value();
      const std::string what = error.what();
      // As the operating system's errors are in Python: OSError, number first.
      const py::tuple arguments = py::make_tuple(code, what);
      PyErr_SetObject(PyExc_OSError, arguments.ptr());
    }
  });
  py::class_<RunLogStore, std::shared_ptr<RunLogStore>>(
      m, "_RunLogStore",
      "Takes the rows of a log while they are made; see the C++ header.")
      .def(py::init<int, Eigen::Index>(), py::arg("num_columns"),
           py::arg("capacity"))
      .def(
          "append",
          [](RunLogStore& self, const Eigen::Ref<const Eigen::VectorXd>& times,
             const Eigen::Ref<const Eigen::MatrixXd>& samples) {
            self.Append(times, samples);
          },
          py::arg("times"), py::arg("samples"),
          "times: (n,), s. samples: (num_columns, n).")
      .def("release", &RunLogStore::Release,
           "Gives back the memory that a file's rows occupy after they were "
           "read.")
      .def_property_readonly(
          "time",
          [](const py::object& self) {
            return StoreArray(self, self.cast<const RunLogStore&>().time())
                .attr("reshape")(-1);
          },
          "(num_rows,), s; a view.")
      .def_property_readonly(
          "values",
          [](const py::object& self) {
            const auto& store = self.cast<const RunLogStore&>();
            return StoreArray(self, store.columns(0, store.num_columns()));
          },
          "(num_rows, num_columns); a view.");
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

}  // namespace

void BindExperiment(py::module_& m) {
  BindPanda(m);
  BindRunLogStore(m);
  BindMetrics(m);
  BindRecording(m);
}

}  // namespace dual_proxy
