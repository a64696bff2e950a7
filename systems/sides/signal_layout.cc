// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/signal_layout.h"

#include <Eigen/Geometry>

namespace dual_proxy {

void SignalSink::Scalar(const char* name, double value) {
  if (vector_) (*vector_)(size_) = value;
  Advance(name, 1);
}

void SignalSink::Matrix(const char* name, const Eigen::Matrix3d& value) {
  if (vector_) {
    for (int i = 0; i < 3; ++i) {
      vector_->segment<3>(size_ + 3 * i) = value.row(i).transpose();
    }
  }
  Advance(name, 9);
}

void SignalSink::Rotation(const char* name, const Eigen::Matrix3d& R) {
  if (vector_) {
    const Eigen::Quaterniond q(R);
    vector_->segment<4>(size_) << q.w(), q.vec();
    if (q.w() < 0) vector_->segment<4>(size_) *= -1;
  }
  Advance(name, 4);
}

void SignalSink::Advance(const char* name, int size) {
  if (layout_) layout_->push_back({name, size_, size});
  size_ += size;
}

}  // namespace dual_proxy
