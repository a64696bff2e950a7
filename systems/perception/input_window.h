// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** What a contact filter takes in one period. */
struct ContactInput {
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};     ///< F_s, N, in B.
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};  ///< m/s, in B.
  Eigen::Vector3d command{Eigen::Vector3d::Zero()};   ///< F_f, N, in B.
};

/** Inputs that have come in since the last window was full. */
struct InputWindowState {
  static constexpr int kMostInputs = 10;

  Eigen::Matrix<double, kMostInputs, 9> inputs =
      Eigen::Matrix<double, kMostInputs, 9>::Zero();
  int count{0};
};

/** Gathers the inputs of a filter that is fed more often than every 10 ms: from
one millisecond to the next sensors say little that is new, and a spike of two
milliseconds is no contact. A full window gives one input, of each component the
mean without the outermost quarters. */
class InputWindow {
 public:
  /** @param period  s, > 0, between inputs. */
  explicit InputWindow(double period);

  /** Inputs in a window, 1 to kMostInputs. */
  int size() const { return size_; }

  /** Takes an input; returns whether the window is full, and begins the next.
  @param[in,out] input  of the period; if the window is full, of the window. No
    heap, no throw. */
  bool Add(ContactInput* input, InputWindowState* state) const noexcept;

 private:
  int size_;
};

}  // namespace dual_proxy
