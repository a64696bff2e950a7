// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace dual_proxy {

/** One named signal in a flat vector of outputs. */
struct SignalSlice {
  std::string name;  ///< As in the log's table of signals.
  int start{0};      ///< Index of its first number.
  int size{0};       ///< 1, 3, 4 (quaternion w x y z), 7, 9 (row-major 3x3)...
};

/** Lists or writes signals, one after the other, so that names and values of a
flat vector come from one place. With a vector it writes (no heap), with a list
it names. */
class SignalSink {
 public:
  /** Writes values to `vector`. */
  explicit SignalSink(Eigen::Ref<Eigen::VectorXd>* vector) : vector_(vector) {}
  /** Appends names to `layout`. */
  explicit SignalSink(std::vector<SignalSlice>* layout) : layout_(layout) {}

  void Scalar(const char* name, double value);

  /** What was counted so far. */
  void Count(const char* name, std::int64_t value) {
    Scalar(name, static_cast<double>(value));
  }

  template <typename Derived>
  void Vector(const char* name, const Eigen::MatrixBase<Derived>& value) {
    constexpr int kSize = Derived::RowsAtCompileTime;
    static_assert(kSize > 0 && Derived::ColsAtCompileTime == 1);
    if (vector_) vector_->segment<kSize>(size_) = value;
    Advance(name, kSize);
  }

  /** A 3x3 matrix, row by row. */
  void Matrix(const char* name, const Eigen::Matrix3d& value);

  /** A rotation as a quaternion w, x, y, z with w >= 0. */
  void Rotation(const char* name, const Eigen::Matrix3d& R);

  /** Numbers listed or written so far. */
  int size() const { return size_; }

 private:
  void Advance(const char* name, int size);

  Eigen::Ref<Eigen::VectorXd>* vector_{nullptr};
  std::vector<SignalSlice>* layout_{nullptr};
  int size_{0};
};

/** Names and places of the signals that `visit` lists. */
template <typename Output>
std::vector<SignalSlice> MakeLayout(void (*visit)(const Output&, SignalSink*)) {
  std::vector<SignalSlice> layout;
  SignalSink sink(&layout);
  visit(Output{}, &sink);
  return layout;
}

}  // namespace dual_proxy
