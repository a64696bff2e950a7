// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

struct ClockOffsetParams {
  int samples{100};
  int min_samples{10};
  double spacing{0.015};
  double max_age{10.0};
  double share{0.1};
  double max_slew{1e-3};
  double jump_margin{1e-3};

  /** Most samples that may be asked for. */
  static constexpr int kMaxSamples = 100;

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("samples", &samples, Between(1, kMaxSamples), "",
                   "newest round trips that are looked at"));
    a->Visit(Field("min_samples", &min_samples,
                   Between(1, {1.0 * samples, "samples"}), "",
                   "round trips before there is an estimate"));
    a->Visit(Field("spacing", &spacing, AtLeast(0), "s",
                   "round trips that end within this count as one, the "
                   "shortest: a burst of late ones is not many"));
    a->Visit(Field("max_age", &max_age, Above(0), "s",
                   "round trips that ended longer ago are forgotten"));
    a->Visit(Field("share", &share, Between(Open(0), 1), "",
                   "of the round trips, the shortest, of which the mean is "
                   "the estimate: what waited nowhere is symmetric"));
    a->Visit(Field("max_slew", &max_slew, Between(0, 0.1), "s/s",
                   "by which the offset in use follows the estimate; more than "
                   "clocks drift apart"));
    a->Visit(Field("jump_margin", &jump_margin, Above(0), "s",
                   "by which a round trip must contradict the offset in use, "
                   "beyond what its own length explains, to show that a clock "
                   "has jumped"));
  }
};

/** Memory of a ClockOffset. */
struct ClockOffsetState {
  struct Sample {
    double time{0};        ///< s, own clock, when the round trip ended.
    double offset{0};      ///< s.
    double round_trip{0};  ///< s, without what the peer kept.
  };

  /** Whether there is an offset. */
  bool estimated{false};
  /** Peer's clock minus own, s: what is in use. */
  double offset{0};
  /** Mean of the shortest round trips, s. */
  double round_trip{0};
  /** Times that a clock has jumped. */
  std::int64_t jumps{0};
  /** Round trips refused: not finite, or shorter than nothing. */
  std::int64_t bad_inputs{0};
  /** Round trips in a row that contradict the offset. */
  int contradictions{0};
  /** s, own clock, of the last round trip that did not, and of the last. */
  double agreed_time{0};
  double last_time{0};
  double newest_time{0};  ///< When the newest of `samples` began to count, s.
  std::array<Sample, ClockOffsetParams::kMaxSamples> samples{};
  int size{0};  ///< Of `samples`: how many there are,
  int next{0};  ///< and where the next goes.
};

/** Estimates by how much a peer's clock is ahead, and the delay, from round
trips: a frame goes at t0 and comes at t1 by the peer's clock; its answer goes
at t2 by that clock and comes at t3.

    offset = ((t1 - t0) + (t2 - t3)) / 2    round trip = (t3 - t0) - (t2 - t1)

Both ways are taken to last as long, so the error of a round trip is half the
difference, and never more than half its length. The estimate is the mean of the
shortest of the newest round trips; the offset in use follows it no faster than
max_slew, so that ages do not jump.

A clock that jumps contradicts that bound: after kContradictions round trips in
a row that do, it is counted in `jumps`, and the estimate begins anew. Until it
is there, and while there are contradictions, IsTrusted() is false. */
class ClockOffset {
 public:
  static constexpr int kContradictions = 5;

  /** @throws std::invalid_argument for parameters out of range. */
  explicit ClockOffset(ClockOffsetParams params);

  const ClockOffsetParams& params() const { return params_; }

  ClockOffsetState MakeState() const { return {}; }

  /** Takes a round trip that ends now.
  @param time  t3, s, own clock.
  @param echo_time  t0, s, own clock.
  @param echo_age  t2 - t1, s, >= 0.
  @param peer_time  t2, s, peer's clock.
  No heap, no throw. */
  void Update(double time, double echo_time, double echo_age, double peer_time,
              ClockOffsetState* state) const noexcept;

  /** Whether ToLocal() can be relied on. */
  static bool IsTrusted(const ClockOffsetState& state) noexcept {
    return state.estimated && state.contradictions == 0;
  }

  /** A time of the peer's clock by the own one, s. */
  static double ToLocal(double peer_time,
                        const ClockOffsetState& state) noexcept {
    return peer_time - state.offset;
  }

 private:
  bool Contradicts(const ClockOffsetState::Sample& sample,
                   const ClockOffsetState& state) const noexcept;

  ClockOffsetParams params_;
};

}  // namespace dual_proxy
