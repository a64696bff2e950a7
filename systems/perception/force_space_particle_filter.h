// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <numbers>
#include <utility>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/instruction_set.h"
#include "dual_proxy/common/normal_stream.h"
#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/random.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/common/workspace.h"
#include "dual_proxy/perception/contact_tracker.h"
#include "dual_proxy/perception/input_window.h"

namespace dual_proxy {

/** How a particle's weight is computed. */
enum class Likelihood {
  kPaper,         ///< Product of a force and a velocity ramp, eq. (6)-(8).
  kFrictionCone,  ///< Rigid contacts with friction: ContactTracker.
};

template <>
struct EnumStrings<Likelihood> {
  static constexpr std::pair<Likelihood, const char*> kValues[] = {
      {Likelihood::kPaper, "paper"},
      {Likelihood::kFrictionCone, "friction_cone"}};
};

/** How Algorithm 3 takes the dimension d from its bounds d_hb <= d_lb. */
enum class DimensionRule {
  kClamped,  ///< d stays where it was, as far as the bounds let it.
  kPrinted,  ///< Below d_hb it becomes d_lb, above d_lb it becomes d_hb.
};

template <>
struct EnumStrings<DimensionRule> {
  static constexpr std::pair<DimensionRule, const char*> kValues[] = {
      {DimensionRule::kClamped, "clamped"},
      {DimensionRule::kPrinted, "printed"}};
};

/** Corners of the two ramps of the likelihood, eq. (6) and (7). */
struct ForceSpaceParticleFilterThresholds {
  double force_low{0};
  double force_high{3};
  double velocity_low{0.001};
  double velocity_high{0.01};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("force_low", &force_low, AtLeast(0), "N",
                   "f_l: below it a contact along the particle is ruled out"));
    a->Visit(Field("force_high", &force_high, Above({force_low, "force_low"}),
                   "N",
                   "f_h: above it the force speaks fully for the particle"));
    a->Visit(Field("velocity_low", &velocity_low, AtLeast(0), "m/s",
                   "v_l: below it the velocity speaks fully for the particle"));
    a->Visit(Field("velocity_high", &velocity_high,
                   Above({velocity_low, "velocity_low"}), "m/s",
                   "v_h: above it a contact there is ruled out"));
  }
};

/** Parameters of ForceSpaceParticleFilter; but for the likelihood the defaults
are the paper's (section V.C) where it gives a number. For the angular filter
read N m for N and rad/s for m/s. */
struct ForceSpaceParticleFilterParams {
  static constexpr int kMaxParticles = 100000;

  int num_particles{1000};
  double period{1.0 / 15.0};
  Likelihood likelihood{Likelihood::kFrictionCone};
  double scatter_mean{0};
  double scatter_std{0.025};
  ForceSpaceParticleFilterThresholds update_thresholds{3, 10, 0.001, 0.005};
  ForceSpaceParticleFilterThresholds resampling_thresholds{0, 3, 0.001, 0.01};
  double alpha_add{0.5};
  double alpha_remove{0.1};
  DimensionRule dimension_rule{DimensionRule::kClamped};
  double epsilon{1e-6};
  int prior_particles{50};
  double prior_std{0.1};
  FrictionConeParams friction_cone;

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("num_particles", &num_particles, Between(2, kMaxParticles),
                   "", "n_p; the cost of an update is proportional to it"));
    a->Visit(Field("period", &period, Between(Open(0), kMaxTime), "s",
                   "between updates; the caller keeps it; scatter, resampling "
                   "and added particles of the printed method are per update"));
    VisitEnum(a, "ForceSpaceParticleFilterParams", "likelihood", &likelihood,
              "eq. (6) to (8), or contacts with friction");
    a->Visit(Field(
        "scatter_mean", &scatter_mean, Between(-1, 1), "",
        "alpha of the scatter N(alpha, Sigma): mean per axis and update"));
    a->Visit(
        Field("scatter_std", &scatter_std, Between(0, 1), "",
              "Sigma of the scatter: standard deviation per axis and update; "
              "larger follows a turning normal faster, but spreads more"));
    a->Visit(Field(
        "update_thresholds", &update_thresholds,
        "weigh the tentative particle, which decides how many are added"));
    a->Visit(Field("resampling_thresholds", &resampling_thresholds,
                   "weigh every particle when resampling"));
    a->Visit(Field("alpha_add", &alpha_add, Between(Open(0), Open(1)), "",
                   "share of the largest singular value above which a "
                   "direction is added"));
    a->Visit(Field("alpha_remove", &alpha_remove,
                   Between(Open(0), {alpha_add, "alpha_add"}), "",
                   "share of it below which a direction is removed"));
    VisitEnum(a, "ForceSpaceParticleFilterParams", "dimension_rule",
              &dimension_rule,
              "of Algorithm 3: as printed, a dimension that has to change goes "
              "to the farther bound");
    a->Visit(Field(
        "epsilon", &epsilon, Between(1e-12, 0.1), "",
        "vectors no longer than this count as zero (N for the commands)"));
    a->Visit(Field("prior_particles", &prior_particles,
                   Between(0, kMaxParticles), "",
                   "that each prior normal adds to an update"));
    a->Visit(Field("prior_std", &prior_std, Between(Open(0), std::numbers::pi),
                   "rad",
                   "how sure a prior is for which nothing else is said, "
                   "standard deviation per axis"));
    a->Visit(Field("friction_cone", &friction_cone,
                   "of likelihood \"friction_cone\", which uses nothing else "
                   "but num_particles, period, epsilon and prior_std"));
  }
};

/** What an update came to. */
enum class FilterStatus {
  kOk,
  kBadInput,        ///< Refused: not finite, or its square overflows.
  kAllWeightsZero,  ///< Nothing is likely; moved particles kept, and counted.
};

template <>
struct EnumStrings<FilterStatus> {
  static constexpr std::pair<FilterStatus, const char*> kValues[] = {
      {FilterStatus::kOk, "ok"},
      {FilterStatus::kBadInput, "bad_input"},
      {FilterStatus::kAllWeightsZero, "all_weights_zero"}};
};

/** What the filter remembers, and its result. Made by MakeState(); copyable,
and a copy continues with the same random numbers. The members up to `prior` are
valid after construction and after every update, whatever the input:
`force_selection` and `motion_selection` are orthogonal projections (symmetric,
idempotent) of rank `dimension` and 3 - `dimension` that sum to the identity. */
struct ForceSpaceParticleFilterState {
  /** One array per coordinate. */
  using Particles = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

  /** 3 x num_particles, in B: unit vectors into the surface, or zero for "no
  contact". */
  Particles particles;
  /** d, 0 to 3: number of directions in force space. */
  int dimension{0};
  /** Omega_f, in B. */
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  /** Omega_m = I - Omega_f, in B. */
  Eigen::Matrix3d motion_selection{Eigen::Matrix3d::Identity()};
  /** Of the particles, decreasing; the squares sum to the number of particles
  on the sphere. */
  Eigen::Vector3d singular_values{Eigen::Vector3d::Zero()};
  /** U = [U1 U2 U3] as columns, in B, right-handed. U1 and U2 point to the
  side of the particles' mean, so U1 is the normal INTO the surface in a single
  contact. Identity while there are no particles on the sphere. Of several
  contacts of Likelihood::kFrictionCone U1 is the normal of the one that is
  pushed hardest, and U3 the axis of free motion at dimension 2. */
  Eigen::Matrix3d singular_vectors{Eigen::Matrix3d::Identity()};
  /** Normals INTO the surfaces, unit vectors in B, as columns: of the contacts
  of Likelihood::kFrictionCone, else U1 and U2; beyond the dimension zero, and a
  third of Likelihood::kPaper, whose sign is not known. */
  Eigen::Matrix3d contact_normals{Eigen::Matrix3d::Zero()};

  /** Expected normals, unit vectors in B; the first `num_priors` columns. */
  Eigen::Matrix<double, 3, 8> prior{Eigen::Matrix<double, 3, 8>::Zero()};
  int num_priors{0};
  /** rad: how sure the normals are, standard deviation per axis. */
  double prior_std{0.1};

  /** Of Likelihood::kFrictionCone. */
  InputWindowState inputs;
  ContactTrackerState tracker;
  /** U1, the main direction, in B; zero at dimension 0. */
  Eigen::Vector3d force_direction() const {
    if (dimension == 0) return Eigen::Vector3d::Zero();
    return singular_vectors.col(0);
  }

  /** rad: the angle within which the true direction lies with 95 %: of U1 at
  dimension 1, of U3 at 2; pi/2 at 0, 0 at 3. Always pi/2 with
  Likelihood::kPaper, whose particles are no distribution of the normal. */
  double direction_uncertainty{std::numbers::pi / 2};
  /** 0 to 1: the probability that the dimension is right; always 0 likewise. */
  double dimension_confidence{0};

  /** For resampling: one number per update. */
  RandomStream random;
  /** For the scatter: see ScatterParticles(), which draws from it while any
  particle is on the sphere. */
  NormalStream normals;

  /** Updates carried out, with kAllWeightsZero, and calls refused. */
  std::int64_t updates{0};
  std::int64_t all_weights_zero{0};
  std::int64_t bad_inputs{0};

  /** Work space of an update: the augmented list, its cumulative weights, and
  which of it are chosen; nothing in it survives from one update to the next. */
  Workspace<Particles> augmented;
  Workspace<Eigen::VectorXd> cumulative_weights;
  Workspace<Eigen::VectorX<std::int32_t>> chosen;
};

/** Estimates in which directions the tool touches something: the Force-Space
Particle Filter of section IV of the paper. Particles live on the unit sphere
(a possible contact normal, pointing into the surface) and at its centre (no
contact).

With Likelihood::kFrictionCone the particles are those of ContactTracker's
contacts, whose number is the dimension; of the commands it uses F_f, if that is
given, and the spaces come from the particles as below. With Likelihood::kPaper
one update is

    move      rho += N(scatter_mean, scatter_std) for rho != 0     Algorithm 1
    add       along the arc from F_f to F_m, if F_m is likely      Algorithm 1
    weight    w = w_f(rho, F_s) w_v(rho, v), in [0, 1]             eq. (6)-(8)
    resample  low-variance, back to num_particles                  Algorithm 2
    spaces    dimension and Omega_f from the singular values       Algorithm 3

Where the latter departs from what is printed:
- Each of w_f and w_v is clamped to [0, 1] (the paper says that they are in it).
- Algorithm 2 advances while the cumulative weight is *below* the sample.
- Algorithm 3 is the clamp of the previous dimension to [d_hb, d_lb]; as printed
  (DimensionRule::kPrinted) it jumps to the bound on the other side. "Free" is
  |S| < sqrt(num_particles / 2), (9).
- All weights zero: the printed resampling divides by zero. The moved particles
  are kept, the last slot becomes the centre, and it is counted.
- n_add is w(rho_t) num_particles rounded to the nearest integer, half up.
- In free space (every particle at the centre, no prior, nothing to add) the
  update is known beforehand and skipped, with the very same result.
- The spaces come from the 3 x 3 eigenproblem of sum rho rho^T, which has the
  singular vectors and squared singular values of the printed matrix (its
  appended zero columns change nothing).

A prior (section IV.C: from vision, or from what was believed at this place
before) adds unscattered particles at its normals to each update, to be weighed
like all others: it can only help what the sensors also support. With
Likelihood::kFrictionCone a contact that is foreseen needs less evidence, and
its normal starts from both.

The paper's angular filter is a second instance fed with moments and angular
velocity. There the particles are axes of constrained rotation. */
class ForceSpaceParticleFilter {
 public:
  using Params = ForceSpaceParticleFilterParams;
  using State = ForceSpaceParticleFilterState;

  /** The largest number of prior normals. */
  static constexpr int kMaxPriors = 8;

  /** @param instruction_set  one of AvailableInstructionSets(); results are the
    same bits with each.
  @throws std::invalid_argument if `params` is invalid, or the instruction set
    is not available. */
  explicit ForceSpaceParticleFilter(
      const Params& params = {},
      InstructionSet instruction_set = FastestInstructionSet());

  const Params& params() const { return params_; }

  /** Every particle at the centre, dimension 0, no prior. Allocates. The same
  seed gives the same results, bit for bit. */
  State MakeState(std::uint64_t seed = 0) const;

  /** True if `state` was made by MakeState() of a filter with the same numbers
  of particles. */
  bool IsCompatible(const State& state) const noexcept;

  /** Advances the particles by one period and computes the spaces.
  @param sensed_force  F_s, 3-vector, N, in B: robot on environment, mean over
    the period.
  @param velocity  v_BE, 3-vector, m/s, in B, mean over the period.
  @param motion_force  F_m, 3-vector, N, in B: command in motion space.
  @param contact_force  F_f, 3-vector, N, in B: command in force space.
  @param[in,out] state  but for its count unchanged if kBadInput is returned.
  @returns kOk, kBadInput (also for a state that is not compatible) or
    kAllWeightsZero.
  Cost O(num_particles), constant in free space. No heap, no throw. */
  FilterStatus Update(const Eigen::Vector3d& sensed_force,
                      const Eigen::Vector3d& velocity,
                      const Eigen::Vector3d& motion_force,
                      const Eigen::Vector3d& contact_force,
                      State* state) const noexcept;

  /** Replaces the prior, which holds until it is replaced.
  @param normals  3 x k, 0 <= k <= kMaxPriors, in B, into the surface; of any
    length above epsilon, and normalised here. k = 0 removes the prior.
  @param std  rad, in (0, pi]: how sure they are, standard deviation per axis,
    instead of params.prior_std; Likelihood::kPaper has no use for it.
  @returns kOk, or kBadInput (too many, not finite, or too short), when `state`
    is unchanged but for the count. No heap, no throw. */
  FilterStatus SetPrior(const Eigen::Ref<const Eigen::Matrix3Xd>& normals,
                        State* state) const noexcept {
    return SetPrior(normals, params_.prior_std, state);
  }
  FilterStatus SetPrior(const Eigen::Ref<const Eigen::Matrix3Xd>& normals,
                        double std, State* state) const noexcept;

 private:
  friend class ForceSpaceParticleFilterTester;

  int capacity() const noexcept;
  int CountAdded(const Eigen::Vector3d& sensed_force,
                 const Eigen::Vector3d& velocity,
                 const Eigen::Vector3d& motion_force) const noexcept;
  FilterStatus UpdateFree(const Eigen::Vector3d& sensed_force,
                          const Eigen::Vector3d& velocity,
                          State* state) const noexcept;
  FilterStatus UpdateInFull(const Eigen::Vector3d& sensed_force,
                            const Eigen::Vector3d& velocity,
                            const Eigen::Vector3d& motion_force,
                            const Eigen::Vector3d& contact_force, int num_added,
                            State* state) const noexcept;
  int MoveParticles(State* state) const noexcept;
  int AddPrior(int count, State* state) const noexcept;
  int AddTentative(const Eigen::Vector3d& motion_force,
                   const Eigen::Vector3d& contact_force, int num_added,
                   int count, State* state) const noexcept;
  bool Resample(const Eigen::Vector3d& sensed_force,
                const Eigen::Vector3d& velocity, int count,
                State* state) const noexcept;
  FilterStatus UpdateContacts(const Eigen::Vector3d& sensed_force,
                              const Eigen::Vector3d& velocity,
                              const Eigen::Vector3d& contact_force,
                              State* state) const noexcept;
  void CalcSpaces(State* state) const noexcept;
  void TurnToMainContact(State* state) const noexcept;
  int CalcPaperDimension(double num_on_sphere,
                         const State& state) const noexcept;

  Params params_;
  InstructionSet instruction_set_;
  InputWindow window_;
  ContactTracker tracker_;
};

}  // namespace dual_proxy
