// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/common/window_mean.h"
#include "dual_proxy/perception/force_space_particle_filter.h"
#include "dual_proxy/perception/pressure_centre_tracker.h"

namespace dual_proxy {

/** How the angular filter finds directions. */
enum class AngularMethod {
  kPressureCentre,  ///< From where the force presses: PressureCentreTracker.
  kParticles,       ///< The paper's: a second ForceSpaceParticleFilter.
};

template <>
struct EnumStrings<AngularMethod> {
  static constexpr std::pair<AngularMethod, const char*> kValues[] = {
      {AngularMethod::kPressureCentre, "pressure_centre"},
      {AngularMethod::kParticles, "particles"}};
};

/** The angular filter finds the directions in which rotation is blocked, from
moments and angular velocity. The keys of the paper's, a force-space particle
filter of these, stand directly in `angular_filter`. */
struct AngularFilterParams {
  bool enabled{false};
  AngularMethod method{AngularMethod::kPressureCentre};
  PressureCentreParams pressure_centre;
  /** The thresholds fit a tool some centimetres wide
  that is pressed with some newtons: on its edge the moment is 0.2 N m; that of
  friction, which blocks nothing, is a third of that and to stay below. */
  ForceSpaceParticleFilterParams filter{MakeDefaults()};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const { ValidateFields("AngularFilterParams", *this); }

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("enabled", &enabled,
                   "whether it runs; without it no moment is controlled"));
    VisitEnum(a, "AngularFilterParams", "method", &method,
              "from where the force presses, which also takes the filter of "
              "forces' normal, or from moments alone as the paper does");
    a->Visit(Field("pressure_centre", &pressure_centre,
                   "of method \"pressure_centre\", which of all others uses "
                   "nothing but period"));
    VisitEmbedded(a, "filter", &filter,
                  "of method \"particles\", with N m for N and rad/s for m/s");
  }

 private:
  static ForceSpaceParticleFilterParams MakeDefaults() {
    ForceSpaceParticleFilterParams params;
    params.period = 0.01;
    params.likelihood = Likelihood::kPaper;
    params.update_thresholds = {0.08, 0.2, 0.02, 0.1};
    params.resampling_thresholds = {0, 0.05, 0.02, 0.2};
    return params;
  }
};

/** Parameters of ContactPerception. */
struct ContactPerceptionParams {
  ForceSpaceParticleFilterParams filter;
  AngularFilterParams angular_filter;

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const { ValidateFields("ContactPerceptionParams", *this); }

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("filter", &filter, "of forces"));
    a->Visit(Field("angular_filter", &angular_filter, "of moments"));
  }
};

/** What a filter takes: of forces and velocities, or of moments about E and
angular velocities; 3-vectors in B. */
struct FilterInput {
  Eigen::Vector3d sensed{Eigen::Vector3d::Zero()};    ///< F_s, N; or M_s, N m.
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};  ///< m/s or rad/s.
  Eigen::Vector3d motion{Eigen::Vector3d::Zero()};    ///< F_m or M_m.
  Eigen::Vector3d contact{Eigen::Vector3d::Zero()};   ///< F_f or M_f.
};

/** The directions of contact, in B. */
struct ContactSelections {
  Eigen::Matrix3d force{Eigen::Matrix3d::Zero()};   ///< Omega_f, projection.
  Eigen::Matrix3d moment{Eigen::Matrix3d::Zero()};  ///< Omega_tau, projection.
  /** Unit vectors INTO the surfaces as columns; zero: none, or not known. */
  Eigen::Matrix3d normals{Eigen::Matrix3d::Zero()};
};

/** One filter with what it averages over, and when it is due. */
struct ScheduledFilterState {
  WindowMeanState<12> means;
  ForceSpaceParticleFilterState filter;
  std::int64_t next_update{0};  ///< In filter periods from time 0.

  /** The means since the last update. */
  FilterInput mean_input() const;
};

/** What ContactPerception remembers, and its results. */
struct ContactPerceptionState {
  ScheduledFilterState force;
  /** At rest without the angular filter; with the method kPressureCentre its
  filter has no particles, only what that has found. */
  ScheduledFilterState moment;
  PressureCentreState pressure_centre;
  WindowMeanState<3> support;  ///< F_s over the angular filter's period.
};

/** What of the tool's surroundings the robot feels: the filters of forces and
of moments, each with the means over its period and its schedule.

A filter is due at the multiples of its period, and then takes the means as the
control period before has left them: exactly one full window (WindowMean). What
it finds holds from the next control period on. */
class ContactPerception {
 public:
  using State = ContactPerceptionState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  explicit ContactPerception(const ContactPerceptionParams& params);

  bool has_angular_filter() const { return moment_.has_value(); }

  /** Allocates all that it will ever use.
  @param seed, angular_seed  of the two filters. */
  State MakeState(std::uint64_t seed, std::uint64_t angular_seed) const;

  /** Runs the filters that are due.
  @param time s, not decreasing. No heap, no throw. */
  void UpdateFilters(double time, State* state) const noexcept;

  /** Takes the samples of one control period; of one that is not finite nothing
  is taken, and it is counted in the means.
  @param time s, not decreasing. No heap, no throw. */
  void AddSamples(double time, const FilterInput& force,
                  const FilterInput& moment, State* state) const noexcept;

  /** As the filters last found them. */
  ContactSelections GetSelections(const State& state) const noexcept;

 private:
  struct ScheduledFilter {
    WindowMean<12> means;
    ForceSpaceParticleFilter filter;

    explicit ScheduledFilter(const ForceSpaceParticleFilterParams& params)
        : means(params.period), filter(params) {}

    /** Whether it is due, which it then is not again in this period. */
    bool TakeTurn(double time, ScheduledFilterState* state) const noexcept;
    void Update(double time, ScheduledFilterState* state) const noexcept;
  };

  void UpdatePressureCentre(double time, State* state) const noexcept;

  ScheduledFilter force_;
  std::optional<ScheduledFilter> moment_;
  std::optional<PressureCentreTracker> pressure_centre_;
  WindowMean<3> support_;
};

}  // namespace dual_proxy
