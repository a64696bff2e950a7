// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/validate.h"

#include <cmath>
#include <sstream>
#include <string>

#include <Eigen/LU>

namespace dual_proxy {
namespace {

template <typename Value>
[[noreturn]] void Throw(const char* who, const char* field,
                        const std::string& expected, const Value& got) {
  std::ostringstream problem;
  problem << "expected " << expected << ", got " << got;
  throw InvalidField(who, field, problem.str());
}

const Eigen::IOFormat& OneLine() {
  static const Eigen::IOFormat format(6, Eigen::DontAlignCols, ", ", ", ", "[",
                                      "]");
  return format;
}

}  // namespace

void ThrowUnlessInRange(const char* who, const char* field, double value,
                        double low, double high) {
  if (std::isfinite(value) && value >= low && value <= high) return;
  std::ostringstream expected;
  expected << "a number in [" << low << ", " << high << "]";
  Throw(who, field, expected.str(), value);
}

void ThrowUnlessAllInRange(const char* who, const char* field,
                           const Eigen::Ref<const Eigen::VectorXd>& values,
                           double low, double high) {
  for (int i = 0; i < values.size(); ++i) {
    std::string entry = field;
    entry.append("[").append(std::to_string(i)).append("]");
    ThrowUnlessInRange(who, entry.c_str(), values(i), low, high);
  }
}

void ThrowUnlessPositive(const char* who, const char* field, double value) {
  if (std::isfinite(value) && value > 0) return;
  Throw(who, field, "a finite value > 0", value);
}

void ThrowUnlessNonNegative(const char* who, const char* field, double value) {
  if (std::isfinite(value) && value >= 0) return;
  Throw(who, field, "a finite value >= 0", value);
}

void ThrowUnlessFinite(const char* who, const char* field,
                       const Eigen::Ref<const Eigen::VectorXd>& value) {
  if (value.allFinite()) return;
  Throw(who, field, "finite values", value.transpose().format(OneLine()));
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
  Throw(who, field, "a rotation matrix", value.format(OneLine()));
}

void ThrowInvalidField(const char* who, const char* field, const char* expected,
                       double got) {
  Throw(who, field, expected, got);
}

}  // namespace dual_proxy
