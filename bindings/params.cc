// SPDX-License-Identifier: BSD-3-Clause
#include "params.h"

#include <functional>
#include <limits>
#include <map>

namespace dual_proxy {
namespace {

// Read-only blocks of memory, begin -> end; one that Python no longer owns is
// not among them. Whoever gets here holds the interpreter's lock.
using Blocks = std::map<const void*, const void*, std::less<>>;

Blocks& ReadOnlyBlocks() {
  static auto& blocks = *new Blocks();  // Python may outlive what is static.
  return blocks;
}

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

py::dict FieldNames(const py::object& self) {
  return py::type::of(self).attr("fields");
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

void MarkReadOnly(const void* begin, std::size_t size) {
  ReadOnlyBlocks()[begin] = static_cast<const std::byte*>(begin) + size;
}

void ForgetReadOnly(const void* begin) { ReadOnlyBlocks().erase(begin); }

void CheckWritable(const void* params, const py::handle& type,
                   const char* field) {
  const auto after = ReadOnlyBlocks().upper_bound(params);
  if (after == ReadOnlyBlocks().begin()) return;
  if (!std::less<>()(params, std::prev(after)->second)) return;
  throw py::attribute_error(
      type.attr("__name__").cast<std::string>() + ": field `" + field +
      "` cannot be set, this is a copy of what is in use: change a copy.copy() "
      "of it and assign that, in a list the whole list");
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

void SetFields(const py::object& self, const py::dict& values) {
  const py::dict names = FieldNames(self);
  for (const auto& [key, value] : values) {
    if (!names.contains(key)) {
      throw py::type_error(
          py::type::of(self).attr("__name__").cast<std::string>() +
          ": unknown field `" + key.cast<std::string>() +
          "`, expected one of " +
          py::str(", ").attr("join")(names).cast<std::string>());
    }
    py::setattr(self, key, value);
  }
}

std::string FieldsRepr(const py::object& self) {
  std::string text =
      py::type::of(self).attr("__name__").cast<std::string>() + "(";
  bool first = true;
  for (const auto& [name, doc] : FieldNames(self)) {
    py::object value = py::getattr(self, name);
    if (py::isinstance<py::array>(value)) value = value.attr("tolist")();
    text += (first ? "" : ", ") + name.cast<std::string>() + "=" +
            py::repr(value).cast<std::string>();
    first = false;
  }
  return text + ")";
}

py::dict FieldsDict(const py::object& self) {
  py::dict values;
  const py::object deepcopy = py::module_::import("copy").attr("deepcopy");
  for (const auto& [name, doc] : FieldNames(self)) {
    values[name] = deepcopy(py::getattr(self, name));
  }
  return values;
}

namespace {

// Arrays as lists, which compare as a whole.
py::object WithoutArrays(const py::object& value) {
  if (py::isinstance<py::array>(value)) return value.attr("tolist")();
  if (!py::isinstance<py::tuple>(value)) return value;
  py::list items;
  for (const py::handle item : value) {
    items.append(WithoutArrays(py::reinterpret_borrow<py::object>(item)));
  }
  return items;
}

}  // namespace

bool FieldsEqual(const py::object& self, const py::object& other) {
  if (!py::type::of(self).is(py::type::of(other))) return false;
  for (const auto& [name, doc] : FieldNames(self)) {
    const py::object mine = py::getattr(self, name);
    const py::object theirs = py::getattr(other, name);
    if (!WithoutArrays(mine).equal(WithoutArrays(theirs))) return false;
  }
  return true;
}

}  // namespace dual_proxy
