// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/input_window.h"

#include <algorithm>

namespace dual_proxy {
namespace {

constexpr double kWindow = 0.01;  // s

}  // namespace

InputWindow::InputWindow(double period)
    : size_(
          static_cast<int>(std::clamp(kWindow / period + 1e-6, 1.0,
                                      double{InputWindowState::kMostInputs}))) {
}

bool InputWindow::Add(ContactInput* input,
                      InputWindowState* state) const noexcept {
  if (size_ == 1) return true;
  state->inputs.row(state->count++) << input->force.transpose(),
      input->velocity.transpose(), input->command.transpose();
  if (state->count < size_) return false;
  state->count = 0;
  // All components are sorted at once, by exchanging neighbours.
  using Inputs = Eigen::Array<double, 9, InputWindowState::kMostInputs>;
  Inputs sorted = state->inputs.transpose();
  for (int round = 0; round < size_; ++round) {
    for (int i = round % 2; i + 1 < size_; i += 2) {
      const Eigen::Array<double, 9, 1> lower =
          sorted.col(i).min(sorted.col(i + 1));
      sorted.col(i + 1) = sorted.col(i).max(sorted.col(i + 1));
      sorted.col(i) = lower;
    }
  }
  const int outer = size_ / 4;
  const Eigen::Matrix<double, 9, 1> means =
      sorted.middleCols(outer, size_ - 2 * outer).rowwise().mean();
  input->force = means.head<3>();
  input->velocity = means.segment<3>(3);
  input->command = means.tail<3>();
  return true;
}

}  // namespace dual_proxy
