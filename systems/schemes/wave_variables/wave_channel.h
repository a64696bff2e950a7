// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** What of a wave goes over the link: sums since its sender started, so that a
message that is lost takes nothing with it. */
struct WaveSums {
  /** U = sum h u, sqrt(W) s, in B. */
  Eigen::Vector3d wave{Eigen::Vector3d::Zero()};
  /** E = sum h |u|^2 / 2, J. */
  double energy{0};

  /** Adds the wave u, sqrt(W), that was sent for a period, s. */
  void Add(const Eigen::Vector3d& u, double period) noexcept;
};

/** True if finite, and its energy not negative. */
bool IsValid(const WaveSums& sums) noexcept;

/** Parameters of a WavePlayer. */
struct WavePlayerParams {
  double interval;      ///< H, s, > 0: of the messages.
  double period;        ///< h, s, > 0: of Play().
  double reserve;       ///< E_res, J, >= 0.
  double healing_time;  ///< tau, s; less than H is H.
  double cutoff;        ///< Hz, of the low-pass; 0 is none.
};

/** Memory of a WavePlayer. */
struct WavePlayerState {
  bool started{false};
  WaveSums received{};  ///< Of the message in use: U^, E^.
  double send_time{0};  ///< Of that message, s.
  WaveSums played{};    ///< Since the sender started, as far as it is known.
  /** sqrt(W), in B: what is played now, and that after the low-pass. */
  Eigen::Vector3d wave{Eigen::Vector3d::Zero()};
  Eigen::Vector3d output{Eigen::Vector3d::Zero()};
};

/** Makes a wave again of the sums that arrive. When a message arrives, the mean
of the wave since the message before is played, and what was lost or held too
long is made good in time tau,

    u = u_mean + (U^ - H u_mean - U_played) / tau,

shortened until |u|^2 H / 2 is no more than the energy E^ + E_res - E_played.
When the next message is late u is held as long as the energy allows, then it is
zero. The mean of an interval has no more energy than the interval itself
(Jensen), and E_res is all that can be played without having been received,
whatever the link does to messages. What is played passes a low-pass, whose gain
is at most 1 at any frequency.

Where every message is in time, u is (U^ - U_played) / H for any tau. Otherwise
tau = H makes good at once what jitter and loss did, by waves that are too large
and too small in turn: they waste the energy of a steady force, and the contact
is lost at a jitter of 5 ms or when one message of five is. */
class WavePlayer {
 public:
  using State = WavePlayerState;

  explicit WavePlayer(const WavePlayerParams& params);

  State MakeState() const { return {}; }

  /** Takes the sums of a message that is new, sent at send_time, s. The first
  is where this player starts: nothing of before it is played. No heap, no
  throw.
  */
  void Receive(const WaveSums& sums, double send_time,
               State* state) const noexcept;

  /** Advances by one period. No heap, no throw.
  @returns state->output. */
  const Eigen::Vector3d& Play(State* state) const noexcept;

 private:
  WavePlayerParams params_;
  double gain_;  // Of the low-pass.
};

}  // namespace dual_proxy
