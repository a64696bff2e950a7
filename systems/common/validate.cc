// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/validate.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>

#include <Eigen/LU>

namespace dual_proxy {
namespace {

[[noreturn]] void Throw(const char* who, const char* field,
                        const std::string& expected, const std::string& got) {
  throw InvalidField(who, field, "expected " + expected + ", got " + got);
}

const Eigen::IOFormat& OneLine() {
  static const Eigen::IOFormat format(6, Eigen::DontAlignCols, ", ", ", ", "[",
                                      "]");
  return format;
}

template <typename Matrix>
std::string Text(const Matrix& matrix) {
  std::ostringstream text;
  text << matrix.format(OneLine());
  return text.str();
}

std::string EntryName(const char* field, Eigen::Index index) {
  return std::string(field) + "[" + std::to_string(index) + "]";
}

}  // namespace

std::string NumberText(double value) {
  constexpr double kPi = std::numbers::pi;
  for (const auto& [number, name] : {std::pair{kPi, "pi"},
                                     {-kPi, "-pi"},
                                     {kPi / 2, "pi/2"},
                                     {-kPi / 2, "-pi/2"}}) {
    if (value == number) return name;
  }
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  if (std::isfinite(value) && std::strtod(text.data(), nullptr) != value) {
    const auto end = std::to_chars(text.begin(), text.end(), value).ptr;
    return {text.begin(), end};
  }
  return text.data();
}

void ThrowUnlessInRange(const char* who, const char* field, double value,
                        Bound low, Bound high) {
  const bool above = low.open ? value > low.value : value >= low.value;
  const bool below = high.open ? value < high.value : value <= high.value;
  if (std::isfinite(value) && above && below) return;
  Throw(who, field,
        std::string("a number in ") + (low.open ? "(" : "[") +
            NumberText(low.value) + ", " + NumberText(high.value) +
            (high.open ? ")" : "]"),
        NumberText(value));
}

void ThrowUnlessAllInRange(const char* who, const char* field,
                           const Eigen::Ref<const Eigen::VectorXd>& values,
                           Bound low, Bound high) {
  for (int i = 0; i < values.size(); ++i) {
    ThrowUnlessInRange(who, EntryName(field, i).c_str(), values(i), low, high);
  }
}

void ThrowUnlessPositive(const char* who, const char* field, double value) {
  if (std::isfinite(value) && value > 0) return;
  Throw(who, field, "a finite value > 0", NumberText(value));
}

void ThrowUnlessAllPositive(const char* who, const char* field,
                            const Eigen::Ref<const Eigen::VectorXd>& values) {
  for (int i = 0; i < values.size(); ++i) {
    ThrowUnlessPositive(who, EntryName(field, i).c_str(), values(i));
  }
}

void ThrowUnlessNonNegative(const char* who, const char* field, double value) {
  if (std::isfinite(value) && value >= 0) return;
  Throw(who, field, "a finite value >= 0", NumberText(value));
}

void ThrowUnlessFinite(const char* who, const char* field,
                       const Eigen::Ref<const Eigen::VectorXd>& value) {
  if (value.allFinite()) return;
  Throw(who, field, "finite values", Text(value.transpose()));
}

void ThrowUnlessRotation(const char* who, const char* field,
                         const Eigen::Matrix3d& value) {
  constexpr double kTolerance = 1e-6;
  if (value.allFinite() &&
      (value * value.transpose() - Eigen::Matrix3d::Identity())
              .cwiseAbs()
              .maxCoeff() <= kTolerance &&
      value.determinant() > 0) {
    return;
  }
  Throw(who, field, "a rotation matrix", Text(value));
}

void ThrowInvalidField(const char* who, const char* field, const char* expected,
                       double got) {
  Throw(who, field, expected, NumberText(got));
}

}  // namespace dual_proxy
