// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

namespace dual_proxy {

/** How a DevicePassivity works. Forces and motions are the link's: in B and in
the robot's scale, f in N on whoever moves the port, x in m. */
struct DevicePassivityParams {
  static constexpr int kMaxActuationDelay = 7;

  bool enabled{true};        ///< False: it observes and injects nothing.
  double initial_energy{0};  ///< J, >= 0: that the port may give away at first.
  bool counts_input{false};  ///< Whether what came in here may leave here, too.
  double max_damping{0};     ///< N s/m, >= 0.
  int actuation_delay{0};    ///< Periods before a command begins to act.
  double period{0.001};      ///< s.
};

/** One period's inputs of a DevicePassivity. */
struct DevicePassivityInput {
  /** Whether there is a link; without it nothing is injected, and the observer
  starts anew. */
  bool connected{false};
  /** J: what the other side says that may leave here, all in all. */
  double received_energy{0};
  /** x_d and v_d; the velocity may be filtered, it is in no energy. */
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};
  /** What was sent to the device in the period before, after all limits. */
  Eigen::Vector3d sent_force{Eigen::Vector3d::Zero()};
  /** f of the link, which is to be sent now. */
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};
};

/** Memory of a DevicePassivity. */
struct DevicePassivityState {
  /** A force on its way to the device. */
  struct Command {
    Eigen::Vector3d force{Eigen::Vector3d::Zero()};    ///< All of it, N.
    Eigen::Vector3d damping{Eigen::Vector3d::Zero()};  ///< Its injected part.
    double promised{0};  ///< J: of dissipation, in `balance` already.
  };

  bool observing{false};
  /** J: W_L, what may still leave the port, less if negative. */
  double balance{0};
  double received{0};    ///< J: of received_energy, in `balance` already.
  double input{0};       ///< J: EinL, all that came in; it never shrinks.
  double dissipated{0};  ///< J: EpcL, all that the injection really took.
  /** Periods in which a bound kept the injection from making up for what had
  left. */
  std::int64_t saturated{0};
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};
  std::array<Command, DevicePassivityParams::kMaxActuationDelay + 1> commands{};
};

/** Passivity observer and controller of the port between link and hand, three
axes of either kind. Each period:

    f . dx > 0: EinL += f . dx;   else W_L += f . dx;      W_L += dE^
    W_L < 0:  alpha = -W_L / (h |v|^2) <= max_damping,     force += alpha v

f is the link's part of what acted, dx the difference of the positions between
which it did, E^ what the other side has granted. An injection is in W_L by what
it takes, alpha v . dx with the force that acted: promised when it is decided
on, as the period that it acts in lies ahead, and put right when that is over.
It is not in EinL, or the other side would be given energy that is gone.

Below kMinSpeed nothing is injected: v would be noise.

Update() neither allocates nor throws. */
class DevicePassivity {
 public:
  using State = DevicePassivityState;

  static constexpr double kMinSpeed = 0.002;  // m/s

  explicit DevicePassivity(const DevicePassivityParams& params)
      : params_(params) {}

  State MakeState() const { return {}; }

  /** Advances by one period. @pre all inputs are finite.
  @returns alpha v, to be added to the link's force. */
  Eigen::Vector3d Update(const DevicePassivityInput& input,
                         State* state) const noexcept;

 private:
  void Observe(const DevicePassivityInput& input, State* state) const noexcept;

  DevicePassivityParams params_;
};

}  // namespace dual_proxy
