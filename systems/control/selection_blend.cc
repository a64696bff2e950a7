// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/selection_blend.h"

#include <algorithm>

namespace dual_proxy {

using Eigen::Matrix3d;

void SelectionBlendParams::Validate() const {
  ValidateFields("SelectionBlendParams", *this);
}

SelectionBlend::SelectionBlend(SelectionBlendParams params) : params_(params) {
  params_.Validate();
}

const Matrix3d& SelectionBlend::Update(
    const Matrix3d& selection, SelectionBlendState* state) const noexcept {
  if (!state->initialized) {
    state->initialized = true;
    state->from = state->to = state->blended = selection;
    state->progress = 1;
    return state->blended;
  }
  if (selection != state->to) {
    state->from = state->blended;
    state->to = selection;
    state->progress = 0;
  }
  const double step = params_.blend_time > params_.period
                          ? params_.period / params_.blend_time
                          : 1.0;
  state->progress = std::min(1.0, state->progress + step);
  state->blended =
      state->progress == 1
          ? state->to
          : Matrix3d(state->from + state->progress * (state->to - state->from));
  return state->blended;
}

}  // namespace dual_proxy
