// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include "dual_proxy/experiment/filter_trial.h"
#include "dual_proxy/experiment/filter_trial_metrics.h"
#include "params.h"

namespace dual_proxy {
namespace {

using Params = FilterTrialParams;
using Sample = FilterTrialSample;
using Intervals = std::vector<FilterTrialInterval>;

/** (n, 2). */
py::array_t<double> AsArray(const Intervals& intervals) {
  const auto n = static_cast<py::ssize_t>(intervals.size());
  py::array_t<double> array({n, py::ssize_t{2}});
  auto view = array.mutable_unchecked<2>();
  for (py::ssize_t i = 0; i < n; ++i) {
    view(i, 0) = intervals[static_cast<std::size_t>(i)].begin;
    view(i, 1) = intervals[static_cast<std::size_t>(i)].end;
  }
  return array;
}

py::array_t<double> AsArray(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()),
                             values.data());
}

/** A field of all samples: (n,) of numbers, (n, 3) of vectors, (n, 3, 3) of
matrices. */
template <typename T>
py::array SampleArray(const std::vector<Sample>& samples, T Sample::* member) {
  const auto n = static_cast<py::ssize_t>(samples.size());
  if constexpr (std::is_arithmetic_v<T>) {
    py::array_t<T> array(n);
    auto view = array.template mutable_unchecked<1>();
    for (py::ssize_t i = 0; i < n; ++i) {
      view(i) = samples[static_cast<std::size_t>(i)].*member;
    }
    return array;
  } else {
    constexpr py::ssize_t kRows = T::RowsAtCompileTime;
    constexpr py::ssize_t kCols = T::ColsAtCompileTime;
    std::vector<py::ssize_t> shape{n, kRows};
    if (kCols > 1) shape.push_back(kCols);
    py::array_t<double> array(shape);
    double* entry = array.mutable_data();
    for (const Sample& sample : samples) {
      for (int row = 0; row < kRows; ++row) {
        for (int col = 0; col < kCols; ++col) {
          *entry++ = (sample.*member)(row, col);
        }
      }
    }
    return array;
  }
}

void BindTrial(py::module_& m) {
  BoundClass<FilterTrial> trial(
      m, "FilterTrial",
      "A trial that was run: arrays of one row per update of the filter, in "
      "B.");
  const auto def = [&trial](const char* name, auto member, const char* doc) {
    trial.def_property_readonly(
        name,
        [member](const FilterTrial& self) {
          return SampleArray(self.samples, member);
        },
        doc);
  };
  def("time", &Sample::time, "(n,), s: end of the period.");
  def("sensed_force", &Sample::sensed_force,
      "F_s, (n, 3), N: the filter's input, mean over the period with noise.");
  def("velocity", &Sample::velocity, "v_BE, (n, 3), m/s: likewise.");
  def("motion_force", &Sample::motion_force,
      "F_m, (n, 3), N: the filter's input, mean over the period.");
  def("contact_force", &Sample::contact_force, "F_f, (n, 3), N: likewise.");
  def("dimension", &Sample::dimension, "(n,): the filter's.");
  def("singular_vectors", &Sample::singular_vectors,
      "U, (n, 3, 3), vectors as columns: the filter's.");
  def("direction_uncertainty", &Sample::direction_uncertainty,
      "(n,), rad: the filter's.");
  def("dimension_confidence", &Sample::dimension_confidence,
      "(n,): the filter's.");
  def("touched", &Sample::touched,
      "(n,) bool: whether the tool touched anything in the period.");
  def("true_dimension", &Sample::true_dimension,
      "(n,): at the end of the period, as all that is true.");
  def("true_force", &Sample::true_force,
      "(n, 3), N: of the robot on the scene, with friction.");
  def("true_normal", &Sample::true_normal,
      "(n, 3): along the sum of the normal forces, unit, INTO the surface, or "
      "zero.");
  def("true_axis", &Sample::true_axis,
      "(n, 3): of dimension 1 the normal, of 2 the axis of free motion; else "
      "zero.");
  def("direction_error", &Sample::direction_error,
      "(n,), rad, 0 to pi/2: between the filter's axis (U1, or U3 at dimension "
      "2) and the\ntrue one where the dimensions agree; else between "
      "true_normal and the force space;\nNaN where filter or truth has no "
      "contact.");
  trial
      .def_property_readonly(
          "contacts",
          [](const FilterTrial& self) { return AsArray(self.contacts); },
          "(k, 2), s: begin and end of each true contact of 0.5 N or more; "
          "infinity if it\noutlasts the trial. Gaps below 50 ms are none.")
      .def_property_readonly(
          "second_walls",
          [](const FilterTrial& self) { return AsArray(self.second_walls); },
          "(k, 2), s: likewise, of a second independent normal force.")
      .def("__len__",
           [](const FilterTrial& self) { return self.samples.size(); });
}

void BindTrialMetrics(py::module_& m) {
  using Metrics = FilterTrialMetrics;
  BoundClass<Metrics> metrics(
      m, "FilterTrialMetrics",
      "What one or more trials come to. Samples count as contact from a true "
      "force of\n0.5 N at their end.");
  metrics.def_constructor<>()
      .def(
          "add",
          [](Metrics& self, const FilterTrial& trial) {
            const py::gil_scoped_release release;
            self.Add(trial);
          },
          py::arg("trial"), "Adds a trial.")
      .def_readonly("samples", &Metrics::samples, "Number of updates.")
      .def_readonly("contact_samples", &Metrics::contact_samples,
                    "Number of updates in contact.")
      .def_readonly("right_dimension_samples",
                    &Metrics::right_dimension_samples,
                    "Of those, with the true dimension.")
      .def_readonly(
          "stated_samples", &Metrics::stated_samples,
          "Of those, of dimension 1 or 2 with a direction_uncertainty "
          "below pi/2.")
      .def_readonly("covered_samples", &Metrics::covered_samples,
                    "Of those, with a direction_error within it.")
      .def_readonly("confident_samples", &Metrics::confident_samples,
                    "Number of updates in contact with a dimension_confidence "
                    "over 0.9.")
      .def_readonly("confident_right_samples",
                    &Metrics::confident_right_samples,
                    "Of those, with the true dimension.")
      .def_readonly("free_samples", &Metrics::free_samples,
                    "Number of updates in whose period nothing was touched.")
      .def_readonly("false_contact_samples", &Metrics::false_contact_samples,
                    "Number of updates with a contact though nothing was "
                    "touched, neither in the\nperiod nor since the filter last "
                    "had none.")
      .def_readonly("dimension_changes", &Metrics::dimension_changes,
                    "Number of changes of the filter's dimension.");
  const auto def = [&metrics](const char* name, auto member, const char* doc) {
    metrics.def_property_readonly(
        name, [member](const Metrics& self) { return AsArray(self.*member); },
        doc);
  };
  def("direction_error", &Metrics::direction_error,
      "(k,), deg: of contact samples where the filter has a contact.");
  def("axis_error", &Metrics::axis_error,
      "(k,), deg: of these, where both dimensions are 2.");
  def("detection_latency", &Metrics::detection_latency,
      "(k,), s: from each contact to the update that shows it; infinity if it "
      "was over\nbefore, and left out if it was over within 100 ms.");
  def("loss_latency", &Metrics::loss_latency,
      "(k,), s: likewise, from each contact's end to dimension 0.");
  def("second_latency", &Metrics::second_latency,
      "(k,), s: likewise, from each second wall to dimension 2.");
}

}  // namespace

void BindFilterTrial(py::module_& m) {
  BindParams<Params>(m, "FilterTrialParams",
                     "Parameters of run_filter_trial(). `seed` decides what is "
                     "not here: the scene's\norientation, details of the path, "
                     "stiffness of contact and controller, the tool's\nradius, "
                     "the noise, the bias's direction, when there are spikes, "
                     "and when the first\nupdate is.")
      .Fields();
  BindTrial(m);
  BindTrialMetrics(m);
  m.attr("_FILTER_TRIAL_SCENES") = EnumNames<FilterTrialScene>();
  m.attr("_FILTER_TRIAL_DRIVES") = EnumNames<FilterTrialDrive>();
  m.attr("_LIKELIHOODS") = EnumNames<Likelihood>();
  Def(
      &m, "run_filter_trial",
      [](const Params& params, const ForceSpaceParticleFilterParams& filter,
         std::uint64_t seed) {
        const py::gil_scoped_release release;
        return RunFilterTrial(params, ForceSpaceParticleFilter(filter), seed);
      },
      py::arg("params") = Params(),
      py::arg("filter") = ForceSpaceParticleFilterParams(), py::arg("seed") = 0,
      "Runs a filter, seeded with `seed`, along a trial: a simulated tool on "
      "analytic\nsurfaces, controlled at 1 kHz. The same arguments give the "
      "same bits.\n\n"
      "Raises ValueError for an invalid parameter or a filter's period below 1 "
      "ms.");
  Def(
      &m, "_measure_filter_cost",
      [](const FilterTrial& trial, const ForceSpaceParticleFilterParams& filter,
         std::uint64_t seed, int repeats) {
        const py::gil_scoped_release release;
        return MeasureFilterCost(trial, ForceSpaceParticleFilter(filter), seed,
                                 repeats);
      },
      py::arg("trial"), py::arg("filter"), py::arg("seed"), py::arg("repeats"),
      "us of the filter's updates per second of the trial, median of repeats.");
}

}  // namespace dual_proxy
