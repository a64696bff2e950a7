// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

#include <Eigen/Core>

namespace dual_proxy {

/** @file
Checks of parameters. Each throws InvalidField with one line that names who
asked, the field, the allowed range and the value it got, e.g.
"WorkspaceMapParams: field `scale` expected a number in [1e-06, inf], got 0".
They are for construction and loading, never for a control cycle. */

/** "Who: field `x` expected a finite value > 0, got -1", with its parts for
those who know a better name than Who. */
class InvalidField : public std::invalid_argument {
 public:
  /** @param problem "expected ..., got ...". */
  InvalidField(const std::string& who, const std::string& field,
               const std::string& problem)
      : std::invalid_argument(who + ": field `" + field + "` " + problem),
        field_(field),
        problem_(problem) {}

  const std::string& field() const { return field_; }
  const std::string& problem() const { return problem_; }

 private:
  std::string field_;
  std::string problem_;
};

/** @throws std::invalid_argument unless low <= value <= high and value is
finite. */
void ThrowUnlessInRange(const char* who, const char* field, double value,
                        double low, double high);

/** The same for every entry; the error names the first wrong one, `field[i]`.
 */
void ThrowUnlessAllInRange(const char* who, const char* field,
                           const Eigen::Ref<const Eigen::VectorXd>& values,
                           double low, double high);

/** @throws std::invalid_argument unless value is finite and > 0. */
void ThrowUnlessPositive(const char* who, const char* field, double value);

/** @throws std::invalid_argument unless value is finite and >= 0. */
void ThrowUnlessNonNegative(const char* who, const char* field, double value);

/** @throws std::invalid_argument unless every entry is finite. */
void ThrowUnlessFinite(const char* who, const char* field,
                       const Eigen::Ref<const Eigen::VectorXd>& value);

/** @throws std::invalid_argument unless value is a rotation matrix: finite,
orthonormal to 1e-6, determinant +1. */
void ThrowUnlessRotation(const char* who, const char* field,
                         const Eigen::Matrix3d& value);

/** Throws the error of this file's form for any other condition. `expected`
completes "expected ...", `got` is what was given. */
[[noreturn]] void ThrowInvalidField(const char* who, const char* field,
                                    const char* expected, double got);

}  // namespace dual_proxy
