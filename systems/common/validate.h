// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
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
  constexpr Bound(double value_in, const char* name_in = nullptr)
      : value(value_in), name(name_in) {}

  double value;
  const char* name;  ///< What the value is, if it is not the same for all.
  bool open{false};
};

/** The end of a range that does not belong to it. */
constexpr Bound Open(Bound bound) {
  bound.open = true;
  return bound;
}

/** What a number, or every entry of an array, may be; always finite. */
struct Range {
  Bound low{-std::numeric_limits<double>::infinity()};
  Bound high{std::numeric_limits<double>::infinity()};
  bool rotation{false};  ///< A rotation matrix, in place of bounds.
  bool or_zero{false};   ///< Zero is in it, too.
};

constexpr Range Finite() { return {}; }
constexpr Range AtLeast(Bound low) { return {.low = low}; }
constexpr Range Above(Bound low) { return {.low = Open(low)}; }
constexpr Range Between(Bound low, Bound high) {
  return {.low = low, .high = high};
}
/** Zero, or in the range: for what can be left out. */
constexpr Range OrZero(Range range) {
  range.or_zero = true;
  return range;
}
/** Orthonormal to 1e-6, determinant +1. */
constexpr Range Rotation() { return {.rotation = true}; }

/** As documentation shows it: ">= 0", "in (0, max_energy]", "0 or >= 1",
"a rotation matrix"; nothing for any finite number. */
std::string RangeText(const Range& range);

/** @throws std::invalid_argument unless value is in the range. */
void ThrowUnlessIn(const char* who, const char* field, double value,
                   const Range& range);

/** The same for every entry; where a bound is what is wrong, the error names
the entry, `field[i]`. */
void ThrowUnlessIn(const char* who, const char* field,
                   const Eigen::Ref<const Eigen::MatrixXd>& values,
                   const Range& range);

/** Throws the error of this file's form for any other condition. `expected`
completes "expected ...", `got` is what was given. */
[[noreturn]] void ThrowInvalidField(const char* who, const char* field,
                                    const char* expected, double got);

}  // namespace dual_proxy
