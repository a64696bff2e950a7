// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace dual_proxy {

/** How the numbers of a signal are arranged. */
enum class SignalKind {
  kScalar,
  kInteger,     ///< A scalar that is a whole number.
  kCounter,     ///< What should not happen, counted from 0 at the start.
  kVector,      ///< x, y, z.
  kQuaternion,  ///< w, x, y, z, w >= 0.
  kMatrix,      ///< 3x3, row by row.
  kJoints,      ///< One number per joint.
};

/** What a signal is; told once, beside the code that writes it. */
struct SignalInfo {
  const char* name;
  const char* unit;   ///< Empty if it has none.
  const char* frame;  ///< B robot base, D device base; empty if none applies.
  const char* meaning;
};

/** One signal in a flat vector. */
struct SignalSlice {
  std::string name;
  int start{0};  ///< Index of its first number.
  int size{0};
  SignalKind kind{SignalKind::kScalar};
  std::string unit{};
  std::string frame{};
  std::string meaning{};
};

/** Lists or writes signals, one after the other, so that what a flat vector
holds and what it means come from one place. With a vector it writes (no heap),
with a list it describes. */
class SignalSink {
 public:
  /** Writes values to `vector`. */
  explicit SignalSink(Eigen::Ref<Eigen::VectorXd>* vector) : vector_(vector) {}
  /** Appends descriptions to `layout`. */
  explicit SignalSink(std::vector<SignalSlice>* layout) : layout_(layout) {}

  void Scalar(const SignalInfo& info, double value) {
    Add(info, SignalKind::kScalar, value);
  }

  void Integer(const SignalInfo& info, double value) {
    Add(info, SignalKind::kInteger, value);
  }

  /** What was counted so far, of what should not happen. */
  void Count(const char* name, const char* meaning, std::int64_t value) {
    Add({name, "", "", meaning}, SignalKind::kCounter,
        static_cast<double>(value));
  }

  void Vector(const SignalInfo& info, const Eigen::Vector3d& value) {
    if (vector_) vector_->segment<3>(size_) = value;
    Advance(info, SignalKind::kVector, 3);
  }

  /** A number per joint. */
  template <typename Derived>
  void Joints(const SignalInfo& info, const Eigen::MatrixBase<Derived>& value) {
    constexpr int kSize = Derived::RowsAtCompileTime;
    static_assert(kSize > 0 && Derived::ColsAtCompileTime == 1);
    if (vector_) vector_->segment<kSize>(size_) = value;
    Advance(info, SignalKind::kJoints, kSize);
  }

  /** A 3x3 matrix, row by row. */
  void Matrix(const SignalInfo& info, const Eigen::Matrix3d& value);

  /** A rotation as a quaternion w, x, y, z with w >= 0. */
  void Rotation(const SignalInfo& info, const Eigen::Matrix3d& R);

  /** Numbers listed or written so far. */
  int size() const { return size_; }

 private:
  void Add(const SignalInfo& info, SignalKind kind, double value) {
    if (vector_) (*vector_)(size_) = value;
    Advance(info, kind, 1);
  }

  void Advance(const SignalInfo& info, SignalKind kind, int size) {
    if (layout_) Describe(info, kind, size);
    size_ += size;
  }

  void Describe(const SignalInfo& info, SignalKind kind, int size);

  Eigen::Ref<Eigen::VectorXd>* vector_{nullptr};
  std::vector<SignalSlice>* layout_{nullptr};
  int size_{0};
};

/** What `visit(arguments..., &sink)` lists. */
template <typename Visit, typename... Arguments>
std::vector<SignalSlice> MakeLayout(const Visit& visit,
                                    const Arguments&... arguments) {
  std::vector<SignalSlice> layout;
  SignalSink sink(&layout);
  visit(arguments..., &sink);
  return layout;
}

/** The numbers that a layout takes. */
int SizeOf(const std::vector<SignalSlice>& layout);

}  // namespace dual_proxy
