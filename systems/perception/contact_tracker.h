// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "dual_proxy/common/instruction_set.h"
#include "dual_proxy/common/normal_stream.h"
#include "dual_proxy/common/random.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/perception/force_bias.h"
#include "dual_proxy/perception/input_window.h"
#include "dual_proxy/perception/particle_kernels.h"

namespace dual_proxy {

/** Parameters of ContactTracker: what is known of the sensors, and of the
surfaces to be met. None is per update, so every period behaves alike. For the
angular filter read N m for N, rad/s for m/s and rad for m. */
struct FrictionConeParams {
  double force_noise{0.25};
  double velocity_noise{0.0015};
  double sliding_speed{0.004};
  double max_friction{0.7};
  double contact_force{0.6};
  double loss_force{0.45};
  double compliance{2e-4};
  double curvature{0.5};
  double torsion{0.05};
  double evidence{9};
  double bias{0.52};
  double bias_drift{0.02};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(
        Field("force_noise", &force_noise, Above(0), "N",
              "sigma_f of one input per axis, with what the model leaves out"));
    a->Visit(Field("velocity_noise", &velocity_noise, Above(0), "m/s",
                   "sigma_v, likewise"));
    a->Visit(
        Field("sliding_speed", &sliding_speed, Above(0), "m/s",
              "half of it sticks, 1.5 times it slides, in between is between"));
    a->Visit(Field("max_friction", &max_friction, Above(0), "",
                   "mu, the most that is thought of while nothing has slid; "
                   "then the friction seen takes its place, with a margin"));
    a->Visit(Field("contact_force", &contact_force,
                   Above({force_noise, "force_noise"}), "N",
                   "from here on what a force shows speaks for a contact"));
    a->Visit(Field(
        "loss_force", &loss_force,
        Between(0, Open({contact_force, "contact_force"})), "N",
        "below, it speaks against one that was there; where little is "
        "commanded only as far as the tool has moved along the normal since"));
    a->Visit(
        Field("compliance", &compliance, AtLeast(0), "m/N",
              "how much surface, tool and arm give; a changing force moves the "
              "tool into the surface, which then is not taken for sliding"));
    a->Visit(Field(
        "curvature", &curvature, AtLeast(0), "rad^2/m",
        "variance by which a normal turns about the axis across the motion per "
        "metre of sliding (a cylinder's 1/r squared times a length)"));
    a->Visit(Field("torsion", &torsion, AtLeast(0), "rad^2/m",
                   "likewise about the direction of motion"));
    a->Visit(Field("evidence", &evidence, Above(0), "",
                   "log likelihood ratio of what is new to what was believed "
                   "that adds or drops a contact"));
    a->Visit(Field("bias", &bias, Above(0), "N",
                   "of a sensor whose bias is not learned yet, standard "
                   "deviation per axis"));
    a->Visit(Field("bias_drift", &bias_drift, Above(0), "N/sqrt(s)",
                   "how the bias wanders, likewise"));
  }
};

/** What is believed of one contact. */
struct TrackedContact {
  /** n, unit vector INTO the surface, in B: mean of its particles. */
  Eigen::Vector3d normal{Eigen::Vector3d::Zero()};
  /** Of its particles, in B. */
  Eigen::Matrix3d covariance{Eigen::Matrix3d::Zero()};
  /** lambda, N: its normal force. */
  double force{0};
  /** N s, in B: of what was sensed while it rested. */
  Eigen::Vector3d impulse{Eigen::Vector3d::Zero()};
  /** m, in B: how far it has slid, which forgets with time; and the farthest,
  up to a limit of which friction may be tilting the force. */
  Eigen::Vector3d displaced{Eigen::Vector3d::Zero()};
  double slid{0};
  /** s: since its normal force was last much larger than before; N: that force;
  N s: what it was pressed since it was found. */
  double onset{0};
  double onset_force{0};
  double pressed{0};
  /** m: how far the tool has lately moved along the normal, and on its way; N:
  how much the normal force has grown meanwhile. All forget with time. */
  double sunk{0};
  double passed{0};
  double grown{0};
  /** N: the normal force of the update before, and smoothed. */
  double last_force{0};
  double smooth_force{0};
  /** N m and N^2: of sinking and force, so that their quotient is what gives.
   */
  double give{0};
  double give_weight{0};
  /** The evidence against it. */
  double loss{0};
  /** m: since its force last spoke for it, how far the tool has moved along the
  normal, and on its way; both forget with time. */
  double departed{0};
  double way{0};
  /** 1/m, in B: what the normal turns by per metre that is slid. */
  Eigen::Matrix3d shape{Eigen::Matrix3d::Zero()};
  /** rad: by how much it has lately turned about the motion, as few surfaces do
  and the force on one that moves aside. */
  double rolled{0};
  /** In B: an expected normal over its variance (rad^2), or zero. */
  Eigen::Vector3d prior{Eigen::Vector3d::Zero()};
};

/** What ContactTracker remembers beside the particles. */
struct ContactTrackerState {
  /** The first `count` are contacts, none within 0.2 rad of another's normal or
  of its opposite. Particles n i / count to n (i + 1) / count are those of
  contact i. */
  std::array<TrackedContact, 3> contacts;
  int count{0};
  /** The sensor's. */
  ForceBiasState bias;
  /** N, in B: what these contacts and friction cannot explain. */
  Eigen::Vector3d unexplained{Eigen::Vector3d::Zero()};
  /** N s, in B: its integral while there is evidence for a new contact. */
  Eigen::Vector3d unexplained_impulse{Eigen::Vector3d::Zero()};
  double evidence{0};
  /** s: how long two contacts that were foreseen have explained the one that is
  believed. */
  double foreseen_time{0};
  /** mu seen while sliding; negative as long as nothing has slid. */
  double friction{-1};
  /** s: since a contact was found, and the speed (m/s) at which it was. */
  double settled_time{0};
  double entry_speed{0};
  /** 0 to 1: how much of the contact slides. */
  double sliding{0};
  /** 0 to 1: how much of its motion may be creeping, stuck to what gives. */
  double creeping{0};
  /** m, in B: how far the tool has moved lately. */
  Eigen::Vector3d passed{Eigen::Vector3d::Zero()};
  /** N^2: what is across the sliding though noise and bias explain less; rad^2:
  how much of the sliding is into a surface; and how the friction that is seen
  varies, as its square. */
  double astray2{0};
  double into2{0};
  double friction_variance{0};
  /** The normal of the last contact that was lost, in B, and s since then. */
  Eigen::Vector3d lost_normal{Eigen::Vector3d::Zero()};
  double lost_time{0};
  /** N: size of the force, smoothed. */
  double force{0};
  /** m/s, in B: smoothed. */
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};
  /** m/s: how fast it has lately moved along the normal, and how fast a surface
  that moves has done so while the tool rested on it. */
  double rising{0};
  double surface_speed{0};
  /** m/s: how fast the tool may be sinking into what gives. */
  double sinking_speed{0};
};

/** Where a tracker's particles live. */
struct ContactParticles {
  MutableParticleList particles;  ///< num_particles.
  MutableParticleList moved;      ///< Work space, num_particles.
  double* weights{};              ///< Work space, num_particles.
  std::int32_t* chosen{};         ///< Work space, num_particles + 1.
  NormalStream* normals{};
  RandomStream* random{};
};

/** Expected normals; see ForceSpaceParticleFilter::SetPrior(). */
struct ContactPrior {
  const Eigen::Matrix<double, 3, 8>* normals{};  ///< Unit vectors, in B.
  int count{0};
  double std{0.1};  ///< rad, > 0.
};

/** Finds and follows up to three contacts, each by a cloud of particles for its
normal: the likelihood "friction_cone" of ForceSpaceParticleFilter. In the
paper's filter one cloud stands for all contacts, and its shape for their
number. Here their number is decided first, by what the force excludes:

    r = F_s - sum_i lambda_i n_i - friction,  lambda_i >= 0

is what the contacts cannot explain. Friction is along the velocity where the
tool slides and anywhere in the cone where it sticks; mu is learned while it
slides. A contact is found when r speaks for one long enough (with no contact r
is the force itself), and dropped when its lambda_i is not there any more, or,
one of several, when the tool moves along its normal: CUSUM tests on the log
likelihood. Where no more than a small force is commanded a small force counts
only as far as the tool has moved along the normal: a hand may rest lightly on a
surface, and what holds the tool in place is there, however hard it is pressed.
When it has moved on in any direction, what is sensed and what is commanded must
still push into the surface, on average. One that is met again soon starts from
the normal that it had. Then each contact's particles

    move      as far as surfaces turn in the distance that was slid,
    weight    1 / (1 + <rho,v>^2 / 3 sigma_v^2) exp(-|e|^2 / 2 sigma_f^2)
    resample  low-variance,

with e the part of the force on this contact that would have to be friction but
cannot: across or against the sliding, or outside the cone. The velocity has
heavy tails, as tools bounce and surfaces give. Among normals that nothing
excludes the particles stay where they are; until a contact has slid, that is
around the mean force of its first second, as friction has no preferred
direction. At rest they do not move.

On the way it learns how much each contact gives, what friction is, what the
sensor's bias is, how the surface bends, and how badly all this fits; the latter
three are in the stated uncertainty. docs/filter.md has the whole.

In files: contact_tracker.cc decides, contact_clouds.cc has the particles,
contact_learning.cc what is learned, contact_uncertainty.cc how sure it is. */
class ContactTracker {
 public:
  using Params = FrictionConeParams;
  using State = ContactTrackerState;

  static constexpr int kMaxContacts = 3;

  /** `params` is valid, `period` in s. */
  ContactTracker(const Params& params, int num_particles, double period,
                 InstructionSet instruction_set);

  State MakeState() const;

  /** Advances by one period. Without contacts the particles are not touched,
  neither before nor after. No heap, no throw.
  @param input  its command is zero if that is not known.
  @param[in,out] particles  those of the contacts that `state` knows. */
  void Update(const ContactInput& input, const ContactPrior& prior,
              const ContactParticles& particles, State* state) const noexcept;

  /** rad: the angle within which the true direction lies with 95 %: of the
  normal (one contact) or the free axis (two); pi/2 with none, 0 with three. */
  static double CalcDirectionUncertainty(const State& state) noexcept;

  /** 0 to 1: how likely the number of contacts is right. */
  double CalcCountConfidence(const State& state) const noexcept;

 private:
  double CalcCompliance(const TrackedContact& contact) const noexcept;
  /** m/s: what the change of its force lets the tool sink by. */
  double CalcSinkingSpeed(const TrackedContact& contact) const noexcept;
  /** 0 to 1: by the speed along the surface, m/s. */
  double CalcSlidingShare(double speed) const noexcept;
  double CalcMaxFriction(const State& state) const noexcept;
  double CalcSlidingFriction(const State& state) const noexcept;
  /** N: the most that friction takes where it sticks. */
  double CalcStickingFriction(const State& state) const noexcept;
  void NoteCreeping(const Eigen::Vector3d& velocity,
                    State* state) const noexcept;
  void LearnMisfit(const Eigen::Vector3d& force,
                   const Eigen::Vector3d& velocity,
                   State* state) const noexcept;
  void NoteSinking(const Eigen::Vector3d& force,
                   const Eigen::Vector3d& velocity,
                   State* state) const noexcept;
  void Explain(const Eigen::Vector3d& force, const Eigen::Vector3d& velocity,
               State* state) const noexcept;
  void Follow(int index, double other_force, const ContactInput& input,
              const ContactPrior& prior, const ContactParticles& particles,
              State* state) const noexcept;
  Eigen::Vector3d CalcPriorPull(const TrackedContact& contact,
                                const ContactPrior& prior) const noexcept;
  void AddContact(const TrackedContact& contact, const Eigen::Vector3d& normal,
                  double std, const ContactParticles& particles,
                  State* state) const noexcept;
  void SplitForeseen(const Eigen::Vector3d& velocity, const ContactPrior& prior,
                     const ContactParticles& particles,
                     State* state) const noexcept;
  double CalcUnexplainedLevel(const Eigen::Vector3d& force,
                              const State& state) const noexcept;
  void LearnFriction(const Eigen::Vector3d& force,
                     const Eigen::Vector3d& velocity,
                     State* state) const noexcept;
  void LearnBias(const Eigen::Vector3d& force, const Eigen::Vector3d& velocity,
                 State* state) const noexcept;
  void NoteSurfaceMotion(const TrackedContact& contact, double sinking,
                         State* state) const noexcept;
  void NoteMotion(const Eigen::Vector3d& velocity, State* state) const noexcept;
  double CalcLossShare(const TrackedContact& contact,
                       const Eigen::Vector3d& command) const noexcept;
  bool DropLost(const Eigen::Vector3d& velocity, const Eigen::Vector3d& command,
                const ContactParticles& particles, State* state) const noexcept;
  void AddFound(const Eigen::Vector3d& force, const Eigen::Vector3d& velocity,
                const ContactPrior& prior, const ContactParticles& particles,
                State* state) const noexcept;
  void MergeNear(const ContactParticles& particles,
                 State* state) const noexcept;
  void Remove(int index, const ContactParticles& particles,
              State* state) const noexcept;
  void Draw(int index, const Eigen::Vector3d& normal, double std,
            const ContactParticles& particles, State* state) const noexcept;
  void CalcStatistics(int index, const ContactParticles& particles,
                      State* state) const noexcept;

  /** The first particle of contact `index` of `count`. */
  int First(int index, int count) const noexcept {
    return static_cast<int>(static_cast<std::int64_t>(num_particles_) * index /
                            count);
  }

  Params params_;
  int num_particles_;
  double period_;
  InstructionSet instruction_set_;
  ForceBias bias_;
  // Shares of the way that are gone in one period, by time constant.
  double smoothing_gain_;
  double friction_gain_;
  double misfit_gain_;
  double forgetting_gain_;
  double impulse_gain_;
  double onset_decay_;
  double departure_decay_;
  double sinking_decay_;
  double creeping_decay_;
  double surface_decay_;
  double give_decay_;
  double roll_decay_;
  double slide_decay_;
  // m: what the velocity's noise makes of a departure.
  double departure_noise_;
  double prior_decay_;
  // Log likelihood ratio of one period per N of difference to a level.
  double found_rate_;
  double lost_rate_;
  // What an update says, as a share of one that is independent of the others.
  double information_;
};

}  // namespace dual_proxy
