// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

#include <Eigen/Core>

namespace dual_proxy {

/** @file
Checks of parameters. Each throws InvalidField with one line that names who
asked, the field, the allowed range and the value it got, e.g.
"CommunicationChannelParams: field `loss` expected a number in [0, 1], got 2".
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

/** A number as messages show it: six digits if they are all of it, else as many
as read back as the same number; what is a half or a whole of pi by name. */
std::string NumberText(double value);

/** One end of a range of numbers: part of it, or Open(), where it is not. */
struct Bound {
  // NOLINTNEXTLINE(google-explicit-constructor): a number is a closed bound.
  constexpr Bound(double value_in, bool open_in = false)
      : value(value_in), open(open_in) {}

  double value;
  bool open;
};

/** The end of a range that does not belong to it. */
constexpr Bound Open(double value) { return {value, true}; }

/** @throws std::invalid_argument unless value is finite and between the bounds,
which the message shows as in "[0, 1)". */
void ThrowUnlessInRange(const char* who, const char* field, double value,
                        Bound low, Bound high);

/** The same for every entry; the error names the first wrong one, `field[i]`.
 */
void ThrowUnlessAllInRange(const char* who, const char* field,
                           const Eigen::Ref<const Eigen::VectorXd>& values,
                           Bound low, Bound high);

/** @throws std::invalid_argument unless value is finite and > 0. */
void ThrowUnlessPositive(const char* who, const char* field, double value);

/** The same for every entry; the error names the first wrong one, `field[i]`.
 */
void ThrowUnlessAllPositive(const char* who, const char* field,
                            const Eigen::Ref<const Eigen::VectorXd>& values);

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
