// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/stl.h>

#include <numbers>
#include <optional>
#include <utility>

#include "dual_proxy/perception/contact_history.h"
#include "dual_proxy/perception/force_space_particle_filter.h"
#include "force_torque_adapter.h"
#include "params.h"

namespace dual_proxy {
namespace {

using Algorithm = ForceSpaceParticleFilter;
using Params = ForceSpaceParticleFilterParams;
using State = ForceSpaceParticleFilterState;
using Thresholds = ForceSpaceParticleFilterThresholds;

constexpr const char* kUpdateDoc =
    "Advances the particles by one period and computes the spaces.\n\n"
    "sensed_force: F_s, (3,), N, in B: robot on environment, mean over the "
    "period.\n"
    "velocity: v_BE, (3,), m/s, in B, mean over the period.\n"
    "motion_force: F_m, (3,), N, in B: command in motion space.\n"
    "contact_force: F_f, (3,), N, in B: command in force space.\n"
    "Returns \"ok\", \"bad_input\" (not finite: refused and counted, nothing "
    "else changes) or \"all_weights_zero\" (moved particles kept, centre "
    "added, "
    "counted).";

constexpr const char* kPriorDoc =
    "Replaces the expected normals, which hold until they are replaced.\n\n"
    "normals: (3, k), 0 <= k <= 8, in B, into the surface; normalised here.\n"
    "std: rad, in (0, pi], how sure they are (standard deviation per axis); "
    "params.prior_std\nif None.\n"
    "Raises ValueError unless all are finite and longer than epsilon.";

/** Algorithm and state in one, for scripts. */
struct Filter {
  Filter(const Params& params, std::uint64_t seed)
      : algorithm(params), state(algorithm.MakeState(seed)) {}

  Algorithm algorithm;
  State state;
};

void ThrowUnlessCompatible(const Algorithm& algorithm, const State& state) {
  if (algorithm.IsCompatible(state)) return;
  throw py::value_error(
      "state: expected the state of a filter with num_particles=" +
      std::to_string(algorithm.params().num_particles) +
      " and prior_particles=" +
      std::to_string(algorithm.params().prior_particles) +
      ", got one with another number");
}

const char* Update(const Algorithm& algorithm, const py::object& sensed_force,
                   const py::object& velocity, const py::object& motion_force,
                   const py::object& contact_force, State* state) {
  return EnumToString(algorithm.Update(
      Vec3(sensed_force, "sensed_force"), Vec3(velocity, "velocity"),
      Vec3(motion_force, "motion_force"), Vec3(contact_force, "contact_force"),
      state));
}

/** As a matrix; empty if it is not of shape (3, k) with k <= kMaxPriors. */
std::optional<Eigen::Matrix3Xd> NormalsFromArray(
    const py::array_t<double, py::array::forcecast>& array) {
  if (array.ndim() != 2 || array.shape(0) != 3 ||
      array.shape(1) > Algorithm::kMaxPriors) {
    return std::nullopt;
  }
  Eigen::Matrix3Xd matrix(3, array.shape(1));
  const auto view = array.unchecked<2>();
  for (py::ssize_t i = 0; i < 3; ++i) {
    for (py::ssize_t j = 0; j < array.shape(1); ++j) matrix(i, j) = view(i, j);
  }
  return matrix;
}

void SetPrior(const Algorithm& algorithm, const py::object& normals,
              std::optional<double> std, State* state) {
  const char* expected = "(3, k) with k <= 8";
  const auto array = AsArray(normals, "normals", expected);
  const auto matrix = NormalsFromArray(array);
  if (!matrix) ThrowShape("normals", expected, array);
  if (std && !(*std > 0 && *std <= std::numbers::pi)) {
    throw py::value_error("std: expected a number in (0, pi], got " +
                          py::repr(py::float_(*std)).cast<std::string>());
  }
  if (algorithm.SetPrior(*matrix, std.value_or(algorithm.params().prior_std),
                         state) != FilterStatus::kOk) {
    throw py::value_error(
        "normals: expected finite vectors longer than epsilon, got " +
        py::repr(array).cast<std::string>());
  }
}

const char* OfferPrior(const Algorithm& algorithm, const py::object& normals,
                       State* state) {
  const auto array = py::array_t<double, py::array::forcecast>::ensure(normals);
  if (!array) PyErr_Clear();
  const auto matrix = array ? NormalsFromArray(array) : std::nullopt;
  if (!matrix) {
    ++state->bad_inputs;
    return EnumToString(FilterStatus::kBadInput);
  }
  return EnumToString(algorithm.SetPrior(*matrix, state));
}

/** What the filter found, for the state and for the filter alike. */
template <typename Class, typename GetState>
void DefResult(BoundClass<Class>* cls, GetState get) {
  const auto def = [cls, get](const char* name, auto member, const char* doc) {
    cls->def_property_readonly(
        name, [get, member](const Class& self) { return get(self).*member; },
        doc);
  };
  def("particles", &State::particles,
      "(3, n), in B: unit vectors into the surface, or zero for no contact. A "
      "copy.");
  def("dimension", &State::dimension,
      "0 to 3: number of directions in force space.");
  def("force_selection", &State::force_selection,
      "Omega_f, (3, 3), in B: orthogonal projection onto force space.");
  def("motion_selection", &State::motion_selection,
      "Omega_m = I - Omega_f, (3, 3), in B.");
  def("singular_values", &State::singular_values,
      "(3,), decreasing: of the particles.");
  def("singular_vectors", &State::singular_vectors,
      "U, (3, 3), vectors as columns, in B, right-handed; U1 points into the "
      "surface.");
  def("contact_normals", &State::contact_normals,
      "(3, 3), unit vectors INTO the surfaces as columns, in B; zero: none, or "
      "not known.");
  cls->def_property_readonly(
      "prior",
      [get](const Class& self) -> Eigen::Matrix3Xd {
        return get(self).prior.leftCols(get(self).num_priors);
      },
      "(3, k), unit vectors in B: the expected normals.");
  def("direction_uncertainty", &State::direction_uncertainty,
      "rad: the true direction is within this angle with 95 %: U1 at dimension "
      "1, U3 at 2.\npi/2 at 0 and with likelihood \"paper\"; 0 at 3.");
  def("dimension_confidence", &State::dimension_confidence,
      "0 to 1: the probability that the dimension is right; 0 with likelihood "
      "\"paper\".");
  def("updates", &State::updates, "Number of updates carried out.");
  def("all_weights_zero", &State::all_weights_zero,
      "Number of updates in which nothing was likely.");
  def("bad_inputs", &State::bad_inputs, "Number of calls refused.");
}

void BindContactHistory(py::module_& m) {
  using History = ContactHistory;
  using Params = ContactHistoryParams;
  using State = ContactHistoryState;

  BindParams<Params>(m, "ContactHistoryParams", "Parameters of ContactHistory.")
      .Fields();

  const auto def = [](auto* cls, const char* name, auto member,
                      const char* doc) {
    cls->def_property_readonly(
        name, [member](const State& self) { return self.*member; }, doc);
  };
  auto state =
      BindState<State>(m, "ContactHistoryState", "What the history remembers.");
  def(&state, "updates", &State::updates, "Number of updates carried out.");
  def(&state, "bad_inputs", &State::bad_inputs, "Number of updates refused.");

  const auto check = [](const History& self, const State& state) {
    if (self.IsCompatible(state)) return;
    throw py::value_error(
        "state: expected that of a history with capacity=" +
        std::to_string(self.params().capacity) +
        ", got one with capacity=" + std::to_string(state.cells.size()));
  };
  BoundClass<History>(
      m, "ContactHistory",
      "Remembers which contact normals were believed where, so that a place "
      "visited again\ngives them as a prior (section IV.C of the paper). Its "
      "state is made by make_state().\n\nA visit of a cell ends when the tool "
      "goes on to another, and gives its prior to later\nvisits, not to "
      "itself. Passing a place without contact notes and erases nothing.")
      .def_constructor<const Params&>(py::arg("params") = Params())
      .def_property_readonly("params", &ParamsOf<History>)
      .def("make_state", &History::MakeState, "Nothing remembered.")
      .def(
          "update",
          [check](const History& self, const py::object& position,
                  const py::object& normals, State* state) {
            check(self, *state);
            const char* expected = "(3, d) with d <= 8";
            const auto array = AsArray(normals, "normals", expected);
            const auto matrix = NormalsFromArray(array);
            if (!matrix) ThrowShape("normals", expected, array);
            return EnumToString(
                self.Update(Vec3(position, "position"), *matrix, state));
          },
          py::arg("position"), py::arg("normals"), py::arg("state"),
          "Notes what is believed here.\n\n"
          "position: p_BE, (3,), m, in B: where the tool point is.\n"
          "normals: (3, d), 0 <= d <= 8, in B, into the surface; normalised "
          "here.\n"
          "Returns \"ok\" or \"bad_input\" (not finite, shorter than 1e-6, or "
          "a million cells away:\nrefused and counted, nothing else changes).")
      .def(
          "update_from_selection",
          [check](const History& self, const py::object& position,
                  const py::object& force_selection,
                  const py::object& force_direction, State* state) {
            check(self, *state);
            return EnumToString(self.UpdateFromSelection(
                Vec3(position, "position"),
                Mat3(force_selection, "force_selection"),
                Vec3(force_direction, "force_direction"), state));
          },
          py::arg("position"), py::arg("force_selection"),
          py::arg("force_direction"), py::arg("state"),
          "As update, from what the ports of the filter say.\n\n"
          "force_selection: Omega_f, (3, 3), in B.\n"
          "force_direction: U1, (3,), in B; zero without contact.\n"
          "Notes U1, and where Omega_f is of rank 2 also both directions "
          "across "
          "it in force space.")
      .def(
          "lookup",
          [check](const History& self, const py::object& position,
                  const State& state) {
            check(self, state);
            const RememberedContacts prior =
                self.Lookup(Vec3(position, "position"), state);
            return std::pair(Eigen::Matrix3Xd(prior.normals), prior.std);
          },
          py::arg("position"), py::arg("state"),
          "What was believed near `position` (p_BE, (3,), m, in B) on earlier "
          "visits.\n\n"
          "Returns (normals, std): (3, k), k <= 8, unit normals in B, into the "
          "surface, of the\nnearest memory first; and how uncertain the least "
          "sure of them is, rad.");
}

void BindForceTorqueAdapter(py::module_& m) {
  using P = ForceTorqueAdapterParams;
  BindParams<P>(m, "ForceTorqueAdapterParams",
                "Parameters of ForceTorqueAdapter.")
      .Fields();
  using S = ForceTorqueAdapterState;
  BindState<S>(m, "ForceTorqueAdapterState",
               "What the adapter remembers, and its output.")
      .def_property_readonly(
          "wrench", [](const S& self) { return self.wrench; },
          "(6,) [force; moment] about E, N and N m, in B: robot on "
          "environment; zero while the bias is being learned.")
      .def_property_readonly(
          "bias", [](const S& self) { return self.bias; },
          "(6,) [force; moment], N and N m, in S.")
      .def_readonly("ready", &S::ready, "Whether there is a bias to go by.")
      .def_readonly("tares", &S::tares, "How often a bias was learned.")
      .def_readonly("tares_refused", &S::tares_refused,
                    "How often none could be though the tool was at rest.")
      .def_readonly("bad_inputs", &S::bad_inputs, "Samples refused.");
  BoundClass<ForceTorqueAdapter>(
      m, "ForceTorqueAdapter",
      "From what a wrist sensor measures to what the tool exerts on its "
      "environment: bias, weight\nand inertia of the tool, sign.")
      .def_constructor<const P&>(py::arg("params") = P())
      .def_property_readonly("params", &ParamsOf<ForceTorqueAdapter>)
      .def("make_state", &ForceTorqueAdapter::MakeState)
      .def(
          "update",
          [](const ForceTorqueAdapter& self, const py::object& measured,
             const py::object& robot_position, const py::object& robot_rotation,
             const py::object& p_SE, S& state, bool tare,
             const py::object& robot_velocity) {
            self.Update({.measured = AsFixed<Eigen::Matrix<double, 6, 1>>(
                             measured, "measured"),
                         .X_BE = {.p = Vec3(robot_position, "robot_position"),
                                  .R = Mat3(robot_rotation, "robot_rotation")},
                         .v_BE = OptionalVelocity(robot_velocity),
                         .p_SE = Vec3(p_SE, "p_SE"),
                         .tare = tare},
                        &state);
          },
          py::arg("measured"), py::arg("robot_position"),
          py::arg("robot_rotation"), py::arg("p_SE"), py::arg("state"),
          py::arg("tare") = false, py::arg("robot_velocity") = py::none(),
          "Takes a sample; the result is in `state`.\n\n"
          "measured: (6,) [force; moment] about the origin of S, N and N m, in "
          "S: arm on tool.\n"
          "robot_position (3,), m, and robot_rotation (3, 3): of the tool "
          "point. p_SE: (3,), m, tool point in S.\n"
          "tare: asks for the bias to be learned anew when it becomes true.\n"
          "robot_velocity: (6,) [linear; angular], m/s, rad/s, in B: of the "
          "tool point, if known;\nwithout, it is taken from the poses.");
}

}  // namespace

void BindPerception(py::module_& m) {
  BindParams<Thresholds>(
      m, "ForceSpaceParticleFilterThresholds",
      "Corners of the force and the velocity ramp of the likelihood, eq. (6) "
      "and (7).")
      .Fields();

  BindParams<FrictionConeParams>(m, "FrictionConeParams",
                                 "What likelihood \"friction_cone\" knows of "
                                 "sensors and surfaces; nothing "
                                 "is per update.")
      .Fields();

  BindParams<Params>(m, "ForceSpaceParticleFilterParams",
                     "Parameters of ForceSpaceParticleFilter; the defaults are "
                     "the paper's where it gives a number.")
      .Fields();

  auto state = BindState<State>(
      m, "ForceSpaceParticleFilterState",
      "What the filter remembers, and its result; with its random generator.");
  DefResult(&state, [](const State& self) -> const State& { return self; });

  BoundClass<Algorithm>(m, "ForceSpaceParticleFilterAlgorithm",
                        "The force-space particle filter without its state; "
                        "see ForceSpaceParticleFilter.")
      .def_constructor<const Params&>(py::arg("params") = Params())
      .def_property_readonly("params", &ParamsOf<Algorithm>)
      .def("make_state", &Algorithm::MakeState, py::arg("seed") = 0,
           "Every particle at the centre. The same seed gives the same bits.")
      .def(
          "update",
          [](const Algorithm& self, const py::object& sensed_force,
             const py::object& velocity, const py::object& motion_force,
             const py::object& contact_force, State* state) {
            ThrowUnlessCompatible(self, *state);
            return Update(self, sensed_force, velocity, motion_force,
                          contact_force, state);
          },
          py::arg("sensed_force"), py::arg("velocity"), py::arg("motion_force"),
          py::arg("contact_force"), py::arg("state"), kUpdateDoc)
      .def(
          "set_prior",
          [](const Algorithm& self, const py::object& normals, State* state,
             std::optional<double> std) {
            SetPrior(self, normals, std, state);
          },
          py::arg("normals"), py::arg("state"), py::arg("std") = py::none(),
          kPriorDoc)
      .def("offer_prior", &OfferPrior, py::arg("normals"), py::arg("state"),
           "As set_prior, but never raises: normals that it would refuse "
           "change nothing, are\ncounted in `state.bad_inputs`, and give "
           "\"bad_input\" instead of \"ok\".");

  BoundClass<Filter> filter(
      m, "ForceSpaceParticleFilter",
      "Estimates the contact directions at the tool from force, velocity and "
      "commands\n(section IV of the paper), together with its state.");
  filter
      .def_constructor<const Params&, std::uint64_t>(
          py::arg("params") = Params(), py::arg("seed") = 0)
      .def_property_readonly("params",
                             [](const Filter& self) {
                               return ReadOnlyCopy(self.algorithm.params());
                             })
      .def(
          "update",
          [](Filter& self, const py::object& sensed_force,
             const py::object& velocity, const py::object& motion_force,
             const py::object& contact_force) {
            return Update(self.algorithm, sensed_force, velocity, motion_force,
                          contact_force, &self.state);
          },
          py::arg("sensed_force"), py::arg("velocity"), py::arg("motion_force"),
          py::arg("contact_force"), kUpdateDoc)
      .def(
          "set_prior",
          [](Filter& self, const py::object& normals,
             std::optional<double> std) {
            SetPrior(self.algorithm, normals, std, &self.state);
          },
          py::arg("normals"), py::arg("std") = py::none(), kPriorDoc)
      .def(
          "reset",
          [](Filter& self, std::uint64_t seed) {
            self.state = self.algorithm.MakeState(seed);
          },
          py::arg("seed") = 0, "Starts again, as if new.")
      .def_property(
          "state", [](const Filter& self) { return self.state; },
          [](Filter& self, const State& state) {
            ThrowUnlessCompatible(self.algorithm, state);
            self.state = state;
          },
          "A copy of the state; assign it to go back to it.");
  DefResult(&filter,
            [](const Filter& self) -> const State& { return self.state; });

  BindContactHistory(m);
  BindForceTorqueAdapter(m);
}

}  // namespace dual_proxy
