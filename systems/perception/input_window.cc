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
  const int outer = size_ / 4;
  Eigen::Matrix<double, 9, 1> means;
  for (int i = 0; i < means.size(); ++i) {
    double* const begin = state->inputs.col(i).data();
    std::sort(begin, begin + size_);
    means(i) = state->inputs.col(i).segment(outer, size_ - 2 * outer).mean();
  }
  input->force = means.head<3>();
  input->velocity = means.segment<3>(3);
  input->command = means.tail<3>();
  return true;
}

}  // namespace dual_proxy
