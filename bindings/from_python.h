// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"

/** @file
Numbers, arrays and enums of Python and NumPy, checked with an error of one line
that names the argument or the field. */

namespace dual_proxy {

namespace py = pybind11;

/** "name: expected float64 of shape (3,), got shape (2,)" as ValueError. */
[[noreturn]] void ThrowShape(const char* name, const std::string& expected,
                             const py::handle& got);

/** An array of doubles made from any Python value, or a ValueError that names
it. */
py::array_t<double, py::array::forcecast> AsArray(const py::handle& value,
                                                  const char* name,
                                                  const std::string& expected);

/** A number of Python or NumPy, also as an array without dimensions; infinite
if beyond what a double holds. No bool is one, though Python's True is the
integer 1. */
std::optional<double> AsNumber(const py::handle& value);

/** Likewise, an integer: Python's int. */
std::optional<py::int_> AsInteger(const py::handle& value);

/** A bool of Python or NumPy, also as an array without dimensions. */
std::optional<bool> AsBool(const py::handle& value);
/** As Python shows a value, on one line and in at most 200 characters. */
std::string Show(const py::handle& value);
/** A string that can be written as UTF-8; half of a surrogate pair cannot. */
std::optional<std::string> AsText(const py::handle& value);

/** "(3,)" or "(3, 3)". */
std::string FixedShape(int rows, int cols);

/** Fixed-size vector or matrix from an array-like of exactly that shape.
@throws ValueError naming `name`, the expected and the received shape. */
template <typename Matrix>
Matrix AsFixed(const py::handle& value, const char* name) {
  constexpr int kRows = Matrix::RowsAtCompileTime;
  constexpr int kCols = Matrix::ColsAtCompileTime;
  static_assert(kRows != Eigen::Dynamic && kCols != Eigen::Dynamic);
  constexpr int kDims = kCols == 1 ? 1 : 2;
  using Array = py::array_t<double, py::array::forcecast>;
  // What a control loop passes is an array of doubles already.
  const Array array = py::isinstance<py::array_t<double>>(value)
                          ? py::reinterpret_borrow<Array>(value)
                          : AsArray(value, name, FixedShape(kRows, kCols));
  if (array.ndim() != kDims || array.shape(0) != kRows ||
      (kDims == 2 && array.shape(1) != kCols)) {
    ThrowShape(name, FixedShape(kRows, kCols), array);
  }
  Matrix result;
  if constexpr (kDims == 1) {
    const auto view = array.template unchecked<1>();
    for (int i = 0; i < kRows; ++i) result(i) = view(i);
  } else {
    const auto view = array.template unchecked<2>();
    for (int i = 0; i < kRows; ++i) {
      for (int j = 0; j < kCols; ++j) result(i, j) = view(i, j);
    }
  }
  return result;
}

inline Eigen::Vector3d Vec3(const py::handle& value, const char* name) {
  return AsFixed<Eigen::Vector3d>(value, name);
}

inline Eigen::Matrix3d Mat3(const py::handle& value, const char* name) {
  return AsFixed<Eigen::Matrix3d>(value, name);
}

/** Normals of contacts as columns; None: there are none. */
inline Eigen::Matrix3d NormalsOrNone(const py::handle& value) {
  if (value.is_none()) return Eigen::Matrix3d::Zero();
  return Mat3(value, "contact_normals");
}

/** An enum's value by its name in Python (EnumStrings).
@throws ValueError that names the field and lists what is allowed. */
template <typename Enum>
Enum EnumFromPython(const py::handle& value, const char* name) {
  if (const auto text = AsText(value)) {
    const auto found = EnumFromString<Enum>(*text);
    if (found) return *found;
  }
  throw py::value_error("field `" + std::string(name) + "` expected " +
                        ExpectedEnum<Enum>() + ", got " + Show(value));
}

/** The names of an enum's values, in order. */
template <typename Enum>
py::tuple EnumNames() {
  py::list names;
  for (const auto& [value, name] : EnumStrings<Enum>::kValues) {
    names.append(name);
  }
  return py::tuple(names);
}

template <typename T>
inline constexpr bool kIsVector = false;
template <typename T>
inline constexpr bool kIsVector<std::vector<T>> = true;

template <typename T>
inline constexpr bool kIsMatrix = std::is_base_of_v<Eigen::MatrixBase<T>, T>;

template <typename T>
inline constexpr bool kIsOptionalMatrix = false;
template <typename T>
inline constexpr bool kIsOptionalMatrix<std::optional<T>> = kIsMatrix<T>;

/** Throws an error that says "`name` expected ..., got ...".
@param kind  of what has the name, with a space after it, or nothing. */
template <typename Error>
[[noreturn]] void ThrowExpected(const char* kind, const char* name,
                                const std::string& expected,
                                const py::handle& value) {
  throw Error(kind + ("`" + std::string(name)) + "` expected " + expected +
              ", got " + Show(value));
}

/** A field's value from Python: a number, a string, an enum's name, an array of
the exact shape, None for an optional one, nested Params, or a list of them.
@param kind  as of ThrowExpected().
@throws TypeError or ValueError naming the field. */
template <typename T>
T FieldFromPython(const py::handle& value, const char* name,
                  const char* kind = "field ") {
  if constexpr (std::is_enum_v<T>) {
    return EnumFromPython<T>(value, name);
  } else if constexpr (kIsMatrix<T>) {
    return AsFixed<T>(value, name);
  } else if constexpr (kIsOptional<T>) {
    if (value.is_none()) return std::nullopt;
    return FieldFromPython<typename T::value_type>(value, name, kind);
  } else if constexpr (kIsVector<T>) {
    if (!py::isinstance<py::list>(value) && !py::isinstance<py::tuple>(value)) {
      ThrowExpected<py::type_error>(kind, name, "a list", value);
    }
    T items;
    for (const py::handle& item : value) {
      items.push_back(
          FieldFromPython<typename T::value_type>(item, name, kind));
    }
    return items;
  } else {
    std::string expected;
    if constexpr (std::is_same_v<T, bool>) {
      if (const auto found = AsBool(value)) return *found;
      expected = "true or false";
    } else if constexpr (std::is_integral_v<T>) {
      expected = "an integer";
      if (const auto found = AsInteger(value)) {
        try {
          return found->cast<T>();
        } catch (const py::cast_error&) {
          using Limits = std::numeric_limits<T>;
          ThrowExpected<py::value_error>(
              kind, name,
              "an integer in [" + std::to_string(Limits::min()) + ", " +
                  std::to_string(Limits::max()) + "]",
              value);
        }
      }
    } else if constexpr (std::is_floating_point_v<T>) {
      if (const auto found = AsNumber(value)) return *found;
      expected = "a number";
    } else if constexpr (std::is_same_v<T, std::string>) {
      if (const auto text = AsText(value)) return *text;
      expected = "a string";
    } else if constexpr (std::is_same_v<T, py::bytes>) {
      if (py::isinstance<T>(value)) return py::reinterpret_borrow<T>(value);
      expected = "bytes";
    } else {
      if (py::isinstance<T>(value)) return value.cast<T>();
      expected =
          py::type::of<T>().attr("__name__").template cast<std::string>();
    }
    ThrowExpected<py::type_error>(kind, name, expected, value);
  }
}

}  // namespace dual_proxy
