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

#include "dual_proxy/common/validate_entries.h"

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

std::string NameOf(const Bound& bound) {
  return bound.name != nullptr ? bound.name : NumberText(bound.value);
}

std::string NameAndValueOf(const Bound& bound) {
  const std::string value = NumberText(bound.value);
  return bound.name != nullptr ? bound.name + (" = " + value) : value;
}

// `text` shows a bound; nothing for any finite number.
template <typename BoundText>
std::string Describe(const Range& range, const BoundText& text) {
  const auto& [low, high, rotation, or_zero] = range;
  if (rotation) return "a rotation matrix";
  if (std::isfinite(high.value)) {
    return std::string("in ") + (low.open ? "(" : "[") + text(low) + ", " +
           text(high) + (high.open ? ")" : "]");
  }
  if (std::isfinite(low.value)) return (low.open ? "> " : ">= ") + text(low);
  return "";
}

bool IsRotation(const Eigen::Ref<const Eigen::MatrixXd>& value) {
  constexpr double kTolerance = 1e-6;
  return value.allFinite() &&
         (value * value.transpose() - Eigen::Matrix3d::Identity())
                 .cwiseAbs()
                 .maxCoeff() <= kTolerance &&
         value.topLeftCorner<3, 3>().determinant() > 0;
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

std::string RangeText(const Range& range) {
  return (range.or_zero ? "0 or " : "") + Describe(range, NameOf);
}

void ThrowUnlessIn(const char* who, const char* field, double value,
                   const Range& range) {
  const auto& [low, high, rotation, or_zero] = range;
  if (or_zero && value == 0) return;
  const bool above = low.open ? value > low.value : value >= low.value;
  const bool below = high.open ? value < high.value : value <= high.value;
  if (std::isfinite(value) && above && below) return;
  const std::string text = Describe(range, NameAndValueOf);
  const char* const kind =
      std::isfinite(high.value) ? "a number " : "a finite value ";
  Throw(who, field,
        (or_zero ? "0 or " : "") +
            (text.empty() ? "a finite value" : kind + text),
        NumberText(value));
}

void ThrowUnlessIn(const char* who, const char* field,
                   const Eigen::Ref<const Eigen::MatrixXd>& values,
                   const Range& range) {
  const std::string text = RangeText(range);
  if (range.rotation) {
    if (!IsRotation(values)) Throw(who, field, text, Text(values));
  } else if (text.empty()) {
    if (!values.allFinite()) {
      Throw(who, field, "finite values", Text(values.reshaped().transpose()));
    }
  } else {
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      ThrowUnlessIn(who, EntryName(field, static_cast<std::size_t>(i)).c_str(),
                    values.reshaped()(i), range);
    }
  }
}

std::string EntryName(const std::string& name, std::size_t index) {
  return name + "[" + std::to_string(index) + "]";
}

void ThrowUnlessSpans(const char* who, const char* field,
                      const std::vector<Eigen::Vector2d>& spans) {
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const std::string entry = EntryName(field, i);
    ThrowUnlessIn(who, entry.c_str(), spans[i], AtLeast(0));
    ThrowUnlessIn(who, EntryName(entry, 1).c_str(), spans[i](1),
                  Above({spans[i](0), "its start"}));
  }
}

void ThrowInvalidField(const char* who, const char* field, const char* expected,
                       double got) {
  Throw(who, field, expected, NumberText(got));
}

}  // namespace dual_proxy
