// SPDX-License-Identifier: BSD-3-Clause
#include "from_python.h"

#include <cstddef>
#include <limits>
#include <string_view>

namespace dual_proxy {
namespace {

// What is in an array without dimensions; else the value itself.
py::object Scalar(const py::handle& value) {
  if (py::isinstance<py::array>(value) &&
      py::reinterpret_borrow<py::array>(value).ndim() == 0) {
    return value.attr("__getitem__")(py::tuple());
  }
  return py::reinterpret_borrow<py::object>(value);
}

bool IsBool(const py::handle& value) {
  return py::isinstance<py::bool_>(value) ||
         py::isinstance(value, py::module_::import("numpy").attr("bool_"));
}

bool IsA(const py::handle& value, const char* name) {
  return py::isinstance(value, py::module_::import("numbers").attr(name));
}

}  // namespace

void ThrowShape(const char* name, const std::string& expected,
                const py::handle& got) {
  throw py::value_error(std::string(name) + ": expected shape " + expected +
                        ", got " +
                        py::str(got.attr("shape")).cast<std::string>());
}

std::optional<double> AsNumber(const py::handle& value) {
  if (PyFloat_CheckExact(value.ptr())) return PyFloat_AS_DOUBLE(value.ptr());
  const py::object scalar = Scalar(value);
  if (!IsA(scalar, "Real") || IsBool(scalar)) return {};
  if (IsA(scalar, "Integral") && !AsInteger(scalar)) return {};
  const double number = PyFloat_AsDouble(scalar.ptr());
  if (PyErr_Occurred() == nullptr) return number;
  const bool too_large = PyErr_ExceptionMatches(PyExc_OverflowError) != 0;
  PyErr_Clear();
  if (!too_large) return {};
  return std::numeric_limits<double>::infinity();
}

std::optional<py::int_> AsInteger(const py::handle& value) {
  const py::object scalar = Scalar(value);
  if (!IsA(scalar, "Integral") || IsBool(scalar)) return {};
  // NumPy counts durations among the integers, but does not make them one.
  PyObject* const integer = PyNumber_Index(scalar.ptr());
  if (integer == nullptr) {
    PyErr_Clear();
    return {};
  }
  return py::reinterpret_steal<py::int_>(integer);
}

std::optional<bool> AsBool(const py::handle& value) {
  const py::object scalar = Scalar(value);
  if (!IsBool(scalar)) return {};
  return PyObject_IsTrue(scalar.ptr()) == 1;
}

std::string Show(const py::handle& value) {
  constexpr int kMost = 200;
  const py::object words = py::repr(value).attr("split")();
  const py::str line = py::str(" ").attr("join")(words);
  const py::object start = line[py::slice(0, kMost, 1)];
  return start.cast<std::string>() + (py::len(line) > kMost ? "..." : "");
}

std::optional<std::string> AsText(const py::handle& value) {
  if (!py::isinstance<py::str>(value)) return {};
  Py_ssize_t size = 0;
  const char* const text = PyUnicode_AsUTF8AndSize(value.ptr(), &size);
  if (text == nullptr) {
    PyErr_Clear();
    return {};
  }
  return std::string(text, static_cast<std::size_t>(size));
}

std::string FixedShape(int rows, int cols) {
  return "(" + std::to_string(rows) + "," +
         (cols == 1 ? "" : " " + std::to_string(cols)) + ")";
}

py::array_t<double, py::array::forcecast> AsArray(const py::handle& value,
                                                  const char* name,
                                                  const std::string& expected) {
  // Numbers, or objects that may be: no bools, no strings, nothing complex.
  const auto given = py::array::ensure(value);
  auto array = py::array_t<double, py::array::forcecast>();
  bool is_numbers = given && std::string_view("iufO").find(
                                 given.dtype().kind()) != std::string::npos;
  if (is_numbers) {
    array = py::array_t<double, py::array::forcecast>::ensure(given);
    is_numbers = static_cast<bool>(array);
  }
  if (!is_numbers) {
    PyErr_Clear();
    throw py::value_error(std::string(name) + ": expected numbers of shape " +
                          expected + ", got " + Show(value));
  }
  return array;
}

}  // namespace dual_proxy
