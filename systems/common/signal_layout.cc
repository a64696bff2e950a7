// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/signal_layout.h"

#include <Eigen/Geometry>

namespace dual_proxy {

void SignalSink::Matrix(const SignalInfo& info, const Eigen::Matrix3d& value) {
  if (vector_) {
    for (int i = 0; i < 3; ++i) {
      vector_->segment<3>(size_ + 3 * i) = value.row(i).transpose();
    }
  }
  Advance(info, SignalKind::kMatrix, 9);
}

void SignalSink::Rotation(const SignalInfo& info, const Eigen::Matrix3d& R) {
  if (vector_) {
    const Eigen::Quaterniond q(R);
    vector_->segment<4>(size_) << q.w(), q.vec();
    if (q.w() < 0) vector_->segment<4>(size_) *= -1;
  }
  Advance(info, SignalKind::kQuaternion, 4);
}

void SignalSink::Describe(const SignalInfo& info, SignalKind kind, int size) {
  layout_->push_back({.name = info.name,
                      .start = size_,
                      .size = size,
                      .kind = kind,
                      .unit = info.unit,
                      .frame = info.frame,
                      .meaning = info.meaning});
}

int SizeOf(const std::vector<SignalSlice>& layout) {
  return layout.empty() ? 0 : layout.back().start + layout.back().size;
}

}  // namespace dual_proxy
