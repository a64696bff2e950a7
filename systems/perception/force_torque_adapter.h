// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include <Eigen/Core>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of ForceTorqueAdapter. S is the sensor's frame, whose axes are
E's. */
struct ForceTorqueAdapterParams {
  double tool_mass{0};
  Eigen::Vector3d tool_com{Eigen::Vector3d::Zero()};
  double gravity{9.81};
  double cutoff{0};
  double max_force{500};
  double max_moment{50};
  bool tare{false};
  double tare_time{0.5};
  double tare_speed{0.005};
  double tare_max_force{10};
  double tare_max_noise{1};
  double period{0.001};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("tool_mass", &tool_mass, AtLeast(0), "kg",
                   "beyond the sensor: its weight and inertia are removed"));
    a->Visit(Field("tool_com", &tool_com, Finite(), "m",
                   "in S: centre of that mass"));
    a->Visit(Field("gravity", &gravity, AtLeast(0), "m/s^2", "along -z of B"));
    a->Visit(Field("cutoff", &cutoff, CutoffOrNone(), "Hz",
                   "the sensor's own first-order low-pass, which what the "
                   "tool's inertia does passes through, too; 0 is none"));
    a->Visit(Field("max_force", &max_force, Above(0), "N",
                   "that the sensor measures, per axis: a sample beyond it is "
                   "none, and refused like one that is not finite"));
    a->Visit(Field("max_moment", &max_moment, Above(0), "N m", "likewise"));
    a->Visit(Field("tare", &tare,
                   "whether the sensor's bias is learned before anything "
                   "moves; false: there is none until one is asked for"));
    a->Visit(Field("tare_time", &tare_time, Between(Open(0), 10), "s",
                   "how long the tool has to be at rest for it"));
    a->Visit(Field("tare_speed", &tare_speed, Above(0), "m/s",
                   "slower than this the tool's centre of mass is at rest"));
    a->Visit(Field("tare_max_force", &tare_max_force, Above(0), "N",
                   "a larger force on the resting tool is no bias: it touches "
                   "something, or its mass is wrong"));
    a->Visit(Field(
        "tare_max_noise", &tare_max_noise, Above(0), "N",
        "noise, standard deviation per axis, with which no bias is learned"));
    a->Visit(Field("period", &period, Above(0), "s", "between samples"));
  }
};

/** One sample. */
struct ForceTorqueAdapterInput {
  /** [force; moment] about the origin of S, N and N m, in S: of the arm on the
  tool, as the sensor gives it. */
  Eigen::Matrix<double, 6, 1> measured{Eigen::Matrix<double, 6, 1>::Zero()};
  Pose X_BE;  ///< Of the tool point.
  /** [linear; angular], m/s and rad/s, in B: of the tool point, if it is known.
  Without, it is taken from the poses, which then have to come at the sample
  period or at a whole multiple of it. */
  std::optional<Eigen::Matrix<double, 6, 1>> v_BE{};
  /** m, in S: tool point. */
  Eigen::Vector3d p_SE{Eigen::Vector3d::Zero()};
  /** Asks for the bias to be learned anew when it becomes true. The tool is to
  be in free space. */
  bool tare{false};
};

/** What the adapter remembers, and its output. */
struct ForceTorqueAdapterState {
  using Vector6d = Eigen::Matrix<double, 6, 1>;

  /** [force; moment] about E, N and N m, in B: of the robot on its environment.
  Zero while it is not ready. */
  Vector6d wrench{Vector6d::Zero()};
  /** Whether there are samples, and a bias to go by. Without, nothing that
  depends on the wrench is to begin or go on, and nothing to move. */
  bool ready{false};
  /** [force; moment], N and N m, in S: what is sensed when nothing touches. */
  Vector6d bias{Vector6d::Zero()};
  /** How often a bias was learned, and how often the tool was at rest and yet
  none could be (tare_max_force, tare_max_noise). */
  std::int64_t tares{0};
  std::int64_t tares_refused{0};
  std::int64_t bad_inputs{0};
  /** Bad inputs in a row. */
  std::int64_t outage{0};

  bool taring{false};
  bool tare_asked{false};
  /** Of the samples at rest so far. */
  std::int64_t rest_samples{0};
  Vector6d rest_sum{Vector6d::Zero()};
  Eigen::Vector3d rest_squares{Eigen::Vector3d::Zero()};
  /** m and m/s, in B: last place and velocity of the tool's centre of mass, of
  how many samples (up to 2), and how many periods it has been there. */
  Eigen::Vector3d com{Eigen::Vector3d::Zero()};
  Eigen::Vector3d com_velocity{Eigen::Vector3d::Zero()};
  int com_samples{0};
  int com_periods{0};
  /** N, in B: of the arm on the tool, because the tool accelerates. */
  Eigen::Vector3d inertial_force{Eigen::Vector3d::Zero()};
};

/** From what a wrist sensor measures to what the tool exerts on its
environment, in this project's sign: INTO the surface that the tool pushes on.

    F_B = R_BS (f - f_bias) + m g_B - m a_com
    M_B = R_BS (m - m_bias) + p_com x (m g_B - m a_com) - p_SE x F_B   (about E)

The tool's acceleration follows from its last two velocities, or, where these
are not given, from its last three places: the model knows where its mass is.
Those that come less often than samples are taken as of when they change, up to
ten samples; after that they say nothing of acceleration.
(The moment that turns the tool about its own centre of mass
is left; it is less than a sensor's noise.)

The bias is learned before anything moves: over `tare_time` at rest, as the mean
of what is measured less the tool's weight. A mean above tare_max_force is no
bias, and with more noise than tare_max_noise none can be told; then the next
`tare_time` counts. Until it is known, `ready` is false and the wrench is zero.
The same when it is asked for again. Input that is not finite is counted; the
output stays as it was for ten samples, then it is not ready until the next good
one. */
class ForceTorqueAdapter {
 public:
  using Params = ForceTorqueAdapterParams;
  using State = ForceTorqueAdapterState;

  /** @throws std::invalid_argument if `params` is invalid. */
  explicit ForceTorqueAdapter(const Params& params = {});

  const Params& params() const { return params_; }

  State MakeState() const noexcept;

  /** Takes a sample; the result is in `state`. No heap, no throw. */
  void Update(const ForceTorqueAdapterInput& input,
              State* state) const noexcept;

 private:
  void NoteMotion(const Eigen::Vector3d& com,
                  const std::optional<Eigen::Vector3d>& velocity,
                  State* state) const noexcept;
  void Tare(const Eigen::Matrix<double, 6, 1>& net, bool at_rest,
            State* state) const noexcept;

  Params params_;
  double gain_{1};
  std::int64_t samples_needed_{1};
};

}  // namespace dual_proxy
