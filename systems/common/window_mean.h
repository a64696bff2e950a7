// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <type_traits>

#include <Eigen/Core>

#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/validate.h"

namespace dual_proxy {

/** Memory of WindowMean, and its result. */
template <int kSize>
struct WindowMeanState {
  /// Lets Drake tell the type's name by hash when it is in a Context.
  using NonTypeTemplateParameter = std::integral_constant<int, kSize>;
  using Vector = Eigen::Matrix<double, kSize, 1>;

  Vector sum{Vector::Zero()};   ///< Of the samples of this window.
  Vector mean{Vector::Zero()};  ///< Of the newest window that has a sample.
  std::int64_t samples{0};      ///< Samples in `sum`.
  std::int64_t window{-1};      ///< Index k of the window of the last sample.
  std::int64_t bad_inputs{0};   ///< Samples refused.
};

/** Mean of a vector's samples over the current window [k T, (k + 1) T): what a
slower process, one that runs every T, takes in place of a momentary value.

The mean starts anew with the first sample at or after each multiple of T (to
1e-9 of T, as 0.3 / 0.1 is below 3 in floating point). So a process that runs at
a multiple of T and looks at the mean as the cycle before has left it sees
exactly one full window. A window without a sample keeps the mean of the one
before; it is zero before the first sample. */
template <int kSize>
class WindowMean {
 public:
  using State = WindowMeanState<kSize>;
  using Vector = typename State::Vector;

  /** @param window T, s, > 0, at most kMaxTime.
  @throws std::invalid_argument if it is not. */
  explicit WindowMean(double window) : window_(window) {
    ThrowUnlessIn("WindowMean", "window", window, Between(Open(0), kMaxTime));
  }

  /** T, s. */
  double window() const { return window_; }

  State MakeState() const { return {}; }

  /** The k of the window [k T, (k + 1) T) that `time` is in, with the tolerance
  above; none if time is not finite, or beyond 2^53 windows. */
  std::optional<std::int64_t> FindWindow(double time) const noexcept {
    constexpr double kTolerance = 1e-9;
    constexpr double kMaxIndex = 9007199254740992.0;
    const double index = std::floor(time / window_ + kTolerance);
    if (!(std::abs(index) <= kMaxIndex)) return std::nullopt;
    return static_cast<std::int64_t>(index);
  }

  /** Takes a sample; the mean with it is in state->mean. A sample that is not
  finite, or whose time is not finite (or beyond 2^53 windows), is refused and
  counted, and nothing else changes. No heap, no throw.
  @param time s, not decreasing. */
  void Update(double time, const Vector& value, State* state) const noexcept {
    const std::optional<std::int64_t> window = FindWindow(time);
    if (!window || !value.allFinite()) {
      ++state->bad_inputs;
      return;
    }
    if (*window != state->window) {
      state->window = *window;
      state->samples = 0;
      state->sum.setZero();
    }
    state->sum += value;
    ++state->samples;
    state->mean = state->sum / static_cast<double>(state->samples);
  }

 private:
  double window_;
};

}  // namespace dual_proxy
