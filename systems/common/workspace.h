// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace dual_proxy {

/** An Eigen array in a state that is written in each step before it is read: a
copy has the room, not the content, as simulators copy states all the time. */
template <typename Array>
class Workspace {
 public:
  Workspace() = default;
  Workspace(const Workspace& other) { MakeRoom(other); }
  Workspace& operator=(const Workspace& other) {
    MakeRoom(other);
    return *this;
  }
  Workspace(Workspace&&) noexcept = default;
  Workspace& operator=(Workspace&&) noexcept = default;
  ~Workspace() = default;

  Array& operator*() { return array_; }
  const Array& operator*() const { return array_; }
  Array* operator->() { return &array_; }
  const Array* operator->() const { return &array_; }

 private:
  void MakeRoom(const Workspace& other) {
    const auto rows = other.array_.rows();
    const auto cols = other.array_.cols();
    if (array_.rows() != rows || array_.cols() != cols) {
      array_.setZero(rows, cols);
    }
  }

  Array array_;
};

}  // namespace dual_proxy
